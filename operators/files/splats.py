"""Conversion between objects and files of Gaussian splats."""

from dataclasses import replace

import bpy
import numpy as np

from ... import core
from ...command.clouds import with_columns
from ...core.files import choose_origin
from ...core.files.table import NORMAL
from ...tools.quantities import PREFIX
from ..objects.attributes import (
    ONLY_DRAWN,
    STORABLE,
    has_vectors,
    own_positions,
    point_count,
    read_attribute,
    remove_attributes,
    tag_changed,
    write_attribute,
)
from ..objects.deleting import keep_points
from ..objects.place import OFFSET, place_of
from ..objects.splat_file import (
    OWN_OFFSET,
    keep_format,
    keep_raw,
    own_offset,
    read_format,
    read_raw,
    with_digits,
    write_places,
)
from ..objects.splats import BASE, HARMONIC, ROTATION, SCALE, column_names, growth, remember_places, shown_splats
from .objects import add_column, read_colors

_NORMALS = ("nx", "ny", "nz")  # columns
_NUMBER = ".number"  # a column beside those of a file: which point it is
_TYPE = "GAUSSIAN_SPLAT"  # of point clouds, from Blender 5.3 on
_UPRIGHT = {
    "Z": 0,
    "Y": 1,
    "-Y": -1,
}  # rotation about x in units of 90 degrees, by the axis of the file that points upwards


def add_splats(name, splats, collection, known=None, up="Z"):
    """Add an object of splats as loose vertices, which become a point cloud by `mark` and Object > Convert; return it.

    Coordinates are those of the file, less an offset if they are far from the origin: `known`, that of other objects,
    if they are near enough. The object is rotated instead, by the axis of the file that points upwards: "Z", "Y" or
    "-Y".
    """
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(splats))
    obj = bpy.data.objects.new(name, mesh)
    obj.rotation_euler.x = _UPRIGHT[up] * 0.5 * np.pi
    _write_shifted(obj, splats.positions.astype(np.float64), _rotation(_UPRIGHT[up]), known)
    _write(obj, splats)
    mesh.update()
    collection.objects.link(obj)
    return obj


def _write(obj, splats):
    """Write the attributes of splats, whose places are those of the points, and what their file holds besides."""
    data = obj.data
    remember_places(data)
    write_attribute(data, SCALE, splats.scales, "FLOAT_VECTOR")
    write_attribute(data, ROTATION, splats.rotations, "QUATERNION")
    kinds = bpy.types.Attribute.bl_rna.properties["data_type"].enum_items
    base = np.column_stack([splats.colors, splats.opacities])
    write_attribute(data, BASE, base, "FLOAT4" if "FLOAT4" in kinds else "FLOAT_COLOR")
    for number in range(splats.harmonics.shape[1]):
        write_attribute(data, f"{HARMONIC}{number}", splats.harmonics[:, number], "FLOAT_VECTOR")
    if splats.file is not None:
        _keep_file(obj, splats)


def splats_of_columns(obj):
    """Return the splats whose columns in a file the points of an object have as attributes; see `holds_columns`.

    Notices tell what was guessed or left out. Return also which points they are, (n,) bool: those of finite numbers.
    """
    data = obj.data
    columns = dict(zip("xyz", own_positions(data).T, strict=True))
    if has_vectors(data, NORMAL):  # which Blender makes of three columns
        columns |= dict(zip(_NORMALS, read_attribute(data, NORMAL).T, strict=True))
    columns |= {name: read_attribute(data, name) for name in column_names(data)}
    colors = read_colors(data)
    if colors is not None and not columns.keys() & {"f_dc_0", "red"}:  # which Blender has made of these
        values = np.rint(255.0 * colors[:, :3]).astype(np.uint8)
        columns |= dict(zip(("red", "green", "blue"), values.T, strict=True))
    number = np.arange(point_count(data))
    splats = core.splats.from_columns({**columns, _NUMBER: number}, obj.name)
    kept = np.isin(number, splats.file.columns.pop(_NUMBER))
    return splats, kept


def write_in_place(context, obj, splats, kept):
    """Let those points of an object that are kept, (n,) bool, be splats instead of points with columns."""
    if not kept.all():
        keep_points(context, obj, kept)
    remove_attributes(obj.data, *splats.file.columns, NORMAL)
    _write(obj, splats)
    tag_changed(obj.data)


def _rotation(quarters):
    """Return the rotation by multiples of 90 degrees about x, (3, 3), without rounding."""
    return np.linalg.matrix_power(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), quarters)


def _write_shifted(obj, places, rotation, known):
    """Write positions of a file, less an offset if they are far away, which the object keeps in world axes."""
    rotated = places @ rotation.T
    origin = choose_origin(rotated, known)
    if known is None or (origin != known).any():
        # With a few floaters far away, a shift to the center of all would cost the others digits.
        nearer = np.median(np.abs(rotated - origin), axis=0) < np.median(np.abs(rotated), axis=0)
        origin = np.where(nearer, origin, 0.0)
    own = origin @ rotation
    if origin.any():
        obj[OFFSET], obj[OWN_OFFSET] = origin.tolist(), own.tolist()
    write_places(obj.data, places - own)


def _keep_file(obj, splats):
    """Keep on an object what its file holds beside the splats."""
    columns = splats.file.columns
    keep_raw(obj.data, columns)
    for name in columns.keys() - _known_columns(splats):
        add_column(obj.data, name, columns[name])
    keep_format(obj, splats.file)


def _known_columns(splats):
    """Return the names of the columns that splats contain."""
    rest = splats.harmonics.shape[1]
    per_channel = sum(name.startswith("f_rest_") for name in splats.file.columns) // 3
    numbers = (per_channel * channel + number for channel in range(3) for number in range(rest))
    return {*core.splats.NEEDED, *(f"f_rest_{number}" for number in numbers)}


def mark(data):
    """Set the type of a point cloud to splats, where Blender has it."""
    kind = data.bl_rna.properties.get("type")
    if kind is not None and _TYPE in kind.enum_items:
        data.type = _TYPE


def is_drawn(data) -> bool:
    """Whether Blender itself draws the splats of data."""
    return getattr(data, "type", "") == _TYPE


def splats_to_write(obj):
    """Return the deformed splats of an object in the coordinates of their file, with its other data."""
    splats = _with_file(obj)
    return replace(splats, positions=splats.positions + own_offset(obj))


def splats_in_world(objects):
    """Return the displayed splats of objects, in world space without offsets, with the other data of their files."""
    return core.splats.joined([placed_splats(obj) for obj in objects])


def placed_splats(obj):
    """Return the displayed splats of an object, likewise."""
    splats = _with_file(obj)
    matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    maps = np.broadcast_to(matrix, (len(splats), 3, 3))
    return splats.deformed(splats.positions @ matrix.T + place_of(obj), maps)


def _with_file(obj):
    """Return the deformed splats of an object in local space, with the other data of their file."""
    splats, data, known = shown_splats(obj), obj.data, read_format(obj)
    positions = with_digits(data, splats.positions.astype(np.float32))
    if known is None:
        return replace(splats, positions=positions)
    order, comments, types = known
    raw = read_raw(data, len(splats))
    columns = {}
    for name, code in types.items():
        if name in raw:
            values = raw[name]
        elif name in data.attributes:
            values = read_attribute(data, name)
        else:  # written from the splats, or deleted since
            values = np.zeros(len(splats))
        columns[name] = values.astype(code)
    file = core.splats.SplatFile(columns, order, comments)
    grown = growth(read_attribute(data, SCALE), splats.scales)
    return replace(splats, positions=positions, file=file.scaled(grown))


def with_results(splats, data):
    """Return splats to be written with the results of their points as further columns of the file."""
    names = [
        layer.name
        for layer in data.attributes
        if layer.name.startswith(PREFIX) and layer.name not in ONLY_DRAWN and layer.data_type in STORABLE
    ]
    return with_columns(splats, {name: read_attribute(data, name) for name in names})
