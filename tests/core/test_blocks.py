import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from core.algebra.blocks import blocks, on_all_cores


@pytest.mark.parametrize(("count", "size"), [(10, 3), (9, 3), (2, 5), (0, 4)])
def test_blocks_cover_all_rows_once(count, size):
    rows = [np.arange(count)[block] for block in blocks(count, size)]
    np.testing.assert_array_equal(np.concatenate([*rows, []]), np.arange(count))
    assert all(len(part) <= size for part in rows)


@pytest.mark.parametrize("parts", [[], [3], list(range(20))])
def test_results_come_in_the_order_of_the_parts(parts):
    assert on_all_cores(lambda part: part**2, parts) == [part**2 for part in parts]


def test_no_further_part_is_begun_after_a_cancel():
    reports, begun = [], []

    def report():
        reports.append(None)
        if len(reports) > 3:
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        on_all_cores(begun.append, range(10_000), report)
    assert len(begun) < 10_000


def test_an_error_of_a_part_comes_through():
    with pytest.raises(ZeroDivisionError):
        on_all_cores(lambda part: 1 / part, [2, 1, 0])


def test_the_same_bits_on_one_core(monkeypatch):
    points = fibonacci_sphere(9_000) * [1.0, 0.8, 0.6]
    several = core.build_laplacian(points)
    monkeypatch.setenv("MESHFREE_CORES", "1")
    one = core.build_laplacian(points)
    np.testing.assert_array_equal(one.areas, several.areas)
    np.testing.assert_array_equal(one.stiffness.data, several.stiffness.data)
