"""The subcommand that makes a mesh of a cloud."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from . import clouds, colors, core
from .cloud_verb import Task
from .tool_verb import ToolVerb

if TYPE_CHECKING:
    from argparse import ArgumentParser
    from pathlib import Path

    from tools.tool import Array, Outcome


class MeshVerb(ToolVerb):
    """The subcommand of the tool that makes a mesh, whose outputs are files of meshes."""

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]  # computed
        """Endings of files."""
        return (*clouds.kinds(), *core.files.MESHES)

    def add_options(self, parser: ArgumentParser) -> None:
        super().add_options(parser)
        if clouds.kinds():
            told = "end the mesh where the points end; otherwise all openings are closed (default on)"
            parser.add_argument("--keep-open", action=argparse.BooleanOptionalAction, default=True, help=told)

    def compute(self, task: Task, subject: Any, inputs: Any, own: Any) -> Any:
        found = super().compute(task, subject, inputs, own)
        for kind in clouds.kinds().values() if found.opened else ():
            if not task.arguments.keep_open:
                faces, opened = kind.close(found.mesh.vertices, found.faces)
                found = found._replace(faces=faces, opened=opened)
        return found

    def write(self, output: Path, task: Task, outcome: Outcome, subject: Any) -> list[str]:
        faces, table = outcome.made.faces, _on_vertices(task.cloud, subject, outcome.made.mesh.vertices)
        if clouds.kind_of(output) is None:
            return core.files.write_mesh(output, table, faces, double=not table.single)
        task.cloud.owner.add_mesh(table, faces)
        return []


def _on_vertices(cloud: clouds.Cloud, laplacian: core.LaplaceBeltrami, vertices: Array) -> core.files.PointTable:
    """Return vertices in the coordinates of the file, with the columns and colors of the points."""
    if cloud.splats is not None:
        tint: Array | None = colors.of_splats(cloud.splats.colors)
    else:
        tint = None if cloud.given.colors is None else colors.linear(cloud.given.colors)
    single = isinstance(cloud.given, core.splats.Splats) or cloud.given.single
    table = core.files.PointTable(vertices + cloud.place, single=single)
    columns = {**cloud.columns, **{name: np.nan_to_num(weights) for name, weights in cloud.groups.items()}}
    if columns or tint is not None:
        carrying, count = core.surface.values_on_mesh(laplacian, vertices), len(vertices)
        for name, values in columns.items():
            carry = carrying.interpolate if values.dtype.kind == "f" else carrying.labels
            table.attributes[name] = carry(values)[-count:]
        if tint is not None:
            averaged = colors.average(tint, carrying.interpolate)[-count:]
            table.colors = np.clip(colors.srgb(averaged), 0.0, 1.0)
    return table
