"""Values that points take from the surface of others: weights of bones, colors, labels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, check_finite
from ..errors import InvalidPointsError, PointCloudError
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Array, Floats, Progress
from .inpainting import inpaint, inpaint_labels
from .places import SurfaceMatch


@ends_at_one
def transfer_values(
    target: LaplaceBeltrami, match: SurfaceMatch, values: ArrayLike, *, progress: Progress | None = None
) -> Floats:
    """Give points the values of a matched surface, and fill in the others.

    Parameters
    ----------
    target : LaplaceBeltrami
        Of n points.
    match : SurfaceMatch
        Of these points, with m points of sources.
    values : array_like, (m,) or (m, k)
        Of the sources, one after another: weights, colors, any numbers.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,) or (n, k)
        No number leaves the range of its column.

    Raises
    ------
    InvalidPointsError
        A match of other points, or values of another number or not finite.
    PointCloudError
        No point has a place on the surface.

    See Also
    --------
    inpaint : How points without a place get theirs.

    Examples
    --------
    The height over the unit sphere, of another sample of it:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> target, source = mf.build_laplacian(points[:, [1, 2, 0]]), mf.build_laplacian(points)
    >>> match = mf.rig.match_surface(target, source)
    >>> height = mf.rig.transfer_values(target, match, points[:, 2])
    >>> print(np.abs(height - target.points[:, 2]).max() < 0.01)
    True
    """
    given = as_doubles(_checked(target, match, values, "Values", "iuf"))
    used = given[match.weights.indices]
    check_finite(used, "values", "Replace them, or leave their points out.")
    columns = given.reshape(len(given), -1)
    # Values that are not finite elsewhere take no part: the match skips them.
    low, high = used.min(axis=0), used.max(axis=0)
    taken = np.clip(match.weights @ np.nan_to_num(columns), low, high)[match.known]
    found = np.clip(inpaint(target, match.known, taken, progress=progress), low, high)
    return found.reshape(len(found), *given.shape[1:])


def transfer_labels(target: LaplaceBeltrami, match: SurfaceMatch, labels: ArrayLike) -> Array:
    """Give points the labels of a matched surface, and fill in the others, from the nearest each.

    Parameters
    ----------
    target : LaplaceBeltrami
        Of n points.
    match : SurfaceMatch
        Of these points, with m points of sources.
    labels : array_like, (m,) or (m, k)
        Of the sources, one after another: whole numbers, truth values, or rows of numbers that must not be averaged.

    Returns
    -------
    ndarray, (n,) or (n, k)
        Of the same type.

    Raises
    ------
    InvalidPointsError
        A match of other points, or labels of another number.
    PointCloudError
        No point has a place on the surface.

    See Also
    --------
    inpaint_labels : How points without a place get theirs.

    Examples
    --------
    Which half of the unit sphere points are on, of another sample of it:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> target, source = mf.build_laplacian(points[:, [1, 2, 0]]), mf.build_laplacian(points)
    >>> found = mf.rig.transfer_labels(target, mf.rig.match_surface(target, source), points[:, 2] > 0)
    >>> print((found == (target.points[:, 2] > 0)).mean() > 0.95)
    True
    """
    given = _checked(target, match, labels, "Labels", "biuf")
    return inpaint_labels(target, match.known, given[match.nearest[match.known]])


def _checked(target: LaplaceBeltrami, match: SurfaceMatch, values: ArrayLike, name: str, kinds: str) -> Array:
    """Return values of the sources of a match as an array, after checks of all three."""
    if len(match.known) != len(target.points):
        raise InvalidPointsError(
            f"The match is of {len(match.known)} points, and the target has {len(target.points)}. Match these."
        )
    if not match.known.any():
        raise PointCloudError(
            f"No point lies within {match.limit:.3g} of the surface of the source, with normals that agree. Move one"
            " onto the other, or raise the distance or the angle."
        )
    count = match.weights.shape[1]
    shapes: list[tuple[int | None, ...]] = [(count,), (count, None)]
    return check_array(values, name, shapes, f"Give one row for each of the {count} points of the sources.", kinds)
