"""Principal curvatures and directions, shape index, curvedness and roughness."""

from dataclasses import replace

import bpy
from bpy.props import EnumProperty, FloatProperty

from ... import core
from ...command.quantities import (
    CURVATURE_1,
    CURVATURE_2,
    CURVEDNESS,
    DIRECTION_1,
    ROUGHNESS,
    SHAPE_INDEX,
    quantity,
    rows_of,
    written_by,
)
from ...command.results import ROUGHNESS as ROUGHNESS_SETTINGS
from ...command.results import check_wavelength, curvature_line, roughness_line
from ..objects.attributes import tag_changed, write_attribute
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader

_SHOWN = {
    "SHAPE_INDEX": ("Shape Index", SHAPE_INDEX),
    "CURVEDNESS": ("Curvedness", CURVEDNESS),
    "GREATEST": ("Greatest Curvature", CURVATURE_1),
    "LEAST": ("Least Curvature", CURVATURE_2),
    "DIRECTION": ("Direction", DIRECTION_1),
}


class Curvatures(Tool):
    """The settings and the work of `meshfree.principal_curvatures`."""

    writes = written_by("principal_curvatures")
    asks = adjustable = ("display", "show")

    display: EnumProperty(
        name="Display",
        description="Which of the results is shown as colors",
        items=[(key, title, quantity(name).tooltip) for key, (title, name) in _SHOWN.items()],
        default="SHAPE_INDEX",
    )

    @property
    def shown(self):
        return _SHOWN[self.display][1]

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)

        def compute(progress):
            laplacian = operator(progress)
            progress("Curvature", 0.9)
            found = cache.result(laplacian, "principal", compute=lambda: core.measure.principal_curvatures(laplacian))
            return replace(found, direction=reading.local_directions(found.direction))

        return compute

    def write(self, context, obj, result):
        for row in rows_of("principal_curvatures"):
            write_attribute(obj.data, row.attribute, row.of(result))
        tag_changed(obj.data)
        return [*result.notices, f"{obj.name}: {curvature_line(result)}"]


class MESHFREE_OT_principal_curvatures(Curvatures, ShownOperator, bpy.types.Operator):
    """Compute principal curvatures and directions, shape index and curvedness"""

    bl_idname = "meshfree.principal_curvatures"
    bl_label = "Principal Curvatures"


class Roughness(Tool):
    """The settings and the work of `meshfree.roughness`."""

    writes = (ROUGHNESS,)
    asks = ("wavelength", "show")
    at_zero = {"wavelength": "Automatic"}

    wavelength: FloatProperty(
        name="Wavelength",
        subtype="DISTANCE",
        **ROUGHNESS_SETTINGS["wavelength"].keywords,
    )

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        wavelength = self.wavelength or None
        name = obj.name

        def compute(progress):
            laplacian = operator(progress)
            check_wavelength(wavelength or 0.0, reading.points, name)
            return cache.result(
                laplacian,
                "roughness",
                wavelength,
                compute=lambda: core.clean.roughness(laplacian, wavelength, progress=progress),
            )

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, ROUGHNESS, result)
        tag_changed(obj.data)
        return [f"{obj.name}: {roughness_line(result, length_text)}"]


class MESHFREE_OT_roughness(Roughness, ShownOperator, bpy.types.Operator):
    """Measure the signed height of points above the smoothed surface"""

    bl_idname = "meshfree.roughness"
    bl_label = "Roughness"


TOOLS = (
    Registration(
        MESHFREE_OT_principal_curvatures,
        panel=Row("Measure", 1, 1),
        menu=Row("Object", 3, 1),
        quick=Row("Object", 1, 3, "Curvature"),
    ),
    Registration(MESHFREE_OT_roughness, panel=Row("Measure", 1, 2), menu=Row("Object", 3, 2)),
)
