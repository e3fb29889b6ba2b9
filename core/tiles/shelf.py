"""What tiles keep between steps, and tell each other: in memory, or in the files of `Store`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np

from ..errors import PointCloudError
from ..types import Array, Bools, Floats, Ints
from .cut import Tile

Told: TypeAlias = dict[str, Array]  # what a step tells of a tile, by names
Record: TypeAlias = dict[str, Array]  # what all tiles have agreed on so far, by names


@dataclass(frozen=True, eq=False)
class Part:
    """The points of a tile with its halo, and whose they are.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Coordinates [L].
    inner, close : ndarray, (k,) bool
        See `Tile`.
    owner : ndarray, (k,) int
        The tile in whose box each point lies.
    place : ndarray, (k,) int
        Its place among the points in that box.
    """

    points: Floats
    inner: Bools
    close: Bools
    owner: Ints
    place: Ints


class Shelf(Protocol):
    """Holds the tiles of a cloud, and what each step has found about them."""

    record: Record

    @property
    def alive(self) -> Sequence[int]:
        """The numbers of the tiles that can be measured."""

    def part(self, number: int) -> Part:
        """Return the points of a tile with its halo."""

    def bounds(self, number: int) -> tuple[Floats, Floats]:
        """Return the lowest and highest coordinates in the box of a tile."""

    def own(self, number: int) -> Floats:
        """Return the points in the box of a tile."""

    def columns(self, number: int) -> dict[str, Array]:
        """Return what the input told of these points besides."""

    def read(self, step: str, number: int, name: str) -> Array:
        """Return what a step has told of a tile under a name."""

    def told(self, step: str, name: str) -> Iterator[Array]:
        """Yield what a step has told of each tile under a name, but for those where it has not been."""

    def done(self, step: str, number: int) -> bool:
        """Whether a step has been at a tile."""

    def state(self, step: str, number: int) -> Any:
        """Return what the last step at a tile before this one has left to go on from; None at first."""

    def put(self, step: str, number: int, told: Told, state: Any) -> None:
        """Keep what a step has told of a tile, and its state, unless that is None: then the last one stays."""

    def fail(self, step: str, number: int, error: PointCloudError) -> None:
        """Note that a tile cannot be measured."""


def visited(shelf: Shelf, step: str) -> list[int]:
    """Return the tiles that can be measured and that a step has been at, in their order, as `Shelf.told` has them."""
    return [number for number in shelf.alive if shelf.done(step, number)]


class Memory:
    """A shelf in memory.

    Parameters
    ----------
    points : ndarray, (n, 3)
    tiles : sequence of Tile
    record : dict
        What is agreed on from the start.
    last : str
        The step whose state is not kept.
    columns : dict of str to ndarray, (n, ...)
        What is told of the points besides.
    """

    def __init__(
        self, points: Floats, tiles: Sequence[Tile], record: Record, last: str, columns: dict[str, Array]
    ) -> None:
        self.record, self._columns = record, columns
        self._points, self._tiles, self._last = points, tiles, last
        self._owner, self._place = np.full((2, len(points)), -1)
        for number, tile in enumerate(tiles):
            self._owner[tile.own], self._place[tile.own] = number, np.arange(len(tile.own))
        self._told: dict[tuple[str, int], Told] = {}
        self._states: dict[int, Any] = {}
        self.alive: Sequence[int] = range(len(tiles))

    def part(self, number: int) -> Part:
        """Return the points of a tile with its halo."""
        tile = self._tiles[number]
        rows = tile.rows
        return Part(self._points[rows], tile.inner, tile.close, self._owner[rows], self._place[rows])

    def bounds(self, number: int) -> tuple[Floats, Floats]:
        """Return the lowest and highest coordinates in the box of a tile."""
        own = self.own(number)
        return own.min(axis=0), own.max(axis=0)

    def own(self, number: int) -> Floats:
        """Return the points in the box of a tile."""
        return self._points[self._tiles[number].own]

    def columns(self, number: int) -> dict[str, Array]:
        """Return what the input told of these points besides."""
        return {name: values[self._tiles[number].own] for name, values in self._columns.items()}

    def read(self, step: str, number: int, name: str) -> Array:
        """Return what a step has told of a tile under a name."""
        return self._told[step, number][name]

    def told(self, step: str, name: str) -> Iterator[Array]:
        """Yield what a step has told of each tile under a name, but for those where it has not been."""
        return (self.read(step, number, name) for number in visited(self, step))

    def done(self, step: str, number: int) -> bool:
        """Whether a step has been at a tile."""
        return (step, number) in self._told

    def state(self, step: str, number: int) -> Any:
        """Return what the last step at a tile has left to go on from; None at first."""
        return self._states.get(number)

    def put(self, step: str, number: int, told: Told, state: Any) -> None:
        """Keep what a step has told of a tile, and its state, unless that is None: then the last one stays."""
        self._told[step, number] = told
        if step == self._last:
            self._states.pop(number, None)
        elif state is not None:
            self._states[number] = state

    def fail(self, step: str, number: int, error: PointCloudError) -> None:
        """Raise the error: in memory all tiles are asked for."""
        raise error

    def joined(self, values: Sequence[Array]) -> Array:
        """Return quantities of all points, (n, ...), from those of the points in each box."""
        result = np.empty((len(self._points), *values[0].shape[1:]), values[0].dtype)
        for tile, own in zip(self._tiles, values, strict=True):
            result[tile.own] = own
        return result

    def rows(self, owner: Ints, place: Ints) -> Ints:
        """Return which of the cloud's points lie at some places of some tiles."""
        own = np.concatenate([tile.own for tile in self._tiles])
        start = np.cumsum([0, *(len(tile.own) for tile in self._tiles)])
        rows: Ints = own[start[owner] + place]
        return rows
