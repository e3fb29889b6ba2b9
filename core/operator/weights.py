"""Moments of the pair weights: those of the kernel make the operator right at every point, for slopes and bends."""

import numpy as np
from scipy import sparse

from ..geometry import frames
from ..kernel import SECOND_MOMENT
from .curvature import second_moment, uneven

_ROUNDS = 4
_BLOCK = 1 << 16  # pairs, at least, worked on at one time, so that their temporaries stay in the cache
_LARGEST = 0.1  # most that each term may change a weight


def balance_weights(cloud, distance, weights, areas, report=lambda: None):
    """Find factors of the pair weights that give them the moments of the kernel.

    For the operator to be right on every function that is quadratic along the surface, the weights of a point i must
    have no first moment, ``sum_j w_ij u_ij = 0``, and the second moment ``sum_j w_ij u_ij u_ij^T = 2 v_i m_i I``, where
    u_ij is the way to j along the surface as i sees it and m_i = 1 up to curvature. Areas from the unit-integral
    condition leave errors of both, as the sum over the points is not quite an integral. A pair takes the factor
    ``1 + (p_i(u_ij) + p_j(u_ji)) / 2``, with a p_i of each point: a constant, a linear and a traceless quadratic term.
    That keeps the weights symmetric, and, as the terms are bounded, positive.

    A few steps of Jacobi's iteration find them. They take away what changes from point to point, which is what is
    wrong, and leave alone linear terms that change slowly, which cancel between the two ends of a pair.

    Parameters
    ----------
    cloud : Cloud
        Of m points, with p pairs. Next to boundaries, where images complete the sums, points keep their weights.
    distance : ndarray, (p,)
        Distance of each pair along the surface.
    weights : ndarray, (p,)
        Pair weights, areas of both ends included.
    areas : ndarray, (m,)
        Area elements.
    report : callable
        Called before each block of pairs; may raise `Cancelled`.

    Returns
    -------
    ndarray, (p,)
    """
    pairs = cloud.pairs
    lengths = pairs.lengths
    free = ~cloud.boundary.reached(lengths)
    blocks = list(_Block.of(cloud, distance, weights, report))
    moment = 4.0 * areas * _trace(cloud, weights, areas)
    # Terms of every point: constant, and the linear and quadratic one as complex numbers in the point's own frame.
    constant = np.zeros(len(areas))
    linear, quadratic = (np.zeros(len(areas), dtype=complex) for _ in range(2))
    for _ in range(_ROUNDS):
        trace, slope, traceless = (np.zeros(len(areas), dtype=kind) for kind in (float, complex, complex))
        for block in blocks:
            report()
            block.add_moments(constant, linear, quadratic, trace, slope, traceless)
        share = np.where(free, 1.0 / moment, 0.0)
        constant = np.clip(constant + (1.0 - trace * share) * free, -_LARGEST, _LARGEST)
        linear = _bounded(linear - 4.0 * slope * lengths * share)
        quadratic = _bounded(quadratic - 2.0 * traceless * share)
    result = np.empty(len(distance))
    for block in blocks:
        result[block.rows] = block.factor(constant, linear, quadratic)
    return result


def _trace(cloud, weights, areas):
    """Return the trace of the weights' second moments over 4 areas, as the integral gives it, (m,).

    That of the curved surface, times ``1 + mu2 Laplacian(h^2) / 8`` where h varies: pairs are as wide as h is in their
    middle, which is on the side of the wider kernel more often.
    """
    pairs, lengths = cloud.pairs, cloud.pairs.lengths
    squared = lengths**2
    gain = pairs.half(weights * (squared[pairs.second] - squared[pairs.first]))
    gain = (gain.sum(axis=1) - gain.sum(axis=0)) * (SECOND_MOMENT / 8.0) / areas
    return second_moment(lengths, cloud.gaussian_curvature) * (1.0 + uneven(gain))


def _bounded(terms):
    return terms * (_LARGEST / np.maximum(np.abs(terms), _LARGEST))


class _Block:
    """The pairs of some points in a row."""

    @classmethod
    def of(cls, cloud, distance, weights, report):
        """Yield all pairs, block by block."""
        pairs = cloud.pairs
        start = pairs.half(weights).indptr
        tangents = np.moveaxis(frames(cloud.normals)[:, :, 1:], 2, 0)
        # Coordinate by coordinate, which is faster than rows of three.
        vectors = [np.ascontiguousarray(rows.T) for rows in (pairs.points, cloud.normals, *tangents)]
        cuts = np.searchsorted(start, np.arange(0, start[-1], max(_BLOCK, len(start))))
        for low, high in zip(cuts, [*cuts[1:], len(start) - 1], strict=True):
            report()
            yield cls(cloud, distance, weights, start[low : high + 1], slice(low, high), *vectors)

    def __init__(self, cloud, distance, weights, start, points, places, normals, *tangents):
        pairs, self.points = cloud.pairs, points
        self.rows = slice(start[0], start[-1])
        self.first, self.second = i, j = pairs.first[self.rows], pairs.second[self.rows]
        self.start = start - start[0]
        self.distance = distance[self.rows]
        self.reach = self.distance / (0.5 * (pairs.lengths[i] + pairs.lengths[j]))
        self.weights = weights[self.rows]
        chord = [values[j] - values[i] for values in places]
        left, right = ([values[ends] for values in normals] for ends in (i, j))
        side = np.where(_dot(left, right) < 0.0, -1.0, 1.0)
        # How far the geodesic bends away from the chord, to third order, within the tangent plane.
        turn = (side * _dot(chord, right) - _dot(chord, left)) / 6.0
        self.here = _direction([d + side * turn * n for d, n in zip(chord, right, strict=True)], tangents, i)
        self.there = _direction([turn * n - d for d, n in zip(chord, left, strict=True)], tangents, j)

    def factor(self, constant, linear, quadratic):
        """Return the factor of each pair's weight."""
        result = np.ones(len(self.first))
        for ends, direction in ((self.first, self.here), (self.second, self.there)):
            terms = linear[ends].conj() * self.reach + quadratic[ends].conj() * direction
            result += 0.5 * (constant[ends] + terms.real * direction.real - terms.imag * direction.imag)
        return result

    def add_moments(self, constant, linear, quadratic, trace, slope, traceless):
        """Add the first moment of the weights, and the trace and the rest of the second, at both ends of each pair."""
        lever = self.weights * self.factor(constant, linear, quadratic) * self.distance
        moment = lever * self.distance
        shape = len(self.start) - 1, len(trace)
        for total, here, there in (
            (trace, moment, moment),
            (slope, lever * self.here, lever * self.there),
            (traceless, moment * self.here**2, moment * self.there**2),
        ):
            total[self.points] += sparse.csr_array((here, self.second, self.start), shape=shape).sum(axis=1)
            total += sparse.csr_array((there, self.second, self.start), shape=shape).sum(axis=0)


def _dot(left, right):
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def _direction(way, tangents, ends):
    """Return unit vectors in the tangent planes as complex numbers."""
    result = np.empty(len(ends), dtype=complex)
    x, y = (_dot(way, [values[ends] for values in axes]) for axes in tangents)
    size = np.maximum(np.sqrt(x * x + y * y), 1e-300)
    result.real, result.imag = x / size, y / size
    return result
