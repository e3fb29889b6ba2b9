"""The points of a cloud that take part, from which all else is measured."""

from dataclasses import dataclass, field

from ..types import Floats, Ints
from .agreed import Decisions
from .components import move_apart
from .nearest import Nearest
from .scaled import ScaledPoints


@dataclass(frozen=True)
class Sample:
    """The points that take part, by component, in scaled coordinates."""

    scaled: ScaledPoints  # the m distinct points, and how they map to the caller's
    component: Ints  # (m,), of each point, the largest 0
    # Neighbors of each point; components stand far apart there, and noisy points are where they were moved to
    nearest: Nearest
    noise: Floats  # (m,), noise that was smoothed at each point, as a share of the spacing; zero where none was
    # (2, m), what quadrics missed the neighbors of each point by before that, see `likely_causes`; zero until it is
    # known
    scatter: Floats
    # Distance from level to level where depth is rounded so coarsely that this was smoothed, as a share of the spacing;
    # zero elsewhere
    step: float = 0.0
    decisions: Decisions = field(default_factory=Decisions)  # what is decided for the points as a whole

    @property
    def moved(self) -> Floats:
        """Offsets by which the points were moved to smooth noise, (m, 3)."""
        return self.nearest.points - move_apart(self.scaled.points, self.component)

    @property
    def places(self) -> Floats:
        """Where the points are, noisy ones where they were moved to, components where they stand, (m, 3)."""
        return self.scaled.points + self.moved
