"""The layouts of dialogs and of Adjust Last Operation, from what operators say that they ask for."""

import bpy

from ..operators.deform.bake import MESHFREE_OT_deform_bake
from ..operators.files.exporting import MESHFREE_OT_export_points
from ..operators.files.importing import MESHFREE_OT_import_points
from ..operators.objects.groups import ROLES, has_group
from ..operators.running.application import ApplicationOperator
from ..operators.tools.select import MESHFREE_OT_select_grow
from ..operators.tools.sequence import MESHFREE_OT_analyze_sequence


def draw_setting(layout, settings, name: str, obj):
    """Draw a setting; one that names a group or an attribute of an object with a list of those."""
    if name.endswith("group"):
        search_group(layout, settings, name, obj)
    elif name in {"viewpoint", "curve"}:
        layout.prop_search(settings, name, bpy.data, "objects")
    elif name == "source":
        layout.prop_search(settings, name, obj.data, "attributes")
    elif name in getattr(settings, "at_zero", ()) and not getattr(settings, name):
        row = layout.row(align=True)
        row.prop(settings, name)
        row.label(text=settings.at_zero[name])
    else:
        layout.prop(settings, name)


def search_group(layout, settings, name: str, obj):
    """Draw a setting that names a group of an object, in red where that is missing, unless it is one to be assigned."""
    group = getattr(settings, name)
    owner, groups = (obj, "vertex_groups") if obj.type == "MESH" else (obj.data, "attributes")
    awaited = group in ROLES and not has_group(obj, group)
    layout.prop_search(settings, name, owner, groups, results_are_suggestions=awaited)
    if awaited:
        layout.label(text="No points assigned yet", icon="INFO")


def _draw_asked(operator, context):
    _draw(operator, context, operator.asks)


def _draw_tool(operator, context):
    _draw(operator, context, operator.adjustable if operator.is_repeated(context) else operator.asks)


def _draw(operator, context, names):
    operator.layout.use_property_split = True
    for name in names:
        draw_setting(operator.layout, operator, name, context.object)


# Here, and not when they are registered: it is then that Blender looks whether a class has a layout of its own.
ApplicationOperator.draw = _draw_tool
for kind in (
    MESHFREE_OT_export_points,
    MESHFREE_OT_import_points,
    MESHFREE_OT_deform_bake,
    MESHFREE_OT_analyze_sequence,
    MESHFREE_OT_select_grow,
):
    kind.draw = _draw_asked
