"""The tab "Mesh-Free" in the sidebar of the 3D view: its first and its last panel, and what all have in common."""

import bpy

from ..operators import registration
from ..operators.deform.handles import handled_object
from ..operators.objects.attributes import DISC, point_count
from ..operators.objects.modifiers import is_sequence
from ..operators.objects.reading import TYPES, obstacle
from ..operators.objects.result import area_text, is_analyzed, trusted_text
from ..operators.objects.splats import has_splats, holds_columns
from ..operators.running.application import ApplicationOperator
from ..operators.running.job import running
from .notices import draw_figures, draw_status, draw_table
from .wrapping import draw_text

_EDITING = "Choose points here, in Edit Mode. Switch to Object Mode to analyze"


class SidebarPanel:
    """A panel in the tab of the extension."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Mesh-Free"


class ReadyPanel(SidebarPanel):
    """A panel below the main one, for objects that can be analyzed."""

    bl_parent_id = "MESHFREE_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object)


class ToolPanel(ReadyPanel):
    """A panel with the tools whose rows have its label as home, and what they told in figures."""

    def draw(self, context):
        draw_tools(self.layout, self.bl_label)
        self.draw_more(self.layout, context)
        draw_figures(self.layout, context, self.bl_label)

    def draw_more(self, layout, context):
        """Draw what is between tools and figures."""


class PropertiesPanel:
    """A panel in the Object tab of the Properties editor, with the contents of one in the sidebar."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}


class MESHFREE_PT_main(SidebarPanel, bpy.types.Panel):
    """The object, and what is done with it most"""

    bl_label = "Mesh-Free Laplacian"

    def draw(self, context):
        layout, obj = self.layout, context.object
        reason = obstacle(obj)
        handled = handled_object(obj, context.scene)
        if reason and handled != obj:
            column = layout.column(align=True)
            draw_text(column, context, f'Handle of "{handled.name}"', "OUTLINER_OB_EMPTY")
            draw_text(column, context, "G moves it, R rotates it", "BLANK1")
            draw_status(layout, context, handled)
        elif obj is not None and obj.type == "ARMATURE":
            _draw_followers(layout, context)
        elif reason:
            _draw_reason(layout, context, reason)
            if obj is not None or running() is not None:
                draw_status(layout, context, obj)
        else:
            draw_text(layout, context, _points_text(obj), f"OUTLINER_OB_{obj.type}")
            _draw_looks(layout, obj)
            layout.operator("meshfree.analyze")
            draw_tasks(layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True))
            draw_status(layout, context, obj)


def _points_text(obj):
    return f"{obj.name}: {point_count(obj.data):,} {'splats' if has_splats(obj.data) else 'points'}"


def draw_tools(layout, home, without=()):
    """Draw the tools of a panel by group, but for some names; dots mean that a tool opens a dialog."""
    for group in registration.groups("panel", home):
        column = layout.column(align=True)
        for tool in group:
            operator = tool.operator
            asks = issubclass(operator, ApplicationOperator) and operator.asks
            if tool.name not in without:
                text = tool.panel.text or f"{operator.bl_label}{'...' if asks else ''}"
                _set(column.operator(operator.bl_idname, text=text), tool.panel)


def draw_tasks(layout):
    """Draw the quick tools, which run without asking."""
    for group in registration.groups("quick", "Object"):
        for tool in group:
            button = layout.operator(tool.operator.bl_idname, text=tool.quick.text)
            button.at_once = True
            _set(button, tool.quick)


def _set(button, row):
    for name, value in row.given:
        setattr(button, name, value)


def _draw_reason(layout, context, reason):
    """Draw why an object cannot be analyzed now, and what can be done."""
    obj = context.object
    column = layout.column(align=True)
    for sentence in (reason if obstacle(obj, ("EDIT",)) else _EDITING).split(". "):
        draw_text(column, context, sentence)
    if obj is not None and any(map(is_sequence, obj.modifiers)):
        layout.operator("meshfree.analyze_sequence", text="Analyze Sequence...", icon="SEQUENCE")
    elif context.mode == "OBJECT":
        layout.operator("meshfree.import_points", text="Import Points...", icon="IMPORT")
        layout.operator("meshfree.import_tiles", text="Import Tiles...")


def _draw_looks(layout, obj):
    """Draw the button that shows points as what they are; it stays, so that nothing moves under the mouse."""
    row, data = layout.row(), obj.data
    if has_splats(data) or holds_columns(data):
        row.operator("meshfree.show_splats", icon="SHADING_RENDERED")
        return
    if obj.type == "MESH" and data.polygons:  # Blender shows these
        return
    row.enabled = DISC not in data.attributes
    row.operator("meshfree.show_surface", icon="SHADING_SOLID", depress=not row.enabled)


def _draw_followers(layout, context):
    """Draw the selected objects whose points may follow the active armature, with their notices."""
    chosen = [other for other in context.selected_objects if other.type in TYPES]
    if not chosen:
        draw_text(layout, context, "Select points, too: Rig lets them follow the bones", "OUTLINER_OB_ARMATURE")
        draw_status(layout, context, None)
    for other in chosen:
        draw_text(layout, context, _points_text(other), f"OUTLINER_OB_{other.type}")
        draw_status(layout, context, other, f"notices_{other.name}")


class MESHFREE_PT_splats(ToolPanel, bpy.types.Panel):
    """Tools for Gaussian splats"""

    bl_label = "Splats"
    bl_order = 2

    @classmethod
    def poll(cls, context):
        return super().poll(context) and has_splats(context.object.data)

    def draw_more(self, layout, context):
        layout.prop(context.object.meshfree, "leave_out_floaters")


class MESHFREE_PT_statistics(SidebarPanel, bpy.types.Panel):
    """Figures of the last analysis"""

    bl_label = "Statistics"
    bl_parent_id = "MESHFREE_PT_main"
    bl_order = 10  # the last one, so that no tool moves when it appears

    @classmethod
    def poll(cls, context):
        return not obstacle(context.object) and is_analyzed(context.object)

    def draw(self, context):
        result = context.object.meshfree
        trusted = trusted_text(result) if result.is_property_set("trusted_area") else ""  # not in files of version 0.3
        counts = {
            "Analyzed Points": result.subset_count,
            "Components": result.component_count if result.component_count > 1 else 0,
            "Boundary Points": result.boundary_count,
            "Points Left Out": result.left_out_count,
        }
        lines = [("Total Area", area_text(result.total_area)), *([("Trusted Area", trusted)] if trusted else [])]
        draw_table(self.layout, context, [*lines, *((name, f"{count:,}") for name, count in counts.items() if count)])
        if result.left_out_count:
            self.layout.operator("meshfree.select_left_out").edit_mode = True


CLASSES = (MESHFREE_PT_main, MESHFREE_PT_splats, MESHFREE_PT_statistics)
