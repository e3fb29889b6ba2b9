"""Waves at any time, from a few modes."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import exprel

from ..arguments import as_array, as_doubles, check_array, check_finite, not_negative, positive
from ..geometry import check_values
from ..operator import Spectrum
from ..types import Floats


def wave_modes(
    spectrum: Spectrum,
    areas: ArrayLike,
    displacement: ArrayLike,
    velocity: ArrayLike,
    *,
    speed: float = 1.0,
    damping: float = 0.0,
) -> Callable[[ArrayLike], Floats]:
    """Return a wave as a function of time, from the modes that it consists of.

    ``d2u/dt2 = speed^2 Delta u - 2 damping du/dt``, whose modes swing on their own: a few numbers and a formula, for
    which no time has to be computed before another.

    Parameters
    ----------
    spectrum : Spectrum
        Of the operator on n points; with Dirichlet modes the boundary is held fast.
    areas : array_like, (n,)
        Area elements [L^2] that the eigenvectors are orthonormal for.
    displacement, velocity : array_like, (n,)
        At the time zero; what is not in the span of the modes is left out. One number stands for a constant.
    speed : float
        Of waves [L / T], above zero.
    damping : float
        The amplitude fades as ``exp(-damping t)`` [1 / T], not negative. Modes of a lower frequency than that do not
        swing any more.

    Returns
    -------
    callable
        From one time, or an array of times [T], to displacements: (n,) for one, times.shape + (n,) for more. Times
        before zero are as good where nothing is damped.

    Raises
    ------
    InvalidPointsError
        Values or areas that do not fit the spectrum, or are not finite; the same for times, when it is called.
    PointCloudError
        A speed that is not above zero, or a damping that is negative or not finite.

    See Also
    --------
    Wave : With all modes, step by step.
    LaplaceBeltrami.eigenpairs : Computes the spectrum.

    Notes
    -----
    Eigenvalues with the symbol correction give every wave its true speed, where steps of `Wave` make short ones slow.

    Examples
    --------
    On the unit sphere z swings with the frequency sqrt(2), so that after half a period it is reversed:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> wave = mf.motion.wave_modes(laplacian.eigenpairs(4), laplacian.areas, z, np.zeros(800))
    >>> print(np.abs(wave(np.pi / np.sqrt(2)) + z).max().round(2))
    0.0
    """
    modes = spectrum.eigenvectors
    n = len(modes)
    areas = check_values(areas, n, columns=False)
    start = [areas * np.broadcast_to(_function(values, n), n) @ modes for values in (displacement, velocity)]
    frequency = positive(speed, "speed") * np.sqrt(spectrum.eigenvalues)
    fading = not_negative(damping, "damping")

    def at(time: ArrayLike) -> Floats:
        advice = "Give numbers."
        given = check_array(time, "Times", [(), (None,), (None, None)], advice)
        times = as_doubles(given)[..., None]
        check_finite(times.reshape(-1, 1), "times", advice)
        even, odd = _swing(times, frequency, fading)
        return (even * start[0] + odd * (start[1] + fading * start[0])) @ modes.T

    return at


def _function(values: ArrayLike, count: int) -> Floats:
    given = as_array(values, "Values")
    return check_values(np.full(count, given) if given.ndim == 0 else given, count, columns=False)


def _swing(times: Floats, frequency: Floats, fading: float) -> tuple[Floats, Floats]:
    """Return the solutions with the values 1 and 0, and slopes of minus the fading and 1, at the time zero.

    They are ``exp(-fading t)`` times cosine and ``sin(w t) / w``, or the hyperbolic ones where w^2 is negative.
    """
    squared = (frequency - fading) * (frequency + fading)
    growth = np.sqrt(np.maximum(-squared, 0.0))
    swings = squared > 0.0
    sum_ = np.where(swings | (fading == 0.0), 1.0, fading + growth)
    envelope = np.exp(-np.where(swings, fading, frequency**2 / sum_) * times)  # the slower exponential, to all digits
    turn = np.sqrt(np.maximum(squared, 0.0)) * times
    even = np.where(swings, np.cos(turn), 0.5 + 0.5 * np.exp(-2.0 * growth * times))
    odd = times * np.where(swings, np.sinc(turn / np.pi), exprel(-2.0 * growth * times))
    return envelope * even, envelope * odd
