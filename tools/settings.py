"""Settings of tools and of the Laplacian, for properties of Blender and for options of the command line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple


class Choice(NamedTuple):
    """A value that can be chosen, in upper case, with its label and its tooltip."""

    value: str
    label: str
    description: str


class Setting(NamedTuple):
    """A setting.

    Attributes
    ----------
    name, description : str
        Its name in Python, and what it is in the words of the manual.
    default : bool, int, float, str or sequence of float
        Its type is that of the values. For one of several choices in upper case.
    least, most : float or None
        Bounds of a number.
    choices : tuple of Choice
    form : {"", "LENGTH", "AREA", "DEGREES", "X,Y,Z"}
        What the number is: a length or an area in the units of the points, an angle [rad], a place or a direction.
    label : str
        In Blender; empty for its name in capitals.
    low, high : float or None
        Where a slider begins and ends, within the bounds.
    at_zero : str
        What stands beside it at 0, where that means automatic or unlimited.
    """

    name: str
    description: str
    default: Any
    least: float | None = None
    most: float | None = None
    choices: tuple[Choice, ...] | tuple[str, ...] = ()
    form: str = ""
    label: str = ""
    low: float | None = None
    high: float | None = None
    at_zero: str = ""

    @property
    def title(self) -> str:
        """Its label."""
        return self.label or self.name.replace("_", " ").title()

    @property
    def values(self) -> tuple[str, ...]:
        """The values to choose from."""
        return tuple(choice if isinstance(choice, str) else choice.value for choice in self.choices)


def by_name(settings: Iterable[Setting]) -> dict[str, Setting]:
    """Return settings by their names."""
    return {setting.name: setting for setting in settings}
