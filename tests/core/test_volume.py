import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, sausage


@pytest.fixture(scope="module")
def ball():
    return core.build_laplacian(fibonacci_sphere(1500))


def test_a_ball_and_a_torus(operators, ball):
    found = core.measure.enclosed_volume(ball)
    assert found.volume == pytest.approx(4.0 * np.pi / 3.0, rel=1e-3)
    assert abs(found.volume - 4.0 * np.pi / 3.0) < found.uncertainty < 0.02 * found.volume
    assert found.openings.tolist() == [0]
    assert found.notices == []
    ring = core.measure.enclosed_volume(operators("coarse torus"))
    assert ring.volume == pytest.approx(2.0 * np.pi**2 * 0.4**2, rel=3e-3)


def test_it_follows_translation_and_scale():
    points = random_sphere(1000) * [1.0, 0.8, 0.6]
    before = core.measure.enclosed_volume(core.build_laplacian(points))
    after = core.measure.enclosed_volume(core.build_laplacian(2.0 * points + [50.0, 0.0, -3.0]))
    assert before.volume == pytest.approx(4.0 * np.pi / 3.0 * 0.48, rel=5e-3)
    assert after.volume == pytest.approx(8.0 * before.volume, rel=5e-3)  # the grid lies elsewhere


@pytest.mark.parametrize("height", [0.9, 0.7])
def test_a_hole_is_closed_and_its_doubt_stated(height):
    points = fibonacci_sphere(1500)
    found = core.measure.enclosed_volume(core.build_laplacian(points[points[:, 2] < height]))
    assert found.openings.tolist() == [1]
    assert "1 openings" in found.notices[0]
    missing = np.pi * (1.0 - height) ** 2 * (2.0 + height) / 3.0
    assert abs(found.volume - 4.0 * np.pi / 3.0) < min(found.uncertainty, missing)
    assert found.uncertainty < 0.5 * found.volume


def test_an_upright_vessel_is_closed_flat():
    """A cylinder without its ends: walls that end upright are no dome, and may go on for two radii at both ends."""
    rng = np.random.default_rng(0)
    angle, z = rng.uniform(0.0, 2.0 * np.pi, 2500), rng.uniform(0.0, 2.0, 2500)
    found = core.measure.enclosed_volume(core.build_laplacian(np.column_stack([np.cos(angle), np.sin(angle), z])))
    assert found.openings.tolist() == [2]
    assert found.volume == pytest.approx(2.0 * np.pi, rel=0.05)
    assert found.uncertainty > 0.9 * 4.0 * np.pi


@pytest.mark.parametrize("left", [1.0, 1.8])
def test_a_limb_cut_off_is_within_the_doubt_up_to_its_width(left):
    """A capsule of three radii and one more cut through its straight part: what is missing is a tube and a dome."""
    capsule = sausage(2500, radius=1.0, length=3.0)[0]
    low = capsule[:, 0].min()
    found = core.measure.enclosed_volume(core.build_laplacian(capsule[capsule[:, 0] < low + 5.0 - left]))
    assert found.openings.tolist() == [1]
    assert 0.3 < abs(found.volume - (4.0 / 3.0 + 3.0) * np.pi) < found.uncertainty
    assert any("cut off" in notice for notice in found.notices)


def test_a_component_inside_another_is_a_cavity(ball):
    points = np.concatenate([fibonacci_sphere(1500), 0.5 * fibonacci_sphere(700), 0.5 * fibonacci_sphere(700) + 3.0])
    found = core.measure.enclosed_volume(core.build_laplacian(points))
    third = 4.0 * np.pi / 3.0
    assert found.volume == pytest.approx(third, rel=3e-3)
    np.testing.assert_allclose(found.volumes, third * np.array([1.0, 0.125, 0.125]), rtol=5e-3)
    assert any("1 of 3 components lie inside others" in notice for notice in found.notices)


def test_normals_to_both_sides_are_said_and_do_not_matter(ball):
    points = fibonacci_sphere(1500)
    normals = points * np.where(points[:, :1] > 0.2, -1.0, 1.0)
    found = core.measure.enclosed_volume(core.build_laplacian(points, normals))
    assert found.volume == pytest.approx(core.measure.enclosed_volume(ball).volume, rel=1e-3)
    assert "The normals of 40% of the area" in found.notices[-1]


def test_a_flat_sheet_has_a_doubt_and_no_volume(operators):
    found = core.measure.enclosed_volume(operators("random square"))
    assert found.uncertainty > 0.05
    assert abs(found.volume) < found.uncertainty
    assert found.openings.sum() >= 1


def test_a_mesh_that_there_is_already_gives_the_same():
    laplacian = core.build_laplacian(core.example_sphere())
    alone = core.measure.enclosed_volume(laplacian)
    laplacian.release()
    core.surface.mesh_surface(laplacian)
    given = core.measure.enclosed_volume(laplacian)
    assert given.volume == alone.volume
    assert given.uncertainty == alone.uncertainty
