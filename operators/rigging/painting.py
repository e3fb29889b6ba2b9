"""The base of operators that change weights: in Object Mode, Edit Mode and Weight Paint alike."""

from ..running.application import ApplicationOperator
from ..running.ready import reporting
from ..tools.select import object_mode


class WeightOperator(ApplicationOperator):
    """An operator on the weights of points, which leaves the mode of the object while it reads and writes."""

    works_in = ("OBJECT", "EDIT", "WEIGHT_PAINT")

    @reporting
    def execute(self, context):
        with object_mode(context, context.object):
            return super().execute(context)

    def complete(self, context, job):
        obj = job.snapshots[0].find()
        if obj is not None and obj.mode != "OBJECT" and obj != context.view_layer.objects.active:
            job.stop(f'Stopped because "{obj.name}" is no longer the active object: nothing was changed')
        if job.reason or obj is None:
            return super().complete(context, job)
        with context.temp_override(object=obj, active_object=obj), object_mode(context, obj):
            return super().complete(context, job)


def in_selecting_mode(obj) -> bool:
    """Whether an object is in a mode in which tools work on the selected points."""
    masked = obj.type == "MESH" and (obj.data.use_paint_mask or obj.data.use_paint_mask_vertex)
    return obj.mode == "EDIT" or (obj.mode == "WEIGHT_PAINT" and masked)
