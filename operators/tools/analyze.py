"""Analysis: areas, normals, curvature, boundary and components of points."""

from dataclasses import dataclass, replace

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty, StringProperty

from ... import core
from ...command import analysis
from ...command.analysis import WRITE_LIMIT, Built
from ...command.stages import StageTimes
from ...tools.quantities import MEAN_CURVATURE, NORMAL, quantity
from ..objects.attributes import point_count
from ..objects.notices import forget_results
from ..objects.options import laplacian_options, point_budget
from ..objects.reading import read_points
from ..objects.result import analysis_names, area_text, is_analyzed, is_stale, trusted_text, write_result
from ..registration import Registration, Row
from ..running.application import ShownOperator
from ..running.measures import measure


@dataclass(frozen=True)
class Analysis:
    """The results for an object, in world lengths; normals in local space too."""

    built: Built  # on the subset, where there is one
    measures: dict  # by the names of attributes
    local_normals: np.ndarray
    spectrum: "core.Spectrum | None"
    subset_count: int  # points that it was computed on; 0 for all
    seconds: dict
    notices: list

    @property
    def total_area(self) -> float:
        """Area of the whole surface."""
        return analysis.total_area(self.measures)

    @property
    def trusted_area(self) -> float:
        """Area of its parts whose results are not in doubt."""
        return analysis.trusted_area(self.measures)

    @property
    def counts(self) -> dict:
        """Numbers of components, boundary points and points left out, by the names of the settings that keep them."""
        return analysis.counts(self.measures)


def plan_analysis(context, obj, modes: int = 0, write_limit: int = WRITE_LIMIT, orient=None):
    """Read an object; return a function of a progress callback that analyzes it, with the lowest modes if any.

    Of a subset at most `write_limit` modes are transferred to all points. The normals are oriented by the object's
    attribute, or by the vectors, (n, 3), that `orient` returns, called with the measures and a progress callback.
    """
    reading = read_points(context, obj)
    options, budget = laplacian_options(obj.meshfree), point_budget(obj.meshfree)

    def compute(progress):
        with StageTimes(progress) as times:
            given = reading.points, options, reading.boundary, budget, modes, times
            measured = measure(*given, reading.orientation, reading.splats)
            if orient is not None:
                measured = measure(*given, orient(measured, times), reading.splats)
            spectrum, unresolved = None, []
            if modes:
                spectrum, unresolved = analysis.resolved_modes(measured.built.laplacian, modes, times)
            if spectrum is not None and len(measured.subset):
                times("All Points", 1.0)
                spectrum = replace(spectrum, eigenvectors=measured.carried(spectrum.eigenvectors[:, :write_limit]))
        return Analysis(
            built=measured.built,
            measures=measured.measures,
            local_normals=reading.local_normals(measured.measures[NORMAL]),
            spectrum=spectrum,
            subset_count=len(measured.subset),
            seconds=times.seconds,
            notices=reading.notices + measured.notices + unresolved,
        )

    return compute


class AnalysisOperator(ShownOperator):
    """The base of operators that analyze objects; `wanted` is the number of modes."""

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

    @property
    def adjustable(self):
        """Names of the settings; the number of modes to write only where not all are written."""
        return ("write_limit", "show") if self.wanted > WRITE_LIMIT else ("show",)

    @property
    def writes(self):
        """Names of the attributes."""
        return analysis_names(min(self.wanted, self.write_limit))

    def becomes_single(self, obj):
        return self.make_single_user or super().becomes_single(obj)

    def plan(self, context, obj):
        return plan_analysis(context, obj, self.wanted, self.write_limit)

    def write(self, context, obj, result):
        if is_analyzed(obj) and is_stale(obj):
            forget_results(obj)
        write_result(obj, result, self.write_limit)
        modes = "" if result.spectrum is None else f", {len(result.spectrum.eigenvalues)} modes"
        points, seconds = point_count(obj.data), sum(result.seconds.values())
        trusted = trusted_text(result)
        trusted = f" ({trusted} of it trusted)" if trusted else ""
        line = f"{obj.name}: {area_text(result.total_area)}{trusted} from {points:,} points{modes}, {seconds:.1f} s"
        return [*result.notices, line]


class MESHFREE_OT_analyze(AnalysisOperator, bpy.types.Operator):
    """Compute area, normal and curvatures of each point, the boundary, the components and the total area"""

    bl_idname = "meshfree.analyze"
    bl_label = "Analyze Points"

    modes: IntProperty(
        name="Modes",
        description="Compute this many vibration modes in the same run",
        default=0,
        min=0,
        soft_max=100,
        options={"SKIP_SAVE"},  # else the search (F3) would do what a script has done last
    )
    attribute: StringProperty(
        name="Attribute",
        description="Name of the result to show; empty for the one on show, or the mean curvature",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(cls, context, properties):
        """Return the tooltip of a button; empty for that of the class."""
        return quantity(properties.attribute).tooltip

    @property
    def shown(self):
        """Name of the attribute."""
        return self.attribute

    @property
    def wanted(self):
        """How many modes to compute."""
        return self.modes


TOOLS = (
    Registration(
        MESHFREE_OT_analyze,
        menu=Row("Object", 1, 3),
        quick=Row("Object", 1, 3, "Curvature", (("attribute", MEAN_CURVATURE),)),
    ),
)
