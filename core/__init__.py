"""Mesh-free discrete Laplace-Beltrami operator on point clouds, usable without Blender.

`build_laplacian` makes the operator of a cloud, and nearly all else takes that operator, first. Here is what everyone
needs; what the operator is for is in a namespace a topic:

- `clean` gives fewer, smoother and better points,
- `measure` curvature, areas, lengths, volumes, sections, and one cloud on or beside another,
- `distance` distances, paths and directions along a surface, and functions between given values,
- `spectral` what the modes are for: descriptors, matching, segments,
- `deform` surfaces that bend by handles, or shrink to the least area,
- `rig` weights of bones, their transfer, and surfaces that follow bones,
- `motion` heat, waves and reactions,
- `surface` meshes and discs,
- `splats` Gaussian splats, `files` point files, `tiles` clouds larger than the memory, `paper` the paper as it stands.

Lengths are in the unit of the points, [L].

Examples in the docstrings can be copied as they are. All but one begin with the same three lines, for 800 points of the
unit sphere, where answers are known:

>>> import numpy as np
>>> import meshfree_laplacian as mf
>>> points = mf.example_sphere()
"""

import ast
import importlib
import re
import threading
from pathlib import Path
from types import ModuleType
from typing import Any

from .errors import BrokenLibraryError

_ROOT = Path(__file__).parent


def _read(file: str) -> dict[str, str]:
    """Return the module of each public name or package that a file imports, parsed as type checkers do."""
    listed = ast.parse((_ROOT / file).read_text(encoding="utf-8"))
    imports = [node for node in listed.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or alias.name for node in imports for alias in node.names}


_HOMES = _read("__init__.pyi")
_NAMESPACES = [name for name, home in _HOMES.items() if name == home]
_lock = threading.RLock()  # scipy has circular imports: two threads at once may see half-loaded modules

__all__ = sorted(name for name, home in _HOMES.items() if name != home)


def __getattr__(name: str) -> Any:
    """Import the module of a public name, or a package, when it is first used: scipy takes a second."""
    if name == "__version__":
        return _version()
    if name not in _HOMES and name not in _HOMES.values():
        raise AttributeError(_missing(name))
    home = _HOMES.get(name, name)
    with _lock:
        module = _import(home)
    found = module if name == home else getattr(module, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, "__version__"})


def _missing(name: str) -> str:
    """Return the error message for an unknown name, with the namespace that has it, if any."""
    for space in _NAMESPACES:
        if name in _read(f"{space}/__init__.py"):
            return f"`mf.{name}` is `mf.{space}.{name}`"
    return f"module {__name__!r} has no attribute {name!r}"


def _version() -> str:
    """Return the version: of the extension or the tree that this is in, or of the installed wheel."""
    manifest = _ROOT.parent / "blender_manifest.toml"
    if not manifest.exists():
        from importlib import metadata  # here, as it takes as long as all else of this module

        return metadata.version(__name__)
    [found] = re.findall(r'^version = "(.+)"', manifest.read_text(encoding="utf-8"), re.MULTILINE)
    return str(found)


def _import(name: str) -> ModuleType:
    """Import a module or package of core; explain an error where scipy, or its use of numpy, does not load."""
    try:
        return importlib.import_module(f".{name}", __name__)
    except ImportError as error:
        if (error.name or "").startswith(__name__):
            raise
        raise BrokenLibraryError(f"The scipy of this Python does not serve: {error}. Install one that fits.") from error
