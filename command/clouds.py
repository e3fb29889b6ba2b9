"""Points or splats of a file, and the files that their results are written to."""

from dataclasses import replace

import numpy as np

from . import core
from .quantities import NORMAL, PREFIX

_FILE_NORMAL = "normal"  # the attribute that files call nx ny nz


def inputs() -> tuple:
    """Return the endings of files that are read."""
    return (*core.files.READABLE, *core.files.SPLATS)


def outputs() -> tuple:
    """Return the endings of files that results are written to."""
    return (*core.files.WRITABLE, ".npz")


def read_file(path, columns="", las=None):
    """Read a file, as splats if it holds splats.

    Parameters
    ----------
    path : pathlib.Path
    columns : str
        Names of the columns of a file of text; empty to find them.
    las : LasChoices
        Which points of LAS files are read; None for all that are not withheld.

    Returns
    -------
    Splats or PointTable
    """
    if columns.strip():
        return core.files.read_points(path, columns)
    choices = core.files.LasChoices() if las is None else las
    return core.splats.read_file(path, lambda path: core.files.read_points(path, las=choices))


def positions(given):
    """Return the positions of the points or splats that a file holds, (n, 3)."""
    return given.positions if isinstance(given, core.splats.Splats) else given.points


class Cloud:
    """Points of a file, in double precision.

    Parameters
    ----------
    path : pathlib.Path
    given : PointTable or Splats
    floaters : bool
        Whether floaters among splats are left out of operators.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Less `place`, (3,), which keeps numbers small.
    out : ndarray, (m,) int
        Splats that operators leave out.
    """

    def __init__(self, path, given, floaters=True):
        self.path, self.given, self.notices = path, given, list(given.notices)
        self.splats = given if isinstance(given, core.splats.Splats) else None
        places = np.asarray(positions(given), dtype=np.float64)
        self.place = core.files.choose_origin(places, degrees=getattr(given, "degrees", False))
        self.points = core.check_points(places - self.place)
        self.out = core.splats.floating_rows(given) if floaters and self.splats is not None else np.arange(0)

    @property
    def columns(self) -> dict:
        """Other numbers of the points, by name."""
        return {} if self.splats is not None else self.given.attributes

    def numbers(self, name, what):
        """Return the column of a name, (n,), that an option asks for."""
        if name not in self.columns:
            known = ", ".join(self.columns) or "none"
            raise core.PointCloudError(
                f'{self.path} has no column "{name}", which {what} names. Its columns are {known}.'
            )
        return self.columns[name]

    def taken(self, kept):
        """Return the file's content of some of the points, (n,) bool."""
        if self.splats is not None:
            return _some(self.splats, kept)
        colors = None if self.given.colors is None else self.given.colors[kept]
        columns = {name: values[kept] for name, values in self.columns.items()}
        return replace(self.given, points=self.given.points[kept], attributes=columns, colors=colors)


def moved(given, points, matrix, place):
    """Return what a file holds after a motion.

    Parameters
    ----------
    given : PointTable or Splats
    points : ndarray, (n, 3)
        Its positions less a place.
    matrix : ndarray, (4, 4)
        Of the motion of these, with one factor of size.
    place : ndarray, (3,)
        To which the result is relative.
    """
    linear, after = matrix[:3, :3], points @ matrix[:3, :3].T + matrix[:3, 3] + place
    if isinstance(given, core.splats.Splats):
        return given.deformed(after, np.broadcast_to(linear, (len(after), 3, 3)))
    columns = dict(given.attributes)
    if np.ndim(columns.get(_FILE_NORMAL)) == 2:
        columns[_FILE_NORMAL] = columns[_FILE_NORMAL] @ (linear / np.cbrt(np.linalg.det(linear))).T
    if np.ndim(columns.get(core.files.SCANNER)) == 2:
        # Relative to the points, whose own motion is known, so that no digits are lost far from the origin.
        away = columns[core.files.SCANNER] - given.points
        columns[core.files.SCANNER] = after + away @ linear.T
    return replace(given, points=after, attributes=columns)


def write(path, given, results, arrays=None) -> list:
    """Write points or splats with results to a file of a kind in `outputs`.

    Parameters
    ----------
    path : pathlib.Path
    given : PointTable or Splats
        In the coordinates of the file.
    results : dict of str to ndarray
        By the names of attributes.
    arrays : dict of str to ndarray, optional
        For .npz files, if not the points and results.

    Returns
    -------
    list of str
        Notices of what is written in another form.
    """
    splats = isinstance(given, core.splats.Splats)
    if path.suffix.lower() == ".npz":
        points = np.asarray(given.positions if splats else given.points, dtype=np.float64)
        named = {name.removeprefix(PREFIX): values for name, values in results.items()}
        save_arrays(path, {"points": points, **named} if arrays is None else arrays)
        return []
    if splats:
        if path.suffix.lower() != ".ply":
            raise core.PointCloudError(f"Splats cannot be written to {path}. Let its name end in .ply.")
        core.splats.write_splats(path, with_columns(given, {name: _narrow(values) for name, values in results.items()}))
        return []
    return core.files.write_points(path, with_results(given, results), double=not given.single)


def with_results(given, results):
    """Return a table with results as further columns, in single precision; normals under the name that files have.

    Parameters
    ----------
    given : PointTable
    results : dict of str to ndarray
        By the names of attributes.
    """
    attributes = {**given.attributes, **{name: _narrow(values) for name, values in results.items()}}
    if NORMAL in results:
        attributes.pop(_FILE_NORMAL, None)
        attributes[_FILE_NORMAL] = attributes.pop(NORMAL)
    return replace(given, attributes=attributes)


def _narrow(values):
    """Return numbers in single precision, which is what results in files have in Blender, too."""
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _some(splats, kept):
    """Return some of the splats, (n,) bool."""
    names = ("positions", "scales", "rotations", "opacities", "colors", "harmonics")
    file = splats.file
    if file is not None:
        file = file._replace(columns={name: values[kept] for name, values in file.columns.items()})
    return replace(splats, **{name: getattr(splats, name)[kept] for name in names}, file=file)


def with_columns(splats, results):
    """Return splats to be written with results of their points as further columns of the file."""
    file = splats.file or core.splats.SplatFile({})
    columns = dict(file.columns)
    for name, values in results.items():
        columns.update(core.files.split_columns(name, values))
    return replace(splats, file=file._replace(columns=columns))


def save_arrays(path, arrays):
    """Write arrays by name; an older file is kept if that fails."""
    with core.files.replacing(path) as part, part.open("wb") as file:  # to a path, numpy would add its own ending
        np.savez(file, **arrays)
