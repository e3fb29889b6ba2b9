"""More points than the budget: a subset is analyzed, and its results carried to all points."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, local_points, result_names, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.results import RESULTS
from tools.quantities import rows_of


@pytest.fixture
def free(core, cache, monkeypatch):
    """Function that sets how many points the free memory is enough for."""
    memory = part("core.memory")
    need = memory.needed_memory(1, core.LaplacianOptions())
    return lambda count: monkeypatch.setattr(memory, "available_memory", lambda: 1.25 * need * (count + 0.5))


def limited(points, most=1000):
    """Add an object with a budget."""
    obj = add_object(points)
    obj.meshfree.point_budget = "NUMBER"
    obj.meshfree.most_points = most
    return obj


def test_results_are_carried_to_all_points(core):
    obj = limited(sphere_points(6000))
    assert bpy.ops.meshfree.analyze(modes=9) == {"FINISHED"}
    points = local_points(obj)
    assert 900 <= obj.meshfree.subset_count <= 1000
    assert obj.meshfree.point_count == 6000
    assert {*RESULTS} - {*result_names(obj)} == {"lb_disc"}  # as many as were not analyzed are drawn as dots
    assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi, rel=2e-3)
    assert attribute(obj, "lb_area").sum() == pytest.approx(obj.meshfree.total_area, rel=1e-5)
    assert_allclose(attribute(obj, "lb_normal"), points, atol=0.05)
    assert_allclose(attribute(obj, "lb_mean_curvature"), 1.0, atol=0.05)
    assert not attribute(obj, "lb_boundary").any()
    assert not attribute(obj, "lb_component").any()
    assert_allclose(obj["lb_eigenvalues"][1:4], 2.0, rtol=0.01)
    modes = np.column_stack([attribute(obj, f"lb_eigenvector_{mode:03d}") for mode in (2, 3, 4)])
    fit = np.linalg.lstsq(modes, points, rcond=None)[0]
    assert np.abs(modes @ fit - points).max() < 0.02  # the modes of degree 1 are the coordinates


def test_values_at_the_subset_are_those_of_its_operator_and_others_take_theirs_from_these(core):
    bowl = sphere_points(3000)
    bowl = bowl[bowl[:, 2] < 0.3]
    obj = limited(np.concatenate([bowl, bowl + [3.0, 0.0, 0.0]]))
    bpy.ops.meshfree.analyze()
    points = local_points(obj)
    subset = core.clean.blue_noise_subset(points, 1000)
    laplacian = core.build_laplacian(points[subset])
    built = SimpleNamespace(laplacian=laplacian, mean_curvature=core.measure.mean_curvature(laplacian))
    nearest = core.clean.Prolongation(points, subset, laplacian.normals, laplacian.component).nearest
    assert obj.meshfree.subset_count == len(subset)
    for row in rows_of("analyze"):
        values, known = attribute(obj, row.attribute), row.of(built)
        if row.attribute == "lb_area":
            assert values.sum() == pytest.approx(known.sum(), rel=1e-5)
            continue
        assert_allclose(values[subset], known, rtol=1e-5, atol=1e-6, err_msg=row.attribute)
        if values.dtype.kind != "f":
            assert (values == known[nearest]).all(), row.attribute


def test_modes_beyond_those_written_keep_their_eigenvalue():
    obj = limited(sphere_points(2000))
    bpy.ops.meshfree.analyze(modes=6, write_limit=2)
    assert len(obj["lb_eigenvalues"]) == 6
    assert [name for name in result_names(obj) if "vector" in name] == ["lb_eigenvector_001", "lb_eigenvector_002"]


def test_a_budget_that_is_enough_changes_nothing():
    obj = limited(sphere_points(), most=1000)
    bpy.ops.meshfree.analyze()
    within = everything(obj)["attributes"]
    obj.meshfree.point_budget = "ALL"
    bpy.ops.meshfree.analyze()
    assert everything(obj)["attributes"] == within
    assert obj.meshfree.subset_count == 0


def test_the_boundary_group_is_read_of_the_subset(core):
    points = sphere_points(6000)
    obj = limited(points[points[:, 2] > 0.0])
    bpy.ops.meshfree.analyze()
    at_boundary = attribute(obj, "lb_boundary")
    assert at_boundary.any()
    assert np.abs(local_points(obj)[at_boundary][:, 2]).max() < 0.2
    assert obj.meshfree.total_area == pytest.approx(2.0 * np.pi, rel=0.02)


@pytest.mark.parametrize(
    ("before", "after", "stale"),
    [
        ("NUMBER", "NUMBER", False),
        ("NUMBER", "AUTO", True),
        ("NUMBER", "ALL", True),
        ("ALL", "NUMBER", True),
        ("ALL", "AUTO", False),
    ],
)
def test_results_are_stale_where_another_number_is_asked_for(result, before, after, stale):
    obj = limited(sphere_points(2000))
    obj.meshfree.point_budget = before
    bpy.ops.meshfree.analyze()
    assert not result.is_stale(obj)
    obj.meshfree.point_budget = after
    assert result.is_stale(obj) == stale


def test_automatic_takes_what_fits(free):
    obj = add_object(sphere_points(5000))
    free(5000)
    bpy.ops.meshfree.analyze()
    assert obj.meshfree.subset_count == 0


def test_automatic_takes_a_subset_where_all_do_not_fit(free, capfd):
    obj = add_object(sphere_points(5000))
    free(4999)
    bpy.ops.meshfree.analyze()
    assert 1800 <= obj.meshfree.subset_count <= 2000  # a round number that takes half at most
    assert "of 5,000 points" in capfd.readouterr().out
    free(4000)
    bpy.ops.meshfree.spectrum(count=3)  # the same one, as it is kept
    assert 1800 <= obj.meshfree.subset_count <= 2000


def test_an_operator_that_is_kept_is_used_whatever_is_free(free):
    obj = add_object(sphere_points(2000))
    bpy.ops.meshfree.analyze()
    free(1500)
    bpy.ops.meshfree.spectrum(count=3)
    assert obj.meshfree.subset_count == 0


def test_all_points_are_refused_where_they_do_not_fit(free):
    obj = add_object(sphere_points(5000))
    obj.meshfree.point_budget = "ALL"
    free(4000)
    with refused(obj, r'"Cloud": 5,000 points would take .* enough for 4,000 points'):
        bpy.ops.meshfree.analyze()


def test_other_tools_refuse_what_does_not_fit(free):
    obj = add_object(sphere_points(5000))
    free(4000)
    with refused(obj, "Use fewer points"):
        bpy.ops.meshfree.segment()


def test_what_is_kept_is_given_back_where_memory_is_short(cache, free):
    add_object(sphere_points(1000), "First")
    bpy.ops.meshfree.analyze()
    kept = set(cache._kept)
    add_object(sphere_points(3000), "Second").meshfree.point_budget = "ALL"
    free(2000)
    with pytest.raises(RuntimeError, match="GB are free"):
        bpy.ops.meshfree.analyze()
    assert not kept & set(cache._kept)
