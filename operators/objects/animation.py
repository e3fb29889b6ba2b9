"""Keyframes of data-blocks, wherever a version of Blender keeps them."""

import bpy
from bpy_extras import anim_utils

TRANSFORM = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")
_PATHS = (*TRANSFORM, *(f"delta_{name}" for name in TRANSFORM if name != "rotation_axis_angle"))  # that move an object


def curves(block):
    """Return the F-curves of a data-block: Blender's collection, or an empty tuple."""
    animation = block.animation_data
    if animation is None or animation.action is None:
        return ()
    if not hasattr(animation, "action_slot"):  # before Blender 4.4
        return animation.action.fcurves
    bag = animation.action_slot and anim_utils.action_get_channelbag_for_slot(animation.action, animation.action_slot)
    return bag.fcurves if bag else ()


def moves_by_keys(obj) -> bool:
    """Whether keyframes move an object."""
    return any(curve.data_path in _PATHS for curve in curves(obj))


def moves_by_driver(obj) -> bool:
    """Whether drivers move an object."""
    animation = obj.animation_data
    return animation is not None and any(curve.data_path in _PATHS for curve in animation.drivers)


def stop_moving(obj):
    """Remove the keyframes that move an object, not those of other users of its action; it keeps its transform."""
    animation = obj.animation_data
    if animation.action.users > 1:  # other users, or a fake one
        animation.action = animation.action.copy()
    found = curves(obj)
    for curve in [curve for curve in found if curve.data_path in _PATHS]:
        found.remove(curve)
    if not (len(found) or animation.drivers or animation.nla_tracks):
        action = animation.action
        obj.animation_data_clear()
        bpy.data.actions.remove(action)
