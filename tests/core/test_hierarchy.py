"""Equations solved with coarse versions of their matrix: the direct answer, in as few steps for many points."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import eigsh, splu
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import random_sphere
from core.algebra import coarse_to_fine, davidson, hierarchy, solvers
from core.algebra.hierarchy import approximate_inverse
from core.algebra.rows import PART, Rows, matrix_by_rows, multiply_rows
from core.algebra.solvers import conjugate_gradients, solve_symmetric

PAIRS = [(k, j) for k in range(2) for j in range(3)]
CLOUDS = ["another random sphere", "coarse torus", "random square", "density jump"]


def silent():
    pass


def kernel_matrix(points, reach):
    """Stiffness with weights that fall off to zero at a distance."""
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    distance = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    half = sparse.coo_array(((1.0 - distance / reach) ** 2, pairs.T), shape=(len(points),) * 2)
    weights = (half + half.T).tocsr()
    return (sparse.diags_array(weights.sum(axis=1)) - weights).tocsr()


def fixed_ends(laplacian):
    """Matrix and load of a harmonic function with values 0 and 1 at the ends."""
    x = laplacian.points[:, 0]
    low, high = np.quantile(x, [0.05, 0.95])
    free = np.flatnonzero((x > low) & (x < high))
    matrix = laplacian.stiffness[free]
    return matrix[:, free], -(matrix @ (x >= high))


@pytest.fixture
def coarse(monkeypatch):
    """Have coarse versions used for any number of points."""
    monkeypatch.setattr(solvers, "_FEW", 0)


@pytest.mark.parametrize("name", CLOUDS)
def test_fixed_points(operators, coarse, name):
    matrix, load = fixed_ends(operators(name))
    exact = splu(matrix.tocsc()).solve(load)
    np.testing.assert_allclose(solve_symmetric(matrix, load), exact, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", CLOUDS)
def test_nothing_fixed(operators, coarse, name):
    laplacian = operators(name)
    load = laplacian.areas * laplacian.points[:, 0]
    load -= load.mean()
    exact = np.append(0.0, splu(laplacian.stiffness[1:, 1:].tocsc()).solve(load[1:]))
    found = solve_symmetric(laplacian.stiffness, load)
    np.testing.assert_allclose(found - found[0], exact, rtol=0.0, atol=1e-8 * np.ptp(exact))


def test_several_right_hand_sides_and_a_start(operators, coarse):
    matrix, load = fixed_ends(operators("coarse torus"))
    both = np.column_stack([load, np.random.default_rng(0).normal(size=len(load)), 0.0 * load])
    exact = splu(matrix.tocsc()).solve(both)
    for start in (None, np.ones_like(both)):
        found = solve_symmetric(matrix, both, start)
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-8 * np.abs(exact).max())
    assert not solve_symmetric(matrix, both)[:, 2].any()


def test_components_do_not_mix(operators, coarse):
    """A loose component stays where it started, next to one with fixed points, and next to another one like it."""
    matrix, load = fixed_ends(operators("coarse torus"))
    loose = operators("coarse torus").stiffness
    whole = sparse.block_diag([matrix, loose, loose], format="csr")
    found = solve_symmetric(whole, np.append(load, np.zeros(2 * loose.shape[0])))
    np.testing.assert_allclose(found[: len(load)], splu(matrix.tocsc()).solve(load), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(found[len(load) :], 0.0, atol=1e-12)


def test_fields_are_the_same(operators, monkeypatch):
    laplacian = operators("random square")
    fixed = np.flatnonzero(np.abs(laplacian.points[:, 0] - 0.5) > 0.47)
    values = np.sin(5.0 * laplacian.points[fixed, 1])
    plain = core.distance.harmonic_field(laplacian, fixed, values), core.clean.smoothing_base(laplacian, dirichlet=True)
    monkeypatch.setattr(solvers, "_FEW", 0)
    coarse = (
        core.distance.harmonic_field(laplacian, fixed, values),
        core.clean.smoothing_base(laplacian, dirichlet=True),
    )
    for one, other in zip(plain, coarse, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-7)  # plain steps end that far from the exact answer


def test_the_number_of_steps_hardly_grows():
    steps = []
    for count in (2000, 16_000):
        points = random_sphere(count)
        matrix = kernel_matrix(points, 20.0 / np.sqrt(count))  # as wide as the operator's
        load = points[:, 2] - points[:, 2].mean()
        with ThreadPoolExecutor() as pool:
            inverse = approximate_inverse(matrix, pool, silent)
            found = conjugate_gradients(matrix, load, scaling=inverse)
        assert found.converged
        steps.append(found.products)
    assert max(steps) <= min(steps) + 4
    assert max(steps) < 20


@pytest.mark.parametrize("twins", [0, 500])
def test_the_inverse_is_symmetric_and_positive(twins):
    """Also where points in pairs next to each other have by far the largest eigenvalues, which are not estimated."""
    points = random_sphere(1500)
    matrix = kernel_matrix(points, 0.15)
    row = np.arange(0, 2 * twins, 2)
    heavy = 1e3 * matrix.diagonal().max() * np.ones(twins)
    pairs = sparse.coo_array((heavy, (row, row + 1)), shape=matrix.shape)
    pairs = pairs + pairs.T
    matrix = (matrix + sparse.diags_array(pairs.sum(axis=1)) - pairs + sparse.eye_array(1500) * 1e-3).tocsr()
    x, y = np.random.default_rng(0).normal(size=(2, 1500))
    with ThreadPoolExecutor() as pool:
        inverse = approximate_inverse(matrix, pool, silent)
        one, other = inverse * x, inverse * y
    np.testing.assert_allclose(y @ one, x @ other, rtol=0.0, atol=1e-5 * np.linalg.norm(y) * np.linalg.norm(one))
    assert x @ one > 0.0
    assert y @ other > 0.0


@pytest.mark.parametrize("thread", [0.0, 1e-6])
def test_parts_that_become_one_unknown_each(thread):
    """Their diagonal is rounding, by which nothing may be divided, or of a thread that they hang by: a low mode."""
    big = kernel_matrix(random_sphere(12_000), 10.0 / np.sqrt(12_000))  # a thousand on the second level
    small = [kernel_matrix(random_sphere(24, seed), 3.0) for seed in range(12)]
    matrix = sparse.block_diag([big, *small], format="csr")
    for start in range(12_000, matrix.shape[0], 24):
        ends = [0, start, 0, start], [0, start, start, 0]
        matrix += sparse.csr_array((thread * np.array([1.0, 1.0, -1.0, -1.0]), ends), shape=matrix.shape)
    count = len(small) + 4
    values, vectors = coarse_to_fine(matrix, np.ones(matrix.shape[0]), count, 1e-6, 1e-3, lambda fraction=0.0: None)
    assert np.abs(values[: 1 + len(small)]).max() < thread + 1e-9 * values[-1]
    assert np.abs(values[1 : 1 + len(small)] - thread / 24.0).max() < 1e-2 * thread + 1e-9 * values[-1]
    missed = np.linalg.norm(matrix @ vectors - vectors * values, axis=0)
    assert missed.max() < 1e-6 * values[-1]
    assert values[-3] > 0.5 * values[-1]  # the three of degree one
    load = np.concatenate([points - points.mean() for points in (random_sphere(12_000)[:, 2], *np.eye(24)[:12])])
    with ThreadPoolExecutor() as pool:
        found = conjugate_gradients(matrix, load, scaling=approximate_inverse(matrix, pool, silent))
    assert found.converged
    assert found.products < 20


def test_cores_share_entries_of_a_matrix_evenly():
    """Such as 3.2 times as many as are multiplied at once: by four, and not three and a rest."""
    matrix = sparse.eye_array(16 * PART // 5, format="csr")
    with ThreadPoolExecutor() as pool:
        counts = list(Rows(matrix, pool, silent).each(lambda rows, part: part.nnz))
    assert sum(counts) == matrix.nnz
    assert max(counts) <= min(counts) + 1


def test_components_that_cancel_exactly():
    """They become one unknown each whose row is zero: it has an entry all the same."""
    big = kernel_matrix(random_sphere(12_000), 10.0 / np.sqrt(12_000))  # a thousand on the second level
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    matrix = sparse.block_diag([pair, big, pair], format="csr")
    values, vectors = coarse_to_fine(matrix, np.ones(12_004), 6, 1e-6, 1e-3, lambda *_: None)
    assert np.abs(values[:3]).max() < 1e-9 * values[-1] < values[3]
    missed = np.linalg.norm(matrix @ vectors - vectors * values, axis=0)
    assert missed.max() < 1e-6 * values[-1]
    load = np.concatenate([pair[0], random_sphere(12_000)[:, 2], pair[0]])
    load[2:-2] -= load[2:-2].mean()
    with ThreadPoolExecutor() as pool:
        found = conjugate_gradients(matrix, load, scaling=approximate_inverse(matrix, pool, silent))
    assert found.converged
    assert found.products < 20
    np.testing.assert_allclose(found.values[[0, 1, -2, -1]], [0.5, -0.5] * 2, rtol=0.0, atol=1e-6)


def test_no_other_has_to_converge_where_all_wanted_are_zero(monkeypatch):
    """Of a scan in many parts: those beyond, of the next eigenvalues, may converge slowly."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    matrix = sparse.block_diag([kernel_matrix(random_sphere(6000), 0.12), *[pair] * 30], format="csr")
    values, vectors = coarse_to_fine(matrix, np.ones(6060), 20, 1e-9, 0.1, lambda *_: None)
    assert np.abs(values).max() < 1e-8
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(20), rtol=0.0, atol=1e-9)
    assert np.linalg.norm(matrix @ vectors, axis=0).max() < 1e-8
    monkeypatch.setattr(davidson, "_STEPS", 1)  # enough for a tolerance above the rounding of single precision
    assert coarse_to_fine(matrix, np.ones(6060), 20, 1e-4, 0.1, lambda *_: None) is not None


def test_eigenvectors_some_at_a_time_are_those_of_all_at_once(monkeypatch):
    """In V-cycles of few columns, and turned by few rows, in no more steps."""
    matrix = kernel_matrix(random_sphere(6000), 0.12)
    matrix /= matrix.diagonal().mean()
    monkeypatch.setattr(davidson, "_ENTRIES", 0)
    monkeypatch.setattr(davidson, "_STEPS", 7)  # six are enough; nine are needed without Chebyshev's acceleration
    found = []
    for columns, rows in ((40, 1 << 11), (5, 700)):
        monkeypatch.setattr(davidson, "_COLUMNS", columns)
        monkeypatch.setattr(davidson, "_BLOCK", rows)
        found.append(coarse_to_fine(matrix, np.ones(6000), 16, 1e-7, 0.0, lambda *_: None))
    (values, vectors), (others, parts) = found
    np.testing.assert_allclose(others, values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(parts @ (parts.T @ vectors), vectors, rtol=0.0, atol=1e-5)


def test_a_block_that_converges_is_not_widened(monkeypatch):
    """Nor while what has converged is checked: new vectors would have to converge first."""
    matrix = kernel_matrix(random_sphere(6000), 0.12)
    monkeypatch.setattr(davidson, "_PATIENCE", 2)
    monkeypatch.setattr(davidson, "_STEPS", 7)
    values, vectors = coarse_to_fine(matrix, np.ones(6000), 16, 1e-7, 0.0, lambda *_: None)
    assert np.linalg.norm(matrix @ vectors - vectors * values, axis=0).max() < 1e-7 * values[-1]


def test_the_result_does_not_depend_on_cores(operators, coarse, monkeypatch):
    matrix, load = fixed_ends(operators("another random sphere"))
    found = []
    for cores in (1, 3):
        monkeypatch.setenv("MESHFREE_CORES", str(cores))
        found.append(solve_symmetric(matrix, load))
    np.testing.assert_array_equal(found[0], found[1])


def scattered(count, reach, spread, far=0):
    """Random points with so many in a wide sparse part, as symmetric form of weights and of areas that vary."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.random((count, 2)), [1.0, 0.0] + 3.0 * rng.random((far, 2))])
    near = cKDTree(points).query(points, k=reach)[0][:, -1]
    pairs = cKDTree(points).query_pairs(near.max(), output_type="ndarray")
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) / near[pairs].max(axis=1)
    pairs, length = pairs[length < 1.0], length[length < 1.0]
    half = sparse.coo_array(((1.0 - length) ** 2, pairs.T), shape=(len(points),) * 2)
    weights = (half + half.T).tocsr()
    root = np.sqrt(near**2 * np.exp(spread * rng.standard_normal(len(points))))
    scale = sparse.diags_array(1.0 / root)
    matrix = (scale @ (sparse.diags_array(weights.sum(axis=1)) - weights) @ scale).tocsr()
    return (0.5 / matrix.diagonal().max() * (matrix + matrix.T)).tocsr(), root


SCATTERED = {
    "even": (2500, 20, 0.1),
    "areas that vary": (2500, 20, 3.0),
    "crowded": (4000, 150, 1.5),
    "a sparse part": (2500, 20, 0.1, 60),
}


def test_constants_of_components_are_known(monkeypatch):
    """To all digits, without any step, for which single precision is too coarse."""
    matrix, root = scattered(2500, 20, 1.0)
    assert connected_components(matrix)[0] == 1
    fixed = matrix + 1e-3 * sparse.eye_array(len(root))  # a component that has no zero
    several, roots = sparse.block_diag([matrix, fixed, matrix, matrix], format="csr"), np.tile(root, 4)
    monkeypatch.setattr(davidson, "_STEPS", 0)
    values, vectors = coarse_to_fine(several, roots, 3, 1e-7, 1e-6, lambda *_: None)
    assert np.abs(values).max() < 1e-15
    constant = (vectors / roots[:, None]).reshape(4, -1, 3)
    np.testing.assert_allclose(constant, constant[:, :1] + np.zeros_like(constant), rtol=0.0, atol=1e-9)
    assert np.abs(constant[1]).max() < 1e-9


@pytest.mark.parametrize("spread", [1.0, 2.0, 3.0])
def test_modes_where_areas_vary_by_powers_of_ten(spread):
    """In double precision where residuals of single precision would not fall to those of the last of the block."""
    matrix, root = scattered(2500, 20, spread)
    exact = np.sort(eigsh(matrix, 20, sigma=-1e-12, return_eigenvectors=False))
    assert davidson.needs_double(matrix.diagonal().max(), exact[-1]) == (spread > 1.0)
    values, vectors = coarse_to_fine(matrix, root, 20, 2e-7, exact[-1], lambda *_: None)
    np.testing.assert_allclose(values[1:], exact[1:], rtol=1e-6)
    assert np.linalg.norm(matrix @ vectors - vectors * values, axis=0).max() <= 2.2e-7 * values[-1]


@pytest.mark.parametrize("given", SCATTERED.values(), ids=SCATTERED)
def test_a_cycle_overshoots_by_little(given):
    """Wherever couplings are weak or many, and where the diagonal is no larger than eigenvalues that are wanted."""
    matrix, root = scattered(*given)
    wanted = eigsh(matrix, 40, sigma=-1e-12, return_eigenvectors=False).max()
    with ThreadPoolExecutor(1) as pool:
        levels, last, mass = hierarchy.build_levels(matrix, root, 300, 120, pool, silent, wanted)
        values, vectors = eigh(last.toarray(), mass.toarray())
        coarsest = davidson._known(values, vectors, mass @ vectors, np.float32)
        step, shift = np.random.default_rng(1).standard_normal((len(root), 1)), np.zeros(1, dtype=np.float32)
        for _ in range(25):
            step /= np.linalg.norm(step)
            load = (matrix @ step).astype(np.float32)
            step = hierarchy.solve_roughly(levels, coarsest, load, shift, 40).astype(np.float64)
    assert np.linalg.norm(step) < davidson._CYCLED[1]


def test_where_coarse_versions_do_not_help(coarse):
    """Nothing is coupled, or all of it repels: the plain steps go on."""
    for share in (0.0, 0.3):
        value = np.linspace(1.0, 1e4, 3000)
        root = np.sqrt(value[1:] * value[:-1])
        matrix = sparse.diags_array([share * root, value, share * root], offsets=[-1, 0, 1]).tocsr()
        exact = np.sin(np.arange(3000.0))
        found = solve_symmetric(matrix, matrix @ exact)
        np.testing.assert_allclose(found, exact, atol=1e-5)


def test_it_can_be_stopped_at_any_time(operators, coarse):
    matrix, load = fixed_ends(operators("another random sphere"))
    seen = []
    solve_symmetric(matrix, load, progress=lambda stage, fraction: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[-1] < 1.0
    for last in range(0, len(seen), 5):
        left = iter(range(last))

        def stop(stage, fraction, left=left):
            if next(left, None) is None:
                raise core.Cancelled

        with pytest.raises(core.Cancelled):
            solve_symmetric(matrix, load, progress=stop)


@pytest.mark.parametrize("columns", [0, 1, 3, 6])
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-14), (np.float32, 1e-6)])
def test_a_product_is_changed_part_by_part_in_the_precision_of_its_columns(monkeypatch, columns, dtype, tolerance):
    monkeypatch.setattr("core.algebra.rows.PART", 50)
    rng = np.random.default_rng(0)
    matrix, other, load = (
        sparse.random_array((60, 40), density=0.2, rng=rng).tocsr(),
        rng.random((40, columns)).astype(dtype),
        rng.random((60, columns)).astype(dtype),
    )

    def subtract(rows, values):
        np.subtract(load[rows], values, out=values)

    with ThreadPoolExecutor(2) as pool:
        found = Rows(matrix, pool, silent).product(other, subtract)
        exact = load - matrix @ other
        written = Rows(matrix, pool, silent).product(np.asfortranarray(other), subtract, load)
    assert found.dtype == dtype
    assert written is load
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=tolerance)
    np.testing.assert_array_equal(written, found)


@pytest.mark.parametrize("shape", [(40,), (40, 0), (40, 1), (40, 3), (40, 6)])
def test_a_product_has_the_same_bits_on_any_number_of_cores(monkeypatch, shape):
    rng = np.random.default_rng(0)
    matrix, values = sparse.random_array((60, 40), density=0.2, rng=rng).tocsr(), rng.random(shape)
    whole = multiply_rows(matrix, values)
    np.testing.assert_allclose(whole, np.tensordot(matrix.toarray(), values, 1), rtol=0.0, atol=1e-14)
    monkeypatch.setattr("core.algebra.rows.PART", 50)
    monkeypatch.setattr("core.algebra.rows._LEAST", 50)
    monkeypatch.setenv("MESHFREE_CORES", "3")
    np.testing.assert_array_equal(multiply_rows(matrix, values), whole)


@pytest.mark.parametrize("block", [1, 7, 100])
def test_a_matrix_is_put_together_from_its_rows(monkeypatch, block):
    monkeypatch.setattr("core.algebra.rows._BLOCK", block)
    matrix = sparse.random_array((60, 40), density=0.05, rng=np.random.default_rng(0)).tocsr()
    counts = np.diff(matrix.indptr)
    assert (counts == 0).any()
    found = matrix_by_rows(lambda rows: matrix[rows], counts, 40)
    assert found.indices.dtype == found.indptr.dtype == np.int32
    np.testing.assert_array_equal(found.toarray(), matrix.toarray())


@pytest.mark.parametrize("name", CLOUDS)
def test_a_matrix_without_weak_couplings_is_about_the_same(operators, name):
    """It is symmetric, takes the slowest function to the same, and has nearly the energy of smooth ones."""
    laplacian = operators(name)
    root = np.sqrt(laplacian.areas)
    matrix = (sparse.diags_array(1.0 / root) @ laplacian.stiffness @ sparse.diags_array(1.0 / root)).tocsr()
    with ThreadPoolExecutor(2) as pool:
        strong = hierarchy._strong(Rows(matrix, pool, silent), laplacian.stiffness.diagonal(), root)
    assert strong.nnz < 0.8 * matrix.nnz
    assert strong.indices.dtype == strong.indptr.dtype == matrix.indices.dtype
    assert abs(strong - strong.T).max() <= 1e-12 * abs(matrix).max()
    np.testing.assert_allclose(strong @ root, matrix @ root, rtol=0.0, atol=1e-12 * abs(matrix).max())
    smooth = root * np.sin(3.0 * laplacian.points[:, 0])
    assert 0.9 < (smooth @ strong @ smooth) / (smooth @ matrix @ smooth) < 1.01


def attached(extra, links):
    """Smooth matrix of a random sphere, with few more unknowns that hardly couple with it."""
    points = random_sphere(6000)
    matrix = kernel_matrix(points, 0.12)
    matrix /= matrix.diagonal().mean()
    whole = sparse.block_array([[matrix, None], [None, sparse.csr_array(extra)]]).tolil()
    for own, other, weight in links:
        own += len(points)
        whole[own, other] = whole[other, own] = -weight
        whole[own, own] += weight
        whole[other, other] += weight
    return whole.tocsr()


class TestPointsThatHardlyCouple:
    """Few points that lie nearly apart from all others, as scans of depth cameras have them."""

    def check(self, matrix, mass, scale):
        root = 1.0 / np.sqrt(mass)
        scaled = (sparse.diags_array(root) @ matrix @ sparse.diags_array(root)).tocsr()
        found = coarse_to_fine(scaled, 1.0 / root, 20, 2e-7, scale, lambda *_: None)
        assert found is not None
        exact = np.sort(eigsh(scaled, 20, sigma=-1e-4, return_eigenvectors=False))
        np.testing.assert_allclose(found[0][1:], exact[1:], rtol=1e-6)

    def test_a_pair_whose_largest_eigenvalue_is_not_seen_among_many(self, monkeypatch):
        monkeypatch.setattr(hierarchy, "rough_largest_eigenvalue", lambda *_: 1.54)  # as of 240,000 points
        matrix = attached(0.3 * np.array([[1.0, -1.0], [-1.0, 1.0]]), [(k, 7 + k + 5 * j, 1e-4) for k, j in PAIRS])
        self.check(matrix, np.append(np.ones(6000), [1.0, 5.0]), 0.0)

    def test_many_of_large_areas(self):
        ring = sparse.eye_array(100) - sparse.csr_array(np.roll(np.eye(100), 1, axis=1))
        links = [(own, 50 * own + j, 0.03) for own in range(100) for j in range(3)]
        self.check(attached(0.009 * (ring.T @ ring), links), np.append(np.ones(6000), np.full(100, 3.0)), 0.1)
