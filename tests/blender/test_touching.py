"""Simulate Along Surface with an object that touches the surface, in all motions, as frames and as modes."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_simulate import FRAMES, cloud, evaluated_motion, frames, laplacian_of  # noqa: F401

FAR = 8.0


def add_ball(places):
    """Add an empty that is at a place of the X axis at some frames, far away at those before and after."""
    ball = bpy.data.objects.new("Ball", None)
    bpy.context.scene.collection.objects.link(ball)
    for frame, place in places.items():
        for near, at in ((frame - 1, FAR), (frame + 1, FAR), (frame, place)):
            if near == frame or near not in places:
                ball.location = (at, 0.0, 0.0)
                ball.keyframe_insert("location", frame=near)
    return ball


def ends(obj):
    """The points nearest to the ends of the X axis."""
    x = local_points(obj)[:, 0]
    return x.argmax(), x.argmin()


def test_it_starts_heat_where_it_is(cloud):  # noqa: F811
    cloud.location, cloud.scale = (1.0, 2.0, 3.0), (2.0, 2.0, 2.0)
    ball = bpy.data.objects.new("Ball", None)
    bpy.context.scene.collection.objects.link(ball)
    for frame, side in ((5, 1.0), (7, 8.0), (9, -1.0)):  # it touches, leaves, and touches on the other side
        ball.location = (1.0 + 2.0 * side, 2.0, 3.0)
        ball.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(4)
    cloud.vertex_groups.clear()
    bpy.ops.meshfree.simulate(kind="HEAT", toucher="Ball", width=0.8, distance=1.0, folder="")
    assert bpy.context.scene.frame_current == 4
    kept, x = frames(cloud), local_points(cloud)[:, 0]
    assert kept[2][x > 0.95].max() > 0.9
    assert kept[5][x < 0.0].max() < 0.01
    assert kept[6][x < -0.95].max() > 0.9
    assert 0.0 < kept[6][x > 0.95].max() < 0.9


def test_a_front_arrives_from_the_touch_that_is_first(cloud, core):  # noqa: F811
    add_ball({5: 1.0, 9: -1.0})
    bpy.ops.meshfree.simulate(kind="FRONT", toucher="Ball", width=0.3, distance=2.0)
    laplacian, speed = laplacian_of(core, cloud), 2.0 / (FRAMES - 1)
    distances = [core.distance.geodesic_distance(laplacian, [end]) for end in ends(cloud)]
    for number, row in enumerate(frames(cloud)):
        arrivals = [began * speed + away for began, away in zip((2, 6), distances, strict=True) if began <= number]
        arrival = np.min(arrivals, axis=0) if arrivals else np.inf
        assert_allclose(row, np.clip(1.0 + (number * speed - arrival) / 0.3, 0.0, 1.0), atol=1e-5)
    assert 0.3 < row.mean() < 1.0


def test_what_stays_where_it_is_starts_one_front(cloud, core):  # noqa: F811
    add_ball(dict.fromkeys(range(3, 3 + FRAMES), 1.0))
    bpy.ops.meshfree.simulate(kind="FRONT", toucher="Ball", width=0.3, distance=3.3)
    distance = core.distance.geodesic_distance(laplacian_of(core, cloud), [ends(cloud)[0]])
    assert_allclose(frames(cloud)[6], np.clip(1.0 + (3.3 * 6 / 11 - distance) / 0.3, 0.0, 1.0), atol=1e-5)


def test_a_touch_changes_a_wave_nowhere_else(cloud):  # noqa: F811
    ball = add_ball({3: 1.0})
    bpy.ops.meshfree.simulate(kind="WAVE", toucher="Ball", width=0.4, distance=3.0)
    before = frames(cloud)
    bpy.data.objects.remove(ball)
    add_ball({3: 1.0, 10: -1.0})
    bpy.ops.meshfree.simulate(kind="WAVE", toucher="Ball", width=0.4, distance=3.0)
    after, x = frames(cloud), local_points(cloud)[:, 0]
    assert before[7].min() < -0.05  # a trough, which the touch is not to fill
    assert_allclose(after[7][x > 0.0], before[7][x > 0.0], atol=1e-3)
    assert after[7][ends(cloud)[1]] == pytest.approx(1.0)


def test_touches_between_frames_on_disk_count(cloud, monkeypatch):  # noqa: F811
    monkeypatch.setattr(part("operators.tools.simulate"), "_MEGABYTE", 4 * 600 * 5)
    add_ball({7: 1.0})
    bpy.ops.meshfree.simulate(kind="FRONT", toucher="Ball", width=0.3, budget=1)
    assert cloud.meshfree.motion_step == 3
    kept, end = frames(cloud), ends(cloud)[0]
    assert kept[1].max() == 0.0
    assert kept[2][end] == 1.0


@pytest.mark.parametrize("kind", ["HEAT", "WAVE"])
def test_modes_are_driven_by_each_touch(cloud, kind):  # noqa: F811
    add_ball({5: 1.0, 9: -1.0})
    settings = {"kind": kind, "toucher": "Ball", "width": 0.8, "distance": 2.0, "show": False}
    bpy.ops.meshfree.simulate(**settings)
    expected = frames(cloud)
    bpy.ops.meshfree.simulate(**settings, keep="MODES", modes=60)
    assert cloud.meshfree.motion_file == ""
    handler = part("operators.objects.motion")
    handler.detach()  # nodes alone play it, in any order of frames
    try:
        for frame in (9, 4, 5, 2 + FRAMES, 7, 1):
            bpy.context.scene.frame_set(frame)
            number = min(max(frame - 3, 0), FRAMES - 1)
            assert_allclose(evaluated_motion(cloud), expected[number], atol=0.03)
        bpy.context.scene.frame_set(8)
        before = evaluated_motion(cloud)
        bpy.context.scene.frame_set(7, subframe=0.5)
        middle = evaluated_motion(cloud)
        bpy.context.scene.frame_set(7)
        assert_allclose(middle, 0.5 * (before + evaluated_motion(cloud)), atol=1e-5)
    finally:
        handler.attach()


def test_keyframes_of_modes_go_with_the_next_motion(cloud):  # noqa: F811
    add_ball({5: 1.0})
    actions = len(bpy.data.actions)
    for _ in range(2):
        bpy.ops.meshfree.simulate(kind="WAVE", toucher="Ball", keep="MODES", modes=6, width=0.8, show=False)
        assert len(bpy.data.actions) == actions + 1
    bpy.ops.meshfree.simulate(kind="FRONT", show=False)
    assert len(bpy.data.actions) == actions


def test_modes_show_the_motion_of_the_frame_at_once(cloud):  # noqa: F811
    add_ball({5: 1.0})
    bpy.context.scene.frame_set(6)
    bpy.ops.meshfree.simulate(kind="HEAT", toucher="Ball", keep="MODES", modes=30, width=0.8, show=False)
    assert attribute(cloud, "lb_motion").max() > 0.3
    assert_allclose(attribute(cloud, "lb_motion"), evaluated_motion(cloud), atol=1e-4)


@pytest.mark.parametrize("kind", ["HEAT", "WAVE", "REACTION", "FRONT"])
def test_an_object_that_touches_nothing_is_refused(cloud, kind):  # noqa: F811
    far = add_object(sphere_points(10) + 50.0, "Far")
    bpy.context.view_layer.objects.active = cloud
    for name, text in {"Far": "comes within .* of no point", "Cloud": "is the object itself", "X": "not in"}.items():
        with refused(cloud, text):
            bpy.ops.meshfree.simulate(kind=kind, toucher=name)
    assert far.name == "Far"
