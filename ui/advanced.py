"""The panel Advanced: fields and signatures, the spectrum, and the settings that change results."""

import bpy

from ..operators.objects.reading import obstacle
from ..operators.objects.result import read_eigenvalues
from ..tools.groups import BOUNDARY_GROUP, FIXED, HIGH, LOW, SOURCE, VALUE
from ..tools.quantities import eigenvector_name
from .dialogs import draw_setting
from .display import shown_attribute
from .groups import draw_groups
from .panel import PropertiesPanel, ReadyPanel, ToolPanel
from .wrapping import draw_text, split_properties, split_where_it_fits

_LISTED = 20  # eigenvalues in the panel
_SETTINGS = {  # of each method, in groups
    "DEFAULT": (
        ("boundary", "boundary_group", "sheets", "projection"),
        ("bandwidth", "neighbors", "bandwidth_factor"),
    ),
    "PAPER": (("areas", "normals", "regularization"), ("neighbors", "denoise")),
}
_READING = ("point_budget", "most_points"), ("use_modifiers", "make_single_user")


class MESHFREE_PT_advanced(ToolPanel, bpy.types.Panel):
    """Distances and other fields on the surface, signatures, modes, and settings"""

    bl_label = "Advanced"
    bl_order = 8

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object, ("OBJECT", "EDIT"))  # where points are assigned to the groups

    def draw_more(self, layout, context):
        draw_groups(layout, context.object, SOURCE, LOW, HIGH, VALUE, FIXED)


class AdvancedPanel(ReadyPanel):
    """A panel in the panel Advanced."""

    bl_parent_id = "MESHFREE_PT_advanced"


class MESHFREE_PT_spectrum(AdvancedPanel, bpy.types.Panel):
    """Vibration modes and their eigenvalues"""

    bl_label = "Spectrum"

    def draw(self, context):
        layout, obj = self.layout, context.object
        row = layout.row(align=True)
        row.operator("meshfree.spectrum").count = obj.meshfree.modes
        row.prop(obj.meshfree, "modes")
        eigenvalues = read_eigenvalues(obj)
        if not len(eigenvalues):
            return
        layout.label(text="Eigenvalues")
        row = layout.row(align=True)
        row.prop(obj.meshfree, "plot_eigenvalues", toggle=True)
        column = row.row(align=True)
        column.active = obj.meshfree.plot_eigenvalues
        column.prop(obj.meshfree, "compare_weyl", toggle=True)
        shown = shown_attribute(obj)
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for mode, eigenvalue in enumerate(eigenvalues[:_LISTED], start=1):
            shown_value = eigenvalue if eigenvalue > 1e-9 * eigenvalues[-1] else 0.0  # 0 up to rounding
            text, name = f"{mode}:  {shown_value:.4g}", eigenvector_name(mode)
            if name in obj.data.attributes:
                grid.operator("meshfree.colormap", text=text, depress=name == shown).attribute = name
            else:
                grid.label(text=text)
        if len(eigenvalues) > _LISTED:
            more = f"and {len(eigenvalues) - _LISTED} more, up to {eigenvalues[-1]:.4g}"
            draw_text(layout, context, more)


class Settings:
    """The base of panels with the settings."""

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object, ("OBJECT", "EDIT"))

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        row.menu("MESHFREE_MT_presets", text=bpy.types.MESHFREE_MT_presets.bl_label)
        row.operator("meshfree.add_preset", text="", icon="ADD")
        row.operator("meshfree.add_preset", text="", icon="REMOVE").remove_active = True
        split_properties(layout, context)
        obj = context.object
        for group in (("laplacian",), *_SETTINGS[obj.meshfree.laplacian], *_READING):
            column = layout.column(align=True)
            for name in group:
                row = column.row(align=True)
                row.active = _counts(obj.meshfree, name)
                split_where_it_fits(row, context, obj.meshfree.bl_rna.properties[name])
                draw_setting(row, obj.meshfree, name, obj)
        draw_groups(layout, obj, BOUNDARY_GROUP)


class MESHFREE_PT_settings(Settings, AdvancedPanel, bpy.types.Panel):
    """Settings that change results"""

    bl_label = "Settings"


class MESHFREE_PT_settings_properties(Settings, PropertiesPanel, bpy.types.Panel):
    """Settings that change results, beside those of the object"""

    bl_label = "Mesh-Free Settings"


def _counts(settings, name):
    """Whether a setting has an effect with the present others."""
    if name == "boundary":
        return not settings.boundary_group  # a named one is not detected
    return name != "most_points" or settings.point_budget == "NUMBER"


CLASSES = (
    MESHFREE_PT_advanced,
    MESHFREE_PT_spectrum,
    MESHFREE_PT_settings,
    MESHFREE_PT_settings_properties,
)
