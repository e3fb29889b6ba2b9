"""Floaters: splats that show no surface, which training leaves in the air and where few pictures look."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..errors import InvalidPointsError
from ..types import Bools, Floats
from .splats import Splats

_SEEN = 0.05  # opacity in the middle: nobody sees that less of what lies behind comes through
_HUGE = 10.0  # times the median length: the middle of such a splat tells nothing of the shape
_APART = 3.0  # standard deviations, and times the median, at which a splat touches no other one
_AGREEING = 3  # neighbours that it must touch, as on each of the three faces at a corner
_NEIGHBORS = 12  # nearest middles, of which these are chosen
_BLOCK = 1 << 13  # splats looked at at one time


def floaters(splats: Splats) -> Bools:
    """Find splats that show no surface: hardly seen ones, huge ones, and such as float alone.

    Splats cover a surface without gaps, so that each of them touches others. How far two are apart is measured by the
    Mahalanobis distance of their middles, in standard deviations of both ellipsoids together: along flat splats far,
    across them near. Isolated are those whose third such distance is above three, and above three times the median,
    which serves splats that leave gaps everywhere.

    Parameters
    ----------
    splats : Splats

    Returns
    -------
    ndarray, (n,) bool
        Those with an opacity below 0.05, those ten times as long as the median of the others, and of what is left the
        isolated ones. Turning or scaling all splats, or giving them in another order, changes nothing.

    Raises
    ------
    InvalidPointsError
        Positions, lengths, rotations or opacities that are not finite.

    See Also
    --------
    build_laplacian : Leaves them out, by ``left_out``.
    read_splats : Reads files of splats.

    References
    ----------
    Zhou, Laehner. Laplace-Beltrami operator for Gaussian splatting. 2025 (neighbors by the Mahalanobis distance).
    """
    if not hasattr(splats, "covariances"):
        raise InvalidPointsError(f"These are {type(splats).__name__}, not Splats. Use read_splats, or Splats(...).")
    positions, opacities = np.asarray(splats.positions, dtype=np.float64), splats.opacities
    lengths = np.max(splats.scales, axis=1, initial=0.0)
    for values in (positions, splats.scales, splats.rotations, opacities):
        bad = np.count_nonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))
        if bad:
            raise InvalidPointsError(f"{bad} of {len(values)} splats have values that are not finite. Delete these.")
    kept = opacities >= _SEEN
    if kept.any():
        kept &= lengths <= _HUGE * np.median(lengths[kept])
    rows = np.flatnonzero(kept)
    if len(rows) > _NEIGHBORS:
        apart = _gaps(positions[rows], splats.covariances[rows])
        kept[rows] = apart <= _APART * max(1.0, float(np.median(apart)))
    return ~kept


def floating_rows(splats: Any) -> Any:
    """Return the floaters that operators leave out, as indices: all, or none where these are the larger part."""
    rows = np.flatnonzero(floaters(splats))
    return rows if 2 * len(rows) < len(splats) else rows[:0]


def _gaps(positions: Floats, covariances: Floats) -> Floats:
    """Return the third of the Mahalanobis distances from each splat to its neighbors, (m,)."""
    result = np.empty(len(positions))
    index = cKDTree(positions).query(positions, k=_NEIGHBORS + 1, workers=-1)[1][:, 1:]
    # Flat ones have no inverse: a millionth of the length is no thickness that matters.
    ridge = 1e-12 * np.trace(covariances, axis1=1, axis2=2)[:, None, None] * np.eye(3) + np.finfo(float).tiny * np.eye(
        3
    )
    covariances = covariances + ridge

    def measure(part: Any) -> None:
        near = index[part]
        steps = positions[near] - positions[part][:, None]
        both = covariances[near] + covariances[part][:, None]
        squares = np.einsum("nki,nki->nk", steps, np.linalg.solve(both, steps[..., None])[..., 0])
        result[part] = np.sqrt(np.partition(squares, _AGREEING - 1, axis=1)[:, _AGREEING - 1])

    on_all_cores(measure, blocks(len(positions), _BLOCK))
    return result
