"""Reaction and diffusion on the surface, step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import not_negative, positive
from ..errors import InvalidPointsError, PointCloudError
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Floats, Progress
from .propagation import Propagator, read_pair

PATTERNS = {  # feed, kill, and the distance between two spots or stripes for rates of 0.16 and 0.08
    "spots": (0.030, 0.062, 12.9),
    "stripes": (0.029, 0.057, 12.0),
}
_CHANGE = 0.5  # largest share by which the reaction changes anything in one of its own steps


class Mixture(NamedTuple):
    """Two substances that react.

    Attributes
    ----------
    food, eater : ndarray, (n,)
        The concentrations u, which is fed, and v, which grows where there is u.
    """

    food: Floats
    eater: Floats


class ReactionDiffusion:
    """Two substances that spread and react, which makes spots and stripes (Gray and Scott), in equal steps of time.

    ``du/dt = D_u Delta u - u v^2 + feed (1 - u)``, and ``dv/dt = D_v Delta v + u v^2 - (feed + kill) v``.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points; nothing flows across boundaries.
    step : float
        Time of a step [T], above zero; patterns grow within thousands.
    feed, kill : float
        How fast u is fed, and v removed beyond that [1 / T], not negative.
    rates : pair of float
        D_u and D_v [L^2 / T], not negative. Patterns have a size in proportion to their root; there are some where D_u
        is about twice D_v.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Raises
    ------
    PointCloudError
        A step that is not above zero, or another number that is negative or not finite.

    See Also
    --------
    Heat : Spreads without reacting.

    Notes
    -----
    Half a step of the reaction, one of `Heat` for each substance, and another half (Strang, 1968). The reaction takes
    as many Runge-Kutta steps of its own as keep it stable and concentrations from becoming negative, whatever the step.

    References
    ----------
    Pearson. Complex patterns in a simple system. 1993.

    Examples
    --------
    Without v there is no reaction, and u is fed until it is 1:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> reaction = mf.motion.ReactionDiffusion(mf.build_laplacian(points), 50.0, 0.04, 0.06, (2e-4, 1e-4))
    >>> food, eater = reaction.advance((np.full(800, 0.5), np.zeros(800)))
    >>> print(food.min().round(2), food.max().round(2), eater.max())
    0.93 0.93 0.0
    """

    @ends_at_one
    def __init__(
        self,
        laplacian: LaplaceBeltrami,
        step: float,
        feed: float,
        kill: float,
        rates: ArrayLike,
        *,
        progress: Progress | None = None,
    ) -> None:
        self._step = positive(step, "step")
        self._feed, self._kill = not_negative(feed, "feed"), not_negative(kill, "kill")
        numbers = np.asarray(rates, dtype=object).ravel()
        if len(numbers) != 2:
            raise PointCloudError(f"The rates are {rates!r}. Give two numbers, one for each substance.")
        spread = [self._step * not_negative(number, "rate") for number in numbers]
        self._propagator = Propagator(laplacian, progress)
        self._spread = [self._propagator.heat(time) if time > 0.0 else None for time in spread]

    @classmethod
    @ends_at_one
    def of_pattern(
        cls, laplacian: LaplaceBeltrami, step: float, pattern: str, size: float, *, progress: Progress | None = None
    ) -> ReactionDiffusion:
        """Return a reaction that is known to make a pattern.

        Parameters
        ----------
        laplacian, step, progress
            As of the class. From v = 1 at some points it takes about 5,000 units of time to cover a hundred of
            them squared.
        pattern : {"spots", "stripes"}
        size : float
            From one spot or stripe to the next [L], above zero; 10 smoothing lengths of the points or more.

        Returns
        -------
        ReactionDiffusion

        Raises
        ------
        PointCloudError
            No such pattern, or a step or size that is not above zero.
        """
        if not (isinstance(pattern, str) and pattern in PATTERNS):
            raise PointCloudError(f"The pattern is {pattern!r}. Choose one of {', '.join(map(repr, PATTERNS))}.")
        feed, kill, unit = PATTERNS[pattern]
        rate = 0.16 * (positive(size, "size") / unit) ** 2
        return cls(laplacian, step, feed, kill, (rate, 0.5 * rate), progress=progress)

    @ends_at_one
    def advance(self, state: ArrayLike | Mixture, *, progress: Progress | None = None) -> Any:
        """Return the concentrations one step later.

        Parameters
        ----------
        state : pair of array_like (n,), or array (n, 2)
            Concentrations u and v, not negative; not changed.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        Mixture, or ndarray, (n, 2)
            For a pair, or for an array with two columns. Points that the operator leaves out keep their values.

        Raises
        ------
        InvalidPointsError
            Concentrations that do not fit the points, are not finite, or negative.
        """
        before, columns = read_pair(state, self._propagator.count)
        wrong = int(np.count_nonzero((before < 0.0).any(axis=0)))
        if wrong:
            raise InvalidPointsError(f"{wrong} of {before.shape[1]} points have negative concentrations. Raise them.")
        known = self._propagator.order
        both = before.copy()
        both[:, known] = self._react(before[:, known])
        for row, spread in enumerate(self._spread):
            if spread is not None:
                both[row] = spread(both[row : row + 1], progress)[0]
        both[:, known] = self._react(both[:, known])
        return both.T if columns else Mixture(*both)

    def _react(self, both: Floats) -> Floats:
        """Return concentrations, (2, m), after half a step of the reaction alone."""
        left = 0.5 * self._step
        while left > 0.0:
            u, v = both.max(axis=1, initial=0.0)
            fastest = v**2 + 2.0 * u * v + self._feed + self._kill
            length = min(left, _CHANGE / fastest) if fastest > 0.0 else left
            both = np.maximum(_runge_kutta(self._rate, both, length), 0.0)
            left -= length
        return both

    def _rate(self, both: Floats) -> Floats:
        u, v = both
        eaten = u * v * v
        return np.stack([self._feed * (1.0 - u) - eaten, eaten - (self._feed + self._kill) * v])


def _runge_kutta(rate: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """Return a state one step later, to fourth order."""
    first = rate(state)
    second = rate(state + 0.5 * step * first)
    third = rate(state + 0.5 * step * second)
    fourth = rate(state + step * third)
    return state + (step / 6.0) * (first + 2.0 * (second + third) + fourth)
