"""Areas, normals, curvature, rim and connected parts of the active object's points."""

from dataclasses import dataclass

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty

from ..core import LaplaceBeltrami, PointCloudError, Spectrum, UnresolvedModesError
from . import cache
from .attributes import point_count
from .options import laplacian_options
from .reading import read_points
from .ready import ReadyOperator
from .result import analysis_names, area_text, check_writable, write_result
from .stages import Stages

WRITE_LIMIT = 50  # modes written as attributes unless more are asked for: each takes 4 bytes per point in the file


@dataclass(frozen=True)
class Analysis:
    """All that is computed for an object, in lengths of the world; normals in local space too."""

    laplacian: LaplaceBeltrami
    local_normals: np.ndarray
    mean_curvature: np.ndarray
    spectrum: Spectrum | None
    seconds: dict
    notices: list

    @property
    def total_area(self) -> float:
        """Area of the whole surface."""
        return float(self.laplacian.areas.sum())

    @property
    def counts(self) -> dict:
        """Connected parts, points at a rim and points left out, by the names of the settings that keep them."""
        component = self.laplacian.component
        return {
            "part_count": int(component.max()) + 1,
            "rim_count": int(np.count_nonzero(self.laplacian.boundary)),
            "left_out_count": int(np.count_nonzero(component < 0)),
        }


def analyze_object(context, obj, modes: int = 0) -> Analysis:
    """Compute all that an analysis gives, with the lowest modes if any are asked for; write nothing."""
    reading = read_points(context, obj)
    with Stages(context.window_manager) as stages:
        laplacian, curvature = cache.build(reading.points, laplacian_options(obj.meshfree), reading.rim, stages)
        spectrum, unresolved = resolved_modes(laplacian, modes, stages) if modes else (None, [])
    notices = reading.notices + laplacian.notices + unresolved
    local_normals = reading.local_normals(laplacian.normals)
    return Analysis(laplacian, local_normals, curvature, spectrum, stages.seconds, notices)


def resolved_modes(laplacian, modes, progress):
    """Compute the modes asked for, or as many of them as the points resolve and a notice of that."""
    try:
        return cache.lowest_modes(laplacian, modes, progress), []
    except UnresolvedModesError as error:
        if error.resolved == 0:
            raise
        notice = f"Only {error.resolved} of {modes} modes were computed: the others are finer than the points resolve."
        return cache.lowest_modes(laplacian, error.resolved, progress), [notice]


class AnalysisOperator(ReadyOperator):
    """What the operators that analyze the active object have in common."""

    write_limit: IntProperty(
        name="Modes to Write",
        description="Write at most this many modes as attributes; the eigenvalues of all of them are kept",
        default=WRITE_LIMIT,
        min=1,
        max=999,
    )
    make_single_user: BoolProperty(
        name="Make Single User",
        description="Give the object a mesh of its own if it shares its mesh with other objects",
        default=False,
        options={"SKIP_SAVE"},
    )
    show: BoolProperty(name="Show", description="Show the result as colors on the points", default=True)

    def run(self, context, modes: int, shown: str):
        """Analyze the active object, write the result, then show the attribute `shown`; empty for the one on show."""
        obj = context.object
        written = min(modes, self.write_limit)
        try:
            check_writable(obj, analysis_names(written), self.make_single_user or obj.meshfree.make_single_user)
            analysis = analyze_object(context, obj, modes)
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        write_result(obj, analysis, self.write_limit)
        for notice in analysis.notices:
            self.report({"WARNING"}, notice)
        message = f"{area_text(analysis.total_area)} from {point_count(obj.data):,} points"
        if analysis.spectrum is not None:
            message += f", {len(analysis.spectrum.eigenvalues)} modes"
        self.report({"INFO"}, f"{message}, {sum(analysis.seconds.values()):.1f} s")
        if self.show:
            bpy.ops.meshfree.colormap(attribute=shown if shown in obj.data.attributes else "")
        return {"FINISHED"}


class MESHFREE_OT_analyze(AnalysisOperator, bpy.types.Operator):
    """Compute area, normal and curvatures of each point, the rim, the connected parts and the total area"""

    bl_idname = "meshfree.analyze"
    bl_label = "Analyze Points"

    modes: IntProperty(
        name="Modes", description="Compute this many vibration modes in the same run", default=0, min=0, soft_max=100
    )

    def execute(self, context):
        return self.run(context, self.modes, shown="")


CLASSES = (MESHFREE_OT_analyze,)
