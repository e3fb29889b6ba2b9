"""What the operators that apply the Laplacian have in common: read all objects, compute, and only then write."""

from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
from bpy.props import BoolProperty

from ..core import PointCloudError
from . import cache
from .options import laplacian_options
from .reading import obstacle, read_points, sharing_objects
from .ready import ReadyOperator
from .result import check_writable
from .stages import Stages


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

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        context.view_layer.update()  # a script may have moved or scaled an object a line ago
        objects, left_out = ([context.object], []) if self.only_active else chosen_objects(context)
        plans, results = [], []
        try:
            for obj in objects:
                with naming(obj):
                    check_writable(obj, self.writes, obj.meshfree.make_single_user, among=context.selected_objects)
                    plans.append(self.plan(context, obj))
            with Stages(context.window_manager) as stages:
                for obj, plan in zip(objects, plans, strict=True):
                    with naming(obj):
                        results.append(plan(stages))
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        done.messages, done.notices, done.seconds = [], [], stages.seconds
        self.warn([f"Left out: {reason}." for reason in left_out])
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


@contextmanager
def naming(obj):
    """Let errors say which object they are about."""
    name = f'"{obj.name}"'
    try:
        yield
    except PointCloudError as error:
        if name in str(error):
            raise
        raise PointCloudError(f"{name}: {error}") from error


def chosen_objects(context):
    """Choose among the active object and the other selected ones.

    Returns
    -------
    list of bpy.types.Object
        All meshes that can be read and written. Of those that share a mesh one, but each that is to get its own.
    list of str
        What the other meshes lack.
    """
    chosen, left_out = {}, []
    for obj in [context.object, *context.selected_objects]:
        reason = obstacle(obj)
        if not reason:
            chosen.setdefault(obj if obj.meshfree.make_single_user else obj.data, obj)
        elif obj.type == "MESH":
            left_out.append(reason)
    return list(chosen.values()), left_out


def operator_reader(context, obj):
    """Read an object's points; return them, and a function of a progress callback that gives their operator."""
    reading = read_points(context, obj)
    options = laplacian_options(obj.meshfree)
    return reading, lambda progress: cache.build(reading.points, options, reading.rim, progress).laplacian
