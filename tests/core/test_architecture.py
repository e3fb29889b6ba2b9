"""The arrows of the house: ui -> operators -> core, and no bpy in core."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PUBLIC = [
    "LaplacianOptions",
    "build_laplacian",
    "LaplaceBeltrami",
    "estimate_areas",
    "estimate_normals",
    "PointCloudError",
]


def imported(path):
    """Names of the modules that a file imports, relative ones with their dots."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            stem = "." * node.level + (node.module or "")
            yield from (f"{stem}{'' if stem.endswith('.') else '.'}{alias.name}" for alias in node.names)


@pytest.mark.parametrize(("package", "forbidden"), [("core", ("bpy", "..operators", "..ui")), ("operators", ("..ui",))])
def test_imports_point_one_way(package, forbidden):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    wrong = [f"{file.name}: {name}" for file in files for name in imported(file) if name.startswith(forbidden)]
    assert wrong == []


def test_core_needs_numpy_and_scipy_only():
    allowed = set(sys.stdlib_module_names) | {"numpy", "scipy"}
    wrong = [
        f"{file.name}: {name}"
        for file in sorted((ROOT / "core").rglob("*.py"))
        for name in imported(file)
        if not name.startswith(".") and name.split(".")[0] not in allowed
    ]
    assert wrong == []


def test_core_is_usable_from_the_repository_root_without_blender():
    names = ", ".join(PUBLIC)
    code = f"import sys; from core import {names}; assert 'bpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_core_never_uses_the_warnings_module():
    assert [file.name for file in (ROOT / "core").rglob("*.py") if "warnings" in imported(file)] == []
