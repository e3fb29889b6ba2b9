"""Arrays of numpy, alone (.npy) or several in an archive (.npz), read without running any code of the file."""

import re
import zipfile
from pathlib import Path
from typing import IO

import numpy as np

from ..errors import InvalidPointsError
from .lines import brief
from .rows import unpacks_too_far
from .table import PointTable

_MAGIC = b"\x93NUMPY"
_LONGEST = 10_000  # bytes of a header, as numpy's own
_FIELDS = {"descr": "'[^']*'", "fortran_order": "True|False", "shape": r"\([^()]*\)"}  # of a header
_NUMBERS = r"'[<>=|]?([iu][1248]|f(2|4|8|12|16))'"
_ROWS = r"\((\d{1,15})L?,\s*3L?,?\s*\)"  # Python 2 wrote 200L


def read_array(path: Path) -> PointTable:
    """Read an array (n, 3), or the one named points among several, whatever the file is called.

    Raises
    ------
    InvalidPointsError
        There is none.
    """
    with open(path, "rb") as file:
        packed = file.read(2) == b"PK"
        size = file.seek(0, 2)
        file.seek(0)
        if not packed:
            return _read_rows(file, path, size)
        with zipfile.ZipFile(file) as archive:
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
            unpacked = entry.file_size
            if unpacks_too_far(unpacked, size):
                raise InvalidPointsError(
                    f"{path} would unpack to {unpacked / 1e6:,.0f} MB from {size / 1e6:,.1f} MB, which points never do."
                    " Save it again with numpy.savez, without compression."
                )
            with archive.open(name) as member:
                return _read_rows(member, path, unpacked)


def _read_rows(file: IO[bytes], path: Path, size: int) -> PointTable:
    """Read an array (n, 3) of a file, or a member of an archive, of so many bytes, and allocate no more memory.

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
    values = np.frombuffer(file.read(3 * count * dtype.itemsize), dtype)
    values = values.reshape((count, 3), order="F" if columnwise == "True" else "C")
    return PointTable(values.astype(np.float64), single=dtype == np.float32)
