"""The steps of the walk in tiles: each is at all tiles, one by one and in any order, and then agreed on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from ..errors import PointCloudError
from ..options import LaplacianOptions
from . import measures, neighborhoods
from .site import Site
from .store import Record, Store, Told


def _all(store: Store) -> Sequence[int]:
    return store.alive


def at_first(store: Store) -> Sequence[int]:
    """Return the one tile at which a step is that is of all."""
    return store.alive[:1]


def _at_first_if_filled(store: Store) -> Sequence[int]:
    return at_first(store) if "filled" in store.record else []


def _nothing(store: Store, options: LaplacianOptions) -> Record:
    return {}


def _always(options: LaplacianOptions) -> bool:
    return True


def _of_sheets(options: LaplacianOptions) -> bool:
    return options.sheets


def _of_one_length(options: LaplacianOptions) -> bool:
    return options.bandwidth == "global"


@dataclass(frozen=True)
class Step:
    """A step of the walk."""

    name: str
    stage: str  # what it is for, in words of the user
    cost: float  # CPU time over all tiles, against that of the others: seconds for 500,000 points of a torus
    # From the site of a tile, and the state that an earlier step has left there, to a new state, or None where that one
    # stays, and to what the step tells of the tile
    local: Callable[[Site, Any], tuple[Any, Told]]
    # From the store and the options to what all tiles agree on then: small against the points
    merge: Callable[[Store, LaplacianOptions], Record] = _nothing
    # From the store to the numbers of the tiles at which the step is needed
    where: Callable[[Store], Sequence[int]] = _all
    needed: Callable[[LaplacianOptions], bool] = _always  # from the options to whether they ask for it


_SURVEY = (
    Step("rounding", "Neighbors", 0.5, neighborhoods.look_for_rounding, neighborhoods.agree_on_rounding),
    Step("spacing", "Neighbors", 8.6, neighborhoods.find_spacing, neighborhoods.agree_on_spacing),
    Step("reach", "Outliers", 1.1, neighborhoods.find_reach, neighborhoods.agree_on_reach),
    Step("gaps", "Components", 1.5, neighborhoods.link_strictly, neighborhoods.agree_on_large),
    Step("components", "Components", 1.3, neighborhoods.link_loosely, neighborhoods.agree_on_components),
    Step("noise", "Noise", 4.7, neighborhoods.find_noise, neighborhoods.agree_on_noise),
    Step("filling", "Noise", 0.5, neighborhoods.find_filling, neighborhoods.agree_on_filling, _at_first_if_filled),
    Step("sheets", "Sheets", 3.6, neighborhoods.link_sheets, neighborhoods.agree_on_large_sheets),
    Step("touching", "Sheets", 0.8, neighborhoods.join_sheets, neighborhoods.agree_on_sheets, needed=_of_sheets),
    Step("patches", "Normals", 4.2, measures.orient_tile),
    Step("sides", "Normals", 0.5, measures.compare_sides, measures.agree_on_flips),
    Step("outside", "Normals", 0.5, measures.tell_sides, measures.agree_on_outside),
    Step("pieces", "Sheets", 2.7, neighborhoods.link_pieces, neighborhoods.agree_on_pieces, needed=_of_sheets),
    Step("bridges", "Sheets", 0.5, neighborhoods.find_bridges, neighborhoods.agree_on_bridges, needed=_of_sheets),
    Step("length", "Areas", 1.0, neighborhoods.find_length, neighborhoods.agree_on_length, needed=_of_one_length),
    Step("areas", "Areas", 30.5, measures.find_areas, measures.agree_on_areas),
)
MEASURE = Step("measure", "Operator", 31.0, measures.measure)


def survey_steps(options: LaplacianOptions) -> list[Step]:
    """Return the steps, in their order, after which all is agreed on."""
    return [step for step in _SURVEY if step.needed(options)]


def part_of(steps: Sequence[Step], step: Step) -> tuple[float, float]:
    """Return what share of the work of some steps is done when one of them begins, and when it ends."""
    place = next(place for place, other in enumerate(steps) if other.name == step.name)
    ends = np.cumsum([0.0, *(other.cost for other in steps)])
    return float(ends[place] / ends[-1]), float(ends[place + 1] / ends[-1])


def visit(store: Store, step: Step, number: int, options: LaplacianOptions) -> None:
    """Take a step at one tile, unless that is done, and keep what it tells."""
    if store.done(step.name, number):
        return
    began = process_time()
    try:
        state, told = step.local(Site(store, number, options), store.state(step.name, number))
    except PointCloudError as error:
        if step.where is not _all:  # it is of all tiles, if at one place
            raise
        store.fail(step.name, number, error)
    else:
        store.put(step.name, number, {**told, "seconds": np.array(process_time() - began)}, state)


def agree(store: Store, step: Step, options: LaplacianOptions) -> Record:
    """Return what all tiles agree on after a step that has been at all of them."""
    return step.merge(store, options)
