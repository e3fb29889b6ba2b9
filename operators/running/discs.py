"""The discs of the display after points were moved, added or deleted."""

import numpy as np

from ... import core
from ...core import PointCloudError
from ..objects.attributes import (
    DISC,
    own_positions,
    points_checksum,
    read_attribute,
    remove_attributes,
)
from ..objects.carried import discs_at_rest, write_discs
from ..objects.handlers import notify
from ..objects.reading import discs
from . import cache
from .later import later


def disc_finder(obj):
    """Read the discs of an object's display; return a function that computes those of moved points.

    Its arguments are how the points were read, the points at full strength in that space, and the points; it returns
    normals times radii, (n, 3), in local space, None without discs. Discs are computed for full strength, and kept;
    interpolation gives those of lower strengths.
    """
    rest = discs_at_rest(obj)

    def find(reading, full, points):
        if rest is None:
            return None
        moved = _found(reading.local(full), rest)
        steps = [np.linalg.norm(places - reading.points, axis=1) for places in (points, full)]
        share = np.divide(*steps, out=np.zeros(len(rest)), where=steps[1] > 0.0)
        return rest + np.minimum(share, 1.0)[:, None] * (moved - rest)

    return find


def _found(local, sides, progress=None):
    """Find the discs of points in local space, on the sides of vectors, both (n, 3); see `DISC`."""
    key = cache.content("discs", local)
    found = cache.fetch(key, lambda: core.surface.surface_discs(local, progress=progress))
    return discs(core.geometry.toward(found.normals, sides), found.radii, local)


def renew_discs(obj, points):
    """Find the discs of an object's display again if they are of other points than the checksum; of many in a thread.

    Sides stay. Where points have no tangent planes any more they become dots.
    """
    data = obj.data
    if DISC not in data.attributes or obj.meshfree.discs_of in ("", points):  # empty where it is not known
        return
    local, sides = own_positions(data).astype(np.float64), read_attribute(data, DISC).astype(np.float64)
    later("Discs", obj, points, lambda progress: _found(local, sides, progress), _take)


def _take(obj, points, job):
    """Write the discs that were found, unless the points have changed since."""
    if obj.mode != "OBJECT" or points_checksum(obj.data) != points:
        return
    try:
        write_discs(obj, job.result())
    except PointCloudError:  # such as of a line, or of too few
        remove_attributes(obj.data, DISC)
    notify("shape_changed", obj)
