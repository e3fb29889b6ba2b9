"""File > Import: points of files as objects, with all digits of large coordinates."""

import os
from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ... import core
from ...command.clouds import read_file
from ...core import PointCloudError
from ...core.files import (
    READABLE,
    SCANS,
    SPLATS,
    TEXTS,
    frame_number,
    numbered_files,
    order_frames,
)
from ..objects.attributes import DISC, check_size, deselect, point_count, tag_changed, write_attribute
from ..objects.colors import own_colors
from ..objects.handlers import notify
from ..objects.notices import keep
from ..objects.place import OFFSET, known_offset, offset_of
from ..objects.reading import discs
from ..objects.splats import MOST_DRAWN
from ..registration import Registration
from ..running import cache
from ..running.ready import reporting
from .importer import ImportOperator, convert
from .objects import add_object, file_filter
from .sequence import add_sequence
from .splats import add_splats, is_drawn, mark

DROPPED = tuple(suffix for suffix in (*READABLE, *SPLATS) if suffix != ".obj")  # which are meshes nearly always

_QUICK = 80_000  # points whose discs take less than two seconds


class MESHFREE_OT_import_points(ImportOperator, bpy.types.Operator):
    """Import the points of LAS, LAZ, E57, PLY, PCD, OBJ, XYZ, PTS, PTX, CSV, text and numpy files, or splats"""

    bl_idname = "meshfree.import_points"
    bl_label = "Import Points"
    filter_glob: file_filter(*READABLE, *SPLATS)
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

    @property
    def asks(self):
        """Names of the settings; some only for sequences or for a kind of file; those of text until one is chosen."""
        sequence = ("sequence", "numbers") if self.sequence else ("sequence",)
        suffixes = {path.suffix.lower() for path in self.chosen()}
        scans = ("classes", "withheld", "meters") if suffixes & {*SCANS} else ()
        text = ("columns",) if suffixes & {"", *TEXTS} else ()
        return "up", "kind", "attributes", *text, *scans, "surface", *sequence, "frame"

    def invoke(self, context, event):
        if self.properties.is_property_set("filepath") and {path.suffix.lower() for path in self.chosen()} == {".ply"}:
            self._attended = True  # a menu has asked where files are dropped that Blender reads, too: no dialog besides
            return self.execute(context)
        return super().invoke(context, event)

    @reporting
    def execute(self, context):
        paths, choices = self.chosen(), self.las_choices()
        if self.sequence:
            paths = order_frames(paths) if len(paths) > 1 else numbered_files(paths[0].parent)
        self._paths = paths
        surface, columns = self.surface and not self.sequence, self.columns
        return self.begin(context, lambda progress: _read_all(paths, columns, choices, surface, progress))

    def _add(self, context, read):
        """Add an object for each table."""
        shared = known_offset(context.scene)
        surfaces, clouds = [], []
        for path, (table, found) in zip(self._paths, read, strict=True):
            if isinstance(table, core.splats.Splats):
                obj = self._add_splats(context, path.stem, table, shared)
                clouds.append(obj)
                shared = shared if shared is not None or OFFSET not in obj else offset_of(obj)
                continue
            upright = _rotate_up(table, self.up) if self.up != "Z" else table
            obj = add_object(path.stem, upright, context.collection, shared, self.attributes)
            obj.select_set(True)
            context.view_layer.objects.active = obj
            self.tell(obj, table, shared, f"{len(table.points):,} points")
            if isinstance(found, str):
                self.note(f"{obj.name} is shown as dots. {found}", obj)
                surfaces.append(obj)  # by the same display, so that renders show them, too
            elif found is not None:
                surfaces.append(obj)
                if DISC not in obj.data.attributes:  # else the file has them
                    write_attribute(obj.data, DISC, _rotate(found, self.up) if self.up != "Z" else found)
                    tag_changed(obj.data)
            if shared is None and OFFSET in obj:
                shared = offset_of(obj)
        every = context.selected_objects
        convert(context, every if self.kind == "POINTCLOUD" else clouds)
        for obj in every:
            obj.select_set(True)
            deselect(obj.data)  # else the first assignment to a group would include all points
        for obj in clouds:
            mark(obj.data)
            if self.surface and not self.sequence and not is_drawn(obj.data):
                notify("splats_found", obj)
                if point_count(obj.data) > MOST_DRAWN:
                    self.note(f"{obj.name}: viewports draw {MOST_DRAWN:,} of its splats, renders all", obj)
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
        self.tell(obj, splats, shared, f"{len(splats):,} Gaussian splats with harmonics of degree {degree}")
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


def _read_all(paths, columns, choices, surface, progress):
    """Read files, kept ones from memory, since Adjust Last Operation imports again.

    Return each table with the discs of its points, if requested, or why there are none.
    """
    tables = []
    for number, path in enumerate(paths):
        progress("Read", number / len(paths))
        state = path.stat() if os.path.isfile(path) else None  # which reads no folder without permission
        key = ("file", str(path), state and (state.st_mtime_ns, state.st_size), columns, choices)
        tables.append(cache.fetch(key, lambda path=path: read_file(path, columns, choices)))
    if not surface:
        return [(table, None) for table in tables]
    total = sum(len(table.points) for table in tables if not isinstance(table, core.splats.Splats))
    if total > _QUICK:
        return [(table, f"Discs of {total:,} points take a while: press Show as Surface") for table in tables]
    return [
        (table, None if isinstance(table, core.splats.Splats) else _find_discs(table.points, progress))
        for table in tables
    ]


def _find_discs(points, progress):
    """Return the discs of points for the display, (n, 3); a text if they form no surface."""
    points = points - points.mean(axis=0)  # squares of large coordinates would lose all digits
    try:
        found = cache.fetch(
            cache.content("discs", points), lambda: core.surface.surface_discs(points, progress=progress)
        )
        shown = discs(found.normals, found.radii, points)
        check_size(DISC, shown)
    except PointCloudError as error:
        return str(error)
    return shown


def _rotate_up(table, up):
    """Return a table rotated so that its Y axis, or -Y, points upwards."""
    vectors = {name: _rotate(values, up) for name, values in table.attributes.items() if values.ndim == 2}
    return replace(table, points=_rotate(table.points, up), attributes={**table.attributes, **vectors}, las=None)


def _rotate(vectors, up):
    side = 1.0 if up == "Y" else -1.0
    return vectors[:, [0, 2, 1]] * np.array([1.0, -side, side], vectors.dtype)


TOOLS = (Registration(MESHFREE_OT_import_points),)
