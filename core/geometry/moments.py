"""Moments of pair weights: the terms they are sums of, and how well any weights around a point can meet them."""

from __future__ import annotations

import functools

import numpy as np

from ..algebra import blocks, eliminate, on_all_cores, shares
from ..kernel import SUPPORT, pair_kernel
from ..types import Floats, Ints
from .boundary import Boundary
from .nearest import Nearest
from .quadrics import along, chords, frames, gathered, lengthened
from .sheets import on_sheet

TERMS = 5  # of a point: trace of the second moment, first moment (2), the rest of the second (2)
_MOST = 160  # neighbors in a kernel, at most, that are looked at: with more, any sampling is dense enough
LARGEST = 2.0  # change of a weight's logarithm, at most: where more is needed the moments cannot be met
_STEPS = 8  # of Newton's method
MET = 2e-3  # relative residual of the moments that is small enough; the ridge of their equations, too
_BLOCK = 1 << 13  # points worked on at one time: of fewer, cores wait for each other


class EdgeTerms:
    """The terms of points next to boundaries, where the images make all functions even across them."""

    def __init__(self, boundary: Boundary, lengths: Floats, tangents: Floats) -> None:
        self._tangents, self._outward = tangents, boundary.outward
        self._inside = np.minimum(boundary.distance / lengths[:, None], SUPPORT).T
        self._corner = self._inside[1] < SUPPORT

    @functools.cached_property
    def _across(self) -> Floats:
        across = np.einsum("tci,isc->sti", self._tangents, self._outward)
        return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)

    def terms(self, rows: Ints, x: Floats, y: Floats) -> tuple[Floats, ...]:
        """Return the terms of the offsets (x, y) from some points, (5, k).

        The first is the change of the squared distance n to the boundary, ``s^2 - 2 n s`` for an offset by s towards
        it. Next to a corner, where there are two boundaries, there are no others.
        """
        (to_x, to_y), (other_x, other_y) = self._across[:, :, rows]
        along = to_x * y - to_y * x
        step, other = to_x * x + to_y * y, other_x * x + other_y * y
        first = step * (step - 2.0 * self._inside[0, rows])
        second = np.where(self._corner[rows], other * (other - 2.0 * self._inside[1, rows]), along**2)
        none = np.zeros_like(x)
        return first + second, np.where(self._corner[rows], 0.0, along), none, second - first, none


def put_terms(x: Floats, y: Floats, terms: Floats) -> None:
    """Compute the terms of offsets, in units of h: ``x^2 + y^2, x, y, x^2 - y^2, 2 x y``, into (5, ...)."""
    square, first, second, difference, product = terms
    first[:], second[:] = x, y  # in the precision of the terms: to convert at each step takes longer than the steps
    np.multiply(first, first, out=square)
    np.multiply(second, second, out=product)
    np.subtract(square, product, out=difference)
    square += product
    np.multiply(first, second, out=product)
    product *= 2.0


def least_error(
    nearest: Nearest, normals: Floats, areas: Floats, boundary: Boundary, lengths: Floats, rows: Ints
) -> Floats:
    """Return the least relative residual of the moments around some points, (k,), over all positive weights.

    Each point has the weights of the kernel times ``exp(p(u))``, with the quadratic polynomial p of the offset u that
    meets its moments best, as in `balance_weights`, but for itself alone: no other point has a say. The problem is
    convex in the five coefficients, and solved by Newton's method. Normals, (m, 3), may have any sign; areas and
    smoothing lengths are (m,). The residual is zero where the kernel holds more than 160 others.
    """
    result, tangents = np.zeros(len(rows)), frames(normals)[:, :, 1:].transpose(2, 1, 0).copy()
    edges, near = EdgeTerms(boundary, lengths, tangents), boundary.reached(lengths)

    def measure(part: slice) -> None:
        block, found = rows[part], result[part]
        found[:] = solve(block, nearest.distance[block, 1:], nearest.index[block, 1:])
        # More neighbors can only meet the moments better.
        open_ = np.flatnonzero((nearest.distance[block, -1] <= SUPPORT * lengths[block]) & (found > MET))
        places, reach = nearest.points[block[open_]], SUPPORT * lengths[block[open_]]
        count = nearest.tree.query_ball_point(places, reach, return_length=True)
        found[open_[count > _MOST]] = 0.0
        order = np.argsort(count, kind="stable")[: np.count_nonzero(count <= _MOST)]
        for some in shares(len(order), 2):  # half of them have few, and are not queried for many
            if some.stop > some.start:
                asked, most = open_[order[some]], count[order[some.stop - 1]]
                here = block[asked]
                distance, index = nearest.tree.query(nearest.points[here], k=range(2, most + 1))
                found[asked] = solve(here, distance, index)

    def solve(rows: Ints, distance: Floats, index: Ints) -> Floats:
        """Return the least error of some points with these neighbors."""
        lengths_here = lengths[rows, None]
        within = slice(np.count_nonzero(distance < SUPPORT * lengths_here, axis=1).max())
        distance, index = distance[:, within], index[:, within]
        density, folded = gathered(areas, index), np.flatnonzero(nearest.apart[rows].any(axis=1))
        density[folded] *= on_sheet(nearest, normals, rows[folded], index[folded], distance[folded])[0]
        distance = distance / lengths_here
        chord = chords(nearest.points, rows, index)
        x, y = (along(chord, axis[:, rows]) for axis in tangents)
        terms = np.empty((TERMS, *x.shape), dtype=np.float32)
        put_terms(*lengthened(x, y, distance), terms)
        weights = pair_kernel(distance)
        beside = np.flatnonzero(near[rows])
        if len(beside):
            width = x.shape[1]
            of_edge = edges.terms(np.repeat(rows[beside], width), terms[1, beside].ravel(), terms[2, beside].ravel())
            own, other = boundary.distance[rows[beside], None], boundary.distance[index[beside]]
            seen = np.isfinite(own) & np.isfinite(other)
            mirrored = np.where(seen, own, np.inf) * np.where(seen, other, 1.0) / lengths_here[beside, :, None] ** 2
            image = np.sqrt(distance[beside, :, None] ** 2 + 4.0 * mirrored)
            weights[beside] += pair_kernel(np.minimum(image, SUPPORT)).sum(axis=2)
            terms[:, beside] = np.reshape(of_edge, (TERMS, len(beside), width))
        weights *= density / (4.0 * lengths_here**2)
        return _solve(terms, weights.astype(np.float32))

    on_all_cores(measure, blocks(len(rows), _BLOCK))
    return result


def _solve(terms: Floats, weights: Floats) -> Floats:
    """Return the least distance from ``(1, 0, 0, 0, 0)`` of sums of terms, (5, k, views), over weights, (k, views)."""
    rows = np.arange(len(weights))
    result, coefficients = np.full(len(rows), np.inf), np.zeros((TERMS, len(rows)), dtype=terms.dtype)
    for step in range(_STEPS + 1):
        power = np.einsum("tik,ti->ik", terms, coefficients)
        # Half of the limit is left to the other ends of the pairs, which change the same weights.
        weighted = weights * np.exp(np.clip(power, -0.5 * LARGEST, 0.5 * LARGEST))
        products = [weighted * term for term in terms]
        missing = -np.array([product.sum(axis=1) for product in products])
        missing[0] += 1.0
        # A point that has converged is frozen: its result must not depend on the others in its block.
        known = result[rows]
        result[rows] = np.where(known > MET, np.minimum(known, np.linalg.norm(missing, axis=0)), known)
        open_ = result[rows] > MET
        if step == _STEPS or not open_.any():
            break
        equations = np.empty((TERMS, TERMS + 1, len(rows)))
        for row, product in enumerate(products):
            for column in range(row + 1):
                equations[row, column] = equations[column, row] = np.einsum("ik,ik->i", product, terms[column])
        equations[range(TERMS), range(TERMS)] += MET
        equations[:, TERMS] = missing
        change = eliminate(equations)[:, TERMS]
        coefficients += (change / np.maximum(np.linalg.norm(change, axis=0), 1.0)).astype(terms.dtype)
        if np.count_nonzero(open_) < 0.7 * len(rows):
            rows, terms, weights, coefficients = rows[open_], terms[:, open_], weights[open_], coefficients[:, open_]
    return result
