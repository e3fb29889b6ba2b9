"""The discs of the display after a tool has moved the points."""

import numpy as np

from ... import core
from ..objects.carried import discs_at_rest
from ..objects.reading import discs
from . import cache


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
        local = reading.local(full)
        found = cache.fetch(cache.content("discs", local), lambda: core.surface.surface_discs(local))
        moved = discs(core.geometry.toward(found.normals, rest), found.radii, local)
        steps = [np.linalg.norm(places - reading.points, axis=1) for places in (points, full)]
        share = np.divide(*steps, out=np.zeros(len(local)), where=steps[1] > 0.0)
        return rest + np.minimum(share, 1.0)[:, None] * (moved - rest)

    return find
