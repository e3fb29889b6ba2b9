"""Distances between neighbors along the surface, from their normals."""

from collections.abc import Callable

import numpy as np

from ..algebra import by_blocks
from ..types import Floats, Ints
from .nearest import AGREEING, NEXT, SMOOTH, Nearest
from .quadrics import chords, components


def arc_squared(squared: Floats, left: Floats, right: Floats, cosine: Floats | float = 1.0) -> Floats:
    """Return the squared length of arcs over chords, from the normals at both ends.

    ``s^2 = r^2 + (e - d)^2 (1 / 12 + c / 45) + (e + d)^2 / 20``, of the cubic that has these normals: the first term
    for the curvature that both ends share, exact on spheres and cylinders to sixth order of the arc's angle; the second
    for the difference of their curvatures.

    Parameters
    ----------
    squared : ndarray
        r^2, of the chord.
    left, right : ndarray
        d and e: heights of the chord along the first and along the second unit normal, both on one side.
    cosine : ndarray, optional
        1 - c, between the normals; 1 leaves out what is of sixth order.
    """
    return squared + (right - left) ** 2 * (1.0 / 12.0 + (1.0 - cosine) / 45.0) + (left + right) ** 2 / 20.0


def arc_ahead(left: Floats, right: Floats) -> Floats:
    """Return how much of the second normal, added to a chord, gives the direction of its arc at the first end.

    It differs from the chord's by a third of the angle between the normals, to third order; for the heights see
    `arc_squared`.
    """
    return (right - left) / 6.0


def bent_ways(
    squared: Floats, left: Floats, right: Floats, cosine: Floats, turn: Floats, sharp: Floats
) -> tuple[Floats, Floats]:
    """Return the squared length of the shortest paths over chords that may cross edges, and their tilt.

    Over the edge in which two planes meet it has two legs: ``s^2 = r^2 - 2 d e / (1 + cosine)``. In the plane of the
    first end its direction is that of the chord with ``-d / (1 + cosine)`` of the second normal added; for an arc see
    `arc_ahead`. What the normals turn by more than the surface bends is taken for an edge, as far as one is sure, and
    the rest for an arc; at a step, where both ends see the other one on the same side, for an arc the more, the more
    they do.

    Parameters
    ----------
    squared, left, right, cosine : ndarray
        As of `arc_squared`. Folds sharper than the normals of one sheet turn count as those.
    turn : ndarray
        What e - d would be by the curvatures at both ends.
    sharp : ndarray
        From 0 to 1, how sure an edge is.

    Returns
    -------
    squared, ahead : ndarray
    """
    change = right - left
    share = sharp * np.clip(1.0 - turn / np.where(change == 0.0, 1.0, change), 0.0, 1.0)
    share *= np.minimum(change**2 / np.maximum(left**2 + right**2, 1e-300), 1.0)
    open_ = np.maximum(1.0 + cosine, 1.0 - SMOOTH)
    legs, arc = squared - 2.0 * np.minimum(left * right, 0.0) / open_, arc_squared(squared, left, right, cosine)
    ahead = arc_ahead(left, right)
    return arc + share * (legs - arc), ahead - share * (left / open_ + ahead)


def circle_arc(chord: Floats, sine: Floats) -> Floats:
    """Return the length of circular arcs over chords, to all orders, by the sine of half their angle, |t| / (2 r)."""
    return chord * np.where(sine > 1e-4, np.arcsin(sine) / np.maximum(sine, 1e-4), 1.0)


def measure_squared_slope(nearest: Nearest, normals: Floats) -> Floats:
    """Measure the slopes between neighboring points that are too fine for the normals, which are fitted to many.

    Return the mean square of the slope, (m,), of the chords to the eight nearest neighbors against the mean normal of
    their ends, averaged over the neighborhood. It is of fourth order in the spacing on a smooth surface. Sharp edges,
    where normals change too fast between neighbors to be right, do not count: arcs make up for them already. Normals,
    (m, 3), may have any sign.
    """

    def measure(part: slice) -> Floats:
        rows, near = np.arange(part.start, part.stop), (part, slice(1, NEXT + 1))
        index, counted = nearest.index[near], nearest.weight[near] > 0.0
        cosine, left, right = heights_of_ends(chords(nearest.points, rows, index), normals, rows, index)
        height = left + np.where(cosine < 0.0, -right, right)
        across = counted & (np.abs(cosine) < SMOOTH)
        smooth = counted & ~across & (across.sum(axis=1) < AGREEING)[:, None]
        slope = np.where(smooth, (0.5 * height / nearest.distance[near]) ** 2, 0.0)
        return slope.sum(axis=1) / np.maximum(counted.sum(axis=1), 1)

    return nearest.averaged(by_blocks(measure, len(normals)))


def heights_of_ends(chord: Floats, normals: Floats, rows: Ints, other: Ints) -> tuple[Floats, Floats, Floats]:
    """Return what `pair_heights` does, for chords from some points, (k,) int, to others, (k, views) int.

    These are cosines of the normals, (m, 3), of both ends, and heights of the `chords`, (3, k, views), along the first
    and along the second, (k, views) each.
    """
    cosine, left, right = np.zeros((3, *other.shape))
    for step, own, there in zip(chord, normals[rows].T, components(normals, other), strict=True):
        here = own[:, None]
        cosine += there * here
        left += step * here
        right += step * there
    return cosine, left, right


def pair_heights(
    first: Callable[[Floats], Floats], second: Callable[[Floats], Floats], points: Floats, normals: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the chords of pairs, their heights along the first normal and along the second, and the normals' cosine.

    `first` and `second` return quantities of points, (..., m), at the first and at the second point of each of p pairs,
    (..., p). Points and normals, (3, m), have a row for each coordinate, as have chords, (3, p).
    """
    chord = second(points) - first(points)
    left, right = first(normals), second(normals)
    return chord, dots(chord, left), dots(chord, right), dots(left, right)


def dots(left: Floats, right: Floats) -> Floats:
    """Return the inner products of the columns of two arrays, (p,)."""
    return np.einsum("cp,cp->p", left, right)
