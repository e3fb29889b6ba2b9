"""Analysis of the active object against the same call through core."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, local_points, result_names, sphere_points
from tests.results import RESULTS


def expected(core, obj):
    """What the attributes should hold, by core, of the object's points in the world."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    laplacian = core.build_laplacian(local_points(obj) @ matrix.T)
    normals = laplacian.normals @ matrix
    squared = ((laplacian.points[:, None] - laplacian.points) ** 2).sum(axis=2)
    spacing = np.median(np.sqrt(np.partition(squared, 8, axis=1)[:, 8] * np.pi / 8.0))
    return {
        "lb_area": laplacian.areas,
        "lb_boundary": laplacian.boundary,
        "lb_component": laplacian.component,
        "lb_doubt": laplacian.doubt,
        "lb_disc": normals / np.linalg.norm(normals, axis=1)[:, None] * (laplacian.disc_radii / spacing)[:, None],
        "lb_gaussian_curvature": laplacian.gaussian_curvature,
        "lb_mean_curvature": core.measure.mean_curvature(laplacian),
        "lb_normal": normals / np.linalg.norm(normals, axis=1)[:, None],
        "lb_trust": laplacian.trust,
    }


def assert_result(core, obj):
    values = expected(core, obj)
    assert sorted(values) == RESULTS
    for name in RESULTS:
        smallest = 0.0 if name == "lb_area" else 1e-6
        assert_allclose(attribute(obj, name), values[name], rtol=1e-5, atol=smallest, err_msg=name)
    assert obj.meshfree.total_area == pytest.approx(values["lb_area"].sum(), rel=1e-6)
    assert obj.meshfree.point_count == len(values["lb_area"])


def test_result_is_that_of_core(core):
    obj = add_object(sphere_points())
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}
    assert result_names(obj) == RESULTS
    assert_result(core, obj)
    outwards = np.einsum("ij,ij->i", attribute(obj, "lb_normal"), local_points(obj))
    assert (outwards > 0.9).all()
    assert np.median(attribute(obj, "lb_mean_curvature")) == pytest.approx(1.0, abs=0.1)


def test_types_of_the_attributes():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    types = {name: obj.data.attributes[name].data_type for name in RESULTS}
    assert {types.pop("lb_normal"), types.pop("lb_disc")} == {"FLOAT_VECTOR"}
    assert types.pop("lb_boundary") == "BOOLEAN"
    assert types.pop("lb_component") == types.pop("lb_doubt") == "INT"
    assert set(types.values()) == {"FLOAT"}


@pytest.mark.parametrize("radius", [1.0, 0.02])
def test_gaussian_curvature_of_a_sphere(radius):
    obj = add_object(sphere_points(2000))
    obj.scale = (radius, radius, radius)
    bpy.ops.meshfree.analyze()
    assert_allclose(attribute(obj, "lb_gaussian_curvature"), 1.0 / radius**2, rtol=0.1)


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Scale(3.0, 4),
        Matrix.Rotation(0.7, 4, "Y") @ Matrix.Diagonal((1.0, 2.0, 0.5, 1.0)),
        Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)),
        Matrix.Translation((100.0, -5.0, 3.0)),
    ],
    ids=["scaled", "rotated and scaled unevenly", "mirrored", "moved"],
)
def test_lengths_are_the_worlds_and_vectors_local(core, matrix):
    obj = add_object(sphere_points())
    before = local_points(obj)
    obj.matrix_world = matrix
    bpy.ops.meshfree.analyze()
    assert_allclose(obj.matrix_world, matrix, atol=1e-6)
    assert_result(core, obj)
    assert_allclose(local_points(obj), before, rtol=0, atol=0)


def test_scale_set_a_line_before_is_seen(core):
    obj = add_object(sphere_points())
    obj.scale = (2.0, 2.0, 2.0)
    bpy.ops.meshfree.analyze()
    assert obj.meshfree.total_area == pytest.approx(16.0 * np.pi, rel=0.01)


def test_scale_of_a_parent_counts(core):
    obj = add_object(sphere_points())
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    obj.parent = parent
    parent.scale = (1.0, 3.0, 1.0)
    bpy.ops.meshfree.analyze()
    assert_allclose(obj.matrix_world, Matrix.Diagonal((1.0, 3.0, 1.0, 1.0)))
    assert_result(core, obj)


def test_settings_reach_core(core):
    obj = add_object(sphere_points())
    settings = {"bandwidth": "GLOBAL", "neighbors": 60}
    for name, value in settings.items():
        setattr(obj.meshfree, name, value)
    bpy.ops.meshfree.analyze()
    options = core.LaplacianOptions(bandwidth="global", neighbors=60)
    areas = core.build_laplacian(local_points(obj), options=options).areas
    assert_allclose(attribute(obj, "lb_area"), areas, rtol=1e-6)


def test_settings_of_the_paper_reach_core(core):
    obj = add_object(sphere_points(300))
    settings = {"laplacian": "PAPER", "neighbors": 60, "normals": "PCA", "areas": "UNIFORM", "denoise": True}
    for name, value in settings.items():
        setattr(obj.meshfree, name, value)
    bpy.ops.meshfree.spectrum(count=3)
    settings = {"neighbors": 60, "normals": "pca", "areas": "uniform", "denoise": True}
    laplacian = core.paper.build_laplacian(local_points(obj), **settings)
    assert_allclose(attribute(obj, "lb_area"), laplacian.areas, rtol=1e-6)
    assert_allclose(obj["lb_eigenvalues"].to_list(), laplacian.eigenpairs(3).eigenvalues, rtol=1e-9, atol=1e-9)


def test_another_object_can_be_named_by_a_script(core):
    obj = add_object(sphere_points())
    add_object(sphere_points(seed=1), "Other")
    with bpy.context.temp_override(object=obj):
        bpy.ops.meshfree.analyze()
    assert result_names(obj)
    assert_result(core, obj)
    assert result_names(bpy.data.objects["Other"]) == []


def test_mesh_with_faces_is_taken_as_its_vertices_with_a_notice(core, capfd):
    obj = add_object(sphere_points(), faces=[(0, 1, 2)])
    bpy.ops.meshfree.analyze()
    assert "has 1 faces: only its 1000 vertices are used" in capfd.readouterr().out
    assert_result(core, obj)


def test_duplicate_points_share_one_area_with_a_notice(capfd):
    points = sphere_points()
    obj = add_object(np.vstack([points, points[:10]]))
    bpy.ops.meshfree.analyze()
    assert "Info: Points that lie on another one: 10." in capfd.readouterr().out
    areas = attribute(obj, "lb_area")
    assert_allclose(areas[:10], areas[1000:], rtol=1e-6)
    assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi, rel=0.01)


def test_report_and_panel_give_the_area_in_scene_units(capfd):
    add_object(sphere_points())
    bpy.context.scene.unit_settings.system = "METRIC"
    bpy.context.scene.unit_settings.scale_length = 0.001
    bpy.ops.meshfree.analyze()
    assert "mm² from 1,000 points" in capfd.readouterr().out


def test_seconds_of_each_stage_are_kept():
    obj = add_object(sphere_points(seed=2))  # points that no other test has, so that no operator is re-used
    bpy.ops.meshfree.analyze(modes=3)
    stages = {stage.name: stage.seconds for stage in obj.meshfree.stages}
    assert {"Neighbors", "Normals", "Areas", "Operator", "Curvature", "Spectrum"} <= stages.keys()
    assert all(seconds >= 0.0 for seconds in stages.values())


def test_second_run_replaces_the_first(core):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    names = obj.data.attributes.keys()
    obj.data.vertices[0].co *= 1.01
    bpy.ops.meshfree.analyze()
    assert sorted(obj.data.attributes.keys()) == sorted(names)
    assert_result(core, obj)


def test_attribute_of_another_kind_is_replaced(core):
    obj = add_object(sphere_points())
    obj.data.attributes.new("lb_area", "FLOAT_COLOR", "POINT")
    obj.data.attributes.new("lb_normal", "FLOAT", "EDGE")
    obj.data.attributes.new("lb_boundary", "FLOAT", "POINT")
    bpy.ops.meshfree.analyze()
    assert result_names(obj) == RESULTS
    assert_result(core, obj)


def test_undo_and_redo():
    name = add_object(sphere_points()).name
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.meshfree.analyze("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    obj = bpy.data.objects[name]
    assert result_names(obj) == []
    assert not obj.modifiers
    assert obj.meshfree.total_area == 0.0
    bpy.ops.ed.redo()
    obj = bpy.data.objects[name]
    assert result_names(obj) == RESULTS
    assert len(obj.modifiers) == 1


@pytest.mark.parametrize("how", ["operator", "setting"])
def test_shared_mesh_becomes_single_by_choice(how):
    obj = add_object(sphere_points())
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    if how == "setting":
        obj.meshfree.make_single_user = True
        bpy.ops.meshfree.analyze()
    else:
        bpy.ops.meshfree.analyze(make_single_user=True)
    assert obj.data != other.data
    assert result_names(obj) == RESULTS
    assert result_names(other) == []


class TestStale:
    @pytest.fixture
    def obj(self):
        obj = add_object(sphere_points())
        bpy.ops.meshfree.analyze(modes=3)
        return obj

    @pytest.fixture
    def is_stale(self, result, obj):
        def after_update():
            bpy.context.view_layer.update()
            return result.is_stale(obj)

        return after_update

    def test_not_after_analysis_or_a_rigid_motion(self, obj, is_stale):
        assert not is_stale()
        obj.rotation_euler = (1.0, 2.0, 3.0)
        obj.location = (5.0, 0.0, 0.0)
        assert not is_stale()

    def test_after_a_moved_point(self, obj, is_stale):
        obj.data.vertices[7].co.x += 0.001
        assert is_stale()

    def test_after_a_change_of_scale(self, obj, is_stale):
        obj.scale = (1.0, 1.001, 1.0)
        assert is_stale()

    def test_after_a_change_of_settings_until_it_is_taken_back(self, obj, is_stale):
        obj.meshfree.neighbors += 1
        assert is_stale()
        obj.meshfree.neighbors -= 1
        assert not is_stale()

    def test_new_analysis_keeps_modes_of_the_same_points_and_removes_those_of_others(self, obj, is_stale):
        bpy.ops.meshfree.analyze()
        assert len(result_names(obj)) == len(RESULTS) + 3
        obj.data.vertices[7].co.x += 0.001
        bpy.ops.meshfree.analyze()
        assert result_names(obj) == RESULTS
        assert "lb_eigenvalues" not in obj
        assert not is_stale()
