"""Makes a curve object of the displayed iso lines."""

import bpy
import numpy as np
from bpy.props import FloatProperty, IntProperty

from .. import core
from ..operators.objects.attributes import own_positions, read_attribute
from ..operators.objects.curves import add_curves
from ..operators.registration import Registration, Row
from ..operators.running.application import ApplicationOperator, operator_reader
from ..tools.mesh_surface import carried_mesh
from .display import component, label, shown_attribute, shown_range, sloping, step_colors

_COUNT = 10  # of lines, where none are shown
_UNKNOWN = 1e-6  # fraction of points without a value above which a vertex has none


class MESHFREE_OT_iso_lines_to_curves(ApplicationOperator, bpy.types.Operator):
    """Make a curve object of the displayed iso lines"""

    bl_idname = "meshfree.iso_lines_to_curves"
    bl_label = "Iso Lines to Curves"
    adjustable = ("count", "thickness")
    at_zero = {"count": "As Shown"}
    only_active = True

    count: IntProperty(
        name="Iso Lines",
        description="Number of lines, in the middle of as many even steps of the color range; 0 for as many as are"
        f" shown, or {_COUNT} where none are",
        default=0,
        min=0,
        soft_max=50,
        max=1000,
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Radius of tubes along the lines; with 0 they are seen in viewports only",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )

    def becomes_single(self, obj):
        return False  # its mesh is not changed

    def plan(self, context, obj):
        count = self.count or obj.meshfree.iso_lines or _COUNT
        name, values, (low, high) = _shown(obj)
        levels = low + (np.arange(count) + 0.5) / count * (high - low)
        surface = (
            _on_faces(obj, values) if obj.type == "MESH" and obj.data.polygons else _on_points(context, obj, values)
        )

        def compute(progress):
            vertices, faces, carried = surface(progress)
            lines = core.measure.iso_lines(vertices, faces, carried, levels)
            if not lines:
                raise core.PointCloudError(
                    f"{label(name)} has no lines at {count} values from {levels[0]:g} to {levels[-1]:g}. Extend"
                    " the range to the values, or raise the number of lines."
                )
            return lines

        return compute

    def write(self, context, obj, result):
        lines = [(line.points, line.closed) for line in result]
        made = add_curves(obj, f"{obj.name} Iso Lines", lines, self.thickness)
        levels = len({line.level for line in result})
        return [f"{made.name}: {len(result):,} lines at {levels:,} values of {label(shown_attribute(obj))}"]


def _shown(obj):
    """Read the displayed attribute of an object: name, numbers, NaN for unknown ones, and range."""
    name, bounds = shown_attribute(obj), shown_range(obj)
    if bounds is None or step_colors(obj):
        raise core.PointCloudError(
            f'"{obj.name}" shows no numbers that change along the surface. Show such an attribute, or one component of'
            " a vector, under Show first."
        )
    values = read_attribute(obj.data, name)
    (shown,) = sloping(
        name, values if values.dtype.kind == "f" else values.astype(float), component(name, obj.meshfree)
    )
    return name, shown, bounds


def _on_faces(obj, values):
    """Return a function that gives vertices, triangles and values on them."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    found = own_positions(mesh), triangles.reshape(-1, 3), values
    return lambda progress: found


def _on_points(context, obj, values):
    """Return a function that gives vertices, faces and values of a mesh reconstructed from the points."""
    reading, operator = operator_reader(context, obj)

    def compute(progress):
        mesh, carrying = carried_mesh(operator(progress), 1.0, progress)
        known, count = np.isfinite(values), len(mesh.vertices)
        carried = carrying.interpolate(np.where(known, values, 0.0))[-count:]
        if not known.all():
            carried[carrying.interpolate(np.where(known, 0.0, 1.0))[-count:] > _UNKNOWN] = np.nan
        return reading.local(mesh.vertices), mesh.faces, carried

    return compute


TOOLS = (Registration(MESHFREE_OT_iso_lines_to_curves, menu=Row("Object", 2, 2)),)
