"""Reports come in the language of Blender: whole texts are looked up, and values are put in afterwards.

Blender as a Python module has no languages, so that a dictionary stands for them here; tests/gui has one of Blender's.
"""

import importlib

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, sphere_points

GERMAN = {
    '"{name}": {error}': "„{name}“: {error}",
    "{bad} of {count} points have coordinates that are not finite (NaN or infinity). Delete these points.": (
        "Von {count} Punkten haben {bad} keine endlichen Koordinaten. Bitte löschen."
    ),
    "{object}: {area} from {count:,} points, {seconds:.1f} s": "{object}: {count} Punkte, {area}",
    "The mesh has {faces} faces: it is taken as its {count} vertices.": "Nur {count} Punkte, keine {faces} Flächen.",
    '"{object}" has no {kind} named "{name}". Choose another {setting}, or clear it.': (
        "„{object}“ hat keine {kind} „{name}“: {setting} ändern."
    ),
    "vertex group": "Gruppe",
    "Handles": "Griffe",
    "Cloud": "Wolke",  # which is a name here
}


@pytest.fixture
def translated(extension, monkeypatch):
    """Give the function that translates, in German."""
    function = importlib.import_module(f"{extension.__name__}.operators.translation").translated
    monkeypatch.setattr(function, "__defaults__", (lambda text: GERMAN.get(text, text),))
    return function


def reports(capfd):
    """Lines that Blender printed for reports."""
    return capfd.readouterr().out.splitlines()


def test_error_of_core(translated):
    points = sphere_points(200)
    points[3:5] = np.nan
    add_object(points).name = "{count} {"
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.meshfree.analyze()
    assert str(raised.value).strip() == (
        "Error: „{count} {“: Von 200 Punkten haben 2 keine endlichen Koordinaten. Bitte löschen."
    )


def test_words_within(translated):
    obj = add_object(sphere_points(200))
    obj.meshfree.deform.handles = "Cloud"
    with pytest.raises(RuntimeError, match="„Cloud“ hat keine Gruppe „Cloud“: Griffe ändern"):
        bpy.ops.meshfree.deform_bind()


def test_report_and_notice(translated, capfd):
    add_object(sphere_points(1000), faces=[(0, 1, 2)])
    bpy.ops.meshfree.analyze(show=False)
    said = reports(capfd)
    assert "Warning: Nur 1000 Punkte, keine 1 Flächen." in said
    assert any(line.startswith("Info: Cloud: 1000 Punkte, 12.") for line in said)


def test_the_command_line_stays_english(translated, extension):
    done = importlib.import_module(f"{extension.__name__}.operators.application").done
    add_object(sphere_points(1000), faces=[(0, 1, 2)])
    bpy.ops.meshfree.analyze(show=False)
    assert "from 1,000 points" in done.messages[0]
    assert "The mesh has 1 faces: it is taken as its 1000 vertices." in done.notices
