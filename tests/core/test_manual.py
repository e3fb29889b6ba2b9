"""The manual is whole: links and pictures are there, quoted messages are those of the code, the sample is the coral."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from coral import Coral
from core.files import read_points

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
LINK = re.compile(r"(?<!\\)\]\((?!https?://)([^)#\s]*)(?:#([^)\s]+))?\)")
HOSTED = {"../../releases"}  # pages of the server that shows the README
LARGEST = 300e3  # bytes of a picture
GAP = "…"  # what stands for names and numbers in quoted messages


def read(path):
    return path.read_text(encoding="utf-8")


def anchors(path):
    """Names by which a page's headings are linked to."""
    text = re.sub(r"^```.*?^```", "", read(path), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_links(path):
    for target, anchor in LINK.findall(read(path)):
        if target in HOSTED:
            continue
        place = (path.parent / target).resolve() if target else path
        assert place.exists(), f"{path.name} links to {target}"
        if anchor:
            assert anchor in anchors(place), f"{path.name} links to {target}#{anchor}"


def test_every_page_and_picture_is_linked():
    linked = {(path.parent / target).resolve() for path in PAGES for target, _ in LINK.findall(read(path))}
    assert {path for path in DOCS.rglob("*") if path.is_file()} <= linked


@pytest.mark.parametrize("path", [*PAGES, ROOT / "CHANGELOG.md"], ids=lambda path: path.stem)
def test_paragraphs_in_lists_are_indented_as_the_site_takes_them(path):
    text = re.sub(r"^```.*?^```", "", read(path), flags=re.MULTILINE | re.DOTALL)
    assert re.findall(r"\n\n {1,3}\S.*", text) == []


def test_pictures_are_small():
    assert [path.name for path in DOCS.glob("pictures/*") if path.stat().st_size > LARGEST] == []


def messages():
    """All texts in the code, with a mark for what is filled in."""
    for path in sorted(
        path for folder in ("core", "tools", "command", "operators", "ui") for path in (ROOT / folder).rglob("*.py")
    ):
        for node in ast.walk(ast.parse(read(path))):
            if isinstance(node, ast.JoinedStr):
                yield "".join(part.value if isinstance(part, ast.Constant) else "\0" for part in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


def test_messages():
    quoted = re.findall(r"^\| `(.+?)` \|", read(DOCS / "faq.md"), re.MULTILINE)
    assert len(quoted) > 40
    texts = set(messages())
    for message in quoted:
        parts = message.split(GAP)
        assert sum(map(len, parts)) > 12, message
        pattern = re.compile(".*".join(map(re.escape, parts)), re.DOTALL)
        longest = max(parts, key=len)
        assert any(longest in text and pattern.search(text) for text in texts), f"no code says: {message}"


def test_sample():
    points = read_points(DOCS / "coral.ply").points
    np.testing.assert_allclose(points, Coral().sample(len(points)), atol=1e-6)
