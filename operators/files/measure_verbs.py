"""Verbs that measure: parts, sections and profiles, whose outputs are tables."""

import bpy

from ...command import measures, profiles, sections
from ...command.rows import TABLES, write_rows, write_text
from ...command.settings import as_place
from ...command.svg import profile_picture
from ...command.table_verbs import CutOptions, PathOptions
from ..objects.place import place_of
from ..running.application import operator_reader
from ..tools.measures import MeasureParts, labels_of
from ..tools.profile import Profile
from ..tools.sections import CrossSection
from . import objects as files
from . import opening
from .tool_verbs import WithReference
from .verbs import LEFT_OUT, Apply


class MeasureFile(WithReference):
    """The verb `measure`, whose outputs are tables."""

    outputs = TABLES
    use, required = measures.OVER, False

    def __init__(self):
        super().__init__("measure_parts", _MeasureInFile)
        self.name = "measure"

    def add_options(self, parser):
        measures.add_base(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        measures.check_base(parser, arguments)
        super().check(parser, arguments)

    def prepare(self, tool, obj, path, arguments):
        other = self._reference
        ground = () if other is None else (other.operator, other.place, other.name)
        tool.base = measures.base_of(arguments.plane, arguments.normal, place_of(obj), *ground)

    def save(self, tool, obj, output):
        write_rows(output, tool.records)
        return []

    def figures(self, tool, result):
        return {"parts": tool.records}


class _MeasureInFile(MeasureParts):
    """The same tool, which remembers its rows in double precision, and measures volumes over a plane or a cloud."""

    records = ()
    base = None

    def plan(self, context, obj):
        measure, (_, operator), labels = super().plan(context, obj), operator_reader(context, obj), labels_of(obj)

        def compute(progress):
            table = measure(progress)
            volumes, told = measures.volumes_over(operator(progress), table.rows, labels, self.base, progress)
            self.records = [row.record() | over for row, over in zip(table.rows, volumes, strict=True)]
            return table._replace(notices=[*table.notices, *told])

        return compute


class Section(CutOptions, Apply):
    """The verb `section`, with a plane in the coordinates of the file, whose outputs hold measures."""

    left_out = LEFT_OUT | {"plane"}
    outputs = (*TABLES, ".blend")

    def __init__(self):
        super().__init__("cross_section", _SectionInFile)
        self.name = "section"

    def add_options(self, parser):
        parser.add_argument(
            "--plane",
            metavar="X,Y,Z",
            help="position of the plane in the coordinates of the file, as --plane=X,Y,Z where X is below zero; or the"
            " name of an object of a .blend file, whose local XY plane cuts. Without it, the middle of the points",
        )
        sections.add_options(parser, ", if no object gives it")
        super().add_options(parser)

    def check(self, parser, arguments):
        if arguments.normal is not None and arguments.plane and as_place(arguments.plane) is None:
            parser.error("--normal goes with a position, not with an object, whose plane has one")
        super().check(parser, arguments)

    def prepare(self, tool, obj, path, arguments):
        tool.plane = arguments.plane or ""
        tool.place, tool.normal = as_place(tool.plane), arguments.normal
        self._arguments = arguments

    def save(self, tool, obj, output):
        if output.suffix.lower() == ".blend":
            opening.save_scene(output)
        else:
            write_rows(output, sections.curve_records(tool.found))
        for path in self.beside(output, self._arguments):
            sections.write_corners(path, tool.found.curves, place_of(obj))
        return []

    def figures(self, tool, result):
        return sections.figures(tool.found)


class _SectionInFile(CrossSection):
    """The same tool, with a plane in the coordinates of the file."""

    place = None  # of the plane, (3,), unless it is an object
    normal = None  # across it, unless it is upwards or that of an object

    def cut(self, context, obj, reading):
        if self.place is not None:
            return self.place - place_of(obj), sections.UP if self.normal is None else self.normal, ""
        place, normal, guessed = super().cut(context, obj, reading)
        if self.normal is None:
            return place, normal, guessed
        return place, self.normal, sections.through_middle(obj.name)


class ProfileBetween(PathOptions, Apply):
    """The verb `profile`, between two positions in the coordinates of the file, whose outputs are tables."""

    outputs = (".csv", ".blend")

    def __init__(self):
        super().__init__("profile", _ProfileInFile)

    def prepare(self, tool, obj, path, arguments):
        self._arguments = arguments
        self._ends = profiles.nearest_ends(files.file_points(obj), [arguments.path_from, arguments.path_to])
        tool.rows = self._ends.rows

    def save(self, tool, obj, output):
        if output.suffix.lower() == ".blend":
            opening.save_scene(output)
        else:
            write_text(output, tool.table)
        for path in self.beside(output, self._arguments):
            write_text(path, profile_picture(tool.table, bpy.context.scene.unit_settings))
        return []

    def figures(self, tool, result):
        return {**profiles.figures(result), **self._ends.figures}


class _ProfileInFile(Profile):
    """The same tool, between points that are given, with heights in the coordinates of the file."""

    rows = None  # (2,) int

    def ends(self, obj):
        return self.rows

    def origin(self, obj):
        return place_of(obj)
