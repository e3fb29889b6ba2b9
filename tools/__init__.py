"""The tools, a module each: declared once, for Blender's operators, the subcommands and the rows of the manual.

Nothing here needs Blender.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import core
else:
    _home = __name__.rpartition(".")[0]
    _beside = f"{_home}.core".removeprefix(".")
    core = import_module(_beside if find_spec(_beside) else _home)  # in the wheel, core is the package around this one
