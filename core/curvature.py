"""Curvature from the operator applied to the coordinates."""

import numpy as np


def mean_curvature(laplacian):
    """Compute the mean curvature from ``Laplacian x = -2 H n``.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the sign: outward ones give a sphere of radius R the value 1 / R.

    Returns
    -------
    ndarray, (n,)
        Mean of the two principal curvatures [1 / L].
    """
    centered = laplacian.points - laplacian.points.mean(axis=0)
    return -0.5 * np.einsum("ij,ij->i", laplacian.apply(centered), laplacian.normals)
