"""A tile in a step: its points, what others have told of those around, and what is agreed on for them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ..geometry import Agreed, Decisions, ScaledPoints
from ..options import LaplacianOptions
from ..types import Array, Bools, Floats, Ints
from .store import Part, Record, Store

_SCALARS = ("scale", "spacing", "reach", "length")
_LABELS = {"component": "components", "sheet": "touching"}  # by the step that tells them


class Site:
    """A tile in a step, by its number; -1 for points of several.

    The points are a part, if they are not those of the tile.
    """

    def __init__(self, store: Store, number: int, options: LaplacianOptions, part: Part | None = None) -> None:
        self.store, self.number, self.options = store, number, options
        if part is not None:
            self.part = part

    @functools.cached_property
    def part(self) -> Part:
        """The points of the tile with its halo."""
        return self.store.part(self.number)

    @property
    def record(self) -> Record:
        """What is agreed on."""
        return self.store.record

    def inner(self, scaled: ScaledPoints) -> Bools:
        """Return which of the distinct points lie in the box, (m,)."""
        return self.part.inner[scaled.first]

    def own(self, scaled: ScaledPoints, values: Array, neutral: Any) -> Array:
        """Return a quantity of the distinct points for all points in the box."""
        return scaled.scatter(values, neutral)[self.part.inner]

    def told(self, step: str, name: str) -> Array:
        """Return what the tile itself has told in a step before."""
        return self.store.read(step, self.number, name)

    def around(self, step: str, name: str, neutral: Any) -> Array:
        """Return what the tiles of all points here, (k,), have told of these in a step before."""
        part, result = self.part, None
        for owner in np.unique(part.owner):
            if not self.store.done(step, int(owner)):
                continue
            rows = part.owner == owner
            values = self.store.read(step, int(owner), name)[part.place[rows]]
            if result is None:
                result = np.full((len(rows), *values.shape[1:]), neutral, values.dtype)
            result[rows] = values
        assert result is not None  # the tile itself has told
        return result

    def named(self, step: str, name: str, neutral: Any = -1) -> Array:
        """Return what is agreed on, under a name, for the labels that a step has given to the points here, (k,).

        The record is that of `names_of`; points without a label have a neutral value.
        """
        owner, label = self.part.owner, self.around(step, "label", -1)
        values, start = self.record[name], self.record[f"{step} start"]
        result = np.full(len(label), neutral, values.dtype)
        rows = np.flatnonzero(label >= 0)
        result[rows] = values[start[owner[rows]] + label[rows]]
        return result

    def agreed(self) -> Agreed:
        """Return what is agreed on for the points here."""
        record = self.record
        known: dict[str, Any] = {name: float(record[name]) for name in _SCALARS if name in record}
        known |= {name: record[name] for name in ("center", "ratio", "rounded") if name in record}
        known |= {name: self.named(step, name) for name, step in _LABELS.items() if name in record}
        if "smallest" in record:
            known["smallest"] = int(record["smallest"])
        if "noisy" in record:
            known["noisy"] = bool(record["noisy"])
        if "filling" in record:
            known["filling"] = tuple(record["filling"].tolist())
        if "outer" in record:
            known["side"] = self.sides()
        if "bridges" in record:
            known["bridges"] = self._bridges(record["bridges"])
        return Agreed(**known)

    def decisions(self) -> Decisions:
        """Return the same for a sample of the points here."""
        return Decisions(self.agreed())

    def labels(self) -> Ints:
        """Return the components of the points here, (k,), with sheets divided if they are."""
        found = "sheet" if "sheet" in self.record else "component"
        return self.named(_LABELS[found], found)

    def sides(self) -> Floats:
        """Return a direction on the outer side at the points here, (k, 3)."""
        label, side = self.labels(), self.around("outside", "side", 0.0)
        return side * np.append(self.record["outer"], 0.0)[label, None]

    def _bridges(self, bridges: Ints) -> Ints:
        """Return the bridges, (k, 4), between points here, by their rows."""
        ends = np.concatenate([bridges[:, :2], bridges[:, 2:]])
        far = int(max(self.part.place.max(), ends[:, 1].max(initial=0))) + 1
        here = self.part.owner.astype(np.int64) * far + self.part.place
        order = np.argsort(here)
        wanted = ends[:, 0].astype(np.int64) * far + ends[:, 1]
        found = order[np.minimum(np.searchsorted(here, wanted, sorter=order), len(here) - 1)]
        rows = np.where(here[found] == wanted, found, -1).reshape(2, -1).T
        kept: Ints = rows[(rows >= 0).all(axis=1)]
        return kept
