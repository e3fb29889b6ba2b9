"""What the pages tell to type with Blender works, on small files and clouds of the names that they give."""

import re
import shlex
import shutil
from contextlib import chdir
from dataclasses import replace
from itertools import pairwise

import bpy
import numpy as np
import pytest

from tests.blender.armatures import add_armature
from tests.blender.clouds import add_group, add_object, sphere_points
from tests.blender.conftest import new_file, part
from tests.blender.splats import bar_splats
from tests.blender.test_command import run  # noqa: F401
from tests.pages import ROOT, snippets
from tests.splat_files import write_ply

VERB = ["blender", "--command", "meshfree"]
COMMANDS = [one for one in snippets("blender") if shlex.split(one.text)[:3] == VERB]
OTHERS = [one for one in snippets("blender") if one not in COMMANDS]
COLUMNS = ["x", "y", "z", "nx", "ny", "nz", "picked", "foot", "head"]
TABLE = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w-]+)` \| \[.*?\| (.*`--.*) \|$", TABLE, re.MULTILINE)


def named(found):
    return pytest.mark.parametrize("snippet", found, ids=lambda snippet: snippet.id)


def open_sphere(count=1200, seed=0):
    """Points of the upper half of a sphere, with a boundary."""
    points = sphere_points(count, seed)
    return points[points[:, 2] > -0.2]


def columns(points):
    """Columns of a file, with groups and normals."""
    tip, foot = points[:, 0] > 0.9, points[:, 0] < -0.8
    values = [*points.T, *points.T, tip, foot, tip]
    return dict(zip(COLUMNS, np.float32(values), strict=True))


@pytest.fixture(scope="module")
def made(installed, tmp_path_factory):
    """A folder with all files that the commands name."""
    folder = tmp_path_factory.mktemp("made")
    with chdir(folder):
        make(folder)
    return folder


def make(folder):
    core = part("core")
    new_file()
    scan = open_sphere()
    for name in ("scan", "plan"):
        write_ply(folder / f"{name}.ply", columns(scan))
    table = columns(scan)
    np.savetxt("scan.csv", np.column_stack(list(table.values())), delimiter=",", header=",".join(table), comments="")
    around = np.linspace(0.0, 2.0 * np.pi, 40)[:-1]
    np.savetxt("seam.xyz", np.column_stack([0.8 * np.cos(around), 0.8 * np.sin(around), 0.6 + 0.0 * around]))
    for name in ("days", "frames", "scans"):
        (folder / name).mkdir()
        for number in (1, 2):
            write_ply(folder / name / f"{name}_{number}.ply", columns(scan * [1.0, 1.0, 1.0 + 0.02 * number]))
    write_las(folder / "first.las", scan)
    (folder / "survey").mkdir()
    for number, tile in enumerate(np.split(scan[np.argsort(scan[:, 0])][: len(scan) // 2 * 2], 2)):
        write_las(folder / "survey" / f"tile_{number}.laz", tile)
    rigged = add_object(scan)
    for name, members in (("Arm", scan[:, 0] > 0.0), ("Leg", scan[:, 0] <= 0.0)):
        add_group(rigged, name, members)
    rigged.parent = add_armature(
        {"Arm": ((0.0, 0.0, 0.0), (0.8, 0.0, 0.0)), "Leg": ((0.0, 0.0, 0.0), (-0.8, 0.0, 0.0))}
    )
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "rigged.blend"), copy=True)
    new_file()
    (folder / "list.txt").write_text("scan.ply\nplan.ply\ndays/days_1.ply\ndays/days_2.ply\n")
    assert part("operators.files.command").run(["info", "scan.ply", "--report", "reports/2.jsonl"]) == 0
    bar = bar_splats(core)
    small = replace(bar, positions=np.float32(0.4 * bar.positions), scales=np.float32(0.4 * bar.scales))
    for name in ("guitar", "a", "b"):
        core.splats.write_splats(folder / f"{name}.ply", small)
    add_armature({"Bone": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.8))})
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "rig.blend"))
    [handles] = snippets("json")
    (folder / "bend.json").write_text(handles.text)


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """The working folder, with copies of these files."""
    monkeypatch.chdir(shutil.copytree(made, tmp_path, dirs_exist_ok=True))
    return tmp_path


def write_las(path, points):
    """By the laspy that the extension brings."""
    import laspy

    las = laspy.LasData(laspy.LasHeader(point_format=7, version="1.4"))
    las.header.scales = [1e-6] * 3
    las.xyz = points
    las.write(path)


@pytest.mark.any_blender
@named(COMMANDS)
def test_command(run, folder, snippet):  # noqa: F811
    words = shlex.split(snippet.text)[3:]
    code, lines = run(*words)
    assert code == 0, lines
    for option, output in pairwise(words):
        if option == "--out":
            assert (folder / output).is_file()
        elif option == "--out-dir":
            assert len(list((folder / output).iterdir())) == len(lines) > 1


@named(OTHERS)
def test_background(folder, snippet):
    *_, option, code = shlex.split(snippet.text)
    assert option == "--python-expr"
    exec(code, {})
    assert bpy.context.object.meshfree.total_area > 0.0


@pytest.mark.any_blender
@named(snippets("bpy"))
def test_code(folder, snippet):
    """It runs with a selected cloud that has a boundary, and the groups that the tools look for."""
    if "POINTCLOUD" in snippet.text and bpy.app.version < (4, 5, 0):
        pytest.skip("Blender imports no Point Cloud objects before 4.5")
    points = sphere_points(1600)
    points = points[points[:, 2] > 0.0]
    np.savetxt("scan.xyz", points)
    obj = add_object(points)
    obj.select_set(True)
    along = points[:, 0]
    groups = {"Handle": along > 0.9, "Anchor": along < -0.8, "Low": along < -0.8, "High": along > 0.9}
    for name, members in {**groups, "Source": along > 0.95, "Value": along > 0.9}.items():
        add_group(obj, name, members)
    exec(compile(snippet.text, snippet.id, "exec"), {"__name__": "example", "bpy": bpy})
    assert np.isfinite(bpy.context.object.meshfree.total_area)


@pytest.mark.any_blender
@pytest.mark.parametrize(("verb", "options"), ROWS)
def test_verbs_have_the_options_and_choices_of_the_table(command, capsys, verb, options):
    assert command.run([verb, "--help"]) == 0
    told = capsys.readouterr().out
    for option, choices in re.findall(r"(--[\w-]+)(?: ([A-Z]+(?:\\\|[A-Z]+)+))?", options):
        assert re.search(rf"{option}\b", told), option
        assert all(re.search(rf"\b{choice}\b", told) for choice in choices.split(r"\|")), choices
