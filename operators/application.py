"""What the operators that apply the Laplacian have in common: read all objects, compute, and only then write."""

from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
from bpy.props import BoolProperty

from ..core import Cancelled, PointCloudError
from . import cache
from .options import laplacian_options
from .reading import TYPES, obstacle, read_points, sharing_objects
from .ready import ReadyOperator
from .result import check_writable
from .stages import Stages, Work

_TICK = 0.1  # seconds between two looks at the work
_VIEWING = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM"}


@dataclass
class Done:
    """What the last of these operators did, for the command line."""

    messages: list = field(default_factory=list)
    notices: list = field(default_factory=list)
    seconds: dict = field(default_factory=dict)


done = Done()


class ApplicationOperator(ReadyOperator):
    """An operator on the active object and on all other selected ones that can be read and written.

    Of objects that share a mesh and its scale one is enough. A subclass says what to do by two methods: `plan` reads
    everything that is needed of an object and returns a function of a progress callback that computes, without touching
    Blender; `write` puts what that returns on the object and returns a line for the status bar.
    """

    only_active = False  # for what has one object by nature
    writes = ()  # names of the attributes that `write` makes
    _attended = False  # somebody at the window waits for it, and may press Esc

    def invoke(self, context, event):
        self._attended = True
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        """Do all at once for scripts; let somebody at the window stop it."""
        context.view_layer.update()  # a script may have moved or scaled an object a line ago
        objects, left_out = ([context.object], []) if self.only_active else chosen_objects(context)
        plans = []
        try:
            for obj in objects:
                with naming(obj.name):
                    check_writable(obj, self.writes, obj.meshfree.make_single_user, among=context.selected_objects)
                    plans.append((obj.name, self.plan(context, obj)))
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._objects, self._left_out = objects, left_out
        attended, self._attended = self._attended, False  # Adjust Last Operation comes here again, and waits
        if attended and not bpy.app.background:
            self._work = Work(lambda progress: compute_all(plans, progress))
            self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        with Stages(context.window_manager) as stages:
            return self._finish(context, lambda: compute_all(plans, stages), stages)

    def modal(self, context, event):
        if event.type == "ESC":
            self._work.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in _VIEWING else {"RUNNING_MODAL"}
        if not self._work.ended:
            context.workspace.status_text_set(
                f"{self.bl_label}: stopping"
                if self._work.stopping
                else f"{self.bl_label}: {self._work.stage}, {self._work.fraction:.0%}    Esc to stop"
            )
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        return self._finish(context, self._work.result, self._work)

    def _finish(self, context, compute, stages):
        """Write what was computed, or report why there is nothing."""
        objects = self._objects
        try:
            results = compute()
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except Cancelled:
            self.report({"INFO"}, "Stopped: nothing was changed")
            return {"CANCELLED"}
        done.messages, done.notices, done.seconds = [], [], stages.seconds
        self.warn([f"Left out: {reason}." for reason in self._left_out])
        for obj in objects:  # before anything is written to a mesh that is copied
            if obj.meshfree.make_single_user and sharing_objects(obj):
                obj.data = obj.data.copy()
        for obj, result in zip(objects, results, strict=True):
            done.messages.append(self.write(context, obj, result))
            self.report({"INFO"}, done.messages[-1])
        self.conclude(context, objects)
        return {"FINISHED"}

    def conclude(self, context, objects):
        """Do what is left when all objects are written."""

    def warn(self, notices):
        """Report notices of core."""
        for notice in notices:
            self.report({"WARNING"}, notice)
        done.notices += notices


class ShownOperator(ApplicationOperator):
    """An operator whose attribute is shown when it is done."""

    show: BoolProperty(name="Show", description="Show the result as colors on the points", default=True)

    def conclude(self, context, objects):
        if self.show:
            for obj in objects:
                with context.temp_override(object=obj):
                    bpy.ops.meshfree.colormap(attribute=self.writes[0])


def compute_all(plans, progress):
    """Carry out what was planned for some objects, given by name, and return the results."""
    results = []
    for name, plan in plans:
        with naming(name):
            results.append(plan(progress))
    return results


@contextmanager
def naming(name):
    """Let errors say which object they are about."""
    try:
        yield
    except PointCloudError as error:
        if f'"{name}"' in str(error):
            raise
        raise PointCloudError(f'"{name}": {error}') from error


def chosen_objects(context):
    """Choose among the active object and the other selected ones.

    Returns
    -------
    list of bpy.types.Object
        All meshes and point clouds that can be read and written. Of those that share a mesh one, but each that is to
        get its own.
    list of str
        What the others of these lack.
    """
    chosen, left_out = {}, []
    for obj in [context.object, *context.selected_objects]:
        reason = obstacle(obj)
        if not reason:
            chosen.setdefault(obj if obj.meshfree.make_single_user else obj.data, obj)
        elif obj.type in TYPES:
            left_out.append(reason)
    return list(chosen.values()), left_out


def operator_reader(context, obj):
    """Read an object's points; return them, and a function of a progress callback that gives their operator."""
    reading = read_points(context, obj)
    options = laplacian_options(obj.meshfree)
    return reading, lambda progress: cache.build(reading.points, options, reading.rim, progress).laplacian
