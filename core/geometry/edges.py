"""Edges: the normal and the bend of the smooth side that each point lies on, from neighbors on that side alone."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..algebra import blocks, on_all_cores
from ..types import Bools, Floats, Ints
from .moments import MET
from .nearest import POWER, SMOOTH, Nearest
from .noise import LEFT
from .quadrics import Quadrics, components, entries, fit_quadrics, heights_over, rises

_ROUNDS = 8  # of fits, each by the normals of the last; nearly all points need fewer
_COEFFICIENTS = 6  # of a quadric
_BLOCK = 1 << 12  # points fitted at one time


@dataclass(frozen=True)
class Sides:
    """The smooth side that each point lies on, up to the edges next to it."""

    normals: Floats  # (m, 3), unit normals
    shape_operator: Floats  # (m, 3, 3), as of `Quadrics`
    # (m,), how sure it is that an edge is near, from 0 to 1. At zero, normal and bend are those of the quadric
    sharp: Floats
    # (m, 3), unit normals of the quadrics through all neighbors, towards the same side of the surface: across an edge,
    # too, they tell whether two points see the same one
    around: Floats

    def turn(self, first: Ints, second: Ints, chord: Floats, side: Floats) -> Floats:
        """Return by how much normals differ along chords, (3, k), by the bends at both ends: what is no edge.

        `side` is -1 where the normals of both ends point to different sides of the surface, else 1.
        """
        own, other = entries(self.shape_operator, first), entries(self.shape_operator, second)
        return rises([one + side * two for one, two in zip(own, other, strict=True)], *chord)

    def toward(self, normals: Floats) -> Sides:
        """Return the same, seen from where normals of the surface, (m, 3), point."""
        side = np.where(np.einsum("ij,ij->i", normals, self.normals) < 0.0, -1.0, 1.0)
        return Sides(side[:, None] * self.normals, side[:, None, None] * self.shape_operator, self.sharp, normals)


def one_side(quadrics: Quadrics, normals: Floats) -> Sides:
    """Return the sides of a surface without edges, by its normals, (m, 3)."""
    return Sides(normals, quadrics.shape_operator, np.zeros(len(normals)), normals)


def find_sides(nearest: Nearest, quadrics: Quadrics) -> Sides:
    """Fit quadrics again where they miss their neighbors, to those whose normals agree, until normals turn no more.

    Across an edge normals differ more and more with each such fit, on each side they agree; where the surface is round
    or noisy the fit stays much the same. A point next to the edge may end between both sides: in the end it takes the
    normal of the neighbor whose quadric fits best, to this point and to that neighbor's own side. How sure an edge is
    follows from the share of the misfit that is left, both per degree of freedom of their fits.
    """
    rows = np.flatnonzero(quadrics.misfit > LEFT * nearest.spacing)
    found, sharp = quadrics.take(np.arange(len(quadrics.misfit))), np.zeros(len(quadrics.misfit))
    for beside in (False, True):
        turning = rows
        for _ in range(_ROUNDS):
            last = found.normals[turning]
            refit = functools.partial(_refit, nearest, quadrics, found, beside)
            parts = [turning[block] for block in blocks(len(turning), _BLOCK)]
            for part, (enough, fitted, sure) in zip(parts, on_all_cores(refit, parts), strict=True):
                found.assign(part[enough], fitted)
                sharp[part] = sure
            turned = 1.0 - np.abs(np.einsum("ij,ij->i", found.normals[turning], last))
            turning = turning[turned > MET]
            if not len(turning):
                break
    lost = rows[sharp[rows] == 0.0]
    found.assign(lost, quadrics.take(lost))
    return Sides(found.normals, found.shape_operator, sharp, quadrics.normals)


def _refit(
    nearest: Nearest, quadrics: Quadrics, found: Quadrics, beside: bool, rows: Ints
) -> tuple[Bools, Quadrics, Floats]:
    """Fit quadrics to those neighbors of some points whose last normals agree with theirs, or with one beside them.

    Return which of the k points have enough such neighbors, the quadrics of these, and how sure an edge is near each of
    the k points, 0 without enough.
    """
    index = nearest.index[rows]
    toward = found.normals[_closest(nearest, found, rows) if beside else rows]
    cosine = np.abs(
        sum(own[:, None] * other for own, other in zip(toward.T, components(found.normals, index), strict=True))
    )
    weight = nearest.weight[rows] * np.maximum((cosine - SMOOTH) / (1.0 - SMOOTH), 0.0) ** POWER
    count = weight.sum(axis=1) ** 2 / np.maximum((weight**2).sum(axis=1), 1e-300)
    enough = count > _COEFFICIENTS
    some = rows[enough]
    fitted = fit_quadrics(nearest.points, index[enough], weight[enough], some, toward[enough])
    left = fitted.misfit / (np.sqrt(1.0 - _COEFFICIENTS / count[enough]) * quadrics.misfit[some])
    sharp = np.zeros(len(rows))
    sharp[enough] = 1.0 - np.sqrt(np.minimum(left, 1.0))
    return enough, fitted, sharp


def _closest(nearest: Nearest, quadrics: Quadrics, rows: Ints) -> Ints:
    """Return which of the neighbors of some points, or these themselves, have the quadric that misses least, (k,).

    What it misses are the neighbors that it was fitted to, and the point.
    """
    index = nearest.index[rows]
    missed = heights_over(quadrics, nearest.points, index, rows[:, None]) ** 2 + quadrics.misfit[index] ** 2
    missed[nearest.weight[rows] == 0.0] = np.inf
    return index[np.arange(len(rows)), missed.argmin(axis=1)]
