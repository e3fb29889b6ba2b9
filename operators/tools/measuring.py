"""Measures of selected points: area, boundary, sizes, curvature and volume; the shortest path between two points."""

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty

from ... import core
from ...core import PointCloudError
from ..objects.curves import add_curves
from ..objects.result import area_text, length_text, volume_text
from ..registration import Registration, Row
from ..running import cache
from .mesh import volume_of
from .select import SelectionOperator, analyzed, selected


class MESHFREE_OT_measure_selection(SelectionOperator, bpy.types.Operator):
    """Measure the selected points: area, boundary, size, curvature, and the volume of the whole surface"""

    bl_idname = "meshfree.measure_selection"
    bl_label = "Measure Selection"

    volume: BoolProperty(
        name="Volume",
        description="Measure the volume within the whole surface, its openings closed, and that of the selected points"
        " over the plane of their rim. It takes longer",
        default=False,
    )

    def prepare(self, context, obj):
        chosen = selected(obj)
        _, laplacian = analyzed(context, obj)
        region = cache.result(laplacian, "region", chosen, compute=lambda: core.measure_region(laplacian, chosen))
        lines, notices = _texts(laplacian, region, chosen), []
        if self.volume:
            found = volume_of(laplacian, lambda *_: None)
            lines.append(f"Volume {_within(volume_text, found.volume, found.uncertainty)}")
            pile, missing = _pile(laplacian, chosen)
            lines += pile
            notices = [*found.notices, *missing]
        left = np.count_nonzero(chosen & (laplacian.component < 0))
        if left:
            notices = [f"{left:,} selected points are left out of the Laplacian, and not measured.", *notices]

        def keep():
            self.begin_notices([obj])
            for line in lines:
                self.note(f"{obj.name}: {line}", obj)
            for notice in notices:
                self.warn(notice, obj)
            return f"{np.count_nonzero(chosen):,} points are measured"

        return keep


def _texts(laplacian, region, chosen):
    """Return the figures of a part as lines."""
    known = chosen & (laplacian.component >= 0)
    sizes = np.ptp(laplacian.surface_points[known], axis=0)
    curvature = core.mean_curvature(laplacian)[known]
    areas = laplacian.areas[known]
    mean, most = areas @ curvature / areas.sum(), curvature[np.abs(curvature).argmax()]
    return [
        f"Area {_within(area_text, region.area, region.area_uncertainty)}",
        f"Boundary {_within(length_text, region.boundary_length, region.length_uncertainty)}",
        f"Size {' x '.join(map(length_text, sizes))} along the axes of the world",
        f"Mean curvature {mean:.4g} on average, {most:.4g} at most, in 1 / length",
    ]


def _pile(laplacian, chosen):
    """Return the volumes above and below the plane through the rim of a part as a line, or why there are none."""
    try:
        found = core.pile_volume(laplacian, chosen)
    except core.InvalidPointsError as error:
        return [], [f"{error} Its volume over the rim was not measured."]
    above = _within(volume_text, found.above, found.uncertainty)
    return [f"Over the plane of its rim {above}, below it {volume_text(found.below)}"], []


def _within(text, value, off):
    """Return a number in the scene's units with its uncertainty, as a share of it."""
    return f"{text(value)} +- {100.0 * off / abs(value):.2g} %" if value else f"{text(value)} +- {text(off)}"


class MESHFREE_OT_geodesic_path(SelectionOperator, bpy.types.Operator):
    """Draw the shortest path along the surface between the two selected points, and measure it"""

    bl_idname = "meshfree.geodesic_path"
    bl_label = "Geodesic Path"

    thickness: FloatProperty(
        name="Thickness",
        description="Radius of a tube along the path; with 0 it is seen in viewports only",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )

    def prepare(self, context, obj):
        reading, laplacian, ends, path = selected_path(context, obj)
        straight = length_text(core.polygon_length(laplacian.points[ends]))
        line = f"{length_text(core.polygon_length(path))} along the surface, {straight} straight"

        def add():
            made = add_curves(obj, f"{obj.name} Path", [(reading.local(path), False)], self.thickness)
            self.begin_notices([obj])
            self.note(f"{obj.name}: {line}", obj)
            return f"{made.name} is {line}"

        return add


def selected_path(context, obj):
    """Find the shortest path between the two selected points.

    Returns
    -------
    Reading
    LaplaceBeltrami
    ndarray, (2,) int
        These points.
    ndarray, (k, 3)
        Corners of the path, as points are read.
    """
    ends = np.flatnonzero(selected(obj))
    if len(ends) != 2:
        raise PointCloudError(
            f'{len(ends):,} points of "{obj.name}" are selected. Select the two between which the path leads.'
        )
    reading, laplacian = analyzed(context, obj)
    path = cache.result(
        laplacian,
        "path",
        ends,
        compute=lambda: core.geodesic_path(
            laplacian, *ends.tolist(), geodesics=cache.geodesics(laplacian, lambda *_: None)
        ),
    )
    return reading, laplacian, ends, path


TOOLS = (
    Registration(MESHFREE_OT_measure_selection, panel=Row("Points and Groups", 2, 1), menu=Row("Points", 2, 1)),
    Registration(MESHFREE_OT_geodesic_path, panel=Row("Points and Groups", 2, 2), menu=Row("Points", 2, 2)),
)
