"""Curvature: its effect on the kernel, and the mean curvature from the operator applied to the coordinates."""

import numpy as np

from .kernel import SECOND_MOMENT

_UNEVEN = 0.01  # gain of an integral over the kernel, from h that varies, up to which it is known
_LARGEST = 0.3  # most that a curvature term may change an area or a weight, where the fit is poor


def kernel_integral(lengths, gaussian):
    """Return the integral of the kernel over the surface around each point, ``1 - mu2 h^2 K / 6``, clipped, (m,)."""
    return 1.0 - np.clip(SECOND_MOMENT / 6.0 * lengths**2 * gaussian, -_LARGEST, _LARGEST)


def weight_factor(lengths, gaussian):
    """Return the factor of the pair weights, ``1 + mu2 h^2 K / 4``, clipped, (m,); a pair takes its ends' mean."""
    return 1.0 + np.clip(SECOND_MOMENT / 4.0 * lengths**2 * gaussian, -_LARGEST, _LARGEST)


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
        Mean of the two principal curvatures [1 / L]; where the kernel reaches beyond a rim, from local quadrics.
    """
    points = laplacian.surface_points
    centered = points - points.mean(axis=0)
    curvature = -0.5 * np.einsum("ij,ij->i", laplacian.apply(centered), laplacian.normals)
    # At a rim the natural operator takes the surface as level across it.
    return np.where(laplacian.near_rim, laplacian.mean_bend, curvature)
