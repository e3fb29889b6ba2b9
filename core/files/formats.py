"""Which file is read and written how, by the ending of its name."""

import zipfile

import numpy as np

from ..errors import InvalidPointsError, PointCloudError
from .ply import read_ply, write_ply
from .table import PointTable, check_table
from .text import read_columns, read_scan, read_vertices, write_columns
from .whole import replacing

_LASER = (".las", ".laz")


def _read_array(path) -> PointTable:
    """Read an array (n, 3) of numpy, or the one named points among several."""
    try:
        loaded = np.load(path, allow_pickle=False)
        if not isinstance(loaded, np.ndarray):  # several, whatever the file is called
            with loaded:
                loaded = loaded["points"]
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise InvalidPointsError(
            f"{path} holds no array of points: {str(error).strip(chr(39))}. Save it again."
        ) from None
    if loaded.ndim != 2 or loaded.shape[1] != 3 or loaded.dtype.kind not in "iuf":
        raise InvalidPointsError(f"{path} holds {loaded.dtype} of the shape {loaded.shape}. Points are numbers (n, 3).")
    return PointTable(loaded.astype(np.float64), single=loaded.dtype == np.float32)


_READERS = {
    ".ply": read_ply,
    ".obj": read_vertices,
    ".xyz": read_columns,
    ".pts": read_scan,
    ".csv": read_columns,
    ".txt": read_columns,
    ".npy": _read_array,
    ".npz": _read_array,
}
READABLE = tuple(_READERS)
WRITABLE = (".ply", ".xyz", ".csv")


def read_points(path) -> PointTable:
    """Read the points of a file of one of the kinds in `READABLE`.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    PointTable

    Raises
    ------
    PointCloudError
        There is no such file, or no points in it, or it is broken; the text says where.
    """
    suffix = path.suffix.lower()
    if suffix in _LASER:
        raise PointCloudError(
            f"{path} is a LAS file, which cannot be read inside Blender. Convert it to PLY with coordinates in"
            f" double precision first, for instance with this extension's source: make convert LAS={path.name}"
        )
    if suffix not in _READERS:
        raise PointCloudError(f"{path} is not a file with points. Give one of {', '.join(READABLE)}.")
    if not path.is_file():
        raise PointCloudError(f"There is no file {path}. Check its name and folder.")
    try:
        table = check_table(_READERS[suffix](path), path)
    except OSError as error:
        raise PointCloudError(f"{path} cannot be read: {error.strerror or error}. Check the file.") from error
    step = float(np.spacing(np.float32(np.abs(table.points).max())))
    if table.single and step * 8192.0 > np.ptp(table.points, axis=0).max():
        table.notices.append(
            f"{path.name}: its coordinates are kept in single precision, in steps of {step:.2g}. Export it in"
            " double precision, or with a shift."
        )
    return table


def write_points(path, table, double=True):
    """Write a table to a file of one of the kinds in `WRITABLE`; an older file stays if that fails.

    Parameters
    ----------
    path : pathlib.Path
    table : PointTable
    double : bool
        Whether coordinates are kept in double precision.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITABLE:
        raise PointCloudError(f"Points cannot be written to {path}. Give it one of {', '.join(WRITABLE)}.")
    with replacing(path) as part:
        if suffix == ".ply":
            write_ply(part, table, double)
        else:
            write_columns(part, table, "," if suffix == ".csv" else " ", double)
