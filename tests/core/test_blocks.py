import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import get_cached_controller

import core
from benchmarks.samplings import fibonacci_sphere
from core.algebra.blocks import blocks, by_blocks, on_all_cores, workers


@pytest.mark.parametrize(("count", "size"), [(10, 3), (9, 3), (2, 5), (0, 4)])
def test_blocks_cover_all_rows_once(count, size):
    rows = [np.arange(count)[block] for block in blocks(count, size)]
    np.testing.assert_array_equal(np.concatenate([*rows, []]), np.arange(count))
    assert all(len(part) <= size for part in rows)


def test_cores_share_blocks_evenly():
    for count, many in (8, 1), (9, 2), (17, 4), (33, 8), (65, 16):
        sizes = [block.stop - block.start for block in blocks(count, 8)]
        assert len(sizes) == many
        assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("parts", [[], [3], list(range(20))])
def test_results_come_in_the_order_of_the_parts(parts):
    assert on_all_cores(lambda part: part**2, parts) == [part**2 for part in parts]


@pytest.mark.parametrize("count", [0, 1, 20_000])
def test_rows_of_an_array_come_in_their_order(count):
    found = by_blocks(lambda rows: np.arange(count)[rows, None] * np.array([1, 10]), count)
    np.testing.assert_array_equal(found, np.arange(count)[:, None] * [1, 10])


def test_no_further_part_is_begun_after_a_cancel():
    reports, begun = [], []

    def report():
        reports.append(None)
        if len(reports) > 3:
            raise core.Cancelled

    def part(number):
        begun.append(number)
        time.sleep(1e-3)

    with pytest.raises(core.Cancelled):
        on_all_cores(part, range(10_000), report)
    assert len(begun) < 10_000


def test_a_thread_keeps_its_pool_and_parts_may_have_parts(monkeypatch):
    monkeypatch.setenv("MESHFREE_CORES", "2")
    threads = set()

    def part(number):
        threads.add(threading.get_ident())
        return sum(on_all_cores(lambda other: number * other, range(4)))

    with workers() as pool, workers() as again:
        assert again is pool
        for _ in range(5):
            assert on_all_cores(part, range(4)) == [0, 6, 12, 18]
    assert len(threads) <= 2
    with workers() as other:
        assert other is not pool


def test_no_part_runs_any_more_after_an_error(monkeypatch):
    monkeypatch.setenv("MESHFREE_CORES", "2")
    running = []

    def part(number):
        running.append(number)
        time.sleep(0.05 * number)
        if number == 0:
            raise ValueError("of the first part")
        running.remove(number)

    with workers():
        with pytest.raises(ValueError, match="of the first part"):
            on_all_cores(part, range(4))
        assert running == [0]


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


@pytest.fixture
def three():
    """Let BLAS have three threads, whatever the machine or its environment says."""
    if not threads_of_blas():
        pytest.skip("this BLAS does not let its threads be counted, such as that of macOS")
    with get_cached_controller().limit(limits=3, user_api="blas"):
        assert threads_of_blas() == {3}
        yield


def threads_of_blas():
    return {library["num_threads"] for library in get_cached_controller().info() if library["user_api"] == "blas"}


def test_blas_has_no_threads_while_ours_work(three):
    with workers() as pool:
        assert set().union(*pool.map(lambda part: threads_of_blas(), range(9))) == {1}
        assert on_all_cores(lambda part: threads_of_blas(), [0, 1]) == [{1}, {1}]
        assert threads_of_blas() == {1}
    assert threads_of_blas() == {3}


def test_blas_has_no_threads_from_the_start_to_the_end_of_a_build(three):
    seen = []
    core.build_laplacian(fibonacci_sphere(2000), progress=lambda *_: seen.append(threads_of_blas()))
    assert len(seen) > 9
    assert all(threads == {1} for threads in seen[:-1])
    assert seen[-1] == {3}  # told after it that all is done


def test_blas_has_its_threads_again_after_an_error(three):
    with pytest.raises(core.Cancelled), workers():
        raise core.Cancelled
    assert threads_of_blas() == {3}


def test_blas_has_its_threads_again_after_the_last_of_several_pools(three):
    """Those of two threads, of which the one that begins first ends first, and lives on."""
    first, last = workers(), workers()
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as other:
        one.submit(first.__enter__).result()
        other.submit(last.__enter__).result()
        one.submit(first.__exit__, None, None, None).result()
        assert threads_of_blas() == {1}
        other.submit(last.__exit__, None, None, None).result()
        assert threads_of_blas() == {3}
        with workers():
            assert threads_of_blas() == {1}
