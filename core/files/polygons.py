"""Faces of several corners as triangles."""

import numpy as np

from ..types import Floats, Ints


def triangles(faces: Ints, points: Floats) -> Ints:
    """Divide faces of k corners, (m, k), into triangles, quads along their shorter diagonal, others into fans."""
    if faces.shape[1] == 4:
        places = points[faces]
        first, second = (np.linalg.norm(places[:, end] - places[:, end - 2], axis=1) for end in (2, 3))
        faces = np.where((first <= second)[:, None], faces, np.roll(faces, -1, axis=1))
    fans = [faces[:, [0, corner, corner + 1]] for corner in range(1, faces.shape[1] - 1)]
    return np.stack(fans, axis=1).reshape(-1, 3)
