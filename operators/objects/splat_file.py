"""Data of a splat file that Blender does not show, kept so that unchanged values are written as they were."""

import json

import numpy as np

from ...core.linalg import solve
from .attributes import own_positions, read_attribute, remove_attributes, write_attribute, write_own_positions
from .place import OFFSET, offset_of

FORMAT = "lb_splat_format"  # custom property of an object: the format of its file
OWN_OFFSET = "lb_splat_offset"  # custom property: `OFFSET` in the axes of the file
DIGITS = "ply_digits"  # attribute: positions in double precision less those in single precision
# What decoding a file loses: attributes and their columns.
RAW = {
    "ply_scale": ("FLOAT_VECTOR", ("scale_0", "scale_1", "scale_2")),
    "ply_rotation": ("FLOAT_COLOR", ("rot_0", "rot_1", "rot_2", "rot_3")),
    "ply_opacity": ("FLOAT", ("opacity",)),
}
_ORDER, _COMMENTS, _COLUMNS = "order", "comments", "columns"


def keep_format(obj, file):
    """Keep the format of a file on an object."""
    types = [[name, values.dtype.str[1:]] for name, values in file.columns.items()]
    obj[FORMAT] = json.dumps({_ORDER: file.order, _COMMENTS: file.comments, _COLUMNS: types})


def read_format(obj):
    """Return byte order, comments, and types of columns by name; None if none are kept."""
    kept = obj.get(FORMAT)
    if not kept:
        return None
    kept = json.loads(kept)
    return kept[_ORDER], tuple(kept[_COMMENTS]), dict(kept[_COLUMNS])


def add_columns(obj, others):
    """Add the columns of the files of other objects to the format kept on an object."""
    formats = [known for known in map(read_format, (obj, *others)) if known]
    if formats:
        order, comments, _ = formats[0]
        columns = {name: code for known in reversed(formats) for name, code in known[2].items()}
        columns = {**formats[0][2], **columns, **formats[0][2]}
        obj[FORMAT] = json.dumps({_ORDER: order, _COMMENTS: comments, _COLUMNS: list(columns.items())})


def keep_raw(data, columns):
    """Keep the values of columns that decoding loses, unless they are kept already."""
    for name, (kind, parts) in RAW.items():
        if name not in data.attributes:
            write_attribute(data, name, np.column_stack([columns[part] for part in parts]), kind)


def read_raw(data, count) -> dict:
    """Return the values of columns that decoding loses, zeros where none were kept."""
    columns = {}
    for name, (_, parts) in RAW.items():
        values = read_attribute(data, name) if name in data.attributes else np.zeros((count, len(parts)))
        columns.update(zip(parts, values.reshape(count, -1).T, strict=True))
    return columns


def write_places(data, places):
    """Move points to positions in double precision, (n, 3), and keep the digits that single precision loses."""
    write_own_positions(data, places)
    digits = (places - places.astype(np.float32)).astype(np.float32)
    if digits.any():
        write_attribute(data, DIGITS, digits, "FLOAT_VECTOR")
    else:
        remove_attributes(data, DIGITS)


def with_digits(data, positions):
    """Return positions, (n, 3) float32, with their kept digits, (n, 3) float64, where these are still valid."""
    places = positions.astype(np.float64)
    if DIGITS not in data.attributes:
        return places
    more = places + read_attribute(data, DIGITS)
    return np.where(more.astype(np.float32) == positions, more, places)


def own_places(data):
    """Return the positions of points in local space with all digits, (n, 3) float64."""
    return with_digits(data, own_positions(data))


def own_offset(obj):
    """Return the offset from local positions to those of the file, (3,) float64."""
    if OWN_OFFSET in obj:
        return np.array(obj[OWN_OFFSET], dtype=np.float64)
    if OFFSET not in obj:
        return np.zeros(3)
    return solve(np.array(obj.matrix_world, dtype=np.float64)[:3, :3], offset_of(obj))
