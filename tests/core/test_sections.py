"""Cross sections: the right length and area, holes subtracted, on plane and surface, wherever the points lie."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ellipe

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere


@pytest.fixture(scope="module")
def cylinder():
    rng = np.random.default_rng(5)
    angle, z = rng.uniform(0.0, 2.0 * np.pi, 3000), rng.uniform(0.0, 2.0, 3000)
    return core.build_laplacian(np.column_stack([np.cos(angle), np.sin(angle), z]))


@pytest.mark.parametrize("height", [0.0, 0.5, -0.9])
@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (2.0, -1.0, 2.0)])
def test_sections_of_a_sphere_are_circles(operators, height, normal):
    across = np.array(normal) / np.linalg.norm(normal)
    found = core.measure.cross_section(operators("another random sphere"), height * across, normal)
    (circle,) = found.curves
    assert circle.closed
    assert found.length == pytest.approx(2.0 * np.pi * np.sqrt(1.0 - height**2), rel=1e-3)
    assert found.enclosed_area == pytest.approx(np.pi * (1.0 - height**2), rel=3e-3)
    np.testing.assert_allclose(circle.points @ across, height, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(circle.points, axis=1), 1.0, rtol=0.0, atol=1e-3)
    assert not found.notices


def test_a_torus_cut_flat_is_a_ring(operators):
    found = core.measure.cross_section(operators("random torus"), (0.0, 0.0, 0.2), (0.0, 0.0, 1.0))
    outer, inner = found.curves
    wide = np.sqrt(0.4**2 - 0.2**2)
    assert outer.enclosed_area == pytest.approx(np.pi * (1.0 + wide) ** 2, rel=3e-3)
    assert inner.enclosed_area == pytest.approx(-np.pi * (1.0 - wide) ** 2, rel=3e-3)
    assert found.enclosed_area == pytest.approx(np.pi * 4.0 * wide, rel=3e-3)
    assert found.length == pytest.approx(4.0 * np.pi, rel=3e-3)


def test_a_torus_cut_upright_is_two_circles(operators):
    found = core.measure.cross_section(operators("random torus"), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert [curve.closed for curve in found.curves] == [True, True]
    for curve in found.curves:
        assert curve.length == pytest.approx(2.0 * np.pi * 0.4, rel=3e-3)
        assert curve.enclosed_area == pytest.approx(np.pi * 0.16, rel=5e-3)


def test_a_cylinder_cut_aslant_is_an_ellipse(cylinder):
    found = core.measure.cross_section(cylinder, (0.0, 0.0, 1.0), (0.0, 0.5, 1.0))
    assert found.length == pytest.approx(4.0 * np.sqrt(1.25) * ellipe(0.2), rel=3e-3)
    assert found.enclosed_area == pytest.approx(np.pi * np.sqrt(1.25), rel=3e-3)


def test_along_a_cylinder_the_section_is_open_and_encloses_nothing(cylinder):
    found = core.measure.cross_section(cylinder, (0.5, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert [curve.closed for curve in found.curves] == [False, False]
    assert found.length == pytest.approx(4.0, rel=0.015)  # each end is known by a third of a spacing
    assert found.enclosed_area == 0.0
    assert "2 of 2 curves of the section are open" in found.notices[0]
    for curve in found.curves:
        np.testing.assert_allclose(np.abs(curve.points[:, 1]), np.sqrt(0.75), rtol=0.0, atol=2e-3)


def test_what_lies_inside_is_a_hole_and_what_lies_in_that_is_none():
    radii = np.array([1.5, 1.0, 0.5])
    points = np.concatenate([radius * fibonacci_sphere(int(1200 * radius**2)) for radius in radii])
    found = core.measure.cross_section(core.build_laplacian(points), (0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    areas = [curve.enclosed_area for curve in found.curves]
    np.testing.assert_allclose(areas, np.pi * radii**2 * [1.0, -1.0, 1.0], rtol=0.005)


def test_it_follows_turn_translation_scale_and_order():
    points, rng = random_sphere(1500, 3) * [1.0, 0.8, 0.6], np.random.default_rng(1)
    place, normal = np.array([0.1, 0.2, 0.1]), np.array([1.0, 2.0, -1.0])
    before = core.measure.cross_section(core.build_laplacian(points), place, normal)
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    moved = 50.0 * points[rng.permutation(len(points))] @ turn.T + 7.0
    laplacian = core.build_laplacian(moved)
    after = core.measure.cross_section(laplacian, 50.0 * turn @ place + 7.0, -3.0 * turn @ normal)
    assert after.length == pytest.approx(50.0 * before.length, rel=1e-3)
    assert after.enclosed_area == pytest.approx(2500.0 * before.enclosed_area, rel=2e-3)
    shifted = core.measure.cross_section(core.build_laplacian(5.0 * points - 2.0), 5.0 * place - 2.0, normal)
    np.testing.assert_allclose(shifted.curves[0].points, 5.0 * before.curves[0].points - 2.0, rtol=0.0, atol=1e-6)


def test_beside_the_surface_there_are_no_curves(operators):
    found = core.measure.cross_section(operators("another random sphere"), (0.0, 0.0, 1.1), (0.0, 0.0, 1.0))
    assert not found.curves
    assert (found.length, found.enclosed_area) == (0.0, 0.0)


def test_where_the_plane_only_touches_it_is_said(operators):
    found = core.measure.cross_section(operators("another random sphere"), (0.0, 0.0, 0.997), (0.0, 0.0, 1.0))
    assert any("the plane only touches the surface" in notice for notice in found.notices)


def test_curves_shorter_than_the_spacing_are_left_out_and_counted(operators):
    laplacian = operators("another random sphere")
    top = core.surface.mesh_surface(laplacian).vertices[:, 2].max()
    found = core.measure.cross_section(laplacian, (0.0, 0.0, top - 1e-7), (0.0, 0.0, 1.0))
    assert not found.curves
    assert "1 curves shorter than" in found.notices[0]


def test_it_can_be_cancelled():
    def cancel(stage, fraction):
        if stage == "Section":
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.measure.cross_section(core.build_laplacian(core.example_sphere()), (0, 0, 0), (0, 0, 1), progress=cancel)


@pytest.mark.parametrize(
    ("point", "normal", "text"),
    [
        ((0, 0), (0, 0, 1), "point of the plane"),
        ((0, 0, np.nan), (0, 0, 1), "point of the plane"),
        ((0, 0, 0), (0, 0, np.inf), "normal of the plane"),
        ((0, 0, 0), (0, 0, 0), "has length 0"),
        ((0, 0, 0), "up", "normal of the plane"),
    ],
)
def test_what_is_no_plane_is_refused(operators, point, normal, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.measure.cross_section(operators("another random sphere"), point, normal)
