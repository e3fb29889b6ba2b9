"""Simulate Along Surface: the frames on disk are those of core, and are played with the scene."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused

FRAMES = 12


@pytest.fixture
def cloud(tmp_path):
    """A sphere with one source, in a file that is saved, and a scene of some frames."""
    obj = add_object(sphere_points(600))
    add_group(obj, "Source", [7])
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 3, 2 + FRAMES
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    return bpy.data.objects["Cloud"]


def frames(obj):
    return np.load(bpy.path.abspath(obj.meshfree.motion_file))


def laplacian_of(core, obj):
    return core.build_laplacian(local_points(obj))


def test_frames_of_heat_are_those_of_core(cloud, core):
    assert bpy.ops.meshfree.simulate(kind="HEAT", distance=1.5, width=0.5) == {"FINISHED"}
    laplacian = laplacian_of(core, cloud)
    heat = core.motion.Heat(laplacian, (0.5 * 1.5) ** 2 / (FRAMES - 1))
    state = np.exp(-((core.distance.geodesic_distance(laplacian, [7]) / 0.5) ** 2))
    for row in frames(cloud):
        assert_allclose(row, state, atol=1e-6)
        state = heat.advance(state)
    assert frames(cloud).shape == (FRAMES, 600)


@pytest.mark.parametrize("keep", ["FRAMES", "MODES"])
def test_heat_is_seen_to_the_last_frame(cloud, keep, capfd):
    """It fades to a few percent of the pulse, which would be black in the range of all frames."""
    bpy.ops.meshfree.simulate(kind="HEAT", keep=keep, width=0.2)
    shown, high = [], cloud.meshfree.range_high
    for frame in (3 + FRAMES // 3, 2 + FRAMES):
        bpy.context.scene.frame_set(frame)
        mesh = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        values = np.empty(len(mesh.attributes["lb_motion"].data), np.float32)
        mesh.attributes["lb_motion"].data.foreach_get("value", values)
        shown.append(values.max() / high)
    assert cloud.meshfree.range_mode == "LOCKED"
    assert high < 0.5
    assert shown[0] > 0.9
    assert shown[1] > 0.3
    assert "Press Space to play it" in capfd.readouterr().out


def test_the_frame_of_the_scene_is_played(cloud):
    bpy.ops.meshfree.simulate(kind="FRONT")
    kept = frames(cloud)
    for frame, row in ((3, 0), (8, 5), (1, 0), (3 + FRAMES, -1)):
        bpy.context.scene.frame_set(frame)
        assert_allclose(attribute(cloud, "lb_motion"), kept[row], atol=1e-6)
    bpy.context.scene.frame_set(8, subframe=0.25)
    assert_allclose(attribute(cloud, "lb_motion"), 0.75 * kept[5] + 0.25 * kept[6], atol=1e-6)


def test_a_front_travels_over_the_geodesic_distance(cloud, core):
    bpy.ops.meshfree.simulate(kind="FRONT", width=0.2)
    distance = core.distance.geodesic_distance(laplacian_of(core, cloud), [7])
    for number, row in enumerate(frames(cloud)):
        travelled = distance.max() * number / (FRAMES - 1)
        assert_allclose(row, np.clip(1.0 + (travelled - distance) / 0.2, 0.0, 1.0), atol=1e-5)
    assert row.min() == 1.0


def test_a_wave_runs_as_far_as_it_should(cloud):
    bpy.ops.meshfree.simulate(kind="WAVE", distance=np.pi, width=0.5)
    first, now = frames(cloud)[[0, 5]]
    points, travelled = local_points(cloud), np.pi * 5 / (FRAMES - 1)
    distance = np.arccos(np.clip(points @ points[7], -1.0, 1.0))
    assert first.max() == pytest.approx(1.0)
    assert_allclose(first, np.exp(-((distance / 0.5) ** 2)), atol=0.02)
    assert distance[np.argmax(now)] == pytest.approx(travelled, abs=0.4)
    assert np.abs(now[distance > travelled + 1.0]).max() < 0.02
    assert cloud.meshfree.range_mode == "LOCKED"
    assert cloud.meshfree.range_low == -cloud.meshfree.range_high


def test_patterns_grow_from_the_sources(monkeypatch):
    monkeypatch.setattr(part("tools.motions"), "_PATTERN_TIME", 1000.0)
    obj = add_object(sphere_points(700))
    add_group(obj, "Source", [7])
    bpy.context.scene.frame_end = 20
    bpy.ops.meshfree.simulate(kind="REACTION", pattern="STRIPES", distance=1.8)
    values = frames(obj)
    shares = np.mean(values > 0.5 * values[-1].max(), axis=1)
    assert values.min() >= 0.0
    assert 0.0 < shares[0] < 0.2
    assert 0.2 < shares[-1] < 0.8


def test_a_reaction_that_dies_out_is_told(cloud, monkeypatch):
    monkeypatch.setattr(part("tools.motions"), "_PATTERN_TIME", 300.0)
    bpy.ops.meshfree.simulate(kind="REACTION", distance=0.2)
    assert frames(cloud)[-1].max() < 0.05
    assert any("died out" in notice.text for notice in cloud.meshfree.notices)


def test_a_budget_leaves_frames_out_and_says_so(cloud, monkeypatch):
    monkeypatch.setattr(part("operators.tools.simulate"), "_MEGABYTE", 4 * 600 * 5)
    bpy.ops.meshfree.simulate(kind="FRONT", budget=1, width=0.5)
    assert frames(cloud).shape == (5, 600)
    assert cloud.meshfree.motion_step == 3
    assert any("One of 3 frames is kept" in notice.text for notice in cloud.meshfree.notices)
    bpy.context.scene.frame_set(4)
    kept = frames(cloud)
    assert_allclose(attribute(cloud, "lb_motion"), (2.0 * kept[0] + kept[1]) / 3.0, atol=1e-6)


def test_files_of_others_stay(cloud, tmp_path):
    own = tmp_path / "motion" / "precious.npy"
    own.parent.mkdir()
    own.write_text("mine")
    cloud.meshfree.motion_file = str(own)
    bpy.ops.meshfree.simulate(kind="FRONT")
    assert own.read_text() == "mine"


def test_what_is_missing_is_told_and_other_objects_play_on(cloud):
    bpy.ops.meshfree.simulate(kind="FRONT")
    Path(bpy.path.abspath(cloud.meshfree.motion_file)).unlink()
    part("operators.objects.motion")._open.clear()
    bpy.context.scene.frame_set(5)
    assert any("cannot be read" in notice.text for notice in cloud.meshfree.notices)


def test_a_file_of_other_points_is_told(cloud):
    bpy.ops.meshfree.simulate(kind="FRONT")
    cloud.data.vertices.add(1)
    bpy.context.scene.frame_set(5)
    assert any("600 points, and there are 601" in notice.text for notice in cloud.meshfree.notices)


def test_frames_of_an_unsaved_file_are_temporary_until_it_is_saved():
    obj = add_object(sphere_points(400))
    add_group(obj, "Source", [0])
    bpy.context.scene.frame_end = 5
    bpy.ops.meshfree.simulate(kind="FRONT")
    assert Path(obj.meshfree.motion_file).is_relative_to(bpy.app.tempdir)
    assert any("temporary folder" in notice.text for notice in obj.meshfree.notices)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_height_displaces_along_the_normals(cloud, scale):
    cloud.scale = (scale,) * 3
    bpy.ops.meshfree.simulate(kind="FRONT", height=0.25 * scale, show=False)
    bpy.context.scene.frame_set(8)
    evaluated = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get())
    positions = np.empty(3 * 600, np.float32)
    evaluated.data.attributes["position"].data.foreach_get("vector", positions)
    expected = 1.0 + 0.25 * attribute(cloud, "lb_motion")
    assert_allclose(np.linalg.norm(positions.reshape(-1, 3), axis=1), expected, atol=5e-3)
    assert expected.max() == pytest.approx(1.25)
    bpy.ops.meshfree.simulate(kind="FRONT", show=False)
    assert not cloud.modifiers


def test_a_failure_at_the_end_leaves_an_earlier_motion_as_it_was(cloud, monkeypatch):
    bpy.ops.meshfree.simulate(kind="WAVE", keep="MODES", modes=6, width=0.8, height=0.1, show=False)
    before = evaluated_motion(cloud)
    tool = part("operators.tools.simulate")

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(tool, "forget_groups", fail)
    with refused(cloud, "memory is used up"):
        bpy.ops.meshfree.simulate(kind="HEAT", keep="MODES", modes=9, width=0.8, show=False)
    assert_allclose(evaluated_motion(cloud), before, atol=1e-6)
    assert cloud.modifiers[0].node_group is not None


def test_undo_takes_the_motion_back(cloud):
    bpy.ops.ed.undo_push(message="Made")
    bpy.ops.meshfree.simulate(kind="FRONT")
    bpy.ops.ed.undo_push(message="Done")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Cloud"]
    assert obj.meshfree.motion_file == ""
    assert "lb_motion" not in obj.data.attributes


def test_without_sources_it_is_refused(cloud):
    with refused(cloud, "has no vertex group named"):
        bpy.ops.meshfree.simulate(group="Missing")


def evaluated_motion(obj):
    layer = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["lb_motion"]
    values = np.empty(len(layer.data), np.float32)
    layer.data.foreach_get("value", values)
    return values


@pytest.mark.parametrize("kind", ["HEAT", "WAVE"])
def test_modes_are_the_formula_of_core_at_any_frame(cloud, core, kind):
    bpy.ops.meshfree.simulate(kind=kind, keep="MODES", modes=20, distance=2.0, width=0.8, show=False)
    assert cloud.meshfree.motion_file == ""
    laplacian = laplacian_of(core, cloud)
    pairs, areas = laplacian.eigenpairs(20), laplacian.areas
    pulse = np.exp(-((core.distance.geodesic_distance(laplacian, [7]) / 0.8) ** 2))
    wave = core.motion.wave_modes(pairs, areas, pulse, 0.0, speed=2.0)
    for frame in (9, 3, 2 + FRAMES, 1):
        bpy.context.scene.frame_set(frame)
        time = max(frame - 3, 0) / (FRAMES - 1)
        heat = core.clean.spectral_filter(pulse, pairs, areas, lambda values, time=time: np.exp(-time * values))
        assert_allclose(evaluated_motion(cloud), heat if kind == "HEAT" else wave(time), atol=2e-4)


def test_modes_say_how_much_of_the_pulse_they_hold_and_displace_too(cloud):
    bpy.ops.meshfree.simulate(kind="WAVE", keep="MODES", modes=4, width=0.4, height=0.2, show=False)
    assert any("The modes hold" in notice.text for notice in cloud.meshfree.notices)
    evaluated = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get())
    positions = np.empty(3 * 600, np.float32)
    evaluated.data.attributes["position"].data.foreach_get("vector", positions)
    expected = 1.0 + 0.2 * evaluated_motion(cloud)
    assert_allclose(np.linalg.norm(positions.reshape(-1, 3), axis=1), expected, atol=2e-3)
    bpy.ops.meshfree.simulate(kind="FRONT", show=False)
    assert not cloud.modifiers
    assert "lb_motion_001" not in cloud.data.attributes
    assert not [group for group in bpy.data.node_groups if "meshfree_motion" in group]


def test_modes_play_without_the_extension(cloud, extension):
    bpy.ops.meshfree.simulate(kind="WAVE", keep="MODES", modes=10, width=0.8, show=False)
    handler = part("operators.objects.motion")
    handler.detach()
    try:
        bpy.context.scene.frame_set(3)
        first = evaluated_motion(cloud)
        bpy.context.scene.frame_set(8)
        assert np.abs(evaluated_motion(cloud) - first).max() > 0.1
    finally:
        handler.attach()
