"""Pair weights of maximum entropy: as close to the kernel's as its own moments around every point allow."""

import itertools
import os
from dataclasses import dataclass

import numpy as np

from ..blocks import blocks, on_all_cores
from ..geometry import frames
from ..kernel import SECOND_MOMENT, SUPPORT
from .curvature import second_moment, uneven

_ROUNDS = 12  # of the solver, at most
_ENOUGH = 1e-3  # root mean square of that over h, which a first moment makes of a slope, at which it stops
_MEMORY = 5  # earlier rounds that a step is extrapolated from
_RIDGE = 1e-3  # of the entropy's curvature, where the points cannot tell the terms apart
_LARGEST = 1.0  # most that the logarithm of a weight may change: where more is asked for the moments cannot be met
_SMALLEST = 1e-8  # share of what rounds change that an extrapolation goes by: less would be rounding
_BLOCK = 1 << 16  # pairs worked on at one time, so that they stay in the cache
_AT_ONCE = 4  # sums over all pairs at most, each of which holds two numbers of each pair
_TERMS = 5  # of a point: trace of the second moment, first moment (2), the rest of the second (2)


@dataclass(frozen=True)
class Balance:
    """Balanced weights and how well their moments are met.

    Attributes
    ----------
    factor : ndarray, (p,)
        By which each pair's weight is multiplied, positive.
    residual : ndarray, (m,)
        What the moments of each point are off by, relatively.
    """

    factor: np.ndarray
    residual: np.ndarray


def balance_weights(cloud, distance, weights, areas, report=lambda: None):
    """Find factors of the pair weights that give them the moments of the kernel.

    For the operator to be right on every function that is quadratic along the surface, the weights of a point i must
    have no first moment, ``sum_j w_ij u_ij = 0``, and the second moment ``sum_j w_ij u_ij u_ij^T = 2 v_i m_i I``, where
    u_ij is the way to j along the surface as i sees it and m_i = 1 up to curvature. Of all symmetric positive weights
    with these moments those are taken that are closest to the kernel's own in relative entropy (as in local
    maximum-entropy approximation; Arroyo and Ortiz 2006): ``w_ij exp((p_i(u_ij) + p_j(u_ji)) / 2)`` with a quadratic
    polynomial p_i without a constant for each point. Its coefficients solve a convex problem, whose gradient is what
    the moments are off by.

    Next to a boundary images complete the sums, and functions do not change across it: quadratic are the square of the
    distance to it, and what they are along it. A pair and its image take one factor.

    It is solved by Newton's method point by point, the other ends of the pairs held, and Anderson's extrapolation from
    the last rounds. Where a few points lie in a row, or on one side, no weights have these moments: the residual says
    so.

    Parameters
    ----------
    cloud : Cloud
        Of m points, with p pairs.
    distance : ndarray, (p,)
        Distance of each pair along the surface.
    weights : ndarray, (p,)
        Pair weights, areas of both ends included, and those of the images in boundaries added to the pairs they are of.
    areas : ndarray, (m,)
        Area elements.
    report : callable
        Called before each block of pairs; may raise `Cancelled`.

    Returns
    -------
    Balance
    """
    lengths = cloud.pairs.lengths
    moments = _Moments(cloud, distance, weights, 4.0 * areas * _trace(cloud, weights, areas) / lengths**2, report)
    inverse = np.linalg.inv(moments.curvature() + _RIDGE * np.eye(_TERMS))
    goal = np.zeros((len(areas), _TERMS))
    goal[:, 0] = 1.0
    terms, earlier = np.zeros_like(goal), []
    for step in range(_ROUNDS + 1):
        missing = goal - moments.of(terms)
        residual = np.linalg.norm(missing, axis=1)
        if step == _ROUNDS or np.sqrt(np.mean((residual / lengths) ** 2)) < _ENOUGH:
            break
        change = np.einsum("iab,ib->ia", inverse, missing - _RIDGE * terms)
        earlier = [*earlier[-_MEMORY:], (terms, change)]
        terms = _extrapolate(earlier)
    return Balance(moments.factor(terms), residual)


def _extrapolate(earlier):
    """Return the next iterate of a fixed-point iteration from earlier ones and their changes (Anderson 1965)."""
    terms, change = earlier[-1]
    result = terms + change
    if len(earlier) > 1:
        slopes = np.stack([(before[1] - after[1]).ravel() for before, after in itertools.pairwise(earlier)])
        products = slopes @ slopes.T
        products += _SMALLEST * np.trace(products) * np.eye(len(slopes))
        share = np.linalg.solve(products, slopes @ change.ravel())
        for (before, after), part in zip(itertools.pairwise(earlier), share, strict=True):
            result = result - part * ((before[0] + before[1]) - (after[0] + after[1]))
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


class _Edges:
    """The terms of points next to boundaries, where the images make even what is odd across them."""

    def __init__(self, cloud, tangents):
        boundary, lengths = cloud.boundary, cloud.pairs.lengths[:, None]
        across = np.einsum("tci,isc->sti", tangents, boundary.outward)
        self._across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
        self._inside = np.minimum(boundary.distance / lengths, SUPPORT).T
        self._corner = self._inside[1] < SUPPORT

    def terms(self, rows, x, y):
        """Return the terms of the ways (x, y) from some points, (5, k).

        What counts is the square of the distance n to the boundary: it grows by ``s^2 - 2 n s`` on a way that leads by
        s towards it. Next to a corner, where there are two of them, that is all.
        """
        (to_x, to_y), (other_x, other_y) = self._across[:, :, rows]
        along = to_x * y - to_y * x
        step, other = to_x * x + to_y * y, other_x * x + other_y * y
        first = step * (step - 2.0 * self._inside[0, rows])
        second = np.where(self._corner[rows], other * (other - 2.0 * self._inside[1, rows]), along**2)
        none = np.zeros_like(x)
        return first + second, np.where(self._corner[rows], 0.0, along), none, second - first, none


class _Moments:
    """The moments of weights around every point, in units of those that the kernel has."""

    def __init__(self, cloud, distance, weights, unit, report):
        pairs = cloud.pairs
        self._pairs, self._weights, self._unit, self._report = pairs, weights, unit, report
        self._ends = pairs.first, pairs.second
        self._blocks = blocks(len(weights), _BLOCK)
        self._basis = np.empty((2, _TERMS, len(weights)), dtype=np.float32)  # seven digits, of terms about one
        # Fresh memory of this size costs as much as what is worked out in it, so it is used again.
        self._factor = np.empty(len(weights))
        self._spare = [np.empty((2, len(weights))) for _ in range(min(os.cpu_count() or 1, _AT_ONCE))]
        places, normals = pairs.points.T.copy(), cloud.normals.T.copy()
        tangents = frames(cloud.normals)[:, :, 1:].transpose(2, 1, 0).copy()
        near, edges = cloud.boundary.reached(pairs.lengths), _Edges(cloud, tangents)

        def describe(block):
            i, j = ends = [index[block] for index in self._ends]
            chord, left, right = places[:, j] - places[:, i], normals[:, i], normals[:, j]
            right *= np.where(_dot(left, right) < 0.0, -1.0, 1.0)
            # How far the geodesic bends away from the chord, to third order, within the tangent plane.
            turn = (_dot(chord, right) - _dot(chord, left)) / 6.0
            ways = chord + turn * right, turn * left - chord
            for basis, end, way in zip(self._basis[:, :, block], ends, ways, strict=True):
                x, y = (_dot(way, axis[:, end]) for axis in tangents)
                size = distance[block] / (np.maximum(np.hypot(x, y), 1e-300) * pairs.lengths[end])
                x, y = x * size, y * size
                basis[:] = x * x + y * y, x, y, x * x - y * y, 2.0 * x * y
                rows = np.flatnonzero(near[end])
                if len(rows):
                    basis[:, rows] = edges.terms(end[rows], x[rows], y[rows])

        on_all_cores(describe, self._blocks, report)

    def factor(self, terms):
        """Return the factor of each pair's weight, (p,), until the next call."""
        terms = terms.T.copy()

        def evaluate(block):
            power = np.zeros(block.stop - block.start)
            for end, basis in zip(self._ends, self._basis, strict=True):
                own = end[block]
                for values, part in zip(terms, basis, strict=True):
                    power += values[own] * part[block]
            np.exp(np.clip(0.5 * power, -_LARGEST, _LARGEST), out=self._factor[block])

        on_all_cores(evaluate, self._blocks, self._report)
        return self._factor

    def of(self, terms):
        """Return the moments of the weights times that factor, (m, 5); those of the kernel are (1, 0, 0, 0, 0)."""
        weights = self.factor(terms)
        weights *= self._weights
        return np.stack(self._sums((weights, part) for part in self._basis.swapaxes(0, 1)), axis=1)

    def curvature(self):
        """Return the second derivatives of the entropy for the terms of each point alone, (m, 5, 5)."""
        result = np.empty((len(self._unit), _TERMS, _TERMS))
        places = [(a, b) for a in range(_TERMS) for b in range(a + 1)]
        sums = self._sums((self._weights, self._basis[:, a], self._basis[:, b]) for a, b in places)
        for (a, b), values in zip(places, sums, strict=True):
            result[:, a, b] = result[:, b, a] = values
        return result

    def _sums(self, products):
        """Sum products of quantities of pairs, as each of their points sees them, at both ends, in the unit."""

        def add(factors):
            space = self._spare.pop()
            np.multiply(*factors[:2], out=space)
            for factor in factors[2:]:
                space *= factor
            total = self._pairs.half(space[0]).sum(axis=1) + self._pairs.half(space[1]).sum(axis=0)
            self._spare.append(space)
            return total / self._unit

        return on_all_cores(add, list(products), self._report, len(self._spare))


def _dot(left, right):
    return np.einsum("cp,cp->p", left, right)
