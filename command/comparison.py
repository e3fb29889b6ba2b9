"""Distances of a cloud from the surface of another one, for the command line and for Blender's tool."""

import numpy as np

from . import core
from .alignment import check_found
from .quantities import COMPARED
from .settings import Setting

COMPARE = {
    setting.name: setting
    for setting in (
        Setting(
            "align_first", "Move the object onto the other cloud before it is compared, as Align Points does", False
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


def compared(points, normals, laplacian, align_first, greatest, names, advice, progress):
    """Measure distances of points from the surface of another cloud.

    Parameters
    ----------
    points, normals : ndarray, (n, 3)
        In the coordinates of the other cloud.
    laplacian : LaplaceBeltrami
        Of the other cloud.
    align_first, greatest
        Values of the settings in `COMPARE`.
    names : tuple of str
        Of both clouds.
    advice : str
        What to do where they cannot be aligned.
    progress : callable
        Called as ``progress(stage, fraction)``, from 0.8 on.

    Returns
    -------
    Deviation
    Alignment or None
        How the points were moved, if they were.
    """
    aligned = None
    if align_first:
        aligned = core.align(points, laplacian.points, progress=lambda stage, _: progress(stage, 0.8))
        check_found(aligned, *names, advice)
        linear = aligned.matrix[:3, :3]
        points, normals = points @ linear.T + aligned.matrix[:3, 3], normals @ linear.T
    found = core.surface_deviation(
        points,
        normals,
        laplacian,
        greatest or None,
        progress=lambda stage, fraction: progress(stage, 0.8 + 0.2 * fraction),
    )
    if not found.known.any():
        raise core.PointCloudError(
            f'No point of "{names[0]}" has the surface of "{names[1]}" above or below it. Move them onto each other,'
            " or raise Greatest Distance."
        )
    return found, aligned


def distances(found):
    """Return the mean, the 95th percentile and the maximum of the distances of a `Deviation`."""
    sizes = np.abs(found.distance[found.known])
    return float(sizes.mean()), float(np.percentile(sizes, 95.0)), float(sizes.max())


def line(found, name, other, length_text) -> str:
    """Return the distances of a `Deviation` as a text, with lengths written by a function."""
    mean, within, most = map(length_text, distances(found))
    return f"{name}: {mean} from {other} on average, 95 % within {within}, {most} at most"


def left_out(found, other) -> list:
    """Return a notice of the points that are not compared, if any."""
    left = np.count_nonzero(~found.known)
    notice = (
        f"{left:,} of {len(found.known):,} points lie beside the surface of {other}, or too far from it: they are"
        f" not compared, and {COMPARED} is false there."
    )
    return [notice] if left else []


def figures(found) -> dict:
    """Return what the command line prints of a `Deviation`."""
    mean, within, most = distances(found)
    return {
        "compared_count": int(np.count_nonzero(found.known)),
        "mean_distance": mean,
        "distance_95": within,
        "greatest_distance": most,
    }
