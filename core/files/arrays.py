"""Arrays of numpy, alone (.npy) or several in an archive (.npz), read and written without pickles."""

import re
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, FilePath
from .lines import brief
from .rows import unpacks_too_far
from .table import PointTable
from .whole import replacing

_MAGIC = b"\x93NUMPY"
_LONGEST = 10_000  # bytes of a header, as numpy's own
_FIELDS = {"descr": "'[^']*'", "fortran_order": "True|False", "shape": r"\([^()]*\)"}  # of a header
_NUMBERS = r"'[<>=|]?([iu][1248]|f(2|4|8|12|16))'"
_ROWS = r"\((\d{1,15})L?,\s*3L?,?\s*\)"  # Python 2 wrote 200L


def read_array(path: Path) -> PointTable:
    """Read an array (n, 3), or the one named points among several, whatever the file is called.

    Without one `InvalidPointsError` is raised.
    """
    return next((table for table, _ in array_pieces(path)), PointTable(np.empty((0, 3))))


def array_pieces(
    path: Path, size: int | None = None, notices: list[str] | None = None
) -> Iterator[tuple[PointTable, dict[str, Array]]]:
    """Yield the points of such a file, so many at once, with no further columns; errors as of `read_array`."""
    with ExitStack() as stack:
        file = stack.enter_context(open(path, "rb"))
        packed = file.read(2) == b"PK"
        if packed:
            archive = stack.enter_context(zipfile.ZipFile(file))
            entry = _entry(archive, path, file.seek(0, 2))
            there = entry.file_size
        else:
            there = file.seek(0, 2)

        def opened() -> IO[bytes]:
            return stack.enter_context(archive.open(entry.filename) if packed else open(path, "rb"))

        dtype, columnwise, count, begin = _read_header(opened(), path, there)
        step = count if size is None else size
        # An array that is stored column by column is read at three places.
        streams = [opened() for _ in range(3 if columnwise else 1)]
        for axis, stream in enumerate(streams):
            stream.seek(begin + axis * count * dtype.itemsize)
        width = 3 // len(streams)
        for done in range(0, count, step):
            rows = min(step, count - done)
            parts = [np.frombuffer(stream.read(rows * width * dtype.itemsize), dtype) for stream in streams]
            values = np.concatenate([part.reshape(rows, width) for part in parts], axis=1, dtype=np.float64)
            yield PointTable(values, single=dtype == np.float32), {}


def write_arrays(path: FilePath, arrays: Mapping[str, Array]) -> None:
    """Write arrays by name to an archive. An older one stays if that fails.

    Parameters
    ----------
    path : path-like
    arrays : mapping of str to ndarray

    Raises
    ------
    PointCloudError
        The file cannot be written.
    """
    with replacing(path) as part, zipfile.ZipFile(part, "w") as archive:
        for name, values in arrays.items():  # as numpy.savez, which leaves the archive open where the disk is full
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(values), allow_pickle=False)  # type: ignore[no-untyped-call]


def _entry(archive: zipfile.ZipFile, path: Path, size: int) -> zipfile.ZipInfo:
    """Return the entry of the points in an archive of so many bytes."""
    name = next((name for name in ("points.npy", "points") if name in archive.namelist()), None)
    if name is None:
        raise InvalidPointsError(
            f"{path} holds no array of points: points is not among its arrays. Save it again with that name."
        )
    entry = archive.getinfo(name)
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InvalidPointsError(
            f"{path} uses a compression that numpy does not support. Save it again with numpy.savez."
        )
    if unpacks_too_far(entry.file_size, size):
        raise InvalidPointsError(
            f"{path} would unpack to {entry.file_size / 1e6:,.0f} MB from {size / 1e6:,.1f} MB, which points never do."
            " Save it again with numpy.savez, without compression."
        )
    return entry


def _read_header(file: IO[bytes], path: Path, size: int) -> tuple[np.dtype[Any], bool, int, int]:
    """Return type, whether it is stored column by column, rows, and where they begin, of an array of so many bytes.

    The header is not parsed by numpy, which evaluates it as Python.
    """
    start = file.read(8)
    length = int.from_bytes(file.read(2 if start[6:7] == b"\x01" else 4), "little")
    header = file.read(length).decode("latin-1") if length <= _LONGEST else ""
    found = [
        match
        for match in (
            re.search(rf"'{name}'\s*:\s*({value})", header.replace('"', "'")) for name, value in _FIELDS.items()
        )
        if match
    ]
    if start.startswith(_MAGIC) and re.search(r"['\"]descr['\"]\s*:\s*\[", header):
        raise InvalidPointsError(
            f"{path} holds records of named numbers, not an array (n, 3). Save x, y and z as one, or all as columns of"
            " text (.csv) or .ply."
        )
    if not start.startswith(_MAGIC) or len(found) < len(_FIELDS):
        raise InvalidPointsError(f"{path} holds no array of points. Save it again with numpy.")
    kind, columnwise, shape = (match[1] for match in found)
    rows = re.fullmatch(_ROWS, shape)
    if not rows or not re.fullmatch(_NUMBERS, kind):
        raise InvalidPointsError(
            f"{path} holds values of the type {brief(kind)} and the shape {brief(shape)}. Points are numbers (n, 3)."
        )
    dtype, count = np.dtype(kind[1:-1]), int(rows[1])
    there = size - file.tell()
    if there < 3 * count * dtype.itemsize:
        raise InvalidPointsError(
            f"{path} holds no array of points: it ends after {there // (3 * dtype.itemsize)} of {count} points."
            " Copy or save it again."
        )
    return dtype, columnwise == "True", count, file.tell()
