"""The modifier of a motion: a formula of the time over modes, and displacement along the normals."""

import bpy
import numpy as np

from ...core.linalg import det
from ...tools.quantities import MOTION, MOTION_MODE, NORMAL
from .animation import curves
from .attributes import remove_numbered, write_attribute
from .modifiers import MOTION_TAG, is_display, is_motion, new_group, set_input
from .node_trees import TreeBuilder
from .reading import metric

NAME = "Mesh-Free Motion"
_HEIGHT, _FIRST, _FRAMES = "Height", "First Frame", "Frames"  # inputs of the nodes
_INPUTS = (
    (_HEIGHT, "Float", "Displacement along the normals where the motion is 1, in local lengths"),
    (_FIRST, "Int", "Frame of the scene with which the motion begins"),
    (_FRAMES, "Int", "Frames of the scene from the beginning to the end", {"default_value": 1, "min_value": 1}),
)


def mode_name(number: int) -> str:
    """Name of the attribute that holds what a mode of a motion adds; modes are counted from 1."""
    return f"{MOTION_MODE}{number:03d}"


def show_motion(obj, height: float, normals, formula, first: int, frames: int):
    """Give an object the modifier that its motion needs, or take it away if it needs none.

    The height is the displacement where the motion is 1, in lengths of the world, 0 for none, along normals, (n, 3), in
    local space. There is no formula of a motion whose attribute holds the frame on show. Frames are those of the scene.
    """
    modifier = next((item for item in obj.modifiers if is_motion(item)), None)
    remove_numbered(obj.data, MOTION_MODE, 0 if formula is None else len(formula.rates))
    if not height and formula is None:
        if modifier is not None:
            obj.modifiers.remove(modifier)
        return
    if modifier is None:
        modifier = obj.modifiers.new(NAME, "NODES")
        others = [item for item in obj.modifiers if item != modifier]
        obj.modifiers.move(len(others), len([item for item in others if not is_display(item)]))
    if formula is not None:
        at_start = formula.shares[0] if formula.is_single else np.ones(len(formula.rates))
        for number, mode in enumerate((formula.modes * at_start).T, 1):
            write_attribute(obj.data, mode_name(number), mode)
    if height:
        write_attribute(obj.data, NORMAL, normals)
    modifier.node_group = _new_group(formula, bool(height))
    if formula is not None and not formula.is_single:
        _key_amplitudes(modifier.node_group, formula, first, frames)
    scale = det(metric(obj)) ** (1.0 / 6.0)  # the metric has squares of lengths
    for name, value in ((_HEIGHT, float(height / scale)), (_FIRST, first), (_FRAMES, max(frames - 1, 1))):
        set_input(modifier, name, value)


def _new_group(formula, displaces):
    group = new_group(NAME, MOTION_TAG, _INPUTS)
    tree = TreeBuilder(group)
    given = tree.node("NodeGroupInput").outputs
    geometry = given["Geometry"]
    if formula is not None:
        shares = _functions(tree, formula, given) if formula.is_single else _keyed(tree, formula)
        geometry = tree.store(geometry, MOTION, _sum(tree, shares), "FLOAT")
    if displaces:
        size = tree.math("MULTIPLY", tree.attribute(MOTION, "FLOAT"), given[_HEIGHT])
        offset = tree.node("ShaderNodeVectorMath", tree.attribute(NORMAL), Scale=size, operation="SCALE")
        geometry = tree.node("GeometryNodeSetPosition", geometry, Offset=offset)
    tree.output("NodeGroupOutput", geometry)
    return group


def _time(tree, given):
    """Add nodes for the time from 0 at the first frame to 1 at the last; return the last one."""
    since = tree.math("SUBTRACT", tree.node("GeometryNodeInputSceneTime").outputs["Frame"], given[_FIRST])
    return tree.math("DIVIDE", tree.math("MAXIMUM", since, 0.0), given[_FRAMES])


def _functions(tree, formula, given):
    """Add nodes for the function of the time of each mode, and return them."""
    time = _time(tree, given)
    return [tree.math(formula.function, tree.math("MULTIPLY", time, float(rate))) for rate in formula.rates]


def _keyed(tree, formula):
    """Add nodes for the amplitude of each mode, which have keyframes, and return them."""
    return [tree.node("ShaderNodeValue", name=mode_name(number + 1)) for number in range(len(formula.rates))]


def _sum(tree, shares):
    """Add nodes for the sum of all modes, each times a share; return the last one."""
    total = 0.0
    for number, share in enumerate(shares, 1):
        total = tree.math("MULTIPLY_ADD", share, tree.attribute(mode_name(number), "FLOAT"), total)
    return total


def _key_amplitudes(group, formula, first, frames):
    """Give the amplitudes of the modes a keyframe at each frame of the scene, straight lines between them."""
    numbers = np.arange(frames)
    values = np.array([formula.amplitudes(number / max(frames - 1, 1)) for number in numbers])
    sockets = [group.nodes[mode_name(number + 1)].outputs[0] for number in range(len(formula.rates))]
    for socket in sockets:  # which makes its F-curve, wherever a version of Blender keeps it
        socket.keyframe_insert("default_value", frame=first)
    by_path = {curve.data_path: curve for curve in curves(group)}
    for socket, of_mode in zip(sockets, values.T, strict=True):
        points = by_path[socket.path_from_id("default_value")].keyframe_points
        points.add(frames - len(points))
        points.foreach_set("co", np.column_stack([first + numbers, of_mode]).astype(np.float32).reshape(-1))
        for point in points:
            point.interpolation = "LINEAR"
        by_path[socket.path_from_id("default_value")].update()


def forget_groups():
    """Remove the nodes of motions that nothing uses any more, with their keyframes."""
    for group in [item for item in bpy.data.node_groups if MOTION_TAG in item and not item.users]:
        animation = group.animation_data
        action = animation and animation.action
        bpy.data.node_groups.remove(group)
        if action is not None and not action.users:
            bpy.data.actions.remove(action)
