"""Curvature: its effect on the kernel, the mean one from the operator applied to the coordinates, principal ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import CURVED, frames
from ..kernel import SECOND_MOMENT
from ..types import Floats

if TYPE_CHECKING:
    from .laplacian import LaplaceBeltrami

_UNEVEN = 0.01  # gain of an integral over the kernel, from h that varies, up to which the expansion holds


def kernel_integral(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the integral of the kernel over the surface around each point, (m,): ``1 - mu2 h^2 K / 6``.

    Clipped, as all terms of curvature here.
    """
    return _curved(lengths, gaussian, -SECOND_MOMENT / 6.0)


def weight_factor(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the factor of the pair weights, (m,): ``1 + mu2 h^2 K / 4``.

    With it slow functions have the right Laplacian. A pair takes its ends' mean.
    """
    return _curved(lengths, gaussian, SECOND_MOMENT / 4.0)


def second_moment(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the trace of the second moment of weights with that factor over 4 areas, (m,).

    The factor times ``1 - mu2 h^2 K / 3``.
    """
    return weight_factor(lengths, gaussian) * _curved(lengths, gaussian, -SECOND_MOMENT / 3.0)


def _curved(lengths: Floats, gaussian: Floats, factor: float) -> Floats:
    return 1.0 + np.clip(factor * lengths**2 * gaussian, -CURVED, CURVED)


def uneven(excess: Floats) -> Floats:
    """Return the gain of an integral of the kernel where h varies, damped where it varies too fast for that."""
    return excess / (1.0 + (excess / _UNEVEN) ** 2)


def mean_curvature(laplacian: LaplaceBeltrami) -> Floats:
    """Compute the mean curvature from ``Laplacian x = -2 H n``.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the sign: outward ones give a sphere of radius R the value 1 / R.

    Returns
    -------
    ndarray, (n,)
        Mean of the two principal curvatures [1 / L], averaged over the kernel, without what changes from each point to
        its neighbours, which is noise; where the kernel extends beyond a boundary,
        `LaplaceBeltrami.quadric_mean_curvature`.

    See Also
    --------
    LaplaceBeltrami.quadric_mean_curvature : That of local quadrics, and how far the two differ.
    LaplaceBeltrami.apply : What it is computed by.
    principal_curvatures : Both curvatures that it is the mean of.
    estimate_normals : The normals alone.

    Examples
    --------
    It is one everywhere on the unit sphere:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> laplacian = core.build_laplacian(points)
    >>> curvature = core.mean_curvature(laplacian)
    >>> print(curvature.min().round(1), curvature.max().round(1))
    1.0 1.0
    """
    points, normals, edge = laplacian.surface_points, laplacian.normals, laplacian.near_boundary[:, None]
    # At a boundary the natural operator takes the surface as level across it.
    at_edge = laplacian.quadric_mean_curvature[:, None] * normals
    vector = np.where(edge, at_edge, -0.5 * laplacian.apply(points - points.mean(axis=0)))
    vector -= np.where(edge, 0.0, _off_neighbors(laplacian, _off_neighbors(laplacian, vector)))
    return np.einsum("ij,ij->i", vector, normals)


def _off_neighbors(laplacian: LaplaceBeltrami, values: Floats) -> Floats:
    """Return how far values are off the mean of their neighbours by the weights of the stiffness, (n, k).

    Twice of it is of fourth order for what varies with the place, and all of what changes from point to point.
    """
    weight = laplacian.stiffness.diagonal()
    return (laplacian.stiffness @ values) / np.where(weight > 0.0, weight, 1.0)[:, None]


@dataclass(frozen=True, eq=False)
class PrincipalCurvatures:
    """The greatest and the least curvature of a surface at each point, made by `principal_curvatures`.

    Attributes
    ----------
    first, second : ndarray, (n,)
        Greatest and least curvature of the curves across the surface [1 / L], with the sign of `mean_curvature`.
    direction : ndarray, (n, 3)
        Unit tangent along which the first is met; the second is met across it. Where both are alike it is arbitrary,
        and its sign is so everywhere.
    """

    first: Floats
    second: Floats
    direction: Floats

    @property
    def shape_index(self) -> Floats:
        """The kind of shape, (n,): 1 a cap, 1/2 a ridge, 0 a saddle, -1/2 a valley, -1 a cup; 0 where it is flat."""
        return np.arctan2(self.first + self.second, self.first - self.second) * (2.0 / np.pi)

    @property
    def curvedness(self) -> Floats:
        """How strongly the surface is curved, whatever its shape, (n,) [1 / L]: root mean square of both."""
        return np.hypot(self.first, self.second) / np.sqrt(2.0)


def principal_curvatures(laplacian: LaplaceBeltrami) -> PrincipalCurvatures:
    """Compute the principal curvatures: their mean by the operator, their difference and direction by local quadrics.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the signs: outward ones give a sphere of radius R twice 1 / R.

    Returns
    -------
    PrincipalCurvatures
        Zero, with an arbitrary direction, at points that were left out.

    See Also
    --------
    mean_curvature : Their mean.

    References
    ----------
    Koenderink, van Doorn. Surface shape and curvature scales. 1992. For shape index and curvedness.

    Examples
    --------
    On the unit sphere, a cap everywhere, both are one:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> curvatures = core.principal_curvatures(core.build_laplacian(points))
    >>> print(curvatures.first.mean().round(1), curvatures.second.mean().round(1))
    1.0 1.0
    >>> print(curvatures.shape_index.mean().round(1))
    1.0
    """
    _, v, u = np.moveaxis(frames(laplacian.normals), 2, 0)
    along, across, mixed = (
        np.einsum("ia,iab,ib->i", left, laplacian.shape_operator, right) for left, right in ((u, u), (v, v), (u, v))
    )
    half = np.hypot(0.5 * (along - across), mixed)
    angle = 0.5 * np.arctan2(2.0 * mixed, along - across)[:, None]
    mean = mean_curvature(laplacian)
    return PrincipalCurvatures(mean + half, mean - half, np.cos(angle) * u + np.sin(angle) * v)
