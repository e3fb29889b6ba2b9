"""What there is for each tool, said once, beside its operator: panels, menus and the command line list it from here."""

from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

_registered = []


class Row(NamedTuple):
    """Where a tool stands: in which panel or menu, in which group of rows there, and at which place of it, from 1."""

    home: str
    group: int
    place: int
    text: str = ""  # on the button, where it is not the name of the operator


@dataclass(frozen=True)
class Registration:
    """An operator with its rows, and what the command line runs: listed in its module as one of `TOOLS`."""

    operator: type
    panel: Row | None = None  # of a panel, by its label
    menu: Row | None = None  # of the menu "Object", or of "Points" in Edit Mode
    quick: Row | None = None  # of what one click does, in the menus that a right click opens on objects and on points
    verb: type | None = None  # a `Tool`; the verb has the name of the operator

    @property
    def name(self) -> str:
        """Name of the operator, as scripts call it."""
        return self.operator.bl_idname.removeprefix("meshfree.")


def add(tools):
    """Let the interface list the tools of a module, when their operators are registered in Blender."""
    _registered.extend(tools)


def clear():
    """Forget all tools."""
    _registered.clear()


def registered() -> tuple:
    """Return all tools."""
    return tuple(_registered)


def groups(kind: str, home: str) -> list:
    """Return the tools with a row in a panel or a menu, in their order, as lists of those that stand together.

    Parameters
    ----------
    kind : {"panel", "menu", "quick"}
    home : str
        As rows name it.
    """
    rows = [(getattr(tool, kind), tool) for tool in _registered]
    rows = sorted(((row, tool) for row, tool in rows if row and row.home == home), key=lambda pair: pair[0])
    return [[tool for _, tool in group] for _, group in groupby(rows, lambda pair: pair[0].group)]
