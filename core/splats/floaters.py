"""Floaters: splats off the surface, which training leaves in empty space and where few pictures look."""

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..arguments import check_finite
from ..cores import cores
from ..errors import InvalidPointsError
from ..linalg import solve
from ..types import Bools, Floats, Ints
from .splats import Splats

_SEEN = 0.05  # opacity at the center below which a splat is invisible
_HUGE = 10.0  # times the median length: the center of such a splat is not on the surface
_APART = 3.0  # standard deviations, and times the median, at which a splat touches no other one
_AGREEING = 3  # neighbors that it must touch, as on each of the three faces at a corner
_NEIGHBORS = 12  # nearest centers, of which these are chosen
_BLOCK = 1 << 13  # splats worked on at one time


def floaters(splats: Splats) -> Bools:
    """Find splats that belong to no surface: nearly transparent, huge or isolated ones.

    Splats cover a surface without gaps, so that each of them touches others. The distance of two is the Mahalanobis
    distance of their centers, in standard deviations of both ellipsoids together: large along flat splats, small
    across them. Isolated are those whose third such distance is above three, and above three times the median, for
    splats with gaps everywhere.

    Parameters
    ----------
    splats : Splats

    Returns
    -------
    ndarray, (n,) bool
        Those with an opacity below 0.05, those ten times as long as the median of the others, and of the rest the
        isolated ones. Rotating or scaling all splats, or their order, makes no difference.

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
    for name in ("positions", "scales", "rotations", "opacities"):
        check_finite(getattr(splats, name), f"{name} of splats", "Delete these splats.")
    positions = np.asarray(splats.positions, dtype=np.float64)
    lengths = np.max(splats.scales, axis=1, initial=0.0)
    kept = splats.opacities >= _SEEN
    if kept.any():
        kept &= lengths <= _HUGE * np.median(lengths[kept])
    rows = np.flatnonzero(kept)
    if len(rows) > _NEIGHBORS:
        apart = _gaps(positions[rows], splats.covariances[rows])
        kept[rows] = apart <= _APART * max(1.0, float(np.median(apart)))
    return ~kept


def floating_rows(splats: Splats) -> Ints:
    """Return the floaters that operators leave out, as indices: all, or none where these are the larger part."""
    rows = np.flatnonzero(floaters(splats))
    return rows if 2 * len(rows) < len(splats) else rows[:0]


def _gaps(positions: Floats, covariances: Floats) -> Floats:
    """Return the third of the Mahalanobis distances from each splat to its neighbors, (m,)."""
    result = np.empty(len(positions))
    index = cKDTree(positions).query(positions, k=_NEIGHBORS + 1, workers=cores())[1][:, 1:]
    # Flat ones have no inverse: a thickness of a millionth of the length is negligible.
    ridge = 1e-12 * np.trace(covariances, axis1=1, axis2=2) + np.finfo(float).tiny
    covariances = covariances + ridge[:, None, None] * np.eye(3)

    def measure(rows: slice) -> None:
        near = index[rows]
        steps = positions[near] - positions[rows][:, None]
        both = covariances[near] + covariances[rows][:, None]
        squares = np.einsum("nki,nki->nk", steps, solve(both, steps[..., None])[..., 0])
        result[rows] = np.sqrt(np.partition(squares, _AGREEING - 1, axis=1)[:, _AGREEING - 1])

    on_all_cores(measure, blocks(len(positions), _BLOCK))
    return result
