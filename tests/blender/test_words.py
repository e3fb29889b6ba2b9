"""A walk over all that a user meets: labels in Title Case, tooltips, bounds, units and undo."""

import re

import bpy
import pytest

from tests.blender.test_manual import operators
from tools.quantities import QUANTITIES

# Words that stay small within a label, and names that are not written as others are.
SMALL = {"a", "and", "as", "at", "by", "for", "from", "in", "of", "on", "or", "the", "to", "with"}
# These change nothing in the scene.
NO_UNDO = {
    "copy_measures",
    "export_eigenvalues",
    "export_measures",
    "export_operator",
    "export_points",
    "export_profile",
    "export_splats",
    "measure_live",
    "stop",
}
UNLOGGED = {"stop"}  # nothing to repeat
# A button beside its menu, as with all presets of Blender.
HIDDEN = {"add_preset"}
# Numbers that may have any sign and size: values given by the user, the matrix of an object and its eigenvalues.
ANY_SIZE = re.compile(r"\.(low|high|range_low|range_high|metric|matrix|rest)$")
# Lengths, areas and angles by their name, which Blender shows with a unit.
WITH_UNIT = re.compile(r"distance|radius|amplitude|wavelength|phase|area$|angle|spacing", re.IGNORECASE)
OF_BLENDER = {"rna_type"}
# Beyond these a number has no bound worth the name.
LARGEST = {"INT": 2**31 - 1, "FLOAT": 3.4e38}


def groups():
    names = [name for name in dir(bpy.types) if name.startswith("MESHFREE_PG_")]
    found = {cls.__name__: cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__[:9] == "MESHFREE_"}
    return {name: cls.bl_rna for name, cls in found.items() if cls.is_registered} | {
        name: getattr(bpy.types, name).bl_rna for name in names
    }


def panels():
    names = [name for name in dir(bpy.types) if re.match("MESHFREE_(PT|UL|MT|FH)_", name)]
    return {name: getattr(bpy.types, name) for name in names}


def properties():
    """All settings by the names of their owners, those of Blender's own base classes left out."""
    for owners in (operators(), groups()):
        for owner, kind in owners.items():
            for item in kind.properties:
                if item.identifier not in OF_BLENDER and not (
                    owner.startswith("MESHFREE_PG") and item.identifier == "name"
                ):
                    yield f"{owner}.{item.identifier}", item


def numbers():
    return [(path, item) for path, item in properties() if item.type in {"INT", "FLOAT"}]


def title(label):
    """Whether a label is in Title Case: all words begin with a capital but small ones within it."""
    words = re.sub(r"\([^)]*\)|\.\.\.$", "", label).split()
    return (
        bool(words)
        and words[0][0] not in "abcdefghijklmnopqrstuvwxyz"
        and all(not word[0].islower() or word in SMALL for word in words)
    )


def tooltip(text):
    return bool(re.match(r"[A-Z0-9]", text)) and not text.endswith((".", "!", " ")) and "  " not in text


def test_the_walk_meets_everything(extension):
    assert len(operators()) > 20
    assert {"MESHFREE_PG_settings", "MESHFREE_PG_stage"} <= groups().keys()
    assert len(panels()) > 10
    assert len(list(properties())) > 100


def test_labels_are_in_title_case():
    labels = {name: kind.name for name, kind in operators().items()}
    labels.update((name, panel.bl_label) for name, panel in panels().items())
    labels.update((path, item.name) for path, item in properties())
    labels.update((row.attribute, row.label) for row in QUANTITIES)
    choices = [(path, item) for path, item in properties() if item.type == "ENUM"]
    labels.update((f"{path}.{choice.identifier}", choice.name) for path, item in choices for choice in item.enum_items)
    assert [(path, label) for path, label in labels.items() if not title(label)] == []


def test_everything_has_a_tooltip():
    tips = {name: kind.description for name, kind in operators().items()}
    tips.update((name, panel.__doc__ or "") for name, panel in panels().items())
    tips.update((path, item.description) for path, item in properties())
    tips.update((row.attribute, row.tooltip) for row in QUANTITIES)
    choices = [(path, item) for path, item in properties() if item.type == "ENUM"]
    tips.update(
        (f"{path}.{choice.identifier}", choice.description) for path, item in choices for choice in item.enum_items
    )
    assert [(path, tip) for path, tip in tips.items() if not tooltip(tip)] == []


def test_labels_and_tooltips_differ():
    assert [path for path, item in properties() if item.name.lower() == item.description.lower()] == []


def test_numbers_have_bounds():
    """One that cannot be negative says so; one that may be anything is named above, or is an angle or a place."""
    wrong = [
        path
        for path, item in numbers()
        if item.subtype not in {"ANGLE", "XYZ", "DIRECTION", "TRANSLATION", "MATRIX", "EULER", "COLOR", "COLOR_GAMMA"}
        and not ANY_SIZE.search(path)
        and not item.soft_min > -LARGEST[item.type]
    ]
    assert wrong == []


def test_defaults_are_within_their_bounds():
    for path, item in numbers():
        values = list(item.default_array) if item.is_array else [item.default]
        assert all(item.hard_min <= value <= item.hard_max for value in values), path
        assert item.hard_min <= item.soft_min < item.soft_max <= item.hard_max, path


def test_sliders_of_counts_end_somewhere():
    """What is dragged in the panel must not run to two thousand million; counts of points may."""
    found = [path for path, item in numbers() if item.type == "INT" and item.soft_max == LARGEST["INT"]]
    assert [path for path in found if not path.endswith("_count")] == []


def test_lengths_areas_and_angles_have_units():
    wrong = [
        path
        for path, item in numbers()
        if item.type == "FLOAT" and WITH_UNIT.search(path.rsplit(".")[-1]) and item.unit == "NONE"
    ]
    assert wrong == []


@pytest.mark.parametrize("name", sorted(NO_UNDO - UNLOGGED | {"analyze", "smooth", "colormap", "import_points"}))
def test_undo_by_kind(name):
    options = getattr(bpy.types, f"MESHFREE_OT_{name}").bl_options
    assert ("UNDO" in options) == (name not in NO_UNDO)


def test_every_operator_can_be_found_undone_and_repeated():
    for name in operators():
        cls = getattr(bpy.types, f"MESHFREE_OT_{name}")
        assert cls.bl_idname == f"meshfree.{name}"  # as the Info log shows it
        options = getattr(cls, "bl_options", set())
        assert ("INTERNAL" in options) == (name in HIDDEN), name  # F3 finds all others
        assert "REGISTER" in options or name in UNLOGGED, name
        assert "UNDO" in options or name in NO_UNDO | HIDDEN, name


def test_buttons_that_are_gray_say_why():
    """Without any object every operator that needs one refuses with a sentence that tells what to do."""
    messages = {}
    for name in operators():
        operator = getattr(bpy.ops.meshfree, name)
        if operator.poll():
            continue
        with pytest.raises(RuntimeError) as refused:
            operator()
        messages[name] = str(refused.value).strip().partition("poll() ")[2]
    assert len(messages) > 15
    assert {
        name: text for name, text in messages.items() if len(text.split()) < 3 or "context is incorrect" in text
    } == {}


def test_scripts_call_operators_by_their_ids():
    """What the Info log says of them is tested in a window: without one Blender keeps none."""
    for name in operators():
        assert repr(getattr(bpy.ops.meshfree, name)).startswith(f"bpy.ops.meshfree.{name}(")
