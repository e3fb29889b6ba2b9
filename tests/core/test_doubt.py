"""Why results are in doubt: each cause on a cloud that has it, and none on clean ones."""

import numpy as np
import pytest

import core
from benchmarks.awkward import box
from benchmarks.samplings import fibonacci_sphere, noisy_sphere, random_sphere, torus_points
from core import Doubt
from core.geometry.boundary import no_boundary
from core.geometry.cells import measure_cells
from core.geometry.doubt import likely_causes
from core.geometry.nearest import find_nearest
from core.geometry.rows import look_across_rows


def ball():
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 3))
    return points[np.linalg.norm(points, axis=1) < 1.0]


def two_spheres():
    """Random points of two spheres whose distance is 0.8 of the spacing of either."""
    gap = 0.8 * np.sqrt(4.0 * np.pi / 2000)
    return np.concatenate([random_sphere(2000), (1.0 + gap) * random_sphere(2000, 1)])


CLOUDS = {  # on fewer points other causes weigh as much
    Doubt.FEW: lambda: box([1.0, 1.0, 1.0], 300),
    Doubt.VOLUME: ball,
    Doubt.NOISE: lambda: noisy_sphere(4000, 1.2),
    Doubt.SHEETS: two_spheres,
}
SAID = {
    Doubt.FEW: "too few",
    Doubt.VOLUME: "fill a volume",
    Doubt.NOISE: "noise is about",
    Doubt.ROWS: "in rows",
    Doubt.SHEETS: "sheets of it",
}


@pytest.fixture(scope="module", params=CLOUDS, ids=lambda cause: cause.name)
def told(request):
    return request.param, core.build_laplacian(CLOUDS[request.param]())


def test_the_cause_of_a_cloud_is_that_of_most_doubts(told):
    cause, laplacian = told
    shares = np.bincount(laplacian.doubt, laplacian.areas, len(Doubt)) / laplacian.areas.sum()
    assert shares[cause] > 0.02
    assert shares[cause] > 0.7 * shares[1:].sum()


def test_one_notice_names_it(told):
    cause, laplacian = told
    (notice,) = [notice for notice in laplacian.notices if "LaplaceBeltrami.doubt" in notice]
    assert [other for other, text in SAID.items() if text in notice] == [cause]


def test_there_is_a_cause_where_trust_is_low_and_nowhere_else(told):
    laplacian = told[1]
    np.testing.assert_array_equal(laplacian.doubt > 0, laplacian.trust < 0.5)
    np.testing.assert_array_equal(laplacian.doubt == Doubt.LEFT_OUT, laplacian.component < 0)


def test_the_cause_moves_with_the_points(told):
    laplacian = told[1]
    order = np.random.default_rng(1).permutation(len(laplacian.points))
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    after = core.build_laplacian((7e3 * laplacian.points @ turn + 4.0)[order])
    before = laplacian.doubt[order]
    assert np.mean(after.doubt == before) > 0.95  # where moments cannot be met, what is left depends on rounding
    both = (after.doubt > 0) & (before > 0)
    np.testing.assert_array_equal(after.doubt[both], before[both])


@pytest.mark.parametrize(
    "points",
    [random_sphere(1000), fibonacci_sphere(1000), torus_points(4000), noisy_sphere(1000, 0.3)],
    ids=["random sphere", "even sphere", "torus", "noisy sphere"],
)
def test_clean_clouds_have_no_doubts(points):
    laplacian = core.build_laplacian(points)
    assert not laplacian.doubt.any()
    assert not any("LaplaceBeltrami.doubt" in notice for notice in laplacian.notices)


def test_an_outlier_is_in_doubt_as_it_is_left_out():
    laplacian = core.build_laplacian(np.concatenate([random_sphere(1000), [[0.0, 0.0, 3.0]]]))
    assert laplacian.doubt[-1] == Doubt.LEFT_OUT
    assert not laplacian.doubt[:-1].any()


def test_a_small_cause_is_named_with_its_own_share():
    """A ball beside a bar: two causes, of which the larger is named."""
    bar = box([1.0, 0.2, 0.2], 300) + [3.0, 0.0, 0.0]
    laplacian = core.build_laplacian(np.concatenate([ball(), bar]))
    shares = np.bincount(laplacian.doubt, laplacian.areas, len(Doubt)) / laplacian.areas.sum()
    (notice,) = [notice for notice in laplacian.notices if "LaplaceBeltrami.doubt" in notice]
    assert shares[Doubt.FEW] > 0.005
    assert SAID[Doubt.VOLUME] in notice


def test_a_width_of_the_callers_choice_is_not_blamed():
    options = core.LaplacianOptions(bandwidth="local", neighbors=40, bandwidth_factor=0.4)
    laplacian = core.build_laplacian(ball(), options=options)
    assert laplacian.doubt.any()
    assert not any("LaplaceBeltrami.doubt" in notice for notice in laplacian.notices)


@pytest.mark.parametrize(("across", "cause"), [(1.0, Doubt.FEW), (8.0, Doubt.ROWS)])
def test_cells_are_long_where_points_lie_in_rows(across, cause):
    along, row = np.meshgrid(np.arange(160.0), across * np.arange(21.0))
    points = np.stack([along.ravel(), row.ravel(), np.zeros(along.size)], axis=1)
    nearest, normals = look_across_rows(find_nearest(points)), np.tile([0.0, 0.0, 1.0], (len(points), 1))
    cells = measure_cells(nearest, normals, np.zeros(len(points)), no_boundary(len(points)))
    inner = (np.abs(points[:, 0] - 80.0) < 40.0) & (np.abs(points[:, 1] - 10.0 * across) < 5.0 * across)
    assert np.all(likely_causes(nearest, normals, cells, np.zeros((2, len(points))))[inner] == cause)
