"""The discs that the display draws, found anew where a tool moves the points."""

import numpy as np

from ... import core
from ..objects.carried import discs_at_rest
from ..objects.reading import discs
from . import cache


def disc_finder(obj, reading):
    """Read what discs an object draws; return a function that finds those of moved points.

    It takes where the points go at full strength, as `reading.points`, and where they go, and returns normals times
    radii, (n, 3), in local space; None where none are drawn. Discs are found for full strength, and kept; of what lies
    on the way they are mixed, so that a change of the strength finds nothing anew.
    """
    rest = discs_at_rest(obj)

    def find(full, points):
        if rest is None:
            return None
        local = reading.local(full)
        found = cache.fetch(cache.content("discs", local), lambda: core.surface_discs(local))
        moved = discs(core.geometry.toward(found.normals, rest), found.radii, local)
        steps = [np.linalg.norm(places - reading.points, axis=1) for places in (points, full)]
        share = np.divide(*steps, out=np.zeros(len(local)), where=steps[1] > 0.0)
        return rest + np.minimum(share, 1.0)[:, None] * (moved - rest)

    return find
