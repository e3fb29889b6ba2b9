"""The command line from files to files, and the work that it shares with Blender's tools; neither needs Blender."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

    import core
    import tools
    import tools.cross_section
    import tools.groups
    import tools.laplacian
    import tools.listed
    import tools.roughness
    import tools.settings
    import tools.tool
    from tools import quantities

_HOME = f"{__name__.rpartition('.')[0]}.tools".removeprefix(".")
_TAKEN = "groups", "laplacian", "listed", "quantities", "roughness", "settings", "tool"  # as tools.name


def __getattr__(name: str) -> ModuleType:
    """Import what stands beside this package as it is asked for, so that the program can begin before all of it."""
    if name not in ("core", "quantities", "tools"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    tools = import_module(_HOME)
    for taken in _TAKEN:
        import_module(f"{_HOME}.{taken}")
    globals().update(core=tools.core, quantities=tools.quantities, tools=tools)
    return globals()[name]
