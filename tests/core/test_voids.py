"""Slits, cracks and narrow doors: voids of a few spacings over which the surface must not go on."""

import re

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import eigsh

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, torus_points
from benchmarks.surveys import in_order, survey
from core.geometry.boundary import measure_boundary, no_boundary
from core.geometry.cells import measure_cells
from core.geometry.cloud import read_cloud
from core.geometry.nearest import find_nearest
from core.geometry.quadrics import frames
from core.options import LaplacianOptions

ACROSS = "Voids that the surface goes on over"


def slit_square(kind, count, wide, seed, deep=0.75):
    """Points of [-1, 1]^2 with a slit so many spacings wide from below, and half the slit's width."""
    rng = np.random.default_rng(seed)
    spacing = 2.0 / np.sqrt(count)
    half = 0.5 * wide * spacing
    if kind == "random":
        points = rng.uniform(-1.0, 1.0, (count, 2))
    else:
        many = round(np.sqrt(count))
        side = (np.arange(many) + 0.5) * 2.0 / many - 1.0 if kind == "uneven" else np.linspace(-1.0, 1.0, many)
        points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        points += rng.uniform(-0.3, 0.3, points.shape) * spacing * (kind == "uneven")
    inside = (np.abs(points[:, 0]) < half) & (points[:, 1] < 2.0 * deep - 1.0)
    if kind == "grid":  # the next columns are where the slit ends
        half = np.abs(points[~inside & (np.abs(points[:, 1]) < 0.4), 0]).min()
    return np.column_stack([points[~inside], np.zeros(np.count_nonzero(~inside))]), half


def slit_eigenvalue(half, deep=0.75, cells=200):
    """The first eigenvalue of the slit square above zero, by finite differences on a half: its function is odd in x."""
    size = 2.0 / cells
    middle = size * (np.arange(cells) + 0.5) - 1.0
    x, y = np.meshgrid(middle[cells // 2 :], middle, indexing="ij")
    inside = ~((x < half) & (y < 2.0 * deep - 1.0))
    number = np.where(inside, np.cumsum(inside).reshape(inside.shape) - 1, -1)
    pairs = np.concatenate(
        [
            np.stack([one.ravel(), other.ravel()])
            for one, other in ((number[:-1], number[1:]), (number[:, :-1], number[:, 1:]))
        ],
        axis=1,
    )
    pairs = pairs[:, (pairs >= 0).all(axis=0)]
    weights = sparse.csr_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(inside.sum(),) * 2)
    weights = weights + weights.T
    stiffness = sparse.diags_array(weights.sum(axis=1) + 2.0 * (x[inside] < size)) - weights
    return eigsh((stiffness / size**2).tocsc(), 1, sigma=0.0)[0][0]


@pytest.mark.parametrize(
    ("kind", "count", "wide", "seed"),
    [
        ("random", 4_000, 4.0, 1),
        ("random", 4_000, 6.0, 2),
        ("random", 4_000, 9.0, 3),
        ("uneven", 4_000, 4.0, 1),
        ("uneven", 4_000, 12.0, 11),
        ("grid", 2_500, 4.0, 0),
        ("grid", 2_500, 7.0, 0),
        ("grid", 4_000, 12.0, 0),  # wide, and coarser in fewer points
    ],
)
def test_a_slit_of_four_spacings_and_more_is_a_boundary(kind, count, wide, seed):
    points, half = slit_square(kind, count, wide, seed)
    laplacian = core.build_laplacian(points)
    assert laplacian.eigenpairs(2).eigenvalues[1] == pytest.approx(slit_eigenvalue(half), rel=0.1)
    assert laplacian.areas.sum() == pytest.approx(4.0 - 3.0 * half, rel=0.015)
    assert not any(ACROSS in notice for notice in laplacian.notices)


def test_a_slit_on_a_bent_noisy_sheet_in_millimetres_is_a_boundary():
    """Rolled up, the sheet is the same within itself."""
    flat, half = slit_square("random", 5_000, 6.0, 4)
    bent = np.column_stack([np.sin(flat[:, 0]), flat[:, 1], np.cos(flat[:, 0])])
    bent += 0.05 * (2.0 / np.sqrt(5_000)) * np.random.default_rng(0).standard_normal(bent.shape)
    found = core.build_laplacian(1000.0 * bent).eigenpairs(2).eigenvalues[1]
    assert 1e6 * found == pytest.approx(slit_eigenvalue(half), rel=0.1)


def test_a_slit_within_a_sheet_is_a_boundary():
    """Heat goes around it: of the square [-1, 1]^2 with a wall at x = 0, |y| < .6, fields odd in x change there."""
    points, half = slit_square("random", 8_000, 5.0, 6, deep=1.0)
    fill = np.random.default_rng(7).uniform(-1.0, 1.0, (8_000, 2))
    fill = fill[(np.abs(fill[:, 0]) < half) & (np.abs(fill[:, 1]) > 0.6)]
    points = np.concatenate([points, np.column_stack([fill, np.zeros(len(fill))])])
    laplacian = core.build_laplacian(points)
    x, y = points[:, 0], points[:, 1]
    rims = laplacian.boundary & (np.abs(x) < half + 0.05) & (np.abs(y) < 0.5)
    assert np.histogram(y[rims & (x < 0.0)], 10, (-0.5, 0.5))[0].min() > 0
    assert np.histogram(y[rims & (x > 0.0)], 10, (-0.5, 0.5))[0].min() > 0
    first, second = laplacian.stiffness.tocoo().coords
    over = (x[first] < 0.0) & (x[second] > 0.0) & (np.abs(y[first]) < 0.5) & (np.abs(y[second]) < 0.5)
    assert np.count_nonzero(over) == 0


def test_sheets_side_by_side_have_the_eigenvalues_of_both():
    """Two of 1 x 2, four spacings apart: each value of one sheet twice."""
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (5_000, 2))
    points[:, 0] += np.where(points[:, 0] > 0.0, 2.0, -2.0) * 2.0 / np.sqrt(5_000)
    laplacian = core.build_laplacian(np.column_stack([points, np.zeros(len(points))]))
    exact = np.repeat(np.sort((np.pi**2 * (np.arange(4.0)[:, None] ** 2 + np.arange(6) ** 2 / 4.0)).ravel()), 2)
    found = laplacian.eigenpairs(10).eigenvalues
    np.testing.assert_allclose(found[2:], exact[2:10], rtol=0.05)
    assert found[1] < 1e-6


@pytest.mark.parametrize(("kind", "wide"), [("random", 2.5), ("uneven", 2.0), ("grid", 2.0)])
def test_a_slit_that_is_bridged_is_told_where_it_is(kind, wide):
    points = slit_square(kind, 8_000, wide, 1)[0]
    cloud = read_cloud(1000.0 * points + (5e5, 5e6, 100.0), LaplacianOptions())
    [notice] = [notice for notice in cloud.notices if ACROSS in notice]
    place = [float(word) for word in re.search(r"at \((.*?)\)", notice)[1].split(",")]
    x, y = 1e-3 * (np.array(place[:2]) - (5e5, 5e6))
    assert abs(x) < (0.5 * wide + 1.5) * 2.0 / np.sqrt(8_000)
    assert y < 0.6


CLOSED = {
    "random sphere": random_sphere(8_000),
    "even sphere": fibonacci_sphere(2_000),
    "random torus": torus_points(6_000),
    "thin torus": torus_points(4_000, minor=0.15),
}


def clumps(count, mean, size, seed):
    """A sphere with points in clumps of so many on average, within so many spacings."""
    rng = np.random.default_rng(seed)
    centers = rng.standard_normal((count // mean, 3))
    points = np.repeat(centers / np.linalg.norm(centers, axis=1)[:, None], rng.poisson(mean, len(centers)), axis=0)
    points += size * np.sqrt(4.0 * np.pi / count) * rng.standard_normal(points.shape)
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.mark.parametrize("name", CLOSED)
def test_there_are_no_voids_between_even_or_random_points(name):
    cloud = read_cloud(CLOSED[name], LaplacianOptions())
    assert not cloud.boundary.at_boundary.any()
    assert not any(ACROSS in notice for notice in cloud.notices)


@pytest.mark.parametrize(("mean", "size", "seed"), [(8, 2.0, 0), (3, 0.7, 1), (8, 1.0, 2), (20, 3.0, 3)])
def test_clumps_make_no_slits(mean, size, seed):
    assert not read_cloud(clumps(12_000, mean, size, seed), LaplacianOptions()).boundary.at_boundary.any()


@pytest.mark.parametrize(("ratio", "bands"), [(30.0, 1), (4.0, 8), (8.0, 24)])
def test_where_densities_meet_there_is_no_slit(ratio, bands):
    points = random_sphere(20_000, 4)
    dense = (np.sin(np.pi * bands * points[:, 2]) < 0.0) | (np.random.default_rng(2).random(20_000) < 1.0 / ratio)
    assert not read_cloud(points[dense], LaplacianOptions()).boundary.at_boundary.any()


@pytest.mark.parametrize("jitter", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("ratio", [3, 6, 12])
def test_there_are_no_slits_between_scan_lines(ratio, jitter):
    """All points at a boundary are within two lines of the sheet's own."""
    along = int(np.sqrt(3_000 / ratio))
    sides = np.linspace(-1.0, 1.0, along), np.linspace(-1.0, 1.0, along * ratio)
    points = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    step = 2.0 / np.array([along, along * ratio])
    points += np.random.default_rng(3).uniform(-0.5, 0.5, points.shape) * jitter * step
    cloud = read_cloud(np.column_stack([points, 0.2 * points[:, 0] ** 2]), LaplacianOptions())
    ends = points[cloud.scaled.first[cloud.boundary.at_boundary]]
    assert (np.abs(ends) > 1.0 - 2.0 * step.max()).any(axis=1).all()


def test_a_pair_over_a_strip_without_points_is_parted_and_none_beside_it():
    points = np.stack(np.meshgrid(np.arange(40.0), np.arange(40.0)), axis=-1).reshape(-1, 2)
    points = points[(points[:, 0] < 18.0) | (points[:, 0] > 21.0)]
    points = np.column_stack([points, np.zeros(len(points))])
    nearest, normals = find_nearest(points), np.tile([0.0, 0.0, 1.0], (len(points), 1))
    x = points[:, 0]
    boundary = measure_boundary(nearest, normals, (x == 17.0) | (x == 22.0))
    first, second = nearest.tree.query_pairs(7.5, output_type="ndarray").T
    over = (x[first] < 20.0) != (x[second] < 20.0)
    assert np.count_nonzero(over) > 100
    parted = np.zeros(len(first), dtype=bool)
    parted[boundary.parting(nearest.tree, normals, first, second, np.full(len(points), np.sqrt(0.5)))] = True
    np.testing.assert_array_equal(parted, over)


def test_no_pair_of_a_coarse_dome_is_parted():
    """Its chords leave the surface, their arcs do not."""
    points = fibonacci_sphere(600)
    points = points[points[:, 2] > 0.0]
    nearest = find_nearest(points)
    boundary = measure_boundary(nearest, points, points[:, 2] < 0.06)
    first, second = nearest.tree.query_pairs(0.9, output_type="ndarray").T
    gaps = np.full(len(points), 0.6 * np.sqrt(4.0 * np.pi / 600))
    assert len(first) > 10_000
    assert np.isfinite(boundary.distance[:, 0]).all()
    assert len(boundary.parting(nearest.tree, points, first, second, gaps)) == 0


def test_the_furthest_corner_of_a_cell_is_as_far_as_its_radius_and_no_point_is_nearer_to_it():
    points = np.column_stack([np.random.default_rng(0).uniform(0.0, 1.0, (2_000, 2)), np.zeros(2_000)])
    nearest, normals = find_nearest(points), np.tile([0.0, 0.0, 1.0], (2_000, 1))
    cells = measure_cells(nearest, normals, np.zeros(2_000), no_boundary(2_000))
    inner = (np.abs(points[:, :2] - 0.5) < 0.4).all(axis=1)
    np.testing.assert_allclose(np.linalg.norm(cells.corner, axis=1), cells.radius, rtol=1e-12)
    corner = np.einsum("ick,ik->ic", frames(normals)[:, :, 1:], cells.corner)
    distance = nearest.tree.query(points + corner, k=3)[0][inner]
    np.testing.assert_allclose(distance, cells.radius[inner, None] * np.ones(3), rtol=1e-9)


def test_slits_are_the_same_in_tiles_as_in_the_whole(tmp_path):
    """A strip of four tiles, with one slit across their borders, one within a tile, and one that is told."""
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(-6.0, 6.0, 6_000), rng.uniform(-0.3, 0.3, 6_000), np.zeros(6_000)])
    spacing = np.sqrt(12.0 * 0.6 / 6_000)
    for low, high, wide in ((-3.6, -1.8, 4.0), (0.7, 2.2, 7.0), (3.5, 5.0, 2.5)):
        slit = (low < points[:, 0]) & (points[:, 0] < high)
        points = points[~slit | (np.abs(points[:, 1]) > 0.5 * wide * spacing)]
    whole = core.build_laplacian(points)
    assert np.count_nonzero(whole.boundary & (np.abs(points[:, 1]) < 0.2)) > 150
    assert any(ACROSS in notice for notice in whole.notices)
    store = survey(tmp_path / "store", points, 4)
    core.tiles.run_steps(store)
    assert max(len(store.part(number).points) for number in range(store.count)) < 0.8 * len(points)
    np.testing.assert_array_equal(in_order(store, "boundary"), whole.boundary)
    # The course of a short boundary goes by how long it is, and halos end within slits.
    np.testing.assert_allclose(in_order(store, "areas"), whole.areas, rtol=0.0, atol=1e-4 * whole.areas.max())
