"""What does not fit the free memory is refused before the start, with the number that fits."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from core import memory

POINTS = fibonacci_sphere(1000)
DEFAULT = core.LaplacianOptions()


@pytest.fixture
def free(monkeypatch):
    """Function that sets the free memory, None for unknown."""
    return lambda size: monkeypatch.setattr(memory, "available_memory", lambda: size)


def test_the_need_grows_with_points_neighbors_and_modes():
    one = memory.needed_memory(1000, DEFAULT)
    assert memory.needed_memory(2000, DEFAULT) == 2 * one
    assert memory.needed_memory(1000, DEFAULT, modes=50) > one
    assert memory.needed_memory(1000, core.LaplacianOptions(bandwidth_factor=1.7)) > 1.5 * one
    assert memory.needed_memory(1000, core.PaperOptions().cloud) > 5.0 * one


def test_the_number_that_fits_is_not_refused(free):
    free(10_000_000)
    most = core.points_that_fit(DEFAULT)
    memory.check_memory(most, DEFAULT)
    with pytest.raises(core.NotEnoughMemoryError) as caught:
        memory.check_memory(most + 1, DEFAULT)
    assert caught.value.fitting == most


def test_an_operator_is_refused_before_the_start(free):
    free(5_000_000)
    stages = []
    with pytest.raises(core.NotEnoughMemoryError, match=r"1,000 points .* enough for \d\d0 points\. Use fewer points"):
        core.build_laplacian(POINTS, progress=lambda *stage: stages.append(stage))
    assert stages == []


def test_modes_are_refused_before_the_start(free):
    laplacian = core.build_laplacian(POINTS)
    free(1_000_000)
    with pytest.raises(core.NotEnoughMemoryError, match="100 modes of 1,000 points .* enough for 11 modes") as caught:
        laplacian.eigenpairs(100)
    assert caught.value.fitting == 11
    assert len(laplacian.eigenpairs(4).eigenvalues) == 4


@pytest.mark.parametrize(("octaves", "refused"), [(5.0, False), (12.0, True)])
def test_modes_in_double_precision_are_refused_before_they_take_twice_as_much(free, octaves, refused):
    count = 2000
    turns, reach = (3.0 - np.sqrt(5.0)) * np.pi * np.arange(count), np.exp2(octaves * np.arange(count) / count)
    laplacian = core.build_laplacian(np.column_stack([reach * np.cos(turns), reach * np.sin(turns), 0.0 * turns]))
    free(2_500_000)
    if refused:
        with pytest.raises(core.NotEnoughMemoryError, match="10 modes of 2,000 points .* enough for 6 modes"):
            laplacian.eigenpairs(10)
        free(5_000_000)
    disc = 1.84118**2 / reach[-1] ** 2  # without what is left open in the middle
    assert laplacian.eigenpairs(10).eigenvalues[1] == pytest.approx(disc, rel=0.1)


def test_without_knowledge_nothing_is_refused(free):
    free(None)
    assert core.points_that_fit(DEFAULT) is None
    memory.check_memory(10**12, DEFAULT)
    memory.check_mode_memory(10**12, 10**6)


def test_this_machine_tells_its_free_memory():
    assert 1 << 26 < memory.available_memory() < 1 << 50


def test_linux(tmp_path):
    known = tmp_path / "meminfo"
    known.write_text("MemTotal:  2000 kB\nMemAvailable:   1000 kB\nHugePages_Total:       0\n")
    assert memory._linux_memory(known) == 1_024_000
    assert memory._linux_memory(tmp_path / "none") is None
