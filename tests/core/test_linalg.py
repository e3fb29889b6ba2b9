"""Functions of numpy.linalg, for threads."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from core import linalg


def test_threads_are_in_one_of_the_functions_at_a_time():
    inside, seen = [], []

    def work(number):
        inside.append(number)
        time.sleep(0.002)  # others would come in meanwhile
        seen.append(len(inside))
        inside.remove(number)
        return number

    one, another = (linalg.one_at_a_time(work, needed=True) for _ in range(2))
    with ThreadPoolExecutor(4) as pool:
        found = [pool.submit(function, number) for number, function in enumerate([one, another] * 10)]
    assert [future.result() for future in found] == list(range(20))
    assert seen == [1] * 20


def test_an_error_lets_the_next_one_in():
    def fail():
        raise np.linalg.LinAlgError

    failing = linalg.one_at_a_time(fail, needed=True)
    for _ in range(2):
        with pytest.raises(np.linalg.LinAlgError):
            failing()


def test_where_numpy_waits_itself_its_functions_are_taken_as_they_are():
    needed = np.lib.NumpyVersion(np.__version__) < "2.1.0"
    assert linalg.one_at_a_time(np.linalg.svd, needed=False) is np.linalg.svd
    for name in ("cond", "det", "eigh", "eigvalsh", "inv", "pinv", "solve", "svd"):
        assert (getattr(linalg, name) is getattr(np.linalg, name)) is not needed
