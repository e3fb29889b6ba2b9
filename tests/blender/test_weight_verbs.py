"""The verbs of weights, which need Blender: `rig` and `transfer-weights`."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.armatures import add_armature, choose, weights_of
from tests.blender.clouds import add_object, sphere_points
from tests.blender.conftest import new_file, part
from tests.blender.test_automatic_weights import BONES, rod
from tests.blender.test_command import run, write  # noqa: F401
from tests.blender.test_transfer_weights import BONES as GROUPS
from tests.blender.test_transfer_weights import height, positions


@pytest.fixture
def scan(tmp_path):
    """A file of points, those of an object."""
    points = np.array([vertex.co for vertex in rod(faces=False).data.vertices])
    np.savetxt(tmp_path / "scan.xyz", points, fmt="%.9g")
    new_file()
    return tmp_path / "scan.xyz"


def write_armatures(path, names=("Rig",), parent=False):
    """A .blend file with armatures, and a mesh that is no part of any."""
    new_file()
    rod().name = "Body"
    for name in names:
        armature = add_armature(BONES, name)
        if parent:
            armature.parent = bpy.data.objects.new("Root", None)
            armature.parent.location.z = 0.5
            bpy.context.scene.collection.objects.link(armature.parent)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    new_file()
    return path


def rigged(armature=None):
    obj = rod(faces=False)
    choose(armature or add_armature(BONES), obj)
    bpy.ops.meshfree.auto_weights(influences=2, falloff=2.0)
    return weights_of(obj)


def test_points_of_a_file_with_the_armature_of_another(run, scan, tmp_path):  # noqa: F811
    write_armatures(tmp_path / "rig.blend")
    expected = rigged()
    given = "--armature", tmp_path / "rig.blend", "--influences", 2, "--falloff", 2
    code, [line] = run("rig", scan, *given, "--out", tmp_path / "new" / "rigged.blend")
    assert code == 0, line
    assert (line["points"], line["bones"], line["bones_followed"]) == (402, 2, 2)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new" / "rigged.blend"))
    obj = bpy.data.objects["scan"]
    assert sorted(other.name for other in bpy.data.objects) == ["Rig", "scan"]
    assert (obj.parent.name, obj.modifiers[0].object.name) == ("Rig", "Rig")
    assert_allclose(weights_of(obj), expected, atol=1e-4)


def test_an_armature_that_is_moved_by_its_parent(run, scan, tmp_path):  # noqa: F811
    write_armatures(tmp_path / "rig.blend", parent=True)
    armature = add_armature(BONES)
    armature.location.z = 0.5
    expected = rigged(armature)
    given = "--armature", tmp_path / "rig.blend", "--influences", 2, "--falloff", 2
    code, [line] = run("rig", scan, *given, "--out", tmp_path / "rigged.blend")
    assert code == 0, line
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "rigged.blend"))
    assert bpy.data.objects["Rig"].parent.name == "Root"
    assert_allclose(weights_of(bpy.data.objects["scan"]), expected, atol=1e-4)


def test_one_of_many_armatures(run, scan, tmp_path):  # noqa: F811
    rigs = write_armatures(tmp_path / "rig.blend", ("First", "Second"))
    code, [line] = run("rig", scan, "--armature", rigs)
    assert code == 1
    assert "Name one with --armature-object: First, Second" in line["error"]
    code, [line] = run("rig", scan, "--armature", rigs, "--armature-object", "Third")
    assert code == 1
    assert 'no armature "Third"' in line["error"]
    code, [line] = run("rig", scan, "--armature", rigs, "--armature-object", "Second", "--out", tmp_path / "a.blend")
    assert code == 0, line
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert [obj.name for obj in bpy.data.objects if obj.type == "ARMATURE"] == ["Second"]


def test_a_blend_file_with_points_and_armature(run, tmp_path):  # noqa: F811
    write_armatures(tmp_path / "a.blend")
    code, [line] = run("rig", tmp_path / "a.blend", "--object", "Body", "--out", tmp_path / "b.blend")
    assert code == 0, line
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"))
    assert bpy.data.objects["Body"].parent.name == "Rig"


def test_files_without_an_armature(run, scan, tmp_path):  # noqa: F811
    assert run("rig", scan, "--out", tmp_path / "a.blend") == (2, [])
    assert run("rig", scan, "--armature", tmp_path / "a.blend", "--out", tmp_path / "a.ply") == (2, [])
    code, [line] = run("rig", scan, "--armature", tmp_path / "none.blend", "--out", tmp_path / "a.blend")
    assert (code, "none.blend is no .blend file, or it is not there" in line["error"]) == (1, True)
    rod()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mesh.blend"))
    code, [line] = run("rig", scan, "--armature", tmp_path / "mesh.blend", "--out", tmp_path / "a.blend")
    assert (code, "has no armature" in line["error"]) == (1, True)
    code, [line] = run("rig", scan, "--armature", tmp_path / "mesh.blend", "--out", tmp_path / "mesh.blend")
    assert (code, "overwrite its input" in line["error"]) == (1, True)
    assert not (tmp_path / "a.blend").exists()


@pytest.fixture
def body(tmp_path):
    """A file with a rigged sphere that stands aside."""
    source = add_object(sphere_points(900), "Body")
    part("operators.rigging.weights").write_weights(source, list(GROUPS), height(positions(source)))
    source.location = 4.0, 0.0, 0.0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rigged.blend"))
    return tmp_path / "rigged.blend"


def test_weights(run, body, tmp_path):  # noqa: F811
    inputs = [
        write(tmp_path / f"{name}.csv", sphere_points(count, seed=4) + [4.0, 0.0, 0.0])
        for name, count in (("a", 500), ("b", 400))
    ]
    code, lines = run("transfer-weights", *inputs, "--reference", body, "--out-dir", tmp_path / "out")
    assert code == 0, lines
    for line, count in zip(lines, (500, 400), strict=True):
        assert line["taken_count"] > 0.98 * count
        assert f"from {body}" in line["done"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "a.blend"))
    obj = bpy.context.object
    assert [group.name for group in obj.vertex_groups] == list(GROUPS)
    world = positions(obj) + np.array(obj.matrix_world.translation) + np.array(obj.get("lb_offset", (0, 0, 0)))
    assert np.abs(weights_of(obj) - height(world)).max() < 0.03


def test_files_without_weights_fail(run, body, tmp_path):  # noqa: F811
    plain = write(tmp_path / "a.csv", sphere_points(500))
    code, [line] = run("transfer-weights", plain, "--reference", plain)
    assert code == 1
    assert "has no weights to transfer" in line["error"]
    code, [line] = run("transfer-weights", plain, "--reference", body)
    assert code == 1
    assert "No point of" in line["error"]
    assert run("transfer-weights", plain, "--reference", body, "--out", tmp_path / "a.ply")[0] == 2
