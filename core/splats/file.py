"""Files of Gaussian splats: PLY by trainers, and other layouts."""

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..arguments import as_path
from ..errors import InvalidPointsError, PointCloudError
from ..files import (
    FARTHEST,
    SPLATS,
    PlyVertices,
    PointTable,
    check_places,
    is_coarse,
    precision_notices,
    read_points,
    read_vertex_columns,
    read_vertex_names,
    reading,
    refuse_packed,
    replacing,
    write_vertex_columns,
)
from ..types import Array, FilePath, Floats
from . import packed
from .antimatter import read_antimatter
from .columns import (
    COLORS,
    NEEDED,
    OPACITY,
    PLACES,
    REST,
    ROTATIONS,
    SCALES,
    SplatFile,
    decode_opacities,
    decode_rotations,
    decode_scales,
    encode_opacities,
    encode_rotations,
    encode_scales,
    rest_names,
    stack,
)
from .harmonics import COUNTS
from .layouts import ANCHORS, are_anchors, completed, hold_enough, near_miss, remarks
from .splats import Splats
from .spz import is_spz, read_spz

_LOST = 1e-6  # of the extent: rounding of positions that matters


def holds_splats(path: FilePath) -> bool:
    """Whether a file is one of splats, by its first bytes or name; broken PLY files are not."""
    path = as_path(path)
    try:
        with reading(path):
            return _reader(path) is not None
    except PointCloudError:
        return False


def read_file(path: FilePath, read: Callable[[Path], PointTable] = read_points) -> PointTable | Splats:
    """Read the splats of a file, or its points if it has no splats.

    Parameters
    ----------
    path : path-like
    read : callable
        Reader of points.

    Returns
    -------
    Splats or PointTable
        With a notice, where properties of splats are incomplete.

    Raises
    ------
    PointCloudError
        There is no such file, or it is broken, or of an unknown kind.
    """
    path = as_path(path)
    if holds_splats(path):
        return read_splats(path)
    table = read(path)
    missing = near_miss((*PLACES, *table.attributes))
    if missing:
        table.notices.append(f"{path.name} {missing}")
    return table


def read_splats(path: FilePath) -> Splats:
    """Read Gaussian splats from a file of one of these kinds, whatever its name.

    Parameters
    ----------
    path : path-like
        PLY with the properties x y z, f_dc_0 to f_dc_2, opacity, scale_0 to scale_2 and rot_0 to rot_3, and f_rest_0 on
        for splats of view-dependent colour; also with red green blue instead of f_dc, or one or two scales. PLY packed
        by SuperSplat, .spz up to version 3, and .splat.

    Returns
    -------
    Splats
        Notices state guesses, and how many splats were left out since their numbers are not finite.

    Raises
    ------
    PointCloudError
        There is no such file.
    InvalidPointsError
        It is broken, or holds no splats; the text says what is missing.
    """
    path = as_path(path)
    with reading(path):
        return _from_vertices((_reader(path) or _refuse)(path), path)


def _reader(path: Path) -> Callable[[Path], PlyVertices] | None:
    """Return the reader of a file as columns of trainers; None if it holds no splats."""
    suffix = path.suffix.lower()
    with open(path, "rb") as file:
        is_ply = file.read(3) == b"ply"
    if is_ply:
        names = read_vertex_names(path)
        if packed.MARK in names:
            return packed.read_packed
        return _read_ply if hold_enough(names) else None
    if is_spz(path) or suffix == ".spz":
        return read_spz
    return read_antimatter if suffix == ".splat" else None


def _refuse(path: Path) -> NoReturn:
    """Report the missing properties of a file, or what converts it."""
    refuse_packed(path)
    names = read_vertex_names(path)
    missing = f"no {', '.join(name for name in NEEDED if name not in names)} among its properties"
    raise InvalidPointsError(
        f"{path} holds no Gaussian splats: it has {ANCHORS if are_anchors(names) else missing}. Give a file of splats:"
        f" PLY, {', '.join(SPLATS)}."
    )


def from_columns(columns: dict[str, Array], name: str) -> Splats:
    """Return the splats of columns for which `hold_enough` holds, as of a PLY file that another program has read.

    Parameters
    ----------
    columns : dict of str to ndarray, (n,)
        By the names of the properties.
    name : str
        Of their object, for notices and errors.

    Raises
    ------
    InvalidPointsError
        No splat has finite numbers.
    """
    path = Path(name)
    return _from_vertices(_completed(PlyVertices(columns, None, [], []), path), path)


def _read_ply(path: Path) -> PlyVertices:
    """Read a PLY file as columns of trainers."""
    return _completed(read_vertex_columns(path), path)


def _completed(vertices: PlyVertices, path: Path) -> PlyVertices:
    """Add the columns that are missing of those of trainers, with notices."""
    columns, guesses = completed(vertices.columns)
    notices = [f"{path.name}: {'; '.join(guesses)}. write_splats writes the common layout."] if guesses else []
    notices += [f"{path.name}: {text}" for text in remarks(list(vertices.columns))]
    return vertices._replace(columns=columns, notices=[*vertices.notices, *notices])


def _from_vertices(vertices: PlyVertices, path: Path) -> Splats:
    """Return the finite splats of the vertices of a file with all necessary properties."""
    columns, left_out = _without_broken(vertices.columns, path)
    positions = stack(columns, PLACES)
    check_places(positions, path)
    rest, odd = _harmonic_columns(columns, path)
    single = [columns[axis].dtype == np.float32 for axis in PLACES]
    wide = precision_notices(positions[:, single], path) if any(single) else ()
    return Splats(
        positions=positions,
        scales=decode_scales(stack(columns, SCALES)),
        rotations=decode_rotations(stack(columns, ROTATIONS)),
        opacities=decode_opacities(columns[OPACITY].astype(np.float64)),
        colors=stack(columns, COLORS),
        harmonics=stack(columns, rest, np.float32).reshape(len(positions), 3, -1).swapaxes(1, 2),
        notices=[*vertices.notices, *left_out, *wide, *odd],
        file=SplatFile(columns, vertices.order or "<", tuple(vertices.comments)),
    )


def _without_broken(columns: dict[str, Array], path: Path) -> tuple[dict[str, Array], list[str]]:
    """Leave out splats with numbers that are not finite, or too far away, as training leaves them; report how many.

    Logarithms of sizes may be minus infinity, of sizes zero, and logits of opacities infinite, of 0 and 1.
    """
    sound = np.ones(len(columns[OPACITY]), bool)
    for name, values in columns.items():
        if values.dtype.kind == "f" and (name in NEEDED or name.startswith(REST)):
            limits = {**dict.fromkeys(SCALES, values < np.inf), OPACITY: ~np.isnan(values)}
            limits |= dict.fromkeys(PLACES, np.abs(values) <= FARTHEST)
            sound &= limits[name] if name in limits else np.isfinite(values)
    broken = np.count_nonzero(~sound)
    if not broken:
        return columns, []
    if broken == len(sound):
        raise InvalidPointsError(
            f"{path}: all {broken} splats have numbers that are not finite (NaN or infinity). Train or export it again."
        )
    far = f", or positions beyond {FARTHEST:g}" if any(_any_far(columns[name]) for name in PLACES) else ""
    notice = f"{path.name}: left out {broken:,} splats with numbers that are not finite (NaN or infinity){far}."
    return {name: values[sound] for name, values in columns.items()}, [notice]


def _any_far(values: Array) -> bool:
    return bool((np.isfinite(values) & (np.abs(values) > FARTHEST)).any())


def write_splats(path: FilePath, splats: Splats) -> None:
    """Write Gaussian splats to a PLY file, in the layout of the file that they came from.

    Unchanged data of a file are written bit for bit as they were.

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
    path = as_path(path)
    if not isinstance(splats, Splats):
        raise PointCloudError(
            f"The data to be written to {path} are {type(splats).__name__}, not Splats. Make Splats first."
        )
    if path.suffix.lower() != ".ply":
        raise PointCloudError(f"Splats cannot be written to {path}. Give it a name that ends in .ply.")
    if not len(splats):
        raise PointCloudError(f"There are no splats to write to {path}. Give at least one.")
    file = splats.file
    if file is None or len(file.columns[OPACITY]) != len(splats):
        file = SplatFile({})
    columns = dict(file.columns)
    double = _needs_double(splats.positions)
    for name, values in encoded(splats, columns).items():
        kind = columns[name].dtype if name in columns else np.float32
        columns[name] = values.astype(np.float64 if double and name in PLACES else kind)
    with replacing(path) as temporary:
        write_vertex_columns(temporary, columns, file.order, file.comments)


def _needs_double(positions: Floats) -> bool:
    """Whether single precision would lose digits of positions that were not read in it."""
    lost = np.abs(positions.astype(np.float32) - positions).max()
    return is_coarse(positions) and lost > _LOST * np.ptp(positions, axis=0).max()


def encoded(splats: Splats, columns: dict[str, Array]) -> dict[str, Floats]:
    """Return the columns of a file with these splats; numbers that did not change are those of the columns before."""
    result = dict(zip(PLACES, splats.positions.T, strict=True)) | dict(zip(COLORS, splats.colors.T, strict=True))
    rest = splats.harmonics.swapaxes(1, 2).reshape(len(splats), -1)
    used = splats.harmonics.shape[1]
    per_channel = max(sum(name.startswith(REST) for name in columns) // 3, used)
    result.update(zip(rest_names(per_channel, used), rest.T, strict=True))
    for names, values, decode, encode in (
        ((OPACITY,), splats.opacities[:, None], decode_opacities, encode_opacities),
        (SCALES, splats.scales, decode_scales, encode_scales),
        (ROTATIONS, splats.rotations, decode_rotations, encode_rotations),
    ):
        values = values.astype(np.float32)
        coded = encode(values.astype(np.float64))
        if names[0] in columns:
            before = stack(columns, names)
            same = (decode(before).astype(np.float32) == values).all(axis=1, keepdims=True)
            coded = np.where(same, before, coded)
        result.update(zip(names, coded.T, strict=True))
    return result


def _harmonic_columns(columns: dict[str, Array], path: Path) -> tuple[list[str], list[str]]:
    """Return the names of the usable harmonics, channel by channel, and notices about the others."""
    count = sum(name.startswith(REST) for name in columns)
    whole = count % 3 == 0 and count // 3 <= COUNTS[-1] and all(f"{REST}{number}" in columns for number in range(count))
    per_channel = count // 3
    used = max(known for known in COUNTS if known <= per_channel) if whole else 0
    notices = []
    if used != per_channel or not whole:
        notices.append(
            f"{path.name}: {count} numbers f_rest are not those of whole degrees up to 4, and {3 * used} of them are"
            " used. View-dependent colors may not be rotated with the surface."
        )
    return rest_names(per_channel, used), notices
