"""Move the points of an object: in place, or by a shape key."""

import numpy as np
from bpy.props import EnumProperty

from ...core import PointCloudError
from .attributes import DISC, check_size, own_positions, read_attribute, write_own_positions
from .carried import local_gradients, moved_discs, write_discs
from .modifiers import is_own
from .reading import key_positions, shape_keys
from .splats import has_splats, read_splats, write_splats

TARGETS = (
    ("SHAPE_KEY", "Shape Key", "Add a shape key, whose value mixes the result with the points as they were"),
    ("IN_PLACE", "In Place", "Move the points themselves"),
)


def target_property():
    """Return the operator property for the target of moved points."""
    return EnumProperty(
        name="Result",
        description="Where the result is written; point clouds have no shape keys and are moved in place",
        items=TARGETS,
        default="SHAPE_KEY",
    )


def check_movable(obj, target: str):
    """Refuse an object whose points cannot be moved, before anything is computed."""
    if obj.meshfree.use_modifiers and any(not is_own(item) for item in obj.modifiers):
        raise PointCloudError(
            f'The points of "{obj.name}" were read after its modifiers, and cannot be written before them.'
            " Turn off Use Modifiers, or apply the modifiers."
        )
    keys = shape_keys(obj)
    if keys is not None and target == "IN_PLACE":
        raise PointCloudError(
            f'"{obj.name}" has shape keys, so moving its points in place would have no visible effect. Choose'
            " Shape Key as the result, or apply the shape keys."
        )
    if keys is not None and not keys.use_relative:
        raise PointCloudError(
            f'The shape keys of "{obj.name}" are absolute. Turn on Relative, so that a key can be added to them.'
        )
    if keys is not None and obj.show_only_shape_key:
        raise PointCloudError(
            f'"{obj.name}" shows its active shape key alone, which hides a new one. Turn off Solo Active Shape'
            " Key (pin icon)."
        )


def write_positions(obj, reading, points, target: str, name: str, gradients=None, discs=None):
    """Move the points to new positions.

    Parameters
    ----------
    obj : bpy.types.Object
    reading : Reading
        How the points were read.
    points : ndarray, (n, 3)
        Their new positions, in the space of `reading.points`.
    target : str
        One of `TARGETS`.
    name : str
        Of the shape key; Blender adds a number to a name in use.
    gradients : ndarray, (n, 3, 3), optional
        Of the deformation, in the space of `reading.points`, for splats and discs.
    discs : ndarray, (n, 3), optional
        Of the moved points, in the form of the display, even if a shape key moves them; without gradients.

    Returns
    -------
    bpy.types.ShapeKey or None
    """
    moved = reading.local(points - reading.points)
    check_size("position", moved)
    if gradients is not None:
        local = local_gradients(gradients, reading.matrix)
        if has_splats(obj.data):
            write_splats(obj.data, read_splats(obj.data).deformed(own_positions(obj.data) + moved, local))
            return None
        discs = moved_discs(read_attribute(obj.data, DISC), local)
    key = None
    if target == "IN_PLACE" or obj.type != "MESH":
        write_own_positions(obj.data, own_positions(obj.data) + moved)
    else:
        key = add_key(obj, name, moved)
        key.value = 1.0
    if discs is not None:
        write_discs(obj, discs)
    return key


def add_key(obj, name: str, moved):
    """Add a shape key of value 0 with displacements, (n, 3), relative to the reference key.

    It becomes the active one, as in Blender.
    """
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    key = obj.shape_key_add(name=name, from_mix=False)
    key.value = 0.0
    positions = key_positions(obj.data.shape_keys.reference_key) + moved
    key.points.foreach_set("co", positions.astype(np.float32).reshape(-1))
    obj.active_shape_key_index = obj.data.shape_keys.key_blocks.find(key.name)
    obj.data.update()
    return key
