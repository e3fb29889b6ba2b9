"""The side of normals, for the command line and for Blender's tool."""

import numpy as np

from . import core
from .settings import Setting, place

ORIENT = {
    setting.name: setting
    for setting in (
        Setting(
            "method",
            "How the side is found",
            "WINDING",
            choices=("WINDING", "OUTSIDE", "VIEWPOINT", "ATTRIBUTE", "KEEP"),
        ),
        Setting("source", "Vector attribute, for Attribute", ""),
        Setting("holds", "Meaning of the vectors of the attribute", "POSITIONS", choices=("POSITIONS", "DIRECTIONS")),
        Setting("flip", "Reverse all normals afterwards", False),
    )
}
_METHODS = {"WINDING": "winding", "OUTSIDE": "outside"}  # in core; others are by viewpoints


def add_viewpoint(parser, implied, convert=place):
    """Add the option for a viewpoint, from a text; `implied` is what it sets, for the help."""
    parser.add_argument(
        "--viewpoint",
        type=convert,
        metavar="X,Y,Z",
        help="position in the coordinates of the file from which the points were seen, as --viewpoint=X,Y,Z where X"
        f" is below zero. Sets {implied}",
    )


def imply_method(parser, arguments):
    """Set the method that a viewpoint or a column implies, and refuse others, by `parser.error`."""
    implied = {"VIEWPOINT": arguments.viewpoint, "ATTRIBUTE": arguments.source}
    for method, value in implied.items():
        if value is None or len(value) == 0:
            continue
        if arguments.method is None:
            arguments.method = method
        elif arguments.method != method:
            option = "--viewpoint" if method == "VIEWPOINT" else "--source"
            parser.error(f"{option} goes with the method {method}, not {arguments.method}")


def check_vectors(vectors, name, where):
    """Refuse an attribute that does not hold vectors."""
    if vectors.ndim != 2:
        raise core.PointCloudError(
            f'The attribute "{name}" of {where} holds no vectors. Choose one with a vector for each point.'
        )


def seen_from(vectors, points, holds, name, where):
    """Return from where points were seen, and notices of those of which no vector says it.

    Parameters
    ----------
    vectors, points : ndarray, (n, 3)
        In the same coordinates.
    holds : str
        A value of the setting.
    name : str
        Of the attribute.
    where : str
        Of what it is.

    Returns
    -------
    ndarray, (n, 3)
        Points without a vector are seen from themselves, which says nothing of their side.
    list of str
    """
    there = np.isfinite(vectors).all(axis=1)
    count, missing = len(there), int(np.count_nonzero(~there))
    if missing == count:
        raise core.PointCloudError(
            f'The attribute "{name}" of {where} is NaN at all {count:,} points. Choose one that has vectors.'
        )
    places = np.where(there[:, None], vectors + points if holds == "DIRECTIONS" else vectors, points)
    told = f'{where}: {missing:,} of {count:,} points have no "{name}" (NaN). They take the side of the others around.'
    return places, [told] if missing else []


def outward(points, normals, areas, method, viewpoint, flip, keep):
    """Return normals, (n, 3), on the side that settings name.

    Parameters
    ----------
    points, normals : ndarray, (n, 3)
    areas : ndarray, (n,)
    method, flip
        Values of the settings in `ORIENT`.
    viewpoint : ndarray, (3,) or (n, 3), or None
        From where points were seen.
    keep : callable
        Function of the name of a method, a viewpoint and a function without arguments, which returns the result of the
        latter, new or kept.
    """
    sign = -1.0 if flip else 1.0
    if method == "KEEP":
        return sign * normals
    name = _METHODS.get(method, "viewpoint")
    return sign * keep(
        name,
        viewpoint,
        lambda: core.orient_normals(points, normals, method=name, viewpoint=viewpoint, areas=areas),
    )


def reversed_line(before, after, name) -> str:
    """Return how many normals are reversed as a text; `before` may be None."""
    if before is None:
        return f"{name}: normals oriented"
    count = int(np.count_nonzero(np.einsum("ij,ij->i", before, after) < 0.0))
    return f"{name}: {count:,} of {len(after):,} normals reversed"
