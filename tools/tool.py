"""What a tool is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import core
from .quantities import written_by
from .settings import Setting

Laplacian: TypeAlias = "core.LaplaceBeltrami"
Array = NDArray[Any]
Progress = Callable[[str, float], None]
Subject = TypeVar("Subject")


class Length(Protocol):
    """A function that writes a length as a text; with a power of 2 an area, with 3 a volume."""

    def __call__(self, size: float, /, power: int = 1) -> str:
        """Return the text."""


class Row(NamedTuple):
    """The position of a tool in Blender: panel or menu, group of rows in it, and index in that, from 1."""

    home: str
    group: int
    place: int
    text: str = ""  # of the button, if not the label of the tool
    given: tuple[tuple[str, str], ...] = ()  # settings of the button by name, if not the defaults


class Cloud(Protocol):
    """Points that a tool reads: of a file, or of an object in Blender."""

    name: str  # of the object, or of the file without its ending
    where: str  # the same as errors name it
    kind: str  # what a group of points is called there
    in_blender: bool
    out: Array  # (m,) int, floaters among splats that operators leave out
    repeats: bool  # whether settings are adjusted, which must not take long
    points: Array  # (n, 3), with lengths as the results have them
    place: Array  # (3,), less which the points are
    heights_from: Array  # (3,), the same where heights are told, which in Blender are those in the scene
    orientation: Array | None  # (n, 3), to the side of the normals that was chosen, 0 where none was

    @property
    def boundary(self) -> Array | None:
        """Points of the boundary, (n,) bool, where a group names them."""

    @property
    def options(self) -> core.LaplacianOptions:
        """Those of the default method, where the paper's operator is not usable."""

    def named(self, setting: str) -> str:
        """Return what a setting is called there, for errors."""

    def has_group(self, name: str) -> bool:
        """Whether there is a group of points of some name."""

    def has_numbers(self, name: str) -> bool:
        """Whether there are numbers at the points of some name."""

    def weights(self, setting: str, name: str, least: int = 1, outside: float = 0.0) -> Array:
        """Return the weights, (n,), of the group that a setting names, and a value for the points outside."""

    def numbers(self, setting: str, name: str) -> Array:
        """Return the numbers at the points, (n,) or (n, m), that a setting names."""

    def vectors(self, setting: str, name: str, places: bool) -> Array:
        """Return the vectors at the points, (n, 3), that a setting names, along the axes of `points`.

        They may stand for places in the coordinates of `points`.
        """

    def viewpoint(self) -> Array:
        """Return from where the points were seen, (3,)."""

    def sources(self, name: str) -> Array:
        """Return the source points, (n,) bool: those of a group, or those that were given in another way."""

    def curve(self) -> tuple[Array, bool]:
        """Return the points of a curve, (k, 3), and whether its last one is joined with the first."""

    def ends(self) -> tuple[Array, Array]:
        """Return the two points that a path is between, (2,) int, and how far they are from where they are wanted."""

    def laplacian(self, progress: Progress) -> Laplacian:
        """Return the operator, for tools that do not always need it."""

    def reference(self) -> tuple[Cloud, Array]:
        """Return another cloud, and the offset, (3,), from the points here to those of that."""


class Outcome(NamedTuple):
    """What a tool writes and tells.

    Attributes
    ----------
    values : mapping of str to ndarray
        Results at the points, (n,) or (n, m), by the names of attributes; vectors along the axes of `Cloud.points`.
    line : str
        A line on it, without the name of the cloud.
    notices : sequence of str
        What users have to know beside.
    points : ndarray, (n, 3), optional
        Where the points are moved to, in the coordinates of `Cloud.points`.
    kept : ndarray, (n,) bool, optional
        Which points stay; the others are deleted.
    numbers : mapping of str to ndarray
        Results that are not at the points, by name.
    figures : mapping of str to object
        Numbers on it, by name, for programs.
    matrix : ndarray, (4, 4), optional
        How the whole cloud is moved, in the coordinates of the reference.
    made : object
        What else is made, such as a mesh or a table.
    """

    values: Mapping[str, Array]
    line: str
    notices: Sequence[str] = ()
    points: Array | None = None
    kept: Array | None = None
    numbers: Mapping[str, Array] = {}
    figures: Mapping[str, Any] = {}
    matrix: Array | None = None
    made: Any = None


class AnyTool(Generic[Subject]):
    """A tool for a cloud, by its points or by their operator. A subclass declares it, in this order of its work.

    `own` of its methods has the values of the settings as attributes.
    """

    name: str  # of Blender's operator
    verb = ""  # the subcommand, if it is not the name with - for _
    label: str
    help: str  # a sentence without its period: tooltip, and help
    settings: tuple[Setting, ...] = ()
    showing: tuple[Setting, ...] = ()  # those that choose which result is shown, in Blender alone
    reads: tuple[str, ...] = ()  # beside points: "sources" or "curve"
    reference = ""  # what another cloud is for, if it reads one
    panel: Row | None = None  # home: the label of a panel
    menu: Row | None = None  # home: "Object", or "Points" in Edit Mode
    quick: Row | None = None  # of context menus, with the same homes: run by one click
    keeps_line = False  # whether its line is kept beside the notices
    extended = False  # whether Blender has a class of its own for it, with what only Blender can do

    def asks(self, own: Any) -> tuple[str, ...]:
        """Return the names of the settings that matter beside the values of others."""
        return tuple(setting.name for setting in self.settings)

    def later(self, own: Any) -> tuple[str, ...]:
        """Return the names of the settings that `finish` alone takes, so that they can be changed at once."""
        return ()

    def adjustable(self, own: Any) -> tuple[str, ...]:
        """Return the names of the settings that can be changed without long computation."""
        return self.later(own)

    def writes(self, own: Any) -> tuple[str, ...]:
        """Return the names of the attributes that are written."""
        return written_by(self.name)

    @property
    def shows(self) -> bool:
        """Whether it has results at the points, to be shown at the end."""
        return bool(written_by(self.name))

    def shown(self, own: Any) -> str:
        """Return the name of the attribute to show."""
        return self.writes(own)[0]

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Read and check what `compute` takes beside the points: arrays, and tuples of them."""

    def compute(self, subject: Subject, inputs: Any, own: Any, progress: Progress) -> Any:
        """Compute what takes long. It is kept as long as inputs and settings are the same, but for `later`."""
        raise NotImplementedError

    def finish(self, found: Any, subject: Subject, own: Any, length: Length) -> Outcome:
        """Return what is written and told of what `compute` found; `length` writes lengths as texts."""
        raise NotImplementedError

    def key(self, own: Any) -> tuple[Any, ...]:
        """Return the values of the settings that `compute` depends on."""
        names = [setting.name for setting in self.settings if setting.name not in self.later(own)]
        values = [getattr(own, name) for name in names]
        return tuple(value if isinstance(value, (str, int, float)) else tuple(value) for value in values)


class Tool(AnyTool[Laplacian]):
    """A tool that applies the operator of a cloud."""


class PointTool(AnyTool[Array]):
    """A tool that needs the points alone, (n, 3)."""

    bytes_a_point = 200  # of memory at the peak
    deletes = False  # whether points may be deleted


class MovingTool(Tool):
    """A tool that moves the points, and has no results at them."""

    def shown(self, own: Any) -> str:
        return ""

    def moved(self, found: Any, laplacian: Laplacian, own: Any) -> Array:
        """Return the new positions, (n, 3), of the points of an operator, by what `compute` found."""
        raise NotImplementedError

    def shape(self, found: Any) -> Array | None:
        """Return the points, (n, 3), whose discs are found; None where discs turn with what moves the points."""
        return None

    def title(self, found: Any) -> str:
        """Return the name of the shape key that holds the result."""
        return self.label

    def told(self, found: Any, own: Any) -> list[str]:
        """Return notices of what was found."""
        return []

    def line(self, found: Any, before: Array, after: Array, length: Length) -> str:
        """Return what is told of points that were moved."""
        moved = np.linalg.norm(after - before, axis=1)
        average, most = length(np.sqrt(np.mean(moved**2))), length(moved.max())
        return f"{len(after):,} points moved by {average} on average, at most by {most}"

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        points = self.moved(found, laplacian, own)
        line = self.line(found, laplacian.points, points, length)
        return Outcome({}, line, self.told(found, own), points)
