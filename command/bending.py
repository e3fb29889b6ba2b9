"""Verbs of the command line that need no object: summaries of splat files, and deformation of points and splats."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import core
from .verb import ONE_LINE, Verb

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tools.tool import Array

_SHARES = (0.01, 0.5, 0.99)  # quantiles that are printed
_FLAT = 0.3  # ratio of the shortest to the middle axis below which a splat is flat


class SplatInfo(Verb):
    """The verb `splat-info`: a summary of a file of splats."""

    name = "splat-info"
    help = "summarize files of Gaussian splats"
    description = f"Summarize files of Gaussian splats. {ONE_LINE}"
    inputs = "files of splats"

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        splats = core.splats.read_splats(path)
        axes = np.sort(splats.scales, axis=1)

        def quantiles(values: Array) -> list[float]:
            return [float(f"{value:.6g}") for value in np.quantile(values, _SHARES)]

        return {
            "splats": len(splats),
            "degree": round(np.sqrt(splats.harmonics.shape[1] + 1)) - 1,
            "low": splats.positions.min(axis=0).tolist(),
            "high": splats.positions.max(axis=0).tolist(),
            "longest_axis": quantiles(axes[:, 2]),
            "opacity": quantiles(splats.opacities),
            "flat": float(np.mean(axes[:, 0] < _FLAT * axes[:, 1])),
            "notices": splats.notices,
        }


class Deform(Verb):
    """The verb `deform`: deform the points or splats of a file by handles in a JSON file."""

    name = "deform"
    help = "move points or Gaussian splats by handles that a JSON file names"
    description = f"Move points or Gaussian splats by handles that a JSON file names. {ONE_LINE}"
    inputs = "files of points or splats"
    outputs = core.files.WRITABLE
    reads = ("handles",)

    def add_options(self, parser: ArgumentParser) -> None:
        parser.add_argument(
            "--handles",
            type=Path,
            required=True,
            metavar="JSON",
            help='{"handles": [{"center": [x, y, z], "radius": r, "shift": [x, y, z]}], "anchors": [...]}: points'
            ' in balls or by "indices", moved by "shift", "matrix" (4 x 4) or "positions"',
        )

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        if output is None:
            raise core.PointCloudError("Nothing would be written. Give --out or --out-dir.")
        wanted = _read_handles(arguments.handles)
        given = core.splats.read_file(path)
        splats = None if isinstance(given, core.files.PointTable) else given
        if splats is not None and output.suffix.lower() != ".ply":
            raise core.PointCloudError(f"Splats cannot be written to {output}. Let its name end in .ply.")
        points = given.points if isinstance(given, core.files.PointTable) else given.positions
        handles, goal = _moves(wanted, points)
        anchors = [_members(one, points, "anchors") for one in wanted.get("anchors", [])]
        out = core.splats.floating_rows(splats) if splats is not None else ()
        laplacian = core.build_laplacian(points, left_out=out)
        deformer = core.deform.CoarseDeformer(laplacian, handles, np.unique(np.concatenate(anchors)) if anchors else ())
        moved = deformer.solve(goal)
        written = []
        if isinstance(given, core.files.PointTable):
            written = core.files.write_points(output, replace(given, points=moved), double=not given.single)
        else:
            core.splats.write_splats(output, given.deformed(moved, deformer.gradients(moved)))
        farthest = float(np.linalg.norm(moved - points, axis=1).max())
        notices = [*given.notices, *deformer.notices, *written]
        return {"points": len(points), "farthest": farthest, "left_out": len(out), "notices": notices}


def _read_handles(path: Path) -> dict[str, Any]:
    """Read handles and anchors from a JSON file."""
    try:
        wanted = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise core.PointCloudError(f"{path} cannot be read: {error.strerror or error}. Check its name.") from error
    except ValueError as error:
        raise core.PointCloudError(f"{path} is no JSON: {error}. Mend it.") from error
    listed = isinstance(wanted, dict) and all(
        isinstance(wanted.get(name, []), list) and all(isinstance(one, dict) for one in wanted.get(name, []))
        for name in ("handles", "anchors")
    )
    if not listed or not wanted.get("handles"):
        raise core.PointCloudError(f'{path} names no handles. Give {{"handles": [{{...}}], "anchors": [{{...}}]}}.')
    return wanted


def _moves(wanted: dict[str, Any], points: Array) -> tuple[Array, Array]:
    """Return the indices of the handles, and their target positions."""
    members = [_members(one, points, "handles") for one in wanted["handles"]]
    goals = [_goal(one, points[rows]) for one, rows in zip(wanted["handles"], members, strict=True)]
    rows = np.concatenate(members)
    if len(np.unique(rows)) < len(rows):
        raise core.PointCloudError("Some points are in two handles. Make balls smaller, or name each point once.")
    return rows, np.concatenate(goals)


def _members(one: dict[str, Any], points: Array, name: str) -> Array:
    """Return the indices of the points of a handle: listed ones, or those in a ball."""
    if "indices" in one:
        rows = _numbers(one["indices"], (-1,), "indices")
        if not np.isin(rows, np.arange(len(points))).all():
            raise core.PointCloudError(
                f"The {name} name points that are not there. Give whole numbers below {len(points)}."
            )
        return rows.astype(int)
    if {"center", "radius"} <= one.keys():
        center, radius = _numbers(one["center"], (3,), "center"), _numbers(one["radius"], (), "radius")
        rows = np.flatnonzero(np.linalg.norm(points - center, axis=1) <= radius)
        if not len(rows):
            raise core.PointCloudError(f"No point is in a ball of the {name}. Give another center or a larger radius.")
        return rows
    raise core.PointCloudError(f'One of the {name} names no points. Give "indices", or "center" and "radius".')


def _goal(one: dict[str, Any], points: Array) -> Array:
    """Return the target positions of the points of a handle."""
    if "positions" in one:
        return _numbers(one["positions"], points.shape, "positions")
    if "matrix" in one:
        matrix = _numbers(one["matrix"], (4, 4), "matrix")
        return points @ matrix[:3, :3].T + matrix[:3, 3]
    if "shift" in one:
        return points + _numbers(one["shift"], (3,), "shift")
    raise core.PointCloudError('One of the handles goes nowhere. Give "shift", "matrix" or "positions".')


def _numbers(given: Any, shape: tuple[int, ...], name: str) -> Array:
    """Return numbers of a JSON file as an array; -1 in a shape stands for any length."""
    try:
        array = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    fits = array.ndim == len(shape) and all(size in (own, -1) for own, size in zip(array.shape, shape, strict=True))
    if not fits or not np.isfinite(array).all():
        raise core.PointCloudError(
            f'"{name}" must be {" x ".join(map(str, shape)) or "one"} finite numbers. Mend that.'
        )
    return array
