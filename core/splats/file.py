"""Files of Gaussian splats: PLY with the properties that trainers write."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InvalidPointsError, PointCloudError
from ..files import (
    PlyVertices,
    check_places,
    read_vertex_columns,
    read_vertex_names,
    reading,
    replacing,
    write_vertex_columns,
)
from .harmonics import COUNTS
from .splats import Splats

PLACES = ("x", "y", "z")
COLORS = tuple(f"f_dc_{channel}" for channel in range(3))
OPACITY = "opacity"
SCALES = tuple(f"scale_{axis}" for axis in range(3))
ROTATIONS = tuple(f"rot_{number}" for number in range(4))
NEEDED = (*PLACES, *COLORS, OPACITY, *SCALES, *ROTATIONS)
_REST = "f_rest_"  # the harmonics, channel by channel
_PACKED = "packed_position"


class SplatFile(NamedTuple):
    """What a file of splats held, from which what was not changed is written again.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        By the names of the properties, in their order and types: scales as logarithms, opacities as logits.
    order : str
        Of the bytes, "<" or ">".
    comments : list of str
        Lines of the header.
    """

    columns: dict
    order: str = "<"
    comments: tuple = ()


def holds_splats(path) -> bool:
    """Tell whether a file is one of splats, by its header; files that are broken are none."""
    if Path(path).suffix.lower() != ".ply":
        return False
    try:
        with reading(Path(path)):
            return set(NEEDED) <= set(read_vertex_names(path))
    except PointCloudError:
        return False


def read_splats(path) -> Splats:
    """Read Gaussian splats from a PLY file, such as trainers write.

    Parameters
    ----------
    path : path-like
        Of a file with the properties x y z, f_dc_0 to f_dc_2, opacity, scale_0 to scale_2 and rot_0 to rot_3, and
        f_rest_0 on for splats whose colour depends on the direction of view.

    Returns
    -------
    Splats

    Raises
    ------
    PointCloudError
        There is no such file.
    InvalidPointsError
        It is broken, or holds no splats; the text says what is missing.
    """
    path = _path(path)
    with reading(path):
        vertices = read_vertex_columns(path)
    missing = [name for name in NEEDED if name not in vertices.columns]
    if missing:
        packed = " It is a packed one; save it again as a plain PLY." if _PACKED in vertices.columns else ""
        raise InvalidPointsError(
            f"{path} holds no Gaussian splats: it has no {', '.join(missing)} among its properties.{packed} Give a PLY"
            " file of splats."
        )
    return from_vertices(vertices, path)


def from_vertices(vertices: PlyVertices, path) -> Splats:
    """Make splats of the vertices of a file that has all properties they need."""
    columns = vertices.columns
    positions = _stack(columns, PLACES)
    check_places(positions, path)
    rest, notices = _harmonic_columns(columns, path)
    return Splats(
        positions=positions,
        scales=decode_scales(_stack(columns, SCALES)),
        rotations=decode_rotations(_stack(columns, ROTATIONS)),
        opacities=decode_opacities(columns[OPACITY].astype(np.float64)),
        colors=_stack(columns, COLORS),
        harmonics=_stack(columns, rest, np.float32).reshape(len(positions), 3, -1).swapaxes(1, 2),
        notices=[*vertices.notices, *notices],
        file=SplatFile(columns, vertices.order or "<", tuple(vertices.comments)),
    )


def write_splats(path, splats):
    """Write Gaussian splats to a PLY file, in the layout of the file that they came from.

    What was read and not changed is written bit for bit as it was.

    Parameters
    ----------
    path : path-like
        Its name ends in .ply; an older file stays if writing fails.
    splats : Splats

    Raises
    ------
    PointCloudError
        The name ends otherwise, or there is no splat.
    """
    path = _path(path)
    if not isinstance(splats, Splats):
        raise PointCloudError(
            f"What is to be written to {path} is {type(splats).__name__}, not Splats. Make Splats first."
        )
    if path.suffix.lower() != ".ply":
        raise PointCloudError(f"Splats cannot be written to {path}. Give it a name that ends in .ply.")
    if not len(splats):
        raise PointCloudError(f"There are no splats to write to {path}. Give at least one.")
    file = splats.file
    if file is None or len(file.columns[OPACITY]) != len(splats):
        file = SplatFile({})
    columns = dict(file.columns)
    for name, values in _encoded(splats, columns).items():
        kind = columns[name].dtype if name in columns else np.float32
        columns[name] = values.astype(kind)
    with replacing(path) as part:
        write_vertex_columns(part, columns, file.order, file.comments)


def _path(given):
    try:
        return Path(given)
    except TypeError as error:
        raise PointCloudError(f"{given!r} is no name of a file. Give a text or a path.") from error


def _encoded(splats, columns):
    """Return the columns of a file with these splats; numbers that did not change are those of the columns before."""
    result = dict(zip(PLACES, splats.positions.T, strict=True)) | dict(zip(COLORS, splats.colors.T, strict=True))
    rest = splats.harmonics.swapaxes(1, 2).reshape(len(splats), -1)
    per_channel = sum(name.startswith(_REST) for name in columns) // 3 or splats.harmonics.shape[1]
    result.update(zip(_rest_names(per_channel, splats.harmonics.shape[1]), rest.T, strict=True))
    for names, values, decode, encode in (
        ((OPACITY,), splats.opacities[:, None], decode_opacities, _encode_opacities),
        (SCALES, splats.scales, decode_scales, _encode_scales),
        (ROTATIONS, splats.rotations, decode_rotations, lambda rotations: rotations),
    ):
        values = values.astype(np.float32)
        coded = encode(values.astype(np.float64))
        if names[0] in columns:
            before = _stack(columns, names)
            same = (decode(before).astype(np.float32) == values).all(axis=1, keepdims=True)
            coded = np.where(same, before, coded)
        result.update(zip(names, coded.T, strict=True))
    return result


def decode_scales(logarithms):
    """Return half axes of their logarithms; zero for what is no number."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(np.exp(logarithms), nan=0.0, posinf=_LARGEST)


def _encode_scales(scales):
    return np.log(np.maximum(scales, _SMALLEST))


def decode_opacities(logits):
    """Return opacities from 0 to 1 of their logits; zero for what is no number."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(1.0 / (1.0 + np.exp(-logits)), nan=0.0)


def _encode_opacities(opacities):
    inside = np.clip(opacities, _SMALLEST, 1.0 - _NEAR)
    return np.log(inside) - np.log1p(-inside)


def decode_rotations(quaternions):
    """Return unit quaternions; no turn for those without a length."""
    length = np.sqrt(np.einsum("nk,nk->n", quaternions, quaternions))[:, None]
    sound = np.isfinite(length) & (length > 0.0)
    return np.where(sound, quaternions / np.where(sound, length, 1.0), [1.0, 0.0, 0.0, 0.0])


def _harmonic_columns(columns, path):
    """Return the names of the harmonics that can be used, channel by channel, and what to tell about the others."""
    count = sum(name.startswith(_REST) for name in columns)
    whole = (
        count % 3 == 0 and count // 3 <= COUNTS[-1] and all(f"{_REST}{number}" in columns for number in range(count))
    )
    per_channel = count // 3
    used = max(known for known in COUNTS if known <= per_channel) if whole else 0
    notices = []
    if used != per_channel or not whole:
        notices.append(
            f"{path.name}: {count} numbers f_rest are not those of whole degrees up to 4, and {3 * used} of them are"
            " used. Colors may not turn with the surface."
        )
    return _rest_names(per_channel, used), notices


def _rest_names(per_channel, used):
    """Return the names of the first harmonics of each channel, of which a file has so many."""
    return [f"{_REST}{channel * per_channel + number}" for channel in range(3) for number in range(used)]


def _stack(columns, names, dtype=np.float64):
    count = len(columns[OPACITY])
    result = np.empty((count, len(names)), dtype)
    for index, name in enumerate(names):
        result[:, index] = columns[name]
    return result


_SMALLEST = float(np.finfo(np.float32).tiny)
_LARGEST = float(np.finfo(np.float32).max)
_NEAR = 2.0**-25  # half a step of single precision below one
