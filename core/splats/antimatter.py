"""Files .splat of the viewer antimatter15/splat: 32 bytes per splat, without a header."""

import os
from pathlib import Path

import numpy as np

from ..errors import InvalidPointsError
from ..files import PlyVertices
from .columns import COLORS, OPACITY, PLACES, ROTATIONS, SCALES, encode_opacities, encode_scales, split
from .harmonics import CONSTANT

_RECORD = np.dtype([("place", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("rotation", "u1", 4)])


def read_antimatter(path: Path) -> PlyVertices:
    """Read a .splat file as the columns of trainers.

    A size that is not that of whole splats raises `InvalidPointsError`.
    """
    size = os.stat(path).st_size
    if size % _RECORD.itemsize:
        raise InvalidPointsError(
            f"{path} is no .splat file: its {size} bytes are not {_RECORD.itemsize} for each splat. Copy or export it"
            " again."
        )
    rows = np.fromfile(path, _RECORD)
    colors, scales = rows["color"] / 255.0, rows["scale"].astype(np.float64)
    columns = {
        **split(PLACES, rows["place"]),
        **split(COLORS, (colors[:, :3] - 0.5) / CONSTANT),
        OPACITY: encode_opacities(colors[:, 3]).astype(np.float32),
        **split(SCALES, encode_scales(scales)),
        **split(ROTATIONS, rows["rotation"] / 128.0 - 1.0),
    }
    return PlyVertices(columns, "<", [], [])
