"""Tiles on disk: the same as in memory, whatever is killed, and whatever is wrong with some of them."""

import json
import os
import shutil
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from core.tiles.medians import median

LENGTH, RADIUS, COUNT = 12.0, 0.1, 2400


@cache
def rod():
    """Return random points of a rod with noise, (n, 3)."""
    rng = np.random.default_rng(3)
    angle, along = rng.uniform(0.0, 2.0 * np.pi, COUNT), rng.uniform(0.0, LENGTH, COUNT)
    spacing = np.sqrt(2.0 * np.pi * RADIUS * LENGTH / COUNT)
    points = np.column_stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)])
    return points + 0.15 * spacing * rng.normal(size=points.shape)


def stored(folder, points, most, pieces=3, **choice):
    """Cut points into a store, read in several pieces."""
    parts = np.array_split(np.arange(len(points)), pieces)
    columns = {"row": np.arange(len(points))}

    def chunks():
        return ((points[part], {name: values[part] for name, values in columns.items()}) for part in parts)

    return core.tiles.cut_to_store(chunks, folder / "store", most, **choice)


def joined(store, name):
    """Return a result at all points in the order of the input."""
    rows = np.concatenate([store.columns(number)["row"] for number in store.alive])
    values = np.concatenate([store.read("measure", number, name) for number in store.alive])
    return values[np.argsort(rows)]


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A store after all steps, and what was told of the progress."""
    store, told = stored(tmp_path_factory.mktemp("tiles"), rod(), 640, wavelength=0.0), []
    core.tiles.run_steps(store, progress=lambda *given: told.append(given))
    return store, told


@pytest.fixture
def measured(walk):
    return walk[0]


@cache
def whole():
    return core.build_laplacian(rod())


def same(found, wanted, rtol=1e-5):
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=rtol * np.abs(wanted).max())


class TestStore:
    def test_gives_what_the_whole_gives(self, measured):
        laplacian = whole()
        assert measured.count == 4
        for name in ("normals", "areas", "smoothing_lengths", "gaussian_curvature", "trust", "surface_points"):
            same(joined(measured, name), getattr(laplacian, name))
        same(joined(measured, "mean_curvature"), core.measure.mean_curvature(laplacian))
        np.testing.assert_array_equal(joined(measured, "boundary"), laplacian.boundary)
        np.testing.assert_array_equal(joined(measured, "component"), laplacian.component)
        assert abs(joined(measured, "areas").sum() / laplacian.areas.sum() - 1.0) < 1e-9

    def test_agrees_with_another_cut_of_points_in_another_order(self, measured, tmp_path):
        order = np.random.default_rng(0).permutation(COUNT)
        other = stored(tmp_path, rod()[order], 880, pieces=1)
        core.tiles.run_steps(other)
        assert other.count == 3
        assert core.tiles.ROUGHNESS not in other.names("measure", 0)  # which was not asked for
        for name in ("normals", "areas", "mean_curvature"):
            same(joined(other, name), joined(measured, name)[order])

    def test_tells_how_far_it_is(self, walk):
        stages, fractions = zip(*walk[1], strict=True)
        assert list(fractions) == sorted(fractions)
        assert fractions[0] == 0.0
        np.testing.assert_allclose(fractions[-1], 1.0)
        found = [fraction for stage, fraction in walk[1] if stage == "Areas"]
        assert len(found) == 1 + 4  # at the start, and after each tile
        np.testing.assert_allclose(np.diff(found), np.ptp(found) / 4)
        assert stages[-1] == "Operator"

    def test_gives_the_roughness_of_the_whole(self, measured):
        length = float(np.median(whole().smoothing_lengths))
        assert abs(measured.record["wavelength"] / (9.0 * length) - 1.0) < 1e-9
        same(joined(measured, core.tiles.ROUGHNESS), core.clean.roughness(whole()), 1e-6)
        assert core.tiles.doubted_wavelength(measured.record, core.tiles.HALO) is None
        longer = {**measured.record, "wavelength": np.array(40.0 * length)}
        wavelength, share = core.tiles.doubted_wavelength(longer, core.tiles.HALO)
        assert wavelength == 40.0 * length
        assert 0.01 < share < 1.0

    def test_keeps_no_states_and_no_parts_at_the_end(self, measured):
        names = {path.name.partition(".")[0] for path in measured.folder.rglob("*")}
        assert not any(name.startswith(("state", ".")) or not name for name in names)

    def test_does_nothing_again(self, measured):
        before = {path: path.stat().st_mtime_ns for path in measured.folder.rglob("*")}
        core.tiles.run_steps(core.tiles.Store(measured.folder))
        assert {path: path.stat().st_mtime_ns for path in measured.folder.rglob("*")} == before


KILLED = """
import os, signal, sys
from pathlib import Path
import core
folder, step = sys.argv[1:]
store = core.tiles.Store(folder)
replace = os.replace
def dies(source, target):
    if Path(target).stem == step:
        os.kill(os.getpid(), signal.SIGKILL)
    replace(source, target)
os.replace = dies
core.tiles.run_steps(store)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL there")
def test_a_killed_walk_goes_on_to_the_same_bits(measured, tmp_path):
    store = stored(tmp_path, rod(), 640)
    root = Path(__file__).parents[2]
    for step in ("sheets", "agreed-patches"):  # while a tile tells, and while all agree
        died = subprocess.run([sys.executable, "-c", KILLED, store.folder, step], cwd=root)
        assert died.returncode == -signal.SIGKILL
        assert list(store.folder.rglob(f".{step}.*"))
    store = core.tiles.Store(store.folder)
    core.tiles.run_steps(store)
    for number in measured.alive:
        for name in ("areas", "mean_curvature", "normals"):
            np.testing.assert_array_equal(store.read("measure", number, name), measured.read("measure", number, name))
    assert not list(store.folder.rglob(".*"))
    assert not list(store.folder.rglob("state-*"))


class TestBrokenTiles:
    def test_are_told_and_the_others_done(self, tmp_path):
        store = stored(tmp_path, rod(), 360)
        end = np.argsort([store.own(number)[:, 0].mean() for number in range(store.count)])[-4:]
        away = [50.0, 0.0, 0.0]  # beyond all halos
        for number, points in zip(
            end,
            (
                np.zeros((0, 3)),
                away + 0.01 * np.eye(3),
                np.linspace(0.0, 1.0, 200)[:, None] * away + 2.0 * np.array(away),
                np.full((200, 3), np.nan),
            ),
            strict=True,
        ):
            np.save(store.folder / f"{number:06d}" / "points.npy", points)
        core.tiles.run_steps(store)
        errors = [store.error(number) for number in end]
        for error, text in zip(errors, ("no points", "different points", "straight line", "not finite"), strict=True):
            assert text in error
        assert store.alive == sorted(set(range(store.count)) - set(end.tolist()))
        for number in store.alive:
            assert np.all(store.read("measure", number, "component") == 0)
            assert np.all(store.read("measure", number, "areas") > 0.0)

    def test_that_fill_a_volume_ask_for_too_much_memory(self, tmp_path):
        cube = np.random.default_rng(0).random((3000, 3))
        points = np.concatenate([rod(), cube + [50.0, 0.0, 0.0]])
        needed = core.memory.needed_memory(2200, core.LaplacianOptions())
        store = core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 800, halo=30.0, memory=needed)
        core.tiles.run_steps(store)
        errors = [store.error(number) for number in range(store.count)]
        crowded = [store.own(number)[:, 0].min() > 49.0 for number in range(store.count)]
        assert sum(crowded) >= 3
        for error, in_cube in zip(errors, crowded, strict=True):
            assert (error is not None) == in_cube
            assert error is None or "fill a volume" in error

    def test_are_not_all(self, tmp_path):
        line = np.column_stack([np.linspace(0.0, 1.0, 500), np.zeros((500, 2))])
        store = core.tiles.cut_to_store(lambda: [(line, {})], tmp_path / "store", 300)
        with pytest.raises(core.ComponentError, match="None of the tiles"):
            core.tiles.run_steps(store)


class TestCut:
    def test_keeps_columns_that_all_chunks_have(self, tmp_path):
        points = rod()

        def chunks():
            yield points[:1000], {"class": np.full(1000, 2, np.uint8), "lone": np.zeros(1000)}
            yield points[1000:], {"class": np.full(1400, 300, np.uint16)}

        store = core.tiles.cut_to_store(chunks, tmp_path / "store", 1280)
        assert [list(store.columns(number)) for number in range(store.count)] == [["class"], ["class"]]
        counts = np.bincount(np.concatenate([store.columns(number)["class"] for number in range(2)]))
        assert (counts[2], counts[300]) == (1000, 1400)
        assert store.manifest["columns left out"] == ["lone"]

    def test_finds_center_and_scale(self, tmp_path):
        points = rod() + [1e6, 0.0, 0.0]
        store = stored(tmp_path, points, 640, pieces=7)
        scaled = points - points.mean(axis=0)
        np.testing.assert_allclose(store.record["center"], points.mean(axis=0), rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(store.record["scale"], np.sqrt((scaled**2).sum(axis=1).mean()), rtol=1e-12)

    def test_refuses_a_folder_that_exists(self, measured):
        with pytest.raises(core.PointCloudError, match="exists"):
            core.tiles.cut_to_store(lambda: [(rod(), {})], measured.folder, 100)

    def test_refuses_files_that_change(self, tmp_path):
        counts = iter((2400, 2000))
        with pytest.raises(core.PointCloudError, match="when read again"):
            core.tiles.cut_to_store(lambda: [(rod()[: next(counts)], {})], tmp_path / "store", 800)

    def test_leaves_room_for_halos(self, tmp_path):
        side, fitting, halo = 60, 1100, 5.0  # four tiles of 900 points would have 1225 with their halos
        points = np.stack(np.meshgrid(*2 * [np.arange(side, dtype=float)], [0.0]), axis=-1).reshape(-1, 3)
        points += 0.1 * np.random.default_rng(0).normal(size=points.shape)
        memory = core.memory.needed_memory(fitting, core.LaplacianOptions())
        store = core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 900, halo=halo, memory=memory)
        while (waiting := core.tiles.pending(store))[0].name in ("extent", "halo"):
            for number in waiting[1]:
                core.tiles.visit_tile(store.folder, waiting[0].name, number)
            core.tiles.settle(store)
        assert 4 < store.count <= 8
        assert len(store.alive) == store.count
        assert max(len(store.part(number).points) for number in range(store.count)) <= fitting

    def test_each_worker_has_as_many_tiles(self, tmp_path):
        counts = []
        for workers, halo in [(1, 5.0), (2, 5.0), (8, 5.0), (8, 15.0)]:
            folder = tmp_path / f"{workers} {halo}"
            store = core.tiles.cut_to_store(lambda: [(rod(), {})], folder, 960, halo=halo, workers=workers)
            counts.append(store.count)
        assert counts == [3, 4, 8, 3]  # at last they would be narrow against their halos

    def test_parts_from_what_fills_a_volume_what_is_apart(self, tmp_path):
        rng = np.random.default_rng(0)
        points = np.concatenate([rod(), rng.random((9000, 3)) + [50.0, 0.0, 0.0], np.eye(3) + [90.0, 0.0, 0.0]])
        memory = core.memory.needed_memory(5000, core.LaplacianOptions())
        store = core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 4500, halo=20.0, memory=memory)
        core.tiles.run_steps(store)
        assert sum(len(store.own(number)) for number in store.alive) == COUNT
        errors = {store.error(number).split(":")[0] for number in range(store.count) if number not in store.alive}
        assert len(errors) >= 2

    def test_needs_memory_for_more_than_halos(self):
        options = core.LaplacianOptions()
        most = core.tiles.points_of_tile(2 << 30, options)
        with_halo = (np.sqrt(most) + 2.0 * core.tiles.HALO) ** 2
        assert 0.99 < core.memory.needed_memory(int(with_halo), options) / (2 << 30) <= 1.0
        with pytest.raises(core.NotEnoughMemoryError, match="at least"):
            core.tiles.points_of_tile(1 << 27, options)


def test_modes_are_carried_from_evenly_spread_points_to_all(tmp_path):
    points = fibonacci_sphere(2400)
    store = core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 1200)
    core.tiles.run_steps(store)
    core.tiles.ask_for_modes(store, 4, 700)
    core.tiles.run_steps(store)
    values = next(store.told("spectrum", "values"))
    np.testing.assert_allclose(values, [0.0, 2.0, 2.0, 2.0], atol=0.02)
    source, normals, vectors = (next(store.told("spectrum", name)) for name in ("points", "normals", "vectors"))
    assert len(source) <= 700
    every = core.clean.Prolongation(np.concatenate([source, points]), np.arange(len(source)), normals)
    found = np.concatenate([store.read("modes", number, "modes") for number in range(2)])
    own = np.concatenate([store.own(number) for number in range(2)])
    order = np.lexsort(points.T)
    wanted = every.interpolate(vectors)[len(source) :][order]
    np.testing.assert_allclose(found[np.lexsort(own.T)], wanted, atol=1e-5 * np.abs(wanted).max())
    areas = np.concatenate([store.read("measure", number, "areas") for number in range(2)])
    np.testing.assert_allclose(found.T @ (areas[:, None] * found), np.eye(4), atol=0.02)
    core.tiles.ask_for_modes(store, 4, 700)
    assert core.tiles.pending(store) is None
    core.tiles.ask_for_modes(store, 5, 700)
    assert core.tiles.pending(store)[0].name == "spectrum"
    core.tiles.ask_for_modes(store, 5, 600)
    assert core.tiles.pending(store)[0].name == "candidates"


def test_no_store(tmp_path):
    with pytest.raises(core.PointCloudError, match="holds no tiles"):
        core.tiles.Store(tmp_path)
    (tmp_path / "manifest.json").write_text(json.dumps({"version": 0}))
    with pytest.raises(core.PointCloudError, match="another version"):
        core.tiles.Store(tmp_path)


def test_a_state_that_calls_something_is_refused(measured, tmp_path):
    class Calls:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "called"),)

    shutil.copytree(measured.folder, tmp_path / "store")
    store = core.tiles.Store(tmp_path / "store")
    store.put("x", 0, {}, Calls())
    with pytest.raises(core.PointCloudError, match="no part of a state"):
        store.state("measure", 0)
    assert not (tmp_path / "called").exists()


@pytest.mark.parametrize("count", [1, 2, 5, 1000])
def test_medians_of_parts_are_those_of_all(count):
    values = np.random.default_rng(count).lognormal(size=count)
    assert median(lambda: np.array_split(values, 3)) == np.median(values)
