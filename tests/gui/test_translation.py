"""A translator's dictionary, registered with Blender, reaches errors of operators and why buttons are gray."""

import pytest

SPEAK_FRENCH = """
translations, view = bpy.app.translations, bpy.context.preferences.view
translations.register(
    "meshfree_test",
    {
        "fr_FR": {
            ("*", "{bad} of {count} points have coordinates that are not finite (NaN or infinity). Delete these"
                " points."): "{bad} points sur {count} ne sont pas finis.",
            ("*", '"{object}" has no {kind}. Add points, or select another object'): "« {object} » : pas de {kind}",
            ("*", "vertices"): "sommets",
        }
    },
)
view.language = "fr_FR"
view.use_translate_reports = view.use_translate_tooltips = True
"""
SPEAK_ENGLISH = """
view.language = "en_US"
translations.unregister("meshfree_test")
"""
RUN = """
try:
    bpy.ops.meshfree.analyze(show=False)
    said = ""
except RuntimeError as error:
    said = str(error)
said
"""


@pytest.fixture
def french(gui):
    """Give the window, which speaks French until the test ends."""
    gui.python(SPEAK_FRENCH)
    yield gui
    gui.python(SPEAK_ENGLISH)


def test_error_of_core(french):
    french.python("points = sphere_points(200)\npoints[3:5] = np.nan\nadd_object(points)")
    assert french.python(RUN).strip().endswith("2 points sur 200 ne sont pas finis.")


def test_why_a_button_is_gray(french):
    french.python("add_object(np.empty((0, 3)), '{kind}')")
    assert "« {kind} » : pas de sommets" in french.python(RUN)
