"""Weights of bones: vertex groups of meshes; a table of the four largest of each point of point clouds and splats.

The table is two attributes, the numbers of the bones and their weights. The names of the bones, in the order of the
numbers, are a custom property of the data.
"""

import numpy as np

from ...core import PointCloudError
from ..objects.attributes import read_attribute, tag_changed, write_attribute
from ..objects.groups import put_group
from ..objects.handlers import notify
from ..objects.splats import has_splats

BONES, WEIGHTS = "lb_bones", "lb_bone_weights"  # attributes of point clouds, four numbers each
NAMES = "lb_bone_names"  # custom property of their data
MOST = 4  # bones that a point of a point cloud follows at most
_NAMED = 5  # bones or groups that a text names
_LEAST = 1e-6  # weight from which a point is in a group


def takes_groups(obj) -> bool:
    """Whether the weights of an object are vertex groups, which Blender's own Armature modifier goes by."""
    return obj.type == "MESH" and not has_splats(obj.data)


def has_weights(obj) -> bool:
    """Whether an object has weights of any bones, or vertex groups."""
    if takes_groups(obj):
        return bool(obj.vertex_groups)
    return NAMES in obj.data and BONES in obj.data.attributes and WEIGHTS in obj.data.attributes


def weight_names(obj) -> list:
    """Return the names of the bones that an object has weights of, or of its vertex groups, in their order."""
    if takes_groups(obj):
        return [group.name for group in obj.vertex_groups]
    return list(obj.data.get(NAMES, ()))


def read_weights(obj):
    """Return the weights of all points, (n, b) float64, in the order of `weight_names`; see `weight_table`."""
    bones, shares = weight_table(obj)
    weights = np.zeros((len(bones), len(weight_names(obj))))
    if weights.size:
        np.add.at(weights, (np.arange(len(bones))[:, None], bones), shares)
    return weights


def weight_table(obj):
    """Return of each point the numbers of its bones by `weight_names`, (n, k) int, and their weights, (n, k) float64.

    A point cloud without weights, or with numbers of bones that there are not, raises `PointCloudError`.
    """
    if takes_groups(obj):
        return _groups_table(obj)
    if not has_weights(obj):
        raise PointCloudError(f'"{obj.name}" has no weights of bones. Run Automatic Weights first.')
    shares = read_attribute(obj.data, WEIGHTS).astype(np.float64)
    bones = np.where(shares > 0.0, read_attribute(obj.data, BONES), 0.0).round().astype(np.int64)
    width = len(weight_names(obj))
    if bones.size and not 0 <= bones.min() <= bones.max() < width:
        raise PointCloudError(
            f'Attribute {BONES} of "{obj.name}" has numbers of bones beyond the {width} it names. Run Automatic'
            " Weights again."
        )
    return bones, shares


def _groups_table(obj):
    """Read the vertex groups of a mesh; see `weight_table`."""
    vertices = obj.data.vertices
    held = [(item.group, item.weight) for vertex in vertices for item in vertex.groups]
    sizes = np.fromiter((len(vertex.groups) for vertex in vertices), np.int64, count=len(vertices))
    most = int(sizes.max(initial=0))
    bones, shares = np.zeros((len(vertices), most), np.int64), np.zeros((len(vertices), most))
    if held:
        place = np.arange(most) < sizes[:, None]
        bones[place], shares[place] = zip(*held, strict=True)
    return bones, shares


def write_weights(obj, names, weights):
    """Write the weights of all points, (n, b), replacing those of the same names and, of a point cloud, all others.

    Vertex groups of other names are left as they are, and those of these names stay in their places. Of weights from 0
    to 1 a point cloud keeps the `MOST` largest of each point, with the same sum.
    """
    if takes_groups(obj):
        for name, column in zip(names, weights.T, strict=True):
            put_group(obj, name, np.where(column >= _LEAST, column, 0.0))
    else:
        most = min(MOST, weights.shape[1])
        order = np.argsort(-weights, axis=1, kind="stable")[:, :most]
        largest = np.take_along_axis(weights, order, axis=1)
        kept = largest.sum(axis=1, keepdims=True)
        largest *= weights.sum(axis=1, keepdims=True) / np.where(kept > 0.0, kept, 1.0)
        fill = ((0, 0), (0, MOST - most))
        write_attribute(obj.data, BONES, np.pad(order, fill), "FLOAT_COLOR")
        write_attribute(obj.data, WEIGHTS, np.pad(largest, fill), "FLOAT_COLOR")
        obj.data[NAMES] = list(names)
    tag_changed(obj.data)
    notify("weights_changed", obj)


def listed(names) -> str:
    """Return the first names of bones or groups, and how many more there are."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"


def named(names, what) -> list:
    """Return a notice that names some bones or groups, if there are any."""
    return [f"{what}: {listed(names)}."] if names else []
