"""Heat and waves on the surface, step by step."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from ..arguments import not_negative, positive
from ..geometry import check_values
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Floats, Progress
from .propagation import Propagator, read_pair


class WaveState(NamedTuple):
    """A wave at one time.

    Attributes
    ----------
    displacement : ndarray, (n,)
    velocity : ndarray, (n,)
        [unit of displacement / T].
    """

    displacement: Floats
    velocity: Floats


class Heat:
    """Heat that spreads over the surface, ``du/dt = Delta u``, in equal steps of time.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points; no heat flows across boundaries.
    step : float
        Time of a step [L^2], above zero: a point's heat spreads by about ``2 sqrt(step)``.
    accuracy : float
        Error of values, as a share of their range, up to which functions that are constant at most points are left as
        they are far from the others. That saves most of the time for many functions, each on a few points.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Raises
    ------
    PointCloudError
        A step that is not above zero, an accuracy below, or either not finite.

    See Also
    --------
    Wave, ReactionDiffusion : Other motions.
    clean.spectral_filter : With `clean.exponential`, heat after any time from modes.

    Notes
    -----
    A step is the exponential of the operator, as a polynomial of it (Tal-Ezer, Kosloff, 1984) that is right to 13
    digits, for the wide kernel bounds the spectrum: the heat after many small steps is that after a few large ones. The
    number of products with the operator grows with the root of the step; from some 30 spacings of spread on, eight
    implicit steps of factored equations take its place, at most 0.03 from the exponential in any mode.

    The total, ``areas @ u``, stays the same, and no value leaves the range of those before.

    Examples
    --------
    On the unit sphere z is a mode of eigenvalue 2, so that it fades as ``exp(-2 t)``:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> heat = mf.motion.Heat(mf.build_laplacian(points), 0.1)
    >>> warm = heat.advance(points[:, 2])
    >>> print((warm / points[:, 2]).mean().round(2), np.exp(-0.2).round(2))
    0.82 0.82
    """

    @ends_at_one
    def __init__(
        self, laplacian: LaplaceBeltrami, step: float, *, accuracy: float = 0.0, progress: Progress | None = None
    ) -> None:
        time, error = positive(step, "step"), not_negative(accuracy, "accuracy")
        self._propagator = Propagator(laplacian, progress)
        self._spread = self._propagator.heat(time, error)

    @ends_at_one
    def advance(self, state: ArrayLike, *, progress: Progress | None = None) -> Floats:
        """Return the heat one step later.

        Parameters
        ----------
        state : array_like, (n,) or (n, k)
            Temperatures, or several functions as columns; not changed.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        ndarray
            Same shape. Points that the operator leaves out keep their values.

        Raises
        ------
        InvalidPointsError
            Values that do not fit the points, or are not finite.
        """
        values = check_values(state, self._propagator.count)
        columns = values.reshape(len(values), -1).T
        return self._spread(columns, progress).T.reshape(values.shape)


class Wave:
    """Waves along the surface, ``d2u/dt2 = speed^2 Delta u``, in equal steps of time.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points; boundaries reflect waves, and are free to move (Neumann).
    step : float
        Time of a step [T], above zero.
    speed : float
        Of waves [L / T], above zero.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Raises
    ------
    PointCloudError
        A step or speed that is not above zero, or not finite.

    See Also
    --------
    wave_modes : The same at any time, from modes.

    Notes
    -----
    A step is exact in time: cosine and sine of the operator's root, as polynomials of it that are right to 13 digits,
    so that waves neither fade nor grow at any step, however many. The number of products with the operator
    grows with the step; where waves would run some 300 spacings in one, it is by the trapezoidal rule with
    factored equations, which keeps the energy as well, but slows down all waves that turn in less than a few steps.

    In space a wave of wavenumber k is slower by ``mu2 (k h)^2 / 16``, h being the smoothing length: by 1 % at a
    wavelength of 14 spacings of even points, or 22 of random ones.

    Examples
    --------
    On the unit sphere z swings with the frequency sqrt(2), so that after half a period it is reversed:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> wave = mf.motion.Wave(mf.build_laplacian(points), np.pi / np.sqrt(2) / 10)
    >>> state = points[:, 2], np.zeros(800)
    >>> for _ in range(10):
    ...     state = wave.advance(state)
    >>> print(np.abs(state.displacement + points[:, 2]).max().round(2))
    0.0
    """

    @ends_at_one
    def __init__(
        self, laplacian: LaplaceBeltrami, step: float, speed: float = 1.0, *, progress: Progress | None = None
    ) -> None:
        self.step, self.speed = positive(step, "step"), positive(speed, "speed")
        self._laplacian = laplacian
        self._propagator = Propagator(laplacian, progress)
        self._swing = self._propagator.wave(self.step, self.speed)

    @ends_at_one
    def advance(self, state: ArrayLike | WaveState, *, progress: Progress | None = None) -> Any:
        """Return the wave one step later.

        Parameters
        ----------
        state : pair of array_like (n,), or array (n, 2)
            Displacement, and velocity [unit of displacement / T]; not changed.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        WaveState, or ndarray, (n, 2)
            For a pair, or for an array with two columns. Points that the operator leaves out do not move.

        Raises
        ------
        InvalidPointsError
            Values that do not fit the points, or are not finite.
        """
        both, columns = read_pair(state, self._propagator.count)
        moved = self._swing(both, progress)
        return moved.T if columns else WaveState(*moved)

    def energy(self, state: ArrayLike | WaveState) -> float:
        """Return the energy of a wave, which stays the same.

        Parameters
        ----------
        state : pair of array_like (n,), or array (n, 2)
            As of `advance`.

        Returns
        -------
        float
            Half of ``areas @ velocity^2 + speed^2 u @ stiffness @ u``.

        Raises
        ------
        InvalidPointsError
            Values that do not fit the points, or are not finite.
        """
        (u, velocity), _ = read_pair(state, self._propagator.count)
        tension = self.speed**2 * (u @ (self._laplacian.stiffness @ u))
        return float(0.5 * (self._laplacian.areas @ velocity**2 + tension))
