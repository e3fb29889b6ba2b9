"""The pose of a scanner: where it stood, and how it was turned."""

from collections.abc import Sequence

import numpy as np

from ..types import Floats
from .table import NORMAL, SCANNER, PointTable


def turn(table: PointTable, quaternion: Sequence[float]) -> None:
    """Rotate points and normals of a table, in place, about the origin, by a quaternion w x y z of any length.

    One that is zero, or not finite, raises ValueError.
    """
    w, x, y, z = quaternion
    square = w * w + x * x + y * y + z * z
    if not 0.0 < square < np.inf:
        raise ValueError("a scan has an invalid rotation")
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation = np.eye(3) + (2.0 / square) * (w * cross + cross @ cross)
    table.points = table.points @ rotation.T
    if NORMAL in table.attributes:
        table.attributes[NORMAL] = (table.attributes[NORMAL] @ rotation.T).astype(np.float32)


def shift(table: PointTable, position: Floats) -> None:
    """Move points by the position of their scanner, (3,), and keep it; one that is not finite raises ValueError."""
    if not np.isfinite(position).all():
        raise ValueError("a scanner position is invalid")
    table.points += position
    table.attributes[SCANNER] = np.tile(position, (len(table.points), 1))
    table.single = table.single and not position.any()
