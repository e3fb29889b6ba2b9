"""Files of Blender on the command line: what is read of their objects, and what is written to them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...command.clouds import Kind, positions
from ...command.colors import COLOR
from ...command.settings import LAPLACIAN, add_setting
from ...core import PointCloudError
from ...core.files import SCANNER, PointTable
from ...core.files.table import NORMAL as FILE_NORMAL
from ...core.linalg import inv
from ...tools.quantities import APPLICATIONS, MEAN_CURVATURE, NORMAL, ORIENTATION, RESULTS
from ..objects.attributes import (
    check_size,
    own_positions,
    remove_attributes,
    tag_changed,
    write_own_positions,
)
from ..objects.colors import own_colors
from ..objects.curves import add_curves, plot, read_curve
from ..objects.deleting import check_deletable, keep_points
from ..objects.groups import add_group, group_weights
from ..objects.handlers import notify
from ..objects.notices import renew
from ..objects.place import activate, check_movable, hide, move_object, offset_of, place_of
from ..objects.planes import object_of, plane_of
from ..objects.positions import check_movable as check_points_movable
from ..objects.reading import TYPES, Reading, checked_matrix, local_values, obstacle, reading_notices, sharing_objects
from ..objects.result import check_writable, note_stages, write_numbers, write_result, write_values
from ..objects.splats import has_splats, write_splats
from ..tools.analyze import Analysis
from ..tools.mesh import close_holes
from .arguments import as_setting
from .columns import column_notices
from .objects import add_column, add_object, faces_of, faces_to, group_of, point_table
from .splats import add_splats, placed_splats, with_results

ENDING = ".blend"
_READ = ("use_modifiers", "make_single_user")  # settings of an object that have options, beside those of the Laplacian


class _Groups(Mapping):
    """Weights of the vertex groups of a mesh by name, (n,), NaN outside, read when first asked for."""

    def __init__(self, obj):
        self._obj, self._names, self._known = obj, [group.name for group in obj.vertex_groups], {}

    def __getitem__(self, name):
        if name not in self._known:
            if name not in self._names:
                raise KeyError(name)
            self._known[name] = group_weights(self._obj, name, np.nan)
        return self._known[name]

    def __iter__(self):
        return iter(self._names)

    def __len__(self):
        return len(self._names)


@dataclass(frozen=True)
class Owner:
    """An object of the open file whose points a command line works on; see `Kind` of command/clouds.py."""

    obj: bpy.types.Object
    before: Any  # points or splats as they were read
    settings: dict
    groups: Mapping
    kept: Any = None  # (n,) bool, the points that stay, if some do not
    motion: Any = None  # (4, 4) in the coordinates of the file, where the whole object moves

    def taken(self, kept):
        """Return the owner of some of the points, (n,) bool."""
        return replace(self, kept=kept)

    def moved(self, matrix):
        """Return the owner of the points after a motion, (4, 4)."""
        return replace(self, motion=matrix)

    def write(self, given, results, numbers) -> list:
        """Write points or splats with results at the points, and numbers that are not at these, to the object."""
        obj = self.obj
        stays = self.kept is None and self.motion is None
        moves = stays and not np.array_equal(positions(given), positions(self.before))
        changed = self._changed(given) if stays else {}
        self._check([*results, *changed], moves)
        if sharing_objects(obj):  # make_single_user is on, as checked
            obj.data = obj.data.copy()
        if self.kept is not None and not self.kept.all():
            keep_points(bpy.context, obj, self.kept)
        elif self.motion is not None:
            move_object(obj, Matrix(_shifted(self.motion, offset_of(obj)) @ np.array(obj.matrix_world)))
            bpy.context.view_layer.update()
        elif moves:
            self._move(given)
        self._write_columns(changed)
        if isinstance(given, PointTable) and stays and given.colors is not self.before.colors:
            _write_colors(obj.data, given.colors)
        self._write_results(results)
        write_numbers(obj, numbers)
        tag_changed(obj.data)
        shown = [NORMAL] if ORIENTATION in results else [] if _is_analysis(results) else results
        self._show([*changed, *shown, *APPLICATIONS, MEAN_CURVATURE])
        return []

    def _changed(self, given) -> dict:
        """Return the columns of points, by name, that are not those that were read."""
        if not isinstance(given, PointTable):
            return {}
        known = self.before.attributes
        return {name: values for name, values in given.attributes.items() if known.get(name) is not values}

    def _check(self, names, moves):
        """Refuse an object that cannot be written to, before anything is."""
        obj = self.obj
        check_writable(obj, names, obj.meshfree.make_single_user)
        if moves:
            check_points_movable(obj, "IN_PLACE")
        if self.kept is not None:
            check_deletable(obj)
        if self.motion is not None:
            check_movable(obj)

    def _local(self, vectors):
        return vectors @ inv(_linear(self.obj)).T

    def _move(self, given):
        """Move the points, or the splats with their ellipsoids."""
        data, moved = self.obj.data, self._local(positions(given) - positions(self.before))
        check_size("position", moved)
        if has_splats(data):
            maps = np.broadcast_to(inv(_linear(self.obj)), (len(moved), 3, 3))
            write_splats(data, given.deformed(own_positions(data) + moved, maps))
            return
        write_own_positions(data, own_positions(data) + moved)

    def _write_columns(self, columns):
        """Write columns by name, in place of those that the object has."""
        for name, values in columns.items():
            remove_attributes(self.obj.data, name)
            add_column(self.obj.data, name, self._local_values(name, values))

    def _local_values(self, name, vectors):
        """Return vectors, (n, 3), in the space of the object, of the kind that their name says; others as they are."""
        reading = Reading(None, _linear(self.obj))
        if name == SCANNER and vectors.ndim == 2:
            return reading.local(vectors - place_of(self.obj))
        return local_values(reading, NORMAL if name == FILE_NORMAL else name, vectors)

    def _write_results(self, results):
        """Write results, of which those of an analysis count as one of the object."""
        obj = self.obj
        local = {name: self._local_values(name, values) for name, values in results.items()}
        if _is_analysis(results):
            measures = {name: results[name] for name in RESULTS}
            found = Analysis(None, measures, local[NORMAL], None, 0, {}, [])
            write_result(obj, found, 0, oriented=ORIENTATION in results)
        known = {*RESULTS, ORIENTATION} if _is_analysis(results) else ()
        write_values(obj.data, {name: values for name, values in local.items() if name not in known})

    def _show(self, names):
        """Show the first of some attributes that is there, or else the colors of the points."""
        obj = self.obj
        activate(bpy.context, obj)
        there = [name for name in names if name in obj.data.attributes]
        if there:
            notify("result_written", obj, there[0])
        elif own_colors(obj.data):
            notify("colors_found", [obj])

    def add_mesh(self, table, faces):
        """Add an object of a mesh, vertices and arrays of faces (m, k), and hide the points."""
        obj, weights = self.obj, {name: table.attributes.pop(name) for name in self.groups if name in table.attributes}
        made = add_object(f"{obj.name} Surface", table, obj.users_collection[0], offset_of(obj))
        faces_to(made.data, faces)
        for name, values in weights.items():
            add_group(made, name, values)
        notify("mesh_made", obj, made)
        activate(bpy.context, made)
        hide(obj)

    def add_curves(self, lines):
        """Add an object of curves, each of corners in the coordinates of the file, and whether it is closed."""
        place = place_of(self.obj)
        local = [(self._local(corners - place), closed) for corners, closed in lines]
        add_curves(self.obj, f"{self.obj.name} Section", local)

    def add_profile(self, across, values, table):
        """Add an object that draws values, (k,), and their table as a text."""
        made = plot(self.obj, f"{self.obj.name} Profile", across, values)
        self.obj.meshfree.profile = text = bpy.data.texts.new(f"{made.name}.csv")
        text.from_string(table)

    def save(self, path, operator, notices, seconds):
        """Write the open file, in which the object keeps the notices of an operator, of an analysis also its times."""
        known = hasattr(bpy.types, f"MESHFREE_OT_{operator}")
        title = getattr(bpy.ops.meshfree, operator).get_rna_type().name if known else operator.title()
        renew(self.obj, title, notices)
        if operator == "analyze":
            note_stages(self.obj, seconds)
        path.parent.mkdir(parents=True, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()))

    def place(self, name):
        """Return where another object is, (3,)."""
        found = object_of(bpy.context.scene, name, "from which the points were seen")
        return np.array(found.matrix_world.translation, dtype=np.float64) + offset_of(self.obj)

    def plane(self, name):
        """Return a point and the normal of the local XY plane of another object, (3,) both."""
        place, normal = plane_of(bpy.context.scene, name, self.obj)
        return place + place_of(self.obj), normal

    def curve(self, name):
        """Return the points of a curve object, (k, 3), and whether it is closed."""
        places, closed = read_curve(bpy.context, name)
        return places + offset_of(self.obj), closed


def _is_analysis(results) -> bool:
    return results.keys() >= {*RESULTS}


def _linear(obj):
    return np.array(obj.matrix_world, dtype=np.float64)[:3, :3]


def _shifted(matrix, offset):
    """Return a motion, (4, 4), of points less an offset."""
    result = matrix.copy()
    result[:3, 3] += matrix[:3, :3] @ offset - offset
    return result


def _write_colors(data, colors):
    """Write colors of points, (n, 4) from 0 to 1, in place of their own."""
    name = own_colors(data)
    layer = data.attributes[name] if name else data.attributes.new(COLOR, "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", colors.astype(np.float32).reshape(-1))


def add_options(parser):
    """Add the options for what is read of an object."""
    parser.add_argument("--object", default="", metavar="NAME", help="object of a .blend file; else the active one")
    settings = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
    for name in _READ:
        add_setting(parser, as_setting(settings[name]))


def read(path, name, option, arguments):
    """Open a file, and return the points or splats of one of its objects, as `Kind` says.

    If the file or the object is missing, or has no points, `PointCloudError` is raised.
    """
    if not path.is_file():
        raise PointCloudError(f"There is no file {path}. Check its name and folder.")
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
    obj = _choose_object(path, name, option)
    reason = obstacle(obj)
    if reason:
        raise PointCloudError(reason)
    _set(obj, arguments)
    checked_matrix(obj)
    given = with_results(placed_splats(obj), obj.data) if has_splats(obj.data) else _table(obj)
    return _owned(obj, replace(given, notices=[*given.notices, *reading_notices(obj)]))


def own(name, given, arguments):
    """Make the points or splats of another file an object of an empty one, and return them, as `Kind` says."""
    bpy.ops.wm.read_homefile(use_empty=True)
    add = add_object if isinstance(given, PointTable) else add_splats
    obj = add(name, given, bpy.context.scene.collection)
    activate(bpy.context, obj)
    bpy.context.view_layer.update()
    reason = obstacle(obj)
    if reason:
        raise PointCloudError(reason)
    _set(obj, arguments)
    told = column_notices(obj, getattr(given, "attributes", {}))
    return _owned(obj, replace(given, notices=[*given.notices, *told]))


def close(vertices, faces):
    """Close the openings of a mesh, as `Kind` says."""
    mesh = bpy.data.meshes.new("Surface")
    try:
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.astype(np.float32).reshape(-1))
        faces_to(mesh, faces)
        opened = close_holes(mesh, 0)
        return faces_of(mesh), opened
    finally:
        bpy.data.meshes.remove(mesh)


KIND = Kind(add_options, read, own, close)


def _owned(obj, given):
    """Return points or splats with the object as their owner."""
    scene, settings = bpy.context.scene, {name: _value(getattr(obj.meshfree, name)) for name in LAPLACIAN}
    settings["frames"] = scene.frame_end - scene.frame_start + 1
    return replace(given, owner=Owner(obj, given, settings, _Groups(obj)))


def _value(value):
    return float(str(np.float32(value))) if isinstance(value, float) else value  # which Blender keeps in 32 bits


def _set(obj, arguments):
    """Set the settings of an object that a command line gives."""
    for name in (*LAPLACIAN, *_READ):
        value = getattr(arguments, name, None)
        if value is not None:
            setattr(obj.meshfree, name, group_of(obj, value) if name.endswith("_group") else value)


def _table(obj):
    """Return the points of an object with its columns, vectors along the axes of the world."""
    table, reading = point_table(bpy.context, obj), Reading(None, _linear(obj))
    for name, values in table.attributes.items():
        if values.shape[1:] != (3,) or name in (FILE_NORMAL, SCANNER):
            continue
        turned = (reading.placed_normals if name == ORIENTATION else reading.placed)(values.astype(np.float64))
        table.attributes[name] = turned.astype(values.dtype)
    return table


def _choose_object(path, name, option):
    bpy.context.view_layer.update()
    meshes = [obj for obj in bpy.context.view_layer.objects if obj.type in TYPES]
    active = bpy.context.view_layer.objects.active
    if not meshes:
        raise PointCloudError(f"{path} has no mesh object. Give a file with points.")
    if name:
        chosen = [obj for obj in meshes if obj.name == name]
    elif active in meshes:
        chosen = [active]
    else:
        chosen = meshes
    if len(chosen) != 1:
        names = ", ".join(obj.name for obj in meshes)
        what = f'mesh object "{name}"' if name else "active mesh object"
        raise PointCloudError(f"{path} has no {what}. Name one of its mesh objects with {option}: {names}.")
    bpy.context.view_layer.objects.active = chosen[0]
    return chosen[0]
