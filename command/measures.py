"""The table of measures of all parts of a surface, for the command line and for Blender's tools."""

from math import nan
from typing import NamedTuple

import numpy as np

from . import core
from .sections import UP, add_normal
from .settings import place

OVER = "point cloud over whose surface the volumes of all parts are measured: fill above, and cut below it"
_VOLUMES = "above", "below", "difference", "difference_uncertainty"  # over a plane or a cloud
_TOLD = 5  # notices of volumes over a plane that are told
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


def part_table(laplacian, labels, values, volume, progress):
    """Measure all parts of a surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    labels : ndarray, (n,) int, or None
        Numbers of segments, below zero for points in none.
    values : ndarray, (n,), or None
        Whose means are wanted.
    volume : bool
        Whether to measure the volume within components.
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
    if volume:
        try:
            rows, notices = _with_volumes(rows, core.measure.enclosed_volume(laplacian, progress=progress))
        except core.TooFewPointsError as error:  # for a mesh, not for what else is measured
            notices = [f"There is no volume: {error}"]
    if labels is not None:
        rows += _rows(laplacian, "Segment", labels, values, progress)
    return rows, [*notices, *_left_out(laplacian, labels, values), *laplacian.notices]


def _rows(laplacian, kind, labels, values, progress):
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


class Base(NamedTuple):
    """What volumes are measured over: a plane, or along its normal the surface of another cloud.

    Attributes
    ----------
    point, normal : ndarray, (3,)
    ground : callable or None
        Function of a progress callback that returns the operator of the other cloud.
    shift : ndarray, (3,)
        From the coordinates of the points to those of the other cloud.
    name : str
        Of the other cloud.
    """

    point: np.ndarray
    normal: np.ndarray
    ground: object = None
    shift: np.ndarray = np.zeros(3)
    name: str = ""


def pile_over(laplacian, chosen, base, progress):
    """Measure the volume between a part, (n,) bool, and a `Base`, None for the plane through its rim."""
    if base is None:
        return core.measure.pile_volume(laplacian, chosen)
    heights = None
    if base.ground is not None:
        rows = np.flatnonzero(chosen & (laplacian.component >= 0))
        points, normals = laplacian.surface_points[rows] + base.shift, np.broadcast_to(base.normal, (len(rows), 3))
        found = core.measure.surface_deviation(base.ground(progress), points, normals, progress=progress)
        heights = np.full(len(chosen), nan)
        heights[rows] = np.where(found.known, found.distance, nan)
    return core.measure.pile_volume(laplacian, chosen, plane=(base.point, base.normal), heights=heights)


def base_of(plane, normal, place, ground=None, ground_place=None, name=""):
    """Return the `Base` that options give, None for none.

    Parameters
    ----------
    plane, normal : ndarray, (3,), or None
        A position in the coordinates of the file, and a vector across the plane; else upwards.
    place : ndarray, (3,)
        Less which the points are.
    ground : callable or None
        See `Base`.
    ground_place : ndarray, (3,)
        Less which the points of the other cloud are.
    name : str
        Of the other cloud.
    """
    if plane is None and ground is None:
        return None
    point = np.zeros(3) if plane is None else plane - place
    shift = np.zeros(3) if ground is None else place - ground_place
    return Base(point, UP if normal is None else normal, ground, shift, name)


def add_base(parser):
    """Add the options for the plane over which volumes are measured; that for another cloud is `--reference`."""
    parser.add_argument(
        "--plane",
        type=place,
        metavar="X,Y,Z",
        help="measure the volume of every part over a plane through this position, in the coordinates of the file",
    )
    add_normal(parser, ", to what counts as above, along which heights over --reference are")


def check_base(parser, arguments):
    """Refuse a normal without what volumes are measured over."""
    if arguments.normal is not None and arguments.plane is None and not arguments.reference:
        parser.error("--normal goes with --plane or --reference")


def volumes_over(laplacian, rows, labels, base, progress):
    """Measure the volumes of parts over a `Base`.

    Returns
    -------
    list of dict
        Of each of the rows of a table of parts, by name; empty without a base.
    list of str
        Notices, which name the part.
    """
    if base is None:
        return [{} for _ in rows], []
    volumes, notices, failed = [], [], []
    for row in rows:
        kind, label = row.name.split()
        part = (laplacian.component if kind == "Component" else labels) == int(label)
        try:
            found = pile_over(laplacian, part, base, progress)
        except core.InvalidPointsError as error:  # no part of the other cloud is above or below it
            volumes.append(dict.fromkeys(_VOLUMES))
            failed.append(error)
            notices.append(f"{row.name}: {error}")
            continue
        numbers = found.above, found.below, found.above - found.below, found.uncertainty
        volumes.append(dict(zip(_VOLUMES, numbers, strict=True)))
        notices += [f"{row.name}: {notice}" for notice in found.notices]
    if len(failed) == len(rows):
        raise failed[0]
    more = len(notices) - _TOLD
    if more > 0:
        notices[_TOLD:] = [f"There are {more:,} more such notices of parts."]
    of_ground = [] if base.ground is None else base.ground(progress).notices
    return volumes, [*(f"{base.name}: {notice}" for notice in of_ground), *notices]
