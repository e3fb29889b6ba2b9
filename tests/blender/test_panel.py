"""The panel draws in every state, and dialogs show every setting."""

import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests import splat_files
from tests.blender.armatures import add_armature, choose
from tests.blender.clouds import add_object, attribute, grid_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import NOT_TOOLS, OPERATORS, tools
from tests.blender.splats import add_splats, bar_splats

OTHER_DIALOGS = {"deform_bake"}  # one that asks for more where its object has splats, which it finds out as it opens
PANELS = (  # from top to bottom
    "main",
    "select",
    "display",
    "splats",
    "clean",
    "measure",
    "two_scans",
    "move",
    "deform",
    "rig",
    "make",
    "advanced",
    "spectrum",
    "settings",
    "statistics",
)
TWINS = {"display_properties": "display", "settings_properties": "settings"}  # in the Properties editor


class Layout:
    """Stands in for Blender's layout: checks what it is asked to draw; remembers texts, icons of labels, and buttons.

    Everything that unfolds is open, and the lists of results are drawn after their buttons.
    """

    use_property_split = False

    def __init__(self, texts=None, icons=None, buttons=None, before=None):
        self.texts = [] if texts is None else texts
        self.icons = {} if icons is None else icons
        self.buttons = [] if buttons is None else buttons
        self.before = set() if before is None else before  # names that are drawn before settings

    def row(self, **_):
        within = Layout(self.texts, self.icons, self.buttons, self.before)
        within.use_property_split = self.use_property_split
        return within

    column = box = grid_flow = split = row

    def panel(self, idname, default_closed=False):
        assert default_closed
        return self.row(), self.row()

    def separator(self):
        pass

    def label(self, text="", icon="NONE"):
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        self.texts.append(text)
        self.icons[text] = icon

    def menu(self, idname, text=""):
        menu = getattr(bpy.types, idname)
        self.texts.append(text or menu.bl_label)
        if idname in {"MESHFREE_MT_results", "MESHFREE_MT_modes", "MESHFREE_MT_attributes"}:
            menu.draw(SimpleNamespace(layout=self), bpy.context)

    def context_pointer_set(self, name, data):
        assert name == "object"

    def prop(self, data, path, text=None, toggle=False, slider=False):
        data.path_resolve(path)
        self.texts.append(text or path)
        setting = data.bl_rna.properties.get(path) if hasattr(data, "bl_rna") else None
        if self.use_property_split and setting is not None and setting.type != "BOOLEAN":
            self.before.add(text or setting.name)

    def prop_search(self, data, path, search_data, search_property, results_are_suggestions=False):
        search_data.path_resolve(search_property)
        self.prop(data, path)

    def operator(self, idname, text=None, icon="NONE", icon_value=0, depress=False, emboss=True):
        group, name = idname.split(".")
        kind = getattr(getattr(bpy.ops, group), name).get_rna_type()
        self.texts.append(text if text is not None else kind.name)
        settings = SimpleNamespace(**dict.fromkeys(item.identifier for item in kind.properties))
        self.buttons.append((idname, settings))
        return settings

    def template_popup_confirm(self, idname, text, cancel_text):
        assert idname == text == ""
        self.texts.append(cancel_text)

    def progress(self, text, factor):
        assert 0.0 <= factor <= 1.0
        self.texts.append(text)

    def operator_menu_enum(self, idname, path):
        assert path in self.operator(idname).__dict__


class Narrow:
    """A region of some width, in a context that is Blender's otherwise."""

    def __init__(self, width, kind="UI"):
        view = SimpleNamespace(region_to_view=lambda x, y: (x, y))
        self.region = SimpleNamespace(width=width, type=kind, view2d=view)
        self.preferences = SimpleNamespace(
            system=SimpleNamespace(ui_scale=1.0), ui_styles=bpy.context.preferences.ui_styles
        )

    def __getattr__(self, name):
        return getattr(bpy.context, name)


class Settings(SimpleNamespace):
    """Stands in for an operator whose dialog is drawn: the values of its properties."""

    def path_resolve(self, path):
        return getattr(self, path)


def settings_of(operator, repeated=False, **values):
    """Return what stands in for an operator with these values of its properties, and is of its kind but for Blender."""
    bases = [base for base in operator.__bases__ if not issubclass(base, bpy.types.bpy_struct)]
    own = {name: value for name, value in vars(operator).items() if not name.startswith(("_", "bl_"))}
    kind = type("StandsIn", (Settings, *bases), {**own, "is_repeated": lambda self, context: repeated})
    return kind(**values)


def draw(names=PANELS, icons=None, buttons=None, before=None, context=None):
    """Texts of panels for the active object; icons of labels, buttons and names of settings go where it is given."""
    texts, context = [], bpy.context if context is None else context
    for name in names:
        panel = getattr(bpy.types, f"MESHFREE_PT_{name}")
        if not hasattr(panel, "poll") or panel.poll(bpy.context):
            more = {"draw_more": panel.draw_more} if hasattr(panel, "draw_more") else {}
            stands_in = type(
                "StandsIn", (), {"layout": Layout(texts, icons, buttons, before), "bl_label": panel.bl_label, **more}
            )
            panel.draw(stands_in(), context)
    return texts


def test_the_area_that_can_be_trusted_stands_beside_the_total(capfd):
    obj = add_object(np.random.default_rng(0).uniform(-1.0, 1.0, (1000, 3)))
    bpy.ops.meshfree.analyze()
    areas, doubt = attribute(obj, "lb_area"), attribute(obj, "lb_doubt")
    assert obj.meshfree.trusted_area == pytest.approx(areas[doubt == 0].sum(), rel=1e-5)
    assert obj.meshfree.trusted_area < 0.9 * obj.meshfree.total_area
    texts = draw()
    trusted = texts[texts.index("Trusted Area") + 1]
    assert f"{texts[texts.index('Total Area') + 1]} ({trusted} of it trusted) from" in capfd.readouterr().out
    obj = add_object(sphere_points(), "Sphere")
    bpy.ops.meshfree.analyze()
    for share, told in ((1.0, False), (0.9999, False), (0.99, True)):  # told where it reads otherwise
        obj.meshfree.trusted_area = share * obj.meshfree.total_area
        texts = draw()
        assert "Total Area" in texts
        assert ("Trusted Area" in texts) == told


def test_the_list_of_results_ends_with_other_numbers_of_the_points():
    obj = add_object(sphere_points())
    assert "Attributes" not in draw()
    made = {"classification": "INT", "velocity": "FLOAT_VECTOR", "paint": "FLOAT_COLOR", ".hidden": "FLOAT"}
    for name, kind in made.items():
        obj.data.attributes.new(name, kind, "POINT")
    bpy.ops.meshfree.analyze()
    buttons = []
    texts = draw(buttons=buttons)
    assert texts.index("Attributes") > texts.index("Mean Curvature")
    offered = [settings.attribute for idname, settings in buttons if idname == "meshfree.colormap"]
    assert [name for name in offered if name in made] == ["paint", "classification", "velocity"]  # its own colors first


def test_panel_without_object_says_what_to_do():
    assert "Select a mesh" in " ".join(draw())


def test_panel_in_edit_mode_says_what_works_there():
    add_object(sphere_points())
    bpy.ops.object.mode_set(mode="EDIT")
    texts = draw()
    assert texts[:2] == ["Choose points here, in Edit Mode", "Switch to Object Mode to analyze"]
    assert "Assign to Anchors" in texts
    bpy.ops.object.mode_set(mode="OBJECT")


def test_panel_in_other_modes_says_what_to_do():
    add_object(sphere_points(), faces=[(0, 1, 2)])
    bpy.ops.object.mode_set(mode="SCULPT")
    assert draw()[:2] == ['"Cloud" is not in Object Mode', "Switch to Object Mode first"]
    bpy.ops.object.mode_set(mode="OBJECT")


def test_panel_has_the_groups_of_a_bend_beside_their_settings():
    add_object(sphere_points())
    texts = draw()
    assert texts[texts.index("handles") :][:8] == [
        *("handles", "Assign to Handles", "0", ""),
        *("anchors", "Assign to Anchors", "0", ""),
    ]
    assert "No points assigned yet" not in texts


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "Select a point in Edit Mode first"), (1, "Uses the selected point"), (12, "Uses the 12 selected points")],
)
@pytest.mark.parametrize("name", ["geodesic_distance", "nearest_source", "unwrap", "extend_direction"])
def test_dialogs_say_that_the_selection_is_used(name, count, text):
    obj = add_object(sphere_points())
    obj.data.vertices.foreach_set("select", np.arange(1000) < count)
    assert texts_of(name)[:2] == ["group", text]
    assert (texts_of(name)[-1] == "Close") == (count == 0)  # in place of OK
    obj.vertex_groups.new(name="Source")
    assert texts_of(name)[:1] == ["group"]
    assert text not in texts_of(name)


def texts_of(name):
    """Return what the dialog of an operator holds as it opens."""
    texts, operator = [], getattr(bpy.types, f"MESHFREE_OT_{name}")
    properties = getattr(bpy.ops.meshfree, name).get_rna_type().properties
    values = {item.identifier: item.default for item in properties if hasattr(item, "default")}
    operator.draw(settings_of(operator, layout=Layout(texts), **values), bpy.context)
    return texts


def test_panel_offers_what_tools_wrote(modifiers):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.show_surface()
    assert not {"Shape Index", "Mean Curvature"} & set(draw())
    assert "Choose a Result" in draw()
    bpy.ops.meshfree.principal_curvatures()
    texts = draw()
    assert {"Curvedness", "Curvature 1", "Direction 1"} <= set(texts)
    assert texts.count("Shape Index") == 2  # in the list, and as what is chosen there
    assert "Viewport Points" not in texts
    modifiers.set_input(obj.modifiers[0], "Viewport Points", 500)
    assert "Viewport Points" in draw()


def test_panel_of_a_handle_says_what_to_do():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.deform_bind(at_once=True)
    assert bpy.context.object != obj
    assert draw()[:2] == ['Handle of "Cloud"', "G moves it, R rotates it"]


def test_panel_of_a_new_object():
    add_object(sphere_points())
    texts = draw()
    assert "Cloud: 1,000 points" in texts
    assert "Total Area" not in texts


def test_the_first_button_shows_points_of_other_importers_as_what_they_are(tmp_path, core):
    splat_files.write_ply(tmp_path / "a.ply", splat_files.some_columns(50))
    bpy.ops.wm.ply_import(filepath=str(tmp_path / "a.ply"))
    assert draw()[:2] == ["a: 50 points", "Show as Splats"]
    bpy.ops.meshfree.show_splats()
    assert draw()[:2] == ["a: 50 splats", "Show as Splats"]
    bpy.context.object.select_set(False)
    obj = add_object(sphere_points())
    assert draw()[:2] == ["Cloud: 1,000 points", "Show as Surface"]
    bpy.ops.meshfree.show_surface()
    assert draw()[:2] == ["Cloud: 1,000 points", "Show as Surface"]  # it stays, so that nothing moves
    obj.data.attributes.remove(obj.data.attributes["lb_disc"])
    obj.data.clear_geometry()
    obj.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    assert "Show as Surface" not in draw()  # Blender shows its faces


def test_panel_of_splats_has_what_is_for_them(core):
    add_object(sphere_points())
    assert "Show as Splats" not in draw()
    add_splats(bar_splats(core))
    names = {
        "Show as Splats",
        "Select Floaters",
        "Apply Transform to Splats",
        "Join Splats",
        "Export Splats...",
        "leave_out_floaters",
    }
    assert names <= set(draw())


def test_panel_tells_of_splats_that_blender_joined(tmp_path):
    for number in range(2):
        splat_files.write_ply(tmp_path / "a.ply", splat_files.some_columns(100, seed=number))
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / "a.ply"))
    assert not any("rotated or scaled without" in text for text in draw())
    bpy.context.object.rotation_euler.x = 0.5
    for obj in bpy.data.objects:
        obj.select_set(True)
    bpy.ops.object.join()
    assert any("rotated or scaled without" in text for text in draw())


def test_panel_follows_the_order_of_work():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.spectrum(count=25)
    texts = draw()
    steps = "Analyze Points", "No Notices", "Mode 2", "Compute Modes", "Eigenvalues", "Total Area"
    order = [texts.index(text) for text in steps]
    assert order == sorted(order)
    area = next(text for text in texts if "m²" in text)
    assert float(area.split()[0]) == pytest.approx(4.0 * np.pi, rel=0.01)
    second = next(text for text in texts if text.startswith("2:"))
    assert float(second.split()[1]) == pytest.approx(obj["lb_eigenvalues"][1], rel=3e-4)
    assert "1:  0" in texts
    assert any(text.startswith("and 5 more, up to") for text in texts)
    assert not any("analyze again" in text for text in texts)


def test_panel_counts_the_points_of_each_group():
    obj = add_object(sphere_points())
    assert draw().count("0") == 8
    obj.data.vertices.foreach_set("select", np.arange(1000) < 12)
    bpy.ops.meshfree.group_from_selection(role="ANCHOR")
    texts = draw()
    assert texts[texts.index("Assign to Anchors") + 1] == "12"
    bpy.ops.meshfree.group_from_selection(role="ANCHOR", action="REMOVE")
    texts = draw()
    assert texts[texts.index("Assign to Anchors") + 1] == "0"


def test_panel_marks_stale_results():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    obj.data.vertices[0].co.x += 0.001
    icons = {}
    assert "Results are stale: press Analyze Points again" in draw(icons=icons)
    assert icons["1 Notice"] == "ERROR"
    bpy.ops.meshfree.analyze()
    assert "No Notices" in draw()


def test_panel_names_scale_modifiers_and_sharing():
    obj = add_object(sphere_points(), faces=[(0, 1, 2)])
    obj.scale = (1.0, 2.0, 1.0)
    obj.modifiers.new("Smooth", "SMOOTH")
    bpy.context.scene.collection.objects.link(obj.copy())
    bpy.context.view_layer.update()
    icons = {}
    texts = " ".join(draw(icons=icons))
    for text in (
        "are those in the scene, where the object is scaled by 1 x 2 x 1",
        "Modifiers are left out: 1. Use Modifiers, under Settings",
        "Other objects share its points. Make Single User, under Settings",
    ):
        assert text in texts
    assert icons["3 Notices"] == "INFO"  # there is nothing to do


def test_panel_tells_of_parts_boundaries_and_points_left_out_where_there_are_any():
    points, outermost = grid_points()
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    assert not {"Components", "Boundary Points", "Points Left Out"} & set(draw())
    obj = add_object(np.vstack([points, sphere_points() + (20.0, 0.0, 0.0), [[0.0, 0.0, 50.0]]]))
    bpy.ops.meshfree.analyze()
    assert (obj.meshfree.component_count, obj.meshfree.boundary_count, obj.meshfree.left_out_count) == (
        2,
        outermost.sum(),
        1,
    )
    texts = draw()
    found = {name: texts[texts.index(name) + 1] for name in ("Components", "Boundary Points", "Points Left Out")}
    assert found == {"Components": "2", "Boundary Points": f"{outermost.sum()}", "Points Left Out": "1"}


@pytest.mark.parametrize("method", ["DEFAULT", "PAPER"])
def test_panel_shows_every_setting_that_changes_results(options, method):
    settings = add_object(sphere_points()).meshfree
    settings.laplacian, settings.boundary_group = method, "Missing"
    texts, own = draw(), options.settings_values(settings)
    drawn = (*own, "point_budget", "most_points")
    assert [name for name in drawn if texts.count(name) != 1] == []
    assert texts.count("boundary_group") == (method == "DEFAULT")
    assert [name for name in options.NAMES if name in texts and name not in own] == []


@pytest.mark.parametrize(
    "name", ["lb_normal", "lb_area", "lb_boundary", "lb_component", "lb_eigenvector_001", "lb_eigenvector_003"]
)
def test_panel_for_each_kind_of_display(name):
    add_object(sphere_points())
    bpy.ops.meshfree.spectrum(count=3)
    bpy.ops.meshfree.colormap(attribute=name)
    texts = draw()
    assert "point_size" in texts
    assert ("color_map" in texts) == (name != "lb_normal")
    assert ("range_low" in texts) == (name not in {"lb_normal", "lb_boundary", "lb_component"})


def test_every_operator_of_the_source_is_a_tool_but_for_some():
    assert sorted(dir(bpy.ops.meshfree)) == OPERATORS
    assert sorted(tools()) == sorted(set(OPERATORS) - NOT_TOOLS.keys())


def test_no_two_tools_have_the_same_row():
    rows = [(kind, getattr(tool, kind)) for tool in tools().values() for kind in ("panel", "menu", "quick")]
    places = [(kind, *row[:3]) for kind, row in rows if row]
    assert len(places) > 60
    assert len(set(places)) == len(places)


def test_no_label_is_cut_off_at_the_default_width(core):
    """That of the sidebar is 291 pixels; of a panel in it 235 are for a row, two fifths of these for names."""
    measure, before, texts = part("ui.wrapping")._measure(Narrow(291)), set(), set()
    for obj in (add_object(sphere_points()), add_splats(bar_splats(core))):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.meshfree.spectrum(count=3)
        bpy.ops.meshfree.principal_curvatures(display="DIRECTION")
        for name in ("lb_direction_1", "lb_area"):
            bpy.ops.meshfree.colormap(attribute=name)
            texts |= set(draw(before=before, context=Narrow(291)))
    assert len(before) > 10
    assert [name for name in before if measure(name) > 0.4 * 233] == []
    assert [text for text in texts if measure(text) > 225] == []
    quick = [tool.quick.text for tool in tools().values() if tool.quick and tool.quick.home == "Object"]
    assert [text for text in quick if measure(text) > 105] == []


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_no_button_stands_twice_in_the_tab(core, mode):
    """But for results, which the list has beside arrows and eigenvalues."""
    for obj in (add_object(sphere_points()), add_splats(bar_splats(core))):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.meshfree.spectrum(count=3)
        bpy.ops.meshfree.stray_points()
        bpy.ops.object.mode_set(mode=mode)
        buttons = []
        draw(buttons=buttons)
        bpy.ops.object.mode_set(mode="OBJECT")
        keys = [(name, repr(settings)) for name, settings in buttons if name != "meshfree.colormap"]
        assert len(keys) > (40 if mode == "OBJECT" else 20)
        assert [key for key in set(keys) if keys.count(key) > 1] == []


def test_panels_draw_every_tool_that_has_a_row(core):
    add_splats(bar_splats(core))
    texts, obj = set(draw()), add_object(sphere_points())
    bpy.ops.meshfree.deform_bind(at_once=True)
    bpy.context.view_layer.objects.active = obj
    texts |= set(draw())
    bpy.ops.meshfree.deform_bake(first=1, last=2)
    texts |= set(draw())
    bpy.ops.object.mode_set(mode="EDIT")
    texts |= set(draw())
    bpy.ops.object.mode_set(mode="OBJECT")
    rows = {name: tool.panel.text or tool.operator.bl_label for name, tool in tools().items() if tool.panel}
    assert len(rows) > 25
    assert [name for name, text in rows.items() if not {text, f"{text}..."} & texts] == []


def test_panels_of_an_armature_show_the_selected_points_and_their_notices():
    obj = add_object(sphere_points())
    part("operators.objects.notices").keep(obj, "Tool", "a notice")
    armature = add_armature({"Bone": ((0, 0, -0.5), (0, 0, 0.5))})
    choose(armature)
    assert "Select points, too" in " ".join(draw())
    choose(armature, obj)
    texts = " ".join(draw())
    for expected in ("Cloud: 1,000 points", "a notice", "Bones of Rig", "Automatic Weights..."):
        assert expected in texts
    choose(obj, obj, armature)
    assert "Bones of Rig" in " ".join(draw())


def test_all_panels_are_known_to_these_tests():
    panels = [name for name in dir(bpy.types) if name.startswith("MESHFREE_PT_")]
    assert sorted(panels) == sorted(f"MESHFREE_PT_{name}" for name in (*PANELS, *TWINS))


def test_dialogs_show_every_setting():
    add_object(sphere_points())
    dialogs = [name for name, tool in tools().items() if getattr(tool.operator, "asks", ())]
    assert len(dialogs) > 18
    for name in set(dialogs) - OTHER_DIALOGS:
        check_dialog(name)


def check_dialog(name):
    operator = getattr(bpy.types, f"MESHFREE_OT_{name}")
    properties = [item for item in getattr(bpy.ops.meshfree, name).get_rna_type().properties if not item.is_hidden]
    properties = [item for item in properties if item.type != "POINTER" and item.identifier != "filepath"]
    values = {item.identifier: item.default for item in properties}
    hidden = {"chosen": lambda: [Path("a.las"), Path("b.txt")]} if name == "import_points" else {}
    choices = [item for item in properties if item.type == "ENUM"]
    variants = [{item.identifier: choice} for item in choices for choice in item.enum_items.keys()]
    texts = []
    for variant in [{}, *variants, *({item.identifier: True} for item in properties if item.type == "BOOLEAN")]:
        settings = settings_of(operator, layout=Layout(texts), at_zero={}, **values | variant | hidden)
        if not settings.asks:
            return
        operator.draw(settings, bpy.context)
    assert {text for text in texts if " " not in text} == set(values), name


@pytest.mark.parametrize("name", OPERATORS)
def test_adjust_last_operation_offers_what_is_quick(name):
    operator = getattr(bpy.types, f"MESHFREE_OT_{name}")
    if not hasattr(operator, "adjustable"):
        return
    properties = getattr(bpy.ops.meshfree, name).get_rna_type().properties
    values = {item.identifier: item.default for item in properties if item.type != "POINTER"}
    for variant in ({}, {"keep": "AREA"}, {"source": "x"}):
        given = {key: value for key, value in variant.items() if key in values}
        given |= {"layout": Layout(), "at_zero": {}, "wanted": 10}  # modes of an analysis
        settings = settings_of(operator, True, **values | given)
        quick, texts = settings.adjustable, settings.layout.texts
        operator.draw(settings, bpy.context)
        assert texts == list(quick)
        assert not {"method", "modes", "parts", "wavelength", "handles", "tolerance"} & set(quick)


def test_panel_while_something_runs(monkeypatch):
    add_object(sphere_points())
    notices = part("ui.notices")
    job = SimpleNamespace(label="Smooth Points", fraction=0.25, progress="25%, 20 s left")
    monkeypatch.setattr(notices, "running", lambda: job)
    texts = draw()
    assert "Smooth Points: 25%, 20 s left" in texts
    assert "No Notices" not in texts  # that line is where the progress is, so that nothing moves


@pytest.mark.parametrize(
    ("spent", "fraction", "text"),
    [
        (1.0, 0.5, ""),
        (20.0, 0.01, ""),
        (5.0, 0.5, "some seconds left"),
        (5.0, 0.2, "20 s left"),
        (60.0, 0.4, "90 s left"),
        (60.0, 0.2, "4 min left"),
    ],
)
def test_how_long_the_rest_takes(spent, fraction, text):
    assert part("operators.running.job").left_text(spent, fraction) == text


@pytest.mark.parametrize(("method", "kind"), [("DEFAULT", "LaplacianOptions"), ("PAPER", "PaperOptions")])
def test_every_option_of_core_is_a_setting_with_its_default(options, core, method, kind):
    settings, kind = add_object(sphere_points()).meshfree, getattr(core, kind)
    settings.laplacian = method
    assert options.laplacian_options(settings) == kind()
    for name in set(options.settings_values(settings)) - {"laplacian"}:
        prop = settings.bl_rna.properties[name]
        for choice in prop.enum_items if prop.type == "ENUM" else ():
            kind(**{name: choice.identifier.lower()})


def test_tab():
    for name in PANELS:
        assert getattr(bpy.types, f"MESHFREE_PT_{name}").bl_category == "Mesh-Free"


@pytest.mark.parametrize("name", TWINS)
def test_the_properties_editor_has_the_same(name):
    twin, panel = (getattr(bpy.types, f"MESHFREE_PT_{each}") for each in (name, TWINS[name]))
    assert (twin.bl_space_type, twin.bl_region_type, twin.bl_context) == ("PROPERTIES", "WINDOW", "object")
    assert not twin.poll(SimpleNamespace(object=None))
    add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    texts = {}
    for kind in (twin, panel):
        assert kind.poll(bpy.context)
        kind.draw(SimpleNamespace(layout=Layout(texts.setdefault(kind, []))), bpy.context)
    assert texts[twin] == texts[panel] != []


@pytest.mark.parametrize(("name", "count"), [("analyze", {"modes": 10}), ("spectrum", {"count": 10})])
def test_how_many_modes_to_write_is_asked_only_where_not_all_are(name, count):
    (setting,) = count
    kind = getattr(bpy.types, f"MESHFREE_OT_{name}")
    for wanted, offered in ((10, ("show",)), (50, ("show",)), (51, ("write_limit", "show"))):
        assert kind.adjustable.fget(SimpleNamespace(wanted=wanted, **{setting: wanted})) == offered


def test_the_detail_of_a_mesh_can_be_adjusted():
    kind = bpy.types.MESHFREE_OT_mesh_surface
    tool = part("tools.mesh_surface").TOOL
    assert kind.adjustable.fget(SimpleNamespace(tool=tool, last=kind.last)) == ("detail", "keep_open")


def open_settings():
    """Numbers of operators that a 0 leaves open, by what their tooltips say: names of operator and setting."""
    for name in OPERATORS:
        for item in getattr(bpy.ops.meshfree, name).get_rna_type().properties:
            if re.search(r"; 0 (for|shows)(?! none| both)", item.description):
                yield name, item.identifier


def test_zero_that_leaves_a_setting_open_is_put_into_words():
    found = dict(open_settings())
    assert len(found) >= 7
    add_object(sphere_points())
    for name, setting in found.items():
        operator = getattr(bpy.types, f"MESHFREE_OT_{name}")
        words = operator.at_zero[setting]
        properties = getattr(bpy.ops.meshfree, name).get_rna_type().properties
        values = {item.identifier: item.default for item in properties if item.type != "POINTER"}
        for value, said in ((0, True), (3, False)):
            settings = settings_of(operator, layout=Layout(), **values | {setting: value})
            operator.draw(settings, bpy.context)
            assert (words in settings.layout.texts) == (said and setting in settings.asks), name


@pytest.mark.parametrize("value", [1234.5678, 12.345678, 0.0123456])
def test_figures_have_the_digits_that_scans_bear(result, value):
    for text in (result.area_text(value), result.length_text(value)):
        digits = text.split()[0].replace(".", "").replace(",", "").lstrip("0")
        assert len(digits) <= 4, text


def test_panel_and_report_round_alike(capfd):
    add_object(np.sqrt(1.23456) * sphere_points())
    bpy.ops.meshfree.analyze()
    texts = draw()
    assert f"{texts[texts.index('Total Area') + 1]} from" in capfd.readouterr().out
