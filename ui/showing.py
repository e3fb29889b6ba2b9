"""The panel Show: the list of results, and how the one on show is drawn."""

import bpy

from ..operators.objects.attributes import DISC, STORABLE, mode_number
from ..operators.objects.colors import own_colors, own_material, shows_own_material
from ..operators.objects.modifiers import has_input, input_property
from ..operators.objects.reading import obstacle
from ..tools.quantities import APPLICATIONS, EIGENVECTOR, RESULTS, eigenvector_name, quantity
from .display import (
    draws_discs,
    find_display,
    label,
    range_node,
    shown_attribute,
    shows_zeros,
    step_colors,
)
from .legend import find_legend
from .nodes import LENGTH, MOST
from .panel import PropertiesPanel, SidebarPanel
from .scale import shown_scale
from .wrapping import draw_text, split_properties

_TRUE_COLORS = ("Standard", "Raw")  # view transforms that leave colors as they are, more or less


class MESHFREE_MT_results(bpy.types.Menu):
    """Results that can be shown as colors on the points"""

    bl_label = "Results"
    bl_options = {"SEARCH_ON_KEY_PRESS"}

    def draw(self, context):
        layout, obj = self.layout, context.object
        shown, attributes = shown_attribute(obj), obj.data.attributes
        colors, material = own_colors(obj.data), own_material(obj)
        if colors:
            _draw_choice(layout, "Color", colors, shown)
        if material is not None and find_display(obj) is not None:
            layout.operator("meshfree.own_material", icon=_mark(shows_own_material(obj)))
        if colors or material is not None:
            layout.separator()
        for names in (RESULTS, APPLICATIONS):
            for name in names:
                if name in attributes:
                    _draw_choice(layout, label(name), name, shown)
            layout.separator()
        if eigenvector_name(1) in attributes:
            layout.menu("MESHFREE_MT_modes")
        if _other_attributes(obj.data):
            layout.menu("MESHFREE_MT_attributes")
        if RESULTS[0] not in attributes:
            layout.label(text="More come with Analyze Points and other tools")


class MESHFREE_MT_modes(bpy.types.Menu):
    """Vibration modes that can be shown as colors on the points"""

    bl_label = "Modes"

    def draw(self, context):
        names = sorted(name for name in context.object.data.attributes.keys() if name.startswith(EIGENVECTOR))
        grid = self.layout.grid_flow(columns=1 + len(names) // 20)
        for name in names:
            _draw_choice(grid, label(name), name, shown_attribute(context.object))


class MESHFREE_MT_attributes(bpy.types.Menu):
    """Other numbers of the points that can be shown as colors, such as classes and intensities of a laser scan"""

    bl_label = "Attributes"
    bl_options = {"SEARCH_ON_KEY_PRESS"}

    def draw(self, context):
        obj = context.object
        for name in _other_attributes(obj.data):
            _draw_choice(self.layout, name, name, shown_attribute(obj))


def _other_attributes(data) -> list[str]:
    """Names of the numbers and vectors of points that neither Blender nor this extension made."""
    return [
        attribute.name
        for attribute in data.attributes
        if attribute.domain == "POINT"
        and attribute.data_type in STORABLE
        and not attribute.name.startswith((".", "lb_"))
        and not attribute.is_required
    ]


def _draw_choice(layout, text, name, shown):
    layout.operator("meshfree.colormap", text=text, icon=_mark(name == shown)).attribute = name


def _mark(on):
    return "RADIOBUT_ON" if on else "RADIOBUT_OFF"


class Display:
    """The base of panels about colors."""

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object, ("OBJECT", "EDIT"))  # colors help to choose points there

    def draw(self, context):
        _draw_choices(self.layout, context.object)
        for name, draw in _PARTS.items():
            head, body = self.layout.panel(f"meshfree_{name}", default_closed=True)
            head.label(text=name)
            if body is not None:
                split_properties(body, context)
                draw(body, context, context.object)


class MESHFREE_PT_display(Display, SidebarPanel, bpy.types.Panel):
    """What is shown as colors on the points"""

    bl_label = "Show"
    bl_parent_id = "MESHFREE_PT_main"
    bl_order = 1


class MESHFREE_PT_display_properties(Display, PropertiesPanel, bpy.types.Panel):
    """What is shown as colors on the points, beside the settings of the object"""

    bl_label = "Mesh-Free Display"


def _draw_choices(layout, obj):
    """Draw the list of results, buttons for the modes before and after the displayed one, and one for a new range."""
    shown, attributes = shown_attribute(obj), obj.data.attributes
    row = layout.row(align=True)
    colored = shown and shown == own_colors(obj.data)
    row.menu("MESHFREE_MT_results", text="Color" if colored else label(shown) if shown else "Choose a Result")
    mode = mode_number(shown) or 1
    for step, icon in ((-1, "TRIA_LEFT"), (1, "TRIA_RIGHT")):
        name = eigenvector_name(mode + step)
        column = row.row(align=True)
        column.enabled = name in attributes
        column.operator("meshfree.colormap", text="", icon=icon).attribute = name
    column = row.row(align=True)
    column.enabled = shown in attributes
    column.operator("meshfree.colormap", text="", icon="FILE_REFRESH")


def _draw_range(layout, context, obj):
    """Draw the settings of colors for numbers, and of vectors."""
    settings, shown, attributes = obj.meshfree, shown_attribute(obj), obj.data.attributes
    if shown in attributes and attributes[shown].data_type == "FLOAT_VECTOR":
        layout.prop(settings, "component")
        if quantity(shown).along_surface:
            layout.prop(settings, "strokes")
            if has_input(find_display(obj).node_group, LENGTH):
                layout.prop(*input_property(find_display(obj), LENGTH), text=LENGTH)
    if range_node(obj) is None:
        return
    column = layout.column(align=True)
    column.prop(settings, "color_map")
    column.prop(settings, "reverse")
    column = layout.column(align=True)
    column.prop(settings, "range_mode")
    if settings.range_mode in {"AUTO", "PERCENTILE", "SYMMETRIC"}:
        column.prop(settings, "coverage")
    if shows_zeros(obj):
        draw_text(column, context, "All values are zero", "INFO")
    elif settings.range_mode == "LOCKED" or not step_colors(obj):
        bounds = column.column(align=True)
        bounds.enabled = settings.range_mode == "LOCKED"  # in other modes they show the resulting range
        bounds.prop(settings, "range_low")
        bounds.prop(settings, "range_high")
    column = layout.column(align=True)
    column.prop(settings, "outside")
    if not step_colors(obj):
        column.prop(settings, "iso_lines")
        column.operator("meshfree.iso_lines_to_curves")
    layout.operator("meshfree.select_by_range")


def _draw_points(layout, _context, obj):
    """Draw the settings of discs and dots."""
    settings, display = obj.meshfree, find_display(obj)
    layout.prop(settings, "show_groups")
    if display is None:
        return
    if DISC in obj.data.attributes:
        layout.prop(settings, "point_shape")
        layout.prop(settings, "smooth")
        layout.prop(settings, "dim_back")
    layout.prop(settings, "shaded", slider=True)
    layout.prop(settings, "point_size")
    if not draws_discs(obj):
        layout.prop(*input_property(display, MOST), text=MOST)


def _draw_legend(layout, context, obj):
    """Draw the settings of the legend, and the view transform where it changes colors."""
    if find_display(obj) is None or shown_scale(obj, context.scene) is None:
        return
    column = layout.column(align=True, heading="Show")
    column.prop(obj.meshfree, "legend")
    column.prop(obj.meshfree, "histogram")
    shows_legend = find_legend(context.scene, obj) is not None
    layout.operator("meshfree.legend", depress=shows_legend).show = not shows_legend
    if context.scene.view_settings.view_transform not in _TRUE_COLORS:
        draw_text(layout, context, "Colors differ from the legend:", "INFO")
        layout.prop(context.scene.view_settings, "view_transform")


_PARTS = {"Range and Lines": _draw_range, "Points": _draw_points, "Legend": _draw_legend}
CLASSES = (
    MESHFREE_MT_results,
    MESHFREE_MT_modes,
    MESHFREE_MT_attributes,
    MESHFREE_PT_display,
    MESHFREE_PT_display_properties,
)
