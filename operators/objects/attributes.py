"""Attributes of this extension other than results, by name and type; reading and writing attributes."""

import zlib
from typing import NamedTuple

import bmesh
import bpy
import numpy as np

from ...core import PointCloudError
from ...tools.quantities import AREA, COMPARED, EIGENVECTOR, ORIENTATION, quantity


class _Storage(NamedTuple):
    dtype: type
    components: int
    key: str  # name of the values in foreach_get and foreach_set


_STORAGE = {
    "FLOAT": _Storage(np.float32, 1, "value"),
    "FLOAT_VECTOR": _Storage(np.float32, 3, "vector"),
    "FLOAT2": _Storage(np.float32, 2, "vector"),
    "INT": _Storage(np.int32, 1, "value"),
    "BOOLEAN": _Storage(np.bool_, 1, "value"),
}
_FOUR = {  # types that are stored, but cannot be shown as results
    "QUATERNION": _Storage(np.float32, 4, "value"),
    "FLOAT_COLOR": _Storage(np.float32, 4, "color"),
    "FLOAT4": _Storage(np.float32, 4, "vector"),  # Blender 5.3 on
}
_LAYERS = {"FLOAT": "float", "FLOAT_VECTOR": "float_vector", "INT": "int", "BOOLEAN": "bool"}  # in Edit Mode

SELECTION = ".selection"  # of point clouds, as Blender names it
DISC = "lb_disc"  # unit normal times the radius of the disc of the point, in units of the spacing
# Gradients of the displayed values, or of both texture coordinates, and these values. Blender hides such names.
SLOPE, SLOPE_2, SLOPE_OF = ".lb_slope", ".lb_slope_2", ".lb_slope_of"
# For viewports in Solid: linear colors, and their derivative by the displayed value.
SOLID, TILT = ".lb_color", ".lb_tilt"
RISE = "lb_rise"  # difference of the displayed value to that at the center of a disc
CORNER = "lb_corner"  # marks corners of the discs of the display, which are not points
REST = "lb_rest"  # positions before the displacement
SPLAT_SCALE, SPLAT_ROTATION = "lb_splat_scale", "lb_splat_rotation"  # of deformed splats
MOVED_DISC = "lb_moved_disc"  # the disc after a deformation
ONLY_DRAWN = DISC, MOVED_DISC, CORNER  # attributes of the display alone
SPLAT_HARMONIC = "lb_splat_sh_"  # followed by the number of the harmonic, from 0
_TYPES = {  # of attributes that are not results; all others are FLOAT
    **dict.fromkeys((ORIENTATION, DISC, MOVED_DISC, REST, SLOPE, SLOPE_2, TILT, SPLAT_SCALE), "FLOAT_VECTOR"),
    COMPARED: "BOOLEAN",
    SPLAT_ROTATION: "QUATERNION",
}
STORABLE = tuple(_STORAGE)


def type_of(name: str) -> str:
    """Type of one of this extension's attributes."""
    row = quantity(name)
    if row.attribute:
        return row.data_type
    return "FLOAT_VECTOR" if name.startswith(SPLAT_HARMONIC) else _TYPES.get(name, "FLOAT")


def mode_number(name: str) -> int:
    """Number of the mode that an attribute holds; 0 for attributes that hold none."""
    return _number(name, EIGENVECTOR)


def _number(name, prefix):
    number = name.removeprefix(prefix)
    return int(number) if name.startswith(prefix) and number.isdecimal() else 0


def check_names(obj, names):
    """Refuse names of vertex groups, since attributes and vertex groups share one namespace."""
    taken = sorted(set(names) & {group.name for group in obj.vertex_groups})
    if taken:
        raise PointCloudError(
            f'Object "{obj.name}" has vertex groups named {", ".join(taken)}, which results need as attribute'
            " names. Rename these vertex groups."
        )


def point_count(data) -> int:
    """How many points a mesh or a point cloud has."""
    return len(data.vertices if isinstance(data, bpy.types.Mesh) else data.points)


def own_positions(data):
    """Read the positions of the points of a mesh or a point cloud, (n, 3) float32."""
    positions = np.empty((point_count(data), 3), np.float32)
    if not len(positions):  # new data have no such attribute
        return positions
    data.attributes["position"].data.foreach_get("vector", positions.reshape(-1))
    return positions


def in_edit_mesh(obj) -> bool:
    """Whether a mesh is in Edit Mode, by this object or another one, so that its data cannot be read as arrays."""
    return obj.type == "MESH" and obj.data.is_editmode


def positions_now(obj):
    """Read the positions of the points in local space, with unsaved changes of Edit Mode."""
    if not in_edit_mesh(obj):
        return own_positions(obj.data)
    obj.update_from_editmode()
    positions = np.empty((len(obj.data.vertices), 3), np.float32)
    obj.data.vertices.foreach_get("co", positions.reshape(-1))
    return positions


def write_own_positions(data, positions):
    """Move the points of a mesh or a point cloud to these positions, (n, 3)."""
    data.attributes["position"].data.foreach_set("vector", positions.astype(np.float32).reshape(-1))
    tag_changed(data)


def points_checksum(data) -> str:
    """Return a checksum of the positions of the points of a mesh or a point cloud, without shape keys and modifiers."""
    return f"{zlib.crc32(own_positions(data)):08x}"


def deselect(data):
    """Deselect all points of a mesh or a point cloud; new ones are selected, or count as such."""
    nothing = np.zeros(point_count(data), dtype=bool)
    if isinstance(data, bpy.types.Mesh):
        data.vertices.foreach_set("select", nothing)
    else:
        write_attribute(data, SELECTION, nothing, "BOOLEAN")


def tag_changed(data):
    """Notify Blender that the data of a mesh or a point cloud changed."""
    if isinstance(data, bpy.types.Mesh):
        data.update()
    else:
        data.update_tag()


def write_attribute(data, name: str, values, data_type: str = ""):
    """Write values, (n,) or (n, k), to the points of a mesh or a point cloud, replacing an attribute of that name.

    The type is one that Blender names; empty for that of our own results.
    """
    if not data_type:
        data_type = type_of(name)
        check_size(name, values)
    storage = _STORAGE.get(data_type) or _FOUR[data_type]
    values = np.ascontiguousarray(values, dtype=storage.dtype).reshape(-1)
    if len(values) != storage.components * point_count(data):
        raise PointCloudError(
            f"Attribute {name} got {len(values)} numbers for {point_count(data)} points with"
            f" {storage.components} each. Analyze the object again."
        )
    attribute = data.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, "POINT"):
        data.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = data.attributes.new(name, data_type, "POINT")
    if attribute is None or attribute.name != name:
        raise RuntimeError(f"Blender made no attribute named {name} on {data.name}")
    attribute.data.foreach_set(storage.key, values)


def check_size(name: str, values):
    """Refuse numbers for an attribute that single precision, in which Blender stores them, cannot represent."""
    sizes, kept = np.abs(values), np.finfo(np.float32)
    lost = np.count_nonzero(~np.isfinite(sizes))
    if lost:
        raise PointCloudError(
            f"Attribute {name} has values that are infinite or no numbers, {lost} of {sizes.size}. Scale the object to"
            " a size near 1."
        )
    largest = np.max(sizes, initial=0.0)
    if largest > kept.max:
        row = quantity(name)
        advice = f"Scale the object {'up' if row.power < 0 else 'down'}"
        if row.attribute and row.power == 0:
            advice = "Use smaller values"
        raise PointCloudError(
            f"Attribute {name} has numbers up to {largest:.1e}, beyond the 3e38 that Blender keeps. {advice}."
        )
    if name == AREA and 0.0 < largest < kept.tiny:
        raise PointCloudError(
            f"Attribute {name} has numbers up to {largest:.1e} only, below the 1e-38 that Blender keeps. Scale the"
            " object up."
        )


def read_attribute(data, name: str):
    """Read an attribute of the points as an array of shape (n,), (n, 2), (n, 3) or (n, 4)."""
    attribute = data.attributes.get(name)
    if attribute is None:
        raise PointCloudError(f'"{data.name}" has no attribute {name}. Analyze the object, or choose another name.')
    storage = _STORAGE.get(attribute.data_type) or _FOUR.get(attribute.data_type)
    if storage is None or attribute.domain != "POINT":
        raise PointCloudError(
            f"Attribute {name} has the type {attribute.data_type} on the domain {attribute.domain}. Choose a"
            " number or a vector on points."
        )
    if isinstance(data, bpy.types.Mesh) and data.is_editmode:
        values = _edited_values(data, name, attribute.data_type)
    else:
        values = np.empty((len(attribute.data), storage.components), storage.dtype)
        attribute.data.foreach_get(storage.key, values.reshape(-1))
    return values[:, 0] if storage.components == 1 else values


def _edited_values(mesh, name, data_type):
    """Read an attribute of a mesh in Edit Mode, vertex by vertex."""
    edited, storage = bmesh.from_edit_mesh(mesh), _STORAGE[data_type]
    layers = getattr(edited.verts.layers, _LAYERS.get(data_type, ""), None)
    if layers is None:  # pairs of numbers, and truth values in Blender 4.2
        return _copied_values(edited, name, storage)
    layer = layers[name]
    return np.array([vertex[layer] for vertex in edited.verts], storage.dtype).reshape(-1, storage.components)


def _copied_values(edited, name, storage):
    """Read an attribute of a mesh in Edit Mode from a copy."""
    copy = bpy.data.meshes.new(name)
    try:
        edited.to_mesh(copy)
        values = np.empty((len(copy.vertices), storage.components), storage.dtype)
        copy.attributes[name].data.foreach_get(storage.key, values.reshape(-1))
    finally:
        bpy.data.meshes.remove(copy)
    return values


def has_vectors(data, name: str) -> bool:
    """Whether an attribute exists and holds a vector for each point."""
    attribute = data.attributes.get(name)
    return attribute is not None and (attribute.data_type, attribute.domain) == ("FLOAT_VECTOR", "POINT")


def remove_attributes(data, *names: str):
    """Remove attributes, as far as they exist."""
    for name in names:
        if name in data.attributes:
            data.attributes.remove(data.attributes[name])


def remove_numbered(data, prefix: str, beyond: int):
    """Remove the attributes of a kind that are numbered above `beyond`."""
    remove_attributes(data, *(name for name in data.attributes.keys() if _number(name, prefix) > beyond))
