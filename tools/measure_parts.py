"""Measures of all parts of a surface."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any, NamedTuple

import numpy as np

from . import core
from .quantities import SEGMENT, written_by
from .settings import Setting
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool


class PartRow(NamedTuple):
    """Measures of a part, in world lengths; NaN for what there is not."""

    name: str  # such as "Component 0"
    points: int
    # With their uncertainties; volumes only of closed components
    area: float
    area_uncertainty: float
    boundary_length: float
    length_uncertainty: float
    volume: float = nan
    volume_uncertainty: float = nan
    # Of an attribute, by area
    mean: float = nan
    root_mean_square: float = nan

    def record(self) -> dict[str, Any]:
        """Return the numbers by name, None for what there is not."""
        return {name: None if value != value else value for name, value in self._asdict().items()}


class Table(NamedTuple):
    """The measures of all parts, notices, the name of what the means are of, and what else there is of each part."""

    rows: list[PartRow]
    notices: list[str]
    attribute: str
    beside: Sequence[Mapping[str, Any]] = ()


class MeasureParts(Tool):
    """The tool."""

    name, verb, label = "measure_parts", "measure", "Measure Parts"
    help = "Measure every component and segment: points, area, boundary, volume, and the mean of an attribute"
    reference = "point cloud over whose surface the volumes of all parts are measured: fill above, and cut below it"
    settings = (
        Setting("volume", "Measure the volume within closed components, too. It takes longer", True),
        Setting(
            "source",
            "Numbers at the points whose mean is wanted; empty for the roughness, if there is one",
            "",
            label="Attribute",
        ),
    )
    panel, menu = Row("Measure", 2, 2), Row("Object", 3, 5)
    extended = True

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return the labels of segments, (n,), or None, and the numbers whose means are wanted, and their name."""
        labels = cloud.numbers("", SEGMENT) if cloud.has_numbers(SEGMENT) else None
        if labels is not None:
            check_labels(labels, SEGMENT, cloud.where)
        [usual] = written_by("roughness")
        name = own.source or (usual if cloud.has_numbers(usual) else "")
        values = cloud.numbers("source", name) if name else None
        if values is not None:
            check_numbers(values, name, cloud.where)
        return labels, values, name

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        labels, values, name = inputs
        return Table(*part_table(laplacian, labels, values, own.volume, progress), name)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        rows = found.rows
        components = [row for row in rows if row.name.startswith("Component")]
        area, off = (sum(getattr(row, name) for row in components) for name in ("area", "area_uncertainty"))
        parts = f"{len(rows):,} part{'s' if len(rows) > 1 else ''}"
        line = f"{parts} measured, area {length(area, 2)} ± {100.0 * off / area:.2g} %"
        beside = found.beside or [{}] * len(rows)
        figures = {"parts": [row.record() | more for row, more in zip(rows, beside, strict=True)]}
        return Outcome({}, line, found.notices, figures=figures, made=rows)


def part_table(
    laplacian: Laplacian, labels: Array | None, values: Array | None, volume: bool, progress: Progress
) -> tuple[list[PartRow], list[str]]:
    """Measure all components of a surface, then all segments by labels, (n,) int, below zero for points in none.

    Of values, (n,), the means are among the measures. Returns notices, too.
    """
    rows, notices = _rows(laplacian, "Component", None, values, progress), list[str]()
    if volume:
        try:
            rows, notices = _with_volumes(rows, core.measure.enclosed_volume(laplacian, progress=progress))
        except core.TooFewPointsError as error:  # for a mesh, not for what else is measured
            notices = [f"There is no volume: {error}"]
    if labels is not None:
        rows += _rows(laplacian, "Segment", labels, values, progress)
    return rows, [*notices, *_left_out(laplacian, labels, values), *laplacian.notices]


def _rows(
    laplacian: Laplacian, kind: str, labels: Array | None, values: Array | None, progress: Progress
) -> list[PartRow]:
    """Return the rows of all parts of a kind."""
    found = core.measure.measure_parts(laplacian, labels, progress=progress)
    means = (
        core.measure.part_means(laplacian, values, labels)
        if values is not None
        else np.full((2, len(found.labels)), np.nan)
    )
    columns = (
        found.points,
        found.areas,
        found.area_uncertainties,
        found.boundary_lengths,
        found.length_uncertainties,
    )
    numbers = zip(*(column.tolist() for column in (*columns, *means)), strict=True)
    return [
        PartRow(f"{kind} {label}", *of_part)._replace(mean=mean, root_mean_square=square)
        for label, (*of_part, mean, square) in zip(found.labels.tolist(), numbers, strict=True)
    ]


def _with_volumes(rows: list[PartRow], found: "core.measure.EnclosedVolume") -> tuple[list[PartRow], list[str]]:
    """Return the rows of components with the volumes of those that are closed, and notices of the others."""
    closed = (found.openings == 0) & (found.volumes > 0.0)
    for number in np.flatnonzero(closed).tolist():
        volume, off = float(found.volumes[number]), float(found.uncertainties[number])
        rows[number] = rows[number]._replace(volume=volume, volume_uncertainty=off)
    open_ones = np.count_nonzero(~closed)
    notice = (
        f"{open_ones:,} of {len(closed):,} components are not closed, or have too few points, and have no volume."
        " Volume of Measure Selection closes openings."
    )
    return rows, [notice] if open_ones else []


def _left_out(laplacian: Laplacian, labels: Array | None, values: Array | None) -> list[str]:
    """Return notices of the points that do not count."""
    known, count = laplacian.component >= 0, len(laplacian.points)
    counts = {
        "points are left out of the Laplacian, and not measured": np.count_nonzero(~known),
        "points are in no segment": 0 if labels is None else np.count_nonzero(known & (labels < 0)),
        "values are no numbers, and do not count for the mean": (
            0 if values is None else np.count_nonzero(known & ~np.isfinite(values))
        ),
    }
    return [f"{missing:,} of {count:,} {text}." for text, missing in counts.items() if missing]


def check_labels(labels: Array, name: str, where: str) -> None:
    """Refuse an attribute that does not hold the numbers of segments, of a file or an object."""
    if labels.dtype.kind not in "iu" or labels.ndim != 1 or not (labels >= 0).any():
        raise core.PointCloudError(
            f"The attribute {name} of {where} does not hold whole numbers from zero, so it names no parts. Segment the"
            " points again, or remove it."
        )


def check_numbers(values: Array, name: str, where: str) -> None:
    """Refuse an attribute of vectors whose mean is wanted, of a file or an object."""
    if values.ndim != 1:
        raise core.PointCloudError(
            f"The attribute {name} of {where} has {values.shape[1]} numbers at each point. Choose one with a single"
            " number."
        )


TOOL = MeasureParts()
