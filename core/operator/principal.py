"""Mean and principal curvatures, by the operator and by quadrics, averaged as far as noise asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..algebra import workers
from ..frozen import Frozen
from ..geometry import frames
from ..types import Floats
from .averaging import Averages, Settled, off_neighbors
from .laplacian import LaplaceBeltrami

_OPERATOR = 0.35  # share of the high-frequency part of the operator's curvature: at least as much noise is left in it
_AROUND = 2  # rounds of averaging over which it is compared with the curvature of quadrics
_DECIDES = 0.5  # scatter over a curvature's size from which noise decides it


@dataclass(frozen=True, eq=False)
class MeanCurvature(Frozen):
    """The mean curvature of a surface at each point, made by `measure.measure_mean_curvature`.

    Attributes
    ----------
    values : ndarray, (n,)
        Mean of the two principal curvatures [1 / L].
    scatter : ndarray, (n,)
        Standard deviation of what noise has left in them [1 / L].
    notices : list of str
        Where noise decides.
    """

    values: Floats
    scatter: Floats
    notices: list[str]


def mean_curvature(laplacian: LaplaceBeltrami) -> Floats:
    """Compute the mean curvature: that of ``Laplacian x = -2 H n``, and averages of it where points are noisy.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the sign: outward ones give a sphere of radius R the value 1 / R.

    Returns
    -------
    ndarray, (n,)
        Mean of the two principal curvatures [1 / L]. Without noise it is that of the operator, which has the least
        bias. Noise scatters that more than the `LaplaceBeltrami.quadric_mean_curvature`, which then takes its place, as
        it does where the kernel extends beyond a boundary; and the more noise there is, the more often that is averaged
        over the neighbors, as long as this removes more scatter than it adds bias.

    See Also
    --------
    measure.measure_mean_curvature : The same with what noise has left in it.
    LaplaceBeltrami.apply : What it is computed by.
    measure.principal_curvatures : Both curvatures that it is the mean of.
    estimate_normals : The normals alone.

    Examples
    --------
    It is one everywhere on the unit sphere:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> curvature = mf.measure.mean_curvature(laplacian)
    >>> print(curvature.min().round(1), curvature.max().round(1))
    1.0 1.0
    """
    return measure_mean_curvature(laplacian).values


@workers()
def measure_mean_curvature(laplacian: LaplaceBeltrami) -> MeanCurvature:
    """Compute the mean curvature, and what noise has left in it.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals fix the sign.

    Returns
    -------
    MeanCurvature

    See Also
    --------
    measure.mean_curvature : Its values.

    Examples
    --------
    A tenth of the spacing, 0.013, of noise on the unit sphere leaves little of itself, as the curvature is the same
    everywhere:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> noise = 0.013 * np.random.default_rng(0).normal(size=(len(points), 1))
    >>> found = mf.measure.measure_mean_curvature(mf.build_laplacian(points * (1.0 + noise)))
    >>> print(found.values.mean().round(1), found.scatter.mean() < 0.1, found.notices)
    1.0 True []
    """
    averages = Averages(laplacian)
    settled = _settled_mean(laplacian, averages)
    values, scatter = settled.values[:, 0], np.sqrt(settled.variance)
    return MeanCurvature(values, scatter, _notices(laplacian, averages, np.abs(values), scatter, "mean curvature"))


def _settled_mean(laplacian: LaplaceBeltrami, averages: Averages) -> Settled:
    """Return the mean curvature, (n, 1), with as much averaging as its noise asks for."""
    points, normals, near = laplacian.surface_points, laplacian.normals, laplacian.near_boundary
    vector = -0.5 * laplacian.apply(points - points.mean(axis=0))
    rough = off_neighbors(laplacian, vector, 2)
    high = np.einsum("ij,ij->i", rough, normals)
    own, quadric = np.einsum("ij,ij->i", vector, normals) - high, laplacian.quadric_mean_curvature
    # The Neumann condition takes the surface as flat across a boundary: near one quadrics alone count.
    change = np.where(near, 0.0, own - quadric)
    chance = _OPERATOR * averages.mean_square(np.where(near, 0.0, high)[:, None], _AROUND)
    differs = averages.mean_square(change[:, None], _AROUND)
    quiet = np.clip(1.0 - chance / np.where(differs > 0.0, differs, 1.0), 0.0, 1.0)
    return averages.settle(averages.of((quadric + quiet * change)[:, None]))


def _notices(laplacian: LaplaceBeltrami, averages: Averages, size: Floats, scatter: Floats, what: str) -> list[str]:
    """Return a notice if at most points noise scatters a curvature by more than half of its size, (n,) both."""
    known = laplacian.component >= 0
    decided = known & averages.noisy & (scatter > _DECIDES * size)
    if 2 * np.count_nonzero(decided) <= np.count_nonzero(known):
        return []
    share = np.count_nonzero(decided) / np.count_nonzero(known)
    return [
        f"Noise decides the {what}: at {share:.0%} of the points values are less than twice what noise leaves in them."
        " The surface may be flat; if not, a greater bandwidth_factor averages over more points."
    ]


@dataclass(frozen=True, eq=False)
class PrincipalCurvatures(Frozen):
    """The greatest and the least curvature of a surface at each point, made by `measure.principal_curvatures`.

    Attributes
    ----------
    first, second : ndarray, (n,)
        Greatest and least curvature of the curves across the surface [1 / L], with the sign of
        `measure.mean_curvature`.
    direction : ndarray, (n, 3)
        Unit tangent along which the first is met; the second is met across it. Where both are alike it is arbitrary,
        and its sign is so everywhere.
    scatter : ndarray, (n,)
        Standard deviation of what noise has left in their mean and in half their difference, together [1 / L].
    notices : list of str
        Where noise decides.
    """

    first: Floats
    second: Floats
    direction: Floats
    scatter: Floats
    notices: list[str]

    @property
    def shape_index(self) -> Floats:
        """The kind of shape, (n,): 1 a cap, 1/2 a ridge, 0 a saddle, -1/2 a valley, -1 a cup; 0 where it is flat."""
        return np.arctan2(self.first + self.second, self.first - self.second) * (2.0 / np.pi)

    @property
    def curvedness(self) -> Floats:
        """How strongly the surface is curved, whatever its shape, (n,) [1 / L]: root mean square of both."""
        return np.hypot(self.first, self.second) / np.sqrt(2.0)


@workers()
def principal_curvatures(laplacian: LaplaceBeltrami) -> PrincipalCurvatures:
    """Compute the principal curvatures: their mean by the operator, their difference and direction by local quadrics.

    Where points are noisy both are averaged over the neighbors, as far as that takes away more scatter than it adds
    bias: the shape operator as a tensor, so that noise in it does not add up to a difference that is not there. With a
    greater `LaplacianOptions.bandwidth_factor` each average is over more points.

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
    measure.mean_curvature : Their mean.

    References
    ----------
    Koenderink, van Doorn. Surface shape and curvature scales. 1992. For shape index and curvedness.

    Examples
    --------
    On the unit sphere, a cap everywhere, both are one:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> curvatures = mf.measure.principal_curvatures(mf.build_laplacian(points))
    >>> print(curvatures.first.mean().round(1), curvatures.second.mean().round(1))
    1.0 1.0
    >>> print(curvatures.shape_index.mean().round(1))
    1.0
    """
    averages = Averages(laplacian)
    mean = _settled_mean(laplacian, averages)
    _, v, u = np.moveaxis(frames(laplacian.normals), 2, 0)

    def differences(tensor: Floats) -> Floats:
        along, across, mixed = (
            np.einsum("ia,iab,ib->i", left, tensor, right) for left, right in ((u, u), (v, v), (u, v))
        )
        return np.stack([0.5 * (along - across), mixed], axis=1)

    settled = averages.settle([differences(tensor) for tensor in averages.of(laplacian.shape_operator)])
    half = np.hypot(*settled.values.T)
    angle = 0.5 * np.arctan2(settled.values[:, 1], settled.values[:, 0])[:, None]
    level, scatter = mean.values[:, 0], np.sqrt(mean.variance + settled.variance)
    return PrincipalCurvatures(
        first=level + half,
        second=level - half,
        direction=np.cos(angle) * u + np.sin(angle) * v,
        scatter=scatter,
        notices=_notices(laplacian, averages, np.hypot(level, half), scatter, "principal curvatures"),
    )
