"""Colours on points: the modifier, the material, the range, and the legend for renders."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import FACES, add_object, attribute, grid_points, sphere_points
from tests.blender.conftest import part


@pytest.fixture
def obj():
    obj = add_object(sphere_points() * (1.0, 1.3, 1.7))
    obj.meshfree.point_shape = "DOTS"
    bpy.ops.meshfree.analyze(modes=4)
    return obj


def bounds(display, obj):
    node = display.range_node(obj)
    return node.inputs["From Min"].default_value, node.inputs["From Max"].default_value


def display_points(obj):
    """Point clouds that the evaluated object shows: number of points, attribute names, radii, materials."""
    graph = bpy.context.evaluated_depsgraph_get()
    clouds = [
        item.object.data
        for item in graph.object_instances
        if item.object.type == "POINTCLOUD" and item.parent in {None, obj.evaluated_get(graph)}
    ]
    return [
        (
            len(cloud.points),
            set(cloud.attributes.keys()),
            np.array([value.value for value in cloud.attributes["radius"].data]),
            list(cloud.materials),
        )
        for cloud in clouds
    ]


def rendered_faces(obj):
    """Count the faces of an object that a render gets."""
    found, scene = [], bpy.context.scene

    class Counting(bpy.types.RenderEngine):
        bl_idname, bl_label = "COUNTING", "Counting"

        def render(self, depsgraph):
            found.append(len(obj.evaluated_get(depsgraph).data.polygons))

    bpy.utils.register_class(Counting)
    try:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        scene.render.engine = "COUNTING"
        bpy.ops.render.render()
    finally:
        bpy.utils.unregister_class(Counting)
    (faces,) = found
    return faces


def test_analysis_shows_its_result(display, obj):
    assert display.shown_attribute(obj) == "lb_mean_curvature"


def test_points_carry_the_attribute_a_radius_and_the_material(display, obj):
    ((count, names, radii, materials),) = display_points(obj)
    assert count == 1000
    assert {"lb_area", "lb_normal", "lb_mean_curvature", "lb_eigenvector_004"} <= names
    spacing = np.sqrt(obj.meshfree.total_area / 1000)
    assert (0.3 * spacing < radii).all()
    assert (radii < 1.5 * spacing).all()
    assert [material.name for material in materials] == [display.find_material(obj).name]


@pytest.mark.parametrize("kind", ["MESH", "POINTCLOUD"])
def test_a_limited_viewport_draws_a_share_of_the_points_which_cover_as_much(display, modifiers, obj, kind):
    if kind == "POINTCLOUD":
        if bpy.app.version < (4, 5):
            pytest.skip("Meshes become point clouds from Blender 4.5 on")
        bpy.ops.meshfree.convert()
    ((count, _, radii, _),) = display_points(obj)
    modifiers.set_input(display.find_display(obj), "Viewport Points", 250)
    obj.update_tag()
    ((fewer, _, larger, _),) = display_points(obj)
    assert count == 1000
    assert 200 < fewer < 300
    assert larger == pytest.approx(2.0 * radii[0])
    modifiers.set_input(display.find_display(obj), "Viewport Points", 1000)
    obj.update_tag()
    ((fewer, _, larger, _),) = display_points(obj)
    assert fewer == 1000
    assert larger == pytest.approx(radii)


@pytest.mark.parametrize(("most", "kind"), [(0, "discs"), (2000, "discs"), (1999, "dots"), (500, "dots")])
def test_a_limited_viewport_draws_dots_from_half_its_limit_on_and_renders_draw_discs(
    display, modifiers, obj, most, kind
):
    obj.meshfree.point_shape = "DISCS"
    modifiers.set_input(display.find_display(obj), "Viewport Points", most)
    obj.meshfree.point_size = obj.meshfree.point_size  # tells of it
    faces = len(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons)
    assert (faces, len(display_points(obj))) == ((1000 * FACES, 0) if kind == "discs" else (0, 1))
    assert rendered_faces(obj) == 1000 * FACES


def test_dots_in_place_of_discs_are_as_large_as_these(display, modifiers, obj):
    spacing = obj.meshfree.spacing
    obj.meshfree.point_size = 1.5
    ((_, _, chosen, _),) = display_points(obj)
    assert chosen == pytest.approx(1.5 * spacing)
    modifiers.set_input(display.find_display(obj), "Viewport Points", 1000)
    obj.meshfree.point_shape = "DISCS"
    ((_, _, filled, _),) = display_points(obj)
    reach = np.linalg.norm(attribute(obj, "lb_disc"), axis=1)
    assert np.ptp(reach) > 0.3
    assert filled == pytest.approx(1.5 * spacing * reach, rel=1e-5)


def test_clouds_are_not_drawn_by_nodes_in_edit_mode(display, obj):
    modifier = display.find_display(obj)
    for shape, groups in (("DISCS", False), ("DOTS", False), ("DOTS", True)):
        obj.meshfree.point_shape, obj.meshfree.show_groups = shape, groups
        assert not modifier.show_in_editmode
    meshed = add_object(sphere_points(40), faces=[(0, 1, 2)])
    part("ui.show").show_surface(meshed)
    assert display.find_display(meshed).show_in_editmode


def test_no_loose_vertex_is_drawn_over_the_points(obj):
    # A selected object's loose vertices would cover its colors in orange; its own mesh keeps them all.
    assert len(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices) == 0
    assert len(obj.data.vertices) == 1000


def test_points_of_faces_stay_a_surface():
    obj = add_object(sphere_points(), faces=[(0, 1, 2), (1, 2, 3)])
    obj.meshfree.point_shape = "DOTS"
    bpy.ops.meshfree.analyze()
    ((count, *_),) = display_points(obj)
    assert count == 996
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert (len(mesh.polygons), len(mesh.vertices)) == (2, 4)
    assert mesh.materials[0].name == f"Mesh-Free Display {obj.name}"


def test_second_run_changes_the_display_in_place(display, modifiers, obj):
    modifier, material = display.find_display(obj).name, display.find_material(obj)
    modifiers.set_input(display.find_display(obj), "Radius", 0.123)
    blocks = len(bpy.data.materials), len(bpy.data.node_groups)
    for name in ("lb_eigenvector_003", "lb_normal", "lb_area"):
        bpy.ops.meshfree.colormap(attribute=name)
        assert display.shown_attribute(obj) == name
    assert [item.name for item in obj.modifiers] == [modifier]
    assert display.find_material(obj) == material
    assert (len(bpy.data.materials), len(bpy.data.node_groups)) == blocks
    assert modifiers.get_input(display.find_display(obj), "Radius") == pytest.approx(0.123)


def test_without_a_name_the_attribute_on_show_stays(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_003")
    bpy.ops.meshfree.colormap()
    assert display.shown_attribute(obj) == "lb_eigenvector_003"
    obj.data.vertices[0].co *= 1.1
    bpy.ops.meshfree.analyze()  # removes the modes
    assert display.shown_attribute(obj) == "lb_mean_curvature"


def test_radius_can_be_given(display, obj):
    bpy.ops.meshfree.colormap(radius=0.05)
    ((_, _, radii, _),) = display_points(obj)
    assert np.allclose(radii, 0.05)


def test_display_stays_last(obj):
    obj.modifiers.new("Later", "SMOOTH")
    assert [item.name for item in obj.modifiers] == ["Later", "Mesh-Free Display"]
    display = obj.modifiers["Mesh-Free Display"]
    display.use_pin_to_last = False
    obj.modifiers.move(1, 0)
    bpy.ops.meshfree.colormap()
    assert [item.name for item in obj.modifiers] == ["Later", "Mesh-Free Display"]


def test_objects_share_the_nodes_but_not_the_material(display, obj):
    other = add_object(sphere_points(seed=1), "Other")
    bpy.ops.meshfree.analyze()
    assert display.find_display(obj).node_group == display.find_display(other).node_group
    assert display.find_material(obj) != display.find_material(other)


def test_duplicate_of_an_object_gets_its_own_material(display, obj):
    other = obj.copy()
    other.data = obj.data.copy()
    bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.objects.active = other
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert display.shown_attribute(obj) == "lb_mean_curvature"
    assert display.shown_attribute(other) == "lb_area"


def test_material_of_the_user_is_left_alone(display, modifiers, obj):
    own = bpy.data.materials.new("Own")
    if own.node_tree is None:
        own.use_nodes = True
    nodes = own.node_tree.nodes.keys()
    modifiers.set_input(display.find_display(obj), "Material", own)
    assert display.shown_attribute(obj) == ""
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert own.node_tree.nodes.keys() == nodes
    assert display.shown_attribute(obj) == "lb_area"


def test_display_can_be_left_out():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze(show=False)
    assert not obj.modifiers


def test_signed_values_are_centered_on_zero(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    low, high = bounds(display, obj)
    values = attribute(obj, "lb_eigenvector_002")
    assert low == -high
    assert np.mean(np.abs(values) <= high) == pytest.approx(0.98, abs=0.015)
    middle = display.color_node(obj).color_ramp.evaluate(0.5)
    assert np.ptp(middle[:3]) < 0.05


def test_positive_values_are_sequential(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_area")
    low, high = bounds(display, obj)
    assert 0.0 < low < high
    assert np.allclose(display.color_node(obj).color_ramp.evaluate(0.0)[:3], (0.0578, 0.0004, 0.0887), atol=1e-3)


def ramp_color(display, obj, value):
    low, high = bounds(display, obj)
    return tuple(display.color_node(obj).color_ramp.evaluate((value - low) / (high - low)))


def test_boundary_has_two_colors(display):
    points, _ = grid_points()
    obj = add_object(points)
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_boundary")
    colors = display.step_colors(obj)
    assert list(colors) == ["No", "Yes"]
    assert [ramp_color(display, obj, value) for value in (0.0, 1.0)] == list(colors.values())
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert display.step_colors(obj) == {}


def test_each_part_has_a_color(display):
    spheres = [sphere_points(count) + (5.0 * index, 0.0, 0.0) for index, count in enumerate((600, 500, 400))]
    obj = add_object(np.vstack([*spheres, [[0.0, 0.0, 40.0]]]))
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_component")
    colors = display.step_colors(obj)
    assert list(colors) == ["-1", "0", "1", "2"]
    assert len(set(colors.values())) == 4
    assert [ramp_color(display, obj, float(name)) for name in colors] == list(colors.values())
    obj.meshfree.color_map = "VIRIDIS"
    bpy.ops.meshfree.colormap()
    assert display.step_colors(obj) == {}
    assert bounds(display, obj) == (-1.0, 2.0)


def test_gaussian_curvature_of_both_signs_is_centered_on_zero(display):
    u, v = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, (2, 3000))
    u, v = u[np.cos(u) > -0.5], v[np.cos(u) > -0.5]
    across = 1.0 + 0.4 * np.cos(u)
    obj = add_object(np.stack([across * np.cos(v), across * np.sin(v), 0.4 * np.sin(u)], axis=1))
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_gaussian_curvature")
    low, high = bounds(display, obj)
    assert low == -high


def test_settings_of_the_display(display, obj):
    values = attribute(obj, "lb_normal")[:, 0]
    obj.meshfree.coverage, obj.meshfree.component, obj.meshfree.color_map = 100.0, "X", "VIRIDIS"
    bpy.ops.meshfree.colormap(attribute="lb_normal")
    assert bounds(display, obj) == pytest.approx((values.min(), values.max()))
    obj.meshfree.component = "DIRECTION"
    bpy.ops.meshfree.colormap(attribute="lb_normal")
    assert display.range_node(obj) is None


def test_attributes_of_other_origin_can_be_shown(display, obj):
    for kind, name in (("INT", "count"), ("BOOLEAN", "flag"), ("FLOAT", "value")):
        obj.data.attributes.new(name, kind, "POINT")
        bpy.ops.meshfree.colormap(attribute=name)
        assert display.shown_attribute(obj) == name


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("lb_mean_curvature", "Mean Curvature"),
        ("lb_eigenvector_007", "Mode 7"),
        ("lb_boundary", "Boundary"),
        ("lb_component", "Component"),
        ("weight", "Weight"),
    ],
)
def test_titles(display, name, title):
    assert display.label(name) == title


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize(
    ("name", "texts"), [("lb_area", None), ("lb_normal", 7), ("lb_boundary", 3), ("lb_component", 2)]
)
def test_legend_lies_inside_the_picture_and_is_made_once(display, obj, kind, name, texts):
    legend = part("ui.legend")
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.type = kind
    camera.data.shift_x = 0.1
    camera.location, camera.rotation_euler = (3.0, -4.0, 1.0), (1.2, 0.3, 0.5)
    bpy.ops.meshfree.colormap(attribute=name)
    legend.make_legend(scene, obj, camera)
    parts = list(legend.make_legend(scene, obj, camera).objects)
    written = [part.data.body for part in parts if part.type == "FONT"]
    if texts is None:  # the title, and round numbers inside the range
        assert written[:2] == ["Area", "cm²"]
        numbers, (low, high) = np.array([text.replace(",", "") for text in written[2:]], float), bounds(display, obj)
        assert len(numbers) >= 3
        assert 1e4 * low <= numbers.min() < numbers.max() <= 1e4 * high
    else:
        assert len(written) == texts
    assert len([block for block in bpy.data.objects if block.parent == camera]) == len(parts)
    bpy.context.view_layer.update()
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    for obj in parts:
        for corner in obj.bound_box:
            x, y, depth = world_to_camera_view(scene, camera, obj.matrix_world @ Vector(corner))
            assert 0.6 < x < 1.0
            assert 0.1 < y < 0.9
            assert camera.data.clip_start < depth


def rendered(path):
    """Render what there is, seen from above, and return the colors of its pixels, (n, 3)."""
    scene = bpy.context.scene
    camera = scene.camera or bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    if scene.camera is None:
        scene.collection.objects.link(camera)
        scene.camera = camera
        camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
        camera.location.z = 5.0
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent, scene.view_settings.view_transform = True, "Standard"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels).reshape(-1, 4)
    return pixels[pixels[:, 3] == 1.0][:, :3]


def dark_share(path):
    """Render what there is, and return which share of it is nearly black."""
    return np.mean(rendered(path).max(axis=1) < 0.2)


def test_repeated_colors_are_even_on_discs(tmp_path):
    points, _ = grid_points()
    obj = add_object(points - points.mean(axis=0))
    obj.data.attributes.new("lb_segment", "INT", "POINT")
    bpy.ops.meshfree.show_surface()
    obj.meshfree.color_map = "CATEGORICAL"
    found = []
    for number in (0, 7):  # of the same color
        segment = obj.data.attributes["lb_segment"].data
        segment.foreach_set("value", np.full(len(points), number, np.int32))
        bpy.ops.meshfree.colormap(attribute="lb_segment")
        found.append(rendered(tmp_path / f"{number}.png"))
    first, repeated = found
    assert repeated.mean(axis=0) == pytest.approx(first.mean(axis=0), abs=0.01)
    assert repeated.std(axis=0) == pytest.approx(first.std(axis=0), abs=0.02)


def test_iso_lines_lie_inside_the_range(obj, tmp_path):
    height = attribute(obj, "position")[:, 1]
    values = obj.data.attributes.new("ends", "FLOAT", "POINT")
    values.data.foreach_set("value", np.where(height > 0.0, 1.0, 0.0).astype(np.float32))
    obj.data.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", height)
    obj.meshfree.shaded = 0.0
    bpy.ops.meshfree.colormap(attribute="ends", radius=0.1)
    assert dark_share(tmp_path / "plain.png") == 0.0
    obj.meshfree.iso_lines = 5
    bpy.ops.meshfree.colormap(attribute="ends")
    assert dark_share(tmp_path / "ends.png") == 0.0
    bpy.ops.meshfree.colormap(attribute="height")
    assert 0.004 < dark_share(tmp_path / "lines.png") < 0.4
