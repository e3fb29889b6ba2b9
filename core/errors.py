"""Typed errors of the mathematics: every text says what is wrong, how many points, and what to do."""

from functools import partial

from .phrases import Phrase


class PointCloudError(ValueError):
    """A point cloud, or a question asked of it, that has no sound answer.

    Parameters
    ----------
    template : str
        What to say, with a field for each value.
    values : object
        What goes into the fields, as in a `Phrase`.
    """

    def __init__(self, template, /, **values):
        super().__init__(Phrase(template, **values))

    def __reduce__(self):  # to copy and pickle it: what it says is no template
        return partial(type(self), self.template, **self.values), (), self.__dict__

    @property
    def text(self) -> Phrase:
        """What it says, which can be translated."""
        return self.args[0]

    @property
    def template(self):
        """What it says, with fields for the values."""
        return self.text.template

    @property
    def values(self):
        """What is in the fields, by name."""
        return self.text.values


class InvalidPointsError(PointCloudError):
    """Coordinates of the wrong shape or type, not finite, or too coarse for their distance from the origin."""


class TooFewPointsError(PointCloudError):
    """Fewer points than the neighbourhoods, or the question, need."""


class NotASurfaceError(PointCloudError):
    """Points along a line or a curve, so that no tangent plane exists."""


class IslandError(PointCloudError):
    """A few points far from all others, too few for an operator of their own."""


class AreaError(PointCloudError):
    """An area estimate that is not positive everywhere."""


class UnresolvedModesError(PointCloudError):
    """More vibration modes asked for than the smoothing length resolves.

    Attributes
    ----------
    resolved : int
        How many are resolved, from the lowest on.
    """

    def __init__(self, template, /, *, resolved, **values):
        super().__init__(template, resolved=resolved, **values)
        self.resolved = resolved


class SolverError(PointCloudError):
    """An iterative solver that did not reach its tolerance."""


class Cancelled(Exception):
    """Raised by a progress callback to stop the work; nothing was changed."""
