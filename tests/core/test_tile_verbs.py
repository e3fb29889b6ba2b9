"""The verbs for clouds larger than memory: from files to files of results, in one go or stage by stage."""

import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import core
from command import tile_verbs, tile_work, verbs
from command.line import run as run_command
from command.stages import ToldStages
from core.files import PointTable, read_points, write_points
from tests.core import e57_files
from tests.core.copc_files import write_copc

LENGTH, RADIUS, COUNT = 10.0, 0.2, 1600
OPTIONS = ("--tile-points", 900)


@pytest.fixture
def run(capsys):
    """Run the command line; return the exit code and the JSON lines."""

    def run(*arguments):
        code = run_command([str(argument) for argument in arguments], verbs.make_verbs(), "meshfree")
        return code, [json.loads(line) for line in capsys.readouterr().out.splitlines() if line.startswith("{")]

    return run


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """Two halves of a rod, with classes and colors."""
    folder = tmp_path_factory.mktemp("scans")
    rng = np.random.default_rng(0)
    angle, along = rng.uniform(0.0, 2.0 * np.pi, COUNT), rng.uniform(0.0, LENGTH, COUNT)
    points = np.column_stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)])
    for name, half in (("a", along < 0.5 * LENGTH), ("b", along >= 0.5 * LENGTH)):
        colors = np.ones((np.count_nonzero(half), 4), np.float32)
        colors[:, 0] = 0.2 if name == "a" else 1.0
        classes = {"classification": np.full(len(colors), 2 + (name == "b"), np.uint8)}
        write_points(folder / f"{name}.ply", PointTable(points[half], classes, colors))
    return folder


@pytest.fixture(scope="module")
def done(scans, tmp_path_factory):
    """Folder of a run over both."""
    folder = tmp_path_factory.mktemp("done") / "out"
    arguments = ["tiles", "run", scans, "--out-dir", folder, *OPTIONS, "--format", "laz", "--memory", "4GB"]
    assert run_command(list(map(str, arguments)), verbs.make_verbs(), "meshfree") == 0
    return folder


class TestRun:
    def test_writes_results_and_columns_of_each_tile(self, scans, done):
        tables = [read_points(path) for path in sorted(done.glob("tile_*.laz"))]
        assert len(tables) == 2
        assert sum(len(table.points) for table in tables) == COUNT
        area = sum(table.attributes["lb_area"].astype(float).sum() for table in tables)
        points = np.concatenate([read_points(scans / f"{name}.ply").points for name in "ab"])
        whole = core.build_laplacian(points)
        assert abs(area / whole.areas.sum() - 1.0) < 1e-6
        for table in tables:
            half = table.points[:, 0] >= 0.5 * LENGTH
            np.testing.assert_array_equal(table.attributes["classification"], 2 + half)
            np.testing.assert_allclose(table.colors[:, 0], np.where(half, 1.0, 0.2), atol=1e-2)
            normal = table.attributes["normal"]
            assert np.all(np.einsum("ij,ij->i", normal[:, 1:], table.points[:, 1:]) > 0.0)
            assert set(table.attributes) >= {"lb_mean_curvature", "lb_boundary", "lb_component", "lb_trust"}

    def test_again_does_nothing_but_tell(self, run, scans, done):
        before = {path: path.stat().st_mtime_ns for path in done.rglob("*.*") if path.name != "tiles.jsonl"}
        code, [line] = run("tiles", "run", scans, "--out-dir", done, *OPTIONS, "--format", "laz")
        assert (code, line["points"], line["tiles"], line["component_count"]) == (0, COUNT, 2, 1)
        assert {path: path.stat().st_mtime_ns for path in before} == before

    def test_its_report_is_one_of_files(self, run, done):
        code, [line] = run("report", done)
        assert code == 0
        assert (line["files"], line["failed"], line["points"]) == (2, 0, COUNT)

    def test_other_files_or_settings_need_another_folder(self, run, scans, done):
        for arguments in (
            (scans / "a.ply",),
            (scans, "--boundary", "off"),
            (scans, "--classes", "2"),
            (scans, "--meters"),
        ):
            code, [line] = run("tiles", "run", *arguments, "--out-dir", done)
            assert (code, "other files or settings" in line["error"]) == (1, True)

    def test_several_workers_need_dask(self, scans, done, monkeypatch):
        monkeypatch.setitem(__import__("sys").modules, "distributed", None)
        with pytest.raises(core.PointCloudError, match="Dask"), tile_work.workers(2, ""):
            pass

    @pytest.mark.parametrize(
        "wrong",
        [("--workers", "0"), ("--memory", "much"), ("--part", "1/2"), ("--columns", "x y z"), ("--tile-points", 0)],
    )
    def test_wrong_usage(self, run, scans, tmp_path, wrong):
        assert run("tiles", "run", scans, "--out-dir", tmp_path / "out", *wrong) == (2, [])

    def test_too_little_memory_is_for_another_machine(self, run, scans, tmp_path):
        code, [line] = run("tiles", "run", scans, "--out-dir", tmp_path / "out", "--memory", "100MB")
        assert (code, "GB are allowed" in line["error"]) == (3, True)


@pytest.mark.parametrize("ending", ["laz", "ply"])
def test_one_file_is_the_files_of_tiles_joined(run, done, tmp_path, ending):
    path = tmp_path / f"all.{ending}"
    assert run("tiles", "measure", done, "--format", ending)[0] == 0
    code, [line] = run("tiles", "report", done, "--tile-format", ending, "--one-file", path)
    assert (code, line["notices"]) == (0, [])
    tables = [read_points(tile) for tile in sorted(done.glob(f"tile_*.{ending}"))]
    found = read_points(path)
    np.testing.assert_allclose(found.points, np.concatenate([table.points for table in tables]), atol=1e-9)
    np.testing.assert_array_equal(found.colors, np.concatenate([table.colors for table in tables]))
    assert found.attributes.keys() == tables[0].attributes.keys()
    for name, values in found.attributes.items():
        np.testing.assert_array_equal(values, np.concatenate([table.attributes[name] for table in tables]))


def test_choices_of_results(run, tmp_path):
    """The inner side, as seen from the middle, with roughness, at smoothed points."""
    rng = np.random.default_rng(1)
    angle, along = rng.uniform(0.0, 2.0 * np.pi, 1500), rng.uniform(0.0, LENGTH, 1500)
    middle = 0.25
    radius = middle * (1.0 + 0.03 * rng.normal(size=1500))
    write_points(
        tmp_path / "a.ply", PointTable(np.column_stack([along, radius * np.cos(angle), radius * np.sin(angle)]))
    )
    arguments = ("tiles", "run", tmp_path / "a.ply", "--out-dir", tmp_path / "out", "--tile-points", 800)
    files = ("--smoothed", "--one-file", tmp_path / "all.ply")
    code, [line] = run(*arguments, *files, "--viewpoint=5,0,0", "--roughness", "--wavelength", 4.0)
    assert (code, line["tiles"]) == (0, 2)
    assert "long against the halos" in line["notices"][0]
    found = read_points(tmp_path / "all.ply")
    radial = np.hypot(*found.points.T[1:])
    assert radial.std() < 0.02 * middle
    assert np.all(np.einsum("ij,ij->i", found.attributes["normal"], found.points * [0.0, 1.0, 1.0]) < 0.0)
    assert np.median(found.attributes["lb_roughness"]) / -middle == pytest.approx(1.0, abs=0.05)  # to the axis
    assert [path.name for path in sorted(tmp_path.glob("out/tile*.ply"))] == [
        "tile_000000_smoothed.ply",
        "tile_000001_smoothed.ply",
    ]
    code, [line] = run(*arguments, "--viewpoint=5,0,0", "--roughness")
    assert (code, "other files or settings" in line["error"]) == (1, True)


def test_sides_are_those_that_the_scanners_of_files_saw(run, tmp_path):
    """Two scans of a tube from within, by scanners at other places."""
    rng = np.random.default_rng(2)
    angle, along = rng.uniform(0.0, 2.0 * np.pi, 900), rng.uniform(0.0, 4.0, 900)
    places = np.column_stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)])
    scans = []
    for begin in (0.0, 2.0):
        own = places[(along >= begin) & (along < begin + 2.0)] - [begin + 1.0, 0.0, 0.0]
        scans.append((e57_files.points(own), len(own), e57_files.pose((1, 0, 0, 0), (begin + 1.0, 0.0, 0.0))))
    (tmp_path / "a.e57").write_bytes(e57_files.seal(e57_files.make_e57(*scans)))
    code, [line] = run("tiles", "run", tmp_path / "a.e57", "--out-dir", tmp_path / "out", "--orient", "viewpoint")
    assert (code, line["notices"]) == (0, [])
    found = read_points(tmp_path / "out" / "tile_000000.ply")
    assert set(np.unique(found.attributes["scanner"][:, 0])) == {1.0, 3.0}
    assert np.all(np.einsum("ij,ij->i", found.attributes["normal"], found.points * [0.0, 1.0, 1.0]) < 0.0)


def test_one_file_waits_for_all_steps(run, scans, tmp_path):
    run("tiles", "cut", scans, "--out-dir", tmp_path / "out", *OPTIONS)
    code, [line] = run("tiles", "report", tmp_path / "out", "--one-file", tmp_path / "all.laz")
    assert (code, "wait for the step extent" in line["error"]) == (1, True)


@pytest.mark.parametrize(
    "wrong",
    [
        ("--one-file", "all.npy"),
        ("--one-file", "a.ply"),
        ("--orient", "up", "--viewpoint=1,2,3"),
        ("--wavelength", "1"),
    ],
)
def test_choices_that_do_not_go_together(run, scans, tmp_path, monkeypatch, wrong):
    monkeypatch.chdir(scans)
    assert run("tiles", "run", ".", "--out-dir", tmp_path / "out", *wrong) == (2, [])


def test_stages_give_the_same_to_the_bit(run, scans, done, tmp_path):
    out = tmp_path / "out"
    assert run("tiles", "cut", scans, "--out-dir", out, *OPTIONS, "--memory", "4GB")[1][0]["tiles"] == 2
    steps = []
    while run("tiles", "agree", out)[1][0].get("next") != "measure":
        for share in ("1/2", "2/2"):
            code, [line] = run("tiles", "survey", out, "--tiles", share)
            assert (code, line["visited"] <= 1) == (0, True)
        steps.append(line["step"])
    assert steps[0] == "extent"
    assert steps[-1] == "areas"
    assert run("tiles", "measure", out, "--tiles", "1/2", "--format", "npy")[1][0]["waiting"] == 1
    assert "wait for the step measure" in run("tiles", "agree", out)[1][0]["error"]
    run("tiles", "measure", out, "--tiles", "2/2", "--format", "npy")
    assert run("tiles", "agree", out)[1][0]["next"] is None
    first, second = (core.tiles.Store(folder / "store") for folder in (done, out))
    for number in range(2):
        for name in ("areas", "normals", "mean_curvature"):
            np.testing.assert_array_equal(second.read("measure", number, name), first.read("measure", number, name))
    for _ in range(3):
        assert run("tiles", "modes", out, "--modes", 3, "--mode-points", 600)[0] == 0
        assert run("tiles", "agree", out)[0] == 0
    run("tiles", "measure", out)
    assert "lb_eigenvector_003" in read_points(out / "tile_000001.ply").attributes
    code, [line] = run("tiles", "report", out, "--out", tmp_path / "table.csv")
    assert len(line["eigenvalues"]) == 3
    assert (line["share_in_doubt"], line["share_unmeasured"]) == (doubtful(out), 0.0)
    assert (code, line["measured_points"], line["errors"]) == (0, COUNT, [])
    assert len((tmp_path / "table.csv").read_text().splitlines()) == 3


def doubtful(out):
    """Return the share of points whose trust is below one half."""
    trust = np.concatenate([read_points(path).attributes["lb_trust"] for path in out.glob("tile_*.ply")])
    return pytest.approx(np.mean(trust < 0.5), abs=1e-6)


class TestAgain:
    """A run is started again, with something changed."""

    @pytest.fixture
    def begun(self, run, scans, tmp_path):
        """A folder of its own with the inputs, cut."""
        (tmp_path / "in").mkdir()
        for path in scans.iterdir():
            (tmp_path / "in" / path.name).write_bytes(path.read_bytes())
        run("tiles", "cut", tmp_path / "in", "--out-dir", tmp_path / "out", *OPTIONS)
        return tmp_path

    @pytest.mark.parametrize("change", ["size", "time", "gone"])
    @pytest.mark.parametrize("verb", ["run", "cut"])
    def test_inputs_that_changed_are_refused(self, run, begun, change, verb):
        path = begun / "in" / "a.ply"
        given = "tiles", verb, path, begun / "in" / "b.ply", "--out-dir", begun / "out", *OPTIONS
        before = path.stat()
        if change == "size":
            path.write_bytes(path.read_bytes() + b"\n")
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
        elif change == "time":
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 10**9))
        else:
            path.unlink()
        code, [line] = run(*given)
        assert (code, f"{path} changed since the tiles were cut" in line["error"]) == (1, True)
        told = {"size": f"{before.st_size + 1:,} bytes now", "time": "another time", "gone": "no file now"}
        assert told[change] in line["error"]

    def test_inputs_that_change_while_they_are_cut_leave_no_tiles(self, run, begun, monkeypatch):
        path, original = begun / "in" / "a.ply", core.tiles.cut_to_store

        def cut(*given, **choices):
            store = original(*given, **choices)
            path.write_bytes(path.read_bytes() + b"\n")
            return store

        monkeypatch.setattr(core.tiles, "cut_to_store", cut)
        code, [line] = run("tiles", "cut", begun / "in", "--out-dir", begun / "new", *OPTIONS)
        assert (code, "changed since reading began" in line["error"]) == (1, True)
        assert not (begun / "new" / "store").exists()

    def test_tiles_of_another_size_are_cut_anew(self, run, begun):
        given = "tiles", "run", begun / "in", "--out-dir", begun / "out"
        code, [line] = run(*given, *OPTIONS)
        assert (code, line["tiles"], len(list((begun / "out").glob("tile_*.ply")))) == (0, 2, 2)
        code, [line] = run(*given, "--tile-points", 450)
        assert (code, line["tiles"], line["points"]) == (0, 4, COUNT)
        assert "cut anew" in line["notices"][0]
        code, [line] = run(*given, *OPTIONS)
        assert (code, line["tiles"], len(list((begun / "out").glob("tile_*.ply")))) == (0, 2, 2)
        assert run(*given)[1][0]["tiles"] == 2

    def test_more_memory_measures_what_failed_for_want_of_it(self, run, tmp_path):
        write_points(tmp_path / "a.ply", PointTable(np.random.default_rng(1).random((2000, 3))))
        given = "tiles", "run", tmp_path / "a.ply", "--out-dir", tmp_path / "out", "--tile-points", 1000
        code, lines = run(*given, "--memory", "6MB")
        assert (code, "None of the tiles" in lines[0]["error"]) == (3, True)
        told = [json.loads(text)["error"] for text in (tmp_path / "out" / "tiles.jsonl").read_text().splitlines()]
        assert told
        assert all("allow more memory" in error for error in told)
        assert run(*given, "--memory", "6MB")[0] == 3
        code, [line] = run(*given, "--memory", "4GB")
        assert (code, line["failed_tiles"], line["measured_points"]) == (0, 0, 2000)
        before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*.np?")}
        code, [line] = run(*given, "--memory", "2GB")
        assert (code, line["notices"]) == (0, [])
        assert {path: path.stat().st_mtime_ns for path in before} == before

    def test_other_modes_need_no_new_folder(self, run, begun):
        given = "tiles", "run", begun / "in", "--out-dir", begun / "out", *OPTIONS
        found = {}
        for modes, by in ((2, 500), (4, 500), (3, 400)):
            code, [line] = run(*given, "--modes", modes, "--mode-points", by)
            assert (code, len(line["eigenvalues"])) == (0, modes)
            found[by, modes] = line["eigenvalues"]
            names = read_points(begun / "out" / "tile_000001.ply").attributes
            assert [f"lb_eigenvector_{number:03d}" in names for number in range(1, 5)] == [n < modes for n in range(4)]
        np.testing.assert_allclose(found[500, 2], found[500, 4][:2], rtol=1e-6, atol=1e-9)
        assert found[400, 3][1] != found[500, 4][1]
        assert run(*given)[1][0]["eigenvalues"] == found[400, 3]

    @pytest.mark.parametrize("one_file", [False, True])
    def test_one_folder_for_inputs_and_outputs(self, run, begun, one_file):
        given = ["tiles", "run", begun / "in", "--out-dir", begun / "in", *OPTIONS, "--format", "ply"]
        given += ["--one-file", begun / "in" / "all.ply"] if one_file else []
        for _ in range(2):
            code, [line] = run(*given)
            assert (code, line["points"], line["tiles"], line["notices"]) == (0, COUNT, 2, [])
        assert run(*given[:5], *OPTIONS)[1][0]["points"] == COUNT
        write_points(begun / "in" / "c.ply", PointTable(core.example_sphere()))
        assert "other files or settings" in run(*given)[1][0]["error"]

    def test_results_never_replace_what_is_read(self, run, begun, capsys):
        (begun / "in" / "a.ply").rename(begun / "in" / "tile_000000.ply")
        before = (begun / "in" / "tile_000000.ply").read_bytes()
        given = "tiles", "run", begun / "in", "--out-dir", begun / "in", *OPTIONS
        assert run_command([*map(str, given)], verbs.make_verbs(), "meshfree") == 2
        assert "would overwrite" in capsys.readouterr().err
        assert (begun / "in" / "tile_000000.ply").read_bytes() == before

    def test_another_run_at_work_is_told(self, run, begun):
        with core.files.holding(begun / "out" / ".run.lock"):
            for verb in ("run", "cut"):
                code, [line] = run("tiles", verb, begun / "in", "--out-dir", begun / "out", *OPTIONS)
                assert (code, "Another run is at work" in line["error"]) == (1, True)
        assert run("tiles", "run", begun / "in", "--out-dir", begun / "out", *OPTIONS)[0] == 0
        assert not (begun / "out" / ".run.lock").exists()


def test_packages_that_are_missing_are_told_before_any_work(run, scans, tmp_path, monkeypatch):
    for name in ("laspy", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.laz").write_bytes(b"")
    monkeypatch.setattr(core.tiles, "cut_to_store", None)
    code, [line] = run("tiles", "run", tmp_path / "in", "--out-dir", tmp_path / "out")
    assert (code, "laspy is missing" in line["error"]) == (1, True)
    assert run("tiles", "run", scans, "--out-dir", tmp_path / "out", "--format", "laz") == (2, [])
    for option in (("--workers", 2), ("--scheduler", "tcp://localhost:1")):
        code, [line] = run("tiles", "run", scans, "--out-dir", tmp_path / "out", *option)
        assert (code, "Dask" in line["error"]) == (1, True)


def test_progress_tells_tiles_of_all_and_the_time_left(scans, tmp_path, capsys):
    given = "tiles", "run", scans, "--out-dir", tmp_path / "out", *OPTIONS
    assert run_command([*map(str, given)], verbs.make_verbs(), "meshfree") == 0
    told = capsys.readouterr().err.splitlines()
    for done in range(3):
        pattern = re.compile(rf"tiles run: Areas, {done} of 2 tiles, \d+%, \d+ s left")
        assert any(pattern.fullmatch(line) for line in told)


@pytest.mark.parametrize(("seconds", "text"), [(5.2, "5 s"), (89.0, "89 s"), (120.0, "2 min"), (9000.0, "2.5 h")])
def test_durations(seconds, text):
    assert tile_verbs._duration(seconds) == text


def test_stages_in_a_wrong_order_are_told(run, scans, tmp_path):
    assert "holds no tiles" in run("tiles", "survey", tmp_path)[1][0]["error"]
    run("tiles", "cut", scans, "--out-dir", tmp_path / "out", *OPTIONS)
    assert "waits for the step extent" in run("tiles", "measure", tmp_path / "out")[1][0]["error"]


def test_a_broken_tile_is_told_and_the_others_written(run, scans, tmp_path):
    out = tmp_path / "out"
    run("tiles", "cut", scans, "--out-dir", out, *OPTIONS)
    np.save(out / "store" / "000001" / "points.npy", 1e3 + 1e-3 * np.eye(3))
    code, [line] = run("tiles", "run", scans, "--out-dir", out, *OPTIONS)
    assert (code, line["failed_tiles"], line["errors"][0]["tile"]) == (1, 1, 1)
    assert line["share_unmeasured"] == pytest.approx(3 / line["points"], abs=1e-6)
    assert run("tiles", "report", out)[0] == 1
    assert run("tiles", "run", scans, "--out-dir", out, *OPTIONS, "--report", tmp_path / "r.jsonl")[0] == 0
    assert [path.name for path in out.glob("tile_*")] == ["tile_000000.ply"]
    assert run("report", out)[1][0]["failed"] == 1


@pytest.mark.parametrize(
    ("failing", "error", "code"), [("extent", core.ComponentError, 1), ("measure", core.NotEnoughMemoryError, 3)]
)
def test_a_stage_in_which_a_tile_fails_tells_it_and_the_others_go_on(
    run, scans, tmp_path, monkeypatch, failing, error, code
):
    real, out = core.tiles.visit_tile, tmp_path / "out"

    def visit(folder, step, number):
        if (step, number) != (failing, 1):
            return real(folder, step, number)
        core.tiles.Store(folder).fail(step, number, error("It failed."))
        return number

    monkeypatch.setattr(core.tiles, "visit_tile", visit)
    run("tiles", "cut", scans, "--out-dir", out, *OPTIONS)
    codes = {}
    while "measure" not in codes:
        for verb in ("survey", "measure"):
            found, [line] = run("tiles", verb, out)
            if line.get("step"):
                codes[line["step"]] = found
                failed = [{"tile": 1, "error": "It failed.", "scarce": code == 3}]
                assert line["errors"] == (failed if line["step"] == failing else [])
        assert run("tiles", "agree", out)[0] == 0
    assert {step: found for step, found in codes.items() if found} == {failing: code}
    assert run("tiles", "report", out)[0] == code


def write_delivery(folder, rod):
    """Write files of a survey: a rod in two halves, and others far away that are as files should not be."""
    folder.mkdir()
    middle = np.median(rod[:, 0])
    for name, half in (("a.xyz", rod[rod[:, 0] < middle]), ("b.xyz", rod[rod[:, 0] >= middle])):
        np.savetxt(folder / name, np.column_stack([half[:, ::-1], np.full(len(half), 7.0)]), fmt="%.17g")
    (folder / "garbage.laz").write_bytes(b"LASF" + bytes(1000))
    (folder / "empty.csv").write_text("nan,nan,nan,0\n")
    write_points(folder / "three.ply", PointTable(0.1 * np.eye(3) - 100.0))
    write_points(folder / "volume.ply", PointTable(1000.0 + np.random.default_rng(1).random((6000, 3))))
    write_points(folder / "whole.ply", PointTable(500.0 + rod))
    data = (folder / "whole.ply").read_bytes()
    (folder / "cut_off.ply").write_bytes(data[:-100])
    (folder / "whole.ply").unlink()


def test_what_is_wrong_with_some_files_of_a_delivery_is_told_and_the_others_done(run, scans, tmp_path):
    rod = np.concatenate([read_points(scans / f"{name}.ply").points for name in "ab"])[3:]
    write_delivery(tmp_path / "files", rod)
    out = tmp_path / "out"
    options = ("--columns", "z y x intensity", *OPTIONS, "--memory", "15MB")
    code, [line] = run("tiles", "run", tmp_path / "files", "--out-dir", out, *options)
    assert (code, line["points"], line["measured_points"]) == (3, COUNT + 6000, COUNT)
    assert line["share_unmeasured"] == pytest.approx(6003 / (COUNT + 6000), abs=1e-6)
    broken = [error for error in line["errors"] if "file" in error]
    assert [Path(error["file"]).name for error in broken] == ["cut_off.ply", "garbage.laz"]
    full = [error for error in line["errors"] if "tile" in error]
    assert len(full) == line["failed_tiles"] > 0
    assert all("fill a volume" in error["error"] for error in full)
    assert "empty.csv has no points." in line["notices"]
    assert sum(notice.startswith("Left out a file") for notice in line["notices"]) == line["failed_files"] == 2
    tables = [read_points(path) for path in sorted(out.glob("tile_*.ply"))]
    on = np.concatenate([table.attributes["lb_component"] >= 0 for table in tables])
    assert np.count_nonzero(~on) == 3  # far from all
    assert "Left out intensity, which not all files have." in line["notices"]
    found = np.concatenate([table.points for table in tables])[on]
    np.testing.assert_array_equal(np.sort(found, axis=0), np.sort(rod, axis=0))
    lines = [json.loads(text) for text in (out / "tiles.jsonl").read_text().splitlines()]
    assert any("components left out: 3 " in notice for record in lines for notice in record.get("notices", ()))
    assert run("report", out)[1][0]["failed"] == 2 + len(full)


def test_columns_of_text_by_their_names(run, tmp_path):
    np.savetxt(tmp_path / "a.txt", np.column_stack([core.example_sphere(), np.arange(800)])[:, ::-1])
    out = tmp_path / "out"
    assert run("tiles", "cut", tmp_path / "a.txt", "--out-dir", out, "--columns", "number z y x")[0] == 0
    store = core.tiles.Store(out / "store")
    assert store.columns(0)["number"].dtype == np.float64
    order = np.argsort(store.columns(0)["number"])
    np.testing.assert_array_equal(store.own(0)[order], core.example_sphere())


def test_all_files_of_a_folder_are_of_the_cloud(run, tmp_path):
    for name in ("scan_1", "scan_2", "other"):  # not the frames alone, as for verbs of many files
        write_points(tmp_path / "in" / f"{name}.ply", PointTable(core.example_sphere()))
    _, [line] = run("tiles", "cut", tmp_path / "in", "--out-dir", tmp_path / "out", "--memory", "4GB")
    assert line["points"] == 2400


class TestSources:
    def test_tell_how_much_is_read(self, scans):
        sources, told = tile_work.Sources([scans / "a.ply", scans / "b.ply"], core.files.LasChoices()), []
        for passes in (1, 2):
            assert sum(len(points) for points, _ in sources(told.append)) == COUNT
            assert len(told) == 2 * passes
        first, second = ((scans / f"{name}.ply").stat().st_size for name in "ab")
        share = first / (first + second)
        np.testing.assert_allclose(told, [0.0, share, share, 1.0])  # points are counted in the first pass

    def test_begin_again_without_a_file_that_breaks_off(self, run, tmp_path, monkeypatch):
        paths = [tmp_path / f"{name}.ply" for name in "ab"]
        for path in paths:
            write_points(path, PointTable(core.example_sphere()))
        guarded = core.files.Chunks._guarded

        def breaking_off(self):
            yield from guarded(self)
            if self._path == paths[0]:
                raise core.PointCloudError("It breaks off.")

        monkeypatch.setattr(core.files.Chunks, "_guarded", breaking_off)
        sources = tile_work.Sources(paths, core.files.LasChoices())
        given = sources(lambda share: None)
        with pytest.raises(tile_work.Incomplete):
            list(given)
        assert list(sources.broken) == paths[:1]
        assert sum(len(points) for points, _ in sources(lambda share: None)) == 800
        assert sources.notices == ["Left out a file: It breaks off."]
        _, [line] = run("tiles", "cut", *paths, "--out-dir", tmp_path / "out", "--memory", "4GB")
        assert (line["points"], line["notices"]) == (800, sources.notices)

    def test_all_broken_are_an_error(self, tmp_path):
        (tmp_path / "a.las").write_bytes(b"")
        with pytest.raises(core.PointCloudError, match=r"a\.las"):
            list(tile_work.Sources([tmp_path / "a.las", tmp_path / "b.las"], core.files.LasChoices())(print))

    def test_degrees_and_single_precision_are_told(self, tmp_path):
        rng = np.random.default_rng(0)
        np.savetxt(tmp_path / "a.xyz", rng.random((50, 3)) * [1e-3, 1e-3, 10.0] + [10.0, 50.0, 0.0])
        np.save(tmp_path / "b.npy", (rng.random((50, 3)) + [4e5, 5e6, 0.0]).astype(np.float32))
        sources = tile_work.Sources(sorted(tmp_path.iterdir()), core.files.LasChoices())
        assert sum(len(points) for points, _ in sources(lambda share: None)) == 100
        assert "look like degrees" in sources.notices[0]
        assert "kept in single precision" in sources.notices[1]


def test_progress_is_told_by_stages_and_within_them(capsys):
    with ToldStages("tiles run", 0.1) as stages:
        for stage, fraction in (("Read", 0.0), ("Read", 0.05), ("Read", 0.1), ("Areas", 0.11), ("Areas", 0.5)):
            stages(stage, fraction)
    found = [text.removeprefix("tiles run: ") for text in capsys.readouterr().err.splitlines()]
    assert found == ["Read, 0%", "Read, 10%", "Areas, 11%", "Areas, 50%"]


@pytest.mark.parametrize(("text", "size"), [("2GB", 2 << 30), ("1.5 mb", 3 << 19), ("700", 700), ("1KB", 1024)])
def test_sizes(text, size):
    assert tile_work.bytes_of(text) == size


@pytest.mark.parametrize("text", ["", "GB", "-1GB", "nanGB", "0"])
def test_no_sizes(text):
    with pytest.raises(ValueError, match="size"):
        tile_work.bytes_of(text)


def test_a_box_and_a_level_are_cut(run, scans, tmp_path):
    low, high = [2.0, -1.0, -1.0], [8.0, 1.0, 1.0]
    box = ("--bounds", *low, *high, "--tile-points", 1000)
    code, [line] = run("tiles", "cut", scans, "--out-dir", tmp_path / "box", *box)
    points = np.concatenate([read_points(scans / f"{name}.ply").points for name in "ab"])
    assert (code, line["points"]) == (0, np.count_nonzero(np.all((points >= low) & (points <= high), axis=1)))
    code, [line] = run("tiles", "cut", scans, "--out-dir", tmp_path / "box", "--tile-points", 1000)
    assert (code, "other files or settings" in line["error"]) == (1, True)
    code, [line] = run("tiles", "cut", scans, "--out-dir", tmp_path / "level", "--level", 0)
    assert (code, "no levels of detail" in line["error"]) == (1, True)
    write_copc(tmp_path / "octree.copc.laz", points)
    counts = []
    for level in (0, 1):
        code, [line] = run(
            "tiles", "cut", tmp_path / "octree.copc.laz", "--out-dir", tmp_path / str(level), "--level", level
        )
        counts.append(line["points"])
    assert 0 < counts[0] < counts[1] < COUNT
