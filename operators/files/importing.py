"""File > Import: points of files as objects, with all digits of large coordinates."""

import os
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ... import core
from ...command.clouds import read_file
from ...core import PointCloudError
from ...core.files import (
    READABLE,
    SCANS,
    SPLATS,
    TEXTS,
    LasChoices,
    frame_number,
    numbered_files,
    order_frames,
    parse_classes,
)
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import DISC, check_size, deselect, point_count, tag_changed, write_attribute
from ..objects.colors import own_colors
from ..objects.handlers import notify
from ..objects.notices import keep
from ..objects.place import OFFSET, known_offset, offset_of
from ..objects.reading import discs
from ..registration import Registration
from ..running import cache
from ..running.job import JobOperator
from ..running.ready import reporting
from .columns import column_notices
from .objects import add_object, file_filter
from .sequence import add_sequence
from .splats import add_splats, is_drawn, mark

OWN = tuple(
    suffix for suffix in (*READABLE, *SPLATS) if suffix not in (".ply", ".obj")
)  # which Blender reads itself, too

_QUICK = 80_000  # points whose discs take less than two seconds
_DEPTH = 10.0  # clipping distance of views relative to that of their center
_DRAWN = 200_000  # splats whose ellipsoids are drawn at once
_KINDS = [("MESH", "Mesh", "A mesh of loose vertices, which Edit Mode can select and vertex groups can hold")]
if bpy.app.version >= (4, 5, 0):
    _KINDS.append(("POINTCLOUD", "Point Cloud", "A point cloud object, which shows its points by itself"))


# Blender 5.2 crashes when it is given a path relative to the file for a property that does not say so.
_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


class MESHFREE_OT_import_points(JobOperator, ImportHelper, bpy.types.Operator):
    """Import the points of LAS, LAZ, E57, PLY, PCD, OBJ, XYZ, PTS, PTX, CSV, text and numpy files, or splats"""

    bl_idname = "meshfree.import_points"
    bl_label = "Import Points"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    filepath: StringProperty(
        name="File Path",
        description="File to import",
        maxlen=1024,
        subtype="FILE_PATH",
        options={"HIDDEN", "SKIP_PRESET", *_RELATIVE},
    )
    filter_glob: file_filter(*READABLE, *SPLATS)
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Files",
        description="Names of the files in the folder, if there are several",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    directory: StringProperty(
        name="Folder",
        description="Folder of several files",
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE", *_RELATIVE},
    )
    up: EnumProperty(
        name="Up",
        description="Axis of the file that points upwards",
        items=[
            ("Z", "Z", "Coordinates as they are in the file, as in Blender and in surveys"),
            ("Y", "Y", "Rotate points stored with Y upwards, as in other programs and .spz"),
            ("-Y", "-Y", "Rotate points stored with Y downwards, as many Gaussian splats are"),
        ],
        default="Z",
    )
    kind: EnumProperty(name="Object", description="What the points become", items=_KINDS, default="MESH")
    attributes: BoolProperty(
        name="Attributes",
        description="Import the other columns too: colors, normals, intensity and so on",
        default=True,
    )
    columns: StringProperty(
        name="Columns",
        description="Names of the columns of text files in their order, such as x y z - r g b, where - leaves one out"
        " and ... at the end all that follow; empty to find them",
        options={"SKIP_SAVE"},
    )
    surface: BoolProperty(
        name="Show as Surface",
        description=f"Draw points as discs tangent to the surface, up to {_QUICK:,} of them; not a sequence",
        default=True,
    )
    sequence: BoolProperty(
        name="Sequence",
        description="Make one object of numbered files, which shows one of them at each frame of the scene; of one file"
        " chosen, all in its folder",
        default=False,
        options={"SKIP_SAVE"},
    )
    numbers: BoolProperty(
        name="Follow Numbers",
        description="Show each file of a sequence at the frame of its number; where numbers are missing, the file"
        " before stays",
        default=False,
    )
    classes: StringProperty(
        name="Classes",
        description="Import only points of these classes of LAS files, such as 2 5 or 3-5 (2 is the ground); empty for"
        " all",
    )
    withheld: BoolProperty(
        name="Withheld Points",
        description="Import points of LAS files, too, that are flagged as withheld, which means deleted",
        default=False,
    )
    frame: BoolProperty(
        name="Frame in View",
        description="Let the 3D views look at the imported points, unless a script imports them",
        default=True,
    )

    @property
    def asks(self):
        """Names of the settings; some only for sequences or for a kind of file; those of text until one is chosen."""
        sequence = ("sequence", "numbers") if self.sequence else ("sequence",)
        suffixes = {path.suffix.lower() for path in self._chosen()}
        scans = ("classes", "withheld") if suffixes & {*SCANS} else ()
        text = ("columns",) if suffixes & {"", *TEXTS} else ()
        return "up", "kind", "attributes", *text, *scans, "surface", *sequence, "frame"

    @classmethod
    def obstacle(cls, context):
        if context.mode == "OBJECT":
            return ""
        return "Points are imported in Object Mode. Switch to Object Mode first"

    def invoke(self, context, event):
        self._attended = True
        return self.invoke_popup(context)

    @reporting
    def execute(self, context):
        self._framed = self._attended and self.frame
        paths, choices = self._chosen(), LasChoices(parse_classes(self.classes), self.withheld)
        if self.sequence:
            paths = order_frames(paths) if len(paths) > 1 else numbered_files(paths[0].parent)
        self._paths = paths
        surface, columns = self.surface and not self.sequence, self.columns
        return self.work(context, [], lambda progress: _read_all(paths, columns, choices, surface, progress))

    def _chosen(self):
        """Return the chosen files."""
        names = [item.name for item in self.files if item.name]
        folder = Path(bpy.path.abspath(self.directory))
        return [folder / name for name in names] or [Path(bpy.path.abspath(self.filepath))]

    def finish(self, context, objects, results):
        """Add an object for each table."""
        reason = self.obstacle(context)
        if reason:  # while the files were read
            raise PointCloudError(reason)
        with all_or_nothing([]):
            self._add(context, results)
        if self._framed:
            _frame_selected(context)
        return {"FINISHED"}

    def _add(self, context, read):
        for other in context.selected_objects:
            other.select_set(False)
        shared = known_offset(context.scene)
        surfaces, clouds = [], []
        for path, (table, found) in zip(self._paths, read, strict=True):
            if isinstance(table, core.Splats):
                obj = self._add_splats(context, path.stem, table, shared)
                clouds.append(obj)
                shared = shared if shared is not None or OFFSET not in obj else offset_of(obj)
                continue
            upright = _rotate_up(table, self.up) if self.up != "Z" else table
            obj = add_object(path.stem, upright, context.collection, shared, self.attributes)
            obj.select_set(True)
            context.view_layer.objects.active = obj
            self._report(obj, table, shared, f"{len(table.points):,} points")
            if isinstance(found, str):
                self.note(f"{obj.name} is shown as dots. {found}", obj)
            elif found is not None:
                surfaces.append(obj)
                if DISC not in obj.data.attributes:  # else the file has them
                    write_attribute(obj.data, DISC, _rotate(found, self.up) if self.up != "Z" else found)
                    tag_changed(obj.data)
            if shared is None and OFFSET in obj:
                shared = offset_of(obj)
        every = context.selected_objects
        _convert(context, every if self.kind == "POINTCLOUD" else clouds)
        for obj in every:
            obj.select_set(True)
            deselect(obj.data)  # else the first assignment to a group would include all points
        for obj in clouds:
            mark(obj.data)
            if self.surface and not self.sequence and point_count(obj.data) <= _DRAWN and not is_drawn(obj.data):
                notify("splats_found", obj)
        for obj in surfaces:  # after conversion, which would apply them
            notify("surface_found", obj)
        colored = [obj for obj in every if obj not in surfaces and own_colors(obj.data)]
        for objects in [colored] if self.sequence and colored else [[obj] for obj in colored]:
            notify("colors_found", objects)
        if self.sequence:
            self._join(context)

    def _add_splats(self, context, name, splats, shared):
        """Add an object of splats, which keep the numbers of their file: the object is rotated instead."""
        obj = add_splats(name, splats, context.collection, shared, self.up)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        degree = round(np.sqrt(splats.harmonics.shape[1] + 1)) - 1
        self._report(obj, splats, shared, f"{len(splats):,} Gaussian splats with harmonics of degree {degree}")
        return obj

    def _join(self, context):
        """Add an object that shows the imported ones: one per frame from the first of the scene, or by numbers."""
        frames, first = context.selected_objects, context.scene.frame_start
        name = self._paths[0].stem.rstrip("0123456789_-. ") or "Sequence"
        numbers = [frame_number(path) for path in self._paths] if self.numbers else range(first, first + len(frames))
        sequence = add_sequence(context, name, frames, numbers)
        sequence.select_set(True)
        context.view_layer.objects.active = sequence
        for frame in frames:  # which are seldom selected
            for notice in frame.meshfree.notices:
                text = notice.text if frame.name in notice.text else f"{frame.name}: {notice.text}"
                keep(sequence, notice.tool, text, notice.level)
        missing = numbers[-1] - numbers[0] + 1 - len(numbers)
        rest = f"; {missing} of them have no file and show the one before" if missing else ""
        self.report({"INFO"}, f"{sequence.name}: frames {numbers[0]} to {numbers[-1]}{rest}")

    def _report(self, obj, table, shared, what):
        """Report what was imported, and how its coordinates were shifted."""
        for notice in (*table.notices, *column_notices(obj, getattr(table, "attributes", {}))):
            self.warn(notice, obj)
        offset = offset_of(obj)
        self.report({"INFO"}, f"{obj.name}: {what}")
        if offset.any():
            self.note(f"{obj.name} is shifted by ({', '.join(f'{0.0 - value:.10g}' for value in offset)})", obj)
        if shared is not None and (offset != shared).any():
            self.warn(f"{obj.name} is too far from the points imported before to share their shift", obj)


def _convert(context, objects):
    """Convert new meshes to point clouds, where Blender can."""
    if bpy.app.version < (4, 5) or not objects:
        return
    context.view_layer.update()
    for other in context.view_layer.objects:
        other.select_set(other in objects)
    active = context.view_layer.objects.active
    context.view_layer.objects.active = objects[0]
    meshes = [obj.data for obj in objects]
    bpy.ops.object.convert(target="POINTCLOUD")
    bpy.data.batch_remove(meshes)
    context.view_layer.objects.active = active


def _frame_selected(context):
    """Frame the selected objects in all 3D views of the window."""
    for area in context.window.screen.areas:
        if area.type == "VIEW_3D":
            region = next(region for region in area.regions if region.type == "WINDOW")
            with context.temp_override(area=area, region=region):
                bpy.ops.view3d.view_selected()
                space, view = area.spaces.active, area.spaces.active.region_3d
                space.clip_end = max(space.clip_end, _DEPTH * view.view_distance)  # else large scans are clipped


def _read_all(paths, columns, choices, surface, progress):
    """Read files, kept ones from memory, since Adjust Last Operation imports again.

    Returns
    -------
    list of (PointTable, ndarray or str or None)
        Each table with the discs of its points, if requested, or why there are none.
    """
    tables = []
    for number, path in enumerate(paths):
        progress("Read", number / len(paths))
        state = path.stat() if os.path.isfile(path) else None  # which reads no folder without permission
        key = ("file", str(path), state and (state.st_mtime_ns, state.st_size), columns, choices)
        tables.append(cache.fetch(key, lambda path=path: read_file(path, columns, choices)))
    if not surface:
        return [(table, None) for table in tables]
    total = sum(len(table.points) for table in tables if not isinstance(table, core.Splats))
    if total > _QUICK:
        return [(table, f"Discs of {total:,} points take a while: press Show as Surface") for table in tables]
    return [
        (table, None if isinstance(table, core.Splats) else _find_discs(table.points, progress)) for table in tables
    ]


def _find_discs(points, progress):
    """Return the discs of points for the display, (n, 3); a text if they form no surface."""
    points = points - points.mean(axis=0)  # squares of large coordinates would lose all digits
    try:
        found = cache.fetch(cache.content("discs", points), lambda: core.surface_discs(points, progress=progress))
        shown = discs(found.normals, found.radii, points)
        check_size(DISC, shown)
    except PointCloudError as error:
        return str(error)
    return shown


def _rotate_up(table, up):
    """Return a table rotated so that its Y axis, or -Y, points upwards."""
    vectors = {name: _rotate(values, up) for name, values in table.attributes.items() if values.ndim == 2}
    return replace(table, points=_rotate(table.points, up), attributes={**table.attributes, **vectors})


def _rotate(vectors, up):
    side = 1.0 if up == "Y" else -1.0
    return vectors[:, [0, 2, 1]] * np.array([1.0, -side, side], vectors.dtype)


TOOLS = (Registration(MESHFREE_OT_import_points),)
