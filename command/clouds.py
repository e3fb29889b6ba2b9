"""Points or splats of a file, and the files that their results are written to.

Beside the kinds of files that core reads and writes there is one more where Blender is, which registers it here.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from . import core, quantities
from .settings import as_place, place

if TYPE_CHECKING:
    from argparse import ArgumentParser
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from tools.tool import Array

Given: TypeAlias = "core.files.PointTable | core.splats.Splats"  # what a file holds
_FILE_NORMAL = "normal"  # the attribute that files call nx ny nz
_BLEND = ".blend"
_FOR_BLENDER = (
    "Files of Blender are read and written by Blender itself: blender --command meshfree takes the same verbs."
)
_kinds: dict[str, Kind] = {}  # further ones, by their endings


class Kind(NamedTuple):
    """A kind of file that a program reads and writes which holds more of it than points, in objects.

    What it reads has an `owner`, the object, with these attributes: `settings`, those of the object by name; `groups`,
    from names to weights, (n,), NaN at points outside. And methods: `taken` for some of the points and `moved` for a
    motion, which return another owner; `write` for a cloud with results, `add_mesh`, `add_curves` and `add_profile`,
    which change the open file; `save`, which writes it; `place`, `plane` and `curve`, which return what other objects
    are, by name, in the coordinates of the cloud.
    """

    add_options: Callable[[ArgumentParser], None]  # of a parser: adds the options for what is read
    # Of a path, the name of an object or "", the option for it, and the arguments of a command line; opens the file
    read: Callable[[Path, str, str, Namespace], Given]
    # Of a name, what another file holds, and arguments: makes that an object of an empty file, and returns it
    own: Callable[[str, Given, Namespace], Given]
    # Of the vertices and faces of a mesh: returns arrays of faces (m, k) without openings, and how many edges are left
    # of one face
    close: Callable[[Array, Array], tuple[list[Array], int]]


def register(ending: str, kind: Kind) -> None:
    """Add a kind of file."""
    _kinds[ending] = kind


def unregister(ending: str) -> None:
    """Remove a kind of file."""
    del _kinds[ending]


def kinds() -> dict[str, Kind]:
    """Return the kinds of files beside those of core, by their endings."""
    return dict(_kinds)


def kind_of(path: Path | None) -> Kind | None:
    """Return the kind of a file, if it is one beside those of core; else None."""
    return None if path is None else _kinds.get(path.suffix.lower())


def inputs() -> tuple[str, ...]:
    """Return the endings of files that are read."""
    return (*core.files.READABLE, *core.files.SPLATS, *_kinds)


def outputs() -> tuple[str, ...]:
    """Return the endings of files that results are written to."""
    return (*_kinds, *core.files.WRITABLE, ".npz")


def hint(path: Path) -> str:
    """Return where a file of this name could be read and written, if it is one of Blender and this is another place."""
    return f" {_FOR_BLENDER}" if path.suffix.lower() == _BLEND and not _kinds else ""


def place_or_object(text: str) -> str | Array:
    """Parse X,Y,Z as a position, (3,), or take a text as the name of an object, where there are files of such."""
    return text if _kinds and as_place(text) is None else place(text)


def with_own(arguments: Namespace, given: Given) -> Namespace:
    """Return arguments in which the settings that the command line does not give are those of an object, if any."""
    own = {} if given.owner is None else given.owner.settings
    values = vars(arguments)
    return Namespace(**values | {name: own[name] for name in own.keys() & values.keys() if values[name] is None})


def read_file(path: Path, columns: str = "", las: core.files.LasChoices | None = None) -> Given:
    """Read a file, as splats if it holds splats.

    Columns are the names of those of a file of text; empty to find them. Of LAS files all points are read that are not
    withheld, if nothing else is chosen.
    """
    if hint(path):
        raise core.PointCloudError(f"{path} cannot be read.{hint(path)}")
    if columns.strip():
        return core.files.read_points(path, columns)
    choices = core.files.LasChoices() if las is None else las
    return core.splats.read_file(path, lambda path: core.files.read_points(path, las=choices))


def positions(given: Given) -> Array:
    """Return the positions of the points or splats that a file holds, (n, 3)."""
    return given.positions if isinstance(given, core.splats.Splats) else given.points


class Cloud:
    """Points of a file, (n, 3) in double precision, less a `place`, (3,), which keeps numbers small.

    Operators leave the splats `out`, (m,), floaters if these are not wanted.
    """

    def __init__(self, path: Path, given: Given, floaters: bool = True) -> None:
        self.path, self.given, self.notices = path, given, list(given.notices)
        self.splats = given if isinstance(given, core.splats.Splats) else None
        places = np.asarray(positions(given), dtype=np.float64)
        self.place = core.files.choose_origin(places, degrees=getattr(given, "degrees", False))
        self.points = core.check_points(places - self.place)
        self.out = core.splats.floating_rows(self.splats) if floaters and self.splats is not None else np.arange(0)

    @property
    def columns(self) -> dict[str, Array]:
        """Other numbers of the points, by name."""
        return {} if isinstance(self.given, core.splats.Splats) else self.given.attributes

    @property
    def owner(self) -> Any:
        """The object that the points belong to, as of `Kind`, whose file has others that options name."""
        if self.given.owner is None:
            raise core.PointCloudError(
                f"{self.path} holds points alone, and no objects that could be named. Give a position X,Y,Z, or a file."
            )
        return self.given.owner

    @property
    def groups(self) -> dict[str, Array]:
        """Weights by the names of groups, as of `Kind`; none in files of points."""
        return {} if self.given.owner is None else self.given.owner.groups

    def has(self, name: str) -> bool:
        """Whether there is a group or a column of a name."""
        return name in self.groups or name in self.columns

    def members(self, name: str, what: str) -> Array:
        """Return the points, (n,) bool, with weights or numbers above 0 in the group or column that an option names."""
        return (self.groups[name] if name in self.groups else self.numbers(name, what)) > 0

    def numbers(self, name: str, what: str) -> Array:
        """Return the column of a name, (n,), that an option asks for."""
        if name not in self.columns:
            known = ", ".join([*self.columns, *self.groups]) or "none"
            kinds = "columns" if self.given.owner is None else "columns and groups"
            raise core.PointCloudError(
                f'{self.path} has no column "{name}", which {what} names. Its {kinds} are {known}.'
            )
        return self.columns[name]

    def taken(self, kept: Array) -> Given:
        """Return the file's content of some of the points, (n,) bool."""
        owner = None if self.given.owner is None else self.given.owner.taken(kept)
        if isinstance(self.given, core.splats.Splats):
            return replace(_some(self.given, kept), owner=owner)
        colors = None if self.given.colors is None else self.given.colors[kept]
        columns = {name: values[kept] for name, values in self.columns.items()}
        return replace(self.given, points=self.given.points[kept], attributes=columns, colors=colors, owner=owner)


def moved(given: Given, points: Array, matrix: Array, place: Array) -> Given:
    """Return what a file holds after a motion, (4, 4), with one factor of size.

    It moves the positions, (n, 3), less a place, to which the result is relative, too.
    """
    linear, after = matrix[:3, :3], points @ matrix[:3, :3].T + matrix[:3, 3] + place
    if given.owner is not None:
        whole = matrix.copy()
        whole[:3, 3] += place - linear @ place
        given = replace(given, owner=given.owner.moved(whole))
    if isinstance(given, core.splats.Splats):
        return given.deformed(after, np.broadcast_to(linear, (len(after), 3, 3)))
    columns = dict(given.attributes)
    turn = (linear / np.linalg.norm(linear[0])).T
    for name, values in columns.items():
        if np.ndim(values) == 2 and (
            name in (_FILE_NORMAL, quantities.ORIENTATION) or quantities.quantity(name).is_direction
        ):
            columns[name] = values @ turn
    if core.files.SCANNER in columns and np.ndim(columns[core.files.SCANNER]) == 2:
        # Relative to the points, whose own motion is known, so that no digits are lost far from the origin.
        away = columns[core.files.SCANNER] - given.points
        columns[core.files.SCANNER] = after + away @ linear.T
    return replace(given, points=after, attributes=columns)


def write(
    path: Path,
    given: Given,
    results: Mapping[str, Array],
    arrays: Mapping[str, Array] | None = None,
    numbers: Mapping[str, Array] | None = None,
) -> list[str]:
    """Write points or splats with results to a file of a kind in `outputs`; return notices of what has another form.

    Of a kind beside those of core they are put into the open file, which is saved at the end. What is given is in the
    coordinates of the file, results are by the names of attributes. `arrays` are for .npz files, if not the points and
    results; `numbers`, which .npz files and objects hold, are further results that are not at the points.
    """
    if kind_of(path) is not None:
        return given.owner.write(given, results, numbers or {})
    if path.suffix.lower() == ".npz":
        points = np.asarray(positions(given), dtype=np.float64)
        named = {
            name.removeprefix(quantities.PREFIX): values for name, values in {**results, **(numbers or {})}.items()
        }
        core.files.write_arrays(path, {"points": points, **named} if arrays is None else arrays)
        return []
    if isinstance(given, core.splats.Splats):
        if path.suffix.lower() != ".ply":
            raise core.PointCloudError(f"Splats cannot be written to {path}. Let its name end in .ply.")
        core.splats.write_splats(path, with_columns(given, {name: _narrow(values) for name, values in results.items()}))
        return []
    return core.files.write_points(path, with_results(given, results), double=not given.single)


def with_results(given: core.files.PointTable, results: Mapping[str, Array]) -> core.files.PointTable:
    """Return a table with results as further columns, in single precision; normals under the name that files have."""
    attributes = {**given.attributes, **{name: _narrow(values) for name, values in results.items()}}
    if quantities.NORMAL in results:
        attributes.pop(_FILE_NORMAL, None)
        attributes[_FILE_NORMAL] = attributes.pop(quantities.NORMAL)
    return replace(given, attributes=attributes)


def _narrow(values: Array) -> Array:
    """Return numbers in single precision, which is what results in files have in Blender, too."""
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _some(splats: core.splats.Splats, kept: Array) -> core.splats.Splats:
    """Return some of the splats, (n,) bool."""
    names = ("positions", "scales", "rotations", "opacities", "colors", "harmonics")
    file = splats.file
    if file is not None:
        file = file._replace(columns={name: values[kept] for name, values in file.columns.items()})
    return replace(splats, **{name: getattr(splats, name)[kept] for name in names}, file=file)


def with_columns(splats: core.splats.Splats, results: Mapping[str, Array]) -> core.splats.Splats:
    """Return splats to be written with results of their points as further columns of the file."""
    file = splats.file or core.splats.SplatFile({})
    columns = dict(file.columns)
    for name, values in results.items():
        columns.update(core.files.split_columns(name, values))
    return replace(splats, file=file._replace(columns=columns))
