"""Pair weights of maximum entropy: as close to the kernel's as its own moments around every point allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..algebra import blocks, by_blocks, chebyshev_steps, eliminate, on_all_cores
from ..geometry import LARGEST, MET, TERMS, Cloud, EdgeTerms, Patch, arc_ahead, dots, frames, lengthened, put_terms
from ..kernel import SECOND_MOMENT
from ..types import Floats, Ints, Report
from .curvature import second_moment, uneven

_ROUNDS = 16  # of the solver, at most
_SMALLEST = 1e-6  # residual of the moments that is solved for: by a larger one, results would change with the origin
_BLOCK = 1 << 13  # points worked on at one time
_KERNEL = np.eye(TERMS)[:, :1]  # moments of the kernel, (5, 1)
_FASTEST = 2.5  # bound of the preconditioned eigenvalues: 2, and a margin, as the equations change on the way


@dataclass(frozen=True)
class Balance:
    """Balanced weights and how well their moments are met."""

    factor: Floats  # (p,), by which each pair's weight is multiplied, positive
    residual: Floats  # (m,), relative error of the moments of each point


def balance_weights(
    cloud: Cloud, distance: Floats, weights: Floats, areas: Floats, report: Report = lambda: None
) -> Balance:
    """Find factors of the pair weights that give them the moments of the kernel.

    For the operator to be right on every function that is quadratic along the surface, the weights of a point i must
    have no first moment, ``sum_j w_ij u_ij = 0``, and the second moment ``sum_j w_ij u_ij u_ij^T = 2 v_i m_i I``, where
    u_ij is the offset of j in the tangent plane of i, as long as their distance along the surface, and m_i = 1 up to
    curvature. Of all symmetric positive weights with these moments those are taken that are closest to the kernel's own
    in relative entropy (as in local maximum-entropy approximation; Arroyo and Ortiz 2006):
    ``w_ij exp((p_i(u_ij) + p_j(u_ji)) / 2)`` with a quadratic polynomial p_i without a constant for each point. Its
    coefficients solve a convex problem, whose gradient is the error of the moments.

    Next to a boundary images complete the sums, and functions do not change across it: the quadratic ones are the
    square of the distance to it, and those along it. A pair and its image take one factor.

    It is solved by Newton's method point by point, the other ends of the pairs fixed, in steps of one at most, with
    Chebyshev's acceleration: the equations of all points, over those of each alone, have their eigenvalues in [0, 2],
    as each pair adds the square of a sum of its ends to the entropy, and that of a difference would be positive too. So
    what is done at a point depends on the points around it alone, not on those of the whole cloud. A point whose
    moments are met is left alone, and all ends where all are. Where a few points lie in a row, or on one side, no
    weights have these moments, and the residual is large.

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
    terms, step = np.zeros((TERMS, len(areas))), np.zeros((TERMS, len(areas)))
    slowest = _FASTEST / (1.0 + 0.25 * _ROUNDS**2)  # so many rounds reduce its component to 1 / cosh(4)
    rates = chebyshev_steps(slowest, _FASTEST)
    for number in range(_ROUNDS + 1):
        if number < 2:  # the first round, half a step, goes nearly all the way: later Jacobians differ little
            found, inverse = moments.with_inverse(terms)
        else:
            found = moments.of(terms)
        residual = _residual(found)
        if number == _ROUNDS or residual.max() < _SMALLEST:
            break
        kept, rate = next(rates) if number else (0.0, 0.5)
        step = _take_step(terms, step, kept, rate, inverse, found, residual)
    return Balance(moments.factor, residual)


def _residual(found: Floats) -> Floats:
    """Return by how much moments, (5, m), miss those of the kernel, (m,)."""

    def measure(rows: slice) -> Floats:
        missing = _KERNEL - found[:, rows]
        return np.sqrt(dots(missing, missing))

    return by_blocks(measure, found.shape[1])


def _take_step(
    terms: Floats, before: Floats, kept: float, rate: float, inverse: Floats, found: Floats, residual: Floats
) -> Floats:
    """Add the next steps to the coefficients of points, (5, m), in place; return them.

    They follow from those before and from the moments found, and are of length one at most.
    """
    result = np.empty_like(before)

    def change(rows: slice) -> None:
        gradient = _KERNEL - found[:, rows] - MET * terms[:, rows]
        step = kept * before[:, rows] + rate * np.einsum("abm,bm->am", inverse[:, :, rows], gradient)
        step /= np.maximum(np.sqrt(dots(step, step)), 1.0)
        step[:, residual[rows] < _SMALLEST] = 0.0
        result[:, rows] = step
        terms[:, rows] += step

    on_all_cores(change, blocks(before.shape[1], _BLOCK))
    return result


def _trace(cloud: Cloud, weights: Floats, areas: Floats) -> Floats:
    """Return the trace of the weights' second moments over 4 areas, as the integral gives it, (m,).

    That of the curved surface, times ``1 + mu2 Laplacian(h^2) / 8`` where h varies: h_ij of a pair is h at its middle,
    which is on the side of the wider kernel more often.
    """
    pairs, squared = cloud.pairs, cloud.pairs.lengths**2

    def changes(patch: Patch) -> tuple[list[Floats], list[Floats]]:
        change = weights[patch.pairs] * (patch.second(squared) - patch.first(squared))
        return [change], [-change]

    gain = pairs.over_ends(changes, 1)[0] * (SECOND_MOMENT / 8.0) / areas
    return second_moment(pairs.lengths, cloud.gaussian_curvature) * (1.0 + uneven(gain))


class _Moments:
    """The moments of weights around every point, in units of those of the kernel.

    `factor`, (p,), is by what each pair's weight was multiplied last.
    """

    def __init__(self, cloud: Cloud, distance: Floats, weights: Floats, unit: Floats, report: Report) -> None:
        pairs, lengths = cloud.pairs, cloud.pairs.lengths
        self._pairs, self._weights, self._unit, self._report = pairs, weights, unit, report
        self.factor = np.empty(len(weights))
        # The offsets from both ends, in the tangent planes there over h; next to boundaries, the terms of some pairs.
        self._offsets = np.empty((2, 2, len(weights)), dtype=np.float32)  # seven digits, of numbers about one
        places, normals = pairs.points.T.copy(), cloud.normals.T.copy()
        tangents = frames(cloud.normals)[:, :, 1:].transpose(2, 1, 0).copy()
        near, edges = cloud.boundary.reached(lengths), EdgeTerms(cloud.boundary, lengths, tangents)
        edge = np.where(near, np.arange(len(near)), -1)

        def describe(patch: Patch) -> list[tuple[Ints, Any]]:
            ends, length = (patch.first, patch.second), distance[patch.pairs]
            chord, left, right = patch.second(places) - patch.first(places), patch.first(normals), patch.second(normals)
            right *= np.where(dots(left, right) < 0.0, -1.0, 1.0)
            change = arc_ahead(dots(chord, left), dots(chord, right))
            at_edges: list[tuple[Ints, Any]] = []
            offsets = chord + change * right, change * left - chord
            for stored, end, offset in zip(self._offsets, ends, offsets, strict=True):
                x, y = (dots(offset, end(axis)) for axis in tangents)
                stored[:, patch.pairs] = x, y = lengthened(x, y, length / end(lengths))
                point = end(edge)
                rows = np.flatnonzero(point >= 0)
                at_edges.append((rows, edges.terms(point[rows], x[rows], y[rows]) if len(rows) else 0.0))
            return at_edges

        at_edges = on_all_cores(describe, pairs.patches, report)
        self._at_edges = {patch.pairs.start: found for patch, found in zip(pairs.patches, at_edges, strict=True)}

    def of(self, terms: Floats) -> Floats:
        """Return the moments of the weights times their factors, (5, m); those of the kernel are (1, 0, 0, 0, 0).

        The factors are those of polynomials with these coefficients, (5, m), and kept.
        """

        def weighted(patch: Patch) -> Floats:
            basis = self._basis(patch)
            basis *= self._weigh(patch, basis, terms)
            return basis

        return self._sums(weighted, TERMS)

    def with_inverse(self, terms: Floats) -> tuple[Floats, Floats]:
        """Return the moments, and the inverse Hessian of the entropy by the coefficients of each point, (5, 5, m)."""
        places = [(i, j) for i in range(TERMS) for j in range(i + 1)]

        def products(patch: Patch) -> list[Iterator[Floats]]:
            basis = self._basis(patch)
            weighted = self._weigh(patch, basis, terms) * basis
            return [summed(*end) for end in zip(weighted, basis, strict=True)]

        def summed(own: Floats, other: Floats) -> Iterator[Floats]:
            yield from own
            for i, j in places:
                yield own[i] * other[j]

        left, right = np.transpose(places)
        sums = self._sums(products, TERMS + len(places))
        inverse = np.empty((TERMS, TERMS, sums.shape[1]))

        def invert(rows: slice) -> None:
            curvature = np.empty((TERMS, TERMS, rows.stop - rows.start))
            curvature[left, right] = curvature[right, left] = 0.5 * sums[TERMS:, rows]
            curvature[range(TERMS), range(TERMS)] += MET
            inverse[:, :, rows] = eliminate(curvature)

        on_all_cores(invert, blocks(sums.shape[1], _BLOCK))
        return sums[:TERMS], inverse

    def _sums(self, values: Callable[[Patch], Any], count: int) -> Floats:
        """Return the sums of quantities of pairs at both ends, in the unit, (count, m)."""
        sums = self._pairs.over_ends(values, count, self._report)
        sums /= self._unit
        return sums

    def _basis(self, patch: Patch) -> Floats:
        """Return the terms of the pairs of a patch, (2, 5, pairs), as each end sees them."""
        result = np.empty((2, TERMS, patch.pairs.stop - patch.pairs.start))
        at_edges = self._at_edges[patch.pairs.start]
        for basis, offset, (rows, terms) in zip(result, self._offsets[:, :, patch.pairs], at_edges, strict=True):
            put_terms(offset[0], offset[1], basis)
            basis[:, rows] = terms
        return result

    def _weigh(self, patch: Patch, basis: Floats, terms: Floats) -> Floats:
        """Return the weights of a patch times their factors, by the terms of its pairs and coefficients, (5, m)."""
        power = np.einsum("tp,tp->p", basis[0], patch.first(terms))
        power += np.einsum("tp,tp->p", basis[1], patch.second(terms))
        power *= 0.5
        factor = np.exp(np.clip(power, -LARGEST, LARGEST), out=self.factor[patch.pairs])
        return self._weights[patch.pairs] * factor
