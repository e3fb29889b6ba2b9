"""Modes of two frames of a sequence: their correspondence, signs, and rotations where eigenvalues coincide."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..arguments import check_points, real
from ..errors import InvalidPointsError, PointCloudError
from ..frozen import Frozen
from ..geometry import check_values
from ..linalg import svd
from ..operator import Spectrum
from ..types import Floats, Ints


@dataclass(frozen=True)
class MatchedModes(Frozen):
    """Modes in the order, and with the signs, of those of the frame before.

    Attributes
    ----------
    spectrum : Spectrum
        Mode k continues mode k of the frame before, so that eigenvalues need not ascend. Eigenvectors are orthonormal
        for the areas. Where some were rotated, their eigenvalues are the Rayleigh quotients. No residuals.
    overlaps : ndarray, (count,)
        Cosine of the angle between each mode and the one that it continues, -1 to 1. Small where a mode has left the
        computed ones, or the frames differ too much.
    """

    spectrum: Spectrum
    overlaps: Floats


def match_modes(
    spectrum: Spectrum,
    areas: ArrayLike,
    points: ArrayLike,
    spectrum_before: Spectrum,
    points_before: ArrayLike,
    *,
    tolerance: float = 0.02,
) -> MatchedModes:
    """Order the modes of a frame so that they continue those of the frame before.

    Modes have arbitrary signs, change order where eigenvalues cross, and are any basis of their space where eigenvalues
    coincide. This gives them the order, signs and basis of largest overlap with those of the frame before.

    Parameters
    ----------
    spectrum : Spectrum
        Of this frame, n points.
    areas : array_like, (n,)
        Of its points [L^2].
    points : array_like, (n, 3)
        Of this frame [L].
    spectrum_before : Spectrum
        Of the frame before, m points, of as many modes; as it was matched itself, in a sequence.
    points_before : array_like, (m, 3)
        Of the frame before [L], in any order.
    tolerance : float
        Eigenvalues within this share of each other count as one: points do not distinguish them.

    Returns
    -------
    MatchedModes

    Raises
    ------
    InvalidPointsError
        Points or areas of a wrong shape or not finite, or modes of other points.
    PointCloudError
        Other numbers of modes, or a tolerance that is not from 0 to below 1.

    See Also
    --------
    LaplaceBeltrami.eigenpairs : The modes of a frame.

    Notes
    -----
    Values are taken from the nearest point of the frame before: the surface should move by less between two frames than
    the modes are wide. A mode of this frame is weighed against each one before by its squared overlap, summed over all
    modes of the same eigenvalue, whose own basis thus does not matter; the assignment of the largest sum is taken [1]_,
    and each such set is rotated by the orthogonal Procrustes problem [2]_, which is the sign for a single mode.

    References
    ----------
    .. [1] Crouse, "On implementing 2D rectangular assignment algorithms", IEEE Transactions on Aerospace and Electronic
       Systems 52, 2016.
    .. [2] Schoenemann, "A generalized solution of the orthogonal Procrustes problem", Psychometrika 31, 1966.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> before = laplacian.eigenpairs(4)
    >>> after = mf.Spectrum(before.eigenvalues, -before.eigenvectors)  # as another run may give them
    >>> matched = mf.spectral.match_modes(after, laplacian.areas, points, before, points)
    >>> np.allclose(matched.spectrum.eigenvectors, before.eigenvectors)
    True
    """
    points, points_before = check_points(points), check_points(points_before)
    areas = check_values(areas, len(points), columns=False)
    values, vectors = spectrum.eigenvalues, spectrum.eigenvectors
    count = len(values)
    for frame, own, modes in (("The", points, vectors), ("The earlier", points_before, spectrum_before.eigenvectors)):
        if len(own) != len(modes):
            raise InvalidPointsError(
                f"{frame} frame has {len(own)} points and modes of {len(modes)}. Give points and modes of one frame."
            )
    if spectrum_before.eigenvectors.shape[1] != count:
        raise PointCloudError(
            f"The frame has {count} modes, the earlier one {spectrum_before.eigenvectors.shape[1]}. Compute as many."
        )
    if not 0.0 <= real(tolerance) < 1.0:
        raise PointCloudError(f"The tolerance of eigenvalues is {tolerance!r}. Use a number from 0 to below 1.")

    carried = spectrum_before.eigenvectors[cKDTree(points_before).query(points)[1]]
    overlaps = _overlaps(vectors, areas, carried)
    groups = _equal(values, tolerance)
    weights = np.empty_like(overlaps)
    for group in groups:
        weights[group] = np.sum(overlaps[group] ** 2, axis=0)
    continues = linear_sum_assignment(weights, maximize=True)[1]
    rotation = np.zeros((count, count))
    for group in groups:
        left, _, right = svd(overlaps[np.ix_(group, continues[group])])
        rotation[np.ix_(group, continues[group])] = left @ right
    return MatchedModes(Spectrum(values @ rotation**2, vectors @ rotation), np.sum(rotation * overlaps, axis=0))


def _overlaps(vectors: Floats, areas: Floats, carried: Floats) -> Floats:
    """Return the inner products of modes with those before, (count, count), the latter normalized by these areas."""
    weighted = areas[:, None] * carried
    lengths = np.sqrt(np.sum(carried * weighted, axis=0))
    return vectors.T @ weighted / np.where(lengths > 0.0, lengths, 1.0)


def _equal(values: Floats, tolerance: float) -> list[Ints]:
    """Return sets of modes whose eigenvalues are nearly equal, (g,) int each; they are cut at the widest gaps.

    Zeros, of which each component has one, are distinguished from others by the mean distance of eigenvalues.
    """
    order = np.argsort(values, kind="stable")
    spacing = values[order[-1]] / len(values)
    groups: list[Ints] = []
    rest: list[Ints] = [order]
    while rest:
        group = rest.pop()
        sizes = values[group]
        if sizes[-1] - sizes[0] <= tolerance * max(sizes[-1], spacing):
            groups.append(group)
        else:
            cut = np.argmax(np.diff(sizes)) + 1
            rest += [group[cut:], group[:cut]]
    return groups
