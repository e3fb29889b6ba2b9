"""The operators: by the source, known before the extension is installed, and those that it registers as tools."""

import ast
import importlib
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.blender.clouds import everything
from tests.blender.conftest import MODULE
from tools.listed import listed_tools

ROOT = Path(__file__).parents[2]
NOT_TOOLS = {
    "add_preset": "a button beside the menu of presets",
    "apply_preset": "what each row of the menu of presets does",
}


def _names():
    for path in (path for package in ("operators", "ui") for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and node.name.startswith("MESHFREE_OT_"):
                yield node.name.removeprefix("MESHFREE_OT_")
    yield from (tool.name for tool in listed_tools())
    yield "compare_swap"  # a tool of Blender alone, declared by that which compares


OPERATORS = sorted(_names())


def tools():
    """All registered tools by name."""
    found = importlib.import_module(f"{MODULE}.operators.registration").registered()
    return {tool.name: tool for tool in found}


def applications():
    """Operators, by name, of the tools that apply the Laplacian: they read all, compute, and only then write."""
    base = importlib.import_module(f"{MODULE}.operators.running.application").ApplicationOperator
    return {name: tool.operator for name, tool in tools().items() if issubclass(tool.operator, base)}


@contextmanager
def refused(obj, text):
    """Expect that an operator is refused with a text, by a pattern, and that an object holds what it held."""
    before = everything(obj)
    with pytest.raises(RuntimeError, match=text):
        yield
    assert everything(obj) == before
