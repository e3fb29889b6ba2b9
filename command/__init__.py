"""The command line from files to files, and the work that it shares with Blender's tools; neither needs Blender."""

from importlib import import_module

_home = __name__.rpartition(".")[0]
tools = import_module(f"{_home}.tools".removeprefix("."))
for _taken in ("groups", "laplacian", "listed", "quantities", "roughness", "settings", "tool"):  # as tools.groups
    import_module(f"{tools.__name__}.{_taken}")
core, quantities = tools.core, tools.quantities
