"""Distances of a cloud from the surface of another one."""

from typing import Any, NamedTuple

import numpy as np

from . import core
from .align_points import check_found, doubts
from .quantities import COMPARED, DEVIATION
from .settings import Choice, Setting
from .tool import Array, Cloud, Length, Outcome, PointTool, Progress, Row


class Compared(NamedTuple):
    """What a comparison found."""

    # Of points that the analysis leaves out nothing is known along normals: they have none
    found: "core.measure.Deviation"
    aligned: "core.measure.Alignment | None"  # how the points were moved, if they were
    other: str  # the name of the other cloud
    notices: list[str]  # of both analyses, and of what is in doubt or not compared


class Compare(PointTool):
    """The tool."""

    name, label = "compare", "Compare Points"
    help = "Measure the distance of points from the surface of those of another cloud"
    reference = "point cloud from whose surface distances are measured"
    settings = (
        Setting(
            "align_first", "Move the object onto the other cloud before it is compared, as Align Points does", False
        ),
        Setting(
            "distance",
            "Along the normal of each point, with a sign; or to the nearest place of the other surface, without one",
            "NORMAL",
            choices=(
                Choice(
                    "NORMAL",
                    "Along Normal",
                    "Along the normal of each point: positive on the outer side, negative within",
                ),
                Choice("NEAREST", "Nearest", "To the nearest place of the other surface, without a sign"),
            ),
        ),
        Setting(
            "greatest",
            "Points farther from the other surface are not compared; 0 for any distance",
            0.0,
            0.0,
            form="LENGTH",
            label="Greatest Distance",
            at_zero="Any",
        ),
    )
    panel, menu = Row("Two Scans", 1, 2), Row("Object", 2, 4)
    keeps_line = extended = True

    def writes(self, own: Any) -> tuple[str, ...]:
        return DEVIATION, COMPARED

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        return cloud, *cloud.reference()

    def compute(self, points: Array, inputs: Any, own: Any, progress: Progress) -> Any:
        cloud, other, shift = inputs
        nearest = own.distance == "NEAREST"
        surface = None if nearest else cloud.laplacian(_share(progress, 0.0, 0.4))
        laplacian = other.laplacian(_share(progress, 0.4, 0.4))
        points, aligned, turn = points + shift, None, np.eye(3)
        if own.align_first:
            aligned = core.measure.align(points, laplacian.points, progress=lambda stage, _: progress(stage, 0.8))
            check_found(aligned, cloud, other)
            turn = aligned.matrix[:3, :3]
            points = points @ turn.T + aligned.matrix[:3, 3]
        given: dict[str, Any] = {"greatest": own.greatest or None, "progress": _share(progress, 0.8, 0.2)}
        notices = [f"{other.name}: {notice}" for notice in laplacian.notices]
        if surface is None:
            found, kept = core.measure.surface_deviation(laplacian, points, None, **given), None
        else:
            kept = surface.component >= 0
            normals = surface.normals[kept] @ turn.T
            sides = _sides(surface, cloud.orientation)[kept]
            targets = _sides(laplacian, other.orientation)
            beyond = core.measure.sides_beside(laplacian, targets, points[kept], normals)
            normals *= np.where((sides == 0.0) & (beyond != 0.0), beyond, 1.0)[:, None]
            part = core.measure.surface_deviation(laplacian, points[kept], normals, **given)
            found = core.measure.Deviation(np.zeros(len(points)), np.zeros(len(points), dtype=bool))
            for whole, values in zip(found, part, strict=True):
                whole[kept] = values
            doubtful = part.known & (sides == 0.0) & (beyond == 0.0)
            counts = int(doubtful.sum()), int(part.known.sum())
            notices = [*surface.notices, *notices, *_doubtful(*counts, cloud.name, other.name)]
        if not found.known.any():
            raise core.PointCloudError(
                f'No point of "{cloud.name}" has the surface of "{other.name}" '
                + ("near it" if nearest else "above or below it")
                + ". Move them onto each other, or raise Greatest Distance."
            )
        return Compared(found, aligned, other.name, [*notices, *_left_out(found.known, kept, other.name)])

    def finish(self, found: Any, points: Array, own: Any, length: Length) -> Outcome:
        found, aligned, other, notices = found
        if aligned is not None:
            moved = f"It was moved: {aligned.overlap:.0%} of its points lie on {other}."
            notices = [moved, *doubts(aligned), *notices]
        sizes = np.abs(found.distance[found.known])
        numbers = float(sizes.mean()), float(np.percentile(sizes, 95.0)), float(sizes.max())
        mean, within, most = map(length, numbers)
        figures = {"compared_count": int(np.count_nonzero(found.known))}
        return Outcome(
            {DEVIATION: found.distance, COMPARED: found.known},
            f"{mean} from {other} on average, 95 % within {within}, {most} at most",
            notices,
            figures=figures | dict(zip(("mean_distance", "distance_95", "greatest_distance"), numbers, strict=True)),
            matrix=None if aligned is None else aligned.matrix,
        )


def _sides(laplacian: "core.LaplaceBeltrami", orientation: Array | None) -> Array:
    """Return 1 where normals point to the outer side, -1 where to the inner one, 0 where nothing tells, (n,)."""
    sides = core.measure.outer_sides(laplacian)
    if orientation is None:
        return sides
    chosen = orientation.any(axis=1) & (laplacian.component >= 0)
    return np.where(chosen, 1.0, sides)


def _share(progress: Progress, begin: float, share: float) -> Progress:
    return lambda stage, fraction: progress(stage, begin + share * fraction)


def _doubtful(count: int, known: int, name: str, other: str) -> list[str]:
    """Return a notice of the points whose sign nothing tells, if any."""
    if not count:
        return []
    return [
        f"The sign is in doubt at {count:,} of {known:,} compared points: neither {name} nor {other} has an"
        " outer side there, as a closed body or the ground has. Orient Normals by a viewpoint chooses one; Nearest has"
        " no sign."
    ]


def _left_out(known: Array, kept: Array | None, other: str) -> list[str]:
    """Return notices of points that are not known, (n,) bool, and of those without normals, which are not kept."""
    beside, notices = np.count_nonzero(~known), []
    if kept is not None and not kept.all():
        strays = np.count_nonzero(~kept)
        beside -= strays
        notices.append(
            f"{strays:,} of {len(known):,} points are outliers or in small components, without a normal: they are not"
            f" compared, and {COMPARED} is false there."
        )
    if beside:
        notices.append(
            f"{beside:,} of {len(known):,} points lie beside the surface of {other}, or too far from it: they are not"
            f" compared, and {COMPARED} is false there."
        )
    return notices


TOOL = Compare()
