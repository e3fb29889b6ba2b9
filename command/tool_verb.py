"""The subcommands of the tools that `tools/` declares."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import clouds, core, quantities, tools
from .cloud_verb import CloudVerb, Printed, SurfaceVerb, Task, boundary_of
from .groups import add_at, check_sources, read_sources, read_weights
from .results import number_text
from .settings import LAPLACIAN, chosen, default_options

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Mapping

    from tools.tool import AnyTool, Array, Outcome, PointTool, Progress

check_vectors = tools.groups.check_vectors


class _Declared(CloudVerb):
    """A subcommand of a tool."""

    def __init__(self, tool: AnyTool[Any]) -> None:
        self.tool, self.settings = tool, tool.settings
        self.name, self.operator = tool.verb or tool.name.replace("_", "-"), tool.name
        self.help = tool.help[0].lower() + tool.help[1:]
        self.reads = (*self.reads, *(("curve",) if "curve" in tool.reads else ()))

    def add_options(self, parser: ArgumentParser) -> None:
        if "sources" in self.tool.reads:
            add_at(parser)
        if "curve" in self.tool.reads:
            more = "; or the name of a curve object of the input" if clouds.kinds() else ""
            parser.add_argument(
                "--curve",
                required=True,
                metavar="FILE",
                help=f"points of a curve on the surface in their order: {', '.join(core.files.READABLE)}{more}",
            )
            parser.add_argument("--closed", action="store_true", help="join the last point of the file with the first")
        super().add_options(parser)

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        if "sources" in self.tool.reads:
            check_sources(parser, arguments)

    def taken(self, task: Task) -> tuple[Any, Any]:
        """Return what the tool takes beside the points, and the values of its settings as attributes."""
        own = SimpleNamespace(**chosen(self.settings, task.arguments))
        return self.tool.inputs(FileCloud(task.cloud, task.arguments, self, task.path.stem), own), own

    def compute(self, task: Task, subject: Any, inputs: Any, own: Any) -> Any:
        """Compute what takes long."""
        return self.tool.compute(subject, inputs, own, task.progress)

    def written(self, task: Task, found: Any, subject: Any, own: Any) -> Printed:
        """Write what a tool found, and return what to print, and notices."""
        outcome = self.tool.finish(found, subject, own, number_text)
        notices, count = [*self.read_notices, *outcome.notices], len(task.cloud.points)
        if outcome.kept is not None:
            count = int(np.count_nonzero(outcome.kept))
        if task.output is not None:
            notices += self.write(task.output, task, outcome, subject)
        return {"points": count, "done": f"{task.path.stem}: {outcome.line}", **outcome.figures}, notices

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        """Write an outcome, and return notices."""
        given, values = task.given, outcome.values
        if outcome.kept is not None:
            given = task.cloud.taken(outcome.kept)
            values = {name: each[outcome.kept] for name, each in values.items()}
        elif outcome.points is not None:
            given = _moved(task.cloud, outcome.points, subject)
        return clouds.write(output, given, values, numbers=outcome.numbers)


class ToolVerb(_Declared, SurfaceVerb):
    """The subcommand of a tool that applies the operator."""

    def work(self, task: Task) -> Printed:
        inputs, own = self.taken(task)
        laplacian = self.laplacian(task.cloud, task.arguments, task.progress)
        figures, notices = self.written(task, self.compute(task, laplacian, inputs, own), laplacian, own)
        return figures, [*dict.fromkeys([*laplacian.notices, *notices])]


class PointVerb(_Declared, CloudVerb):
    """The subcommand of a tool that needs the points alone."""

    tool: PointTool

    @property
    def bytes_a_point(self) -> int:  # type: ignore[override]  # computed
        """Memory at the peak."""
        return self.tool.bytes_a_point

    def work(self, task: Task) -> Printed:
        (inputs, own), points = self.taken(task), task.cloud.points
        return self.written(task, self.compute(task, points, inputs, own), points, own)


def _moved(cloud: clouds.Cloud, points: Array, laplacian: core.LaplaceBeltrami) -> clouds.Given:
    """Return the file's content with points moved, and splats deformed by the gradients that their operator gives."""
    given, moved = cloud.given, points - cloud.points
    if isinstance(given, core.splats.Splats):
        return given.deformed(given.positions + moved, core.deform.deformation_gradients(laplacian, points))
    return replace(given, points=given.points + moved)  # so that points that stay keep all of their digits


def declared_verbs(own: Mapping[str, Callable[[AnyTool[Any]], CloudVerb]]) -> list[CloudVerb]:
    """Return the subcommands of all declared tools, some of classes of their own, by the names of the tools."""
    declared = tools.listed.listed_tools()
    usual = [PointVerb if isinstance(tool, tools.tool.PointTool) else ToolVerb for tool in declared]
    return [own.get(tool.name, verb)(tool) for tool, verb in zip(declared, usual, strict=True)]


class FileCloud:
    """The points of a file as a tool reads them; see `tools.tool.Cloud`."""

    kind, in_blender, repeats = "column", False, False

    def __init__(self, cloud: clouds.Cloud, arguments: Namespace, verb: Any, name: str) -> None:
        self._cloud, self._arguments, self._verb = cloud, arguments, verb
        self.name, self.where = name, str(cloud.path)
        self.points, self.out = cloud.points, cloud.out
        self.place = self.heights_from = cloud.place
        self.orientation = cloud.columns.get(quantities.ORIENTATION)

    @property
    def boundary(self) -> Array | None:
        """The points of the boundary that an option names, (n,) bool; None if it names none."""
        return boundary_of(self._cloud, chosen(LAPLACIAN.values(), self._arguments))

    @property
    def options(self) -> core.LaplacianOptions:
        """Options of the default method."""
        return default_options(chosen(LAPLACIAN.values(), self._arguments))

    def named(self, setting: str) -> str:
        """Return the option of a setting."""
        return f"--{setting.replace('_', '-')}"

    def has_group(self, name: str) -> bool:
        """Whether there is a group or a column of some name."""
        return self._cloud.has(name)

    def has_numbers(self, name: str) -> bool:
        """Whether there is a column of some name."""
        return name in self._cloud.columns

    def weights(self, setting: str, name: str, least: int = 1, outside: float = 0.0) -> Array:
        """Return the weights in the group or column that a setting names, (n,)."""
        return read_weights(self._cloud, name, self.named(setting), least, outside)

    def numbers(self, setting: str, name: str) -> Array:
        """Return the column that a setting names."""
        return self._cloud.numbers(name, self.named(setting))

    def vectors(self, setting: str, name: str, places: bool) -> Array:
        """Return the vectors in a column, (n, 3), as places less that of the points."""
        vectors = check_vectors(self.numbers(setting, name), name, self.where).astype(np.float64)
        return vectors - self.place if places else vectors

    def viewpoint(self) -> Array:
        """Return the position, or that of an object, from which the points were seen, (3,)."""
        given = self._arguments.viewpoint
        return (self._cloud.owner.place(given) if isinstance(given, str) else given) - self.place

    def sources(self, name: str) -> Array:
        """Return the points nearest to given positions or, without these, those of a group, (n,) bool."""
        return read_sources(self._cloud, self._arguments)

    def curve(self) -> tuple[Array, bool]:
        """Return the points of the curve in another file or object, (k, 3), and whether it is closed."""
        curve, closed = Path(self._arguments.curve), self._arguments.closed
        if clouds.kinds() and curve.suffix.lower() not in core.files.READABLE:
            places, closed = self._cloud.owner.curve(self._arguments.curve)
        else:
            places = core.files.read_points(curve).points
        return places - self._cloud.place, closed

    def ends(self) -> tuple[Array, Array]:
        """Return the points nearest to two given positions, (2,) int, and how far they are from these, (2,)."""
        points, places = self.points + self.place, np.stack([self._arguments.path_from, self._arguments.path_to])
        rows = core.geometry.nearest_rows(points, places)
        if rows[0] == rows[1]:
            raise core.PointCloudError("The same point is the nearest one to both ends of the path. Give others.")
        return rows, np.linalg.norm(points[rows] - places, axis=1)

    def laplacian(self, progress: Progress) -> core.LaplaceBeltrami:
        """Return the operator."""
        return self._verb.laplacian(self._cloud, self._arguments, progress)

    def reference(self) -> tuple[tools.tool.Cloud, Array]:
        """Return the cloud of the other file, and the offset of its points."""
        cloud, arguments = self._verb.reference()
        return FileCloud(cloud, arguments, self._verb, cloud.path.name), self.place - cloud.place
