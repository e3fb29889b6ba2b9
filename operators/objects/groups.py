"""Groups of points: vertex groups of meshes; boolean or float attributes of point clouds, which have none."""

import re

import numpy as np

from ...core import PointCloudError
from ...tools.groups import HIGH, LOW, VALUE, check_enough
from ...tools.groups import is_chosen as _is_chosen
from .attributes import point_count, read_attribute, tag_changed, write_attribute

_GIVEN = LOW, HIGH, VALUE  # a point has one value
_WEIGHTS = ("BOOLEAN", "FLOAT")  # types of attributes that can be groups of a point cloud


def group_kind(obj) -> str:
    """Return Blender's word for the groups of an object."""
    return "vertex group" if obj.type == "MESH" else "attribute"


def has_group(obj, name: str) -> bool:
    """Whether an object has a group of that name."""
    if obj.type == "MESH":
        return name in obj.vertex_groups
    attribute = obj.data.attributes.get(name)
    return attribute is not None and attribute.data_type in _WEIGHTS and attribute.domain == "POINT"


def rivals(obj, role: str) -> list:
    """Return the groups of an object from which a point is removed when it is assigned to that of a role."""
    return [name for name in _GIVEN if name != role and role in _GIVEN and has_group(obj, name)]


def handle_names(obj) -> list:
    """Return the groups that are handles: the one in the settings, and those of its name with a number."""
    base = obj.meshfree.deform.handles
    pattern = re.compile(re.escape(base) + r"(\.\d+)?")
    groups = obj.vertex_groups if obj.type == "MESH" else obj.data.attributes
    return sorted(group.name for group in groups if pattern.fullmatch(group.name) and has_group(obj, group.name))


def group_weights(obj, name: str, outside=0.0):
    """Read the weight of every point in a group, (n,) float64, with a value for points outside.

    On a point cloud the points outside are those of weight 0.
    """
    if obj.type != "MESH":
        weights = read_attribute(obj.data, name).astype(np.float64)
        return np.where(weights == 0.0, outside, weights)
    index = obj.vertex_groups[name].index
    held = (
        next((item.weight for item in vertex.groups if item.group == index), outside) for vertex in obj.data.vertices
    )
    return np.fromiter(held, np.float64, count=point_count(obj.data))


def is_chosen(obj, name: str, default: str) -> bool:
    """Whether a setting names a group that must exist: any but the default, which may be missing."""
    return _is_chosen(name, default, has_group(obj, name))


def chosen_weights(obj, name: str, setting: str, least: int = 1, outside=0.0):
    """Read the weights in the group that a setting names, (n,) float64, with a value of the points outside.

    A group that does not exist, or has fewer points with a weight above zero than required, raises `PointCloudError`,
    with the label of the setting.
    """
    kind = group_kind(obj)
    if not has_group(obj, name):
        if not name:
            raise PointCloudError(
                f'"{obj.name}" has no {setting} chosen. Choose a group; Assign to Group makes one from the'
                " points selected in Edit Mode."
            )
        what = kind if obj.type == "MESH" else f"{kind} of truth values or numbers on points"
        raise PointCloudError(f'"{obj.name}" has no {what} named "{name}". Choose another {setting}, or clear it.')
    weights = group_weights(obj, name, outside)
    check_enough(weights, kind, name, setting, least, " in Edit Mode")
    return weights


def chosen_members(obj, name: str, setting: str, least: int = 1):
    """Read which points have a weight above zero in the group of a setting, (n,) bool; see `chosen_weights`."""
    return chosen_weights(obj, name, setting, least) > 0.0


def add_group(obj, name: str, weights):
    """Add a vertex group by the weights of all points, (n,) from 0 to 1, without those of weight 0."""
    group = obj.vertex_groups.new(name=name)
    _fill(group, weights)
    return group


def put_group(obj, name: str, weights):
    """Do the same, in the place of a vertex group of that name, if there is one."""
    group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
    group.remove(range(len(weights)))
    _fill(group, weights)


def _fill(group, weights):
    order = np.argsort(weights, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(weights[order])) + 1):
        if weights[part[0]]:
            group.add(part.tolist(), float(weights[part[0]]), "REPLACE")


def check_assignable(obj, name: str, must_exist: bool):
    """Refuse a group that points cannot be assigned to, or removed from."""
    kind, exists = group_kind(obj), has_group(obj, name)
    if must_exist and not exists:
        raise PointCloudError(f'"{obj.name}" has no {kind} named "{name}" to remove points from. Choose another.')
    if name in obj.data.attributes and not (exists and obj.type != "MESH"):
        reason = "vertex groups share their names" if obj.type == "MESH" else "it holds no weights"
        raise PointCloudError(
            f'"{obj.name}" has an attribute named "{name}", and {reason}. Choose another name, or rename the attribute.'
        )
    if obj.type == "MESH" and exists and obj.vertex_groups[name].lock_weight:
        raise PointCloudError(
            f'The vertex group "{name}" of "{obj.name}" is locked. Unlock it, or choose another name.'
        )


def assign(obj, name: str, chosen, action: str, weight: float):
    """Change a group, see `check_assignable`, or add it: give the chosen points, (n,) bool, a weight in it.

    They replace the points of the group, are added to them, or removed, by the action: "REPLACE", "ADD" or "REMOVE".
    """
    if obj.type == "MESH":
        group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
        indices = np.flatnonzero(chosen).tolist()
        if action == "REPLACE":
            group.remove(range(len(chosen)))
        if action == "REMOVE":
            group.remove(indices)
        else:
            group.add(indices, weight, "REPLACE")
        obj.vertex_groups.active = group
    else:
        exists = has_group(obj, name)
        weights = group_weights(obj, name) if exists and action != "REPLACE" else np.zeros(len(chosen))
        weights[chosen] = 0.0 if action == "REMOVE" else weight
        weighted = exists and obj.data.attributes[name].data_type == "FLOAT"
        plain = np.isin(weights, (0.0, 1.0)).all() and not weighted
        write_attribute(obj.data, name, weights, "BOOLEAN" if plain else "FLOAT")
        tag_changed(obj.data)
