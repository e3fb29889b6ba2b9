"""Analysis of all frames of a sequence, with modes matched from frame to frame and one color range."""

from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty

from ...command.analysis import WRITE_LIMIT, continued
from ...command.naming import naming, natural
from ...core import PointCloudError
from ...tools.quantities import AREA, MEAN_CURVATURE, eigenvector_name
from ..objects.all_or_nothing import all_or_nothing
from ..objects.handlers import notify
from ..objects.modifiers import COLLECTION, get_input, is_sequence
from ..objects.reading import obstacle, read_points, sharing_objects
from ..objects.result import analysis_names, area_text, check_writable, write_result
from ..registration import Registration, Row
from ..running.job import JobOperator
from ..running.ready import reporting
from .analyze import plan_analysis


def frames_of(obj) -> list:
    """Return the objects that a sequence shows, in natural order of their names."""
    modifier = next((item for item in obj.modifiers if is_sequence(item)), None) if obj is not None else None
    collection = modifier and get_input(modifier, COLLECTION)
    if collection is None:
        return []
    return sorted(collection.objects, key=lambda item: natural(item.name))


def continue_modes(analysis, points, earlier):
    """Return an analysis with matched modes, and the rest of what `continued` returns."""
    spectrum, overlaps, earlier = continued(analysis.spectrum, analysis.measures[AREA], points, earlier)
    return replace(analysis, spectrum=spectrum), overlaps, earlier


class MESHFREE_OT_analyze_sequence(JobOperator, bpy.types.Operator):
    """Analyze all frames of a sequence, with modes that keep their order and signs, and show them in one color range"""

    bl_idname = "meshfree.analyze_sequence"
    bl_label = "Analyze Sequence"
    bl_options = {"REGISTER", "UNDO"}
    asks = ("modes", "shown_mode", "show")
    at_zero = {"shown_mode": "Mean Curvature"}

    modes: IntProperty(
        name="Modes", description="Compute this many vibration modes of each frame", default=0, min=0, soft_max=50
    )
    shown_mode: IntProperty(
        name="Mode on Show",
        description="Show this mode in all frames; 0 shows the mean curvature",
        default=0,
        min=0,
        soft_max=50,
    )
    show: BoolProperty(name="Show", description="Show the result as colors in one range for all frames", default=True)

    @classmethod
    def obstacle(cls, context):
        if not frames_of(context.object):
            return "No sequence is active. Import numbered files as a sequence, or select the object that shows them"
        return next(filter(None, map(obstacle, frames_of(context.object))), "")

    def invoke(self, context, event):
        self._attended = True
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context):
        if self.shown_mode > self.modes:
            raise PointCloudError(f"Mode {self.shown_mode} is to be shown of {self.modes}. Raise Modes to that.")
        context.view_layer.update()
        frames, plans = frames_of(context.object), []
        names = analysis_names(self.modes)
        for obj in frames:
            with naming(obj.name):
                check_writable(obj, names, obj.meshfree.make_single_user)
                points = read_points(context, obj).points + np.array(obj.matrix_world.translation)
                plans.append((obj.name, points, plan_analysis(context, obj, self.modes, max(self.modes, WRITE_LIMIT))))
        return self.work(context, frames, lambda progress: _compute(plans, progress))

    def finish(self, context, objects, results):
        """Write all frames, show them, and report warnings."""
        name = eigenvector_name(self.shown_mode) if self.shown_mode else MEAN_CURVATURE
        with all_or_nothing(objects):
            for obj, (analysis, _) in zip(objects, results, strict=True):
                if sharing_objects(obj):  # make_single_user is on, as checked
                    obj.data = obj.data.copy()
                write_result(obj, analysis, max(self.modes, WRITE_LIMIT))
            if self.show:
                notify("sequence_written", objects, name)
            self._warn_of(objects, results)
        areas = [analysis.total_area for analysis, _ in results]
        span = f"area {area_text(min(areas))} to {area_text(max(areas))}"
        modes = f", {self.modes} modes" if self.modes else ""
        self.report({"INFO"}, f"{len(objects)} frames, {span}{modes}")
        return {"FINISHED"}

    def _warn_of(self, frames, results):
        """Keep warnings on frames, and on the objects that show them, since frames are seldom selected."""
        sequences = [obj for obj in bpy.data.objects if frames_of(obj) == frames]
        self.begin_notices([*sequences, *frames])
        for obj, (analysis, overlaps) in zip(frames, results, strict=True):
            for notice in [*analysis.notices, *_lost(overlaps)]:
                self.warn(f"{obj.name}: {notice}", obj, *sequences)


def _lost(overlaps):
    """Return a notice of modes without a match."""
    lost = np.flatnonzero(overlaps < 0.5) + 1
    if not len(lost):
        return []
    shown = ", ".join(map(str, lost[:5])) + (", ..." if len(lost) > 5 else "")
    return [f"modes {shown} do not continue those of the frame before"]


def _compute(plans, progress):
    """Analyze frames, given by name, points and plan, one after the other; return analyses and overlaps of modes."""
    results, earlier = [], None
    for number, (name, points, plan) in enumerate(plans):

        def report(_stage, fraction, number=number):
            progress(f"Frame {number + 1} of {len(plans)}", (number + fraction) / len(plans))

        report("", 0.0)  # a frame that is kept reports no other
        with naming(name):
            analysis, overlaps = plan(report), np.empty(0)
            if analysis.spectrum is not None:
                analysis, overlaps, earlier = continue_modes(analysis, points, earlier)
        results.append((replace(analysis, built=None), overlaps))  # which is large, and not written
    return results


TOOLS = (Registration(MESHFREE_OT_analyze_sequence, menu=Row("Object", 1, 5)),)
