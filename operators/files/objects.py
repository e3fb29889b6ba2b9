"""Conversion between objects and point files, for the menus and the command line."""

import json

import bpy
import numpy as np
from bpy.props import StringProperty

from ...command.colors import COLOR
from ...core.files import (
    LasForm,
    PointTable,
    choose_origin,
    is_coarse,
    split_digits,
)
from ...core.files.table import NORMAL as FILE_NORMAL
from ...core.files.table import SCANNER
from ...core.linalg import det
from ...tools.groups import column_weights
from ...tools.quantities import NORMAL, PREFIX
from ..objects.attributes import ONLY_DRAWN, STORABLE, read_attribute, type_of, write_attribute
from ..objects.colors import own_colors
from ..objects.groups import add_group, has_group
from ..objects.place import LAS, OFFSET, place_of
from ..objects.reading import seen_positions
from .columns import RENAMED, Column, doubted_columns, known_digits, read_columns, remember_columns

_LONGEST_NAME = 60  # bytes; Blender's own limit is little above
_PART = 5  # of them for the suffix of the second part of a column


def file_filter(*suffixes):
    """Return the operator property that filters file browsers by these endings."""
    return StringProperty(
        name="File Filter",
        description="Names of files that are listed",
        default=";".join(f"*{suffix}" for suffix in suffixes),
        options={"HIDDEN"},
    )


def add_object(name, table, collection, known=None, with_attributes=True):
    """Add an object of loose vertices to a collection, with other columns or without, and return it.

    Its coordinates are those of the table, less an offset that the object keeps in double precision: `known`, that of
    other objects, if the points are near enough.
    """
    origin = choose_origin(table.points, known, degrees=table.degrees)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(table.points))
    mesh.attributes["position"].data.foreach_set("vector", (table.points - origin).astype(np.float32).reshape(-1))
    columns = {}
    if with_attributes:
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large for single precision becomes infinite
            for column, values in table.attributes.items():
                is_place = column == SCANNER and values.ndim == 2
                columns |= _add_parts(mesh, column, values - origin if is_place else values)
        if table.colors is not None:
            layer = mesh.color_attributes.new(COLOR, "BYTE_COLOR", "POINT")
            layer.data.foreach_set("color_srgb", table.colors.reshape(-1))
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    if origin.any():
        obj[OFFSET] = origin.tolist()
    if table.las is not None:
        obj[LAS] = json.dumps(table.las.to_json())
    remember_columns(obj, columns)
    collection.objects.link(obj)
    return obj


def _add_parts(mesh, name, values):
    """Add a column of a file as an attribute, or two if one has too few digits; then return `Column` by name."""
    if name.startswith(PREFIX) or (name in (SCANNER, FILE_NORMAL) and values.ndim == 2):
        add_column(mesh, name, values)
        return {}
    parts, digits = split_digits(values)
    known = None if digits is None else known_digits(name)
    if known is not None:
        parts, digits = split_digits(values, known)
    first = add_column(mesh, name, parts[0])
    if digits is None:
        return {}
    stem = name.encode()[: _LONGEST_NAME - _PART].decode(errors="ignore")
    return {first: Column(digits, add_column(mesh, f"{stem}_{digits.part}", parts[1]) if digits.part else "")}


def add_column(mesh, name, values):
    """Add a column of a file as an attribute, our own in their types; return its name in Blender."""
    if values.ndim == 2:
        kind = "FLOAT_VECTOR"
    elif name.startswith(PREFIX) and type_of(name) != "FLOAT_VECTOR":
        kind = type_of(name)
    else:
        kind = "INT" if values.dtype.kind in "iu" and _fit(values) else "FLOAT"
    name = name.encode()[:_LONGEST_NAME].decode(errors="ignore")
    free = name not in mesh.attributes and not name.startswith(".")  # which hides an attribute
    layer = mesh.attributes.new(name, kind, "POINT") if free else None
    if layer is None:  # Blender reserves some names, each for one type
        layer = mesh.attributes.new(f"{RENAMED}{name}", kind, "POINT")
    name = layer.name
    write_attribute(mesh, name, values, kind)
    return name


def _fit(values):
    """Whether whole numbers fit into those of Blender."""
    limits = np.iinfo(np.int32)
    return limits.min <= values.min(initial=0) and values.max(initial=0) <= limits.max


def point_table(context, obj, attributes="ALL", with_colors=True) -> PointTable:
    """Return an object's displayed points, in world space without the import offset, with attributes.

    These are "ALL", "NONE", or "RESULTS", those of this extension alone; colors are asked for apart. Normals and
    scanner positions are in world space. Of LAS files, coordinates that Blender has rounded only are those of the file
    again. `single` of the table says whether single precision resolves the coordinates; notices name the columns in
    doubt.
    """
    matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    seen = seen_positions(context, obj)
    with np.errstate(invalid="ignore"):  # infinite points become NaN when transformed
        table = PointTable(seen.astype(np.float64) @ matrix.T + place_of(obj))
        if LAS in obj:
            table.las = LasForm(**json.loads(obj[LAS]))
            table.points = table.las.restored(table.points, np.spacing(np.abs(seen).max(initial=0.0)))
    table.single = not (OFFSET in obj or is_coarse(table.points))
    data = obj.data
    names = [layer.name for layer in data.attributes if _is_column(layer)] if attributes != "NONE" else []
    if attributes == "RESULTS":
        names = [name for name in names if name.startswith(PREFIX)]
    table.attributes, table.notices = read_columns(obj, names), doubted_columns(obj) if names else []
    vectors = [name for name in (NORMAL, FILE_NORMAL) if np.ndim(table.attributes.get(name)) == 2]
    normals = [table.attributes.pop(name) for name in vectors]
    if normals:
        table.attributes[FILE_NORMAL] = _world_normals(normals[0], matrix)
    if np.ndim(table.attributes.get(SCANNER)) == 2:
        table.attributes[SCANNER] = table.attributes[SCANNER].astype(np.float64) @ matrix.T + place_of(obj)
    if with_colors:
        table.colors = read_colors(data)
    return table


def _is_column(layer):
    hidden = layer.name.startswith(".") or layer.name == "position" or layer.name in ONLY_DRAWN
    return not hidden and layer.domain == "POINT" and layer.data_type in STORABLE


def _world_normals(normals, matrix):
    """Transform local normals to unit normals of the world, by cofactors, which singular matrices have too."""
    cofactors = np.stack([np.cross(matrix[i - 2], matrix[i - 1]) for i in range(3)])
    world = normals.astype(np.float64) @ cofactors.T * (-1.0 if det(matrix) < 0.0 else 1.0)
    length = np.linalg.norm(world, axis=1, keepdims=True)
    return (world / np.where(length > 0.0, length, 1.0)).astype(np.float32)


def read_colors(data):
    """Read the colors of points, of sRGB, (n, 4); None without any. See `own_colors`."""
    name = own_colors(data)
    if not name:
        return None
    layer = data.attributes[name]
    colors = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color_srgb", colors)
    return np.clip(colors.reshape(-1, 4), 0.0, 1.0)


def group_of(obj, name):
    """Return the name of an object's group, added from the column of that name if a mesh has no such group.

    Its numbers are weights as of `column_weights`.
    """
    column = None if obj.type != "MESH" or has_group(obj, name) else obj.data.attributes.get(name)
    if column is None or not _is_column(column):
        return name
    weights = column_weights(read_attribute(obj.data, name), name, f'"{obj.name}"')
    return add_group(obj, f"{name} (column)", weights).name


def faces_to(mesh, faces):
    """Give a mesh of loose vertices faces, arrays (m, k) of their numbers, shaded smooth."""
    corners = np.concatenate([each.reshape(-1) for each in faces])
    sizes = np.concatenate([np.full(len(each), each.shape[1]) for each in faces])
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32))
    mesh.polygons.add(len(sizes))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(sizes), dtype=bool))
    mesh.update(calc_edges=True)


def faces_of(mesh) -> list:
    """Return the faces of a mesh, arrays (m, k) int32, one for each number k of corners."""
    corners = np.empty(len(mesh.loops), np.int32)
    starts, counts = np.empty((2, len(mesh.polygons)), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("loop_total", counts)
    return [corners[starts[counts == count, None] + np.arange(count)] for count in np.unique(counts).tolist()]
