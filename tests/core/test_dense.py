"""Products by scipy's BLAS are those of numpy."""

import numpy as np
import pytest

from core.algebra import dense


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("work", [1, 1000, 1 << 24])
@pytest.mark.parametrize(
    ("m", "k", "n"),
    [(500, 7, 5), (7, 500, 5), (6, 6, 6), (1, 1, 1), (1, 9, 1), (9, 1, 1), (3, 4, 90), (0, 3, 2), (3, 0, 2), (2, 3, 0)],
)
def test_product_of_all_orders(monkeypatch, dtype, work, m, k, n):
    monkeypatch.setattr(dense, "_WORK", work)
    rng = np.random.default_rng(0)
    for flip_left in (False, True):
        for flip_right in (False, True):
            left = rng.standard_normal((k, m) if flip_left else (m, k)).astype(dtype)
            right = rng.standard_normal((n, k) if flip_right else (k, n)).astype(dtype)
            left, right = left.T if flip_left else left, right.T if flip_right else right
            result = dense.product(left, right)
            assert result.dtype == dtype
            assert result.flags.c_contiguous
            np.testing.assert_allclose(result, left @ right, rtol=0, atol=1e4 * np.finfo(dtype).eps)


@pytest.mark.parametrize(
    "change",
    [
        lambda matrix: matrix[5:, 3:15],
        lambda matrix: matrix.T[5:17, 3:15].T,
        lambda matrix: matrix[::2, ::3],
        lambda matrix: matrix[::-1],
        lambda matrix: np.broadcast_to(matrix[:1], matrix.shape),
        lambda matrix: np.broadcast_to(matrix[:, :1], matrix.shape),
        lambda matrix: matrix.astype(np.float32),
    ],
)
def test_product_of_parts_of_matrices(change):
    rng = np.random.default_rng(0)
    left = change(rng.standard_normal((50, 20)))
    right = change(rng.standard_normal((30, 24)))[: left.shape[1]]
    left = left[:, : len(right)]
    atol = 1e-5 if left.dtype == np.float32 else 1e-12
    np.testing.assert_allclose(dense.product(left, right), left @ right, rtol=0, atol=atol)
    np.testing.assert_allclose(dense.product(right.T, left.T), right.T @ left.T, rtol=0, atol=atol)


@pytest.mark.parametrize("work", [1, 1000, 1 << 24])
@pytest.mark.parametrize("shape", [(90, 4, 7), (4, 90, 7), (4, 7, 90), (6, 6, 6)])
def test_product_of_two_precisions_has_the_lower_one(monkeypatch, work, shape):
    monkeypatch.setattr(dense, "_WORK", work)
    (m, k, n), rng = shape, np.random.default_rng(0)
    left, right = rng.standard_normal((m, k)), rng.standard_normal((k, n))
    for pair in ((left, right.astype(np.float32)), (left.astype(np.float32), right)):
        result = dense.product(*pair)
        assert result.dtype == np.float32
        np.testing.assert_allclose(result, left @ right, rtol=0, atol=1e-4)


def test_matrices_that_do_not_fit_have_no_product():
    with pytest.raises(ValueError, match=r"shapes \(3, 4\) and \(5, 2\)"):
        dense.product(np.ones((3, 4)), np.ones((5, 2)))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("work", [1, 1000, 1 << 24])
def test_a_product_is_subtracted_in_place(monkeypatch, dtype, work):
    monkeypatch.setattr(dense, "_WORK", work)
    rng = np.random.default_rng(0)
    result, left, right = (rng.standard_normal(shape).astype(dtype) for shape in ((90, 4), (90, 7), (7, 4)))
    expected = result - left @ right
    dense.subtract_product(result, left, right)
    np.testing.assert_allclose(result, expected, rtol=0, atol=100.0 * np.finfo(dtype).eps)


def test_a_product_is_subtracted_from_part_of_a_matrix():
    rng = np.random.default_rng(0)
    whole, left, right = rng.standard_normal((9, 8)), rng.standard_normal((2, 5)), rng.standard_normal((5, 3))
    expected = whole.copy()
    expected[3:5, 4:7] -= left @ right
    dense.subtract(whole[3:5, 4:7], left, right)
    np.testing.assert_allclose(whole, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("part", [lambda matrix: matrix.T, lambda matrix: matrix[:, ::2], lambda matrix: matrix[::-1]])
def test_a_product_is_not_subtracted_where_blas_would_write_elsewhere(part):
    whole = np.zeros((6, 6))
    target = part(whole)
    with pytest.raises(ValueError, match="not contiguous"):
        dense.subtract(target, np.ones((len(target), 2)), np.ones((2, target.shape[1])))
    with pytest.raises(ValueError, match=r"no product of the shape \(6, 6\)"):
        dense.subtract(whole, np.ones((5, 2)), np.ones((2, 6)))
    assert not whole.any()


@pytest.mark.parametrize("size", [1, 2, 7, 300])
def test_inverse_of_a_factor(size):
    half = np.random.default_rng(0).standard_normal((size, size + 4))
    matrix = half @ half.T
    wide = np.full((size, size + 3), 7.0)
    wide[:, :size] = np.triu(matrix) + np.tril(np.full((size, size), np.nan), -1)  # which is not read
    assert dense.invert_factor(wide[:, :size])
    found = wide[:, :size]
    np.testing.assert_array_equal(found, np.triu(found))
    np.testing.assert_allclose(found @ found.T @ matrix, np.eye(size), atol=1e-8)
    assert (wide[:, size:] == 7.0).all()


@pytest.mark.parametrize("least", [-1e-6, -1.0])
def test_a_matrix_that_is_not_positive_definite_has_no_factor(least):
    assert not dense.invert_factor(np.diag([1.0, 2.0, least, 3.0]))


@pytest.mark.parametrize("size", [1, 3, 6])
def test_inverses_of_many_small_matrices(monkeypatch, size):
    monkeypatch.setattr(dense, "_BLOCK", 7)
    half = np.random.default_rng(0).standard_normal((30, size, size))
    matrices = half @ np.swapaxes(half, 1, 2) + 1e-3 * np.eye(size)
    found = dense.inverses(matrices)
    np.testing.assert_allclose(found @ matrices, np.broadcast_to(np.eye(size), matrices.shape), atol=1e-9)
    assert dense.inverses(matrices[:0]).shape == (0, size, size)


def test_inverses_of_all_but_singular_matrices():
    """As of neighbours on a line, whose fits a small ridge makes solvable."""
    direction = np.array([0.6, 0.0, 0.8])
    matrix = np.outer(direction, direction) + 1e-9 * np.eye(3)
    found = dense.inverses(matrix[None])[0]
    np.testing.assert_allclose(found @ direction, direction / (1.0 + 1e-9), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found @ [0.0, 1.0, 0.0], [0.0, 1e9, 0.0], rtol=1e-6)
