"""A file and a preset that version 0.1.0 wrote, see data/version_0_1_0.py, still mean what they did."""

from importlib import import_module
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender.data.version_0_1_0 import OPEN, OPEN_DEFORM

DATA = Path(__file__).parent / "data"
FILE = DATA / "version_0_1_0.blend"
NEW = {
    "rims": "boundary",
    "rim_group": "boundary_group",
    "rim_count": "boundary_count",
    "part_count": "component_count",
}


@pytest.fixture(autouse=True)
def opened(empty_scene):
    bpy.ops.wm.open_mainfile(filepath=str(FILE))


@pytest.fixture
def module(extension):
    return lambda name: import_module(f"{extension.__name__}.{name}")


@pytest.fixture
def stale_reason(module):
    return module("operators.deform.binding").stale_reason


def get(name):
    return bpy.data.objects[name]


def evaluated(obj):
    """Sum, sum of squares, least and greatest height of where the modifiers put the points of a bound object."""
    for modifier in obj.modifiers:
        modifier.show_viewport = not modifier.name.startswith("Mesh-Free Display")
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", values.reshape(-1))
    values = values.astype(np.float64)
    return values.sum(), (values**2).sum(), values[:, 2].min(), values[:, 2].max()


def test_settings():
    settings = get("Open").meshfree
    for name, value in OPEN.items():
        assert getattr(settings, NEW.get(name, name)) == pytest.approx(value), name
    for name, value in OPEN_DEFORM.items():
        assert getattr(settings.deform, name) == pytest.approx(value), name
    assert (settings.component_count, settings.boundary_count, settings.left_out_count) == (2, 134, 6)
    assert settings.total_area == pytest.approx(9.9197006)
    assert (get("Rims off").meshfree.boundary, get("Rims off").meshfree.boundary_group) == ("OFF", "")
    assert get("Bound Softly").meshfree.boundary_group == "Rim"
    assert get("Default").meshfree.boundary == "AUTO"
    assert get("Film").meshfree.boundary_count == 66


def test_nothing_stays_under_former_names(tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "again.blend"))
    get("Open").meshfree.boundary = "AUTO"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "again.blend"))
    assert get("Open").meshfree.boundary == "OFF"
    for obj in bpy.data.objects:
        assert not [name for name in NEW if obj.meshfree.is_property_set(name)]
        assert "rim" not in obj.meshfree.settings_used + obj.meshfree.deform.settings_used.replace("'Rim'", "")


def test_analyses_are_not_stale(module):
    result = module("operators.objects.result")
    analyzed = {obj.name for obj in bpy.data.objects if obj.type == "MESH" and result.is_analyzed(obj)}
    assert analyzed == {"Open", "Default", "Film"}
    assert not [name for name in analyzed if result.is_stale(get(name))]
    get("Open").meshfree.boundary = "AUTO"
    assert result.is_stale(get("Open"))


def test_what_is_on_show(module):
    display = module("ui.display")
    shown = {
        "Open": ("lb_mean_curvature", (0.25, 0.75)),
        "Default": ("lb_distance", (0.0, 2.761289)),
        "Film": ("lb_boundary", (0.0, 1.0)),
        "Bound Softly": ("lb_displacement", (5.681011e-05, 0.5000334)),
    }
    for name, (attribute, bounds) in shown.items():
        assert display.shown_attribute(get(name)) == attribute
        assert display.shown_range(get(name)) == pytest.approx(bounds)
        assert module("ui.overlay").pictures(get(name), bpy.context.scene) or name == "Open"  # without its legend
    assert bpy.ops.meshfree.colormap.poll()
    bpy.context.view_layer.objects.active = get("Film")
    bpy.ops.meshfree.colormap(color_map="MAGMA")
    assert display.shown_attribute(get("Film")) == "lb_boundary"


def test_the_legend_is_found_and_follows(module):
    legend, obj = module("ui.legend"), get("Open")
    found = legend.find_legend(bpy.context.scene, obj)
    count = len(bpy.data.objects)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.meshfree.colormap(attribute="lb_boundary")
    bodies = {part["meshfree_legend_part"]: part.data.body for part in found.objects if part.type == "FONT"}
    assert bodies == {"title": "Boundary"} | {f"tick {i}": f"0.{3 + i}" for i in range(5)}
    assert len(bpy.data.objects) == count - 1  # without the unit
    bpy.ops.meshfree.legend(show=False)
    assert legend.find_legend(bpy.context.scene, obj) is None


def test_group_colors(module):
    show, groups = module("ui.show"), module("operators.objects.groups")
    default = get("Default")
    colors = show._group_colors(default)
    assert colors["Rim"] == module("ui.colormaps").group_color("Boundary")
    material = module("ui.display").find_material(default)
    kind = material["meshfree_kind"]
    show.recolor(default)
    assert material["meshfree_kind"] == kind  # so that its nodes stay
    assert groups.role_group(default, "Boundary") == "Rim"
    default.vertex_groups.new(name="Boundary")
    assert groups.role_group(default, "Boundary") == "Boundary"
    assert show._group_colors(get("Open"))["Rim"] == colors["Rim"]


def test_assigning_takes_the_group_that_is_there():
    obj = get("Default")
    obj.data.vertices.foreach_set("select", np.arange(600) < 20)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.meshfree.group_from_selection(role="BOUNDARY")
    assert obj.meshfree.boundary_group == "Rim"
    assert "Boundary" not in obj.vertex_groups


def test_bindings_follow(stale_reason):
    bound, softly = get("Bound"), get("Bound Softly")
    assert stale_reason(bound) == stale_reason(softly) == ""
    assert evaluated(bound) == pytest.approx((1452.58449, 3499.70514, -6.80556e-05, 0.788941801), rel=1e-5, abs=1e-4)
    assert evaluated(softly) == pytest.approx((696.352427, 1280.48617, -6.56997e-05, 0.500035703), rel=1e-5, abs=1e-4)
    get("Bound Handle").location.z += 0.2
    bpy.context.view_layer.update()
    # The binding is made anew, with today's operator.
    assert evaluated(bound) == pytest.approx((1504.51002, 3550.70228, 0.0, 0.988941789), rel=5e-3, abs=1e-3)
    softly.meshfree.boundary = "AUTO"
    assert stale_reason(softly) == "Settings changed. Bind again"


def test_baked_frames(stale_reason):
    baked = get("Baked")
    assert stale_reason(baked).startswith("Its animation is baked")
    for frame, highest in ((1, 0.225), (2, 0.45), (3, 0.75)):
        bpy.context.scene.frame_set(frame)
        assert evaluated(baked)[3] == pytest.approx(highest)


@pytest.mark.skipif(not hasattr(bpy.app.handlers, "blend_import_post"), reason="Blender 4.2 does not tell of it")
@pytest.mark.parametrize("link", [False, True], ids=["appended", "linked"])
def test_objects_from_an_old_file(link, module):
    bpy.ops.wm.read_homefile(use_empty=True)
    folder = f"{FILE}/Object/"
    way = bpy.ops.wm.link if link else bpy.ops.wm.append
    way(filepath=f"{folder}Open", directory=folder, filename="Open")
    assert get("Open").meshfree.boundary_group == "Rim"
    assert not module("operators.objects.result").is_stale(get("Open"))


def test_an_old_file_that_is_open_when_the_extension_is_switched_on(extension, module):
    name = extension.__name__
    bpy.ops.preferences.addon_disable(module=name)
    bpy.ops.wm.open_mainfile(filepath=str(FILE))
    bpy.ops.preferences.addon_enable(module=name)
    adopt = module("operators.objects.earlier").adopt
    assert bpy.app.timers.is_registered(adopt)  # timers do not run in background mode
    assert get("Open").meshfree.boundary == "AUTO"
    adopt()
    assert get("Open").meshfree.boundary == "OFF"


def test_a_preset():
    obj = get("Default")
    bpy.context.view_layer.objects.active = obj
    exec((DATA / "preset_0_1_0.py").read_text(), {})
    settings = obj.meshfree
    assert (settings.boundary, settings.bandwidth, settings.neighbors) == ("OFF", "LOCAL", 24)
    assert not settings.is_property_set("rims")


def test_scripts_may_still_give_values_under_former_names():
    settings = get("Imported").meshfree
    settings.rims, settings.rim_group = "OFF", "Edge"
    assert (settings.boundary, settings.boundary_group) == ("OFF", "Edge")
    settings.rims = "AUTO"
    assert settings.boundary == "AUTO"
