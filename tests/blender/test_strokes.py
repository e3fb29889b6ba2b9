"""Strokes along directions on the surface: where they lie, how long they are, when they are there."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, everything, grid_points, local_points, sphere_points


@pytest.fixture
def strip():
    """A flat strip with a source, drawn as dots, so that nothing but strokes has corners."""
    obj = add_object(grid_points(columns=60, rows=20, step=0.1)[0])
    obj.meshfree.point_shape = "DOTS"
    add_group(obj, "Source", [0])
    return obj


def strokes(obj):
    """Corners of the triangles that are drawn, (k, 3, 3)."""
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    triangles = [face.vertices for face in mesh.polygons if len(face.vertices) == 3]
    corners = np.array([vertex.co for vertex in mesh.vertices]).reshape(-1, 3)
    return corners[np.array(triangles, int).reshape(-1, 3)]


def extend(**settings):
    assert bpy.ops.meshfree.extend_direction(**settings) == {"FINISHED"}


def ends(obj):
    """Middle of the blunt end of each stroke, its tip, and its width."""
    corners = strokes(obj)
    tips = np.argmin([np.linalg.norm(corners[:, i - 1] - corners[:, i - 2], axis=1) for i in range(3)], axis=0)
    rows = np.arange(len(corners))
    left, right = corners[rows, tips - 1], corners[rows, tips - 2]
    return 0.5 * (left + right), corners[rows, tips], np.linalg.norm(right - left, axis=1)


def test_strokes_lie_along_the_direction_a_little_above_the_surface(strip):
    extend(direction=(3.0, 4.0, 0.0))
    tails, tips, widths = ends(strip)
    assert 400 < len(tips) <= 1200
    lengths = np.linalg.norm(tips - tails, axis=1)
    assert_allclose((tips - tails) / lengths[:, None], np.tile([0.6, 0.8, 0.0], (len(tips), 1)), atol=1e-4)
    radius = 1.1 * strip.meshfree.spacing
    assert_allclose(lengths, 2.0 * radius, rtol=1e-3)  # of so few points a fortieth of the strip would be less
    assert_allclose(widths, 0.16 * lengths, rtol=1e-3)
    up = np.sign(attribute(strip, "lb_disc")[0, 2])
    assert_allclose(up * tails[:, 2], 0.2 * radius, rtol=1e-3)
    points = local_points(strip)[:, :2]
    middles = 0.5 * (tails + tips)[:, None, :2]
    assert_allclose(np.linalg.norm(middles - points, axis=2).min(axis=1), 0.0, atol=1e-4)


def test_of_many_points_some_have_strokes_all_over_the_surface():
    obj = add_object(sphere_points(20_000))
    obj.meshfree.point_shape = "DOTS"
    add_group(obj, "Source", [0])
    extend(direction=(1.0, 1.0, 0.0))
    tails, tips, _ = ends(obj)
    size = np.linalg.norm(np.ptp(local_points(obj), axis=0)) / 40.0
    assert_allclose(np.linalg.norm(tips - tails, axis=1), size, rtol=0.03)  # Blender 4.2 adds the radius of the points
    assert 1000 < len(tips) < 10_000
    middles = 0.5 * (tails + tips)
    rows = np.linalg.norm(local_points(obj)[:, None] - middles[:: len(tips) // 200], axis=2).argmin(axis=0)
    along = ((tips - tails) / np.linalg.norm(tips - tails, axis=1)[:, None])[:: len(tips) // 200]
    assert_allclose(np.einsum("ij,ij->i", along, attribute(obj, "lb_direction")[rows]), 1.0, atol=1e-3)
    beyond = np.linalg.norm(middles, axis=1) - 1.0
    assert_allclose(beyond, 0.2 * 1.1 * obj.meshfree.spacing, rtol=0.05)
    nearest = np.array([np.linalg.norm(middles - place, axis=1).min() for place in local_points(obj)[::50]])
    assert nearest.max() < size  # nowhere is there none


def test_points_without_a_direction_have_no_stroke():
    obj = add_object(np.concatenate([sphere_points(900), sphere_points(300, 1) * 0.5 + [4.0, 0.0, 0.0]]))
    obj.meshfree.point_shape = "DOTS"
    add_group(obj, "Source", [0])
    extend(direction=(1.0, 1.0, 0.0))
    tails, _, _ = ends(obj)
    assert len(tails) > 300
    assert tails[:, 0].max() < 1.2


def test_the_switch_and_the_length_answer_at_once(strip, extension):
    extend(direction=(3.0, 4.0, 0.0))
    count, (tails, tips, _) = len(strokes(strip)), ends(strip)
    strip.meshfree.strokes = False
    assert len(strokes(strip)) == 0
    strip.meshfree.strokes = True
    assert len(strokes(strip)) == count
    extension.operators.objects.modifiers.set_input(strip.modifiers[0], "Stroke Length", 3.0)
    strip.update_tag()
    longer, ahead, _ = ends(strip)
    assert len(longer) < count
    assert_allclose(np.linalg.norm(ahead - longer, axis=1), 3.0 * np.linalg.norm((tips - tails)[0]), rtol=1e-3)


def test_strokes_go_with_what_is_on_show(strip):
    extend(direction=(3.0, 4.0, 0.0))
    assert len(strokes(strip))
    strip.meshfree.component = "X"  # as numbers
    assert len(strokes(strip)) == 0
    strip.meshfree.component = "AUTO"
    assert len(strokes(strip))
    bpy.ops.meshfree.analyze(show=False)
    for name in ("lb_area", "lb_normal"):  # normals do not lie along the surface
        bpy.ops.meshfree.colormap(attribute=name)
        assert len(strokes(strip)) == 0
    bpy.ops.meshfree.colormap(attribute="lb_direction")
    assert len(strokes(strip))


def test_principal_curvatures_have_strokes_around_a_cylinder():
    turn, height = np.meshgrid(2.0 * np.pi * np.arange(60) / 60, np.linspace(0.0, 4.0, 40))
    turn = (turn + 0.05 * np.arange(40)[:, None]).ravel()
    obj = add_object(np.stack([np.cos(turn), np.sin(turn), height.ravel()], axis=1))
    obj.meshfree.point_shape = "DOTS"
    bpy.ops.meshfree.principal_curvatures(display="DIRECTION")
    tails, tips, _ = ends(obj)
    inside = np.abs(tails[:, 2] - 2.0) < 1.5
    along = ((tips - tails) / np.linalg.norm(tips - tails, axis=1)[:, None])[inside]
    assert inside.sum() > 300
    assert np.abs(along[:, 2]).max() < 0.1


def test_strokes_are_drawn_over_discs_and_no_tool_takes_their_corners_for_points(strip):
    strip.meshfree.point_shape = "DISCS"
    extend(direction=(3.0, 4.0, 0.0))
    mesh = strip.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    materials = [material.name for material in mesh.materials if material]
    assert "Mesh-Free Strokes" in materials
    inked = [face for face in mesh.polygons if mesh.materials[face.material_index].name == "Mesh-Free Strokes"]
    assert 400 < len(inked) <= 1200
    marks = np.empty(len(mesh.vertices), bool)
    mesh.attributes["lb_corner"].data.foreach_get("value", marks)
    assert marks.all()


def test_points_that_follow_handles_have_no_strokes(strip):
    extend(direction=(3.0, 4.0, 0.0))
    x = local_points(strip)[:, 0]
    add_group(strip, "Handle", np.flatnonzero(x > 5.5).tolist())
    add_group(strip, "Anchor", np.flatnonzero(x < 0.5).tolist())
    bpy.ops.meshfree.deform_bind()
    assert len(strokes(strip)) == 0
    bpy.ops.meshfree.deform_unbind()
    assert len(strokes(strip))


def test_undo_takes_them_back(strip):
    bpy.ops.ed.undo_push(message="before")
    before = everything(strip)
    extend(direction=(3.0, 4.0, 0.0))
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Cloud"]
    assert everything(obj) == before
    assert len(strokes(obj)) == 0
