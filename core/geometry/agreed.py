"""What is decided for a cloud as a whole, so that its parts can be measured one by one as they are within it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, Self, TypeVar

import numpy as np

from ..frozen import Frozen
from ..types import Floats, Ints
from .scaled import ScaledPoints

_Value = TypeVar("_Value")
_OF_POINTS = ("component", "sheet", "side")


@dataclass(frozen=True, kw_only=True, eq=False)
class Agreed(Frozen):
    """Every decision between points and matrix that takes more than the points around a place.

    `LaplaceBeltrami.agreed` holds those of an operator; `build_laplacian` takes them for the same points, or for some
    of them with a halo around, see `among`. What is None is decided by the points at hand.

    Attributes
    ----------
    center : ndarray, (3,), optional
        Origin of scaled coordinates [L].
    scale : float, optional
        Their unit, the root mean square radius [L].
    rounded : ndarray, (3,), optional
        Along the direction in which points are rounded in steps, as long as these, as a share of the spacing; zero
        where they are not.
    spacing : float, optional
        Median distance between points, scaled: beyond some of it points are sparse.
    reach : float, optional
        Median length, scaled, up to which an edge is no gap.
    component : ndarray, (n,) int, optional
        Component of each point by gaps alone, the largest 0; -1 for points left out.
    smallest : int, optional
        Points of the smallest component.
    noisy : bool, optional
        Whether the noise is worth smoothing.
    filling : tuple of float, optional
        Before and after each round of smoothing, the median misfit, in spacings, of points that fill volumes.
    sheet : ndarray, (n,) int, optional
        Component of each point when sheets that nowhere meet are divided, too; -1 for points left out.
    side : ndarray, (n, 3), optional
        A direction on the outer side of the surface at each point; zero for points left out.
    bridges : ndarray, (k, 2) int, optional
        Points next to each other over which sheets hang together that nothing else joins.
    length : float, optional
        The one smoothing length, scaled, of a "global" bandwidth.
    ratio : ndarray, (components,), optional
        By which the areas of each component are scaled at last.

    See Also
    --------
    build_laplacian : Takes and gives it.

    Examples
    --------
    The upper half of a sphere, with a halo, as it is within the whole sphere:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> whole = mf.build_laplacian(points)
    >>> rows = np.flatnonzero(points[:, 2] > -0.8)
    >>> part = mf.build_laplacian(points[rows], agreed=whole.agreed.among(rows, len(points)))
    >>> inner = points[rows, 2] > 0.8
    >>> print(np.abs(part.normals - whole.normals[rows])[inner].max().round(9))
    0.0
    """

    center: Floats | None = None
    scale: float | None = None
    rounded: Floats | None = None
    spacing: float | None = None
    reach: float | None = None
    component: Ints | None = None
    smallest: int | None = None
    noisy: bool | None = None
    filling: tuple[float, ...] | None = None
    sheet: Ints | None = None
    side: Floats | None = None
    bridges: Ints | None = None
    length: float | None = None
    ratio: Floats | None = None

    def among(self, rows: Ints, count: int) -> Self:
        """Return the same for some of the points, by their rows, (k,) int, each once, of so many points in all."""
        changed: dict[str, Any] = {
            name: given[rows] for name in _OF_POINTS if (given := getattr(self, name)) is not None
        }
        if self.bridges is not None:
            place = np.full(count, -1)
            place[rows] = np.arange(len(rows))
            moved = place[self.bridges]
            changed["bridges"] = moved[(moved >= 0).all(axis=1)]
        return replace(self, **changed)


class Decisions:
    """Takes what is agreed on where it is, decides what is not, and notes both."""

    def __init__(self, given: Agreed | None = None) -> None:
        self._given = Agreed() if given is None else given
        self.made = self._given

    @property
    def whole(self) -> bool:
        """Whether the points at hand are all there are: nothing was agreed on."""
        return all(getattr(self._given, quantity.name) is None for quantity in fields(Agreed))

    def settle(self, name: str, decide: Callable[[], _Value]) -> _Value:
        """Return what is agreed on under a name, or what is decided now."""
        given = getattr(self._given, name)
        value: _Value = decide() if given is None else given
        return self._note(name, value)

    def settle_round(self, name: str, step: int, decide: Callable[[], _Value]) -> _Value:
        """Return what is agreed on for a round, the last of a shorter record, or what is decided now."""
        given = getattr(self._given, name)
        value: _Value = decide() if given is None else given[min(step, len(given) - 1)]
        self._note(name, (*(getattr(self.made, name) or ())[:step], value))
        return value

    def label(self, name: str, scaled: ScaledPoints, decide: Callable[[], Ints]) -> Ints:
        """Return the labels of distinct points, (m,) from 0 without gaps, those left out -1."""
        given = getattr(self._given, name)
        if given is None:
            label = decide()
            self._note(name, scaled.scatter(label, -1))
            return label
        self._note(name, given)
        found = given[scaled.first]
        names, label = np.unique(found, return_inverse=True)
        return label.reshape(-1) - np.count_nonzero(names < 0)

    def names(self, scaled: ScaledPoints, component: Ints) -> Ints:
        """Return the labels that distinct points of these components have in the whole cloud, (m,)."""
        given = self._given.component if self._given.sheet is None else self._given.sheet
        return component if given is None else given[scaled.first]

    def sides(self, scaled: ScaledPoints, normals: Floats, decide: Callable[[], Floats]) -> Floats:
        """Return the normals of distinct points, (m, 3), on the side agreed on, or as decided now."""
        given = self._given.side
        if given is None:
            oriented = decide()
            self._note("side", scaled.scatter(oriented, 0.0))
            return oriented
        self._note("side", given)
        against = np.einsum("ij,ij->i", normals, given[scaled.first]) < 0.0
        return np.where(against[:, None], -normals, normals)

    def bridges(self, scaled: ScaledPoints, decide: Callable[[], Ints]) -> Ints:
        """Return the bridges between distinct points, (k, 2) int, that are agreed on or found now."""
        given = self._given.bridges
        if given is None:
            found = decide()
            self._note("bridges", scaled.first[found])
            return found
        self._note("bridges", given)
        known = scaled.inverse[given]
        return known[(known >= 0).all(axis=1)]

    def _note(self, name: str, value: _Value) -> _Value:
        self.made = replace(self.made, **{name: value})  # type: ignore[arg-type]
        return value
