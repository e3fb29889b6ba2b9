"""Vibration modes of the active object against the same call through core."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, local_points, result_names, sphere_points
from tests.blender.conftest import part


@pytest.fixture
def obj():
    # Three different axes, so that no eigenvalue is double and eigenvectors can be compared.
    return add_object(sphere_points() * (1.0, 1.3, 1.7))


def test_modes_and_eigenvalues_are_those_of_core(core, obj):
    assert bpy.ops.meshfree.spectrum(count=6) == {"FINISHED"}
    laplacian = core.build_laplacian(local_points(obj))
    spectrum = laplacian.eigenpairs(6)
    assert_allclose(obj["lb_eigenvalues"], spectrum.eigenvalues, rtol=1e-9, atol=1e-9)
    for mode in range(6):
        values = attribute(obj, f"lb_eigenvector_{mode + 1:03d}")
        assert_allclose(values, spectrum.eigenvectors[:, mode], atol=1e-5)
    assert_allclose(attribute(obj, "lb_area"), laplacian.areas, rtol=1e-6)


def test_eigenvalues_keep_double_precision(obj):
    bpy.ops.meshfree.spectrum(count=3)
    eigenvalues = obj["lb_eigenvalues"]
    assert eigenvalues.typecode == "d"
    assert eigenvalues[1] != float(np.float32(eigenvalues[1]))


def test_few_modes_are_written_and_all_eigenvalues_kept(obj):
    bpy.ops.meshfree.spectrum(count=8, write_limit=3)
    assert [name for name in result_names(obj) if "eigenvector" in name] == [
        "lb_eigenvector_001",
        "lb_eigenvector_002",
        "lb_eigenvector_003",
    ]
    assert len(obj["lb_eigenvalues"]) == 8


def test_default_limit_is_50(obj):
    assert bpy.ops.meshfree.spectrum.get_rna_type().properties["write_limit"].default == 50


def test_fewer_modes_remove_the_surplus(obj):
    bpy.ops.meshfree.spectrum(count=6)
    bpy.ops.meshfree.spectrum(count=2)
    assert [name for name in result_names(obj) if "eigenvector" in name] == ["lb_eigenvector_001", "lb_eigenvector_002"]
    assert len(obj["lb_eigenvalues"]) == 2


def test_repeating_re_uses_the_operator(core, obj, monkeypatch):
    cache = part("operators.running.cache")
    built, curved = [], []
    build, curve = core.build_laplacian, core.measure.measure_mean_curvature
    monkeypatch.setattr(core, "build_laplacian", lambda *args, **rest: built.append(1) or build(*args, **rest))
    monkeypatch.setattr(core.measure, "measure_mean_curvature", lambda laplacian: curved.append(1) or curve(laplacian))
    cache.clear()
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.spectrum(count=2)
    bpy.ops.meshfree.spectrum(count=3)
    assert len(built) == len(curved) == 1
    assert [stage.name for stage in obj.meshfree.stages] == ["Spectrum"]
    obj.meshfree.neighbors += 1
    bpy.ops.meshfree.spectrum(count=3)
    obj.data.vertices[0].co *= 1.01
    bpy.ops.meshfree.spectrum(count=3)
    assert len(built) == len(curved) == 3


def test_scale_of_the_object_scales_eigenvalues(obj):
    bpy.ops.meshfree.spectrum(count=4)
    before = np.array(obj["lb_eigenvalues"])
    obj.scale = (2.0, 2.0, 2.0)
    bpy.ops.meshfree.spectrum(count=4)
    assert_allclose(obj["lb_eigenvalues"][1:], before[1:] / 4.0, rtol=1e-6)


def test_too_many_modes_are_refused_and_change_nothing(obj):
    with pytest.raises(RuntimeError, match="modes"):
        bpy.ops.meshfree.spectrum(count=1000)
    assert result_names(obj) == []
    assert "lb_eigenvalues" not in obj


@pytest.mark.parametrize("operator", ["analyze", "spectrum"])
def test_a_small_cloud_gets_the_modes_that_it_resolves(operator):
    obj = add_object(sphere_points(150))
    arguments = {"modes": 40} if operator == "analyze" else {"count": 40}
    assert getattr(bpy.ops.meshfree, operator)(**arguments) == {"FINISHED"}
    assert 1 <= len(obj["lb_eigenvalues"]) < 40
    assert len([name for name in result_names(obj) if "eigenvector" in name]) == len(obj["lb_eigenvalues"])
