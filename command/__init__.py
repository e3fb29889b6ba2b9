"""The command line from files to files, and the work that it shares with Blender's tools; neither needs Blender."""

from importlib import import_module
from importlib.util import find_spec

_home = __name__.rpartition(".")[0]
_beside = f"{_home}.core".removeprefix(".")
core = import_module(_beside if find_spec(_beside) else _home)  # in the wheel, core is the package around this one
