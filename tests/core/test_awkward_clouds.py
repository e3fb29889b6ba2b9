"""Clouds of every awkward kind, and arguments of every wrong kind: a sound result, or an error that says what to do.

MESHFREE_CASES in the environment multiplies how many are tried.
"""

import contextlib
import functools
import inspect
import itertools
import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import core
from benchmarks.samplings import fibonacci_sphere, square_grid
from core.clean.sizes import match_size
from tests.public import PUBLIC as CALLABLE

TIMES = int(os.environ.get("MESHFREE_CASES", "1"))
pytestmark = pytest.mark.filterwarnings("error")


def tried(count):
    return settings(
        derandomize=True,
        deadline=None,
        database=None,
        max_examples=count * TIMES,
        suppress_health_check=list(HealthCheck),
    )


def sphere(rng, count):
    points = rng.standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def globe(rng, count):
    """Latitudes and longitudes, with all the points of both poles."""
    rows = max(2, int(np.sqrt(count / 2)))
    around, up = np.meshgrid(np.arange(2 * rows) * np.pi / rows, np.linspace(0.0, np.pi, rows))
    return np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=2).reshape(-1, 3)


def spikes(rng, count):
    points = sphere(rng, count)
    points[rng.integers(0, count, 5)] *= rng.uniform(1.5, 9.0, (5, 1))
    return points


KINDS = {
    "sphere": sphere,
    "duplicates": lambda rng, count: np.repeat(sphere(rng, count // 3 + 1), 3, axis=0),
    "near duplicates": lambda rng, count: (
        np.repeat(sphere(rng, count // 2 + 1), 2, axis=0) + 1e-10 * rng.standard_normal((2 * (count // 2 + 1), 3))
    ),
    "one place": lambda rng, count: np.ones((count, 3)),
    "line": lambda rng, count: rng.random((count, 1)) * [1.0, 2.0, 3.0],
    "curve": lambda rng, count: np.stack([np.cos(t := rng.random(count) * 6.0), np.sin(t), 0.1 * t], axis=1),
    "plane": lambda rng, count: rng.random((count, 2)) @ [[1.0, 0.0, 1.0], [0.0, 1.0, 0.5]],
    "nested shells": lambda rng, count: sphere(rng, count) * rng.choice([1.0, 1.02, 1.3], (count, 1)),
    "spikes": spikes,
    "outliers": lambda rng, count: np.concatenate([sphere(rng, count), rng.uniform(-5.0, 5.0, (count // 8 + 1, 3))]),
    "volume": lambda rng, count: rng.standard_normal((count, 3)),
    "Brownian path": lambda rng, count: np.cumsum(rng.standard_normal((count, 3)), axis=0),
    "integer grid": lambda rng, count: np.argwhere(np.ones((int(np.sqrt(count)) + 1,) * 2 + (1,))),
    "block of integers": lambda rng, count: np.argwhere(np.ones((int(np.cbrt(count)) + 1,) * 3)),
    "globe": globe,
    "islands": lambda rng, count: (
        np.repeat(10.0 * rng.standard_normal((count // 3 + 1, 3)), 3, axis=0) + rng.random((3 * (count // 3 + 1), 3))
    ),
    "far away": lambda rng, count: sphere(rng, count) + 1e5,
    "far away, coarse": lambda rng, count: (sphere(rng, count) + 300.0).astype(np.float32),
    "not a number": lambda rng, count: np.where(rng.random((count, 3)) < 0.01, np.nan, sphere(rng, count)),
    "infinite": lambda rng, count: np.where(rng.random((count, 3)) < 0.01, np.inf, sphere(rng, count)),
    "flattened": lambda rng, count: sphere(rng, count) * [1.0, 1.0, 1e-6],
    "strip": lambda rng, count: rng.random((count, 3)) * [1.0, 0.01, 0.0],
}
SHAPES = {
    "sphere": lambda u, v: np.stack([np.sqrt(1 - v**2) * np.cos(u), np.sqrt(1 - v**2) * np.sin(u), v], axis=1),
    "patch": lambda u, v: np.stack([u / np.pi, v, 0.2 * np.sin(u) * v], axis=1),
    "cylinder": lambda u, v: np.stack([np.cos(u), np.sin(u), v], axis=1),
    "cube": lambda u, v: np.stack([u / np.pi - 1.0, v, np.sin(40.0 * u * v)], axis=1),  # hardly a surface
    "line": lambda u, v: np.stack([u, 2.0 * u, -u], axis=1),
}
LAYOUTS = {
    "plain": np.asarray,
    "list": lambda points: points.tolist(),
    "read-only": lambda points: np.frombuffer(points.tobytes(), points.dtype).reshape(points.shape),
    "big-endian": lambda points: points.astype(points.dtype.newbyteorder(">")),
    "by columns": np.asfortranarray,
    "every other": lambda points: np.repeat(points, 2, axis=0)[::2],
    "backwards": lambda points: points[::-1][::-1],
    "single": lambda points: points.astype(np.float32),
    "masked": np.ma.masked_invalid,
    "extended": lambda points: points.astype(np.longdouble),
}
OPTIONS = {
    "bandwidth": ["adaptive", "local", "global"],
    "neighbors": [6, 10, 20, 40, 100],
    "bandwidth_factor": [0.6, 0.9, 1.0, 2.0],
    "boundary": ["auto", "off"],
    "sheets": [True, False],
    "projection": ["auto", "off", "quadric"],
}
JUNK = [
    None,
    "x",
    b"x",
    True,
    -1,
    2**70,
    1.5,
    np.nan,
    np.inf,
    -np.inf,
    1j,
    [],
    [[1.0], [1.0, 2.0]],
    {},
    {"a": 1},
    object(),
    np.zeros(3),
    np.zeros((3, 3, 3)),
    np.array(["a", "b"]),
    np.array([None, 1.0]),
    np.full(7, np.nan),
    np.array(np.datetime64("2020-01-01")),
    slice(3),
    int,
]


@st.composite
def clouds(draw):
    """A cloud of some kind, in some unit."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(0, 10) | st.integers(60, 260) | st.integers(60, 260) | st.integers(60, 260))
    return KINDS[draw(st.sampled_from(list(KINDS)))](rng, max(count, 1))[: None if count else 0]


@st.composite
def choices(draw):
    """Options within their bounds, of which most are the defaults."""
    names = draw(st.sets(st.sampled_from(list(OPTIONS)), max_size=4))
    chosen = {name: draw(st.sampled_from(OPTIONS[name])) for name in sorted(names)}
    try:
        return core.LaplacianOptions(**{"neighbors": 20, **chosen})
    except core.PointCloudError:
        return core.LaplacianOptions()


def build(points, options):
    """Return the operator, or the kind of error that refuses these points."""
    try:
        return core.build_laplacian(points, options=options)
    except core.PointCloudError as error:
        return type(error)


def check_structure(laplacian):
    """Assert what an operator is for any points."""
    taken = laplacian.component >= 0
    stiffness, areas = laplacian.stiffness, laplacian.areas
    assert taken.any()
    assert np.isfinite(areas).all()
    assert areas.min() > 0.0
    assert np.isfinite(stiffness.data).all()
    assert abs(stiffness - stiffness.T).max() <= 1e-15 * abs(stiffness).max()
    assert np.all(np.abs(stiffness.sum(axis=1)) <= 1e-9 * stiffness.diagonal().max())
    pairs = stiffness.tocoo()
    assert np.all(pairs.data[pairs.row != pairs.col] <= 0.0)
    assert np.linalg.eigvalsh(stiffness.toarray())[0] >= -1e-12 * abs(stiffness).max()
    for name in (
        "normals",
        "quadric_mean_curvature",
        "gaussian_curvature",
        "trust",
        "smoothing_lengths",
        "kernel_widths",
    ):
        assert np.isfinite(getattr(laplacian, name)).all(), name
    assert_allclose(np.linalg.norm(laplacian.normals, axis=1), 1.0, rtol=1e-9)
    assert 0.0 <= laplacian.trust.min() <= laplacian.trust.max() <= 1.0
    assert np.isfinite(core.measure.mean_curvature(laplacian)).all()
    constant = laplacian.apply(np.ones(len(areas)))[taken]
    assert np.abs(constant).max() <= 1e-7 * np.max(stiffness.diagonal()[taken] / areas[taken])
    curvatures = core.measure.principal_curvatures(laplacian)
    assert np.isfinite(curvatures.direction).all()
    assert np.abs(curvatures.shape_index).max() <= 1.0


def check_scale(before, after, scale):
    """Assert that an operator is that of the points in another unit, a power of two."""
    taken = before.component >= 0
    np.testing.assert_array_equal(after.component, before.component)
    np.testing.assert_array_equal(after.boundary, before.boundary)
    assert_allclose(after.areas[taken], scale**2 * before.areas[taken], rtol=1e-12)
    assert_allclose(after.smoothing_lengths, scale * before.smoothing_lengths, rtol=1e-12)
    np.testing.assert_array_equal(after.stiffness.data, before.stiffness.data)


@tried(50)
@given(points=clouds(), options=choices(), seed=st.integers(0, 2**32 - 1), layout=st.sampled_from(list(LAYOUTS)))
def test_any_cloud_with_any_options_in_any_order_and_layout(points, options, seed, layout):
    points = np.asarray(points, dtype=np.float32 if layout == "single" else np.float64)
    order = np.random.default_rng(seed).permutation(len(points))
    before, after = build(points, options), build(LAYOUTS[layout](points[order]), options)
    if isinstance(before, type) or isinstance(after, type):
        assert isinstance(before, type) == isinstance(after, type)
        return
    check_structure(after)
    np.testing.assert_array_equal(after.component, before.component[order])
    np.testing.assert_array_equal(after.boundary, before.boundary[order])
    np.testing.assert_array_equal(after.areas, before.areas[order])
    np.testing.assert_array_equal(after.normals, before.normals[order])
    assert abs(after.stiffness - before.stiffness[order][:, order]).max() <= 1e-15 * abs(before.stiffness).max()


@st.composite
def samples(draw):
    """Random points on a shape, stretched, noisy and partly doubled, in some unit and place."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(110, 220) | st.integers(110, 220) | st.integers(110, 220) | st.integers(1, 110))
    u, v = random.uniform(0.0, 2.0 * np.pi, count), random.uniform(-1.0, 1.0, count)
    points = SHAPES[draw(st.sampled_from(list(SHAPES)))](u, v)
    points *= draw(st.tuples(*[st.sampled_from([0.3, 1.0, 1.0, 2.0])] * 3))
    points += draw(st.sampled_from([0.0, 0.0, 0.01, 0.1])) * random.standard_normal(points.shape)
    doubled = draw(st.integers(0, 80))
    return np.concatenate([points, points[random.integers(0, count, doubled)]])


@st.composite
def changes(draw):
    """A unit, a rotation and a place."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    return 10.0 ** draw(st.integers(-6, 6)), turn, draw(st.sampled_from([0.0, 1.0, 100.0])) * random.standard_normal(3)


@tried(25)
@given(points=samples(), change=changes(), seed=st.integers(0, 2**32 - 1))
def test_any_sample_of_a_shape_has_an_operator_that_moves_with_it_or_is_refused(points, change, seed):
    scale, turn, shift = change
    order = np.random.default_rng(seed).permutation(len(points))
    before = build(points, core.LaplacianOptions())
    after = build(scale * (points @ turn + shift)[order], core.LaplacianOptions())
    if isinstance(before, type) or isinstance(after, type):
        assert before is after
        return
    check_structure(before)
    check_structure(after)
    np.testing.assert_array_equal(after.component, before.component[order])
    np.testing.assert_array_equal(after.boundary, before.boundary[order])
    np.testing.assert_allclose(after.areas, scale**2 * before.areas[order], rtol=1e-5)
    np.testing.assert_allclose(after.smoothing_lengths, scale * before.smoothing_lengths[order], rtol=1e-6)
    values = np.sin(3.0 * np.arange(len(points)))
    size = np.abs(before.apply(values)).max()
    np.testing.assert_allclose(
        scale**2 * after.apply(values[order]), before.apply(values)[order], rtol=0.0, atol=1e-4 * size
    )


def ends(laplacian):
    height = laplacian.points[:, 2]
    return height >= np.quantile(height, 0.9), height < np.quantile(height, 0.1)


def lifted(laplacian, deformer):
    top, bottom = ends(laplacian)
    return deformer(laplacian, top, bottom).solve(laplacian.points[top] + extent(laplacian) * np.array([0.3, 0.1, 0.2]))


def extent(laplacian):
    return np.ptp(laplacian.points, axis=0).max()


def carried(laplacian):
    subset = core.clean.blue_noise_subset(laplacian.points, len(laplacian.points) // 3)
    return core.clean.Prolongation(laplacian.points, subset, laplacian.normals[subset]).interpolate(
        laplacian.normals[subset]
    )


def distances(laplacian):
    found = core.distance.geodesic_distance(laplacian, [0, 1])
    return np.where(np.isinf(found), 0.0, found)  # on other components


def spectrum(laplacian):
    return laplacian.eigenpairs(9, raw=True)


# What a function gives for an operator, with the power of the unit of length that it grows by.
USES = {
    "eigenvalues": (-2, lambda on: on.eigenpairs(9).eigenvalues),
    "modes": (-1, lambda on: spectrum(on).eigenvectors),
    "Dirichlet modes": (-1, lambda on: on.eigenpairs(5, raw=True, dirichlet=True).eigenvectors),
    "operator": (-1, lambda on: on.apply(on.points)),
    "mean curvature": (-1, core.measure.mean_curvature),
    "curvature": (-1, lambda on: core.measure.principal_curvatures(on).curvedness),
    "roughness": (1, core.clean.roughness),
    "mesh": (1, lambda on: core.surface.mesh_surface(on).vertices),
    "deviation": (1, lambda on: core.measure.surface_deviation(on, on.points, on.normals).distance),
    "fair": (1, core.clean.fair_points),
    "fair inside": (1, lambda on: core.clean.fair_points(on, dirichlet=True)),
    "fair, area": (1, lambda on: core.clean.fair_points(on, keep="area")),
    "fair, volume": (1, lambda on: core.clean.fair_points(on, keep="volume")),
    "smooth": (1, lambda on: core.clean.smooth_points(on, 8)),
    "boost": (
        1,
        lambda on: core.clean.smooth_points(on, core.clean.boost(2.0, *(np.array([10.0, 300.0]) / extent(on) ** 2))),
    ),
    "parts": (0, lambda on: core.spectral.segment(on, on.component.max() + 3)),
    "domains": (0, lambda on: core.spectral.nodal_domains(on, on.points[:, 0] - on.points[:, 0].mean())),
    "heat": (-2, lambda on: core.spectral.heat_kernel_signature(spectrum(on))),
    "waves": (-2, lambda on: core.spectral.wave_kernel_signature(spectrum(on))),
    "harmonic": (0, lambda on: core.distance.harmonic_field(on, [0, 1, 2], [0.0, 1.0, 3.0])),
    "harmonic height": (1, lambda on: core.distance.harmonic_field(on, ends(on)[0], on.points[ends(on)[0], 2])),
    "potential": (3, lambda on: core.distance.solve_poisson(on, on.points[:, 2], [0], [0.0])),
    "distance": (1, distances),
    "grown": (0, lambda on: core.distance.grow(on, [0], 0.2 * extent(on))),
    "displaced": (1, lambda on: core.clean.displace_by_mode(on, on.points[:, 0] - on.points[:, 0].mean())),
    "deformed": (1, lambda on: lifted(on, core.deform.Deformer)),
    "deformed coarsely": (
        1,
        lambda on: lifted(on, functools.partial(core.deform.coarse_deformer, count=60, neighbors=12)),
    ),
    "subset": (0, lambda on: core.clean.blue_noise_subset(on.points, 30)),
    "carried": (0, carried),
    "minimal": (1, lambda on: core.deform.minimal_surface(on.points, on.boundary | ends(on)[0], max_steps=1).points),
}


def use(laplacian, name):
    """Return what a function gives, or the kind of error that refuses it."""
    try:
        return USES[name][1](laplacian)
    except core.PointCloudError as error:
        return type(error)


@tried(60)
@given(
    points=clouds(),
    options=choices(),
    power=st.sampled_from([-180, -60, -9, 5, 60, 180]),
    name=st.sampled_from(list(USES)),
)
def test_any_operator_and_any_use_of_it_follow_the_law_of_scale(points, options, power, name):
    points = np.asarray(points, dtype=np.float64)
    before, after = build(points, options), build(2.0**power * points, options)
    if isinstance(before, type) or isinstance(after, type):
        extent = np.ptp(points, axis=0).max() if len(points) else 0.0
        assert before is after or not 1e-60 < 2.0**power * extent < 1e60
        return
    check_scale(before, after, 2.0**power)
    ours, theirs = use(before, name), use(after, name)
    if isinstance(ours, type) or isinstance(theirs, type):
        assert ours is theirs
        return
    assert np.isfinite(ours).all()
    expected = 2.0 ** (power * USES[name][0]) * ours
    assert_allclose(theirs, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["sphere", "globe", "outliers", "strip"])
def test_order_of_the_points_decides_no_mode(kind):
    rng = np.random.default_rng(3)
    points = KINDS[kind](rng, 300)
    order = rng.permutation(len(points))
    before, after = core.build_laplacian(points), core.build_laplacian(points[order])
    for count in (3, 25):
        ours, theirs = before.eigenpairs(count, raw=True), after.eigenpairs(count, raw=True)
        assert_allclose(theirs.eigenvalues, ours.eigenvalues, rtol=1e-9, atol=1e-9 * ours.eigenvalues[-1])
        # Of modes of one eigenvalue, such as those of a globe, rounding chooses among their combinations; the last one
        # may have lost its other.
        same = np.abs(np.subtract.outer(ours.eigenvalues, ours.eigenvalues)) < 1e-6 * ours.eigenvalues[-1]
        mine = ours.eigenvectors[order]
        turned = mine @ (same * (mine.T @ (after.areas[:, None] * theirs.eigenvectors)))
        wanted = np.where(same.sum(axis=0) == 1, mine, turned)[:, :-1]
        assert_allclose(theirs.eigenvectors[:, :-1], wanted, rtol=0.0, atol=1e-6 * np.abs(mine).max())


@tried(80)
@given(name=st.sampled_from(list(OPTIONS)), value=st.sampled_from(JUNK) | st.integers() | st.floats() | st.text())
def test_options_outside_their_bounds(name, value):
    try:
        options = core.LaplacianOptions(**{name: value})
    except core.PointCloudError:
        return
    assert getattr(options, name) == value
    build(fibonacci_sphere(300), options)


def calls():
    """Public functions with arguments that are right, by name; those named first are not replaced by wrong ones."""
    laplacian = core.build_laplacian(fibonacci_sphere(300), options=core.LaplacianOptions(neighbors=30))
    spectrum = laplacian.eigenpairs(6)
    points, n = laplacian.points, 300
    top, bottom = points[:, 2] > 0.8, points[:, 2] < -0.8
    on, of = {"laplacian": laplacian}, {"spectrum": spectrum}
    low = spectrum.eigenvectors[:, 1]
    grid = square_grid(12)
    edge = (grid[:, :2].min(axis=1) == grid.min()) | (grid[:, :2].max(axis=1) == grid[:, :2].max())
    yield core.build_laplacian, {}, {"points": points, "normals": points, "options": core.LaplacianOptions()}
    yield core.build_laplacian, {"points": points}, {"boundary": top, "boundary_distance": np.full(n, np.inf)}
    yield core.estimate_areas, {}, {"points": points, "normals": points, "options": core.LaplacianOptions()}
    yield core.estimate_normals, {}, {"points": points, "options": core.LaplacianOptions()}
    yield core.surface.surface_discs, {}, {"points": points}
    yield core.check_points, {}, {"points": points}
    yield core.clean.blue_noise_subset, {}, {"points": points, "count": 100}
    yield core.clean.Prolongation, {}, {"points": points, "subset": np.arange(150), "normals": points[:150]}
    yield laplacian.apply, {}, {"values": low, "raw": False}
    yield laplacian.eigenpairs, {}, {"count": 4, "raw": False, "dirichlet": False, "tolerance": 1e-6}
    yield core.clean.spectral_filter, of, {"values": low, "areas": laplacian.areas, "response": 3, "rest": 0.0}
    yield (
        core.clean.chebyshev_filter,
        {**on, "response": core.clean.exponential(0.1)},
        {"values": low, "dirichlet": False, "raw": False, "tolerance": 1e-3},
    )
    yield core.clean.exponential, {}, {"time": 1.0}
    yield core.clean.fairing, {}, {"time": 1.0, "order": 2}
    yield core.clean.band, {}, {"low": 1.0, "high": 2.0, "softness": 0.1}
    yield core.clean.boost, {}, {"gain": 2.0, "low": 1.0, "high": 2.0, "softness": 0.1}
    yield (
        core.clean.smooth_points,
        {**on, "spectrum": spectrum},
        {"response": 5, "strength": 1.0, "mask": top, "keep": "area"},
    )
    yield core.clean.fair_points, on, {"time": 0.01, "order": 3, "dirichlet": False, "keep": None}
    yield core.clean.roughness, on, {"wavelength": 0.5}
    yield core.surface.mesh_surface, on, {"detail": 1.0}
    yield core.surface.values_on_mesh, on, {"vertices": points[:9]}
    yield core.measure.surface_deviation, on, {"points": points[:9], "normals": points[:9], "greatest": 1.0}
    yield core.measure.sides_beside, on, {"sides": low, "points": points[:9], "normals": points[:9]}
    yield core.deform.deformation_gradients, on, {"positions": points}
    yield core.clean.displace_by_mode, on, {"mode": low, "amplitude": 0.1, "phase": 0.0}
    yield core.spectral.segment, on, {"parts": 2}
    yield core.spectral.nodal_domains, on, {"values": low, "threshold": 0.02, "bridge": 0.1, "smallest": 5}
    yield core.spectral.modes_needed, on, {"parts": 2}
    yield core.spectral.heat_kernel_signature, of, {"times": [0.1, 1.0], "count": 3, "normalized": False}
    yield core.spectral.wave_kernel_signature, of, {"energies": [0.1, 1.0], "count": 3}
    yield core.spectral.signature_times, of, {"count": 3}
    yield core.spectral.signature_energies, of, {"count": 3}
    yield core.distance.harmonic_field, on, {"fixed": [0, 299], "fixed_values": [0.0, 1.0]}
    bones = {"heads": [[0.0, 0.0, -0.8], [0.0, 0.0, 0.0]], "tails": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.8]]}
    yield core.rig.bone_weights, on, {**bones, "falloff": 1.0, "visible": True, "influences": 1, "least": 0.1}
    yield core.rig.nearest_bones, {}, {"points": points, **bones}
    yield core.rig.inpaint, on, {"known": [0, 299], "values": [0.0, 1.0], "biharmonic": True}
    two = {"weights": np.ones((n, 2)), "length": 0.1, "edges": [[0, 1]], "least": 0.1, "influences": 1, "fill": True}
    yield core.rig.smooth_weights, on, {**two, "columns": [1], "locked": [0], "chosen": [3]}
    yield core.rig.inpaint_labels, on, {"known": [0, 299], "labels": [0, 1]}
    match = core.rig.match_surface(laplacian, laplacian)
    yield core.rig.match_surface, {"target": laplacian, "sources": laplacian}, {"distance": 1.0, "angle": 0.5}
    yield core.rig.transfer_values, {"target": laplacian, "match": match}, {"values": low}
    yield core.rig.transfer_labels, {"target": laplacian, "match": match}, {"labels": top}
    yield core.rig.mix_weights, {}, {"before": np.ones((9, 2)), "taken": np.ones((9, 2)), "mix": 0.5, "locked": [0]}
    yield core.rig.are_normalized, {}, {"weights": np.ones((9, 2))}
    yield (
        core.rig.skin,
        {"gradients": False},
        {"points": points, "weights": np.ones((n, 1)), "matrices": np.eye(4)[None]},
    )
    yield core.rig.Skinner(np.ones((n, 1))).move, {"gradients": False}, {"points": points, "matrices": np.eye(4)[None]}
    ends = {"heads": points, "tails": 2.0 * points, "head_radii": np.ones(n), "tail_radii": np.ones(n)}
    yield core.rig.envelope_share, {}, {"points": points, **ends, "distances": np.ones(n)}
    yield core.distance.solve_poisson, on, {"source": points[:, 2], "fixed": [0], "fixed_values": [0.0]}
    yield core.distance.geodesic_distance, on, {"sources": [0]}
    yield core.distance.falloff, {}, {"distance": points[:, 0] ** 2, "radius": 1.0, "shape": "sharp"}
    yield core.distance.nearest_source, on, {"sources": [0, 150]}
    yield core.distance.signed_distance, on, {"curve": [100, 101, 102], "closed": True}
    yield core.distance.logarithmic_map, on, {"source": 0}
    yield core.distance.transport, on, {"sources": [0], "directions": [[1.0, 0.0, 0.0]]}
    yield core.orient_normals, {}, {"points": points, "normals": points, "method": "outside"}
    frame = {"spectrum": spectrum, "spectrum_before": spectrum}
    yield (
        core.spectral.match_modes,
        frame,
        {"areas": laplacian.areas, "points": points, "points_before": points, "tolerance": 0.02},
    )
    yield core.distance.grow, on, {"chosen": [0], "distance": 0.3}
    yield core.clean.stray_points, {}, {"points": points, "strictness": 1.0, "smallest": 30, "smallest_area": 0.0}
    yield core.clean.thin_out, {}, {"points": points, "spacing": 0.2}
    yield core.clean.thin_out, {}, {"points": points, "count": 100, "keep_edges": False}
    yield core.clean.thin_pieces, {}, {"pieces": [(points, {})], "count": 100}
    yield core.clean.clean_points, on, {"keep_edges": True, "dirichlet": False}
    yield core.measure.measure_region, on, {"members": top}
    yield core.distance.geodesic_path, on, {"start": 0, "end": 150}
    yield core.distance.polygon_length, {}, {"corners": points[:9]}
    yield core.measure.measure_parts, on, {"labels": top.astype(int)}
    yield core.measure.part_means, on, {"values": low, "labels": top.astype(int)}
    yield core.measure.pile_volume, on, {"members": top}
    yield core.measure.cross_section, on, {"point": [0.0, 0.0, 0.1], "normal": [0.0, 1.0, 2.0]}
    yield core.measure.profile, on, {"path": points[:9], "values": low}
    turned = points[:, [1, 2, 0]]
    yield core.measure.align, {"points": points + 0.01}, {"target": points, "overlap": 0.9, "scale": True}
    yield core.measure.match_places, {}, {"places": points[:4], "others": turned[:4], "scale": True}
    yield core.motion.Heat, on, {"step": 0.1}
    yield core.motion.Heat(laplacian, 0.1).advance, {}, {"state": low}
    yield core.motion.Wave, on, {"step": 0.1, "speed": 1.0}
    yield core.motion.Wave(laplacian, 0.1).advance, {}, {"state": np.column_stack([low, low])}
    yield core.motion.ReactionDiffusion, on, {"step": 1.0, "feed": 0.04, "kill": 0.06, "rates": (1e-3, 5e-4)}
    yield (
        core.motion.wave_modes,
        of,
        {"areas": laplacian.areas, "displacement": low, "velocity": low, "speed": 1.0, "damping": 0.1},
    )
    yield core.distance.opposite_ends, on, {"share": 0.05}
    yield core.distance.front_point, {}, {"points": points, "eye": [0, 0, 5], "direction": [0, 0, -1], "reach": 0.1}
    yield core.distance.seen_points, {}, {"points": points, "radii": 0.1, "direction": [0, 0, -1], "eye": [0, 0, 5]}
    yield (
        core.distance.seen_points,
        {"points": points, "direction": [0, 0, -1]},
        {"radii": low * 0 + 0.1, "normals": points, "among": top},
    )
    corners = np.random.default_rng(0).integers(n, size=(40, 3))
    yield core.measure.iso_lines, {}, {"vertices": points, "faces": corners, "values": low, "levels": [0.0, 0.1]}
    yield core.measure.Slopes, {"discs": core.surface.surface_discs(points)}, {"points": points}
    yield core.measure.Slopes(points, core.surface.surface_discs(points)).of, {}, {"values": low}
    yield (
        core.deform.Deformer,
        on,
        {"handles": top, "anchors": bottom, "weights": None, "rotation_aware": True, "neighbors": 40},
    )
    solve = core.deform.Deformer(laplacian, top, bottom).solve
    yield solve, {}, {"handle_positions": points[top], "steps": 3, "rtol": 1e-3, "start": None}
    yield core.deform.coarse_deformer, on, {"handles": top, "anchors": bottom, "count": 100}
    yield core.deform.coarse_deformer(laplacian, top, bottom).solve, {}, {"handle_positions": points[top]}
    yield (
        core.deform.minimal_surface,
        {"max_steps": 2},
        {"points": grid, "fixed": edge, "options": core.LaplacianOptions()},
    )
    yield core.deform.minimal_surface, {"points": grid, "fixed": edge}, {"max_steps": 2, "epsilon": 1e-3}


PUBLIC = list(calls())
OWN_TYPES = "LaplaceBeltrami", "LaplacianOptions", "Spectrum"  # no arrays, so that there is nothing to spoil
ELSEWHERE = {"load", "save", "read_splats", "write_splats", "floaters", "check_room"}  # in tests of their own


def test_all_public_functions_are_tried():
    tested = {function.__name__ for function, _, _ in PUBLIC}
    functions = {one.__name__: one for one in CALLABLE.values() if inspect.isfunction(one)}
    untried = [
        name for name, function in functions.items() if name not in tested | ELSEWHERE and takes_arrays(function)
    ]
    assert untried == []


def takes_arrays(function):
    """Whether a function takes anything but the types of core, and numbers that have a default."""
    needed = [item.annotation for item in inspect.signature(function).parameters.values() if item.default is item.empty]
    return any(getattr(kind, "__name__", kind) not in OWN_TYPES for kind in needed)


@pytest.mark.parametrize(("function", "fixed", "arguments"), PUBLIC)
def test_wrong_arguments_are_refused_in_words(function, fixed, arguments):
    function(**fixed, **arguments)  # is right
    for name, junk in itertools.product(arguments, JUNK):
        if not (name == "response" and callable(junk)):  # whose own errors are the caller's
            with contextlib.suppress(core.PointCloudError):
                function(**fixed, **{**arguments, name: junk})


@pytest.mark.parametrize(
    ("function", "fixed", "arguments"),
    [
        call
        for call in PUBLIC
        if "progress" in inspect.signature(call[0]).parameters
        and call[0] is not core.clean.smooth_points  # has modes here
    ],
)
def test_work_reports_how_far_it_is_and_may_be_stopped_at_any_report(function, fixed, arguments):
    def run(progress):
        for each in fixed.values():
            if isinstance(each, core.LaplaceBeltrami):
                each.release()
        function(**fixed, **arguments, progress=progress)

    reports = []
    run(lambda *report: reports.append(report))
    assert all(0.0 <= fraction <= 1.0 for _, fraction in filter(None, reports))
    # Minimal surfaces return what they have.
    for last in {0} if function is core.deform.minimal_surface else {0, len(reports) // 2, len(reports) - 1}:
        left = iter(range(last))

        def stop(*report, left=left):
            if next(left, None) is None:
                raise core.Cancelled

        with pytest.raises(core.Cancelled):
            run(stop)


@functools.cache
def bumpy(unit):
    points = square_grid(12) + [0.0, 0.0, 1.0]
    points[:, 2] += 0.1 * np.sin(5.0 * points[:, 0])
    return core.build_laplacian(unit * points, options=core.LaplacianOptions(neighbors=20))


@pytest.mark.parametrize("power", [-180, 180])
@pytest.mark.parametrize("name", USES)
def test_uses_follow_the_law_of_scale_in_tiny_and_huge_units(name, power):
    ours, theirs = use(bumpy(1.0), name), use(bumpy(2.0**power), name)
    if isinstance(ours, type):
        assert theirs is ours
        return
    expected = 2.0 ** (power * USES[name][0]) * ours
    assert_allclose(theirs, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_masked_values_are_refused():
    points = fibonacci_sphere(300)
    hidden = np.ma.array(points, mask=points > 0.9)
    with pytest.raises(core.InvalidPointsError, match="masked values"):
        core.build_laplacian(hidden)
    with pytest.raises(core.InvalidPointsError, match="masked values"):
        core.build_laplacian(points, hidden)
    with pytest.raises(core.InvalidPointsError, match="masked values"):
        core.build_laplacian(points).apply(hidden)
    core.build_laplacian(np.ma.array(points))


def test_modes_and_filters_of_a_grid_are_the_same_in_huge_units():
    points, options = np.argwhere(np.ones((13, 13, 1))), core.LaplacianOptions(neighbors=20)
    before, after = (core.build_laplacian(unit * points, options=options) for unit in (1.0, 2.0**100))
    np.testing.assert_array_equal(2.0**-100 * core.clean.fair_points(after), core.clean.fair_points(before))
    ours, theirs = before.eigenpairs(9, raw=True), after.eigenpairs(9, raw=True)
    assert_allclose(2.0**100 * theirs.eigenvectors, ours.eigenvectors, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("unit", [2.0**-180, 2.0**180])
def test_functions_are_carried_in_any_unit(unit):
    rng = np.random.default_rng(0)
    points, values = KINDS["islands"](rng, 90), rng.random(30)
    normals = sphere(rng, 30)
    ours, theirs = (
        core.clean.Prolongation(by * points, np.arange(30), normals).interpolate(values) for by in (1.0, unit)
    )
    np.testing.assert_array_equal(theirs, ours)


def test_a_volume_turned_inside_out_is_brought_back():
    scale = match_size(lambda scale: 2.0 * scale**3 - 3.0, np.ones(1), np.array([True]))
    assert_allclose(scale, 2.0 ** (1.0 / 3.0))
