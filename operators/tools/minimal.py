"""Minimal surfaces with the boundary of an object."""

import bpy
from bpy.props import FloatProperty, IntProperty, StringProperty

from ... import core
from ...command import minimal
from ...tools.groups import FIXED
from ..objects.groups import chosen_members, group_kind, is_chosen
from ..objects.options import default_options, laplacian_options
from ..objects.positions import check_movable, target_property, write_positions
from ..objects.reading import read_points
from ..objects.result import area_text
from ..objects.splats import has_splats
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator, Tool, build_operator
from ..running.discs import disc_finder


class MinimalSurface(Tool):
    """The settings and the work of `meshfree.minimal_surface`."""

    asks = ("group", "tolerance", "steps", "target")
    adjustable = ("target",)

    group: StringProperty(name="Fixed", **minimal.MINIMAL["group"].keywords)
    tolerance: FloatProperty(name="Tolerance", soft_max=0.01, precision=6, **minimal.MINIMAL["tolerance"].keywords)
    steps: IntProperty(name="Steps", soft_max=500, **minimal.MINIMAL["steps"].keywords)
    target: target_property()

    def plan(self, context, obj):
        check_movable(obj, self.target)
        reading = read_points(context, obj)
        options, motion = laplacian_options(obj.meshfree), default_options(obj.meshfree)
        fixed = reading.boundary
        if is_chosen(obj, self.group, FIXED):
            fixed = chosen_members(obj, self.group, "Fixed")
        tolerance, steps, name = self.tolerance, self.steps, obj.name
        kind, find_discs, carries = group_kind(obj), disc_finder(obj), has_splats(obj.data)

        def compute(progress):
            boundary = fixed
            if boundary is None:
                boundary = build_operator(reading, options, progress).laplacian.boundary
                minimal.check_boundary(boundary, kind, name)
            settings = (reading.points, boundary, tolerance, steps, motion)
            film = cache.fetch(cache.content("film", *settings), lambda: minimal.shrink(*settings, progress))
            gradients = None
            if carries:
                laplacian = build_operator(reading, options, progress).laplacian
                gradients = core.deform.deformation_gradients(laplacian, film.points)
            return reading, film, gradients, find_discs(reading, film.points, film.points)

        return compute

    def write(self, context, obj, result):
        reading, film, gradients, discs = result
        if film.steps:
            write_positions(obj, reading, film.points, self.target, "Minimal Surface", gradients, discs)
        obj[minimal.HISTORY] = film.area_history.tolist()
        return [*film.notices, minimal.film_line(film, obj.name, area_text)]


class MESHFREE_OT_minimal_surface(MinimalSurface, ApplicationOperator, bpy.types.Operator):
    """Move the points to the surface of least area with their boundary"""

    bl_idname = "meshfree.minimal_surface"
    bl_label = "Minimal Surface"


TOOLS = (Registration(MESHFREE_OT_minimal_surface, panel=Row("Minimal Surface", 1, 1), menu=Row("Object", 11, 1)),)
