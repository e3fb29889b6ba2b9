"""What all operators that apply the Laplacian have in common: safe on bad input, one undo step, several objects."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, attribute, everything, grid_points, local_points
from tests.blender.operators import refused
from tests.blender.test_bad_input import CLOUDS
from tests.blender.test_smooth import rough_sphere, shown_points

SETTINGS = {
    "show_surface": {},
    "mesh_surface": {},
    "principal_curvatures": {},
    "roughness": {},
    "orient_normals": {},
    "smooth": {},
    "mode_shape": {},
    "segment": {"parts": 3, "vertex_groups": True},
    "separate_by_segment": {},
    "signature": {"modes": 12, "count": 3},
    "harmonic_field": {},
    "geodesic_distance": {},
    "nearest_source": {},
    "unwrap": {},
    "extend_direction": {"direction": (1.0, 0.0, 0.0)},
    "deform_bind": {},
    "minimal_surface": {"steps": 3},
}
SELECTING = {
    "select_grow": {"distance": 0.5},
    "select_component": {},
    "select_front": {"direction": (0.0, 0.0, -1.0)},
    "group_from_selection": {"role": "HANDLE", "action": "ADD"},
}


def run(name, *arguments, **settings):
    return getattr(bpy.ops.meshfree, name)(*arguments, **settings)


def add_ready(points, name="Cloud"):
    """Add a selected object with all groups and parts that the operators take."""
    obj = add_object(points, name)
    obj.select_set(True)
    x = points[:, 0]
    for group, members in (
        ("Handle", x > np.nanquantile(x, 0.95)),
        ("Anchor", x < np.nanquantile(x, 0.05)),
        ("Value", np.arange(len(points)) % 50 == 0),
        ("Source", np.arange(len(points)) < 3),
    ):
        add_group(obj, group, members)
    labels = obj.data.attributes.new("lb_segment", "INT", "POINT")
    labels.data.foreach_set("value", (np.nan_to_num(x) > 0.0).astype(np.int32))
    obj.data.vertices.foreach_set("select", np.arange(len(points)) < 20)
    return obj


def wave():
    """Points of a rectangle with a boundary, bent a little, about the origin."""
    points, _ = grid_points(28, 21)
    points = points - points.mean(axis=0)
    points[:, 2] = 0.1 * np.sin(2.0 * points[:, 0])
    return points


@pytest.mark.parametrize("name", [name for name in SETTINGS if name != "separate_by_segment"])
@pytest.mark.parametrize(("cloud", "text"), CLOUDS.values(), ids=CLOUDS.keys())
def test_points_without_an_answer(name, cloud, text):
    obj = add_ready(cloud(rough_sphere(1000)))
    with refused(obj, '(?s)Error: .*"Cloud"'):
        run(name, **SETTINGS[name])


@pytest.mark.parametrize("name", SETTINGS)
def test_one_undo_step(name):
    obj = add_ready(wave())
    before = everything(obj)
    bpy.ops.ed.undo_push(message="Before")
    assert run(name, "EXEC_DEFAULT", True, **SETTINGS[name]) == {"FINISHED"}
    after = everything(bpy.data.objects["Cloud"])
    assert after != before
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Cloud"]) == before
    bpy.ops.ed.redo()
    assert everything(bpy.data.objects["Cloud"]) == after


def state():
    """Read which vertices are selected, what the groups hold, and the mode."""
    obj = bpy.context.object
    obj.update_from_editmode()
    chosen = np.empty(len(obj.data.vertices), dtype=bool)
    obj.data.vertices.foreach_get("select", chosen)
    held = [[item.group for item in vertex.groups] for vertex in obj.data.vertices]
    return chosen.tolist(), held, obj.vertex_groups.keys(), obj.mode


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("name", SELECTING)
def test_one_undo_step_of_selecting(name, mode):
    add_ready(rough_sphere())
    bpy.ops.object.mode_set(mode=mode)
    bpy.ops.ed.undo_push(message="Before")
    before = state()
    assert run(name, "EXEC_DEFAULT", True, **SELECTING[name]) == {"FINISHED"}
    after = state()
    assert after != before
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert state() == after
    bpy.ops.object.mode_set(mode="OBJECT")


def test_an_error_names_its_object():
    good, bad = add_ready(rough_sphere(), "Good"), add_ready(rough_sphere(6), "Bad")
    bpy.context.view_layer.objects.active = good
    before = everything(good), everything(bad)
    with pytest.raises(RuntimeError, match='"Bad": .*there are 6'):
        bpy.ops.meshfree.segment()
    assert (everything(good), everything(bad)) == before


def test_meshes_that_are_left_out_are_named_and_others_are_not(capfd):
    obj = add_ready(rough_sphere())
    add_object(np.empty((0, 3)), "Hollow").select_set(True)
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.select_set(True)
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.meshfree.smooth() == {"FINISHED"}
    shown = capfd.readouterr().out
    assert 'Left out: "Hollow" has no vertices' in shown
    assert '"Empty"' not in shown


def test_results_are_shown_on_every_object(display):
    objects = [add_ready(rough_sphere(), name) for name in "AB"]
    bpy.ops.meshfree.geodesic_distance()
    assert [display.shown_attribute(obj) for obj in objects] == ["lb_distance"] * 2
    assert bpy.context.object == objects[1]


def linked_duplicate(obj, name):
    other = obj.copy()
    other.name = name
    bpy.context.scene.collection.objects.link(other)
    other.select_set(True)
    return other


def test_a_mesh_in_two_scales_holds_one_result_only():
    obj = add_ready(rough_sphere())
    other = linked_duplicate(obj, "Other")
    assert bpy.ops.meshfree.geodesic_distance(show=False) == {"FINISHED"}
    other.scale = (1.0, 1.0, 2.0)
    with refused(obj, "shares its mesh with.*Make Single User"):
        bpy.ops.meshfree.geodesic_distance()
    obj.meshfree.make_single_user = True
    assert bpy.ops.meshfree.geodesic_distance() == {"FINISHED"}
    assert obj.data != other.data
    assert attribute(other, "lb_distance").max() > 1.2 * attribute(obj, "lb_distance").max()


@pytest.mark.parametrize("single", [("A",), ("B",), ("A", "B")])
def test_objects_that_get_a_mesh_of_their_own_are_worked_on_once_each(single):
    obj = add_ready(rough_sphere(), "A")
    linked_duplicate(obj, "B")
    before = local_points(obj)
    for name in single:
        bpy.data.objects[name].meshfree.make_single_user = True
    bpy.ops.meshfree.mode_shape(amplitude=0.1, target="IN_PLACE")
    for name in "AB":
        moved = np.linalg.norm(local_points(bpy.data.objects[name]) - before, axis=1)
        assert moved.max() == pytest.approx(0.1, rel=1e-4)
    assert len({bpy.data.objects[name].data for name in "AB"}) == 2


class TestShapeKeys:
    """What the points do beside the keys that there are, seen or not."""

    @pytest.fixture
    def obj(self):
        obj = add_ready(rough_sphere())
        points = local_points(obj)
        obj.shape_key_add(name="Basis")
        for name, value, mute, group in (
            ("Half", 0.5, False, ""),
            ("Mute", 1.0, True, ""),
            ("Part", 0.7, False, "Handle"),
        ):
            key = obj.shape_key_add(name=name)
            key.points.foreach_set("co", (1.3 * points).astype(np.float32).reshape(-1))
            key.value, key.mute, key.vertex_group = value, mute, group
        return obj

    def test_a_new_key_adds_to_what_is_seen(self, obj, core):
        seen = shown_points(obj)
        bpy.ops.meshfree.smooth()
        expected = core.clean.clean_points(core.build_laplacian(seen))
        np.testing.assert_allclose(shown_points(obj), expected, atol=2e-5)

    @pytest.mark.parametrize(
        ("prepare", "text"),
        [
            (lambda obj: setattr(obj.data.shape_keys, "use_relative", False), "absolute. Turn on Relative"),
            (lambda obj: setattr(obj, "show_only_shape_key", True), "alone.*Turn off Solo Active Shape Key"),
        ],
    )
    def test_keys_that_would_hide_a_new_one(self, obj, prepare, text):
        prepare(obj)
        with refused(obj, text):
            bpy.ops.meshfree.smooth()
