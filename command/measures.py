"""The table of measures of all parts of a surface, for the command line and for Blender's tools."""

from math import nan
from typing import NamedTuple

import numpy as np

from . import core

_LOST = "points are left out of the Laplacian, and not measured"


class PartRow(NamedTuple):
    """Measures of a part, in world lengths; NaN for what there is not.

    Attributes
    ----------
    name : str
        Such as "Component 0".
    points : int
    area, boundary_length, volume : float
        With their uncertainties; volumes only of closed components.
    mean, root_mean_square : float
        Of an attribute, by area.
    """

    name: str
    points: int
    area: float
    area_uncertainty: float
    boundary_length: float
    length_uncertainty: float
    volume: float = nan
    volume_uncertainty: float = nan
    mean: float = nan
    root_mean_square: float = nan

    def record(self) -> dict:
        """Return the numbers by name, None for what there is not."""
        return {name: None if value != value else value for name, value in self._asdict().items()}


def part_table(laplacian, labels, values, volume_of, progress):
    """Measure all parts of a surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    labels : ndarray, (n,) int, or None
        Numbers of segments, below zero for points in none.
    values : ndarray, (n,), or None
        Whose means are wanted.
    volume_of : callable or None
        Function of the operator and `progress` that returns its `EnclosedVolume`; None for no volumes.
    progress : callable
        Called as ``progress(stage, fraction)``.

    Returns
    -------
    list of PartRow
        Of all components, then of all segments.
    list of str
        Notices.
    """
    rows, notices = _rows(laplacian, "Component", None, values, progress), []
    if volume_of is not None:
        rows, notices = _with_volumes(rows, volume_of(laplacian, progress))
    if labels is not None:
        rows += _rows(laplacian, "Segment", labels, values, progress)
    return rows, [*notices, *_left_out(laplacian, labels, values), *laplacian.notices]


def _rows(laplacian, kind, labels, values, progress):
    """Return the rows of all parts of a kind."""
    found = core.measure_parts(laplacian, labels, progress=progress)
    means = (
        core.part_means(laplacian, values, labels) if values is not None else np.full((2, len(found.labels)), np.nan)
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
        PartRow(f"{kind} {label}", *of_part, mean=mean, root_mean_square=square)
        for label, (*of_part, mean, square) in zip(found.labels.tolist(), numbers, strict=True)
    ]


def _with_volumes(rows, found):
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


def _left_out(laplacian, labels, values):
    """Return notices of the points that do not count."""
    known, count = laplacian.component >= 0, len(laplacian.points)
    counts = {
        _LOST: np.count_nonzero(~known),
        "points are in no segment": 0 if labels is None else np.count_nonzero(known & (labels < 0)),
        "values are no numbers, and do not count for the mean": (
            0 if values is None else np.count_nonzero(known & ~np.isfinite(values))
        ),
    }
    return [f"{missing:,} of {count:,} {text}." for text, missing in counts.items() if missing]


def measured_line(rows, name, area_text) -> str:
    """Return how many parts of a cloud of some name are measured, and the area of all, as a text."""
    components = [row for row in rows if row.name.startswith("Component")]
    area, off = (sum(getattr(row, name) for row in components) for name in ("area", "area_uncertainty"))
    parts = f"{len(rows):,} part{'s' if len(rows) > 1 else ''}"
    return f"{name}: {parts} measured, area {area_text(area)} +- {100.0 * off / area:.2g} %"


def check_labels(labels, name: str, where: str):
    """Refuse an attribute that does not hold the numbers of segments, of a file or an object."""
    if labels.dtype.kind not in "iu" or labels.ndim != 1 or not (labels >= 0).any():
        raise core.PointCloudError(
            f"The attribute {name} of {where} does not hold whole numbers from zero, so it names no parts. Segment the"
            " points again, or remove it."
        )


def check_numbers(values, name: str, where: str):
    """Refuse an attribute of vectors whose mean is wanted, of a file or an object."""
    if values.ndim != 1:
        raise core.PointCloudError(
            f"The attribute {name} of {where} has {values.shape[1]} numbers at each point. Choose one with a single"
            " number."
        )
