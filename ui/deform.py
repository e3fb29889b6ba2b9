"""The panel of the deformation by handles."""

import bpy

from ..operators import registration
from ..operators.deform import live
from ..operators.deform.binding import is_bound
from ..operators.deform.handle_kind import Handles
from ..operators.deform.handles import copied_from, handled_object
from ..operators.deform.kinds import kind_of
from ..operators.deform.nodes import find_deform, is_baked
from ..operators.deform.pose import State
from ..operators.objects.groups import handle_names
from ..operators.objects.modifiers import input_property
from ..operators.objects.reading import obstacle
from ..tools.groups import ANCHOR, HANDLE
from .dialogs import search_group
from .groups import draw_groups
from .panel import SidebarPanel
from .wrapping import draw_text, split_properties


class MESHFREE_PT_deform(SidebarPanel, bpy.types.Panel):
    """Deformation by handles"""

    bl_label = "Bend"
    bl_parent_id = "MESHFREE_PT_move"

    @classmethod
    def poll(cls, context):
        return not obstacle(handled_object(context.object, context.scene), modes=("OBJECT", "EDIT"))

    def draw(self, context):
        layout, obj = self.layout, handled_object(context.object, context.scene)
        if obj != context.object:
            draw_text(layout, context, f"Moves handles of {obj.name}", "EMPTY_DATA")
        settings = obj.meshfree.deform
        if is_bound(obj) and kind_of(obj).name != Handles.name:
            draw_text(layout, context, f"Follows {kind_of(obj).followed}: see Rig", "INFO")
            return
        split_properties(layout, context)
        for name, role in (("handles", HANDLE), ("anchors", ANCHOR)):
            column = layout.column(align=True)
            search_group(column, settings, name, obj, told=False)
            if obj == context.object:  # whose points are selected
                draw_groups(column, obj, role)
        names = handle_names(obj)
        if len(names) > 1:
            draw_text(layout, context, f"{len(names)} groups of handles", "INFO")
        if obj == context.object:
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
        draw_binding(layout, context, obj, "meshfree.deform_bind")


def draw_binding(layout, context, obj, bind: str, without=()):
    """Draw the state of a bound object, and what can be done with it, without some tools, by their names.

    `bind` is the operator that binds it again.
    """
    _draw_state(layout, context, obj)
    layout.operator(bind, text="Bind Again")
    modifier = find_deform(obj)
    if modifier is not None:
        layout.prop(*input_property(modifier, "Strength"), text="Strength", slider=True)
    if not context.scene.render.use_lock_interface:
        column = layout.column(align=True)
        draw_text(column, context, "Blender may crash in renders", "ERROR")
        column.prop(context.scene.render, "use_lock_interface")
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    hidden = {"deform_bake" if is_baked(obj) else "deform_free", *without}
    for group in registration.groups("panel", MESHFREE_PT_deform.bl_label):
        for tool in group:
            if tool.name not in hidden:
                grid.operator(tool.operator.bl_idname)


_STATES = {  # text, with a detail, and icon in the panel
    State.BAKED: ("Baked. {}", "INFO"),
    State.STALE: ("Not up to date. {}", "ERROR"),
    State.PREPARING: ("Not up to date. Binding: {}", "SORTTIME"),
    State.QUICK: ("Follows its {followed} roughly. Exact soon: {}", "SORTTIME"),
    State.SETTLED: ("Bound: follows its {followed}", "CHECKMARK"),
}


def _draw_state(layout, context, obj):
    """Draw the state of the deformation, with what to do if it is stale."""
    state, detail = live.state(obj)
    text, icon = _STATES[state]
    if state is State.STALE and copied_from(obj) is not None:
        text = "Copy. {}"
    draw_text(layout, context, text.format(detail, followed=kind_of(obj).followed), icon)


CLASSES = (MESHFREE_PT_deform,)
