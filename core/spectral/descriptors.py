"""Signatures of points that depend on the intrinsic shape alone: bending the surface does not change them."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, check_finite, check_switches, whole
from ..errors import PointCloudError
from ..operator import Spectrum
from ..types import Floats

_MANY = 1_000_000  # times or energies at most
_ZERO = 1e-8  # eigenvalues below this share of 4 pi / area belong to constants
_RANGE = 4.0 * np.log(10.0)  # of eigenvalue times time: what is left at its end is 1e-4
_WIDTH = 0.07  # of a wave signature's window, as a share of the range of log eigenvalues


def signature_times(spectrum: Spectrum, count: int = 100) -> Floats:
    """Return the times of a heat kernel signature that suit a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        At least one mode more than constant ones.
    count : int
        How many times.

    Returns
    -------
    ndarray, (count,)
        Ascending, evenly in the logarithm [L^2], from ``4 ln 10 / highest`` to ``4 ln 10 / lowest`` nonzero eigenvalue:
        at earlier times missing modes would matter, at later ones all heat is spread evenly. They grow with the square
        of the size of the object, so that signatures of scaled copies agree.

    Raises
    ------
    PointCloudError
        A spectrum of constants alone, or a count below 1.
    """
    values = _nonzero(spectrum)[1]
    return np.geomspace(_RANGE / values[-1], _RANGE / values[0], _at_least_one(count))


def signature_energies(spectrum: Spectrum, count: int = 100) -> Floats:
    """Return the energies of a wave kernel signature that suit a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        At least two different eigenvalues above zero.
    count : int
        How many energies.

    Returns
    -------
    ndarray, (count,)
        Ascending and even: logarithms of eigenvalues, two windows inside the range of the spectrum.

    Raises
    ------
    PointCloudError
        Fewer than two different eigenvalues above zero, or a count below 1.
    """
    low, high, width = _window(spectrum)
    return np.linspace(low + 2.0 * width, high - 2.0 * width, _at_least_one(count))


def heat_kernel_signature(
    spectrum: Spectrum, times: ArrayLike | None = None, *, count: int = 100, normalized: bool = False
) -> Floats:
    """Compute the heat kernel signature: the heat that is left at a point some time after a unit was put there.

    Parameters
    ----------
    spectrum : Spectrum
        100 to 300 modes are usual.
    times : array_like, (k,), optional
        [L^2], not negative; `signature_times` where not given.
    count : int
        How many times, where they are not given.
    normalized : bool
        Divide by the heat of all points together, so that late times do not fade: the integral over the surface is 1.

    Returns
    -------
    ndarray, (n, k)
        ``sum_m exp(-lambda_m t) phi_m^2`` [1 / L^2], a column per time; zero at points that the operator left out.

    Raises
    ------
    PointCloudError
        Times that are not numbers from zero up, or a spectrum of constants alone.

    See Also
    --------
    signature_times : The times that suit a spectrum.
    wave_kernel_signature : Distinguishes details better.
    LaplaceBeltrami.eigenpairs : Computes the spectrum.

    References
    ----------
    Sun, Ovsjanikov, Guibas. A concise and provably informative multi-scale signature based on heat diffusion. 2009.

    Examples
    --------
    All points of the unit sphere are alike, with ``sum_l (2 l + 1) exp(-l (l + 1)) / (4 pi) = 0.113`` at the time one:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> spectrum = mf.build_laplacian(points).eigenpairs(16)
    >>> heat = mf.spectral.heat_kernel_signature(spectrum, [1.0])
    >>> print(heat.shape, heat.min().round(3), heat.max().round(3))
    (800, 1) 0.113 0.113
    """
    check_switches(normalized=normalized)
    times = signature_times(spectrum, count) if times is None else _numbers(times, "Times")
    if np.any(times < 0.0):
        raise PointCloudError(
            f"{np.count_nonzero(times < 0.0)} of {len(times)} times are negative. Use times from 0 up."
        )
    decay = np.exp(-np.outer(spectrum.eigenvalues, times))
    if normalized:
        decay /= decay.sum(axis=0)
    return spectrum.eigenvectors**2 @ decay


def wave_kernel_signature(spectrum: Spectrum, energies: ArrayLike | None = None, *, count: int = 100) -> Floats:
    """Compute the wave kernel signature: the mean probability to find a particle of some energy at a point.

    It distinguishes details better than the heat kernel signature, as each energy uses a narrow band of modes.

    Parameters
    ----------
    spectrum : Spectrum
        100 to 300 modes are usual.
    energies : array_like, (k,), optional
        Logarithms of eigenvalues; `signature_energies` where not given.
    count : int
        How many energies, where they are not given.

    Returns
    -------
    ndarray, (n, k)
        Means of ``phi_m^2`` [1 / L^2] weighted by ``exp(-(e - log lambda_m)^2 / (2 sigma^2))``, sigma a share of 0.07
        of the range of the logarithms, a column per energy; the integral over the surface is 1. Zero at points that
        the operator left out.

    Raises
    ------
    PointCloudError
        Energies that are not numbers, or fewer than two different eigenvalues above zero.

    See Also
    --------
    signature_energies : The energies that suit a spectrum.
    heat_kernel_signature : How heat spreads, at large and in detail.
    LaplaceBeltrami.eigenpairs : Computes the spectrum.

    References
    ----------
    Aubry, Schlickewei, Cremers. The wave kernel signature: a quantum mechanical approach to shape analysis. 2011.

    Examples
    --------
    On the unit sphere the probability is the same everywhere at every energy, one over the area of 4 pi:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> spectrum = mf.build_laplacian(points).eigenpairs(16)
    >>> waves = mf.spectral.wave_kernel_signature(spectrum, count=8)
    >>> print(waves.shape, waves.min().round(2), waves.max().round(2))
    (800, 8) 0.08 0.08
    """
    energies = signature_energies(spectrum, count) if energies is None else _numbers(energies, "Energies")
    constant, values = _nonzero(spectrum)
    width = _window(spectrum)[2]
    exponent = -((energies - np.log(values)[:, None]) ** 2) / (2.0 * width**2)
    weight = np.exp(exponent - exponent.max(axis=0))  # far outside the range all would vanish together
    return spectrum.eigenvectors[:, constant:] ** 2 @ (weight / weight.sum(axis=0))


def _nonzero(spectrum: Spectrum) -> tuple[int, Floats]:
    """Return the number of constant modes and the eigenvalues of all others."""
    values = spectrum.eigenvalues
    inverse_area = np.max(spectrum.eigenvectors[:, 0] ** 2)  # that of the component on which a constant mode lives
    constant = int(np.searchsorted(values, _ZERO * 4.0 * np.pi * inverse_area))
    if constant == len(values):
        raise PointCloudError(
            f"The {len(values)} modes are constant, so they do not distinguish points. Compute more modes."
        )
    return constant, values[constant:]


def _window(spectrum: Spectrum) -> tuple[float, float, float]:
    """Return the lowest and highest logarithm of the eigenvalues above zero, and the width of the windows."""
    logarithms = np.log(_nonzero(spectrum)[1])
    low, high = logarithms[0], logarithms[-1]
    if high - low < 1e-6:
        raise PointCloudError(
            f"The {len(logarithms)} modes above the constants have the same eigenvalue. Compute more modes."
        )
    return low, high, _WIDTH * (high - low)


def _numbers(given: ArrayLike, name: str) -> Floats:
    """Return a row of finite numbers, at least one."""
    advice = "Give a row of finite numbers, at least one."
    values = check_array(given, name, [(None,)], advice)
    if not len(values):
        raise PointCloudError(f"There are no {name.lower()}. {advice}")
    check_finite(values, name.lower(), advice)
    return as_doubles(values)


def _at_least_one(count: int) -> int:
    """Return the number of values per point."""
    if not 1 <= whole(count) <= _MANY:
        raise PointCloudError(f"The number of values per point is {count!r}. Use a whole number from 1 to {_MANY:,}.")
    return int(count)
