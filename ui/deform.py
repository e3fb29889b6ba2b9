"""The panel of the deformation by handles."""

import bpy

from ..operators.deform import live
from ..operators.deform.binding import copied_from, handled_object, is_bound, stale_reason
from ..operators.deform.nodes import find_deform, is_baked
from ..operators.objects.groups import handle_names
from ..operators.objects.modifiers import input_property
from ..operators.objects.reading import obstacle
from .dialogs import search_group
from .panel import SidebarPanel

_WIDTH = 38  # letters in a line of the panel


class MESHFREE_PT_deform(SidebarPanel, bpy.types.Panel):
    """Deformation by handles"""

    bl_label = "Bend"
    bl_parent_id = "MESHFREE_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return not obstacle(handled_object(context.object, context.scene), modes=("OBJECT", "EDIT"))

    def draw(self, context):
        layout, obj = self.layout, handled_object(context.object, context.scene)
        if obj != context.object:
            layout.label(text=f"Moves handles of {obj.name}", icon="EMPTY_DATA")
        settings = obj.meshfree.deform
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(align=True)
        search_group(column, settings, "handles", obj)
        search_group(column, settings, "anchors", obj)
        names = handle_names(obj)
        if len(names) > 1:
            column.label(text=f"{len(names)} groups of handles", icon="INFO")
        if obj == context.object:  # whose points are selected
            layout.operator("meshfree.handle_add")
        column = layout.column(align=True)
        column.prop(settings, "add_empties")
        column.prop(settings, "rotation_aware")
        row = column.row()
        row.active = settings.rotation_aware
        row.prop(settings, "steps")
        column.prop(settings, "soft")
        row = column.row()
        row.active = settings.soft
        row.prop(settings, "weight")
        if not is_bound(obj):
            layout.operator("meshfree.deform_bind")
            return
        _draw_state(layout, obj)
        layout.operator("meshfree.deform_bind", text="Bind Again")
        modifier = find_deform(obj)
        if modifier is not None:
            layout.prop(*input_property(modifier, "Strength"), text="Strength", slider=True)
        if not context.scene.render.use_lock_interface:
            column = layout.column(align=True)
            column.label(text="Blender may crash in renders", icon="ERROR")
            column.prop(context.scene.render, "use_lock_interface")
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for name in ("update", "reset", "apply", "to_shape_key", "bake", "free"):
            if name not in {"bake", "free"} or (name == "free") == is_baked(obj):
                grid.operator(f"meshfree.deform_{name}")
        grid.operator("meshfree.deform_unbind")


def _draw_state(layout, obj):
    """Draw whether the points follow the handles, and what to do if not."""
    reason, working = stale_reason(obj, glance=True) or live.trouble(obj), live.preparing(obj)
    if reason:
        state = "Baked" if is_baked(obj) else "Copy" if copied_from(obj) is not None else "Not up to date"
        text = f"{state}. {reason}"
        icon = "INFO" if is_baked(obj) else "ERROR"
    elif working is not None:
        stage, fraction = working
        exact = live.find(obj) is not None and not live.is_prepared(obj)
        state = "Follows its handles roughly. Exact soon" if exact else "Not up to date. Binding"
        text = f"{state}: {stage}, {fraction:.0%}"
        icon = "SORTTIME"
    else:
        text, icon = "Bound: follows its handles", "CHECKMARK"
    column = layout.column(align=True)
    for line in _wrapped(text):
        column.label(text=line, icon=icon)
        icon = "BLANK1"


def _wrapped(text):
    """Break a text into lines."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > _WIDTH:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


CLASSES = (MESHFREE_PT_deform,)
