"""Where the surface ends, the vertex group that names its boundary, components, and points that lie alone."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, grid_points, local_points, sphere_points


def sheet():
    """Add a flat rectangle with one point in ten thousand of its area; which points are outermost."""
    points, outermost = grid_points()
    return add_object(points), outermost


def test_boundary_of_an_open_surface_is_found():
    obj, outermost = sheet()
    bpy.ops.meshfree.analyze()
    assert (attribute(obj, "lb_boundary") == outermost).all()
    assert obj.meshfree.boundary_count == outermost.sum()
    assert obj.meshfree.total_area == pytest.approx(4.0 * 3.0, rel=0.06)  # half a step beyond the outermost or not
    assert np.abs(attribute(obj, "lb_mean_curvature")).max() < 1e-4


def test_closed_surface_has_none():
    obj = add_object(sphere_points() * (1.0, 1.3, 0.7))
    bpy.ops.meshfree.analyze()
    assert not attribute(obj, "lb_boundary").any()
    assert obj.meshfree.boundary_count == 0


def test_surface_can_be_taken_as_closed():
    obj, _ = sheet()
    bpy.ops.meshfree.analyze()
    area = obj.meshfree.total_area
    obj.meshfree.boundary = "OFF"
    bpy.ops.meshfree.analyze()
    assert not attribute(obj, "lb_boundary").any()
    assert obj.meshfree.total_area > 1.05 * area


@pytest.mark.parametrize("boundaries", ["AUTO", "OFF"])
def test_vertex_group_names_the_boundary(core, boundaries):
    obj, outermost = sheet()
    outermost &= local_points(obj)[:, 0] < 1.0
    add_group(obj, "Other", ~outermost)
    add_group(obj, "Boundary", outermost, weight=0.25)
    uncounted = np.flatnonzero(~outermost)[:50].tolist()  # of weight 0
    obj.vertex_groups["Boundary"].add(uncounted, 0.0, "REPLACE")
    obj.meshfree.boundary_group, obj.meshfree.boundary = "Boundary", boundaries
    bpy.ops.meshfree.analyze()
    assert (attribute(obj, "lb_boundary") == outermost).all()
    options = core.LaplacianOptions(boundary=boundaries.lower())
    laplacian = core.build_laplacian(local_points(obj), options=options, boundary=np.flatnonzero(outermost))
    assert_allclose(attribute(obj, "lb_area"), laplacian.areas, rtol=1e-6)


def test_spectrum_uses_the_group_too():
    obj, outermost = sheet()
    add_group(obj, "Boundary", outermost[::-1] & outermost)
    obj.meshfree.boundary_group = "Boundary"
    bpy.ops.meshfree.spectrum(count=3)
    assert (attribute(obj, "lb_boundary") == outermost).all()


class TestChangesOfTheGroup:
    @pytest.fixture
    def obj(self):
        obj, outermost = sheet()
        add_group(obj, "Boundary", outermost)
        add_group(obj, "Part", outermost & (local_points(obj)[:, 0] < 2.0))
        obj.meshfree.boundary_group = "Boundary"
        bpy.ops.meshfree.analyze(modes=3)
        return obj

    def test_another_group_makes_results_stale_until_it_is_taken_back(self, obj, result):
        assert not result.is_stale(obj)
        for name in ("Part", "Missing", ""):
            obj.meshfree.boundary_group = name
            assert result.is_stale(obj)
        obj.meshfree.boundary_group = "Boundary"
        assert not result.is_stale(obj)

    def test_another_member_makes_results_stale(self, obj, result):
        group = obj.vertex_groups["Boundary"]
        group.add([500], 1.0, "REPLACE")
        assert result.is_stale(obj)
        group.add([500], 0.0, "REPLACE")
        assert not result.is_stale(obj)
        group.remove([0])
        assert result.is_stale(obj)

    def test_name_of_the_group_and_members_of_others_do_not_matter(self, obj, result):
        obj.vertex_groups["Boundary"].name = "Edge"
        obj.meshfree.boundary_group = "Edge"
        obj.vertex_groups["Part"].add([500], 1.0, "REPLACE")
        assert not result.is_stale(obj)

    def test_new_members_get_a_new_operator_and_old_modes_go(self, obj):
        obj.vertex_groups["Boundary"].remove(np.flatnonzero(local_points(obj)[:, 0] > 2.0).tolist())
        area = attribute(obj, "lb_area")
        bpy.ops.meshfree.analyze()
        assert (attribute(obj, "lb_area") != area).any()
        assert "lb_eigenvalues" not in obj
        assert (attribute(obj, "lb_boundary") == np.array(in_group(obj, "Part"))).all()

    def test_panel_looks_at_members_only_now_and_then(self, counting, obj, result, monkeypatch):
        monkeypatch.setattr(counting, "_PATIENCE", 1e9)
        assert not result.is_stale(obj)
        obj.vertex_groups["Boundary"].add([500], 1.0, "REPLACE")
        assert not result.is_stale(obj, glance=True)
        assert result.is_stale(obj)
        assert result.is_stale(obj, glance=True)


def in_group(obj, name):
    index = obj.vertex_groups[name].index
    return [any(item.group == index for item in vertex.groups) for vertex in obj.data.vertices]


def test_group_is_read_with_modifiers_in_use():
    obj, outermost = sheet()
    add_group(obj, "Boundary", outermost)
    obj.meshfree.boundary_group, obj.meshfree.use_modifiers = "Boundary", True
    obj.modifiers.new("Wave", "WAVE")
    bpy.ops.meshfree.analyze()
    assert (attribute(obj, "lb_boundary") == outermost).all()


def test_two_components_are_two_parts_with_a_constant_mode_each():
    small, large = sphere_points(500, seed=1), sphere_points(800)
    obj = add_object(np.vstack([small, large + (5.0, 0.0, 0.0)]))
    bpy.ops.meshfree.spectrum(count=4)
    component = attribute(obj, "lb_component")
    assert (component == np.repeat([1, 0], [500, 800])).all()
    assert obj.meshfree.component_count == 2
    eigenvalues = np.array(obj["lb_eigenvalues"])
    assert_allclose(eigenvalues[:2], 0.0, atol=1e-6)
    assert eigenvalues[2] > 1.0
    assert obj.meshfree.total_area == pytest.approx(8.0 * np.pi, rel=0.01)


def test_lone_point_is_left_out_with_a_notice(capfd):
    obj = add_object(np.vstack([sphere_points(), [[0.0, 20.0, 0.0]]]))
    bpy.ops.meshfree.analyze(modes=3)
    assert "Info: Outliers and small components left out: 1 (" in capfd.readouterr().out
    values = {name: attribute(obj, f"lb_{name}") for name in ("area", "normal", "component", "boundary")}
    assert values["area"][-1] == 0.0
    assert (values["area"][:-1] > 0.0).all()
    assert_allclose(values["normal"][-1], (0.0, 0.0, 1.0))
    assert values["component"][-1] == -1
    assert not values["boundary"][-1]
    for name in ("lb_mean_curvature", "lb_gaussian_curvature", "lb_eigenvector_001", "lb_eigenvector_003"):
        assert attribute(obj, name)[-1] == 0.0
    assert obj.meshfree.left_out_count == 1
    assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi, rel=0.01)


def test_smoothed_noise_is_reported_and_the_points_stay(capfd):
    random = np.random.default_rng(0)
    noisy = sphere_points(2000) * (1.0 + 0.02 * random.normal(size=(2000, 1)))
    obj = add_object(noisy)
    before = local_points(obj)
    bpy.ops.meshfree.analyze()
    assert "Results are of a smoothed surface" in capfd.readouterr().out
    assert_allclose(local_points(obj), before, rtol=0.0, atol=0.0)
    smoothed = np.std(attribute(obj, "lb_mean_curvature"))
    obj.meshfree.projection = "OFF"
    bpy.ops.meshfree.analyze()
    assert "Results are of a smoothed surface" not in capfd.readouterr().out
    assert np.std(attribute(obj, "lb_mean_curvature")) != smoothed
