"""Typed errors of the mathematics: every text says what is wrong, how many points, and what to do."""


class PointCloudError(ValueError):
    """A point cloud, or a question asked of it, that has no sound answer."""


class InvalidPointsError(PointCloudError):
    """Coordinates of the wrong shape or type, not finite, or too coarse for their distance from the origin."""


class TooFewPointsError(PointCloudError):
    """Fewer points than the neighborhoods, or the question, need."""


class NotASurfaceError(PointCloudError):
    """Points along a line or a curve, so that no tangent plane exists."""


class ComponentError(PointCloudError):
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

    def __init__(self, text: str, resolved: int = 0) -> None:
        super().__init__(text)
        self.resolved = resolved


class NotEnoughMemoryError(PointCloudError):
    """More points, or modes, than the free memory is enough for.

    Attributes
    ----------
    fitting : int
        How many points, or modes, it is enough for.
    """

    def __init__(self, text: str, fitting: int = 0) -> None:
        super().__init__(text)
        self.fitting = fitting


class SolverError(PointCloudError):
    """An iterative solver that did not reach its tolerance."""


class BrokenLibraryError(PointCloudError):
    """A scipy that is missing, or does not fit this Python or its numpy."""


class Cancelled(Exception):
    """Raised by a progress callback to stop the work; nothing was changed."""
