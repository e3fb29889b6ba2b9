"""Transfer Attributes: points take colors, numbers, vectors and labels from the surface of other objects."""

from typing import NamedTuple

import bpy
import numpy as np

from ...command import transferring
from ...core import PointCloudError
from ...tools.quantities import quantity
from ..objects.attributes import STORABLE, check_names, point_count, read_attribute, write_attribute
from ..objects.colors import COLORS, own_colors
from ..objects.properties import property_of
from ..registration import Registration, Row
from .transfer import Transfer, TransferOperator

_SMOOTH = ("FLOAT", "FLOAT_VECTOR", "FLOAT2", *COLORS)  # types whose values are averaged
_LABELS = ("INT", "BOOLEAN", "QUATERNION", "FLOAT4")  # and those that are taken from the nearest point
_OWN = ("position", "radius")  # what Blender itself keeps at points, beside names with a leading dot


class _Values(NamedTuple):
    """An attribute of the points of an object."""

    data_type: str  # with which it is written
    smooth: bool  # whether it may be averaged
    array: np.ndarray  # (n, k) or (n,), vectors in world space


class _Attributes(NamedTuple):
    """What is read of an object: its attributes, by name, and which others are left out."""

    found: dict
    left_out: list


class _Change(NamedTuple):
    """The new values of the points of an object, by the names of attributes, where these are from, and notices."""

    values: dict
    match: object
    sources: list
    notices: list


class TransferAttributes(Transfer):
    """The settings and the work of `meshfree.transfer_attributes`."""

    _shown = ""
    shows_colors = True
    asks = ("reverse", "distance", "angle", "attributes", "pattern", "preview", "show")

    attributes: property_of(transferring.ATTRIBUTES["attributes"])
    pattern: property_of(transferring.ATTRIBUTES["pattern"])

    def shown_result(self):
        return self._shown

    def read_values(self, obj):
        color = _color_name(obj)
        found, left_out = {}, []
        matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
        for attribute in obj.data.attributes:
            name = attribute.name
            if not self._wants(name, color):
                continue
            values = _read(obj, attribute, matrix)
            if values is None:
                left_out.append(name)
            else:
                found[name] = values
        transferring.check_found(found, self, f'"{obj.name}"')
        return _Attributes(found, left_out)

    def _wants(self, name, color):
        hidden = self.attributes != "COLOR" and (name.startswith(".") or name in _OWN)
        return not hidden and transferring.is_wanted(name, self, color)

    def plan(self, context, obj):
        sources = self.sources(context, obj)
        given = [source.values for source in sources]
        first = given[0].found
        names = [name for name in first if all(_fits(values, name, first[name].data_type) for values in given)]
        left_out = sorted({name for values in given for name in (*values.found, *values.left_out)} - set(names))
        if not names:
            raise PointCloudError("No attribute is there, of one type, in all sources. Transfer from one at a time.")
        check_names(obj, names)
        reading, find = self.matcher(context, obj, sources)
        arrays = {name: np.concatenate([values.found[name].array for values in given]) for name in names}
        smooth = [name for name in names if first[name].smooth]
        preview = self.preview
        notices = transferring.left_out(left_out)

        def compute(progress):
            match, new = find(progress), {}
            if not preview:
                new = transferring.taken(match, arrays, smooth, lambda stage, share: progress(stage, 0.8 + 0.2 * share))
                for name in names:
                    if first[name].data_type == "FLOAT_VECTOR":
                        new[name] = reading.local(new[name])
            return _Change({name: (first[name].data_type, new[name]) for name in new}, match, sources, notices)

        return compute

    def write(self, context, obj, result):
        what = transferring.counted(result.sources[0].values.found)
        texts = self.write_state(obj, result.match, result.sources, what)
        for name, (data_type, values) in result.values.items():
            write_attribute(obj.data, name, values, data_type)
        self._shown = next((name for name, (kind, _) in result.values.items() if kind in STORABLE), "")
        return [*result.notices, *texts]


def _fits(values, name, data_type):
    """Whether an object has an attribute of a type."""
    return name in values.found and values.found[name].data_type == data_type


def _color_name(obj):
    """Return the name of the attribute with the colors of an object, at points or at corners of faces."""
    data = obj.data
    active = data.color_attributes.active_color_name if isinstance(data, bpy.types.Mesh) else ""
    return active or own_colors(data)


def _read(obj, attribute, matrix):
    """Read an attribute, with vectors in world space; None if it is not one of points, or not finite."""
    name, kind, data = attribute.name, attribute.data_type, obj.data
    if kind in COLORS and attribute.domain in {"POINT", "CORNER"}:
        array = _colors(data, attribute)
        kind = "FLOAT_COLOR"
    elif attribute.domain == "POINT" and kind in (*_SMOOTH, *_LABELS):
        array = read_attribute(data, name)
    else:
        return None
    if kind != "BOOLEAN" and not np.isfinite(array).all():
        return None
    if kind == "FLOAT_VECTOR":
        array = array @ matrix.T
    return _Values(kind, kind in _SMOOTH and quantity(name).carried != "label", array)


def _colors(data, attribute):
    """Return the linear colors of points, (n, 4); of those at corners of faces the means."""
    colors = np.empty((len(attribute.data), 4), np.float32)
    attribute.data.foreach_get("color", colors.reshape(-1))
    if attribute.domain == "POINT":
        return colors
    owner = np.empty(len(data.loops), np.int32)
    data.loops.foreach_get("vertex_index", owner)
    total = np.zeros((point_count(data), 4))
    np.add.at(total, owner, colors)
    corners = np.bincount(owner, minlength=len(total))
    return total / np.maximum(corners, 1)[:, None]


class MESHFREE_OT_transfer_attributes(TransferAttributes, TransferOperator, bpy.types.Operator):
    """Transfer colors, numbers, vectors and labels from the surface of the active object to the other selected ones"""

    bl_idname = "meshfree.transfer_attributes"
    bl_label = "Transfer Attributes"


TOOLS = (
    Registration(
        MESHFREE_OT_transfer_attributes,
        panel=Row("Two Scans", 1, 3),
        menu=Row("Object", 2, 6),
    ),
)
