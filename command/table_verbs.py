"""The subcommands of tools that cut and measure along lines, whose outputs are tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import clouds, core, tools
from .cloud_verb import Task
from .inputs import check_beside
from .measures import add_normal
from .rows import TABLES, write_rows, write_text
from .settings import place
from .svg import profile_picture
from .tool_verb import ToolVerb
from .units import NO_UNITS

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Sequence
    from pathlib import Path

    from tools.tool import Array, Outcome

_CURVES = "curve,closed,x,y,z", ["%d", "%d", "%.17g", "%.17g", "%.17g"]  # columns of a file of corners, and their form


class SectionVerb(ToolVerb):
    """The subcommand of the tool that cuts, whose outputs are tables of the curves."""

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]  # computed
        """Endings of files."""
        return (*TABLES, *clouds.kinds())

    def add_options(self, parser: ArgumentParser) -> None:
        named = "; or the name of an object of the input, whose local XY plane cuts" if clouds.kinds() else ""
        parser.add_argument(
            "--plane",
            type=clouds.place_or_object,
            metavar="X,Y,Z",
            help=f"position of the plane in the coordinates of the file, as --plane=X,Y,Z where X is below zero{named}."
            " Without it, the middle of the points",
        )
        add_normal(parser)
        parser.add_argument(
            "--curves", action="store_true", help="write the corners of the curves, too, beside the output: _curves.csv"
        )
        super().add_options(parser)

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        if arguments.normal is not None and isinstance(arguments.plane, str):
            parser.error("--normal goes with a position, not with an object, whose plane has one")
        check_beside(parser, arguments, "curves")

    def beside(self, output: Path, arguments: Namespace) -> list[Path]:
        return [output.with_name(f"{output.stem}_curves.csv")] if arguments.curves else []

    def taken(self, task: Task) -> tuple[Any, Any]:
        (position, normal, told, name), own = super().taken(task)
        cloud, arguments = task.cloud, task.arguments
        normal = normal if arguments.normal is None else arguments.normal
        if isinstance(arguments.plane, str):
            position, normal = cloud.owner.plane(arguments.plane)
            position, told = position - cloud.place, ()
        elif arguments.plane is not None:
            position, told = arguments.plane - cloud.place, ()
        return (position, normal, told, name), own

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        curves = [(curve.points + task.cloud.place, curve.closed) for curve in outcome.made]
        if clouds.kind_of(output) is not None:
            task.cloud.owner.add_curves(curves)
        else:
            write_rows(output, tools.cross_section.records(outcome.made))
        for path in self.beside(output, task.arguments):
            _write_corners(path, curves)
        return []


def _write_corners(path: Path, curves: Sequence[tuple[Array, bool]]) -> None:
    """Write the corners of curves."""
    columns = [
        np.column_stack([np.full((len(points), 2), (number, closed)), points])
        for number, (points, closed) in enumerate(curves, 1)
    ]
    with core.files.replacing(path) as part:
        np.savetxt(part, np.concatenate(columns), _CURVES[1], ",", header=_CURVES[0], comments="")


class ProfileVerb(ToolVerb):
    """The subcommand of the tool that measures along a path, whose outputs are tables."""

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]  # computed
        """Endings of files."""
        return (".csv", *clouds.kinds())

    def add_options(self, parser: ArgumentParser) -> None:
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

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        check_beside(parser, arguments, "svg")

    def beside(self, output: Path, arguments: Namespace) -> list[Path]:
        return [output.with_suffix(".svg")] if arguments.svg else []

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        found, table = outcome.made
        if clouds.kind_of(output) is not None:
            task.cloud.owner.add_profile(found.distance, found.values, table)
        else:
            write_text(output, table)
        for path in self.beside(output, task.arguments):
            write_text(path, profile_picture(table, NO_UNITS))
        return []
