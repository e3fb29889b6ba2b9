"""Readers and writers of files, by the suffixes of their names."""

import os
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..arguments import as_path
from ..errors import InvalidPointsError, NotEnoughMemoryError, PointCloudError
from ..memory import available_memory
from ..types import FilePath, Floats
from .arrays import read_array
from .e57 import read_e57
from .las import read_las
from .las_choices import LasChoices
from .las_form import FULL
from .las_writing import write_las
from .lines import brief
from .origin import look_like_degrees
from .pcd import read_pcd
from .ply import read_ply, write_vertex_pieces
from .ptx import read_ptx
from .ranges import Columns
from .table import PointTable, check_places, to_columns, without_missed
from .text import read_columns, read_scan, read_vertices, write_columns
from .whole import replacing

_DEGREE = 1e5  # metres
# Memory of what is read, at the peak, by the size of the file: of a million points in double precision 2.0 times, in
# single precision 4.2, of text 2.3 to 3.5; of compressed LAZ files 7 times or more.
_TIMES = 3.0
_IN_MEMORY = {".laz": 7.0}

# Errors of the modules that readers use at broken files; RuntimeError of archives with a password.
_FAULTS = (ValueError, OverflowError, EOFError, RuntimeError, struct.error, zlib.error, zipfile.BadZipFile)

_READERS = {
    ".ply": read_ply,
    ".obj": read_vertices,
    ".pcd": read_pcd,
    ".xyz": read_columns,
    ".pts": read_scan,
    ".ptx": read_ptx,
    ".csv": read_columns,
    ".txt": read_columns,
    ".asc": read_columns,
    ".grd": read_columns,
    ".npy": read_array,
    ".npz": read_array,
    ".las": read_las,
    ".laz": read_las,
    ".e57": read_e57,
}
SCANS = (".las", ".laz")
READABLE = tuple(_READERS)
TEXTS = tuple(suffix for suffix, read in _READERS.items() if read in (read_columns, read_scan))  # rows of columns
WRITABLE = (".ply", ".xyz", ".csv", *SCANS)
SPLATS = (".splat", ".spz")  # of Gaussian splats alone, which core.splats reads
_PACKED = (".ksplat", ".sog", ".lcc")  # of such, which other programs convert


def refuse_packed(path: FilePath) -> None:
    """Refuse files of splats that other programs convert, by their names."""
    path = as_path(path)
    if path.suffix.lower() in _PACKED:
        raise PointCloudError(
            f"{path} holds Gaussian splats in a form that is not read. Convert it to .ply by SuperSplat, or by"
            f" PlayCanvas's splat-transform ({brief(f'splat-transform {path.name} {path.stem}.ply')})."
        )


def read_points(path: FilePath, columns: str = "", las: LasChoices = LasChoices()) -> PointTable:
    """Read the points of a file of one of the kinds in `READABLE`.

    Parameters
    ----------
    path : path-like
    columns : str
        Names of the columns of a file of one of the kinds in `TEXTS`, in their order, such as "x y z - r g b", where -
        leaves one out, and ... at the end all that follow. Empty to find them.
    las : LasChoices
        Which points of a file of one of the kinds in `SCANS` are read.

    Returns
    -------
    PointTable

    Raises
    ------
    PointCloudError
        There is no such file, or no points in it, or it is broken; the text says where. Or columns are named that the
        file does not have.
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    _check_there(path)
    if suffix in SPLATS:
        raise PointCloudError(f"{path} is a file of Gaussian splats. Read it as such, by read_splats.")
    refuse_packed(path)
    if suffix not in _READERS:
        known = ", ".join((*READABLE, *SPLATS))
        raise PointCloudError(f"{path} is not a file with points. Give one of {known}.")
    check_columns(path, columns)
    with reading(path):
        check_size(path)
        given = {"columns": columns} if columns.strip() else {"las": las} if suffix in SCANS else {}
        table = without_missed(_READERS[suffix](path, **given), path)
    check_places(table.points, path)
    table.notices += doubts(table, path)
    return table


def check_size(path: Path) -> None:
    """Raise `NotEnoughMemoryError` for a file that does not fit the free memory: the system would end the program."""
    free, needed = available_memory(), _IN_MEMORY.get(path.suffix.lower(), _TIMES) * path.stat().st_size
    if free is not None and needed > free:
        raise NotEnoughMemoryError(
            f"{path} takes about {needed / 2**30:.1f} GB to read, and {free / 2**30:.1f} GB of memory are free. Divide"
            " it, or free memory."
        )


def check_columns(path: Path, columns: str) -> None:
    """Refuse names of columns for a file that is not of one of the kinds in `TEXTS`."""
    if columns.strip() and path.suffix.lower() not in TEXTS:
        raise PointCloudError(f"{path} names its columns itself. Give columns only with {', '.join(TEXTS)}.")


def doubts(table: PointTable, path: FilePath) -> Iterator[str]:
    """Yield notices about units and precision of the coordinates of a table."""
    path = as_path(path)
    units = np.ones(3)
    if table.degrees or look_like_degrees(table.points):
        known = "are" if table.degrees else "look like"
        yield (
            f"{path.name}: x and y {known} degrees of longitude and latitude, in which lengths, areas and curvatures"
            " are meaningless. Project the points to meters first."
        )
        units[:2] = _DEGREE
    if table.single:
        yield from precision_notices(table.points, path, units)


def precision_notices(points: Floats, path: FilePath, units: Floats | float = 1.0) -> Iterator[str]:
    """Report that points, (n, 3), were kept in single precision, where its steps, in some units, are too coarse."""
    steps = units * np.spacing(np.abs(points).max(axis=0).astype(np.float32))
    if steps.max() * 8192.0 > np.ptp(points, axis=0).max():
        step = np.spacing(np.float32(np.abs(points).max()))
        yield (
            f"{as_path(path).name}: its coordinates are kept in single precision, in steps of {step:.2g}. Export it in"
            " double precision, or with a shift."
        )


@contextmanager
def reading(path: FilePath) -> Iterator[None]:
    """Convert errors while a file is read into typed ones that state its name and what to do.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    PointCloudError
        There is no such file, or it is broken.
    """
    path = as_path(path)
    _check_there(path)
    try:
        with np.errstate(invalid="ignore", over="ignore"):  # in numbers that are refused, or kept as infinite
            yield
    except PointCloudError:
        raise
    except OSError as error:
        raise PointCloudError(f"{path} cannot be read: {error.strerror or error}. Check the file.") from error
    except MemoryError as error:
        raise NotEnoughMemoryError(
            f"{path} needs more memory than is free. Divide the file, or free memory."
        ) from error
    except _FAULTS as error:
        raise InvalidPointsError(
            f"{path} is broken: {brief(str(error).strip('.'))}. Copy or export it again."
        ) from error


def _check_there(path: Path) -> None:
    if not os.path.isfile(path):  # that of pathlib fails at folders without permission
        raise PointCloudError(f"There is no file {path}. Check its name and folder.")


def write_points(path: FilePath, table: PointTable, double: bool = True) -> list[str]:
    """Write a table to a file of one of the kinds in `WRITABLE`; an older file stays if that fails.

    Parameters
    ----------
    path : path-like
    table : PointTable
    double : bool
        Whether coordinates are kept in double precision, as always in LAS and LAZ.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.
    """
    return _write(path, lambda: [table], double)


def write_pieces(path: FilePath, tables: Callable[[], Iterable[PointTable]]) -> list[str]:
    """Write tables one after the other to a file of one of the kinds in `WRITABLE`.

    Memory is that of one of them. An older file stays if it fails.

    Parameters
    ----------
    path : path-like
    tables : callable
        Returns an iterable of tables with the same attributes, the same each time: they are looked at twice, once for
        their number, ranges and types.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import meshfree_laplacian as mf
    >>> from meshfree_laplacian.files import PointTable, read_points, write_pieces
    >>> points = mf.example_sphere()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "sphere.ply")
    ...     write_pieces(path, lambda: [PointTable(points[:500]), PointTable(points[500:])])
    ...     print(len(read_points(path).points))
    []
    800
    """
    return _write(path, tables)


def _write(path: FilePath, tables: Callable[[], Iterable[PointTable]], double: bool = True) -> list[str]:
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITABLE:
        raise PointCloudError(f"Points cannot be written to {path}. Give it one of {', '.join(WRITABLE)}.")
    form = next(iter(tables())).las if suffix in SCANS else None
    full = FULL if suffix in SCANS else 255.0

    def pieces() -> Iterator[Columns]:
        return (to_columns(table, double or suffix in SCANS, full if form is None else form.full) for table in tables())

    with replacing(path) as temporary:
        if suffix in SCANS:
            return write_las(temporary, pieces, path.name, form)
        if suffix == ".ply":
            return write_vertex_pieces(temporary, pieces)
        write_columns(temporary, pieces, "," if suffix == ".csv" else " ")
        return []
