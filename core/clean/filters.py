"""Filters of functions on the points by frequency (section 4 of the paper, Figure 12)."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from ..algebra import (
    Rows,
    chebyshev_coefficients,
    chebyshev_nodes,
    chebyshev_terms,
    degree_needed,
    largest_eigenvalue,
    workers,
)
from ..arguments import as_doubles, check_array, check_finite, check_switches, not_negative, real, whole
from ..errors import PointCloudError
from ..geometry import check_values
from ..kernel import SECOND_MOMENT
from ..operator import LaplaceBeltrami, Spectrum, symmetric_form
from ..progress import ends_at_one
from ..types import Floats, Ints, Progress, Response

_DEGREE = 800  # of a polynomial, at most
_ROUGH = 0.02  # largest error of a response, as a share of its largest value, that is accepted at that degree
_ZERO = 1e-8  # eigenvalues below this share of 4 pi / area belong to constants


def exponential(time: float) -> Response:
    """Return the response ``exp(-time * eigenvalue)``: the flow of heat for that time.

    Parameters
    ----------
    time : float
        [L^2], not negative. Details of a wavelength below about ``6 sqrt(time)`` fade.

    Returns
    -------
    callable
        From an array of eigenvalues [1 / L^2] to an array of factors of the same shape, as of all responses.

    Raises
    ------
    PointCloudError
        A time that is negative or not finite.
    """
    number = not_negative(time, "time of an exponential response")
    return lambda eigenvalues: np.exp(-number * np.asarray(eigenvalues))


def fairing(time: float, order: int = 3) -> Response:
    """Return the response ``1 / (1 + (time * eigenvalue)^order)`` of an implicit step of fairing.

    Parameters
    ----------
    time : float
        [L^2], not negative. Details of a wavelength of ``2 pi sqrt(time)`` are halved.
    order : int
        1 for the flow of heat, 2 or 3 for a sharper cutoff.

    Returns
    -------
    callable
        From eigenvalues [1 / L^2] to factors.

    Raises
    ------
    PointCloudError
        A time that is negative or not finite, or another order.
    """
    number, power = not_negative(time, "time of the fairing"), whole(order)
    if power not in (1, 2, 3):
        raise PointCloudError(f"The order of the fairing is {order!r}. Use 1, 2 or 3.")
    return lambda eigenvalues: 1.0 / (1.0 + (number * np.asarray(eigenvalues)) ** power)


def band(low: float, high: float = np.inf, *, softness: float = 0.1) -> Response:
    """Return the response that keeps the eigenvalues from low to high and fades out on both sides.

    Parameters
    ----------
    low, high : float
        Eigenvalues [1 / L^2] at which the response is one half. A wavelength w has the eigenvalue ``(2 pi / w)^2``;
        low = 0 keeps all below high, high = infinity all above low.
    softness : float
        Relative width of the fade in frequency, the root of the eigenvalue. The smaller, the more products
        `chebyshev_filter` needs.

    Returns
    -------
    callable
        From eigenvalues [1 / L^2] to factors.

    Raises
    ------
    PointCloudError
        Edges out of order or negative, or a softness that is not above zero.
    """
    lowest, highest, fade = real(low), real(high), real(softness)
    if not (0.0 <= lowest < highest and fade > 0.0):
        raise PointCloudError(
            f"A band from {low!r} to {high!r} with softness {softness!r} is empty. Use 0 <= low < high and a"
            " softness above zero."
        )

    def respond(eigenvalues: Floats) -> Floats:
        frequency = np.sqrt(np.maximum(eigenvalues, 0.0))
        result = np.ones_like(frequency)
        for edge, side in ((lowest, 1.0), (highest, -1.0)):
            if 0.0 < edge < np.inf:
                result *= expit(side * (frequency / np.sqrt(edge) - 1.0) * 4.0 / fade)
        return result

    return respond


def boost(gain: float, low: float, high: float = np.inf, *, softness: float = 0.25) -> Response:
    """Return the response that multiplies the details of a `band` by a gain and leaves others unchanged.

    Parameters
    ----------
    gain : float
        Above 1 for stronger details, below for weaker ones.
    low, high, softness : float
        As for `band`. With an infinite high, noise is amplified as well.

    Returns
    -------
    callable
        From eigenvalues [1 / L^2] to factors.

    Raises
    ------
    PointCloudError
        A gain that is not finite, or an empty band.
    """
    factor = real(gain)
    if not np.isfinite(factor):
        raise PointCloudError(f"The gain of the details is {gain!r}. Use a finite number.")
    inside = band(low, high, softness=softness)
    return lambda eigenvalues: 1.0 + (factor - 1.0) * np.asarray(inside(eigenvalues))


def spectral_filter(
    values: ArrayLike, spectrum: Spectrum, areas: ArrayLike, response: int | Response, *, rest: float = 0.0
) -> Floats:
    """Filter a function by its modes.

    Parameters
    ----------
    values : array_like, (n,) or (n, k)
        A function on the points, or several as columns.
    spectrum : Spectrum
        Of the operator on these points.
    areas : array_like, (n,)
        Area elements [L^2] that the eigenvectors are orthonormal for.
    response : int or callable
        A whole number m keeps the first m modes and drops the others; the cost follows m. A callable maps an array of
        eigenvalues [1 / L^2] to the factors of their modes.
    rest : float
        Factor of the residual outside the span of the modes; 1 keeps the details.

    Returns
    -------
    ndarray
        Same shape as the values: ``sum response_k <f, phi_k> phi_k + rest (f - sum <f, phi_k> phi_k)``.

    Raises
    ------
    InvalidPointsError
        Values or areas that do not fit the spectrum, or are not finite.
    PointCloudError
        More modes than the spectrum holds, fewer than there are constant ones, a response that is not a number for
        each eigenvalue, or a rest that is not finite.

    See Also
    --------
    LaplaceBeltrami.eigenpairs : Computes the spectrum.
    chebyshev_filter : The same without a spectrum.
    smooth_points : Filters the points themselves.
    exponential, fairing, band, boost : Responses.

    References
    ----------
    Vallet, Levy. Spectral geometry processing with manifold harmonics. 2008. Section 4 and Figure 12 of the paper.

    Examples
    --------
    On the unit sphere z is a mode of eigenvalue 2, and x y of eigenvalue 6, which the first four modes do not hold:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> values = z + points[:, 0] * points[:, 1]
    >>> smooth = mf.clean.spectral_filter(values, laplacian.eigenpairs(9), laplacian.areas, 4)
    >>> print(np.abs(smooth - z).max().round(2))
    0.0
    """
    n, count = spectrum.eigenvectors.shape
    values = check_values(values, n)
    areas = check_values(areas, n, columns=False)
    kept = real(rest)
    if not np.isfinite(kept):
        raise PointCloudError(f"The factor of the rest is {rest!r}. Use a finite number.")
    if callable(response):
        factors = respond(response, spectrum.eigenvalues)
    else:
        factors = (np.arange(count) < check_modes(response, spectrum, areas)).astype(np.float64)
    used = count if kept != 0.0 else int(np.max(np.flatnonzero(factors), initial=-1)) + 1
    modes = spectrum.eigenvectors[:, :used]
    columns = values.reshape(n, -1)
    coefficients = modes.T @ (areas[:, None] * columns)
    result = modes @ ((factors[:used] - kept)[:, None] * coefficients)
    if kept != 0.0:
        result += kept * columns
    return result.reshape(values.shape)


@ends_at_one
def chebyshev_filter(
    laplacian: LaplaceBeltrami,
    values: ArrayLike,
    response: Response,
    *,
    dirichlet: bool = False,
    raw: bool = False,
    tolerance: float = 1e-4,
    progress: Progress | None = None,
) -> Floats:
    """Filter a function by a polynomial of the operator, without any eigenvectors.

    The result is that of `spectral_filter` with all modes: the polynomial is that of the operator with the symbol
    correction, whose eigenvalues are the corrected ones as far as they are resolved.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    values : array_like, (n,) or (n, k)
        A function on the points, or several as columns.
    response : callable
        Maps an array of eigenvalues [1 / L^2] to factors. It should be smooth: the more abrupt, the more products with
        the operator.
    dirichlet : bool
        Assume that the functions vanish at the boundary (Dirichlet), instead of their normal derivatives (Neumann).
    raw : bool
        Leave out the symbol correction.
    tolerance : float
        Largest error of a factor, as a share of the largest one. For a response with kinks it may be up to 2 percent.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray
        Same shape as the values. Values of points that the operator leaves out are multiplied by ``response(0)``.

    Raises
    ------
    InvalidPointsError
        Values that do not fit the points, or are not finite.
    PointCloudError
        A response that is not a number for each eigenvalue, or too abrupt for a polynomial; a tolerance below zero.
    """
    report = progress or (lambda stage, fraction: None)
    values = check_values(values, len(laplacian.areas))
    check_switches(dirichlet=dirichlet, raw=raw)
    largest = real(tolerance)
    if not largest >= 0.0:
        raise PointCloudError(f"The tolerance of a filter is {tolerance!r}. Use a number that is not negative.")
    done = 0.0

    def report_done() -> None:
        report("Filter", done)

    report_done()
    columns = values.reshape(len(values), -1)
    filtered = respond(response, np.zeros(1))[0] * columns
    with workers() as pool:
        order, root, multiply = corrected_operator(laplacian, dirichlet, raw, pool, report_done)
        top = largest_eigenvalue(lambda y: multiply(y[:, None])[:, 0], len(order))
        coefficients = _polynomial(response, top, largest)
        start = columns[order] / root[:, None]
        result = np.zeros_like(start)
        terms = chebyshev_terms(lambda y: (2.0 / top) * multiply(y) - y, start)
        for degree, (coefficient, term) in enumerate(zip(coefficients, terms, strict=False), 1):
            result += coefficient * term
            done = degree / len(coefficients)
    filtered[order] = root[:, None] * result
    return filtered.reshape(values.shape)


def corrected_operator(
    laplacian: LaplaceBeltrami, dirichlet: bool, raw: bool, pool: ThreadPoolExecutor, report: Callable[[], None]
) -> tuple[Ints, Floats, Callable[[Floats], Floats]]:
    """Return the negated operator with the symbol correction as a product with a symmetric matrix, on all cores.

    Returns
    -------
    order, root
        As of `symmetric_form`.
    multiply : callable
        Of (m, k) arrays: ``S y + mu2 / 8 S (h^2 S y)``, or S y if raw. Positive semi-definite.
    """
    stiffness = laplacian.dirichlet[0] if dirichlet else laplacian.stiffness
    order, root, matrix = symmetric_form(stiffness, laplacian.points, laplacian.areas, laplacian.component, report)
    rows = Rows(matrix, pool, report)
    if raw:
        return order, root, lambda y: rows @ y
    squared = (SECOND_MOMENT / 8.0) * laplacian.kernel_widths[order, None] ** 2

    def multiply(y: Floats) -> Floats:
        product = rows @ y
        return product + rows @ (squared * product)

    return order, root, multiply


def _polynomial(response: Response, top: float, tolerance: float) -> Floats:
    """Return the Chebyshev coefficients of a response over [0, top], as many as the tolerance needs."""
    nodes = chebyshev_nodes()
    factors = respond(response, 0.5 * top * (1.0 + nodes))
    coefficients = chebyshev_coefficients(factors)
    largest = np.abs(factors).max()
    degree = degree_needed(coefficients, tolerance * largest)
    if degree <= _DEGREE:
        return coefficients[: degree + 1]
    coefficients = coefficients[: _DEGREE + 1]
    error = np.abs(np.polynomial.chebyshev.chebval(nodes, coefficients) - factors).max()
    if error > _ROUGH * largest:
        raise PointCloudError(
            f"The response changes too abruptly for a polynomial: at degree {_DEGREE} its error is"
            f" {error / largest:.0%}. Soften it, or compute a spectrum first."
        )
    return coefficients


def respond(response: Response, eigenvalues: Floats) -> Floats:
    """Return a response's factors for eigenvalues, (m,), after a check."""
    advice = f"Let the response return one finite number for each of {len(eigenvalues)} eigenvalues from zero up."
    factors = check_array(response(eigenvalues), "Values of the response", [(), eigenvalues.shape], advice, "iufb")
    factors = np.broadcast_to(as_doubles(factors), eigenvalues.shape)
    check_finite(factors, "values of the response", advice)
    return factors


def check_modes(count: int, spectrum: Spectrum, areas: Floats) -> int:
    """Check a number of modes to keep and return it as an integer."""
    available = len(spectrum.eigenvalues)
    if not 1 <= whole(count) <= available:
        raise PointCloudError(
            f"The number of modes to keep is {count!r}, and the spectrum has {available}. Use a whole number from"
            f" 1 to {available}, or compute more modes."
        )
    constant = int(np.count_nonzero(spectrum.eigenvalues < _ZERO * 4.0 * np.pi / areas.sum()))
    if count < constant:
        raise PointCloudError(
            f"The first {constant} modes are the constants of as many components, so {count} are too few. Keep at"
            f" least {constant} modes."
        )
    return int(count)
