"""Meshes of the surface as a user gets them: where they lie, what their vertices hold, what is shown."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, everything, local_points, sphere_points


@pytest.fixture
def obj():
    return add_object(sphere_points(1500))


def make(obj, **settings):
    """Return the object of the mesh."""
    assert bpy.ops.meshfree.mesh_surface(**settings) == {"FINISHED"}
    return bpy.data.objects[f"{obj.name} Surface"]


def open_edges(obj):
    """Count the edges of one face."""
    faces = np.zeros(len(obj.data.edges), dtype=int)
    edge = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("edge_index", edge)
    np.add.at(faces, edge, 1)
    assert faces.min() > 0
    return np.count_nonzero(faces == 1)


def test_sphere(obj):
    before = everything(obj)
    made = make(obj)
    points = local_points(made)
    assert not open_edges(made)
    assert len(points) - len(made.data.edges) + len(made.data.polygons) == 2
    assert_allclose(np.linalg.norm(points, axis=1), 1.0, atol=2e-3)
    assert all(face.normal.dot(face.center) > 0.0 for face in made.data.polygons)
    after = everything(obj)
    assert {name for name in after if after[name] != before[name]} == {"blocks", "seen"}  # a new object, and hidden
    assert obj.hide_get()
    assert obj.hide_render
    assert bpy.context.object == made
    assert bpy.context.selected_objects == [made]
    assert not made.modifiers  # nothing was on show


def test_lies_on_the_points_of_a_scaled_and_mirrored_object(obj):
    obj.scale, obj.location, obj.rotation_euler = (-2.0, 1.0, 1.5), (5.0, 0.0, 1.0), (0.3, 0.2, 0.1)
    made = make(obj)
    bpy.context.view_layer.update()
    assert_allclose(np.array(made.matrix_world), np.array(obj.matrix_world), atol=1e-6)
    assert_allclose(np.linalg.norm(local_points(made), axis=1), 1.0, atol=5e-3)
    assert all(face.normal.dot(face.center) > 0.0 for face in made.data.polygons)


def test_results_colors_and_groups_are_on_the_vertices(obj):
    points = local_points(obj)
    bpy.ops.meshfree.analyze(modes=4, show=False)
    bpy.ops.meshfree.principal_curvatures(show=False)
    color = obj.data.attributes.new("Col", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", np.column_stack([points * 0.5 + 0.5, np.ones(1500)]).astype(np.float32).ravel())
    add_group(obj, "Top", points[:, 2] > 0.0, 0.5)
    made = make(obj)
    places = local_points(made)
    names = {item.name for item in obj.data.attributes if item.name.startswith("lb_")}
    assert len(names) == 17
    assert names <= {item.name for item in made.data.attributes}
    assert_allclose(attribute(made, "lb_normal"), places, atol=0.02)
    for name in ("lb_normal", "lb_direction_1"):  # the latter has no sign to interpolate
        assert_allclose(np.linalg.norm(attribute(made, name), axis=1), 1.0, rtol=1e-5)
    assert_allclose(attribute(made, "lb_mean_curvature"), 1.0, atol=0.05)
    assert not attribute(made, "lb_component").any()
    found = np.empty((len(places), 4), np.float32)
    made.data.attributes["Col"].data.foreach_get("color", found.reshape(-1))
    assert_allclose(found[:, :3], 0.5 * places + 0.5, atol=0.01)
    group = made.vertex_groups["Top"].index
    weights = np.array(
        [sum(item.weight for item in vertex.groups if item.group == group) for vertex in made.data.vertices]
    )
    assert_allclose(weights[places[:, 2] > 0.2], 0.5, atol=0.01)
    assert not weights[places[:, 2] < -0.2].any()


def test_shows_what_the_points_show(obj, extension):
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_area", color_map="MAGMA")
    made = make(obj)
    assert extension.ui.display.shown_attribute(made) == "lb_area"
    assert made.meshfree.color_map == "MAGMA"
    shown = made.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    assert len(shown.polygons) == len(made.data.polygons)


def test_open_points_stay_open_or_are_closed():
    points = sphere_points(3000)
    obj = add_object(points[points[:, 2] > 0.2])
    made = make(obj)
    assert open_edges(made) > 50
    bpy.data.objects.remove(made)
    obj.hide_set(False)
    bpy.context.view_layer.objects.active = obj
    made = make(obj, keep_open=False)
    assert not open_edges(made)
    assert local_points(made)[:, 2].min() > 0.15


def test_detail_says_how_many_faces(obj):
    coarse = len(make(obj).data.polygons)
    fine = len(make(add_object(sphere_points(1500), "Other"), detail=2.0).data.polygons)
    assert fine == pytest.approx(4 * coarse, rel=0.05)


def test_point_clouds_too(obj):
    if bpy.app.version < (4, 5, 0):
        pytest.skip("Blender makes no Point Cloud objects before 4.5")
    obj.select_set(True)
    bpy.ops.meshfree.convert(target="POINTCLOUD")
    made = make(bpy.context.object)
    assert made.type == "MESH"
    assert not open_edges(made)
