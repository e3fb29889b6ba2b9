"""What tiles keep between steps, and tell each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from ..errors import PointCloudError
from ..types import Array, Bools, Floats, Ints

Told: TypeAlias = dict[str, Array]  # what a step tells of a tile, by names
Record: TypeAlias = dict[str, Array]  # what all tiles have agreed on so far, by names


@dataclass(frozen=True, eq=False)
class Part:
    """The points of a tile with its halo, and whose they are.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Coordinates [L].
    inner : ndarray, (k,) bool
        Which lie in the box; each point lies in that of one tile.
    close : ndarray, (k,) bool
        Which lie in the box or in the nearer half of the halo: the far end tells less, as its neighbors are missing.
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
