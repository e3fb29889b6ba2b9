"""Weights that take the place of others."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, check_finite, check_switches, not_negative
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import as_mask
from ..types import Floats

_EVEN = 1e-3  # what sums of normalized weights may be off, as Blender's painted ones are


def mix_weights(
    before: ArrayLike,
    taken: ArrayLike,
    *,
    mix: float = 1.0,
    locked: ArrayLike = (),
    kept: ArrayLike = (),
    normalize: bool = False,
) -> Floats:
    """Replace weights by others, or mix both, without locked groups.

    Parameters
    ----------
    before, taken : array_like, (n, b)
        Weights that there are, and those that replace them; not negative.
    mix : float
        Share of the weights taken, from 0 to 1; the rest is that of those before.
    locked : array_like, (b,) bool or (k,) int
        Columns that stay exactly as they were.
    kept : array_like, (b,) bool or (k,) int
        Columns of which nothing is taken. Where sums are one, they give way to the others.
    normalize : bool
        Let rows sum to one, as far as columns that are not locked can.

    Returns
    -------
    ndarray, (n, b)

    Raises
    ------
    InvalidPointsError
        Weights of different shapes, negative, or not finite.
    PointCloudError
        A mix that is not from 0 to 1.

    See Also
    --------
    transfer_values : Takes weights from the surface of others.

    Examples
    --------
    The first group is locked, and the other two share what it leaves:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> before, taken = np.tile([0.5, 0.5, 0], (800, 1)), np.tile([0, 0.2, 0.8], (800, 1))
    >>> print(mf.rig.mix_weights(before, taken, locked=[0], normalize=True)[0].round(2))
    [0.5 0.1 0.4]
    """
    advice = "Give one row for each point, with a weight for each group."
    first = as_doubles(check_array(before, "Weights", [(None, None)], advice, "biuf"))
    second = as_doubles(check_array(taken, "Weights", [first.shape], advice, "biuf"))
    for given in (first, second):
        check_finite(given, "weights", "Replace them.")
        if (given < 0.0).any():
            raise InvalidPointsError(
                f"{np.count_nonzero((given < 0.0).any(axis=1))} points have negative weights. Give weights from 0 on."
            )
    share = not_negative(mix, "mix")
    if share > 1.0:
        raise PointCloudError(f"The mix is {mix!r}. Use a number from 0 to 1.")
    check_switches(normalize=normalize)
    fixed = as_mask(locked, first.shape[1])
    stays = as_mask(kept, first.shape[1]) & ~fixed
    moves = ~fixed & ~stays
    result = np.where(moves, (1.0 - share) * first + share * second, first)
    if not normalize:
        return result
    room = np.maximum(1.0 - result[:, fixed].sum(axis=1), 0.0)
    total = result[:, moves].sum(axis=1)
    # Without columns that give way, those that are taken fill the room.
    sizes = np.minimum(total, room) if stays.any() else np.where(total > 0.0, room, 0.0)
    result[:, moves] *= (sizes / np.where(total > 0.0, total, 1.0))[:, None]
    rest = result[:, stays].sum(axis=1)
    result[:, stays] *= ((room - sizes) / np.where(rest > 0.0, rest, 1.0))[:, None]
    return result


def are_normalized(weights: ArrayLike) -> bool:
    """Whether the weights of all points that have any sum to one.

    Parameters
    ----------
    weights : array_like, (n, b)

    Returns
    -------
    bool

    See Also
    --------
    mix_weights : Normalizes.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> upper = points[:, 2] > 0
    >>> print(mf.rig.are_normalized(np.column_stack([upper, ~upper])), mf.rig.are_normalized(0.5 * upper[:, None]))
    True False
    """
    total = as_doubles(check_array(weights, "Weights", [(None, None)], "Give a row for each point.", "biuf")).sum(
        axis=1
    )
    return bool(total.any() and (np.abs(total[total > 0.0] - 1.0) <= _EVEN).all())
