"""The verbs that transfer from the object of one file to those of others."""

import bpy
import numpy as np
import pytest

from tests.blender.armatures import weights_of
from tests.blender.clouds import add_object, sphere_points
from tests.blender.conftest import part
from tests.blender.test_command import run, write  # noqa: F401
from tests.blender.test_transfer_weights import BONES, height, positions

pytestmark = pytest.mark.any_blender


@pytest.fixture
def rigged(tmp_path):
    """A file with a rigged sphere that stands aside."""
    source = add_object(sphere_points(900), "Body")
    part("operators.rigging.weights").write_weights(source, list(BONES), height(positions(source)))
    source.location = 4.0, 0.0, 0.0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rigged.blend"))
    return tmp_path / "rigged.blend"


def test_weights(run, rigged, tmp_path):  # noqa: F811
    inputs = [
        write(tmp_path / f"{name}.csv", sphere_points(count, seed=4) + [4.0, 0.0, 0.0])
        for name, count in (("a", 500), ("b", 400))
    ]
    code, lines = run("transfer-weights", *inputs, "--reference", rigged, "--out-dir", tmp_path / "out")
    assert code == 0, lines
    for line, count in zip(lines, (500, 400), strict=True):
        assert line["taken_count"] > 0.98 * count
        assert f"from {rigged}" in line["done"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "a.blend"))
    obj = bpy.context.object
    assert [group.name for group in obj.vertex_groups] == list(BONES)
    world = positions(obj) + np.array(obj.matrix_world.translation) + np.array(obj.get("lb_offset", (0, 0, 0)))
    assert np.abs(weights_of(obj) - height(world)).max() < 0.03


def test_files_without_weights_fail(run, rigged, tmp_path):  # noqa: F811
    plain = write(tmp_path / "a.csv", sphere_points(500))
    code, [line] = run("transfer-weights", plain, "--reference", plain)
    assert code == 1
    assert "has no weights to transfer" in line["error"]
    code, [line] = run("transfer-weights", plain, "--reference", rigged)
    assert code == 1
    assert "No point of" in line["error"]
    assert run("transfer-weights", plain, "--reference", rigged, "--out", tmp_path / "a.ply")[0] == 2
