"""Texts of core name its settings and functions; Blender puts its own labels in their place."""

import ast
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_found = runpy.run_path(str(ROOT / "operators" / "objects" / "words.py"))
WORDS, in_blender = _found["_WORDS"], _found["in_blender"]
LABELS = r"\b([Bb]utton|[Dd]ialog|[Pp]anel|[Ss]idebar|[Cc]lick|[Pp]ress|Blender|extension|lb_\w+)\b"


def texts():
    """All texts of core but docstrings, with {} for what is filled in."""
    for path in sorted((ROOT / "core").rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        whole = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
        parts = {id(part) for node in whole for part in ast.walk(node) if part is not node}
        for node in ast.walk(tree):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                parts.add(id(node.value))
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr) and id(node) not in parts:
                yield (
                    path,
                    "".join(
                        getattr(part, "value", "{}") if isinstance(part, ast.Constant) else "{}" for part in node.values
                    ),
                )
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
                yield path, node.value


TEXTS = list(texts())


def test_they_name_nothing_of_blender():
    sentences = [(path.name, text) for path, text in TEXTS if " " in text]
    assert len(sentences) > 300
    named = [
        *(label for label in ("Bandwidth Factor", "Convert to Meters", "Withheld Points", "Export Splats", "Columns"))
    ]
    wrong = {
        (name, text) for name, text in sentences if re.search(LABELS, text) or any(label in text for label in named)
    }
    assert wrong == set()


@pytest.mark.parametrize("words", WORDS)
def test_blender_puts_its_own_in_place_of_words_that_core_has(words):
    texts = [text for _, text in TEXTS if words in text]
    assert texts
    for text in texts:
        assert words not in in_blender(text).replace(WORDS[words], "")
        assert in_blender(in_blender(text)) == in_blender(text)
