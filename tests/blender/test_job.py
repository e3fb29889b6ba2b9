"""Long work beside the window: its result, its errors, and all that ends it. The window itself is in tests/gui."""

from threading import Event
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from command.stages import StageTimes
from tests.blender.clouds import add_object, everything, sphere_points
from tests.blender.conftest import part


@pytest.fixture
def jobs():
    module = part("operators.running.job")
    yield module
    assert module.running() is None


class Work:
    """A computation that goes on when it is told to."""

    def __init__(self, outcome=7):
        self.outcome, self.began, self.go_on, self.steps = outcome, Event(), Event(), []

    def __call__(self, progress):
        progress("One", 0.25)
        self.steps.append("One")
        self.began.set()
        self.go_on.wait(5.0)
        progress("Two", 0.5)
        self.steps.append("Two")
        if isinstance(self.outcome, Exception):
            raise self.outcome
        return self.outcome


def event(kind, value="PRESS"):
    return SimpleNamespace(type=kind, value=value)


@pytest.fixture
def operator(jobs, monkeypatch):
    """An operator that has been started on an object, outside of a window's loop of events."""
    modal = []

    class Context:
        """That of Blender, but for the handler of a window's events, which nobody would take away again."""

        def __init__(self):
            self.window_manager = SimpleNamespace(
                modal_handler_add=modal.append,
                event_timer_add=bpy.context.window_manager.event_timer_add,
                event_timer_remove=bpy.context.window_manager.event_timer_remove,
                progress_begin=lambda low, high: None,
                progress_update=lambda value: None,
                progress_end=lambda: None,
                windows=bpy.context.window_manager.windows,
            )

        def __getattr__(self, name):
            return getattr(bpy.context, name)

    class Operator(jobs.JobOperator):
        bl_label = "Try"

        def __init__(self, objects, compute, kind=jobs.Job, begins=True):
            self.reports, self.finished, self.context = [], None, Context()
            assert self.start(self.context, objects, compute, kind) == {"RUNNING_MODAL"}
            if begins:
                assert self.tick() == {"PASS_THROUGH"}

        def report(self, kinds, text):
            self.reports.append((*kinds, text))

        def finish(self, context, objects, results):
            self.finished = objects, results
            return {"FINISHED"}

        def tick(self, kind="TIMER", value="NOTHING"):
            return self.modal(self.context, event(kind, value))

        def stop(self):
            """Do what the key Esc does, and look at the work."""
            assert bpy.ops.meshfree.stop() == {"FINISHED"}
            return self.tick()

        def end(self):
            """Wait for the thread and look once more."""
            self._job.wait(5.0)
            return self.tick()

    yield Operator
    for started in modal:
        started.cancel(started.context)


@pytest.fixture
def obj():
    return add_object(sphere_points(200))


def test_a_result_comes_with_its_objects_and_stages(operator, jobs, obj):
    work = Work()
    started = operator([obj], work)
    assert jobs.running().label == "Try"
    work.began.wait(5.0)
    assert started.tick() == {"PASS_THROUGH"}
    assert (jobs.running().stage, jobs.running().fraction) == ("One", 0.25)
    work.go_on.set()
    assert started.end() == {"FINISHED"}
    assert started.finished == ([obj], 7)
    assert list(started._job.seconds) == ["One", "Two"]
    assert jobs.running() is None


def test_the_work_waits_until_it_was_drawn(operator, obj):
    work = Work()
    work.go_on.set()
    started = operator([obj], work, begins=False)
    started._job.wait(5.0)
    assert not work.began.wait(0.05)
    assert started.tick("MOUSEMOVE") == {"PASS_THROUGH"}
    assert not work.began.wait(0.05)
    assert started.tick() == {"PASS_THROUGH"}
    assert work.began.wait(5.0)
    assert started.end() == {"FINISHED"}


def test_esc_before_the_work_began(operator, jobs, obj):
    work = Work()
    started = operator([obj], work, begins=False)
    assert started.stop() == {"CANCELLED"}
    assert jobs.running() is None
    assert not work.began.wait(0.05)
    assert started.reports == [("INFO", "Stopped: nothing was changed")]


def test_keys_and_the_mouse_go_on_to_blender(operator, obj):
    work = Work()
    started = operator([obj], work)
    for kind in ("ESC", "MIDDLEMOUSE", "Z", "X", "TAB", "LEFTMOUSE", "TIMER"):
        assert started.tick(kind, "PRESS") == {"PASS_THROUGH"}
    work.go_on.set()
    assert started.end() == {"FINISHED"}


def test_esc_ends_it_at_once_though_the_thread_goes_on(operator, jobs, obj):
    work, before = Work(), everything(obj)
    started = operator([obj], work)
    work.began.wait(5.0)
    assert started.stop() == {"CANCELLED"}
    assert jobs.running() is None
    assert started.reports == [("INFO", "Stopped: nothing was changed")]
    work.go_on.set()
    started._job.wait(5.0)
    assert work.steps == ["One"]  # it ended at its next report
    assert started.finished is None
    assert everything(obj) == before


def test_a_late_result_is_dropped(operator, jobs, obj):
    work = Work()
    started = operator([obj], work)
    work.go_on.set()
    started._job.wait(5.0)
    assert started.stop() == {"CANCELLED"}
    assert started.finished is None


def test_the_stop_button(operator, jobs, obj):
    with pytest.raises(RuntimeError, match="Nothing is running"):
        bpy.ops.meshfree.stop()
    started = operator([obj], Work())
    assert started.stop() == {"CANCELLED"}


def test_steps_on_the_main_thread(operator, jobs, obj):
    def compute(progress):
        for number in range(3):
            progress("Frames", number / 3)
            yield
        return "all"

    started = operator([obj], compute, jobs.SteppedJob, begins=False)
    assert [started.tick() for _ in range(3)] == [{"PASS_THROUGH"}] * 3
    assert (jobs.running().stage, jobs.running().fraction) == ("Frames", 2 / 3)
    assert started.tick() == {"PASS_THROUGH"}
    assert started.finished is None
    assert started.tick() == {"FINISHED"}
    assert started.finished[1] == "all"


@pytest.mark.parametrize("way", ["stop", "cancel"])
def test_steps_that_are_stopped_are_put_back(operator, jobs, obj, way):
    ended, left = [], []

    def compute(progress):
        try:
            while True:
                progress("Frames", 0.5)
                yield
        finally:
            ended.append(True)

    started = operator([obj], compute, jobs.SteppedJob, begins=False)
    started.leave = left.append
    started.tick()
    if way == "stop":
        assert started.stop() == {"CANCELLED"}
    else:
        started.cancel(started.context)
    assert jobs.running() is None
    assert (ended, len(left)) == ([True], 1)
    started.cancel(started.context)
    assert len(left) == 1


def test_steps_that_go_wrong(operator, core, jobs, obj):
    def compute(progress):
        yield
        raise core.PointCloudError("No")

    started = operator([obj], compute, jobs.SteppedJob, begins=False)
    assert [started.tick() for _ in range(2)] == [{"PASS_THROUGH"}] * 2
    assert started.tick() == {"CANCELLED"}
    assert started.reports == [("ERROR", "No")]


def test_an_error_is_reported(operator, core, obj):
    work = Work(core.PointCloudError("No"))
    started = operator([obj], work)
    work.go_on.set()
    assert started.end() == {"CANCELLED"}
    assert started.reports == [("ERROR", "No")]


def test_an_error_that_nobody_foresaw_is_raised_and_leaves_nothing(operator, jobs, obj):
    work = Work(ZeroDivisionError("never"))
    started = operator([obj], work)
    work.go_on.set()
    with pytest.raises(ZeroDivisionError):
        started.end()
    assert jobs.running() is None


def test_one_job_at_a_time(operator, obj):
    started = operator([obj], Work())
    with pytest.raises(RuntimeError, match="Try is running"):
        bpy.ops.meshfree.deform_bake()
    for call in (bpy.ops.meshfree.analyze, bpy.ops.meshfree.smooth, bpy.ops.meshfree.select_grow):
        with pytest.raises(RuntimeError, match=r"Try is running. Wait for it, or press Esc to stop it"):
            call()
    started.stop()
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}


def test_a_file_browser_that_was_open_before_another_job_began(operator, core, jobs, obj):
    started = operator([obj], Work())
    with pytest.raises(core.PointCloudError, match="Try is running. Wait for it, or press Esc to stop it"):
        operator([obj], Work())
    assert jobs.running() is started._job
    started.stop()


def test_a_dialog_that_is_closed_ends_nothing(operator, jobs):
    object.__new__(operator).cancel(bpy.context)
    assert jobs.running() is None


def moved_point(obj):
    obj.data.vertices[3].co.x += 0.01


def another_setting(obj):
    obj.meshfree.neighbors += 1


def another_scale(obj):
    obj.scale.x = 1.5
    bpy.context.view_layer.update()


def moved_by_a_modifier(obj):
    obj.modifiers["Displace"].strength = 0.3


CHANGES = {
    "point": (moved_point, 'points, scale or settings of "Cloud" were changed meanwhile'),
    "setting": (another_setting, 'points, scale or settings of "Cloud" were changed meanwhile'),
    "scale": (another_scale, 'points, scale or settings of "Cloud" were changed meanwhile'),
    "modifier": (moved_by_a_modifier, 'points, scale or settings of "Cloud" were changed meanwhile'),
    "mode": (lambda obj: bpy.ops.object.mode_set(mode="EDIT"), '"Cloud" is not in Object Mode. Switch'),
    "points": (lambda obj: obj.data.clear_geometry(), '"Cloud" has no vertices'),
}


@pytest.mark.parametrize(("change", "text"), CHANGES.values(), ids=CHANGES.keys())
def test_an_object_that_was_changed_gets_nothing(operator, obj, change, text):
    obj.modifiers.new("Displace", "DISPLACE").strength = 0.1
    obj.meshfree.use_modifiers = True
    work = Work()
    started = operator([obj], work)
    change(obj)
    work.go_on.set()
    assert started.end() == {"CANCELLED"}
    (kind, report) = started.reports[0]
    assert kind == "WARNING"
    assert report.startswith("Try wrote nothing: ")
    assert text in report
    assert started.finished is None
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_motion_of_the_object_is_no_change(operator, obj):
    work = Work()
    started = operator([obj], work)
    obj.location, obj.rotation_euler, obj.name = (1.0, 2.0, 3.0), (0.4, 0.5, 0.6), "Another Name"
    bpy.context.view_layer.update()
    work.go_on.set()
    assert started.end() == {"FINISHED"}
    assert started.finished[0] == [obj]


def test_a_deleted_object_ends_it(operator, obj):
    other = add_object(sphere_points(200), "Other")
    started = operator([obj, other], Work())
    bpy.data.objects.remove(other)
    assert started.tick() == {"CANCELLED"}
    assert started.reports == [("INFO", 'Stopped because "Other" was deleted: nothing was changed')]


@pytest.mark.parametrize("step", ["undo", "redo"])
def test_undo_and_redo_end_it(operator, obj, step):
    bpy.ops.ed.undo_push(message="Before")
    obj.location.x = 1.0
    bpy.ops.ed.undo_push(message="Moved")
    if step == "redo":
        bpy.ops.ed.undo()
    started = operator([bpy.data.objects["Cloud"]], Work())
    getattr(bpy.ops.ed, step)()
    assert started.tick() == {"CANCELLED"}
    assert started.reports == [("INFO", "Stopped by undo: nothing was changed")]


def test_another_file_ends_it(operator, jobs, obj):
    work = Work()
    started = operator([obj], work)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert jobs.running() is None
    started.cancel(started.context)  # as Blender does with handlers of a window that is gone
    assert started.tick() == {"CANCELLED"}
    work.go_on.set()
    started._job.wait(5.0)
    assert work.steps == ["One"]


def test_disabling_the_extension_ends_it(operator, jobs, obj):
    work = Work()
    operator([obj], work)
    work.go_on.set()
    jobs.detach()
    handlers = [
        handler for name in ("undo_post", "redo_post", "load_pre") for handler in getattr(bpy.app.handlers, name)
    ]
    jobs.attach()
    assert jobs.running() is None
    assert not any(handler.__module__ == jobs.__name__ for handler in handlers)


def test_growing_a_selection_in_edit_mode(operator, obj):
    selecting = part("operators.tools.select")
    obj.data.vertices.foreach_set("select", np.arange(200) < 3)
    obj.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")

    class Grow(selecting.SelectionOperator, operator):
        bl_label = "Grow"
        distance = 0.5
        prepare = selecting.MESHFREE_OT_select_grow.prepare
        finish = selecting.SelectionOperator.finish

        def __init__(self):
            self.reports = []
            with selecting.object_mode(bpy.context, obj):
                _, compute = selecting.operator_reader(bpy.context, obj)
                super().__init__([obj], compute)

    started = Grow()
    assert obj.mode == "EDIT"
    assert started.end() == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert started.reports[0][0] == "INFO"
    assert 3 < sum(vertex.select for vertex in obj.data.vertices) < 50


def test_several_objects_are_computed_one_after_the_other():
    application = part("operators.running.application")
    told = []
    plans = [(name, lambda progress, name=name: progress(name, 0.5) or name) for name in "AB"]
    assert application.compute_all(plans, lambda *progress: told.append(progress)) == ["A", "B"]
    assert told == [("A", 0.25), ("B", 0.75)]


def test_lines_of_progress_without_a_window(capfd):
    add_object(sphere_points(300, seed=9))
    bpy.ops.meshfree.analyze(modes=4)
    out, err = capfd.readouterr()
    lines = [line for line in err.splitlines() if line.startswith("Analyze Points: ")]
    assert lines[0] == "Analyze Points: Normals, 0%"
    assert lines[-1].startswith("Analyze Points: Spectrum")
    assert len(lines) == len(set(lines)) == 6
    assert "Analyze Points: " not in out


def test_stages_add_up_and_are_told_on():
    told = []
    with StageTimes(lambda *progress: told.append(progress)) as times:
        times("One", 0.0)
        times("Two", 0.5)
        times("One", 0.75)
    assert list(times.seconds) == ["One", "Two"]
    assert told == [("One", 0.0), ("Two", 0.5), ("One", 0.75)]
    assert (times.stage, times.fraction) == ("One", 0.75)
    assert np.all(np.array(list(times.seconds.values())) >= 0.0)
