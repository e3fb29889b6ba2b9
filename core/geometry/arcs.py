"""Lengths of the arcs that join pairs within the surface of a cloud."""

import numpy as np

from ..algebra import on_all_cores
from ..types import Floats
from .cloud import Cloud
from .distances import arc_squared, bent_ways, dots, pair_heights
from .patches import Patch


def arc_length(cloud: Cloud) -> Floats:
    """Return the length of the arc that joins each pair within the surface, (p,).

    That of `arc_squared`, or of `bent_ways` where an edge is near, and ``g max(r^2 - a^2, 0)`` more: the path up and
    down over a roughness finer than the normals resolve, of mean squared slope g, the mean of both ends. Between points
    one spacing a apart the chord is that path. The second normal is flipped to the first one's side, pair by pair, by
    the normals of all neighbors: signs do not matter.
    """
    pairs, steep = cloud.pairs, cloud.squared_slope.any()
    result = np.empty(len(pairs.first))
    points, normals = pairs.points.T.copy(), cloud.sides.normals.T.copy()
    around, sharp = cloud.sides.around.T.copy(), cloud.sides.sharp

    def measure(patch: Patch) -> None:
        chord, left, right, cosine = pair_heights(patch.first, patch.second, points, normals)
        side = np.where(dots(patch.first(around), patch.second(around)) < 0.0, -1.0, 1.0)
        right, cosine = side * right, side * cosine
        squared = pairs.distance[patch.pairs] ** 2
        arc = arc_squared(squared, left, right, cosine)
        sure = np.maximum(patch.first(sharp), patch.second(sharp))
        edged = np.flatnonzero(sure)
        if len(edged):
            first, second = (ends[patch.pairs][edged] for ends in (pairs.first, pairs.second))
            turn = cloud.sides.turn(first, second, chord[:, edged], side[edged])
            arc[edged] = bent_ways(squared[edged], left[edged], right[edged], cosine[edged], turn, sure[edged])[0]
        if steep:
            arc += patch.mean(cloud.squared_slope) * np.maximum(squared - patch.mean(cloud.spacing) ** 2, 0.0)
        result[patch.pairs] = np.sqrt(arc)

    on_all_cores(measure, pairs.patches)
    return result
