"""The manual as pages that a browser opens without a network: what the zip brings of docs/."""

import html
import re

from environments import ROOT

DOCS = ROOT / "docs"
START = "manual.html"
_PAGES = ("manual", "install", "tutorial", "objects", "colors", "settings", "files", "faq")
_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font-family: sans-serif; max-width: 50em; margin: 2em auto; padding: 0 1em; line-height: 1.5; }}
table {{ border-collapse: collapse; }} td, th {{ border: 1px solid #bbb; padding: .2em .6em; text-align: left; }}
pre, code {{ background: #eee; }} pre {{ padding: .6em; overflow-x: auto; }}
</style></head><body>
{body}
</body></html>
"""


def sources():
    """Pages for users: those about tools, and what leads to them. Pictures and measured results are not among them."""
    return [*(DOCS / f"{name}.md" for name in _PAGES), *sorted(DOCS.glob("operators/*.md"))]


def write_pages(folder):
    """Write all pages into a folder."""
    known = {path.resolve() for path in sources()}
    for path in sources():
        text = path.read_text(encoding="utf-8")
        target = folder / path.relative_to(DOCS).with_suffix(".html")
        target.parent.mkdir(parents=True, exist_ok=True)
        title = html.escape(text.partition("\n")[0].strip("# "))
        target.write_text(_HEAD.format(title=title, body=_body(text, path, known)), encoding="utf-8")


def _body(text, path, known):
    parts = re.split(r"^```\w*\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    found = []
    for number, part in enumerate(parts):
        if number % 2:
            found.append(f"<pre>{html.escape(part)}</pre>")
        else:
            found += [_block(block, path, known) for block in re.split(r"\n{2,}", part.strip("\n"))]
    return "\n".join(found)


def _block(block, path, known):
    """Return a heading, table, list, code block or paragraph."""

    def written(words):
        return _inline(words, path, known)

    if re.match(r"!\[[^]]*\]\([^)]*\)$", block):
        return ""
    if heading := re.match(r"(#+) (.*)", block):
        level = len(heading[1])
        return f'<h{level} id="{anchor(heading[2])}">{written(heading[2])}</h{level}>'
    if block.startswith("|"):
        return f"<table>{''.join(_row(line, written) for line in block.splitlines())}</table>"
    if block.startswith("    "):
        return f"<pre>{html.escape(block)}</pre>"
    if items := re.split(r"^(?:-|\d+\.) ", block, flags=re.MULTILINE)[1:]:
        number = re.match(r"(\d+)\.", block)
        kind, start = ("ol", f' start="{number[1]}"') if number else ("ul", "")
        return f"<{kind}{start}>{''.join(f'<li>{written(item)}</li>' for item in items)}</{kind}>"
    return f"<p>{written(block)}</p>"


def _row(line, written):
    cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
    return "" if set(line) <= set("|-: ") else f"<tr>{''.join(f'<td>{written(cell)}</td>' for cell in cells)}</tr>"


def anchor(heading):
    """Return what links call a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _inline(text, path, known):
    """Return text with its code, emphasis and links; links to what is not among the pages are words alone."""

    def link(match):
        place, _, part = match[2].partition("#")
        file = (path.parent / place).resolve() if place else path
        if place.startswith("http"):
            return f'<a href="{match[2]}">{match[1]}</a>'
        if file not in known:
            return match[1]
        return f'<a href="{place.removesuffix("md")}{"html" * bool(place)}{"#" * bool(part)}{part}">{match[1]}</a>'

    found = []
    for number, piece in enumerate(re.split(r"`([^`]+)`", text)):
        words = html.escape(piece)
        if number % 2:
            words = f"<code>{words}</code>"
        else:
            words = re.sub(r"\*\*([^*]+)\*\*", r"<b>\1</b>", words)
            words = re.sub(r"\*([^*]+)\*", r"<i>\1</i>", words)
        found.append(words)
    whole = re.sub(r"!\[[^]]*\]\([^)]*\)", "", "".join(found))
    return re.sub(r"\[([^]]+)\]\(([^)\s]+)\)", link, whole)
