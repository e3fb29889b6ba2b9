"""The modifier that displaces points along their normals by the attribute of a motion."""

import bpy
import numpy as np

from .attributes import write_attribute
from .modifiers import MOTION_TAG, is_display, is_intact, is_motion, new_group, set_input
from .node_trees import TreeBuilder
from .quantities import MOTION, NORMAL
from .reading import metric

NAME = "Mesh-Free Motion"
_HEIGHT = "Height"


def displace(obj, height: float, normals):
    """Give an object the modifier that displaces its points by its motion, or take it away for a height of zero.

    Parameters
    ----------
    obj : bpy.types.Object
    height : float
        Displacement where the motion is 1, in lengths of the world.
    normals : ndarray, (n, 3)
        In local space.
    """
    modifier = next((item for item in obj.modifiers if is_motion(item)), None)
    if not height:
        if modifier is not None:
            obj.modifiers.remove(modifier)
        return
    write_attribute(obj.data, NORMAL, normals)
    if modifier is None:
        modifier = obj.modifiers.new(NAME, "NODES")
        others = [item for item in obj.modifiers if item != modifier]
        obj.modifiers.move(len(others), len([item for item in others if not is_display(item)]))
        modifier.node_group = _group()
    scale = np.linalg.det(metric(obj)) ** (1.0 / 6.0)  # the metric has squares of lengths
    set_input(modifier, _HEIGHT, float(height / scale))


def _group():
    known = [group for group in bpy.data.node_groups if MOTION_TAG in group and group.library is None]
    return next((group for group in known if is_intact(group)), None) or _new_group()


def _new_group():
    group = new_group(NAME, MOTION_TAG, [(_HEIGHT, "Float", "Displacement along the normals where the motion is 1")])
    tree = TreeBuilder(group)
    given = tree.node("NodeGroupInput").outputs
    size = tree.math("MULTIPLY", tree.attribute(MOTION, "FLOAT"), given[_HEIGHT])
    offset = tree.node("ShaderNodeVectorMath", tree.attribute(NORMAL), Scale=size, operation="SCALE")
    tree.output("NodeGroupOutput", tree.node("GeometryNodeSetPosition", given["Geometry"], Offset=offset))
    return group
