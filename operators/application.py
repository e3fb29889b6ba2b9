"""What the operators that apply the Laplacian have in common: read all objects, compute, and only then write."""

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

    Of objects that share a mesh one is enough. A subclass says what to do by two methods: `plan` reads everything that
    is needed of an object and returns a function of a progress callback that computes, without touching Blender;
    `write` puts what that returns on the object and returns a line for the status bar.
    """

    only_active = False  # for what has one object by nature
    writes = ()  # names of the attributes that `write` makes

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        objects = [context.object] if self.only_active else chosen_objects(context)
        try:
            plans = []
            for obj in objects:
                check_writable(obj, self.writes, obj.meshfree.make_single_user, among=context.selected_objects)
                plans.append(self.plan(context, obj))
            with Stages(context.window_manager) as stages:
                results = [plan(stages) for plan in plans]
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        done.messages, done.notices, done.seconds = [], [], stages.seconds
        for obj, result in zip(objects, results, strict=True):
            if obj.meshfree.make_single_user and sharing_objects(obj):
                obj.data = obj.data.copy()
            done.messages.append(self.write(context, obj, result))
            self.report({"INFO"}, done.messages[-1])
        return {"FINISHED"}

    def warn(self, notices):
        """Report notices of core."""
        for notice in notices:
            self.report({"WARNING"}, notice)
        done.notices += notices


class ShownOperator(ApplicationOperator):
    """An operator whose attribute is shown when it is done."""

    show: BoolProperty(name="Show", description="Show the result as colors on the points", default=True)

    def execute(self, context):
        result = super().execute(context)
        if result == {"FINISHED"} and self.show:
            bpy.ops.meshfree.colormap(attribute=self.writes[0])
        return result


def chosen_objects(context):
    """Return the active object and the other selected ones that can be read and written, one per mesh."""
    by_mesh = {}
    for obj in [context.object, *context.selected_objects]:
        if not obstacle(obj):
            by_mesh.setdefault(obj.data, obj)
    return list(by_mesh.values())


def operator_reader(context, obj):
    """Read an object's points; return them, and a function of a progress callback that gives their operator."""
    reading = read_points(context, obj)
    options = laplacian_options(obj.meshfree)
    return reading, lambda progress: cache.build(reading.points, options, reading.rim, progress).laplacian
