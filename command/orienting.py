"""The side of normals, which positions in the coordinates of a file may tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import analysis, clouds, core, quantities
from .cloud_verb import Task
from .settings import place
from .tool_verb import ToolVerb

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable
    from pathlib import Path

    from tools.tool import Outcome


def add_viewpoint(parser: ArgumentParser, implied: str, convert: Callable[[str], Any] = place) -> None:
    """Add the option for a viewpoint, from a text; `implied` is what it sets, for the help."""
    parser.add_argument(
        "--viewpoint",
        type=convert,
        metavar="X,Y,Z",
        help="position in the coordinates of the file from which the points were seen, as --viewpoint=X,Y,Z where X"
        f" is below zero. Sets {implied}",
    )


class OrientVerb(ToolVerb):
    """The verb `orient`, which writes the analysis with the side."""

    def add_options(self, parser: ArgumentParser) -> None:
        add_viewpoint(parser, "the method VIEWPOINT", clouds.place_or_object)
        super().add_options(parser)

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        """Set the method that a viewpoint or a column implies, and refuse others."""
        given = {"VIEWPOINT": ("--viewpoint", arguments.viewpoint), "ATTRIBUTE": ("--source", arguments.source)}
        for method, (option, value) in given.items():
            missing = value is None or len(value) == 0
            if missing and arguments.method == method:
                parser.error(f"the method {method} needs {option}")
            if not missing and arguments.method not in (None, method):
                parser.error(f"{option} goes with the method {method}, not {arguments.method}")
            if not missing:
                arguments.method = method

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        turned = subject.toward(outcome.values[quantities.ORIENTATION])
        values = analysis.Built(turned, core.measure.measure_mean_curvature(turned)).measures
        values[quantities.ORIENTATION] = values[quantities.NORMAL]
        return super().write(output, task, outcome._replace(values=values), subject)
