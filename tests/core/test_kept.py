"""What an operator keeps of what was computed of it."""

from threading import Barrier, Thread

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import core
from core.operator.kept import Kept

POINTS = core.example_sphere()


def test_modes_are_computed_once_and_fewer_are_the_lowest_of_them(monkeypatch):
    laplacian = core.build_laplacian(POINTS)
    many = laplacian.eigenpairs(12, raw=True)  # since the correction rounds by the places in an array
    monkeypatch.setattr("core.operator.laplacian.solve_spectrum", None)  # which would fail
    few = laplacian.eigenpairs(5, raw=True)
    assert_array_equal(few.eigenvalues, many.eigenvalues[:5])
    assert_array_equal(few.eigenvectors, many.eigenvectors[:, :5])
    assert_array_equal(few.residuals, many.residuals[:5])
    for other in ({"tolerance": 1e-9}, {"dirichlet": True}, {"count": 13}):
        with pytest.raises(TypeError):
            laplacian.eigenpairs(**{"count": 5, **other})
    laplacian.release()
    with pytest.raises(TypeError):
        laplacian.eigenpairs(5)


def test_counts_that_make_no_sense_are_refused_where_modes_are_kept():
    laplacian = core.build_laplacian(POINTS)
    laplacian.eigenpairs(5)
    for count in (0, -1, 2.5, len(POINTS)):
        with pytest.raises(core.TooFewPointsError):
            laplacian.eigenpairs(count)


def test_a_turned_operator_keeps_its_own():
    laplacian = core.build_laplacian(POINTS)
    laplacian.kept.result("name", lambda: "one side")
    assert laplacian.toward(-POINTS).kept.result("name", lambda: "the other") == "the other"
    assert laplacian.kept.result("name", lambda: "new") == "one side"


def test_of_results_that_depend_on_settings_the_last_is_kept():
    kept, calls = Kept(), []

    def found(*settings):
        return kept.result("a", lambda: calls.append(settings) or len(calls), *settings)

    assert found(1, np.arange(3)) == found(1, np.arange(3)) == 1
    assert found(1, np.arange(3.0)) == 2  # of another type
    assert found(1, np.arange(3)) == 3
    assert found(2, np.arange(3)) == 4


def test_nothing_is_kept_of_a_computation_that_was_cancelled():
    kept = Kept()

    def cancelled():
        raise core.Cancelled

    with pytest.raises(core.Cancelled):
        kept.result("a", cancelled)
    assert kept.result("a", lambda: 1) == 1


def test_threads_that_need_the_same_wait_for_it_and_others_do_not():
    kept, start, calls = Kept(), Barrier(4), []

    def work(name):
        start.wait()
        kept.result(name, lambda: calls.append(name))

    threads = [Thread(target=work, args=(name,)) for name in "aaab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(calls) == ["a", "b"]
    assert kept.result("c", lambda: kept.result("a", lambda: 1)) is None  # one result may need others
