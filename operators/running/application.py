"""What the operators that apply the Laplacian have in common: read all objects, compute, and only then write."""

from contextlib import contextmanager
from dataclasses import dataclass, field

from bpy.props import BoolProperty

from ...core import PointCloudError
from ..objects.handlers import tell
from ..objects.options import laplacian_options
from ..objects.reading import TYPES, obstacle, read_points, sharing_objects
from ..objects.result import check_writable
from . import cache
from .job import JobOperator
from .stages import Stages


@dataclass
class Done:
    """What the last of these operators did, for the command line."""

    messages: list = field(default_factory=list)
    notices: list = field(default_factory=list)
    seconds: dict = field(default_factory=dict)


done = Done()


class ApplicationOperator(JobOperator):
    """An operator on the active object and on all other selected ones that can be read and written.

    Of objects that share a mesh and its scale one is enough. A subclass says what to do by two methods: `plan` reads
    everything that is needed of an object and returns a function of a progress callback that computes, without touching
    Blender; `write` puts what that returns on the object and returns a line for the status bar.
    """

    only_active = False  # for what has one object by nature
    asks = ()  # names of the settings that a dialog asks for before the work; without any there is none
    writes = ()  # names of the attributes that `write` makes
    adjustable = ()  # of those that Adjust Last Operation, which waits, offers: they compute nothing long again

    def invoke(self, context, event):
        self._attended = True
        return context.window_manager.invoke_props_dialog(self) if self.asks else self.execute(context)

    def execute(self, context):
        """Do all at once for scripts; beside the window for somebody there."""
        attended = self.takes_window()
        context.view_layer.update()  # a script may have moved or scaled an object a line ago
        objects, left_out = [self.subject(context)], []
        if not self.only_active:
            objects, left_out = chosen_objects(context, self.becomes_single)
        plans = []
        try:
            for obj in objects:
                with naming(obj.name):
                    check_writable(obj, self.writes, self.becomes_single(obj), among=context.selected_objects)
                    plans.append((obj.name, self.plan(context, obj)))
            self._left_out = left_out
            if attended:
                return self.start(context, objects, lambda progress: compute_all(plans, progress))
            with Stages(context.window_manager, self.bl_label) as stages:
                results = compute_all(plans, stages)
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return self.finish(context, objects, results, stages.seconds)

    def finish(self, context, objects, results, seconds):
        """Write what was computed."""
        done.messages, done.notices, done.seconds = [], [], seconds
        self.warn([(f"Left out: {reason}.") for reason in self._left_out])
        for obj in objects:  # before anything is written to a mesh that is copied
            if self.becomes_single(obj) and sharing_objects(obj):
                obj.data = obj.data.copy()
        for obj, result in zip(objects, results, strict=True):
            done.messages.append(self.write(context, obj, result))
            self.report({"INFO"}, done.messages[-1])
        self.conclude(context, objects)
        return {"FINISHED"}

    def becomes_single(self, obj) -> bool:
        """Whether an object that shares its mesh gets its own."""
        return obj.meshfree.make_single_user

    def conclude(self, context, objects):
        """Do what is left when all objects are written."""

    def warn(self, notices):
        """Report notices of core."""
        for notice in notices:
            self.report({"WARNING"}, notice)
        done.notices += notices

    def is_repeated(self, context) -> bool:
        """Whether this has run before, and is run again by Adjust Last Operation."""
        return any(last.as_pointer() == self.as_pointer() for last in context.window_manager.operators)


class ShownOperator(ApplicationOperator):
    """An operator whose attribute is shown when it is done."""

    show: BoolProperty(name="Show", description="Show the result as colors on the points", default=True)
    adjustable = ("show",)

    @property
    def shown(self) -> str:
        """Name of the attribute."""
        return self.writes[0]

    def conclude(self, context, objects):
        sharing = [other for obj in objects for other in sharing_objects(obj) if other in context.selected_objects]
        if self.show:
            for obj in [*objects, *sharing]:
                tell("result_written", obj, self.shown if self.shown in obj.data.attributes else "")


def compute_all(plans, progress):
    """Carry out what was planned for some objects, given by name, and return the results."""
    results = []
    for number, (name, plan) in enumerate(plans):

        def report(stage, fraction, number=number):
            progress(stage, (number + fraction) / len(plans))

        with naming(name):
            results.append(plan(report))
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


def chosen_objects(context, becomes_single):
    """Choose among the active object and the other selected ones.

    Parameters
    ----------
    context : bpy.types.Context
    becomes_single : callable
        Tells of an object whether it is to get a mesh of its own.

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
            chosen.setdefault(obj if becomes_single(obj) else obj.data, obj)
        elif obj.type in TYPES:
            left_out.append(reason)
    return list(chosen.values()), left_out


def operator_reader(context, obj):
    """Read an object's points; return them, and a function of a progress callback that gives their operator."""
    reading = read_points(context, obj)
    options = laplacian_options(obj.meshfree)
    return reading, lambda progress: cache.build(reading.points, options, reading.boundary, progress).laplacian
