"""Verbs that measure: parts, sections and profiles, whose outputs are tables."""

import bpy
import numpy as np

from ... import core
from ...command.rows import TABLES, write_rows, write_text
from ...command.settings import as_place, place
from ...core import PointCloudError
from ...core.files import replacing
from ..objects.place import place_of
from ..tools.measures import MeasureParts
from ..tools.profile import Profile
from ..tools.sections import CrossSection
from . import objects as files
from . import opening
from .svg import profile_picture
from .verbs import LEFT_OUT, Apply

_CURVES = "curve,closed,x,y,z", ["%d", "%d", "%.17g", "%.17g", "%.17g"]  # columns of a file of corners, and their form


class MeasureFile(Apply):
    """The verb `measure`, whose outputs are tables."""

    outputs = TABLES

    def __init__(self):
        super().__init__("measure_parts", _MeasureInFile)
        self.name = "measure"

    def save(self, tool, obj, output):
        write_rows(output, [row.record() for row in tool.rows])
        return []

    def figures(self, tool, result):
        return {"parts": [row.record() for row in result.rows]}


class _MeasureInFile(MeasureParts):
    """The same tool, which remembers its rows in double precision."""

    rows = ()

    def write(self, context, obj, result):
        self.rows = result.rows
        return super().write(context, obj, result)


class Section(Apply):
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
        parser.add_argument(
            "--normal", type=place, metavar="X,Y,Z", help="vector across the plane, if no object gives it; else upwards"
        )
        parser.add_argument(
            "--curves", action="store_true", help="write the corners of the curves, too, beside the output: _curves.csv"
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        if arguments.normal is not None and arguments.plane and as_place(arguments.plane) is None:
            parser.error("--normal goes with a position, not with an object, whose plane has one")
        _check_beside(parser, arguments, "curves")

    def prepare(self, tool, obj, path, arguments):
        tool.plane = arguments.plane or ""
        tool.place, tool.normal = as_place(tool.plane), arguments.normal
        self._arguments = arguments

    def beside(self, output, arguments):
        return [output.with_name(f"{output.stem}_curves.csv")] if arguments.curves else []

    def save(self, tool, obj, output):
        if output.suffix.lower() == ".blend":
            opening.save_scene(output)
        else:
            write_rows(output, _curve_records(tool.found))
        for path in self.beside(output, self._arguments):
            _save_corners(path, tool.found.curves, place_of(obj))
        return []

    def figures(self, tool, result):
        found = tool.found
        return {
            "curves": len(found.curves),
            "open_curves": sum(not curve.closed for curve in found.curves),
            "length": found.length,
            "enclosed_area": found.enclosed_area,
        }


def _curve_records(found):
    """Return the measures of each curve by name, in world lengths; of a hole the area that it takes away."""
    return [
        {
            "curve": number,
            "length": curve.length,
            "enclosed_area": abs(curve.enclosed_area),
            "closed": int(curve.closed),
            "hole": int(curve.enclosed_area < 0.0),
        }
        for number, curve in enumerate(found.curves, 1)
    ]


def _save_corners(output, curves, offset):
    """Write the corners of curves in the coordinates of the file."""
    columns = [
        np.column_stack([np.full((len(curve.points), 2), (number, curve.closed)), curve.points + offset])
        for number, curve in enumerate(curves, 1)
    ]
    with replacing(output) as part:
        np.savetxt(part, np.concatenate(columns), _CURVES[1], ",", header=_CURVES[0], comments="")


def _check_beside(parser, arguments, option):
    """Refuse an option for a further file beside the output, if there is none."""
    if getattr(arguments, option) and arguments.out is None and arguments.out_dir is None:
        parser.error(f"--{option} writes a file beside the output: give --out or --out-dir, too")


class _SectionInFile(CrossSection):
    """The same tool, with a plane in the coordinates of the file."""

    place = None  # of the plane, (3,), unless it is an object
    normal = None  # across it, unless it is upwards or that of an object

    def cut(self, context, obj, reading):
        if self.place is not None:
            return self.place - place_of(obj), (0.0, 0.0, 1.0) if self.normal is None else self.normal, ""
        place, normal, guessed = super().cut(context, obj, reading)
        if self.normal is None:
            return place, normal, guessed
        return place, self.normal, f"{obj.name} is cut through its middle: no --plane is given."


class ProfileBetween(Apply):
    """The verb `profile`, between two positions in the coordinates of the file, whose outputs are tables."""

    outputs = (".csv", ".blend")

    def __init__(self):
        super().__init__("profile", _ProfileInFile)

    def add_options(self, parser):
        for option, what in (("from", "begins"), ("to", "ends")):
            parser.add_argument(
                f"--{option}",
                dest=f"path_{option}",
                type=place,
                required=True,
                metavar="X,Y,Z",
                help=f"position in the coordinates of the file, at whose nearest point the path {what}; as"
                f" --{option}=X,Y,Z where X is below zero",
            )
        parser.add_argument(
            "--svg", action="store_true", help="write a small picture, too, beside the output with the ending .svg"
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        _check_beside(parser, arguments, "svg")

    def beside(self, output, arguments):
        return [output.with_suffix(".svg")] if arguments.svg else []

    def prepare(self, tool, obj, path, arguments):
        self._arguments, places = arguments, np.array([arguments.path_from, arguments.path_to])
        points = files.file_points(obj)
        tool.rows = core.geometry.nearest_rows(points, places)
        self._ends = points[tool.rows]
        self._away = np.linalg.norm(self._ends - places, axis=1)
        if tool.rows[0] == tool.rows[1]:
            raise PointCloudError("The same point is the nearest one to both ends of the path. Give others.")

    def save(self, tool, obj, output):
        if output.suffix.lower() == ".blend":
            opening.save_scene(output)
        else:
            write_text(output, tool.table)
        for path in self.beside(output, self._arguments):
            write_text(path, profile_picture(tool.table, bpy.context.scene.unit_settings))
        return []

    def figures(self, tool, result):
        distance, values, off, _ = result
        return {
            "length": float(distance[-1]),
            "lowest": float(np.nanmin(values)),
            "highest": float(np.nanmax(values)),
            "uncertainty": float(np.sqrt(np.nanmean(off**2))),
            "ends": self._ends.tolist(),
            "distances_of_ends": self._away.tolist(),
        }


class _ProfileInFile(Profile):
    """The same tool, between points that are given, with heights in the coordinates of the file."""

    rows = None  # (2,) int

    def ends(self, obj):
        return self.rows

    def origin(self, obj):
        return place_of(obj)
