"""Functions of the operator that carry heat and waves from one time to another."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..algebra import (
    Rows,
    chebyshev_coefficients,
    chebyshev_nodes,
    chebyshev_sum,
    chebyshev_terms,
    dissect,
    factorize,
    largest_eigenvalue,
    on_all_cores,
    workers,
)
from ..errors import InvalidPointsError
from ..geometry import check_values
from ..operator import LaplaceBeltrami, symmetric_form
from ..types import Floats, Ints, Progress, Response

Advance = Callable[[Floats, Progress | None], Floats]
"""From functions on the points, (k, n), to those one step later, of the same shape."""

_LEAST = 1e-14  # of a coefficient, as a share of the largest value: smaller ones hold rounding errors
_HEAT, _WAVE = 5e3, 7.5e2  # longest steps by polynomials, in units of the highest frequency: their degree is 400 then
_IMPLICIT = 8  # implicit steps in place of a longer one of heat
_ENDLESS = 1e12  # ratio of step to highest frequency from which nothing but constants is left


class Propagator:
    """Steps in time of functions on the points that are not left out; the others stay.

    Of all points, `count`, those that are not left out are in the order, (m,), in which neighbors are near in memory.
    """

    def __init__(self, laplacian: LaplaceBeltrami, progress: Progress | None) -> None:
        report = progress or _silent
        self._report = report
        self.count = len(laplacian.points)
        self.order, self._root, matrix = symmetric_form(
            laplacian.stiffness,
            laplacian.points,
            laplacian.areas,
            laplacian.component,
            lambda: report("Equations", 0.0),
        )
        size = len(self.order)

        def product(y: Floats) -> Floats:
            report("Equations", 0.2)
            return np.asarray(matrix @ y)

        self._top = largest_eigenvalue(product, size)
        self._points = laplacian.points[self.order]
        # Its eigenvalues lie in [-1, 1], as those of all Chebyshev polynomials of it do.
        self._matrix = ((2.0 / self._top) * matrix - sparse.eye_array(size, format="csr")).tocsr()

    def heat(self, time: float, accuracy: float = 0.0) -> Advance:
        """Return the step of heat, ``exp(-time * operator)`` [L^2].

        Functions that are constant at most points are advanced where they change, up to an error of their range.
        """
        if time * self._top > _HEAT:
            return self._implicit_heat(time)
        weights = self._polynomial(lambda eigenvalues: np.exp(-time * eigenvalues))

        def advance(rows: Floats, progress: Progress | None) -> Floats:
            result, report = rows.copy(), progress or _silent

            def change(number: int) -> bool:
                values = rows[number, self.order]
                found = self._around(weights, values, time, accuracy * float(np.ptp(values)))
                if found is not None:
                    result[number, self.order[found[0]]] += found[1]
                return found is not None

            numbers = range(len(rows)) if accuracy else []
            done = on_all_cores(change, numbers, lambda: report("Step", 0.0))
            left = np.delete(np.arange(len(rows)), np.flatnonzero(done))
            if len(left):
                before = rows[np.ix_(left, self.order)] / self._root
                result[np.ix_(left, self.order)] = self._root * self._combine(weights, before, progress)
            return self._within(rows, result)

        return advance

    def _around(self, weights: Floats, values: Floats, time: float, error: float) -> tuple[Ints, Floats] | None:
        """Return where a function that is constant at most points changes, and by how much; None for others.

        The points around those that are off the constant are as many as make the heat beyond them no larger than the
        error: what the heat at the end would carry there in the whole time is no less.
        """
        off = values - np.median(values)
        inside = off != 0.0
        edge, steps = np.flatnonzero(inside), int(np.ceil(np.sqrt(time * self._top)))  # of a walk in that time
        while 2 * np.count_nonzero(inside) <= len(inside):
            for _ in range(steps):
                reached = np.zeros(len(inside), dtype=bool)
                reached[self._matrix[edge].indices] = True
                edge = np.flatnonzero(reached & ~inside)
                inside[edge] = True
            steps, rows = 1, np.flatnonzero(inside)
            near = self._matrix[rows]
            heat = chebyshev_sum(near[:, rows].__matmul__, weights, off[rows] / self._root[rows])
            beyond = 0.5 * self._top * self._root * (near.T @ heat)
            if time * np.abs(beyond[~inside]).max(initial=0.0) <= error:
                return rows, self._root[rows] * heat - off[rows]
        return None

    def wave(self, time: float, speed: float) -> Advance:
        """Return the step of waves, for displacement and velocity, (2, n)."""
        if time * speed * np.sqrt(self._top) > _WAVE:
            return self._implicit_wave(time, speed)
        phase = time * speed
        cosine = self._polynomial(lambda squares: np.cos(phase * np.sqrt(squares)))
        sine = self._polynomial(lambda squares: time * np.sinc(phase / np.pi * np.sqrt(squares)))
        force = self._polynomial(lambda squares: -speed * np.sqrt(squares) * np.sin(phase * np.sqrt(squares)))
        weights = np.zeros((max(map(len, (cosine, sine, force))), 2, 2))
        weights[: len(cosine), 0, 0] = weights[: len(cosine), 1, 1] = cosine
        weights[: len(sine), 0, 1], weights[: len(force), 1, 0] = sine, force

        def advance(rows: Floats, progress: Progress | None) -> Floats:
            result = rows.copy()
            result[:, self.order] = self._root * self._combine(weights, rows[:, self.order] / self._root, progress)
            return result

        return advance

    def _polynomial(self, function: Response) -> Floats:
        """Return the coefficients of a function of the operator, exact at zero, so that constants stay."""
        values = np.asarray(function(0.5 * self._top * (1.0 + chebyshev_nodes())))
        coefficients = chebyshev_coefficients(values)
        degree = np.flatnonzero(np.abs(coefficients) > _LEAST * np.abs(values).max())[-1]
        coefficients = coefficients[: degree + 1]
        coefficients[0] += np.asarray(function(np.zeros(1)))[0] - np.sum(coefficients[::2]) + np.sum(coefficients[1::2])
        return coefficients

    def _combine(self, weights: Floats, rows: Floats, progress: Progress | None) -> Floats:
        """Return the sum of Chebyshev polynomials of rows, (k, m), each times its weight, a number or (k, k)."""
        report, done = progress or _silent, 0.0
        result = np.zeros_like(rows)
        with workers() as pool:
            matrix = Rows(self._matrix, pool, lambda: report("Step", done))

            def product(values: Floats) -> Floats:
                return np.stack([(matrix @ row[:, None])[:, 0] for row in values])  # faster than all at once

            for degree, (weight, term) in enumerate(zip(weights, chebyshev_terms(product, rows), strict=False), 1):
                result += weight @ term if weight.ndim else weight * term
                done = degree / len(weights)
        return result

    def _within(self, before: Floats, after: Floats) -> Floats:
        """Return rows with the rounding errors beyond the range of those before taken away."""
        inside = before[:, self.order]
        after[:, self.order] = np.clip(
            after[:, self.order], inside.min(axis=1, keepdims=True), inside.max(axis=1, keepdims=True)
        )
        return after

    def _implicit_heat(self, time: float) -> Advance:
        solve = self._factors(min(time, _ENDLESS / self._top) / _IMPLICIT)

        def advance(rows: Floats, progress: Progress | None) -> Floats:
            report = progress or _silent
            before = rows[:, self.order] / self._root
            now = before
            for number in range(_IMPLICIT):
                report("Step", number / _IMPLICIT)
                now = solve(now)
            result = rows.copy()
            result[:, self.order] = self._root * self._with_means(now, before)
            return self._within(rows, result)

        return advance

    def _implicit_wave(self, time: float, speed: float) -> Advance:
        half = 0.5 * min(time, 2.0 * np.sqrt(_ENDLESS / self._top) / speed)
        solve = self._factors((half * speed) ** 2)

        def advance(rows: Floats, progress: Progress | None) -> Floats:
            (progress or _silent)("Step", 0.0)
            place, velocity = rows[:, self.order] / self._root
            middle = solve((place + half * velocity)[None])[0]
            later = np.stack([2.0 * middle - place, 2.0 / half * (middle - place) - velocity])
            result = rows.copy()
            result[:, self.order] = self._root * self._with_means(later, np.stack([place + time * velocity, velocity]))
            return result

        return advance

    def _factors(self, time: float) -> Callable[[Floats], Floats]:
        """Return the solver of ``(1 + time * operator) y = x`` for rows (k, m)."""
        half = 0.5 * time * self._top
        matrix = (half * self._matrix + (1.0 + half) * sparse.eye_array(len(self.order), format="csr")).tocsr()
        order, starts = dissect(matrix, self._points, partial(self._report, "Equations", 0.5))
        solve = factorize(matrix[order][:, order], starts, lambda share: self._report("Factors", share))

        def solve_rows(rows: Floats) -> Floats:
            result = np.empty_like(rows)
            result[:, order] = solve(rows[:, order].T).T
            return result

        return solve_rows

    def _with_means(self, rows: Floats, wanted: Floats) -> Floats:
        """Return rows (k, m) with the means of others on each part: of long steps rounding changes nothing as much."""
        part: Ints = connected_components(self._matrix, directed=False)[1]
        unit = 1.0 / self._root
        missing = np.stack([np.bincount(part, unit * row) for row in wanted - rows])
        return rows + (missing / np.bincount(part, unit**2))[:, part] * unit


def read_pair(state: Any, count: int) -> tuple[Floats, bool]:
    """Return two functions, (2, n), given as a pair or as an array with two columns, and whether it was the latter.

    Other than two, or values that do not fit the points, or are not finite, raise `InvalidPointsError`.
    """
    columns = isinstance(state, np.ndarray) and state.ndim == 2 and state.shape[1] == 2 and len(state) == count
    try:
        first, second = np.transpose(state) if columns else state
    except (TypeError, ValueError) as error:
        raise InvalidPointsError(f"The state is no pair: {error}. Give two functions of {count} numbers.") from error
    return np.stack([check_values(values, count, columns=False) for values in (first, second)]), columns


def _silent(stage: str, fraction: float) -> None:
    """Report nothing."""
