"""Opening and writing files on the command line."""

import bpy

from ... import core
from ...command.clouds import read_file, save_arrays
from ...command.quantities import APPLICATIONS, MEAN_CURVATURE
from ...core import PointCloudError
from ...core.files import WRITABLE, PointTable, write_points
from ..objects.colors import own_colors
from ..objects.handlers import notify
from ..objects.reading import TYPES
from ..objects.splats import has_splats
from .columns import column_notices
from .objects import add_object, point_table
from .splats import add_splats, splats_to_write, with_results


def load(path, name: str = "", option: str = "--object", read=read_file):
    """Open a file in place of the loaded one.

    Parameters
    ----------
    path : pathlib.Path
        A file of one of the kinds in `INPUTS`.
    name : str
        The object's name; empty for the active one, or else the only mesh.
    option : str
        Of the command line for the name.
    read : callable
        Function of a path that reads files other than .blend.

    Returns
    -------
    bpy.types.Object
        The object to work on.
    list of str
        What was left out of the file.

    Raises
    ------
    PointCloudError
        The file or the object is missing, or has no points.
    """
    notices = []
    if path.suffix.lower() != ".blend":
        given = read(path)
        bpy.ops.wm.read_homefile(use_empty=True)
        add = add_object if isinstance(given, PointTable) else add_splats
        obj = add(path.stem, given, bpy.context.scene.collection)
        notices = [*given.notices, *column_notices(obj, getattr(given, "attributes", {}))]
    elif path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
    else:
        raise PointCloudError(f"There is no file {path}. Check its name and folder.")
    return _choose_object(path, name, option), notices


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


def save(path, obj, arrays, shown="") -> list:
    """Write the result to a file of a kind in `OUTPUTS`: the scene, points or splats, or the arrays by name.

    The scene shows the attribute `shown`, or else another result of the points, or their own colors. Returns notices of
    what is written in another form.
    """
    suffix = path.suffix.lower()
    if suffix == ".npz":
        save_arrays(path, arrays)
    elif suffix == ".ply" and has_splats(obj.data):
        core.splats.write_splats(path, with_results(splats_to_write(obj), obj.data))
    elif suffix in WRITABLE:
        table = point_table(bpy.context, obj)
        return [*table.notices, *write_points(path, table, double=not table.single)]
    else:
        for other in bpy.context.view_layer.objects:
            other.select_set(other == obj)
        names = [name for name in (shown, *APPLICATIONS, MEAN_CURVATURE) if name in obj.data.attributes]
        if names:
            notify("result_written", obj, names[0])
        elif own_colors(obj.data):
            notify("colors_found", [obj])
        save_scene(path)
    return []


def save_scene(path):
    """Write the loaded file to a .blend file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()))
