"""The verbs of the command line for files of splats, and for bending of points and splats."""

import json

import numpy as np
import pytest

from tests.blender.clouds import sphere_points
from tests.blender.splats import bar_splats
from tests.blender.test_command import run  # noqa: F401

TOP = {"center": [0.0, 0.0, 10.0], "radius": 1.5}
LOW = {"center": [0.0, 0.0, 0.0], "radius": 1.5}
TURN = [[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]]


@pytest.fixture
def bar(core, tmp_path):
    path = tmp_path / "bar.ply"
    core.splats.write_splats(path, bar_splats(core))
    return path


def handles(folder, **wanted):
    path = folder / "handles.json"
    path.write_text(json.dumps(wanted))
    return path


def test_info_of_splats(core, run, bar):  # noqa: F811
    code, [line] = run("splat-info", bar)
    splats = core.splats.read_splats(bar)
    assert code == 0
    assert (line["splats"], line["degree"], line["flat"]) == (len(splats), 3, 1.0)
    np.testing.assert_allclose(line["high"], splats.positions.max(axis=0))
    np.testing.assert_allclose(line["opacity"][1], np.median(splats.opacities), rtol=1e-5)


def test_splats_are_turned_with_their_handles(core, run, bar, tmp_path):  # noqa: F811
    wanted = handles(tmp_path, handles=[{**TOP, "matrix": TURN}, {**LOW, "matrix": TURN}])
    code, [line] = run("deform", bar, "--handles", wanted, "--out", tmp_path / "out.ply")
    assert code == 0, line
    before, after = core.splats.read_splats(bar), core.splats.read_splats(tmp_path / "out.ply")
    matrix = np.array(TURN)
    moved = before.deformed(
        before.positions @ matrix[:3, :3].T + matrix[:3, 3], np.tile(matrix[:3, :3], (len(before), 1, 1))
    )
    np.testing.assert_allclose(after.positions, moved.positions, atol=1e-5)
    np.testing.assert_allclose(after.covariances, moved.covariances, atol=1e-6)
    np.testing.assert_allclose(after.harmonics, moved.harmonics, atol=1e-5)


def test_floaters_go_with_the_splats_next_to_them(core, run, bar, tmp_path):  # noqa: F811
    splats = core.splats.read_splats(bar)
    opacities, positions = splats.opacities.copy(), splats.positions.copy()
    rows = np.argsort(np.abs(positions[:, 2] - 9.0))[:3]
    opacities[rows] = 0.01
    positions[rows, :2] *= 3.0  # off the surface
    given = tmp_path / "given.ply"
    core.splats.write_splats(
        given, core.splats.Splats(**{**vars(splats), "opacities": opacities, "positions": positions})
    )
    wanted = handles(tmp_path, handles=[{**TOP, "shift": [0.0, 0.0, 2.0]}], anchors=[LOW])
    code, [line] = run("deform", given, "--handles", wanted, "--out", tmp_path / "out.ply")
    assert code == 0, line
    assert line["left_out"] == 3
    moved = core.splats.read_splats(tmp_path / "out.ply").positions
    near = np.argsort(np.linalg.norm(splats.positions - splats.positions[rows[0]], axis=1))[1:6]
    shifts = moved - core.splats.read_splats(given).positions
    np.testing.assert_allclose(shifts[rows[0]], shifts[near].mean(axis=0), atol=0.3)


def test_many_files_of_points_are_bent(run, tmp_path):  # noqa: F811
    points = sphere_points()
    for name in ("a.xyz", "b.xyz"):
        np.savetxt(tmp_path / name, points)
    top = np.flatnonzero(points[:, 2] > 0.8)
    goal = (points[top] + [0.0, 0.0, 0.5]).tolist()
    wanted = handles(
        tmp_path,
        handles=[{"indices": top.tolist(), "positions": goal}],
        anchors=[{"center": [0.0, 0.0, -1.0], "radius": 0.5}],
    )
    inputs = [tmp_path / "a.xyz", tmp_path / "b.xyz"]
    code, lines = run("deform", *inputs, "--handles", wanted, "--out-dir", tmp_path / "out", "--format", "xyz")
    assert code == 0
    assert [line["points"] for line in lines] == [len(points)] * 2
    for name in ("a.xyz", "b.xyz"):
        found = np.loadtxt(tmp_path / "out" / name)
        np.testing.assert_allclose(found[top], goal, atol=1e-6)
        low = np.linalg.norm(points + [0.0, 0.0, 1.0], axis=1) < 0.5
        np.testing.assert_allclose(found[low], points[low], atol=1e-6)


@pytest.mark.parametrize(
    ("wanted", "text"),
    [
        ("{", "no JSON"),
        ("[]", "names no handles"),
        ('{"handles": []}', "names no handles"),
        ('{"handles": [{"shift": [0, 0, 1]}]}', "names no points"),
        ('{"handles": [{"center": [0, 0, 0], "radius": 9}]}', "goes nowhere"),
        ('{"handles": [{"center": [0, 0, 99], "radius": 1, "shift": [0, 0, 1]}]}', "No point is in a ball"),
        ('{"handles": [{"indices": [100000], "shift": [0, 0, 1]}]}', "not there"),
        ('{"handles": [{"indices": [0, 1], "shift": [0, 0]}]}', "must be 3 finite numbers"),
        ('{"handles": [{"indices": [0, 1], "shift": [0, 0, NaN]}]}', "must be 3 finite numbers"),
        ('{"handles": [{"indices": [0, 1], "positions": [[0, 0, 1]]}]}', "must be 2 x 3 finite"),
        ('{"handles": [{"indices": [0, 0], "shift": [0, 0, 1]}]}', "two handles"),
    ],
)
def test_bad_handles_are_told(run, bar, tmp_path, wanted, text):  # noqa: F811
    (tmp_path / "handles.json").write_text(wanted)
    code, [line] = run("deform", bar, "--handles", tmp_path / "handles.json", "--out", tmp_path / "out.ply")
    assert code == 1
    assert text in line["error"]
    assert not (tmp_path / "out.ply").exists()


def test_files_that_are_missing_or_no_splats_are_told(run, bar, tmp_path):  # noqa: F811
    wanted = handles(tmp_path, handles=[{**TOP, "shift": [0, 0, 1]}])
    for arguments, text in (
        (("splat-info", tmp_path / "none.ply"), "no file"),
        (("splat-info", wanted), "no PLY file"),
        (("deform", bar, "--handles", wanted), "Nothing would be written"),
        (("deform", bar, "--handles", wanted, "--out", bar), "overwrite its input"),
        (("deform", bar, "--handles", tmp_path / "none.json", "--out", tmp_path / "out.ply"), "cannot be read"),
    ):
        code, [line] = run(*arguments)
        assert code == 1
        assert text in line["error"]
