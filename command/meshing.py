"""Settings of meshes, and their small holes, for the command line and for Blender's tool."""

import numpy as np

from .settings import Setting

GAP = 12  # edges around a hole that counts as a gap between points, and is closed

MESH = {
    setting.name: setting
    for setting in (
        Setting(
            "detail",
            "How many edges there are along the distance between neighboring points; 2 makes four times as many faces"
            " as 1",
            1.0,
            0.05,
            16.0,
        ),
    )
}


def close_gaps(faces, most=GAP):
    """Close the small holes of a mesh by triangles.

    Parameters
    ----------
    faces : ndarray, (q, k) int
        Oriented alike.
    most : int
        Edges around the largest hole that is closed.

    Returns
    -------
    ndarray, (t, 3) int
        The triangles, oriented as the faces are.
    int
        How many edges of one face are left.
    """
    begin, end = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2).T.astype(np.int64)
    count = int(faces.max(initial=-1)) + 1
    lone = ~np.isin(begin * count + end, end * count + begin)
    begin, end = begin[lone], end[lone]
    following = np.full(count, -1)
    following[end] = begin  # against the faces, as those in a hole have these edges
    following[np.bincount(begin, minlength=count) != 1] = -1  # where holes touch, it is not known which way to go
    loops = list(_small_loops(following, most))
    return np.concatenate([np.empty((0, 3), np.int64), *map(_fans, loops)]), len(begin) - sum(map(np.size, loops))


def _small_loops(following, most):
    """Yield the loops of vertices, by which of them follows each, as arrays (m, k) for k from 3 on."""
    walks = np.flatnonzero(following >= 0)[:, None]
    for size in range(1, most + 1):
        step = following[walks[:, -1]]
        closed = step == walks[:, 0]
        loops = walks[closed]
        if size > 2:
            yield loops[loops[:, 0] == loops.min(axis=1)]  # each is found from all of its vertices
        going = ~closed & (step >= 0)
        walks = np.column_stack([walks[going], step[going]])


def _fans(loops):
    """Return the triangles of loops, (m, k), around the first vertex of each, (m (k - 2), 3)."""
    corners = np.arange(1, loops.shape[1] - 1)
    first = np.broadcast_to(loops[:, :1], (len(loops), len(corners)))
    return np.stack([first, loops[:, corners], loops[:, corners + 1]], axis=2).reshape(-1, 3)
