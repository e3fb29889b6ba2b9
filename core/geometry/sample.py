"""The points of a cloud that take part, from which all else is measured."""

from dataclasses import dataclass, field

from ..types import Floats, Ints
from .agreed import Decisions
from .components import move_apart
from .nearest import Nearest
from .scaled import ScaledPoints


@dataclass(frozen=True)
class Sample:
    """The points that take part, by component, in scaled coordinates.

    Attributes
    ----------
    scaled : ScaledPoints
        The m distinct points, and how they map to the caller's.
    component : ndarray, (m,) int
        Of each point, the largest 0.
    nearest : Nearest
        Neighbors of each point; components stand far apart there, and noisy points are where they were moved to.
    noise : ndarray, (m,)
        Noise that was smoothed at each point, as a share of the spacing; zero where none was.
    scatter : ndarray, (2, m)
        What quadrics missed the neighbors of each point by before that, see `likely_causes`; zero until it is known.
    step : float
        Distance from level to level where depth is rounded so coarsely that this was smoothed, as a share of the
        spacing; zero elsewhere.
    decisions : Decisions
        What is decided for the points as a whole.
    """

    scaled: ScaledPoints
    component: Ints
    nearest: Nearest
    noise: Floats
    scatter: Floats
    step: float = 0.0
    decisions: Decisions = field(default_factory=Decisions)

    @property
    def moved(self) -> Floats:
        """Offsets by which the points were moved to smooth noise, (m, 3)."""
        return self.nearest.points - move_apart(self.scaled.points, self.component)

    @property
    def places(self) -> Floats:
        """Where the points are, noisy ones where they were moved to, components where they stand, (m, 3)."""
        return self.scaled.points + self.moved
