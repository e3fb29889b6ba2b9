"""The layouts of dialogs and of Adjust Last Operation, by the settings that operators list."""

import bpy

from ..operators.deform.bake import MESHFREE_OT_deform_bake
from ..operators.deform.tools import MESHFREE_OT_deform_apply, keyed_empties
from ..operators.files.exporting import MESHFREE_OT_export_points, MESHFREE_OT_export_splats
from ..operators.files.importing import MESHFREE_OT_import_points
from ..operators.files.tiles import MESHFREE_OT_import_tiles
from ..operators.objects.groups import has_group
from ..operators.running.application import ApplicationOperator
from ..operators.tools.profile import ProfileCurve
from ..operators.tools.select import MESHFREE_OT_select_grow, selection
from ..operators.tools.sequence import MESHFREE_OT_analyze_sequence
from ..tools.groups import FIXED, HIGH, LOW, ROLES, SOURCE, VALUE
from .wrapping import draw_text

_OPTIONAL = LOW, HIGH, VALUE  # not all of them are needed
_NO_SOURCE = "Select a point in Edit Mode first"


def draw_setting(layout, settings, name: str, obj):
    """Draw a setting; that of a group or an attribute with a list of those of an object."""
    if name.endswith("group"):
        search_group(layout, settings, name, obj)
    elif name in {"viewpoint", "curve", "plane", "toucher", "box"}:
        layout.prop_search(settings, name, bpy.data, "objects")
    elif name == "source":
        layout.prop_search(settings, name, obj.data, "attributes")
    elif name in getattr(settings, "at_zero", ()) and not getattr(settings, name):
        row = layout.row(align=True)
        row.prop(settings, name)
        row.label(text=settings.at_zero[name])
    else:
        layout.prop(settings, name)


def search_group(layout, settings, name: str, obj, told: bool = True):
    """Draw a setting that names a group of an object, in red if that is missing, unless it has the default name.

    Then a text says what is used instead, or what to do first, if that is to be told.
    """
    group = getattr(settings, name)
    owner, groups = (obj, "vertex_groups") if obj.type == "MESH" else (obj.data, "attributes")
    awaited = group in ROLES and not has_group(obj, group)
    layout.prop_search(settings, name, owner, groups, results_are_suggestions=awaited)
    if told and awaited and group not in _OPTIONAL:
        draw_text(layout, bpy.context, _instead(obj, group), "INFO")


def _instead(obj, group):
    """Return what is used instead of a missing default group."""
    if group != SOURCE:
        return "Uses the detected boundaries" if group == FIXED else "No points assigned yet"
    count = int(selection(obj).sum())
    if count == 0:
        return _NO_SOURCE
    return "Uses the selected point" if count == 1 else f"Uses the {count:,} selected points"


def _lacks(operator, obj) -> bool:
    """Whether a dialog cannot be confirmed yet: there are no sources."""
    asked = "group" in operator.asks and operator.group == SOURCE and not has_group(obj, SOURCE)
    return asked and _instead(obj, SOURCE) == _NO_SOURCE


def _draw_asked(operator, context):
    _draw(operator, context, operator.asks)


def _draw_tool(operator, context):
    repeated = operator.is_repeated(context)
    _draw(operator, context, operator.adjustable if repeated else operator.asks)
    if not repeated and _lacks(operator, context.object):
        operator.layout.template_popup_confirm("", text="", cancel_text="Close")  # without OK


def _draw_apply(operator, context):
    if keyed_empties(operator.subject(context)):  # not in Adjust Last Operation, when they are removed
        column = operator.layout.column(align=True)
        column.label(text=f"The shape of frame {context.scene.frame_current} will be at rest.", icon="INFO")
        column.label(text="Keyframes of its handles would deform it", icon="BLANK1")
        column.label(text="again, so they are removed. Bake keeps motion.", icon="BLANK1")
    operator.layout.prop(operator, "keep_keyframes")


def _draw(operator, context, names):
    operator.layout.use_property_split = True
    for name in names:
        draw_setting(operator.layout, operator, name, context.object)


# At import: Blender checks at registration whether a class has a layout of its own.
ApplicationOperator.draw = ProfileCurve.draw = _draw_tool
_ASKING = (
    MESHFREE_OT_export_points,
    MESHFREE_OT_export_splats,
    MESHFREE_OT_import_points,
    MESHFREE_OT_import_tiles,
    MESHFREE_OT_deform_bake,
    MESHFREE_OT_analyze_sequence,
    MESHFREE_OT_select_grow,
)
for kind in _ASKING:
    kind.draw = _draw_asked
MESHFREE_OT_deform_apply.draw = _draw_apply
