"""Edges: the normal and the bend of the smooth side that each point lies on, from neighbours on that side alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..algebra import blocks, on_all_cores
from ..types import Floats, Ints
from .moments import MET
from .nearest import POWER, SMOOTH, Nearest
from .noise import LEFT
from .quadrics import Quadrics, fit_quadrics

_ROUNDS = 20  # of fits, each by the normals of the last; nearly all points need fewer
_COEFFICIENTS = 6  # of a quadric
_BLOCK = 1 << 12  # points fitted at one time


@dataclass(frozen=True)
class Sides:
    """The smooth side that each point lies on, up to the edges next to it.

    Attributes
    ----------
    normals : ndarray, (m, 3)
        Unit normals.
    shape_operator : ndarray, (m, 3, 3)
        As of `Quadrics`.
    sharp : ndarray, (m,)
        How sure it is that an edge is near, from 0 to 1. At zero, normal and bend are those of the quadric.
    """

    normals: Floats
    shape_operator: Floats
    sharp: Floats

    def turn(self, first: Ints, second: Ints, chord: Floats, side: Floats) -> Floats:
        """Return by how much normals differ along chords, (k, 3), by the bends at both ends: what is no edge.

        `side` is -1 where the normals of both ends point to different sides of the surface, else 1.
        """
        form = self.shape_operator[first] + side[:, None, None] * self.shape_operator[second]
        result: Floats = 0.5 * np.einsum("pa,pab,pb->p", chord, form, chord)
        return result

    def toward(self, normals: Floats) -> Sides:
        """Return the same, seen from where normals of the surface, (m, 3), point."""
        side = np.where(np.einsum("ij,ij->i", normals, self.normals) < 0.0, -1.0, 1.0)
        return Sides(side[:, None] * self.normals, side[:, None, None] * self.shape_operator, self.sharp)


def one_side(quadrics: Quadrics, normals: Floats) -> Sides:
    """Return the sides of a surface without edges, by its normals, (m, 3)."""
    return Sides(normals, quadrics.shape_operator, np.zeros(len(normals)))


def find_sides(nearest: Nearest, quadrics: Quadrics) -> Sides:
    """Fit quadrics again where they miss their neighbours, to those whose normals agree, until normals turn no more.

    Across an edge normals differ more and more with each such fit, on each side they agree; where the surface is round
    or noisy the fit stays much the same. How sure an edge is follows from what is left of the misfit, by as many
    neighbours as it has more than coefficients.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    quadrics : Quadrics
        Of the points.
    """
    rows = np.flatnonzero(quadrics.misfit > LEFT * nearest.spacing)
    normals, form, sharp = quadrics.normals.copy(), quadrics.shape_operator.copy(), np.zeros(len(quadrics.normals))
    turning = rows
    for _ in range(_ROUNDS):
        last = normals.copy()

        def fit(part: slice, last: Floats = last, turning: Ints = turning) -> None:
            some = turning[part]
            index = nearest.index[some]
            cosine = np.abs(np.einsum("ikc,ic->ik", last[index], last[some]))
            weight = nearest.weight[some] * np.maximum((cosine - SMOOTH) / (1.0 - SMOOTH), 0.0) ** POWER
            count = weight.sum(axis=1) ** 2 / np.maximum((weight**2).sum(axis=1), 1e-300)
            enough = count > _COEFFICIENTS
            sharp[some[~enough]] = 0.0
            some, index, weight, count = some[enough], index[enough], weight[enough], count[enough]
            fitted = fit_quadrics(nearest.points, index, weight, some, last[some])
            normals[some], form[some] = fitted.normals, fitted.shape_operator
            left = fitted.misfit / (np.sqrt(1.0 - _COEFFICIENTS / count) * quadrics.misfit[some])
            sharp[some] = 1.0 - np.sqrt(np.minimum(left, 1.0))

        on_all_cores(fit, blocks(len(turning), _BLOCK))
        turned = 1.0 - np.abs(np.einsum("ij,ij->i", normals[turning], last[turning]))
        turning = turning[turned > MET]
        if not len(turning):
            break
    lost = rows[sharp[rows] == 0.0]
    normals[lost], form[lost] = quadrics.normals[lost], quadrics.shape_operator[lost]
    return Sides(normals, form, sharp)
