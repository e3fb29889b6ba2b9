"""Minimal surfaces with the boundary of an object."""

import bpy
from bpy.props import FloatProperty, IntProperty, StringProperty

from ... import core
from ...core import Cancelled, PointCloudError
from ..objects.groups import FIXED, chosen_members, group_kind, is_chosen
from ..objects.options import default_options, laplacian_options
from ..objects.positions import check_movable, target_property, write_positions
from ..objects.reading import read_points
from ..objects.result import area_text
from ..objects.splats import has_splats
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator, Tool, build_operator
from ..running.discs import disc_finder

HISTORY = "lb_area_history"  # custom property of the object: area after each step


class MinimalSurface(Tool):
    """The settings and the work of `meshfree.minimal_surface`."""

    asks = ("group", "tolerance", "steps", "target")
    adjustable = ("target",)

    group: StringProperty(
        name="Fixed",
        description="Vertex group with the points that stay, every boundary at least; where there is none of that"
        " name, the detected boundaries",
        default=FIXED,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Stops when a step changes the area by a smaller fraction than this",
        default=1e-4,
        min=0.0,
        soft_max=0.01,
        precision=6,
    )
    steps: IntProperty(name="Steps", description="Maximum number of steps", default=100, min=1, soft_max=500)
    target: target_property()

    def plan(self, context, obj):
        check_movable(obj, self.target)
        reading = read_points(context, obj)
        options, motion = laplacian_options(obj.meshfree), default_options(obj.meshfree)
        fixed = reading.boundary
        if is_chosen(obj, self.group, FIXED):
            fixed = chosen_members(obj, self.group, "Fixed")
        tolerance, steps, name = self.tolerance, self.steps, obj.name
        kind, find_discs, carries = group_kind(obj), disc_finder(obj, reading), has_splats(obj.data)

        def compute(progress):
            boundary = fixed
            if boundary is None:
                boundary = build_operator(reading, options, progress).laplacian.boundary
                if not boundary.any():
                    raise PointCloudError(
                        f'"{name}" has no boundary, so that its surface would shrink to nothing. Assign the points'
                        f' that stay to the {kind} "{FIXED}".'
                    )
            settings = (reading.points, boundary, tolerance, steps, motion)
            film = cache.fetch(cache.content("film", *settings), lambda: _shrink(*settings, progress))
            gradients = None
            if carries:
                laplacian = build_operator(reading, options, progress).laplacian
                gradients = core.deformation_gradients(laplacian, film.points)
            return reading, film, gradients, find_discs(film.points, film.points)

        return compute

    def write(self, context, obj, result):
        reading, film, gradients, discs = result
        if film.steps:
            write_positions(obj, reading, film.points, self.target, "Minimal Surface", gradients, discs)
        obj[HISTORY] = film.area_history.tolist()
        area = film.area_history[-1] if film.steps else film.initial_area
        areas = f"from {area_text(film.initial_area)} to {area_text(float(area))}"
        return [*film.notices, f"{obj.name}: area {areas} in {film.steps} steps ({film.reason})"]


class MESHFREE_OT_minimal_surface(MinimalSurface, ApplicationOperator, bpy.types.Operator):
    """Move the points to the surface of least area with their boundary"""

    bl_idname = "meshfree.minimal_surface"
    bl_label = "Minimal Surface"


def _shrink(points, boundary, tolerance, steps, options, progress):
    """Compute the minimal surface of a boundary, with the fraction of the steps as progress."""
    count = 0

    def stepped(step, points, area):
        nonlocal count
        count = step

    def report(stage, fraction):
        progress("Steps", min(1.0, (count + fraction) / steps))

    film = core.minimal_surface(
        points,
        boundary,
        epsilon=tolerance,
        max_steps=steps,
        options=options,
        callback=stepped,
        progress=report,
    )
    if film.reason == "cancelled":  # it must not be cached
        raise Cancelled
    return film


TOOLS = (
    Registration(
        MESHFREE_OT_minimal_surface, panel=Row("Minimal Surface", 1, 1), menu=Row("Object", 11, 1), verb=MinimalSurface
    ),
)
