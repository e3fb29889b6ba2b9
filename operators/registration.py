"""The registry of tools, from which panels and menus are built."""

from dataclasses import dataclass
from itertools import groupby

from ..tools.tool import Row as Row

_registered = []


@dataclass(frozen=True)
class Registration:
    """An operator with its rows: an item of `TOOLS` in its module."""

    operator: type
    panel: Row | None = None  # home: the label of a panel
    menu: Row | None = None  # home: "Object", or "Points" in Edit Mode
    quick: Row | None = None  # of context menus, with the same homes: run by one click

    @property
    def name(self) -> str:
        """Name of the operator, as scripts call it."""
        return self.operator.bl_idname.removeprefix("meshfree.")


def add(tools):
    """Add the tools of a module, after their operators are registered in Blender."""
    _registered.extend(tools)


def clear():
    """Remove all tools."""
    _registered.clear()


def registered() -> tuple:
    """Return all tools."""
    return tuple(_registered)


def groups(kind: str, home: str) -> list:
    """Return the tools with a row in a home of a kind, "panel", "menu" or "quick", in order, as lists by group."""
    rows = [(getattr(tool, kind), tool) for tool in _registered]
    rows = sorted(((row, tool) for row, tool in rows if row and row.home == home), key=lambda pair: pair[0])
    return [[tool for _, tool in group] for _, group in groupby(rows, lambda pair: pair[0].group)]
