"""Verbs that hold clouds against that of another file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import clouds, colors, core, quantities, transferring
from .cloud_verb import CloudVerb, Printed, SurfaceVerb, Task, boundary_of, floaters
from .measures import add_base, base_of, check_base, volumes_over
from .naming import naming
from .results import number_text
from .rows import TABLES, write_rows
from .settings import chosen
from .tool_verb import PointVerb, ToolVerb

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tools.tool import Array, Outcome, Progress


class WithReference(CloudVerb):
    """A verb with another file, which is read once, before the first input."""

    reads = ("reference",)
    tool: Any  # of a subclass
    use = ""  # what the reference is for, for the help, if no tool tells it
    required = True  # whether there must be one
    _own: Any = None  # arguments with the settings of the reference
    _target: Any = None  # its cloud, or what a verb of Blender has for it

    def add_options(self, parser: ArgumentParser) -> None:
        use = self.use or self.tool.reference
        parser.add_argument(
            "--reference", required=self.required, metavar="FILE", help=f"{use}, of the kinds of inputs"
        )
        for ending in clouds.kinds():
            parser.add_argument(
                "--reference-object", default="", metavar="NAME", help=f"object of a {ending} file; else the active one"
            )
        super().add_options(parser)

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        if self._target is None and arguments.reference is not None:
            reference = Path(arguments.reference)
            given = self.read(reference, arguments, "reference_object")  # whose errors have its name already
            self._own = clouds.with_own(arguments, given)
            with naming(reference):
                self._target = self.target(reference, given)
        return super().run(path, arguments, output)

    def target(self, path: Path, given: clouds.Given) -> clouds.Cloud:
        """Return the cloud of the reference, with all that is read of it."""
        return clouds.Cloud(path, given)

    @property
    def read_notices(self) -> list[str]:  # type: ignore[override]  # computed
        """What was told as the reference was read, if there is one."""
        return [] if self._target is None else self._target.notices

    def reference(self) -> tuple[clouds.Cloud, Namespace]:
        """Return the cloud of the reference, and arguments with its settings."""
        return self._target, self._own

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        given, cloud, target = task.given, task.cloud, self._target
        if outcome.matrix is not None:
            shifted = cloud.points + (cloud.place - target.place)
            given = clouds.moved(given, shifted, outcome.matrix, target.place)
        return clouds.write(output, given, outcome.values)


class ReferenceVerb(WithReference, SurfaceVerb):
    """A verb that holds surfaces against that of another file, which is analyzed once."""

    _laplacian = None

    def target(self, path: Path, given: clouds.Given) -> clouds.Cloud:
        cloud = clouds.Cloud(path, given, floaters(self._own))
        boundary_of(cloud, vars(self._own))
        return cloud

    def laplacian(self, cloud: clouds.Cloud, arguments: Namespace, progress: Progress) -> core.LaplaceBeltrami:
        if cloud is not self._target:
            return super().laplacian(cloud, arguments, progress)
        if self._laplacian is None:
            with naming(cloud.path):
                self._laplacian = super().laplacian(cloud, arguments, progress)
        return self._laplacian


class AlignVerb(WithReference, PointVerb):
    """The subcommand of the tool that moves points onto the surface of others."""


class CompareVerb(ReferenceVerb, PointVerb):
    """The subcommand of the tool that measures distances from the surface of another cloud."""


class MeasureVerb(ReferenceVerb, ToolVerb):
    """The subcommand of the tool that measures parts, here also over planes and clouds, whose outputs are tables."""

    outputs, prints_all, required = TABLES, True, False

    def add_options(self, parser: ArgumentParser) -> None:
        add_base(parser)
        super().add_options(parser)

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        check_base(parser, arguments)

    def compute(self, task: Task, subject: Any, inputs: Any, own: Any) -> Any:
        found, ground = super().compute(task, subject, inputs, own), tuple[Any, ...]()
        if self._target is not None:
            operator = self.laplacian(*self.reference(), task.progress)
            ground = (lambda _: operator), self._target.place, self._target.path.name
        base = base_of(task.arguments.plane, task.arguments.normal, task.cloud.place, *ground)
        beside, told = volumes_over(subject, found.rows, inputs[0], base, task.progress)
        return found._replace(beside=beside, notices=[*found.notices, *told])

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        write_rows(output, outcome.figures["parts"])
        return []


class TransferAttributes(ReferenceVerb):
    """The verb `transfer-attributes`."""

    name, operator = "transfer-attributes", "transfer_attributes"
    help = "colors, numbers, vectors and labels from the surface of those of another file"
    settings = (*transferring.MATCH.values(), *transferring.ATTRIBUTES.values())
    use = "points whose attributes are taken"

    def work(self, task: Task) -> Printed:
        cloud, arguments, progress = task.cloud, task.arguments, task.progress
        target, laplacian = self.reference()[0], self.laplacian(*self.reference(), progress)
        own, reference = SimpleNamespace(**chosen(self.settings, arguments)), arguments.reference
        arrays, left_out = _values(target, own)
        built = self.laplacian(cloud, arguments, progress)
        offsets = [target.place - cloud.place]
        match = transferring.matched(built, [laplacian], offsets, own, task.path.stem, [reference], progress)
        smooth = [name for name, column in arrays.items() if _is_smooth(name, column)]
        new = transferring.taken(match, arrays, smooth, progress)
        notices, line = transferring.told(match, transferring.counted(arrays), task.path.stem, reference, number_text)
        told = [*target.notices, *transferring.left_out(left_out), *notices]
        if task.output is not None:
            told += _write_taken(task.output, cloud, new, match.state)
        return {"points": len(cloud.points), "done": line, **match.figures}, [*built.notices, *told]


def _values(cloud: clouds.Cloud, own: Any) -> tuple[dict[str, Array], list[str]]:
    """Return the columns of a cloud that settings ask for, by name, colors as linear ones; and which are left out."""
    columns, tint = dict(cloud.columns), cloud.given.colors if cloud.splats is None else None
    if tint is not None:
        columns[colors.COLOR] = colors.linear(np.asarray(tint, dtype=np.float64))
    wanted = {name: column for name, column in columns.items() if transferring.is_wanted(name, own, colors.COLOR)}
    found = {name: column for name, column in wanted.items() if np.isfinite(column).all()}
    transferring.check_found(found, own, str(cloud.path))
    return found, sorted(wanted.keys() - found.keys())


def _is_smooth(name: str, column: Array) -> bool:
    """Whether numbers are averaged: those that are no labels."""
    return column.dtype.kind == "f" and quantities.quantity(name).carried != "label"


def _write_taken(output: Path, cloud: clouds.Cloud, new: dict[str, Array], state: Array) -> list[str]:
    """Write a cloud with what it has taken, by name; return notices."""
    given, tint, where = cloud.given, new.pop(colors.COLOR, None), {quantities.TRANSFER: state}
    if output.suffix.lower() == ".npz":
        return clouds.write(output, given, {**new, **where} | ({} if tint is None else {"colors": colors.srgb(tint)}))
    if isinstance(given, core.splats.Splats):
        kept = [] if tint is None else ["Splats have colors of their own, so that none are taken."]
        return [*clouds.write(output, given, {**new, **where}), *kept]
    if tint is not None:
        given = replace(given, colors=np.clip(colors.srgb(tint), 0.0, 1.0).astype(np.float32))
    return clouds.write(output, replace(given, attributes={**given.attributes, **new}), where)
