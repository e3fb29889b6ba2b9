"""Vertex groups: which vertices are in one, and with what weight."""

import numpy as np

from ..core import PointCloudError
from .attributes import point_count

HANDLE, ANCHOR, FIXED, SOURCE, VALUE = "Handle", "Anchor", "Fixed", "Source", "Value"


def group_weights(obj, name: str, outside=0.0):
    """Read the weight of every vertex in a group, (n,) float64; those outside get a number of their own."""
    index = obj.vertex_groups[name].index
    held = (
        next((item.weight for item in vertex.groups if item.group == index), outside) for vertex in obj.data.vertices
    )
    return np.fromiter(held, np.float64, count=point_count(obj.data))


def is_chosen(obj, name: str, default: str) -> bool:
    """Whether a setting names a group that must be there: any but the default, which may be missing."""
    return bool(name) and (name in obj.vertex_groups or name != default)


def chosen_weights(obj, name: str, setting: str, least: int = 1, outside=0.0):
    """Read the weights in the group that a setting names.

    Parameters
    ----------
    obj : bpy.types.Object
    name : str
        The group.
    setting : str
        What the panel calls the setting, for the texts of errors.
    least : int
        How many points must have a weight above zero.
    outside : float
        What the points outside the group get.

    Returns
    -------
    ndarray, (n,) float64

    Raises
    ------
    PointCloudError
        There is no such group, or too little in it.
    """
    if name not in obj.vertex_groups:
        raise PointCloudError(
            f'"{obj.name}" has no vertex group named "{name}". Choose another {setting}, or clear it.'
            if name
            else f'"{obj.name}" has no {setting} chosen. Choose a vertex group; Assign to Group makes one from the'
            " points selected in Edit Mode."
        )
    weights = group_weights(obj, name, outside)
    count = np.count_nonzero(weights > 0.0)
    if count < least:
        raise PointCloudError(
            f'The vertex group "{name}" gives {count} of {len(weights)} points a weight above zero, and {setting} takes'
            f" at least {least}. Assign points to it in Edit Mode, or clear {setting}."
        )
    return weights


def chosen_members(obj, name: str, setting: str, least: int = 1):
    """Read which vertices the group that a setting names gives a weight above zero, (n,) bool; see `chosen_weights`."""
    return chosen_weights(obj, name, setting, least) > 0.0
