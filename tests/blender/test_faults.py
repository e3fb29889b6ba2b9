"""What ends or fails in the middle of a computation: nothing has changed, no thread is left, and the next run is right.

MESHFREE_FAULTS in the environment says how many of each kind are tried, from the seed MESHFREE_FIRST on; a failure
names its own.
"""

import os
import threading
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.linalg import LinAlgError

from tests.blender.clouds import add_group, add_object, differences, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats
from tests.blender.test_all_or_nothing import (
    bound,
    by_default,
    colored,
    film,
    handled,
    keyed,
    rigged,
    scene,
    shared,
    unhandled,
)

COUNT = int(os.environ.get("MESHFREE_FAULTS", "25"))
FIRST = int(os.environ.get("MESHFREE_FIRST", "0"))
FAULTS = {  # and what of it is told
    MemoryError: "The memory is used up",
    LinAlgError: "The equations have no solution (injected)",
    OSError: "A file could not be read or written: injected",
    KeyboardInterrupt: "",
    "Cancelled": "",
}


def animated():
    return with_keyframes(bound())


def with_keyframes(obj):
    empty = obj.meshfree.deform.handle_items[0].empty
    for frame in (1, 3):
        empty.location.z += 0.2
        empty.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(2)
    return obj


def splats(size=1.0):
    """A bar of splats with groups of handles and anchors."""
    bar = bar_splats(part("core"), degree=1)
    obj = add_splats(replace(bar, positions=np.float32(size) * bar.positions))
    height = own_positions(obj)[:, 2]
    for name, chosen in (("Handle", height > 9.0), ("Anchor", height < 1.0)):
        if obj.type == "MESH":
            add_group(obj, name, chosen)
        else:
            obj.data.attributes.new(name, "BOOLEAN", "POINT").data.foreach_set("value", chosen)
    return obj


def bound_splats():
    obj = splats()
    bpy.ops.meshfree.deform_bind()
    return with_keyframes(obj)


def own_positions(obj):
    positions = np.empty(3 * len(obj.data.attributes["position"].data), np.float32)
    obj.data.attributes["position"].data.foreach_get("vector", positions)
    return positions.reshape(-1, 3)


RUNS = [  # beside all tools by default
    (colored, "analyze", {"modes": 4}),
    (shared, "analyze", {}),
    (handled, "spectrum", {"count": 5}),
    (keyed, "roughness", {}),
    (handled, "orient_normals", {"method": "KEEP", "flip": True}),
    (handled, "segment", {"parts": 3}),
    (handled, "segment", {"method": "NODAL"}),
    (handled, "smooth", {"target": "IN_PLACE"}),
    (keyed, "smooth", {"method": "HEAT"}),
    (handled, "mode_shape", {"animate": True}),
    (keyed, "extend_direction", {}),
    (unhandled, "deform_bind", {"at_once": True}),
    (animated, "deform_bake", {"first": 1, "last": 3}),
    (film, "minimal_surface", {"target": "IN_PLACE", "steps": 3}),
    (splats, "analyze", {"modes": 4}),
    (splats, "smooth", {}),
    (splats, "mode_shape", {}),
    (splats, "deform_bind", {}),
    (bound_splats, "deform_update", {}),
    (bound_splats, "deform_bake", {"first": 1, "last": 3}),
    (splats, "minimal_surface", {"steps": 2}),
    (rigged, "deform_bake", {"first": 1, "last": 3}),
]


UNREPORTED = {"bind_armature", "separate_by_segment"}  # they compute nothing
UNATTENDED = {"deform_bake", "compare_swap"}  # its steps wait for nobody; it writes to another object


def runs():
    """What a tool is run on, by name, with its settings."""
    return [*RUNS, *(run for run in by_default() if run[1] not in UNREPORTED)]


@pytest.fixture
def forget():
    """Function that forgets all that was computed."""
    cache, live = part("operators.running.cache"), part("operators.deform.live")
    return lambda: (cache.clear(), live._followers.clear())


@pytest.fixture(scope="module")
def known():
    """What making the objects of these tests has computed."""
    return {}


@pytest.fixture(scope="module")
def ended():
    """What runs that nothing disturbed have led to, by what they were."""
    return {}


@pytest.fixture
def fresh(forget, cache, known):
    """Function that makes something in an empty file, and forgets what was computed."""

    def start(make):
        bpy.ops.wm.read_homefile(use_empty=True)
        cache._kept.update(known)
        made = make()
        known.update(cache._kept)
        forget()
        return made

    return start


@pytest.fixture
def reports(stages, monkeypatch):
    """Let the report of progress of a number, counted from 0, raise an error; return how many there were."""
    told = stages.Stages.__call__

    def arm(number=-1, error=None):
        seen = []

        def tell(self, stage, fraction):
            seen.append(stage)
            if len(seen) - 1 == number:
                raise error
            told(self, stage, fraction)

        monkeypatch.setattr(stages.Stages, "__call__", tell)
        return seen

    return arm


@pytest.fixture
def undisturbed(fresh, reports, ended):
    """Function that gives the scene after a run that nothing disturbs, the name of its object, and its reports."""

    def find(run):
        make, name, settings = run
        key = make, name, str(settings)
        if key not in ended:
            obj, seen = fresh(make).name, reports()
            getattr(bpy.ops.meshfree, name)(**settings)
            ended[key] = scene(), obj, len(seen)
        return ended[key]

    return find


@pytest.mark.any_blender
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_fault_while_computing_changes_nothing(fresh, undisturbed, reports, core, seed):
    rng = np.random.default_rng(seed)
    tried = runs()
    make, name, settings = tried[seed % len(tried)]
    kind = list(FAULTS)[rng.integers(len(FAULTS))]
    expected, _, count = undisturbed(tried[seed % len(tried)])
    assert count > 0

    fresh(make)
    before, threads = scene(), threading.active_count()
    error = core.Cancelled("injected") if kind == "Cancelled" else kind("injected")
    reports(int(rng.integers(count)), error)
    try:
        with pytest.raises((RuntimeError, KeyboardInterrupt)) as told:
            getattr(bpy.ops.meshfree, name)(**settings)
    finally:
        reports()
    assert FAULTS[kind] in str(told.value)
    assert not FAULTS[kind] or "Traceback" not in str(told.value)
    assert not differences(scene(), before)
    assert threading.active_count() <= threads

    getattr(bpy.ops.meshfree, name)(**settings)
    assert not differences(scene(), expected)


class Context:
    """That of Blender, but for what a window would do."""

    def __init__(self):
        manager = bpy.context.window_manager
        self.window_manager = SimpleNamespace(
            modal_handler_add=lambda operator: None,
            event_timer_add=manager.event_timer_add,
            event_timer_remove=manager.event_timer_remove,
            windows=manager.windows,
            operators=(),
        )

    def __getattr__(self, name):
        return getattr(bpy.context, name)


class Pause:
    """A report of progress, by its number, at which the thread waits."""

    def __init__(self, jobs, number, monkeypatch):
        self.reached, self.go_on = threading.Event(), threading.Event()
        told, seen = jobs.Job.__call__, []

        def tell(job, stage, fraction):
            seen.append(stage)
            if len(seen) - 1 == number:
                self.reached.set()
                self.go_on.wait(20.0)
            told(job, stage, fraction)

        monkeypatch.setattr(jobs.Job, "__call__", tell)


@pytest.fixture
def attended(monkeypatch):
    """Function that starts an operator as a window does, outside of its loop of events, and gives what tells of it."""
    jobs = part("operators.running.job")
    started = []

    def start(name, settings, number):
        registered = getattr(bpy.types, f"MESHFREE_OT_{name}")
        bases = tuple(base for base in registered.__bases__ if base is not bpy.types.Operator)
        members = {key: value for key, value in vars(registered).items() if not key.startswith(("__", "bl_rna"))}
        run = type(name, bases, members)()
        for item in getattr(bpy.ops.meshfree, name).get_rna_type().properties[1:]:
            default = tuple(item.default_array) if getattr(item, "is_array", False) else item.default
            setattr(run, item.identifier, settings.get(item.identifier, default))
        run.reports, run.context, run.pause = [], Context(), Pause(jobs, number, monkeypatch)
        run.report = lambda kinds, text: run.reports.append((*kinds, text))
        run.takes_window = lambda: True
        run.is_repeated = lambda context: False
        run.tick = lambda: run.modal(run.context, SimpleNamespace(type="TIMER", value="NOTHING"))
        started.append(run)
        assert run.execute(run.context) == {"RUNNING_MODAL"}, run.reports
        return run

    yield start
    for run in started:
        run.pause.go_on.set()
        run.cancel(run.context)
        run._job.wait(20.0)
    assert jobs.running() is None


def delete_object(obj, folder):
    bpy.data.objects.remove(obj)


def delete_data(obj, folder):
    (bpy.data.meshes if obj.type == "MESH" else bpy.data.pointclouds).remove(obj.data)


def delete_scene(obj, folder):
    bpy.data.scenes.new("Another")
    bpy.data.scenes.remove(bpy.context.scene)


def delete_all(obj, folder):
    bpy.ops.wm.read_homefile(use_empty=True)


def take_other_data(obj, folder):
    obj.data = add_object(sphere_points(90), "Other").data if obj.type == "MESH" else splats(2.0).data


def delete_points(obj, folder):
    if obj.type == "MESH":
        obj.data.clear_geometry()
    else:
        obj.data = bpy.data.pointclouds.new("Empty")


def rename(obj, folder):
    obj.name, obj.data.name, bpy.context.scene.name = "Renamed", "Renamed Data", "Renamed Scene"


def save_elsewhere(obj, folder):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "renamed.blend"))


def move(obj, folder):
    obj.location, obj.rotation_euler = (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)
    bpy.context.view_layer.update()


ENDING = [delete_object, delete_data, delete_scene, delete_all, take_other_data, delete_points]
HARMLESS = [rename, save_elsewhere, move]


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_change_while_computing_beside_the_window(fresh, undisturbed, reports, attended, tmp_path, seed):
    rng = np.random.default_rng(seed)
    tried = [run for run in runs() if run[1] not in UNATTENDED]
    make, name, settings = tried[seed % len(tried)]
    change = [*ENDING, *HARMLESS][rng.integers(len(ENDING) + len(HARMLESS))]
    records, known, count = undisturbed(tried[seed % len(tried)])
    expected = records[known]["attributes"]
    obj, threads = fresh(make), threading.active_count()
    reports()
    run = attended(name, settings, int(rng.integers(count)))
    run.tick()
    assert run.pause.reached.wait(20.0)
    change(obj, tmp_path)
    before = scene()
    run.pause.go_on.set()
    run._job.wait(20.0)
    result = run.tick()
    assert threading.active_count() <= threads
    if change in HARMLESS:
        assert result == {"FINISHED"}, run.reports
        found = everything(obj)["attributes"]
        if change is move:  # the display makes discs for one orientation, and may leave them to the next run
            drawn = {"lb_disc", ".lb_slope", ".lb_slope_of", ".lb_color", ".lb_tilt"} - found.keys()
            expected = {name: kept for name, kept in expected.items() if name not in drawn}
        assert found == expected
    else:
        assert result == {"CANCELLED"}, run.reports
        assert len(run.reports) == 1
        after = scene()
        for thing in (*before.values(), *after.values()):  # which keep what was reported
            thing["settings"]["notices"] = []
        assert not differences(after, before)
    obj = fresh(make)
    assert getattr(bpy.ops.meshfree, name)(**settings) == {"FINISHED"}
    assert everything(obj)["attributes"].items() >= expected.items()
