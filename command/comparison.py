"""Distances of a cloud from the surface of another one, for the command line and for Blender's tool."""

from typing import NamedTuple

import numpy as np

from . import core, quantities
from .alignment import check_found
from .naming import naming
from .settings import Setting

COMPARE = {
    setting.name: setting
    for setting in (
        Setting(
            "align_first", "Move the object onto the other cloud before it is compared, as Align Points does", False
        ),
        Setting(
            "distance",
            "Along the normal of each point, with a sign; or to the nearest place of the other surface, without one",
            "NORMAL",
            choices=("NORMAL", "NEAREST"),
        ),
        Setting(
            "greatest",
            "Points farther from the other surface are not compared; 0 for any distance",
            0.0,
            0.0,
            form="LENGTH",
        ),
    )
}


class Sided(NamedTuple):
    """A surface, and where it is known which side of it is the outer one.

    Attributes
    ----------
    laplacian : LaplaceBeltrami
    orientation : ndarray, (n, 3), or None
        Vectors to the side that was chosen, zero where none was.
    """

    laplacian: "core.LaplaceBeltrami"
    orientation: np.ndarray | None

    def sides(self):
        """Return 1 where normals point to the outer side, -1 where to the inner one, 0 where nothing tells, (n,)."""
        sides = core.measure.outer_sides(self.laplacian)
        if self.orientation is None:
            return sides
        chosen = self.orientation.any(axis=1) & (self.laplacian.component >= 0)
        return np.where(chosen, 1.0, sides)


class Compared(NamedTuple):
    """What a comparison found.

    Attributes
    ----------
    found : Deviation
        Of points that the analysis leaves out nothing is known along normals: they have none.
    aligned : Alignment or None
        How the points were moved, if they were.
    notices : list of str
        Of both analyses, and of what is in doubt or not compared.
    """

    found: "core.measure.Deviation"
    aligned: "core.measure.Alignment | None"
    notices: list


def compared(points, own, other, settings, names, advice, progress):
    """Measure distances of points from the surface of another cloud.

    Parameters
    ----------
    points : ndarray, (n, 3)
        In the coordinates of the other cloud.
    own, other : callable
        Functions of a progress callback that return the `Sided` of both clouds; the first is called for NORMAL only.
    settings
        An object with the values of those in `COMPARE` as attributes.
    names : tuple of str
        Of both clouds.
    advice : str
        What to do where they cannot be aligned.
    progress : callable
        Called as ``progress(stage, fraction)``.

    Returns
    -------
    Compared
    """
    nearest = settings.distance == "NEAREST"
    surface = None if nearest else own(_share(progress, 0.0, 0.4))
    with naming(names[1]):
        target = other(_share(progress, 0.4, 0.4))
    laplacian, aligned, turn = target.laplacian, None, np.eye(3)
    if settings.align_first:
        aligned = core.measure.align(points, laplacian.points, progress=lambda stage, _: progress(stage, 0.8))
        check_found(aligned, *names, advice)
        turn = aligned.matrix[:3, :3]
        points = points @ turn.T + aligned.matrix[:3, 3]
    measure = _share(progress, 0.8, 0.2)
    notices = [f"{names[1]}: {notice}" for notice in laplacian.notices]
    if nearest:
        found, kept = (
            core.measure.surface_deviation(laplacian, points, None, settings.greatest or None, progress=measure),
            None,
        )
    else:
        kept = surface.laplacian.component >= 0
        normals = surface.laplacian.normals[kept] @ turn.T
        sides = surface.sides()[kept]
        beyond = core.measure.sides_beside(laplacian, target.sides(), points[kept], normals)
        normals *= np.where((sides == 0.0) & (beyond != 0.0), beyond, 1.0)[:, None]
        part = core.measure.surface_deviation(
            laplacian, points[kept], normals, settings.greatest or None, progress=measure
        )
        found = core.measure.Deviation(*(np.zeros(len(points), dtype=values.dtype) for values in part))
        for whole, values in zip(found, part, strict=True):
            whole[kept] = values
        notices = [*surface.laplacian.notices, *notices]
        notices += _doubtful(np.count_nonzero(part.known & (sides == 0.0) & (beyond == 0.0)), part.known.sum(), names)
    if not found.known.any():
        raise core.PointCloudError(
            f'No point of "{names[0]}" has the surface of "{names[1]}" '
            + ("near it" if nearest else "above or below it")
            + ". Move them onto each other, or raise Greatest Distance."
        )
    return Compared(found, aligned, [*notices, *_left_out(found.known, kept, names[1])])


def _share(progress, begin, share):
    return lambda stage, fraction: progress(stage, begin + share * fraction)


def _doubtful(count, known, names):
    """Return a notice of the points whose sign nothing tells, if any."""
    if not count:
        return []
    return [
        f"The sign is in doubt at {count:,} of {known:,} compared points: neither {names[0]} nor {names[1]} has an"
        " outer side there, as a closed body or the ground has. Orient Normals by a viewpoint chooses one; Nearest has"
        " no sign."
    ]


def distances(found):
    """Return the mean, the 95th percentile and the maximum of the distances of a `Deviation`."""
    sizes = np.abs(found.distance[found.known])
    return float(sizes.mean()), float(np.percentile(sizes, 95.0)), float(sizes.max())


def line(found, name, other, length_text) -> str:
    """Return the distances of a `Deviation` as a text, with lengths written by a function."""
    mean, within, most = map(length_text, distances(found))
    return f"{name}: {mean} from {other} on average, 95 % within {within}, {most} at most"


def _left_out(known, kept, other) -> list:
    """Return notices of points that are not known, (n,) bool, and of those without normals, which are not kept."""
    beside, notices = np.count_nonzero(~known), []
    if kept is not None and not kept.all():
        strays = np.count_nonzero(~kept)
        beside -= strays
        notices.append(
            f"{strays:,} of {len(known):,} points are outliers or in small components, without a normal: they are not"
            f" compared, and {quantities.COMPARED} is false there."
        )
    if beside:
        notices.append(
            f"{beside:,} of {len(known):,} points lie beside the surface of {other}, or too far from it: they are not"
            f" compared, and {quantities.COMPARED} is false there."
        )
    return notices


def figures(found) -> dict:
    """Return what the command line prints of a `Deviation`."""
    mean, within, most = distances(found)
    return {
        "compared_count": int(np.count_nonzero(found.known)),
        "mean_distance": mean,
        "distance_95": within,
        "greatest_distance": most,
    }
