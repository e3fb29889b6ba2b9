"""Curvature: its effect on the kernel, and the mean curvature from the operator applied to the coordinates."""

import numpy as np

from ..kernel import SECOND_MOMENT

_UNEVEN = 0.01  # gain of an integral over the kernel, from h that varies, up to which it is known
_LARGEST = 0.3  # most that curvature may change an area or a weight, where the fit is poor


def kernel_integral(lengths, gaussian):
    """Return the integral of the kernel over the surface around each point, (m,): ``1 - mu2 h^2 K / 6``.

    Clipped, as all terms of curvature here.
    """
    return _bent(lengths, gaussian, -SECOND_MOMENT / 6.0)


def weight_factor(lengths, gaussian):
    """Return the factor of the pair weights, (m,): ``1 + mu2 h^2 K / 4``.

    With it slow functions have the right Laplacian. A pair takes its ends' mean.
    """
    return _bent(lengths, gaussian, SECOND_MOMENT / 4.0)


def second_moment(lengths, gaussian):
    """Return the trace of the second moment of weights with that factor over 4 areas, (m,).

    The factor times ``1 - mu2 h^2 K / 3``.
    """
    return weight_factor(lengths, gaussian) * _bent(lengths, gaussian, -SECOND_MOMENT / 3.0)


def _bent(lengths, gaussian, factor):
    return 1.0 + np.clip(factor * lengths**2 * gaussian, -_LARGEST, _LARGEST)


def uneven(excess):
    """Return what an integral of the kernel gains where h varies, next to nothing where it varies too fast to tell."""
    return excess / (1.0 + (excess / _UNEVEN) ** 2)


def mean_curvature(laplacian):
    """Compute the mean curvature from ``Laplacian x = -2 H n``.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the sign: outward ones give a sphere of radius R the value 1 / R.

    Returns
    -------
    ndarray, (n,)
        Mean of the two principal curvatures [1 / L]; where the kernel reaches beyond a boundary, from local quadrics.

    See Also
    --------
    LaplaceBeltrami.apply : What it is computed by.
    estimate_normals : The normals alone.

    Examples
    --------
    It is one everywhere on the unit sphere:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> laplacian = core.build_laplacian(points)
    >>> curvature = core.mean_curvature(laplacian)
    >>> print(curvature.min().round(2), curvature.max().round(2))
    1.0 1.0
    """
    points = laplacian.surface_points
    centered = points - points.mean(axis=0)
    curvature = -0.5 * np.einsum("ij,ij->i", laplacian.apply(centered), laplacian.normals)
    # At a boundary the natural operator takes the surface as level across it.
    return np.where(laplacian.near_boundary, laplacian.mean_curvature, curvature)
