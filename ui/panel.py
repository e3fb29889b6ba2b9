"""The panel in the sidebar of the 3D view, tab "Mesh-Free"."""

import bpy

from ..operators import registration
from ..operators.deform.handles import handled_object
from ..operators.objects.attributes import DISC, mode_number, point_count
from ..operators.objects.colors import own_colors, own_material, shows_own_material
from ..operators.objects.modifiers import has_input, input_property, is_own, is_sequence
from ..operators.objects.reading import TYPES, obstacle, sharing_objects
from ..operators.objects.result import area_text, is_analyzed, is_stale, is_trusted, read_eigenvalues
from ..operators.objects.splats import LEFT_BEHIND, are_left_behind, has_splats, holds_columns
from ..operators.running.application import ApplicationOperator
from ..operators.running.job import running
from ..tools.quantities import APPLICATIONS, DEVIATION, RESULTS, eigenvector_name, quantity
from .dialogs import draw_setting
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
from .scale import shown_scale
from .wrapping import beside_or_below, draw_text, split_properties

_LISTED = 20  # eigenvalues in the panel
_NOTICES = 6  # shown at a time
_CROSS = 44.0  # width of the dismiss button of a notice, and of the box around it
_TRUE_COLORS = ("Standard", "Raw")  # view transforms that leave colors as they are, more or less
_EDITING = "Choose points here, in Edit Mode. Switch to Object Mode to analyze"
_SETTINGS = {  # of each method, in groups
    "DEFAULT": (
        ("boundary", "boundary_group", "sheets", "projection"),
        ("bandwidth", "neighbors", "bandwidth_factor"),
    ),
    "PAPER": (("areas", "normals", "regularization"), ("neighbors", "denoise")),
}
_BUDGET = "point_budget", "most_points"


class SidebarPanel:
    """A panel in the tab of the extension."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Mesh-Free"


class ReadyPanel(SidebarPanel):
    """A panel below the main one, for objects that can be analyzed."""

    bl_parent_id = "MESHFREE_PT_main"

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object)


class PropertiesPanel:
    """A panel in the Object tab of the Properties editor, with the contents of one in the sidebar."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}


class MESHFREE_PT_main(SidebarPanel, bpy.types.Panel):
    """The object, and the button that analyzes it"""

    bl_label = "Mesh-Free Laplacian"

    def draw(self, context):
        layout = self.layout
        obj = context.object
        job = running()
        if job is not None:
            _draw_job(layout, context, job)
        reason = obstacle(obj)
        handled = handled_object(obj, context.scene)
        if reason and handled != obj:
            column = layout.column(align=True)
            draw_text(column, context, f'Handle of "{handled.name}"', "OUTLINER_OB_EMPTY")
            draw_text(column, context, "G moves it, R rotates it", "BLANK1")
            return  # more is in the panel of the deformation
        if obj is not None and obj.type == "ARMATURE":
            _draw_followers(layout, context)
            return
        if reason:
            column = layout.column(align=True)
            for sentence in (reason if obstacle(obj, ("EDIT",)) else _EDITING).split(". "):
                draw_text(column, context, sentence)
            _draw_notices(layout, context, obj)
            if obj is not None and any(map(is_sequence, obj.modifiers)):
                layout.operator("meshfree.analyze_sequence", text="Analyze Sequence...", icon="SEQUENCE")
            elif context.mode == "OBJECT":
                layout.operator("meshfree.import_points", text="Import Points...", icon="IMPORT")
                layout.operator("meshfree.import_tiles", text="Import Tiles...")
            return
        _draw_look(layout, obj)
        _draw_summary(layout, context, obj)
        _draw_notices(layout, context, obj)
        if has_splats(obj.data):
            _draw_splats(layout, context, obj)
        row = beside_or_below(layout, context, "Analyze Points", "Modes 100")
        row.operator("meshfree.analyze").modes = obj.meshfree.modes
        row.prop(obj.meshfree, "modes")
        if is_analyzed(obj):
            _draw_result(layout, context, obj.meshfree)
            if is_stale(obj, glance=True):
                draw_text(layout, context, "Results are stale: analyze again", "ERROR")
        _draw_compared(layout, context, obj)
        draw_tasks(layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True))


def draw_tools(layout, home):
    """Draw the tools of a panel by group; dots in a name mean that the tool opens a dialog."""
    for group in registration.groups("panel", home):
        column = layout.column(align=True)
        for tool in group:
            operator = tool.operator
            asks = issubclass(operator, ApplicationOperator) and operator.asks
            column.operator(operator.bl_idname, text=tool.panel.text or f"{operator.bl_label}{'...' if asks else ''}")


def draw_tasks(layout):
    """Draw the quick tools, which run with defaults."""
    for group in registration.groups("quick", "Object"):
        for tool in group:
            layout.operator(tool.operator.bl_idname, text=tool.quick.text).at_once = True


def _draw_job(layout, context, job):
    """Draw the running job, its progress, and the button that stops it."""
    column = layout.column(align=True)
    draw_text(column, context, f"{job.label} (Esc to Stop)")
    row = column.row(align=True)
    row.progress(text=f"{job.stage}: {job.fraction:.0%}", factor=job.fraction)
    row.operator("meshfree.stop", text="", icon="X")


def _draw_compared(layout, context, obj):
    """Draw what an object was compared with, and the button that exchanges both."""
    kept = obj.meshfree
    if kept.compared_with is None or DEVIATION not in obj.data.attributes:
        return
    hidden = ", which is hidden" if kept.compared_with.hide_get() else ""
    column = layout.column(align=True)
    draw_text(column, context, f"{obj.name} compared with {kept.compared_with.name}{hidden}", "INFO")
    swap = column.operator("meshfree.compare_swap", text="Swap")
    swap.greatest, swap.distance = kept.compared_within, "NEAREST" if kept.compared_nearest else "NORMAL"


def _draw_followers(layout, context):
    """Draw the selected objects whose points may follow the active armature, with their notices."""
    chosen = [other for other in context.selected_objects if other.type in TYPES]
    if not chosen:
        draw_text(layout, context, "Select points, too: Rig lets them follow the bones", "OUTLINER_OB_ARMATURE")
    for other in chosen:
        column = layout.column()
        column.context_pointer_set("object", other)  # whose notices are dismissed
        draw_text(column, context, _counted(other), f"OUTLINER_OB_{other.type}")
        _draw_notices(column, context, other)


def _draw_notices(layout, context, obj):
    """Draw the notices of an object, each with a button that dismisses it."""
    notices = obj.meshfree.notices if obj is not None else ()
    if not len(notices):
        return
    box = layout.box().column()
    for index, notice in list(enumerate(notices))[:_NOTICES]:
        row = box.row(align=True)
        icon = "ERROR" if notice.level == "WARNING" else "INFO"
        draw_text(row, context, f"{notice.tool}: {notice.text}", icon, taken=_CROSS)
        row.operator("meshfree.dismiss", text="", icon="X").index = index
    if len(notices) > _NOTICES:
        draw_text(box, context, f"and {len(notices) - _NOTICES} more, seen when these are dismissed")
    if len(notices) > 1:
        box.operator("meshfree.dismiss", text="Dismiss All").index = -1


def _draw_result(layout, context, result):
    """Draw the total area, and where not trivial the trusted part and numbers of components and of kinds of points."""
    lines = [("Total Area", area_text(result.total_area))]
    if result.is_property_set("trusted_area") and not is_trusted(result):  # it is not in files of earlier versions
        lines.append(("Trusted Area", area_text(result.trusted_area)))
    if result.subset_count:
        lines.append(("Analyzed Points", f"{result.subset_count:,}"))
    if result.component_count > 1:
        lines.append(("Components", f"{result.component_count:,}"))
    if result.boundary_count:
        lines.append(("Boundary Points", f"{result.boundary_count:,}"))
    if result.left_out_count:
        lines.append(("Points Left Out", f"{result.left_out_count:,}"))
    column = layout.column(align=True)
    for name, value in lines:
        row = beside_or_below(column, context, name, value)
        row.label(text=name)
        row.label(text=value)
    if result.left_out_count:
        layout.operator("meshfree.select_left_out").edit_mode = True


def _counted(obj):
    """Return the name of an object, and how many points or splats it has."""
    return f"{obj.name}: {point_count(obj.data):,} {'splats' if has_splats(obj.data) else 'points'}"


def _draw_look(layout, obj):
    """Draw the button by which loose points are seen as what they are, such as those of Blender's own importers."""
    data = obj.data
    if holds_columns(data):
        layout.operator("meshfree.show_splats", icon="SHADING_RENDERED")
    elif not has_splats(data) and DISC not in data.attributes and not (obj.type == "MESH" and data.polygons):
        layout.operator("meshfree.show_surface", icon="SHADING_SOLID")


def _draw_summary(layout, context, obj):
    mesh = obj.data
    column = layout.column(align=True)
    draw_text(column, context, _counted(obj), f"OUTLINER_OB_{obj.type}")
    if obj.type == "MESH" and mesh.polygons:
        draw_text(column, context, f"Faces not used: {len(mesh.polygons):,}", "INFO")
    scale = obj.matrix_world.to_scale()
    if max(abs(factor - 1.0) for factor in scale) > 1e-5:
        shown = ", ".join(f"{factor:.4g}" for factor in scale)
        draw_text(column, context, f"Object scale ({shown}) is applied to lengths and areas", "INFO")
    modifiers = [modifier for modifier in obj.modifiers if not is_own(modifier)]
    if modifiers:
        what = "used" if obj.meshfree.use_modifiers else "left out"
        draw_text(column, context, f"Modifiers {what}: {len(modifiers)}", "MODIFIER")
        column.prop(obj.meshfree, "use_modifiers")
    if sharing_objects(obj):
        draw_text(column, context, "Other objects share this mesh", "INFO")
        column.prop(obj.meshfree, "make_single_user")


def _draw_splats(layout, context, obj):
    """Draw the tools for Gaussian splats."""
    if are_left_behind(obj.data, glance=True):
        draw_text(layout, context, LEFT_BEHIND[0].upper() + LEFT_BEHIND[1:], "ERROR")
    draw_tools(layout, "Splats")
    layout.prop(obj.meshfree, "leave_out_floaters")


class Settings:
    """The base of panels with the settings."""

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object)

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        row.menu("MESHFREE_MT_presets", text=bpy.types.MESHFREE_MT_presets.bl_label)
        row.operator("meshfree.add_preset", text="", icon="ADD")
        row.operator("meshfree.add_preset", text="", icon="REMOVE").remove_active = True
        split_properties(layout, context)
        obj = context.object
        for group in (("laplacian",), *_SETTINGS[obj.meshfree.laplacian], _BUDGET):
            column = layout.column(align=True)
            for name in group:
                row = column.row(align=True)
                row.active = _counts(obj.meshfree, name)
                draw_setting(row, obj.meshfree, name, obj)


class MESHFREE_PT_settings(Settings, ReadyPanel, bpy.types.Panel):
    """Settings that change results"""

    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 3  # the last ones


class MESHFREE_PT_settings_properties(Settings, PropertiesPanel, bpy.types.Panel):
    """Settings that change results, beside those of the object"""

    bl_label = "Mesh-Free Settings"


def _counts(settings, name):
    """Whether a setting has an effect with the present others."""
    if name == "boundary":
        return not settings.boundary_group  # a named one is not detected
    return name != "most_points" or settings.point_budget == "NUMBER"


class MESHFREE_PT_spectrum(ReadyPanel, bpy.types.Panel):
    """Vibration modes and their eigenvalues"""

    bl_label = "Spectrum"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 2  # below what is done every day

    def draw(self, context):
        layout = self.layout
        obj = context.object
        layout.operator("meshfree.spectrum").count = obj.meshfree.modes
        draw_tools(layout, self.bl_label)
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


class Display:
    """The base of panels about colors."""

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object, ("OBJECT", "EDIT"))  # colors help to choose points there

    def draw(self, context):
        layout = self.layout
        obj = context.object
        shown = shown_attribute(obj)
        attributes = obj.data.attributes
        column = layout.column(align=True)
        _draw_own_looks(column, obj, shown)
        for name in (*RESULTS, *(name for name in APPLICATIONS if name in attributes)):
            row = column.row(align=True)
            row.enabled = name in attributes
            row.operator("meshfree.colormap", text=label(name), depress=name == shown).attribute = name
        _draw_mode_steps(layout, attributes, shown)
        if find_display(obj) is None:
            return
        if shown in attributes:
            layout.operator("meshfree.colormap", text="Update Colors")
        split_properties(layout, context)
        if shown in attributes and attributes[shown].data_type == "FLOAT_VECTOR":
            layout.prop(obj.meshfree, "component")
            if quantity(shown).along_surface:
                layout.prop(obj.meshfree, "strokes")
                if has_input(find_display(obj).node_group, LENGTH):
                    layout.prop(*input_property(find_display(obj), LENGTH), text=LENGTH)
        if range_node(obj) is not None:
            _draw_colors(layout, context, obj)
        if DISC in attributes:
            layout.prop(obj.meshfree, "point_shape")
            layout.prop(obj.meshfree, "smooth")
            layout.prop(obj.meshfree, "dim_back")
        layout.prop(obj.meshfree, "shaded", slider=True)
        layout.prop(obj.meshfree, "point_size")
        if not draws_discs(obj):
            layout.prop(*input_property(find_display(obj), MOST), text=MOST)
        if shown_scale(obj, context.scene) is not None:
            _draw_legend(layout, context, obj)


class MESHFREE_PT_display(Display, ReadyPanel, bpy.types.Panel):
    """What is shown as colors on the points"""

    bl_label = "Display"
    bl_order = 1  # open and long: below the tools, which are closed


class MESHFREE_PT_display_properties(Display, PropertiesPanel, bpy.types.Panel):
    """What is shown as colors on the points, beside the settings of the object"""

    bl_label = "Mesh-Free Display"


def _draw_legend(layout, context, obj):
    """Draw the settings of the legend, and the view transform where it changes colors."""
    column = layout.column(align=True, heading="Show")
    column.prop(obj.meshfree, "legend")
    column.prop(obj.meshfree, "histogram")
    shows_legend = find_legend(context.scene, obj) is not None
    layout.operator("meshfree.legend", depress=shows_legend).show = not shows_legend
    if context.scene.view_settings.view_transform not in _TRUE_COLORS:
        draw_text(layout, context, "Colors differ from the legend:", "INFO")
        layout.prop(context.scene.view_settings, "view_transform")


def _draw_own_looks(column, obj, shown):
    """Draw the buttons for the colors of the points, and for the material of the object."""
    colors, material = own_colors(obj.data), own_material(obj)
    if colors:
        column.operator("meshfree.colormap", text="Color", depress=colors == shown).attribute = colors
    if material is not None and find_display(obj) is not None:
        column.operator("meshfree.own_material", depress=shows_own_material(obj))


def _draw_colors(layout, context, obj):
    """Draw the settings of colors for numbers."""
    settings = obj.meshfree
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


def _draw_mode_steps(layout, attributes, shown):
    """Draw buttons for the modes before and after the displayed one, or for the first two."""
    mode = mode_number(shown) or 1
    row = layout.row(align=True)
    for step, text, icon in ((-1, "", "TRIA_LEFT"), (0, f"Mode {mode}", "NONE"), (1, "", "TRIA_RIGHT")):
        name = eigenvector_name(mode + step)
        column = row.column(align=True)
        column.enabled = name in attributes
        column.operator("meshfree.colormap", text=text, icon=icon, depress=name == shown).attribute = name


CLASSES = (
    MESHFREE_PT_main,
    MESHFREE_PT_settings,
    MESHFREE_PT_spectrum,
    MESHFREE_PT_display,
    MESHFREE_PT_display_properties,
    MESHFREE_PT_settings_properties,
)
