"""What splats keep of their file beside what Blender shows, so that what is not changed is written as it was."""

import json

import numpy as np

from .attributes import own_positions, read_attribute, remove_attributes, write_attribute, write_own_positions
from .place import OFFSET, offset_of

FORMAT = "lb_splat_format"  # custom property of an object: how the file that it came from was laid out
OWN_OFFSET = "lb_splat_offset"  # custom property: what `OFFSET` is along the axes that the file had
DIGITS = "ply_digits"  # attribute: what places in double precision have beyond single precision
# What decoding a file loses: attributes and their columns.
RAW = {
    "ply_scale": ("FLOAT_VECTOR", ("scale_0", "scale_1", "scale_2")),
    "ply_rotation": ("FLOAT_COLOR", ("rot_0", "rot_1", "rot_2", "rot_3")),
    "ply_opacity": ("FLOAT", ("opacity",)),
}
_ORDER, _COMMENTS, _COLUMNS = "order", "comments", "columns"


def keep_format(obj, file):
    """Keep on an object how a file is laid out."""
    types = [[name, values.dtype.str[1:]] for name, values in file.columns.items()]
    obj[FORMAT] = json.dumps({_ORDER: file.order, _COMMENTS: file.comments, _COLUMNS: types})


def read_format(obj):
    """Return the order of bytes, the comments, and the types of columns by their names; None where none are kept."""
    kept = obj.get(FORMAT)
    if not kept:
        return None
    kept = json.loads(kept)
    return kept[_ORDER], tuple(kept[_COMMENTS]), dict(kept[_COLUMNS])


def add_columns(obj, others):
    """Let what is written of an object have the columns of the files of other objects, too."""
    formats = [known for known in map(read_format, (obj, *others)) if known]
    if formats:
        order, comments, _ = formats[0]
        columns = {name: code for known in reversed(formats) for name, code in known[2].items()}
        columns = {**formats[0][2], **columns, **formats[0][2]}
        obj[FORMAT] = json.dumps({_ORDER: order, _COMMENTS: comments, _COLUMNS: list(columns.items())})


def keep_raw(data, columns):
    """Keep the numbers of columns that decoding loses, those that are not there yet."""
    for name, (kind, parts) in RAW.items():
        if name not in data.attributes:
            write_attribute(data, name, np.column_stack([columns[part] for part in parts]), kind)


def read_raw(data, count) -> dict:
    """Return the numbers of columns that decoding loses, zeros where nothing was kept."""
    columns = {}
    for name, (_, parts) in RAW.items():
        values = read_attribute(data, name) if name in data.attributes else np.zeros((count, len(parts)))
        columns.update(zip(parts, values.reshape(count, -1).T, strict=True))
    return columns


def write_places(data, places):
    """Move points to places in double precision, (n, 3), and keep the digits that get lost on the way."""
    write_own_positions(data, places)
    digits = (places - places.astype(np.float32)).astype(np.float32)
    if digits.any():
        write_attribute(data, DIGITS, digits, "FLOAT_VECTOR")
    else:
        remove_attributes(data, DIGITS)


def with_digits(data, positions):
    """Return positions, (n, 3) float32, with the digits beyond them, (n, 3) float64, where these still fit."""
    places = positions.astype(np.float64)
    if DIGITS not in data.attributes:
        return places
    more = places + read_attribute(data, DIGITS)
    return np.where(more.astype(np.float32) == positions, more, places)


def own_places(data):
    """Return the places of points in local space with all their digits, (n, 3) float64."""
    return with_digits(data, own_positions(data))


def own_offset(obj):
    """Return what is added to local positions to get those of the file, (3,) float64."""
    if OWN_OFFSET in obj:
        return np.array(obj[OWN_OFFSET], dtype=np.float64)
    if OFFSET not in obj:
        return np.zeros(3)
    return np.linalg.solve(np.array(obj.matrix_world, dtype=np.float64)[:3, :3], offset_of(obj))
