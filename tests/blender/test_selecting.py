"""Selecting points and assigning them to groups, in Edit Mode and in Object Mode."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, grid_points, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused


@pytest.fixture
def obj():
    obj = add_object(np.concatenate([sphere_points(900), 0.5 * sphere_points(300, 1) + [4.0, 0.0, 0.0]]))
    choose(obj, lambda points: points[:, 2] > 0.95)
    return obj


def choose(obj, condition):
    obj.data.vertices.foreach_set("select", condition(local_points(obj)))


def selected(obj):
    values = np.empty(len(obj.data.vertices), dtype=bool)
    obj.data.vertices.foreach_get("select", values)
    return values


def in_group(obj, name):
    index = obj.vertex_groups[name].index
    return np.array([any(item.group == index for item in vertex.groups) for vertex in obj.data.vertices])


@pytest.fixture(params=["OBJECT", "EDIT"])
def mode(request, obj):
    if request.param == "EDIT":
        obj.select_set(True)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
    yield request.param
    assert obj.mode == request.param
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_group_from_the_selection(obj, mode):
    bpy.ops.meshfree.group_from_selection(role="ANCHOR")
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    assert (in_group(obj, "Anchor") == (local_points(obj)[:, 2] > 0.95)).all()
    bpy.ops.object.mode_set(mode=mode)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_selected_faces_do_not_select_their_vertices_again(mode):
    """Edit Mode selects all vertices of edges and faces that are selected."""
    meshed = add_object(sphere_points(40), faces=[(0, 1, 2), (3, 4, 5)])
    add_group(meshed, "Chosen", [0, 3, 4])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.object.mode_set(mode=mode)
    assert bpy.ops.meshfree.select_group(name="Chosen") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.flatnonzero(selected(meshed)).tolist() == [0, 3, 4]
    assert [edge.vertices[:] for edge in meshed.data.edges if edge.select] == [(3, 4)]


def test_growing(obj, mode):
    bpy.ops.meshfree.select_grow(distance=0.5)
    bpy.ops.object.mode_set(mode="OBJECT")
    points = local_points(obj)
    angle = np.arccos(np.clip(points[:, 2], -1.0, 1.0)) - np.arccos(0.95)
    near = (points[:, 0] < 2.0) & (angle < 0.25)
    far = (points[:, 0] > 2.0) | (angle > 0.55)
    assert selected(obj)[near].all()
    assert not selected(obj)[far].any()
    bpy.ops.object.mode_set(mode=mode)


def test_the_connected_part(obj, mode):
    bpy.ops.meshfree.select_component()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert (selected(obj) == (local_points(obj)[:, 0] < 2.0)).all()
    bpy.ops.object.mode_set(mode=mode)


@pytest.mark.parametrize("surface", [True, False])
def test_only_what_is_seen_stays_selected(obj, mode, surface):
    """Of the small sphere below the large one nothing is seen from above."""
    bpy.ops.object.mode_set(mode="OBJECT")
    points = local_points(obj)
    points[900:] += [-4.0, 0.0, -3.0]
    obj.data.vertices.foreach_set("co", points.reshape(-1))
    obj.scale, obj.location = (2.0, 2.0, 2.0), (5.0, 0.0, 0.0)
    if surface:
        bpy.ops.meshfree.show_surface()
    choose(obj, lambda points: points[:, 0] < 0.5)
    bpy.ops.object.mode_set(mode=mode)
    bpy.ops.meshfree.select_front(direction=(0.0, 0.0, -1.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    sure = np.abs(points[:, 2]) > 0.2
    expected = (points[:, 0] < 0.5) & (points[:, 2] > 0.0)
    assert (selected(obj) != expected)[sure].mean() < (0.005 if surface else 0.02)  # random points leave holes
    bpy.ops.object.mode_set(mode=mode)


def test_what_is_seen_without_a_view_says_so(obj):
    with pytest.raises(RuntimeError, match="no 3D viewport.*Give a viewing direction"):
        bpy.ops.meshfree.select_front()


@pytest.mark.parametrize(("action", "count"), [("REPLACE", "new"), ("ADD", "both"), ("REMOVE", "rest")])
def test_what_the_group_held_before(obj, action, count):
    bpy.ops.meshfree.group_from_selection(role="SOURCE")
    old = selected(obj)
    choose(obj, lambda points: points[:, 2] > 0.98)
    new = selected(obj) | (local_points(obj)[:, 2] < -0.98)
    obj.data.vertices.foreach_set("select", new)
    bpy.ops.meshfree.group_from_selection(role="SOURCE", action=action, weight=0.5)
    expected = {"new": new, "both": old | new, "rest": old & ~new}[count]
    assert (in_group(obj, "Source") == expected).all()


def test_assigning_twice_by_the_panel_keeps_the_first_set(obj):
    first = selected(obj)
    press("VALUE")
    choose(obj, lambda points: points[:, 2] < -0.95)
    second = selected(obj)
    press("VALUE")
    assert (in_group(obj, "Value") == (first | second)).all()
    press("VALUE", remove=True)
    assert (in_group(obj, "Value") == first).all()


def press(role, remove=False):
    """Press the button of a role in the panel."""
    entries = [settings for name, settings in draw_points() if name == "meshfree.group_from_selection"]
    (entry,) = [item for item in entries if item["role"] == role and (item["action"] == "REMOVE") == remove]
    assert bpy.ops.meshfree.group_from_selection(**entry) == {"FINISHED"}


def draw_points():
    """Draw the panel of points, and return its buttons with their settings."""
    buttons = []

    class Layout:
        enabled = True

        def operator(self, name, **_):
            settings = SimpleNamespace()
            buttons.append((name, vars(settings)))
            return settings

        def __getattr__(self, name):
            return lambda *_, **__: self

    groups = part("ui.groups")
    groups.draw_groups(Layout(), bpy.context.object, *groups.ROLES)
    return buttons


def test_what_a_group_held_is_not_gone_without_a_word(obj, capfd):
    bpy.ops.meshfree.group_from_selection(role="VALUE")
    choose(obj, lambda points: points[:, 2] < -0.98)
    count = np.count_nonzero(selected(obj))
    bpy.ops.meshfree.group_from_selection(role="VALUE")
    assert f'Cloud: {count:,} points are in the group "Value", in place of ' in capfd.readouterr().out


def test_a_point_has_one_of_the_given_values(obj):
    chosen = selected(obj)
    for role in ("VALUE", "LOW", "HIGH"):
        bpy.ops.meshfree.group_from_selection(role=role, action="ADD")
        for name in {group.name for group in obj.vertex_groups}:
            assert (in_group(obj, name) == (chosen & (name == role.title()))).all()


def test_the_number_in_the_panel_counts_all_members(obj):
    members = part("operators.objects.counting").members
    count = np.count_nonzero(selected(obj))
    bpy.ops.meshfree.group_from_selection(role="VALUE", weight=0.0)
    assert members(obj, "Value").count == members(obj, "Value", glance=True).count == count > 5
    obj.data.vertices.foreach_set("select", np.zeros(1200, dtype=bool))
    bpy.ops.meshfree.select_group(name="Value")
    assert np.count_nonzero(selected(obj)) == count


def test_nothing_selected(obj):
    obj.data.vertices.foreach_set("select", np.zeros(1200, dtype=bool))
    with pytest.raises(RuntimeError, match="No points.*are selected"):
        bpy.ops.meshfree.group_from_selection(role="HANDLE")
    assert len(obj.vertex_groups) == 0


class TestSelectPoint:
    """What a click does: the point in front, though others behind it are nearer to the mouse."""

    @pytest.fixture
    def edited(self, obj):
        obj.rotation_euler, obj.location = (0.3, 0.2, 0.1), (1.0, 2.0, 3.0)
        obj.data.vertices.foreach_set("select", np.arange(1200) < 3)
        bpy.context.view_layer.update()
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
        yield obj
        bpy.ops.object.mode_set(mode="OBJECT")

    def chosen(self, obj):
        obj.update_from_editmode()
        return np.flatnonzero(selected(obj)).tolist()

    def test_the_near_side(self, edited):
        matrix = np.array(edited.matrix_world)
        for x, y in np.random.default_rng(2).uniform(-0.6, 0.6, (20, 2)):
            bpy.ops.meshfree.select_point(eye=(1.0 + x, 2.0 + y, 9.0), direction=(0.0, 0.0, -1.0))
            (index,) = self.chosen(edited)
            place = np.array(edited.data.vertices[index].co) @ matrix[:3, :3].T
            assert place[2] > 0.4
            assert np.hypot(place[0] - x, place[1] - y) < 0.15

    def test_one_more_and_one_less(self, edited):
        ray = {"eye": (1.0, 2.0, 9.0), "direction": (0.0, 0.0, -1.0)}
        bpy.ops.meshfree.select_point(**ray, extend=True)
        (new,) = set(self.chosen(edited)) - {0, 1, 2}
        bpy.ops.meshfree.select_point(**ray, extend=True)
        assert self.chosen(edited) == [0, 1, 2]
        bpy.ops.meshfree.select_point(**ray)
        assert self.chosen(edited) == [new]

    def test_nothing_there(self, edited):
        with pytest.raises(RuntimeError, match="No point is seen along the ray"):
            bpy.ops.meshfree.select_point(eye=(20.0, 2.0, 9.0), direction=(0.0, 0.0, -1.0))
        assert self.chosen(edited) == [0, 1, 2]

    def test_hidden_points_are_seen_through(self, edited):
        ray = {"eye": (1.0, 2.0, 9.0), "direction": (0.0, 0.0, -1.0)}
        bpy.ops.meshfree.select_point(**ray)
        (front,) = self.chosen(edited)
        bpy.ops.mesh.hide()
        bpy.ops.meshfree.select_point(**ray)
        assert self.chosen(edited) not in ([front], [])


def test_hidden_points_are_never_selected(obj, mode):
    hidden = np.arange(1200) % 2 == 0
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.data.vertices.foreach_set("hide", hidden)
    choose(obj, lambda points: (points[:, 2] > 0.95) & ~hidden)
    bpy.ops.object.mode_set(mode=mode)
    bpy.ops.meshfree.select_component()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert (selected(obj) == (local_points(obj)[:, 0] < 2.0) & ~hidden).all()
    bpy.ops.object.mode_set(mode=mode)


def test_points_that_belong_to_no_part():
    obj = add_object(np.concatenate([sphere_points(900), [[30.0, 0.0, 0.0], [0.0, 30.0, 0.0]]]))
    choose(obj, lambda points: points[:, 0] > 20.0)
    bpy.ops.meshfree.select_component()
    assert np.flatnonzero(selected(obj)).tolist() == [900]


@pytest.mark.parametrize("kind", ["EDGE", "FACE"])
def test_loose_points_stay_selected_whatever_is_selected_in_edit_mode(obj, kind):
    bpy.context.tool_settings.mesh_select_mode = (False, kind == "EDGE", kind == "FACE")
    bpy.ops.meshfree.select_grow(distance=0.5)
    count = selected(obj).sum()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert selected(obj).sum() == count > 20


@pytest.mark.parametrize("fails", [False, True])
def test_several_objects_in_edit_mode(obj, fails):
    partner, bystander = add_object(sphere_points(), "Partner"), add_object(sphere_points(), "Bystander")
    obj.select_set(True)
    partner.select_set(True)
    bystander.select_set(False)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bystander.select_set(True)
    partner.select_set(False)
    if fails:
        obj.meshfree.boundary_group = "Nowhere"
        with pytest.raises(RuntimeError, match="Nowhere"):
            bpy.ops.meshfree.select_grow()
    else:
        bpy.ops.meshfree.select_grow()
    assert [item.mode for item in (obj, partner, bystander)] == ["EDIT", "EDIT", "OBJECT"]
    assert [item.select_get() for item in (obj, partner, bystander)] == [True, False, True]
    assert bpy.context.object == obj
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"role": "HANDLE"}, '"Handle" of "Cloud" is locked. Unlock it'),
        ({"role": "ANCHOR"}, 'attribute named "Anchor".*share'),
        ({"role": "FIXED", "action": "REMOVE"}, 'no vertex group named "Fixed" to remove points from'),
        (
            {"role": "FIXED", "front_only": True, "direction": (0.0, 0.0, 1.0)},
            "No selected points.*Turn off On Surface",
        ),
    ],
)
def test_groups_that_cannot_be_changed(obj, settings, text):
    bpy.ops.meshfree.group_from_selection(role="HANDLE")
    obj.vertex_groups["Handle"].lock_weight = True
    obj.data.attributes.new("Anchor", "FLOAT", "POINT")
    with refused(obj, text):
        bpy.ops.meshfree.group_from_selection(**settings)


def test_a_mesh_that_another_object_edits(obj):
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    obj.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.objects.active = other
    with pytest.raises(RuntimeError, match="is not in Object Mode"):
        bpy.ops.meshfree.select_component()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="OBJECT")


def test_the_boundary_becomes_the_boundary_group():
    points, outermost = grid_points()
    obj = add_object(points)
    bpy.ops.meshfree.select_boundary()
    assert (selected(obj) == outermost).all()
    bpy.ops.meshfree.group_from_selection(role="BOUNDARY")
    assert obj.meshfree.boundary_group == "Boundary"
    assert (in_group(obj, "Boundary") == outermost).all()
    choose(obj, lambda points: points[:, 0] < 1.0)
    bpy.ops.meshfree.select_group(name="Boundary")
    assert (selected(obj) == outermost).all()


def test_a_closed_surface_has_no_boundary_to_select():
    add_object(sphere_points(900))
    with pytest.raises(RuntimeError, match="has no boundary"):
        bpy.ops.meshfree.select_boundary()


def test_a_group_that_is_missing_is_not_selected(obj, mode):
    with pytest.raises(RuntimeError, match='no vertex group named "Handle"'):
        bpy.ops.meshfree.select_group()


class TestSeveralObjectsInEditMode:
    @pytest.fixture
    def objects(self):
        objects = [add_object(sphere_points(900, seed), name) for seed, name in enumerate(("One", "Two", "Three"))]
        for obj in objects:
            obj.select_set(True)
        choose(objects[0], lambda points: points[:, 2] > 0.95)
        choose(objects[1], lambda points: points[:, 2] < -0.9)
        choose(objects[2], lambda points: points[:, 2] > 2.0)
        bpy.context.view_layer.objects.active = objects[2]
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
        yield objects
        assert [obj.mode for obj in objects] == ["EDIT"] * 3
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_each_with_selected_points_gets_the_group(self, objects):
        bpy.ops.meshfree.group_from_selection(role="SOURCE")
        assert [obj.mode for obj in objects] == ["EDIT"] * 3
        bpy.ops.object.mode_set(mode="OBJECT")
        assert (in_group(objects[0], "Source") == (local_points(objects[0])[:, 2] > 0.95)).all()
        assert (in_group(objects[1], "Source") == (local_points(objects[1])[:, 2] < -0.9)).all()
        bpy.ops.object.mode_set(mode="EDIT")
        assert not objects[2].vertex_groups

    def test_each_grows(self, objects):
        before = [self.count(obj) for obj in objects]
        bpy.ops.meshfree.select_grow(distance=0.4)
        after = [self.count(obj) for obj in objects]
        assert after[0] > before[0] > 0
        assert after[1] > before[1] > 0
        assert after[2] == before[2] == 0

    def test_an_error_in_one_leaves_all(self, objects):
        objects[1].vertex_groups.new(name="Source").lock_weight = True
        with pytest.raises(RuntimeError, match='"Source" of "Two" is locked'):
            bpy.ops.meshfree.group_from_selection(role="SOURCE")
        assert not objects[0].vertex_groups

    @staticmethod
    def count(obj):
        obj.update_from_editmode()
        return int(selected(obj).sum())
