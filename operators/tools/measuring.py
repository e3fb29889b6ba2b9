"""Measures of selected points: area, boundary, sizes, curvature and volume; the shortest path between two points."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty

from ... import core
from ...command.measures import Base, pile_over
from ...command.naming import naming
from ...core import PointCloudError
from ...tools.cross_section import UP
from ...tools.profile import path_between
from ..objects.curves import add_curves
from ..objects.planes import object_of, plane_of
from ..objects.reading import obstacle
from ..objects.result import area_text, length_text, volume_text
from ..registration import Registration, Row
from ..running.application import operator_reader
from .select import SelectionOperator, analyzed, selected, selected_ends


class Figure(NamedTuple):
    """A measure, in world lengths."""

    title: str
    values: tuple  # of float
    uncertainty: float  # within which the true value is expected; 0 if that is not known
    power: int  # of length


class Measured(NamedTuple):
    """Measures of selected points."""

    area: Figure
    boundary: Figure
    size: Figure
    mean_curvature: Figure
    largest_curvature: Figure
    # Volumes on both sides of a plane, and their difference where the plane was chosen, so that it has a sign
    above: Figure | None
    below: Figure | None
    net: Figure | None
    notices: list  # of str

    @property
    def figures(self) -> list:
        """All of them that there are."""
        return [item for item in self if isinstance(item, Figure)]


class MESHFREE_OT_measure_selection(SelectionOperator, bpy.types.Operator):
    """Measure the selected points: area, boundary, size, curvature, and the volume of the whole surface"""

    bl_idname = "meshfree.measure_selection"
    bl_label = "Measure Selection"

    volume: BoolProperty(
        name="Volume",
        description="Measure the volume within the whole surface, its openings closed, and that of the selected points"
        " over the plane of Volume Over. It takes longer",
        default=False,
    )

    def prepare(self, context, obj):
        chosen = selected(obj)
        _, laplacian = analyzed(context, obj)
        base = volume_base(context, obj) if self.volume else None
        found = measured(laplacian, chosen, base, lambda *_: None)
        lines, notices = _texts(found), []
        if self.volume:
            whole = core.measure.enclosed_volume(laplacian)
            lines.append(f"Volume {_within(volume_text, whole.volume, whole.uncertainty)}")
            lines += _pile_text(found, obj.meshfree)
            notices = [*whole.notices, *found.notices]
        left = left_out(laplacian, chosen)

        def keep():
            self.begin_notices([obj])
            for line in lines:
                self.note(f"{obj.name}: {line}", obj)
            for notice in [*left, *notices]:
                self.warn(notice, obj)
            return f"{np.count_nonzero(chosen):,} points, {lines[0]}. All figures are in the sidebar (N), Mesh-Free"

        return keep


def volume_base(context, obj):
    """Return what the settings of an object name to measure volumes over, as its points are read; None for the rim."""
    kept, location = obj.meshfree, np.array(obj.matrix_world.translation)
    if kept.volume_over == "LEVEL":
        return Base(np.array([0.0, 0.0, kept.volume_height]) - location, UP)
    if kept.volume_over == "OBJECT":
        return Base(*plane_of(context.scene, kept.volume_plane, obj))
    if kept.volume_over == "POINTS":
        other = object_of(context.scene, kept.volume_plane, "whose points are meant")
        with naming(other.name):
            if other == obj:
                raise PointCloudError("Volumes are measured over the points of another object. Choose one.")
            reason = obstacle(other)
            if reason:
                raise PointCloudError(reason)
            _, ground = operator_reader(context, other)
        return Base(np.zeros(3), UP, ground, location - np.array(other.matrix_world.translation))
    return None


def measured(laplacian, chosen, base, progress) -> Measured:
    """Measure the points of a part, (n,) bool, at least one of which the operator has.

    `base` is what volumes are measured over, None for the plane through the rim.
    """
    measure = lambda: core.measure.measure_region(laplacian, chosen, progress=progress)  # noqa: E731
    region = laplacian.kept.result("region", measure, chosen)
    known = chosen & (laplacian.component >= 0)
    sizes = np.ptp(laplacian.surface_points[known], axis=0)
    curvature = laplacian.kept.result("curvature", lambda: core.measure.mean_curvature(laplacian))[known]
    areas, most = laplacian.areas[known], curvature[np.abs(curvature).argmax()]
    piles, notices = (None, None, None), []
    try:
        pile = pile_over(laplacian, chosen, base, progress)
    except core.InvalidPointsError as error:
        notices = [f"{error} Its volume over {'the rim' if base is None else 'that'} was not measured."]
    else:
        notices = pile.notices
        sides = {"Above the Plane": pile.above, "Below the Plane": pile.below, "Difference": pile.above - pile.below}
        piles = [Figure(title, (volume,), pile.uncertainty, 3) for title, volume in sides.items()]
        if base is None:
            piles[2] = None
    return Measured(
        Figure("Area", (region.area,), region.area_uncertainty, 2),
        Figure("Boundary", (region.boundary_length,), region.length_uncertainty, 1),
        Figure("Size", tuple(sizes.tolist()), 0.0, 1),
        Figure("Mean Curvature", (float(areas @ curvature / areas.sum()),), 0.0, -1),
        Figure("Largest Curvature", (float(most),), 0.0, -1),
        *piles,
        notices,
    )


def left_out(laplacian, chosen) -> list:
    """Return a notice of the points of a part, (n,) bool, that the operator has not."""
    left = np.count_nonzero(chosen & (laplacian.component < 0))
    return [f"{left:,} selected points are left out of the Laplacian, and not measured."] if left else []


def _texts(found):
    """Return measures as lines."""
    return [
        f"Area {_within(area_text, *found.area.values, found.area.uncertainty)}",
        f"Boundary {_within(length_text, *found.boundary.values, found.boundary.uncertainty)}",
        f"Size {' x '.join(map(length_text, found.size.values))} along the axes of the world",
        f"Mean curvature {found.mean_curvature.values[0]:.4g} on average,"
        f" {found.largest_curvature.values[0]:.4g} at most, in 1 / length",
    ]


def _pile_text(found, settings):
    """Return the volumes on both sides of the plane as a line, if they were measured."""
    if found.above is None:
        return []
    (above,), (below,), off = found.above.values, found.below.values, found.above.uncertainty
    if found.net is None:
        return [f"Over the plane of its rim {_within(volume_text, above, off)}, below it {volume_text(below)}"]
    name = f"the height {length_text(settings.volume_height)}"
    if settings.volume_over in {"OBJECT", "POINTS"}:
        name = f'"{settings.volume_plane}"'
    difference = _within(volume_text, found.net.values[0], off)
    return [f"Over {name} {volume_text(above)}, below it {volume_text(below)}, the difference {difference}"]


def _within(text, value, off):
    """Return a number in the scene's units with its uncertainty, as a share of it."""
    return f"{text(value)} ± {100.0 * off / abs(value):.2g} %" if value else f"{text(value)} ± {text(off)}"


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
        ends = selected_ends(obj)
        reading, laplacian = analyzed(context, obj)
        path = path_between(laplacian, ends, lambda *_: None)
        straight = length_text(core.distance.polygon_length(laplacian.points[ends]))
        line = f"{length_text(core.distance.polygon_length(path))} along the surface, {straight} straight"

        def add():
            made = add_curves(obj, f"{obj.name} Path", [(reading.local(path), False)], self.thickness)
            self.begin_notices([obj])
            self.note(f"{obj.name}: {line}", obj)
            return f"{made.name} is {line}"

        return add


TOOLS = (
    Registration(MESHFREE_OT_measure_selection, panel=Row("Measure", 1, 1), menu=Row("Points", 2, 1)),
    Registration(MESHFREE_OT_geodesic_path, panel=Row("Measure", 1, 2), menu=Row("Points", 2, 2)),
)
