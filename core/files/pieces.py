"""Points of files piece by piece, for clouds larger than the memory."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_path
from ..errors import InvalidPointsError
from ..types import Array, FilePath, Floats
from .arrays import array_pieces
from .copc import Box
from .e57 import e57_scans
from .formats import SCANS, TEXTS, check_columns, doubts, read_points, reading
from .las import Tally, las_pieces, opened_las, settle_columns
from .las_choices import LasChoices
from .las_form import LasForm
from .ply import ply_pieces
from .ptx import ptx_pieces
from .table import CHANNELS, Missed, PointTable, check_places, full_color
from .text import column_pieces, scan_pieces, vertex_pieces

# None where a PLY file is read as a whole only, and where a text is a PTX file.
_PIECES: dict[str, Callable[..., Iterator[tuple[PointTable, dict[str, Array]]] | None]] = {
    **dict.fromkeys(TEXTS, column_pieces),
    ".pts": scan_pieces,
    ".ptx": ptx_pieces,
    ".obj": vertex_pieces,
    ".ply": ply_pieces,
    ".npy": array_pieces,
    ".npz": array_pieces,
}
_NOWHERE = np.full((2, 3), np.nan)


class Extent(NamedTuple):
    """What `extent` finds.

    Attributes
    ----------
    count : int
        Points.
    low, high : ndarray, (3,)
        The corners of their box; NaN without points.
    names : list of str
        Of the other numbers of a point, as `chunks` gives them.
    """

    count: int  # type: ignore[assignment]  # in place of the method of tuples
    low: Floats
    high: Floats
    names: list[str]


class Chunks:
    """The points of a file in pieces; made by `chunks`, and iterable once.

    Attributes
    ----------
    notices : list of str
        Which data were left out; complete at the end.
    single, degrees : bool
        As of `PointTable`; known at the end.
    las : LasForm or None
        As of `PointTable`; known with the first piece.
    """

    def __init__(
        self, path: Path, size: int, box: Box | None, level: int | None, las: LasChoices, columns: str
    ) -> None:
        self.notices: list[str] = []
        self.single = self.degrees = False
        self.las: LasForm | None = None
        self._path, self._size, self._box, self._level = path, size, box, level
        self._las, self._columns = las, columns
        self._pieces = self._guarded()

    def __iter__(self) -> Iterator[tuple[Floats, dict[str, Array]]]:
        return self._pieces

    def _guarded(self) -> Iterator[tuple[Floats, dict[str, Array]]]:
        """Yield pieces of points with coordinates; errors of a broken file become typed ones."""
        pieces, missed = self._read(), Missed()
        while True:
            with reading(self._path):  # not around the yield: the caller's errors are no faults of the file
                piece = next(pieces, None)
            if piece is None:
                break
            points, attributes = piece
            kept = missed.add(points)
            if self._box is not None:
                kept = kept & np.all((points >= self._box[0]) & (points <= self._box[1]), axis=1)
            if not kept.all():
                points, attributes = points[kept], {name: values[kept] for name, values in attributes.items()}
            for start in range(0, len(points), self._size):
                rows = slice(start, start + self._size)
                yield points[rows], {name: values[rows] for name, values in attributes.items()}
        self.notices += missed.notices(self._path)

    def _read(self) -> Iterator[tuple[Floats, dict[str, Array]]]:
        """Yield pieces as the format gives them."""
        suffix = self._path.suffix.lower()
        if suffix in SCANS:
            yield from self._read_las()
            return
        given = {"columns": self._columns} if self._columns else {}
        found = _PIECES[suffix](self._path, self._size, self.notices, **given) if suffix in _PIECES else None
        if found is None and suffix in TEXTS:
            found = ptx_pieces(self._path, self._size, self.notices)
        for table, channels in self._read_whole(suffix) if found is None else found:
            self.single, self.degrees = self.single or table.single, self.degrees or table.degrees
            yield table.points, {**channels, **table.attributes}

    def _read_las(self) -> Iterator[tuple[Floats, dict[str, Array]]]:
        with opened_las(self._path) as file:
            self.notices += file.notices()
            self.las = file.form(self._las)
            tally, near = Tally(self._las), True
            for points, attributes in las_pieces(file, tally, self._size, self._box, self._level):
                near = near and file.is_geographic(points)
                yield points, attributes
            self.degrees = near and tally.total > 0
            self.notices += [*tally.notices(self._path), *file.reference.notices(self._path, self._las.meters)]

    def _read_whole(self, suffix: str) -> Iterator[tuple[PointTable, dict[str, Array]]]:
        """Yield all points of a file, or of each scan of one."""
        tables = e57_scans(self._path, self.notices) if suffix == ".e57" else iter([read_points(self._path)])
        for table in tables:
            self.notices += table.notices
            colors = () if table.colors is None else table.colors.T
            yield table, dict(zip(CHANNELS, colors, strict=False))


def chunks(
    path: FilePath,
    size: int = 1_000_000,
    *,
    bounds: ArrayLike | None = None,
    level: int | None = None,
    las: LasChoices = LasChoices(),
    columns: str = "",
) -> Chunks:
    """Read the points of a file of one of the kinds in `READABLE` in pieces.

    Memory is that of a piece for LAS, LAZ, COPC, binary PLY files without lists, OBJ, arrays of numpy, and columns of
    text, which are read once more before, for what they hold. PCD and other PLY files are read as a whole, E57 and PTX
    files scan by scan, and cut in pieces then.

    Parameters
    ----------
    path : path-like
    size : int
        Points of a piece at most.
    bounds : array_like, (2, 3), optional
        Lowest and highest corner of a box; only points inside are yielded. LAS files whose headers state another place
        are skipped, and of COPC files only nodes that meet the box are read.
    level : int, optional
        The last level of detail of a COPC file that is read, from 0, which is the coarsest.
    las : LasChoices
        Which points of LAS files are read, and in which unit; bounds are in it, too.
    columns : str
        Names of the columns of text, as of `read_points`.

    Returns
    -------
    Chunks
        Yields points, (k, 3) float64, in the coordinates of the file, and a dict of their other numbers by the names
        of `PointTable.attributes`, (k,) or (k, 3). Colors are red, green, blue and alpha among these, in the numbers of
        the file, since what a full color is follows from all of them: `join_pieces` finds it. Points without valid
        coordinates are left out.

    Raises
    ------
    PointCloudError
        A level of a file without such; and, while it is iterated, as `read_points` does, but for files without
        points that are not read as a whole, which give no piece.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import meshfree_laplacian as mf
    >>> from meshfree_laplacian.files import PointTable, chunks, write_points
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "sphere.ply")
    ...     write_points(path, PointTable(mf.example_sphere()))
    ...     print([len(points) for points, attributes in chunks(path, 300)])
    []
    [300, 300, 200]
    """
    path = as_path(path)
    if size < 1:
        raise InvalidPointsError(f"Pieces of {size} points were asked for. Ask for at least 1.")
    box = None if bounds is None else np.asarray(bounds, dtype=np.float64)
    if box is not None and (box.shape != (2, 3) or not (box[0] <= box[1]).all()):
        raise InvalidPointsError("The bounds are no box. Give its lowest and its highest corner, x y z each.")
    if level is not None and level < 0:
        raise InvalidPointsError(f"The level is {level}. Levels begin with 0, the coarsest.")
    if level is not None and not has_levels(path):
        raise InvalidPointsError(f"{path} has no levels of detail, which only COPC files have. Read it without.")
    check_columns(path, columns)
    return Chunks(path, size, None if box is None else (box[0], box[1]), level, las, columns.strip())


def has_levels(path: FilePath) -> bool:
    """Whether a file is a COPC file, whose points are in levels of detail."""
    path = as_path(path)
    if path.suffix.lower() not in SCANS:
        return False
    with reading(path), opened_las(path) as file:
        return file.octree is not None


def extent(path: FilePath, las: LasChoices = LasChoices()) -> Extent:
    """Find how many points a file has, their box, and what other numbers they have.

    Of LAS and LAZ files these are what the header states, those that `las` leaves out included; other files are read,
    piece by piece.

    Parameters
    ----------
    path : path-like
    las : LasChoices
        Which points of LAS files would be read, and in which unit.
    """
    path = as_path(path)
    if path.suffix.lower() in SCANS:
        with reading(path), opened_las(path) as file:
            header, names = file.reader.header, file.names(las.withheld)
            low, high = np.array([header.mins, header.maxs] if header.point_count else _NOWHERE) * file.scale(las)
            return Extent(int(header.point_count), low, high, names)
    count, (low, high), found = 0, _NOWHERE, dict[str, None]()
    for points, attributes in chunks(path):
        count += len(points)
        low, high = np.fmin(low, points.min(axis=0)), np.fmax(high, points.max(axis=0))
        found.update(dict.fromkeys(attributes))
    return Extent(count, low, high, [*found])


def join_pieces(
    pieces: Sequence[tuple[Floats, dict[str, Array]]],
    path: FilePath,
    single: bool = False,
    degrees: bool = False,
    las: LasForm | None = None,
) -> PointTable:
    """Make one table of pieces, as of a whole file, of one file or of several.

    Parameters
    ----------
    pieces : sequence of (ndarray, dict of str to ndarray)
        As `chunks` yields them.
    path : path-like
        For the texts of notices.
    single, degrees : bool
        As of `PointTable`.
    las : LasForm, optional
        As of `PointTable`.

    Returns
    -------
    PointTable
        Numbers that some pieces lack are 0 there, and colors white; a notice says so.

    Raises
    ------
    TooFewPointsError
        There are no points.
    """
    path = as_path(path)
    table = PointTable(np.concatenate([np.empty((0, 3)), *(points for points, _ in pieces)]), single=single, las=las)
    check_places(table.points, path)
    table.degrees = degrees
    for name in dict.fromkeys(name for _, attributes in pieces for name in attributes):
        values, missing = _join_column(name, pieces)
        table.attributes[name] = values
        if missing:
            table.notices.append(
                f"{path.name}: {missing:,} points have no {name}; it is {'full' if name in CHANNELS else 0} there."
            )
    settle_columns(table, path)
    table.notices += doubts(table, path)
    return table


def _join_column(name: str, pieces: Sequence[tuple[Floats, dict[str, Array]]]) -> tuple[Array, int]:
    """Return the numbers of a name of all pieces, and how many points have none."""
    given = [(len(points), attributes.get(name)) for points, attributes in pieces]
    there = [values for _, values in given if values is not None]
    kind, shape = np.result_type(*there), there[0].shape[1:]
    usual = 0.0
    if name in CHANNELS:
        alike = CHANNELS[:3] if name in CHANNELS[:3] else (name,)  # a full color is that of all three
        usual = full_color(
            np.concatenate([numbers[each] for _, numbers in pieces for each in alike if each in numbers])
        )
    full = np.full(shape, usual, kind)
    columns = [np.broadcast_to(full, (count, *shape)) if values is None else values for count, values in given]
    return np.concatenate(columns), sum(count for count, values in given if values is None)
