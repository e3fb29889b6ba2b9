"""Surface gradients of displayed values, by which colours are interpolated within discs."""

import zlib
from functools import partial

import numpy as np

from .. import core
from ..operators.objects.attributes import (
    DISC,
    SLOPE,
    SLOPE_2,
    SLOPE_OF,
    has_vectors,
    own_positions,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from ..operators.objects.handlers import notify
from ..operators.objects.reading import sharing_objects
from ..operators.running import cache
from ..operators.running.later import drop, later

_KIND = "Slopes"  # of what is found later
_BOUNDS = -3e38, 3e38  # of single precision: larger gradients are clipped


def follow(obj, name, part, columns, spacing):
    """Write the gradients of an object's displayed values, if there are discs that can show them; of many points later.

    Name and part are those on display; columns are the numbers, one or two for each point, empty where they have no
    gradient. The spacing of the points is the length in which discs are kept.
    """
    kept, data = obj.meshfree, obj.data
    if not _is_writable(data):  # as in Edit Mode: earlier gradients are valid for the same attribute
        kept.slopes_of = kept.slopes_of if columns and kept.slopes_of.startswith(f"{part} {name} ") else ""
        return
    points = own_positions(data)
    if not columns or not has_vectors(data, DISC) or not np.isfinite(points).all():
        forget(obj)
        kept.slopes_of = ""
        if not any(other.meshfree.slopes_of for other in sharing_objects(obj)):
            remove_attributes(data, SLOPE, SLOPE_2, SLOPE_OF)
        return
    discs = read_attribute(data, DISC)
    seen = _checksum(points, discs)
    wanted = f"{part} {name} {seen} {_checksum(*columns)} {spacing:.6g}"
    holders = [other for other in (obj, *sharing_objects(obj)) if other.meshfree.slopes_of == wanted]
    kept.slopes_of = wanted if holders and SLOPE in data.attributes else ""
    if kept.slopes_of:
        forget(obj)
        return

    def compute(progress):
        slopes = cache.fetch(cache.content("slopes", points, discs, spacing), lambda: _slopes(points, discs, spacing))
        return [np.clip(slopes.of(values, progress=progress), *_BOUNDS) for values in columns]

    values = _as_number(read_attribute(data, name))
    kept.slopes_later = True
    later(_KIND, obj, wanted, compute, partial(_take, seen, values))


def forget(obj):
    """Drop gradients that are still to be found."""
    drop(_KIND, obj)
    if obj.meshfree.slopes_later:
        obj.meshfree.slopes_later = False


def _take(seen, values, obj, wanted, job):
    """Write gradients of values, unless points or discs, of which a checksum is known, have changed since."""
    data = obj.data
    if not _is_writable(data):
        obj.meshfree.colors_behind = True  # until Edit Mode is left
        return
    if not has_vectors(data, DISC) or _checksum(own_positions(data), read_attribute(data, DISC)) != seen:
        return
    gradients = job.result()
    remove_attributes(data, *(SLOPE, SLOPE_2)[len(gradients) :])
    for kind, gradient in zip((SLOPE, SLOPE_2), gradients, strict=False):
        write_attribute(data, kind, gradient)
    write_attribute(data, SLOPE_OF, values)
    for other in sharing_objects(obj):
        other.meshfree.slopes_of = ""
    obj.meshfree.slopes_of, obj.meshfree.slopes_later = wanted, False
    notify("shape_changed", obj)


def _is_writable(data):
    return data.is_editable and data.override_library is None and not getattr(data, "is_editmode", False)


def _checksum(*arrays):
    checksum = 0
    for array in arrays:
        checksum = zlib.crc32(np.ascontiguousarray(array), checksum)
    return f"{checksum:08x}"


def _slopes(points, discs, spacing):
    radii = np.linalg.norm(discs, axis=1)
    normals = np.divide(
        discs, radii[:, None], out=np.tile([0.0, 0.0, 1.0], (len(discs), 1)), where=radii[:, None] > 0.0
    )
    return core.measure.Slopes(points, core.surface.Discs(normals, radii.astype(np.float64) * spacing))


def _as_number(values):
    """Convert values to numbers as Blender does: vectors to their means, in single precision."""
    return values if values.ndim == 1 else sum(values.T) / np.float32(values.shape[1])
