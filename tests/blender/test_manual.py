"""The manual says what the code does: each operator, each setting with its default, examples that run."""

import math
import re
from pathlib import Path

import bpy
import pytest

import manual_index

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(DOCS.glob("operators/*.md"))
ROW = re.compile(r"^\| \*(?P<label>.+?)\* \| `(?P<name>\w+)` \| (?P<default>.*?) \| (?P<meaning>.*) \|$", re.MULTILINE)
UNITS = {"PERCENTAGE": " %", "DISTANCE": " m", "ANGLE": "°"}
# Of the object's settings: what no panel draws, and results, which the page of the analysis tells.
KEPT = {
    "name",
    "notices",
    "own_material",
    "compared_with",
    "compared_within",
    "motion_file",
    "motion_first",
    "motion_step",
    "profile",
    "spacing",
    "spacing_of",
    "discs_of",
    "shown_before",
    "slopes_of",
    "slopes_later",
    "colors_behind",
    "deform",
    "stages",
    "parts",
    "part_attribute",
    "parts_of",
    "fingerprint",
    "metric",
    "settings_used",
}
RESULTS = {"total_area", "trusted_area", "point_count", "subset_count"}
RESULTS |= {"component_count", "boundary_count", "left_out_count"}
BINDING = {"name", "is_bound", "matrix", "handle_items", "binding_id", "point_count", "fingerprint"}
BINDING |= {"groups_used", "settings_used", "kind", "armature", "bone_items"}


def read(path):
    return path.read_text(encoding="utf-8")


def operators():
    return {name: getattr(bpy.ops.meshfree, name).get_rna_type() for name in dir(bpy.ops.meshfree)}


def sections(text):
    """Text below the headings that name an operator, by its name."""
    parts = re.split(r"^#+ .*?`meshfree\.(\w+)`.*$", text, flags=re.MULTILINE)
    found = {}
    for name, section in zip(parts[1::2], parts[2::2], strict=True):
        found[name] = found.get(name, "") + section
    return found


def page_of():
    """Section about each operator, with the page that it is on."""
    found = {}
    for path in PAGES:
        found |= {name: (path, section) for name, section in sections(read(path)).items()}
    return found


def default(item):
    """Write the default of a setting as the manual does."""
    if item.type == "ENUM":
        return f"*{item.enum_items[item.default].name}*"
    if item.type == "BOOLEAN":
        return "on" if item.default else "off"
    if item.type == "STRING":
        return f"`{item.default}`" if item.default else "empty"
    values = item.default_array if item.is_array else [item.default]
    if item.subtype == "ANGLE":
        values = [math.degrees(value) for value in values]
    return ", ".join(f"{value:g}" for value in values) + UNITS.get(item.subtype, "")


def check_rows(items, text, path):
    """Compare settings with the rows of a table: label, default, and all choices by name and as scripts give them."""
    rows = {row["name"]: row for row in ROW.finditer(text)}
    for item in items:
        row = rows.get(item.identifier)
        assert row, f"{path.name} has no row for {item.name} `{item.identifier}`"
        assert (row["label"], row["default"]) == (item.name, default(item)), f"{path.name}: {item.identifier}"
        if item.type != "ENUM":
            continue
        told = row["meaning"] + "".join(
            read((path.parent / link).resolve()) for link in re.findall(r"\]\(([\w./]+\.md)", row["meaning"])
        )
        for choice in item.enum_items:
            assert f"*{choice.name}*" in told or f"`{choice.identifier}`" in told, f"{path.name}: {choice.name}"


def visible(properties):
    return [item for item in properties if not item.is_hidden and item.identifier != "rna_type"]


def test_operators():
    """There is a section about each operator, with all its settings, and about nothing else."""
    described = page_of()
    assert sorted(described) == sorted(operators())
    for name, rna in operators().items():
        path, section = described[name]
        check_rows(visible(rna.properties), section, path)
        assert f"`meshfree.{name}`" in read(path)


def test_the_index_is_that_of_the_registered_tools(extension):
    index = read(manual_index.INDEX)
    assert "`meshfree.analyze`" in index
    assert manual_index.written(index, extension.__name__) == index  # else run scripts/in_blender.py manual_index.py


def test_no_other_settings():
    """Tables of the pages hold settings that exist, each with its own name."""
    deform = set(settings_group("deform").keys())
    for path in PAGES:
        known = {item.identifier for name in sections(read(path)) for item in operators()[name].properties} | deform
        assert {row["name"] for row in ROW.finditer(read(path))} <= known, path.name


def settings_group(name=""):
    """Properties of the settings of an object, or of its deformation."""
    group = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
    return group[name].fixed_type.properties if name else group


def test_settings():
    """The pages about settings, colors and deformation hold all that the panels draw."""
    shown = [item for item in visible(settings_group()) if item.identifier not in KEPT | RESULTS]
    pages = DOCS / "settings.md", DOCS / "colors.md"
    told = "\n".join(map(read, pages))
    check_rows(shown, told, pages[0])
    assert {row["name"] for row in ROW.finditer(told)} == {item.identifier for item in shown}
    page = DOCS / "operators" / "deform.md"
    drawn = [item for item in settings_group("deform") if item.identifier not in BINDING | {"rna_type"}]
    check_rows(drawn, read(page) + read(DOCS / "operators" / "bind_armature.md"), page)
    results = read(DOCS / "operators" / "analyze.md")
    for name in RESULTS:
        assert f"`{name}`" in results


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_page(path):
    """Each page has a picture, an equation or what it does, limits, and an example in Python."""
    text = read(path)
    assert re.search(r"!\[.+\]\(\.\./pictures/\w+\.png\)", text)
    assert "**How.**" in text
    assert "## Limits" in text
    assert "```python" in text
