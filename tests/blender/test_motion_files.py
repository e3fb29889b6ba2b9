"""Frames of motions on disk: former ones stay as long as Undo, or a file as saved, may play them."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.blender.test_simulate import cloud, frames  # noqa: F401


def simulate(width):
    """Simulate a front, and return the file of its frames."""
    bpy.ops.meshfree.simulate(kind="FRONT", width=width, show=False)
    return Path(bpy.path.abspath(bpy.context.object.meshfree.motion_file))


def save(path=None):
    bpy.ops.wm.save_as_mainfile(filepath=str(path or bpy.data.filepath))


def there(folder):
    return set(folder.iterdir())


def test_undo_brings_the_former_motion_back(cloud):  # noqa: F811
    bpy.ops.ed.undo_push(message="Made")
    first = simulate(0.5)
    bpy.ops.ed.undo_push(message="First")
    expected = np.load(first)[4]
    second = simulate(0.1)
    bpy.ops.ed.undo_push(message="Second")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Cloud"]
    assert Path(bpy.path.abspath(obj.meshfree.motion_file)) == first
    bpy.context.scene.frame_set(7)
    assert_allclose(attribute(obj, "lb_motion"), expected, atol=1e-6)
    bpy.ops.ed.redo()
    assert Path(bpy.path.abspath(bpy.data.objects["Cloud"].meshfree.motion_file)) == second
    assert second.exists()


def test_frames_end_with_the_session_but_for_those_of_the_saved_file(cloud, tmp_path):  # noqa: F811
    saved = simulate(0.5)
    save()
    others = [simulate(0.4), simulate(0.3)]
    assert there(tmp_path / "motion") == {saved, *others}
    bpy.ops.wm.read_homefile(use_empty=True)
    assert there(tmp_path / "motion") == {saved}
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert frames(bpy.data.objects["Cloud"]).shape[1] == 600


def test_frames_that_the_file_plays_no_more_end_with_the_session(cloud, tmp_path):  # noqa: F811
    simulate(0.5)
    save()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    last = simulate(0.4)
    save()
    assert len(there(tmp_path / "motion")) == 2
    bpy.ops.wm.read_homefile(use_empty=True)
    assert there(tmp_path / "motion") == {last}


def test_each_file_keeps_its_own_frames(cloud, tmp_path):  # noqa: F811
    kept = {simulate(0.5)}
    save()
    kept.add(simulate(0.4))
    save(tmp_path / "b.blend")
    simulate(0.3)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert there(tmp_path / "motion") == kept


def test_at_the_end_of_blender_frames_on_show_stay(cloud, tmp_path):  # noqa: F811
    """They may be recovered from the last session."""
    simulate(0.5)
    shown = simulate(0.4)
    files = part("operators.objects.motion_files")
    files.detach()
    try:
        assert there(tmp_path / "motion") == {shown}
    finally:
        files.attach()


def test_former_frames_beyond_the_budget_end_the_oldest_first(cloud, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setattr(part("operators.tools.simulate"), "_MEGABYTE", 4 * 600 * 12 + 500)
    saved = simulate(0.5)
    save()
    first = simulate(0.4)
    assert not any("Undo" in notice.text for notice in cloud.meshfree.notices)
    bpy.ops.meshfree.simulate(kind="FRONT", width=0.3, budget=3, show=False)
    assert first.exists()
    bpy.ops.meshfree.simulate(kind="FRONT", width=0.2, budget=3, show=False)
    assert not first.exists()
    assert saved.exists()
    assert len(there(tmp_path / "motion")) == 3
    assert any("cannot come back by Undo" in notice.text for notice in cloud.meshfree.notices)


@pytest.mark.any_blender
def test_a_failed_motion_leaves_no_file(cloud, tmp_path, monkeypatch):  # noqa: F811
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(part("tools.simulate"), "frame_rows", fail)
    with pytest.raises(RuntimeError, match="memory is used up"):
        simulate(0.5)
    assert not (tmp_path / "motion").exists()


@pytest.fixture
def unsaved(tmp_path):
    """A sphere with frames in a file that was never saved."""
    bpy.ops.wm.read_homefile(use_empty=True)
    obj = add_object(sphere_points(400))
    add_group(obj, "Source", [0])
    bpy.context.scene.frame_end = 5
    bpy.ops.meshfree.simulate(kind="FRONT", show=False)
    return obj


def values_at(frame):
    bpy.context.scene.frame_set(frame)
    return attribute(bpy.data.objects["Cloud"], "lb_motion")


@pytest.mark.any_blender
def test_saving_takes_frames_along_that_were_made_before(unsaved, tmp_path):
    expected = values_at(4)
    for name in ("first", "other"):
        (tmp_path / name).mkdir()
    save(tmp_path / "first" / "a.blend")
    (file,) = there(tmp_path / "first" / "motion")
    assert unsaved.meshfree.motion_file == f"//motion/{file.name}"
    assert not any("temporary" in notice.text for notice in unsaved.meshfree.notices)
    assert_allclose(values_at(4), expected)
    save(tmp_path / "other" / "b.blend")  # elsewhere, it plays the same file
    assert unsaved.meshfree.motion_file == f"//../first/motion/{file.name}"
    for path in (tmp_path / "first" / "a.blend", tmp_path / "other" / "b.blend"):
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=str(path))
        assert_allclose(values_at(4), expected)
    assert there(tmp_path / "first" / "motion") == {file}


@pytest.mark.any_blender
def test_a_copy_takes_frames_along_and_this_file_keeps_its_own(unsaved, tmp_path):
    named, expected = unsaved.meshfree.motion_file, values_at(4)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    assert unsaved.meshfree.motion_file == named
    assert any("temporary" in notice.text for notice in unsaved.meshfree.notices)
    assert_allclose(values_at(4), expected)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copy.blend"))
    assert bpy.data.objects["Cloud"].meshfree.motion_file.startswith("//motion/")
    assert_allclose(values_at(4), expected)


def test_frames_that_cannot_go_along_are_told(unsaved, tmp_path):
    named = unsaved.meshfree.motion_file
    (tmp_path / "motion").write_text("a file of that name")
    save(tmp_path / "a.blend")
    assert unsaved.meshfree.motion_file == named
    assert any("did not go along" in notice.text for notice in unsaved.meshfree.notices)
