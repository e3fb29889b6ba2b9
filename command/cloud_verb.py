"""Verbs for clouds of files: what is read, and the Laplacian of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

from . import analysis, clouds, core, quantities
from .inputs import add_choices, files_in, las_choices
from .settings import LAPLACIAN, Setting, add_setting, chosen, laplacian_options
from .stages import ToldStages
from .verb import ONE_LINE, Verb

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from tools.tool import Array, Progress

Printed: TypeAlias = "tuple[dict[str, Any], list[str]]"  # figures by name, and notices


@dataclass(frozen=True)
class Task:
    """One input of a verb, and where its results go."""

    path: Path
    given: clouds.Given
    arguments: Namespace  # with the settings of the object that was read, if any
    output: Path | None
    progress: Progress

    @cached_property
    def cloud(self) -> clouds.Cloud:
        """Its points."""
        return clouds.Cloud(self.path, self.given, floaters(self.arguments))


class CloudVerb(Verb):
    """A verb for clouds, with options for how they are read; `work` of a subclass processes one."""

    settings: tuple[Setting, ...] = ()  # its own
    read_notices: Sequence[str] = ()  # of what was read once, before the first input
    bytes_a_point = 200  # of memory at the peak, but for operators, which are checked where they are built

    @property
    def inputs(self) -> str:  # type: ignore[override]  # computed
        """What is read."""
        return f"point clouds: {', '.join(clouds.inputs())}. Text has columns x y z and may have a header"

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]  # computed
        """Endings of files."""
        return clouds.outputs()

    @property
    def description(self) -> str:  # type: ignore[override]  # computed
        """What it does, in full."""
        return f"{self.help[0].upper()}{self.help[1:]}. Lengths are in the unit of the coordinates. {ONE_LINE}"

    def add_options(self, parser: ArgumentParser) -> None:
        for setting in self.settings:
            add_setting(parser, setting)
        add_choices(parser)
        for kind in clouds.kinds().values():
            kind.add_options(parser)

    def expand(self, path: Path, arguments: Namespace) -> list[Path]:
        return files_in(path, clouds.inputs()) if path.is_dir() else [path]

    def read(self, path: Path, arguments: Namespace, option: str = "object") -> clouds.Given:
        """Return what a file holds, points or splats; where it has objects, of the one that an option names."""
        kind = clouds.kind_of(path)
        if kind is not None:
            return kind.read(path, getattr(arguments, option), f"--{option.replace('_', '-')}", arguments)
        return clouds.read_file(path, arguments.columns if option == "object" else "", las_choices(arguments))

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        given, kind = self.read(path, arguments), clouds.kind_of(output)
        core.check_room(len(clouds.positions(given)), self.bytes_a_point)
        if kind is not None and given.owner is None:
            given = kind.own(path.stem, given, arguments)
        with ToldStages(self.name) as stages:
            figures, notices = self.work(Task(path, given, clouds.with_own(arguments, given), output, stages))
        notices = [*given.notices, *notices]
        if kind is not None:
            given.owner.save(output, self.operator or self.name.replace("-", "_"), notices, stages.seconds)
        return {**figures, "seconds": stages.rounded, "notices": notices}

    def work(self, task: Task) -> Printed:
        """Process points or splats, write the output, and return what to print, and notices."""
        raise NotImplementedError


class SurfaceVerb(CloudVerb):
    """A verb that builds the Laplacian of a cloud."""

    def add_options(self, parser: ArgumentParser) -> None:
        super().add_options(parser)
        for setting in LAPLACIAN.values():
            add_setting(parser, setting)

    def laplacian(self, cloud: clouds.Cloud, arguments: Namespace, progress: Progress) -> core.LaplaceBeltrami:
        """Return the operator of a cloud by the settings of arguments."""
        return self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian

    def build(self, cloud: clouds.Cloud, values: Mapping[str, Any], progress: Progress) -> analysis.Built:
        """Return the operator of a cloud, by the values of the settings in `LAPLACIAN`."""
        boundary = boundary_of(cloud, values)
        built = analysis.build(cloud.points, laplacian_options(values), boundary, cloud.out, progress)
        sides = cloud.columns.get(quantities.ORIENTATION)
        return built if sides is None else analysis.oriented(built, sides)


def boundary_of(cloud: clouds.Cloud, values: Mapping[str, Any]) -> Array | None:
    """Return the boundary points that a group or column names, (n,) bool; None if none does."""
    name = values["boundary_group"]
    return cloud.members(name, "--boundary-group") if name else None


def floaters(arguments: Namespace) -> bool:
    """Whether floaters among splats are left out: always where no option asks."""
    return getattr(arguments, "leave_out_floaters", None) is not False
