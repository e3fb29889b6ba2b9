"""Clouds of some ten points: all runs from seven points on, finite, and errors give advice that helps."""

import numpy as np
import pytest

import core
from benchmarks.samplings import random_sphere
from core.types import Floats
from tools.measure_parts import part_table

SIZES = [7, 8, 10, 12, 16, 20, 30, 50, 100]


def _cube() -> Floats:
    return np.stack(np.meshgrid(*[[0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)


def _shape(name, count):
    rng = np.random.default_rng(count)
    if name == "sphere":
        return random_sphere(count)
    if name == "plane":
        return np.column_stack([rng.random((count, 2)), np.zeros(count)])
    if name == "torus":
        around, across = rng.uniform(0.0, 2.0 * np.pi, (2, count))
        wide = 1.0 + 0.4 * np.cos(across)
        return np.column_stack([wide * np.cos(around), wide * np.sin(around), 0.4 * np.sin(across)])
    return np.concatenate([random_sphere(count), random_sphere(count)[: count // 2]])  # duplicates


def _uses(laplacian):
    yield from (laplacian.areas, laplacian.stiffness.data, laplacian.normals, laplacian.eigenpairs(1).eigenvalues)
    yield from (
        core.measure.mean_curvature(laplacian),
        core.clean.roughness(laplacian),
        core.clean.clean_points(laplacian),
    )
    yield core.measure.principal_curvatures(laplacian).first
    yield core.distance.geodesic_distance(laplacian, [0])
    yield core.distance.logarithmic_map(laplacian, 0)
    parts = core.measure.measure_parts(laplacian)
    yield from (parts.areas, parts.area_uncertainties)
    yield core.distance.harmonic_field(laplacian, [0, 1], [0.0, 1.0])


@pytest.mark.parametrize("count", SIZES)
@pytest.mark.parametrize("name", ["sphere", "plane", "torus", "duplicates"])
def test_all_runs_on_what_neighbors_there_are(name, count):
    points = _shape(name, count)
    laplacian = core.build_laplacian(points)
    known = laplacian.component >= 0
    assert known.mean() > 0.8
    assert laplacian.areas.min() > 0.0
    for values in _uses(laplacian):
        values = values[known] if len(values) == len(points) else values
        assert np.isfinite(values).all()
    assert np.linalg.eigvalsh(laplacian.stiffness.toarray()).min() > -1e-9
    assert core.clean.stray_points(points).mean() < 0.3


def test_corners_of_a_cube_run():
    laplacian = core.build_laplacian(_cube())
    np.testing.assert_allclose(laplacian.areas, laplacian.areas.mean())
    assert (
        abs(core.measure.measure_parts(laplacian).areas[0] - 6.0)
        <= core.measure.measure_parts(laplacian).area_uncertainties[0]
    )


@pytest.mark.parametrize("count", SIZES)
def test_areas_of_spheres_are_within_their_uncertainty(count):
    found = core.measure.measure_parts(core.build_laplacian(random_sphere(count)))
    assert abs(found.areas[0] - 4.0 * np.pi) <= found.area_uncertainties[0]


@pytest.mark.parametrize("options", [{"bandwidth": "local"}, {"bandwidth": "global"}, {"bandwidth": "adaptive"}])
def test_a_neighbor_that_is_not_there_is_extrapolated_and_told(options):
    laplacian = core.build_laplacian(random_sphere(60), options=core.LaplacianOptions(**options))
    told = [text for text in laplacian.notices if "no more than 100 points: 60." in text]
    assert len(told) == (options["bandwidth"] != "adaptive")
    assert np.isfinite(laplacian.areas).all()


def test_the_paper_runs_on_fewer_points_than_its_neighbors():
    laplacian = core.paper.build_laplacian(random_sphere(60))
    assert any("no more than 100 points: 60." in text for text in laplacian.notices)
    assert laplacian.areas.min() > 0.0


@pytest.mark.parametrize("count", [1, 2, 5, 6])
@pytest.mark.parametrize(
    "call", [core.build_laplacian, core.clean.stray_points, core.estimate_normals, core.estimate_areas]
)
def test_as_many_points_as_the_error_asks_for_are_enough(call, count):
    points = random_sphere(7)
    with pytest.raises(core.TooFewPointsError, match=f"at least 7 different points, and there are {count}"):
        call(np.repeat(points[:count], 1 if count == 1 else 3, axis=0))
    call(points)


def test_points_around_lone_ones_help():
    lone = np.concatenate([random_sphere(6), [[9.0, 0.0, 0.0]]])
    with pytest.raises(core.ComponentError, match="1 of 7 points lie apart .* 6 are left.* Add points around them"):
        core.build_laplacian(lone)
    core.build_laplacian(np.concatenate([lone, random_sphere(60), random_sphere(60) + [9.0, 0.0, 0.0]]))


def test_as_many_parts_as_the_error_offers_are_found():
    laplacian = core.build_laplacian(random_sphere(20))
    with pytest.raises(core.TooFewPointsError, match="Ask for at most 4, or add points"):
        core.spectral.segment(laplacian, 6)
    assert len(np.unique(core.spectral.segment(laplacian, 4))) == 4
    with pytest.raises(core.TooFewPointsError, match=r"2\. Add points\."):
        core.spectral.segment(core.build_laplacian(random_sphere(8)), 2)


@pytest.mark.parametrize("name", ["sphere", "torus"])
@pytest.mark.parametrize("detail", [1.0, 4.0])
@pytest.mark.parametrize("count", [7, 8, 12, 20])
def test_a_mesh_is_made_or_too_few_points_are_told(name, count, detail):
    laplacian = core.build_laplacian(_shape(name, count))
    try:
        vertices = core.surface.mesh_surface(laplacian, detail=detail).vertices
    except core.TooFewPointsError:
        return
    assert np.isfinite(vertices).all()


def test_a_sphere_of_thirty_points_has_a_closed_mesh():
    found = core.measure.enclosed_volume(core.build_laplacian(random_sphere(30)))
    assert list(found.openings) == [0]
    assert abs(found.volume / (4.0 / 3.0 * np.pi) - 1.0) < 0.3


def test_parts_are_measured_where_there_are_too_few_points_for_a_volume():
    laplacian = core.build_laplacian(_shape("sphere", 8))
    rows, notices = part_table(laplacian, None, None, True, lambda *_: None)
    assert rows[0].points == 8
    assert np.isnan(rows[0].volume)
    assert any("There is no volume: The 8 points give no mesh" in text for text in notices)
