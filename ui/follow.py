"""What follows the bones of an armature, in the panel of rigs."""

from ..operators.deform.binding import is_bound
from ..operators.objects.reading import TYPES
from ..operators.rigging.follow import Bones, followers_of
from ..operators.rigging.weights import has_weights, takes_groups
from .deform import draw_binding
from .wrapping import draw_text

_LISTED = 5  # objects that are named


def draw_follow(layout, context, obj):
    """Draw how the active object, points or an armature, follows an armature, or what follows it."""
    if obj is not None and obj.type == "ARMATURE":
        _draw_followers(layout, context, obj)
    if obj is None or obj.type not in TYPES or not (is_bound(obj) and obj.meshfree.deform.kind == Bones.name):
        if obj is None or obj.type not in TYPES or has_weights(obj):
            layout.operator("meshfree.bind_armature")
        return
    settings = obj.meshfree.deform
    if settings.armature is not None:
        draw_text(layout, context, f"Follows {settings.armature.name}", "OUTLINER_OB_ARMATURE")
    if takes_groups(obj):
        draw_text(layout, context, "Its Armature modifier moves the points, and discs turn along", "INFO")
    else:
        layout.prop(settings, "preserve_volume")
    moved = ("deform_apply", "deform_to_shape_key") if takes_groups(obj) else ()
    draw_binding(layout, context, obj, "meshfree.bind_armature", ("deform_reset", *moved))


def _draw_followers(layout, context, armature):
    """Draw which objects follow an armature."""
    names = [obj.name for obj in followers_of(armature)]
    if names:
        more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
        draw_text(layout, context, f"Followed by {', '.join(names[:_LISTED])}{more}", "INFO")
