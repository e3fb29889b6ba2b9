"""Points around a place, of whatever tiles."""

from __future__ import annotations

import numpy as np

from ..types import Floats
from .cut import outside
from .store import Part, Store


def points_around(store: Store, place: Floats, count: int, marked: str = "") -> Part:
    """Return so many points of all tiles that are next to the one at a place, (3,), nearest first.

    That is one of those that the step "noise" has marked under a name, if one is given.
    """
    return _nearest(store, _nearest(store, place, 1, marked).points[0], count)


def _nearest(store: Store, place: Floats, count: int, marked: str = "") -> Part:
    """Return so many points that are next to a place, nearest first; only marked ones where a name is given."""
    found = np.zeros((0, 6))
    away = {number: float(outside(place[None], *store.bounds(number))[0]) for number in store.alive}
    for number in sorted(away, key=lambda number: away[number]):
        if len(found) == count and found[-1, 0] < away[number]:
            break
        points = store.own(number)
        rows = np.flatnonzero(store.read("noise", number, marked)) if marked else np.arange(len(points))
        distance = np.linalg.norm(points[rows] - place, axis=1)
        near = np.argsort(distance, kind="stable")[:count]
        columns = [distance[near], np.full(len(near), number), rows[near], points[rows[near]]]
        found = np.concatenate([found, np.column_stack(columns)])
        found = found[np.argsort(found[:, 0], kind="stable")[:count]]
    owner, row = found[:, 1:3].astype(np.int64).T
    every = np.ones(len(found), dtype=bool)
    return Part(found[:, 3:], every, every, owner, row)
