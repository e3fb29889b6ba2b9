"""The command line from files to files, and the work that it shares with Blender's tools; neither needs Blender."""

from importlib import import_module

_HOME = f"{__name__.rpartition('.')[0]}.tools".removeprefix(".")
_TAKEN = "groups", "laplacian", "listed", "quantities", "roughness", "settings", "tool"  # as tools.name


def __getattr__(name):
    """Import what stands beside this package as it is asked for, so that the program can begin before all of it."""
    if name not in ("core", "quantities", "tools"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    tools = import_module(_HOME)
    for taken in _TAKEN:
        import_module(f"{_HOME}.{taken}")
    globals().update(core=tools.core, quantities=tools.quantities, tools=tools)
    return globals()[name]
