"""Averages over neighbors of what noise scatters: as many as take away more of the scatter than they add in bias."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..algebra import multiply_rows
from ..types import Array, Floats
from .laplacian import LaplaceBeltrami

ROUNDS = (0, 1, 2, 4, 8)  # of averaging that are compared; the last reaches as far as halos of tiles allow
_WINDOWS = 3, 3, 5, 8  # rounds over which squared changes are averaged: bias varies slowly, chance averages out
_CHANCE = 1.5  # ratio of a squared change to that expected from noise alone: what is above it is bias
_NOISE_ROUNDS = 4  # over which noise is measured
_LOG = 2.0 * np.exp(np.euler_gamma)  # mean of squares of a normal distribution over their geometric mean
_HIGH = 7.1  # variance of white noise after (1 - p)^6, p a Gaussian average: 1 + 7.1 times its sum of squared weights
_STAYS = 1.4  # variance of noise over that of what a fit to 24 neighbors takes away
_GAUSSIAN = 0.8  # variance of a Gaussian that leaves as much noise as the weights of the pairs, over that of these
_LEAST = 1e-3  # of the spacing: less noise is ignored, such as that of rounded coordinates


@dataclass(frozen=True)
class Settled:
    """A quantity with as much averaging as its noise asks for."""

    values: Floats  # (n, k)
    variance: Floats  # (n,), what noise leaves in them, the sum over all k


class Averages:
    """Averages over the neighbors of an operator, and how much noise they leave.

    A second derivative of white noise, of deviation sigma, on points that take the area a each, seen through a Gaussian
    of variance w along each axis, has the variance ``sigma^2 a / (8 pi w^3)``: that of the mean curvature, and that of
    half the difference of principal curvatures in both its components together. A quadric is such a Gaussian, as wide
    as its own scatter says; each average adds the second moment of its weights to w.
    """

    def __init__(self, laplacian: LaplaceBeltrami) -> None:
        self._pairs, self._window, uneven = _matrices(laplacian)
        diagonal = laplacian.stiffness.diagonal()
        diagonal = np.where(diagonal > 0.0, diagonal, 1.0)
        area = self._around(laplacian.areas)
        area = np.where(area > 0.0, area, 1.0)  # of points without pairs
        moved = laplacian.points - laplacian.surface_points
        moved = np.einsum("ij,ij->i", moved, laplacian.normals)
        points = laplacian.surface_points - laplacian.surface_points.mean(axis=0)
        bent = np.einsum("ij,ij->i", off_neighbors(laplacian, laplacian.apply(points, raw=True), 2), laplacian.normals)
        height = bent * laplacian.areas / diagonal
        squares = height**2 / (1.0 + _HIGH * uneven) + _STAYS * moved**2
        # The geometric mean is robust: a few large values, at points along an edge, are no noise.
        noise = _LOG * np.exp(self._around(np.log(squares + 1e-12 * area), _NOISE_ROUNDS))
        self.noisy = noise > _LEAST**2 * area
        self._unit = noise / (8.0 * np.pi * area**2)  # of variances; widths are in units of the area
        scatter = self._around(laplacian.curvature_scatter**2)
        self._quadric = np.cbrt(1.0 / (8.0 * np.pi * np.where(scatter > 0.0, scatter, 1.0))) / np.cbrt(area) ** 2
        wider = _GAUSSIAN * self._around(2.0 * laplacian.areas / diagonal) / area
        self._wider = np.where(wider > 0.0, wider, 1.0)

    def of(self, values: Floats) -> list[Floats]:
        """Return values, (n, ...), after each number of averages in `ROUNDS`; values of the other side negated."""
        shape, result = values.shape, [values.reshape(len(values), -1)]
        for before, after in itertools.pairwise(ROUNDS):
            result.append(_repeated(self._pairs, result[-1], after - before))
        return [each.reshape(shape) for each in result]

    def settle(self, averaged: list[Floats]) -> Settled:
        """Return the average of a curvature, from those of `of`, (n, k) each, of least error, or between two of them.

        A step to more averaging changes values by noise, whose variance is known in advance, and by bias. Bias is
        proportional to the width, so the change also tells the bias before the step. Both give the fraction of the step
        that has the least mean squared error.
        """
        width = [self._quadric + rounds * self._wider for rounds in ROUNDS]
        variance = [self._unit / each**3 for each in width]
        steps = zip(averaged[:-1], averaged[1:], _WINDOWS, strict=True)
        changes = [self.mean_square(after - before, rounds) for before, after, rounds in steps]
        values, left = averaged[-1], variance[-1]
        for step in reversed(range(len(changes))):
            before, after = width[step], width[step + 1]
            common = self._unit / (0.5 * (before + after)) ** 3
            chance = variance[step] + variance[step + 1] - 2.0 * common
            bias = np.maximum(changes[step] - _CHANCE * chance, 0.0)
            gain = variance[step] - common - bias * before / (after - before)
            share = np.clip(gain / (chance + bias), 0.0, 1.0)
            values = averaged[step] + share[:, None] * (values - averaged[step])
            left = (1.0 - share) ** 2 * variance[step] + 2.0 * share * (1.0 - share) * common + share**2 * left
        return Settled(values, left)

    def mean_square(self, values: Floats, rounds: int) -> Floats:
        """Return the mean over the neighbors of squares of values, (n, k), summed over k, (n,)."""
        return self._around((values**2).sum(axis=1), rounds)

    def _around(self, values: Floats, rounds: int = 2) -> Floats:
        return _repeated(self._window, values, rounds)


def _repeated(averaging: sparse.csr_array, values: Floats, rounds: int) -> Floats:
    """Return quantities of points, (m, ...), after so many products with a matrix of means."""
    for _ in range(rounds):
        values = multiply_rows(averaging, values)
    return values


def off_neighbors(laplacian: LaplaceBeltrami, values: Floats, rounds: int) -> Floats:
    """Return how far values are off the mean of their neighbors by the weights of the stiffness, (n, k).

    Applied twice it is a high-pass filter: of fourth order in the spacing for smooth functions, while noise passes.
    """
    weight = laplacian.stiffness.diagonal()
    weight = np.where(weight > 0.0, weight, 1.0)[:, None]
    for _ in range(rounds):
        values = multiply_rows(laplacian.stiffness, values) / weight
    return values


def _matrices(laplacian: LaplaceBeltrami) -> tuple[sparse.csr_array, sparse.csr_array, Floats]:
    """Return two means over the neighbors: by the operator's weights, and of all of them and the point alike.

    The first takes values of neighbors whose normal points to the other side with the other sign, and those beyond an
    edge at right angles not at all. Return also the sums of the squared weights of each point, (n,).
    """
    stiffness = laplacian.stiffness
    count = np.diff(stiffness.indptr)
    weight = np.zeros(len(stiffness.data))
    for axis in np.ascontiguousarray(laplacian.normals.T):
        weight += np.repeat(axis, count) * axis[stiffness.indices]
    weight *= np.maximum(-stiffness.data, 0.0)  # all but those on the diagonal
    each, every = np.ones(len(count)), np.repeat(1.0 / np.maximum(count, 1), count)
    total = multiply_rows(_like(stiffness, np.abs(weight)), each)
    weight /= np.repeat(np.where(total > 0.0, total, 1.0), count)
    return _like(stiffness, weight), _like(stiffness, every), multiply_rows(_like(stiffness, weight**2), each)


def _like(matrix: sparse.csr_array, data: Array) -> sparse.csr_array:
    return sparse.csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)
