"""Objects of files of Gaussian splats, and files of such objects."""

import json
from dataclasses import replace

import bpy
import numpy as np

from ... import core
from ...core.files.table import split_columns
from ..objects.attributes import PREFIX, STORABLE, read_attribute, write_attribute
from ..objects.splats import BASE, HARMONIC, ROTATION, SCALE, shown_splats
from .objects import add_column

FORMAT = "lb_splat_format"  # custom property of an object: how the file that it came from was laid out
# What decoding a file loses, so that what is not changed can be written as it was: attributes and their columns.
_RAW = {
    "ply_scale": ("FLOAT_VECTOR", ("scale_0", "scale_1", "scale_2")),
    "ply_rotation": ("FLOAT_COLOR", ("rot_0", "rot_1", "rot_2", "rot_3")),
    "ply_opacity": ("FLOAT", ("opacity",)),
}
_TYPE = "GAUSSIAN_SPLAT"  # of point clouds, from Blender 5.3 on


def add_splats(name, splats, collection):
    """Add an object of splats as loose vertices, which become a point cloud by `mark` and Object > Convert.

    Coordinates are those of the file.

    Returns
    -------
    bpy.types.Object
    """
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(splats))
    mesh.attributes["position"].data.foreach_set("vector", splats.positions.astype(np.float32).reshape(-1))
    write_attribute(mesh, SCALE, splats.scales, "FLOAT_VECTOR")
    write_attribute(mesh, ROTATION, splats.rotations, "QUATERNION")
    kinds = bpy.types.Attribute.bl_rna.properties["data_type"].enum_items
    base = np.column_stack([splats.colors, splats.opacities])
    write_attribute(mesh, BASE, base, "FLOAT4" if "FLOAT4" in kinds else "FLOAT_COLOR")
    for number in range(splats.harmonics.shape[1]):
        write_attribute(mesh, f"{HARMONIC}{number}", splats.harmonics[:, number], "FLOAT_VECTOR")
    obj = bpy.data.objects.new(name, mesh)
    if splats.file is not None:
        _keep_file(obj, splats)
    mesh.update()
    collection.objects.link(obj)
    return obj


def _keep_file(obj, splats):
    """Keep on an object what its splats do not tell of their file."""
    columns = splats.file.columns
    for name, (kind, parts) in _RAW.items():
        write_attribute(obj.data, name, np.column_stack([columns[part] for part in parts]), kind)
    known = _known_columns(splats)
    for name in columns.keys() - known:
        add_column(obj.data, name, columns[name])
    types = [[name, values.dtype.str[1:]] for name, values in columns.items()]
    obj[FORMAT] = json.dumps({"order": splats.file.order, "comments": splats.file.comments, "columns": types})


def _known_columns(splats):
    """Return the names of the columns that splats are made of."""
    rest = splats.harmonics.shape[1]
    per_channel = sum(name.startswith("f_rest_") for name in splats.file.columns) // 3
    numbers = (per_channel * channel + number for channel in range(3) for number in range(rest))
    return {*core.splats.NEEDED, *(f"f_rest_{number}" for number in numbers)}


def mark(data):
    """Tell Blender that a point cloud is one of splats, where it knows such."""
    kind = data.bl_rna.properties.get("type")
    if kind is not None and _TYPE in kind.enum_items:
        data.type = _TYPE


def is_drawn(data) -> bool:
    """Whether Blender itself draws the splats of data."""
    return getattr(data, "type", "") == _TYPE


def splats_to_write(obj) -> "core.Splats":
    """Return the splats of an object as a deformation shows them, in local space, with what their file held."""
    splats, data = shown_splats(obj), obj.data
    written = obj.get(FORMAT)
    if not written:
        return splats
    written = json.loads(written)
    raw = {}
    for name, (_, parts) in _RAW.items():
        values = read_attribute(data, name) if name in data.attributes else np.zeros((len(splats), len(parts)))
        raw.update(zip(parts, values.reshape(len(splats), -1).T, strict=True))
    columns = {}
    for name, code in written["columns"]:
        if name in raw:
            values = raw[name]
        elif name in data.attributes:
            values = read_attribute(data, name)
        else:  # written from the splats, or deleted since
            values = np.zeros(len(splats))
        columns[name] = values.astype(code)
    file = core.splats.SplatFile(columns, written["order"], tuple(written["comments"]))
    rest = (splats.positions, splats.scales, splats.rotations, splats.opacities, splats.colors, splats.harmonics)
    return core.Splats(*rest, file=file)


def with_results(splats, data):
    """Return splats to be written with the results that their points hold, as columns of the file beside its own."""
    columns = {} if splats.file is None else dict(splats.file.columns)
    for layer in data.attributes:
        if layer.name.startswith(PREFIX) and layer.data_type in STORABLE:
            columns.update(split_columns(layer.name, read_attribute(data, layer.name)))
    return replace(splats, file=(splats.file or core.splats.SplatFile({}))._replace(columns=columns))
