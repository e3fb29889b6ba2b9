"""Packed PLY files of Gaussian splats by PlayCanvas and SuperSplat: four whole numbers per splat.

Each element "chunk" holds the least and greatest positions, logarithms of sizes, and colors of 256 splats, between
which their numbers are quantized. An optional element "sh" holds the harmonics as bytes.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import InvalidPointsError
from ..files import PlyVertices, brief, read_elements
from ..types import Array, Floats, Ints
from .columns import COLORS, OPACITY, PLACES, ROTATIONS, SCALES, encode_opacities, split, stack
from .ellipsoids import completed_quaternions
from .harmonics import CONSTANT

MARK = "packed_position"
_PACKED = (MARK, "packed_rotation", "packed_scale", "packed_color")
_PLACES, _SIZES, _COLORS = ("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), ("r", "g", "b")
_CHUNK = 256  # splats
_HARMONICS = 8.0  # between the least and the greatest one
_SINGLE = np.float32


def read_packed(path: Path) -> PlyVertices:
    """Read the splats of a packed PLY file as the columns of trainers.

    Elements or properties that are missing, or do not fit each other, raise `InvalidPointsError`.
    """
    order, comments, elements = read_elements(path)
    vertices, chunks = elements["vertex"], elements.get("chunk", {})
    axes = (*_PLACES, *_SIZES, *(_COLORS if "min_r" in chunks else ()))
    bounds = [f"{end}_{axis}" for end in ("min", "max") for axis in axes]
    missing = [name for name in _PACKED if name not in vertices] + [name for name in bounds if name not in chunks]
    count = len(vertices[MARK])
    wrong = f"no {brief(', '.join(missing))}" if missing else f"{len(chunks[bounds[0]])} chunks"
    if missing or len(chunks[bounds[0]]) != -(-count // _CHUNK):
        raise InvalidPointsError(f"{path}: {count} packed splats, but {wrong}. Save it again, as a plain PLY.")
    columns = _unpack({name: vertices[name].astype(np.uint32) for name in _PACKED}, chunks)
    harmonics = elements.get("sh", {})
    if any(len(values) != count for values in harmonics.values()):
        raise InvalidPointsError(f"{path}: {count} packed splats, but another number of harmonics. Save it again.")
    columns.update((name, _decode_harmonics(values)) for name, values in harmonics.items())
    columns.update((name, values) for name, values in vertices.items() if name not in _PACKED)
    return PlyVertices(columns, order, comments, [])


def _unpack(packed: dict[str, Ints], chunks: dict[str, Array]) -> dict[str, Array]:
    """Return positions, sizes, rotations, colours and opacities."""
    rows = np.arange(len(packed[MARK])) // _CHUNK
    places = _between(chunks, _PLACES, rows, _shares(packed[MARK], (11, 10, 11)))
    sizes = _between(chunks, _SIZES, rows, _shares(packed["packed_scale"], (11, 10, 11)))
    *shares, opacities = _shares(packed["packed_color"], (8, 8, 8, 8))
    colors = _between(chunks, _COLORS, rows, shares) if "min_r" in chunks else np.stack(shares, axis=1)
    largest, *rest = _shares(packed["packed_rotation"], (2, 10, 10, 10))
    others = (np.stack(rest, axis=1) - 0.5) * np.sqrt(2.0)
    return {
        **split(PLACES, places),
        **split(COLORS, (colors - 0.5) / CONSTANT),
        OPACITY: encode_opacities(opacities).astype(_SINGLE),
        **split(SCALES, sizes),
        **split(ROTATIONS, completed_quaternions(np.round(3.0 * largest).astype(int), others)),
    }


def _shares(packed: Ints, widths: tuple[int, ...]) -> list[Floats]:
    """Return the numbers of so many bits each, from the highest bit on, as shares from 0 to 1, (n,) each."""
    ends = np.cumsum(widths)
    return [
        ((packed >> np.uint32(32 - end)) & (2**bits - 1)) / (2**bits - 1)
        for bits, end in zip(widths, ends, strict=True)
    ]


def _between(chunks: dict[str, Array], axes: tuple[str, str, str], rows: Ints, shares: Sequence[Floats]) -> Floats:
    """Interpolate between the bounds of chunks by shares, (n, 3)."""
    low, high = (stack(chunks, [f"{end}_{axis}" for axis in axes])[rows] for end in ("min", "max"))
    share = np.stack(shares, axis=1)
    return low * (1.0 - share) + high * share


def _decode_harmonics(values: Ints) -> Array:
    """Return harmonics of bytes: the centers of 256 equal steps, and both ends exactly."""
    values = values.astype(_SINGLE)
    share = np.where(values == 0.0, 0.0, np.where(values == 255.0, 1.0, (values + 0.5) / 256.0))
    return (_HARMONICS * (share - 0.5)).astype(_SINGLE)
