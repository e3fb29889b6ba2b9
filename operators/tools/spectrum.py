"""Vibration modes of the active object's points."""

import bpy
from bpy.props import IntProperty

from ...tools.quantities import eigenvector_name
from ..registration import Registration, Row
from .analyze import AnalysisOperator


class MESHFREE_OT_spectrum(AnalysisOperator, bpy.types.Operator):
    """Compute the lowest vibration modes of the surface, and its areas and normals where they are not up to date"""

    bl_idname = "meshfree.spectrum"
    bl_label = "Compute Modes"

    count: IntProperty(
        name="Modes",
        description="How many modes to compute, the constant one included",
        default=30,
        min=1,
        soft_max=100,
    )

    @property
    def wanted(self):
        """How many modes to compute."""
        return self.count

    @property
    def shown(self):
        """Name of the attribute: the first mode that is not constant."""
        return eigenvector_name(min(2, self.count))


TOOLS = (Registration(MESHFREE_OT_spectrum, menu=Row("Object", 1, 4)),)
