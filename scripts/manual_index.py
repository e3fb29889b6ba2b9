"""Write the table of operators in docs/manual.md, from the registered tools and their pages, in Blender's module.

Started by in_blender.py.
"""

import importlib
import re
import sys

import bpy

import studio
from manual_pages import DOCS, anchor

INDEX = DOCS / "manual.md"
_HEAD = "| operator | in scripts | what it does |\n| --- | --- | --- |\n"
_TABLE = re.compile(f"{re.escape(_HEAD)}(\\|.*\n)*")


def table(extension):
    """Return the table: operators in the order of the menus, each with its page and its tooltip."""
    registration = importlib.import_module(f"{extension}.operators.registration")
    menus = {tool.name: tool.menu for tool in registration.registered() if tool.menu}
    places = _places()
    names = sorted(dir(bpy.ops.meshfree), key=lambda name: (name not in menus, menus.get(name, ()), places[name]))
    return _HEAD + "".join(_row(name, places[name]) for name in names)


def _row(name, place):
    rna = getattr(bpy.ops.meshfree, name).get_rna_type()
    tooltip = rna.description[:1].lower() + rna.description[1:]
    return f"| [{rna.name}]({place}) | `meshfree.{name}` | {tooltip} |\n"


def _places():
    """Return where in the manual each operator is described."""
    found = {}
    for page in sorted(DOCS.glob("operators/*.md")):
        for level, text in re.findall(r"^(#+) (.*`meshfree\.\w+`.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
            place = page.relative_to(DOCS).as_posix() + ("" if level == "#" else f"#{anchor(text)}")
            found[re.search(r"`meshfree\.(\w+)`", text)[1]] = place
    return found


def written(text, extension):
    """Return a text with its table renewed."""
    return _TABLE.sub(lambda _: table(extension), text)


def main():
    """Renew the table."""
    with studio.extension():
        extension = next(name for name in sys.modules if name.endswith(".meshfree_laplacian"))
        INDEX.write_text(written(INDEX.read_text(encoding="utf-8"), extension), encoding="utf-8")


if __name__ == "__main__":
    main()
