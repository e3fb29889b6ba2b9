"""The curve through the points of a boundary that is known, and how far other points are from it."""

import numpy as np
from scipy.spatial import cKDTree

from ..geometry import arc_squared
from ..types import Floats, Ints

_AROUND = 9  # nearest points of the boundary among which those before and after a point are sought
_OPPOSITE = -0.3  # cosine between the directions to both, at most
_ROUGH = 0.07  # median height of points over the line between their neighbors, in units of its length
_ROUNDS = 3  # of Newton's iteration for the foot


class BoundaryCurve:
    """Parabolas through each point of a boundary and its two neighbors along it, of points in any order [L].

    At least two are different ones: `points`, (m, 3), each first given at `first`, (m,). They are `rough` if scattered
    about a curve, as those found at the boundary of a random cloud, instead of along it.
    """

    def __init__(self, points: Floats) -> None:
        self.points, self.first = np.unique(points, axis=0, return_index=True)
        self._tree = cKDTree(self.points)
        _, other = self._tree.query(self.points, k=min(_AROUND, len(self.points)))
        step = self.points[other[:, 1:]] - self.points[:, None]
        length = np.linalg.norm(step, axis=2)
        every = np.arange(len(step))
        cosine = np.einsum("ikc,ic->ik", step, step[:, 0]) / (length * length[:, :1])
        after = np.argmax(cosine < _OPPOSITE, axis=1)
        ends = cosine[every, after] >= _OPPOSITE
        p, q = length[:, 0, None], length[every, after, None]
        back, forth = step[:, 0] / p, step[every, after] / q
        second = (back + forth) / (p + q)  # half the second derivative
        chord = step[every, after] - step[:, 0]
        height = np.linalg.norm(np.cross(step[:, 0], chord), axis=1)[~ends] / np.sum(chord**2, axis=1)[~ends]
        self.rough = bool(ends.all() or np.median(height) > _ROUGH)
        # Where there is none after it, at the end of a wire or in a corner, the curve ends.
        self._second = np.where(ends[:, None], 0.0, second)
        self._slope = np.where(ends[:, None], -back, forth - q * second)
        self._range = -p[:, 0], np.where(ends, 0.0, q[:, 0])

    def nearest(self, points: Floats) -> tuple[Floats, Ints]:
        """Find the nearest positions on the curve, (n, 3), and the nearest points of the boundary, (n,) int."""
        index = self._tree.query(points)[1]
        slope, second = self._slope[index], self._second[index]
        offset = points - self.points[index]
        t = np.zeros(len(points))
        for _ in range(_ROUNDS):
            along = slope + 2.0 * t[:, None] * second
            left = t[:, None] * slope + t[:, None] ** 2 * second - offset
            squared = np.einsum("ic,ic->i", along, along)
            curvature = squared + 2.0 * np.einsum("ic,ic->i", left, second)
            t = t - np.einsum("ic,ic->i", left, along) / np.maximum(curvature, 0.3 * squared)
            t = np.clip(t, self._range[0][index], self._range[1][index])
        return self.points[index] + t[:, None] * slope + t[:, None] ** 2 * second, index

    def distance(self, points: Floats, normals: Floats, foot: Floats, index: Ints, boundary_normals: Floats) -> Floats:
        """Return the distances of points from their feet along a surface, (n,), to fourth order.

        Normals, (n, 3), are unit vectors of any sign, as are those at the boundary's points, (m, 3); feet and indices
        are from `nearest`.
        """
        offset = points - foot
        other = boundary_normals[index]
        side = np.where(np.einsum("ic,ic->i", normals, other) < 0.0, -1.0, 1.0)
        heights = np.einsum("ic,ic->i", offset, other) * side, np.einsum("ic,ic->i", offset, normals)
        return np.sqrt(arc_squared(np.einsum("ic,ic->i", offset, offset), *heights))
