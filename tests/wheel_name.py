"""Core under the name that it has in the wheel, for examples and pages, which use that."""

import importlib.util
import sys
from pathlib import Path

NAME = "meshfree_laplacian"
_CORE = Path(__file__).parents[1] / "core"


def put_in_place():
    """Let ``import meshfree_laplacian`` find this tree's core, as a package of its own beside `core`."""
    if NAME not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            NAME, _CORE / "__init__.py", submodule_search_locations=[str(_CORE)]
        )
        sys.modules[NAME] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[NAME])
