"""File > Import: the tiles of a survey as one object, with as many points as wanted, or in full inside a box."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ...core.errors import NotEnoughMemoryError
from ...core.files import READABLE, SCANS, LasChoices, PointTable, chunks, extent, join_forms, join_notices, join_pieces
from ...core.memory import available_memory
from ...tools.quantities import MEAN_CURVATURE, PREFIX
from ..objects.attributes import deselect
from ..objects.box import Box, box_of
from ..objects.colors import own_colors
from ..objects.handlers import notify
from ..objects.place import known_offset
from ..registration import Registration
from ..running import cache
from ..running.ready import reporting
from .columns import RENAMED
from .importer import ImportOperator, convert
from .objects import add_object, file_filter

_CLASSES = "classification"
_COPIES = 3  # of what was read, at most, until Blender has it


class _Wanted(NamedTuple):
    """Which points are taken: so many at most, or all where that is None, up to a level of detail, in a box."""

    count: int | None
    level: int | None
    box: Box | None
    las: LasChoices
    attributes: bool


@dataclass
class _Reading:
    """What was seen on the way."""

    total: int = 0
    single: bool = False
    degrees: bool = False
    notices: list = field(default_factory=list)
    forms: list = field(default_factory=list)


class MESHFREE_OT_import_tiles(ImportOperator, bpy.types.Operator):
    """Import the files of a survey as one object: thinned out evenly, to a level of detail, or inside a box"""

    bl_idname = "meshfree.import_tiles"
    bl_label = "Import Tiles"
    filter_glob: file_filter(*READABLE)
    density: EnumProperty(
        name="Density",
        description="How many of the points are imported",
        items=[
            ("NUMBER", "Number", "So many points at most, evenly spread over all files"),
            ("LEVEL", "Level of Detail", "COPC files up to a level, which takes no time for points of finer ones"),
            ("ALL", "All", "All points, if the memory is enough: best with a box"),
        ],
        default="NUMBER",
    )
    count: IntProperty(
        name="Number",
        description="How many points are imported at most",
        default=500_000,
        min=1,
        soft_min=1000,
        soft_max=10_000_000,
    )
    level: IntProperty(
        name="Level",
        description="The finest level of detail that is imported; 0 is the coarsest, each has about four times as many"
        " points as the one before",
        default=3,
        min=0,
        soft_max=12,
    )
    box: StringProperty(
        name="Box",
        description="Object in whose box points are imported: the cube of an empty, the bounding box of others; empty"
        " for points everywhere",
        options={"SKIP_SAVE"},
    )
    color: StringProperty(
        name="Color",
        description="Attribute that the points show, such as classification or a result; empty for the colors of the"
        " scan, else the mean curvature or the class",
        search=lambda self, context, text: self.column_names(),
        search_options={"SUGGESTION"},
    )

    @property
    def asks(self):
        """Names of the settings."""
        density = {"NUMBER": ("density", "count"), "LEVEL": ("density", "level")}.get(self.density, ("density",))
        color = ("color",) if self.attributes else ()
        return *density, "box", "kind", "attributes", *color, "classes", "withheld", "meters", "frame"

    def column_names(self):
        """Return the names of the columns of the first chosen file; none of one that cannot be read.

        That is told when it is imported; here Blender asks at each letter that is typed.
        """
        try:
            return [*next(iter(chunks(self.chosen()[0], 1)), (None, {}))[1]]
        except PointCloudError:
            return []

    @reporting
    def execute(self, context):
        paths, shared = self.chosen(), known_offset(context.scene)
        name = _name_of(paths)
        self._name, self._files = name, len(paths)
        wanted = _Wanted(
            self.count if self.density == "NUMBER" else None,
            self.level if self.density == "LEVEL" else None,
            box_of(context, self.box, 0.0 if shared is None else shared) if self.box else None,
            self.las_choices(),
            self.attributes,
        )
        return self.begin(context, lambda progress: _read(paths, wanted, name, progress))

    def _add(self, context, read):
        """Add the object."""
        table, total = read
        shared = known_offset(context.scene)
        obj = add_object(self._name, table, context.collection, shared, self.attributes)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        files = f"{self._files:,} files" if self._files > 1 else "the file"
        self.tell(obj, table, shared, f"{len(table.points):,} points")
        self.note(f"{obj.name}: {len(table.points):,} of {total:,} points of {files} are imported", obj)
        if self.kind == "POINTCLOUD":
            convert(context, [obj])
            obj.select_set(True)
        deselect(obj.data)
        self._show(obj)

    def _show(self, obj):
        """Show the chosen attribute, or else the one that tells most."""
        there, own = obj.data.attributes, own_colors(obj.data)
        names = (self.color, f"{PREFIX}{self.color}", f"{RENAMED}{self.color}") if self.color else ()
        found = next((name for name in names if name in there), "")
        if self.attributes and self.color and not found:
            self.warn(f'{obj.name}: the files have no "{self.color}" to be shown', obj)
        if not found and not own:
            found = next((name for name in (MEAN_CURVATURE, _CLASSES) if name in there), "")
        if found:
            notify("result_written", obj, found)
        elif own:
            notify("colors_found", [obj])


def _name_of(paths):
    """Return what the names of files have in common, without numbers at the end, or that of the only file."""
    names = [path.stem.removesuffix(".copc") for path in paths]
    if len(names) == 1:
        return names[0]
    first, last = min(names), max(names)
    common = next((index for index, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))
    return first[:common].rstrip("0123456789_-. ") or "Tiles"


def _read(paths, wanted, name, progress):
    """Read the wanted points of files as a table; return also how many points the files have."""
    states = [(str(path), path.stat().st_mtime_ns, path.stat().st_size) for path in paths if os.path.isfile(path)]
    box = () if wanted.box is None else wanted.box
    key = cache.content("tiles", *map(tuple, states), *wanted._replace(box=None), *box)
    return cache.fetch(key, lambda: _read_anew(paths, wanted, name, progress))


def _read_anew(paths, wanted, name, progress) -> tuple[PointTable, int]:
    seen = _Reading()
    pieces = _pieces(paths, wanted, seen, progress)
    if wanted.count is None:
        kept = list(_within_memory(pieces))
    else:
        kept = core.clean.thin_pieces(pieces, wanted.count)
    if not kept and wanted.box is not None:
        raise PointCloudError(f"None of the {seen.total:,} points is inside the box. Move or scale its object.")
    las, differing = join_forms(seen.forms)
    table = join_pieces(kept, Path(name), seen.single, seen.degrees, las)
    table.notices = [*join_notices(seen.notices), *differing, *table.notices]
    return table, seen.total


def _pieces(paths, wanted, seen, progress):
    """Yield the points of files in the box, piece by piece."""
    for number, path in enumerate(paths):
        progress("Read", number / len(paths))
        is_scan = path.suffix.lower() in SCANS
        count, done = extent(path).count if is_scan else 0, 0
        bounds = wanted.box.bounds if is_scan and wanted.box is not None else None  # else they would not be counted
        found = chunks(path, bounds=bounds, level=wanted.level, las=wanted.las)
        for points, numbers in found:
            done += len(points)
            progress("Read", (number + (min(done / count, 1.0) if count else 0.5)) / len(paths))
            numbers = numbers if wanted.attributes else {}
            if wanted.box is not None:
                inside = wanted.box.holds(points)
                points, numbers = points[inside], {name: values[inside] for name, values in numbers.items()}
            if len(points):
                yield points, numbers
        seen.total += count if is_scan else done
        seen.single, seen.degrees = seen.single or found.single, seen.degrees or found.degrees
        seen.notices += found.notices
        seen.forms.append(found.las)


def _within_memory(pieces):
    """Yield pieces as long as there is memory for what Blender makes of them."""
    total = count = 0
    for points, numbers in pieces:
        total += points.nbytes + sum(values.nbytes for values in numbers.values())
        count += len(points)
        free = available_memory()
        if free is not None and (_COPIES - 1) * total > free:
            raise NotEnoughMemoryError(
                f"More than {count:,} points need more memory than is free. Import a number of points, a coarser level,"
                " or a smaller box."
            )
        yield points, numbers


TOOLS = (Registration(MESHFREE_OT_import_tiles),)
