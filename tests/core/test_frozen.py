"""Results of the public calls stay what they are: nobody can write to their arrays."""

import dataclasses
import inspect
import pickle

import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.samplings import fibonacci_sphere
from core.frozen import Frozen
from core.options import LaplacianOptions, PaperOptions
from tests.public import PUBLIC

RESULTS = sorted(
    (one for one in PUBLIC.values() if inspect.isclass(one) and dataclasses.is_dataclass(one)),
    key=lambda one: one.__name__,
)


def test_all_frozen_results_are_of_one_base():
    assert len(RESULTS) > 15
    frozen = {one for one in RESULTS if one.__dataclass_params__.frozen} - {LaplacianOptions, PaperOptions}
    assert [one for one in frozen if not issubclass(one, Frozen)] == []


@dataclasses.dataclass(frozen=True)
class Sample(Frozen):
    array: np.ndarray
    matrix: sparse.csr_array
    several: list
    notices: list
    nothing: None = None


@pytest.fixture
def given():
    return Sample(np.arange(3.0), sparse.csr_array(np.eye(3)), [core.motion.WaveState(np.ones(2), np.zeros(2))], ["a"])


def test_arrays_of_a_result_are_read_only(given):
    [state] = given.several
    for array in (given.array, given.matrix.data, given.matrix.indices, given.matrix.indptr, *state):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5
    given.notices.append("b")
    assert given.notices == ["a", "b"]
    assert dataclasses.replace(given, array=None).matrix.data.base is not None


def test_what_was_given_stays_as_it_was():
    points, matrix = fibonacci_sphere(50), sparse.csr_array(np.eye(3))
    sample = Sample(points, matrix, [points], [])
    points[0], matrix.data[0] = 7.0, 7.0
    assert sample.array[0, 0] == sample.matrix[0, 0] == 7.0  # no copy


def test_operators_and_what_is_found_with_them(operators):
    laplacian = operators("even sphere")
    spectrum = laplacian.eigenpairs(4)
    written = [laplacian.areas, laplacian.points, laplacian.stiffness.data, laplacian.agreed.component]
    written += [spectrum.eigenvalues, spectrum.eigenvectors, laplacian.toward(laplacian.points).normals]
    for array in written:
        with pytest.raises(ValueError, match="read-only"):
            array += 1


def test_points_of_the_caller_can_still_be_moved():
    points = fibonacci_sphere(400)
    core.build_laplacian(points)
    points += 1.0


def test_matrices_that_are_not_sorted_can_be_used_and_stay_as_they_were():
    matrix = sparse.csr_array((np.array([1.0, 2.0, 3.0]), np.array([2, 0, 2]), np.array([0, 3, 3, 3])), shape=(3, 3))
    sample = Sample(np.ones(1), matrix, [], [])
    assert (sample.matrix - sample.matrix.T).toarray()[0].tolist() == [0.0, 0.0, 4.0]
    assert matrix.indices.tolist() == [2, 0, 2]


def test_they_can_be_pickled(given):
    again = pickle.loads(pickle.dumps(given))
    np.testing.assert_array_equal(again.array, given.array)
    np.testing.assert_array_equal(again.matrix.toarray(), np.eye(3))
