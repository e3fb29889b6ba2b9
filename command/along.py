"""Along the surface from points or a curve: distances, cells, a map, directions; for files and for Blender's tools."""

import numpy as np

from . import core
from .groups import SOURCE, unreached
from .results import Told
from .settings import Setting, place, radians

UNREACHED = -1.0  # distance of points that no source reaches
OUTSIDE = -1.0  # texture coordinates of points that the map does not reach


def group_setting(description):
    """Return the settings of a tool whose only one is the group of its sources."""
    return {"group": Setting("group", description, SOURCE)}


GEODESIC = group_setting(
    "Vertex group of the sources; where there is none of that name, the points selected in Edit Mode"
)
NEAREST = group_setting(
    "Vertex group with the points that are centers of cells; where there is none of that name, the points selected in"
    " Edit Mode"
)
UNWRAP = group_setting(
    "Vertex group around the center of the texture, which is the point nearest to the mean of its points; where there"
    " is none of that name, the points selected in Edit Mode"
) | {
    setting.name: setting
    for setting in (
        Setting(
            "radius",
            "Distance along the surface from the center of the texture to its border; 0 for all points",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting("angle", "Rotation of the texture about its center", 0.0, convert=radians, form="DEGREES"),
    )
}
EXTEND = group_setting(
    "Vertex group with the points that have the direction; where there is none of that name, the points selected in"
    " Edit Mode"
) | {
    "direction": Setting(
        "direction",
        "Direction at these points, along the axes of the world; projected onto the surface",
        (0.0, 0.0, -1.0),
        convert=place,
        form="X,Y,Z",
    )
}


def check_distances(sources, name):
    """Refuse sources, (n,) bool, that are all points of a cloud of some name."""
    if sources.all():
        raise core.PointCloudError(
            f'All points of "{name}" are sources, so that all distances are 0. Select fewer of them, or choose a'
            " smaller group."
        )


def distance(laplacian, sources, cache, progress):
    """Return geodesic distances from sources, (n,); infinite where none is reached.

    `cache` keeps results, here and below: the cache of Blender's side, or the module `uncached`.
    """
    return cache.result(
        laplacian,
        "distance",
        sources,
        compute=lambda: cache.geodesics(laplacian, progress).distance(sources, progress=progress),
    )


def told_distance(found, name, length_text) -> Told:
    """Return distances as they are written, with what there is to tell of a cloud of some name."""
    reached = np.isfinite(found)
    notices = unreached(reached, name, f"Their distance is {UNREACHED:g}.")
    line = f"{name}: distances up to {length_text(found[reached].max())}"
    return Told(np.where(reached, found, UNREACHED), notices, line)


def cells(laplacian, sources, cache, progress):
    """Return the number of the nearest source, (n,) int; -1 where none is reached."""
    return cache.result(
        laplacian,
        "cells",
        sources,
        compute=lambda: cache.geodesics(laplacian, progress).nearest_source(sources, progress=progress),
    )


def told_cells(found, name) -> Told:
    """Return cells with what there is to tell of them."""
    count = len(np.unique(found[found >= 0]))
    return Told(found, unreached(found >= 0, name, "Their cell is -1."), f"{name}: {count:,} cells")


def center_of(points, sources) -> int:
    """Return that one of some sources, (n,) bool, that is nearest to their mean."""
    rows = np.flatnonzero(sources)
    return int(rows[np.linalg.norm(points[rows] - points[rows].mean(axis=0), axis=1).argmin()])


def texture(laplacian, center, radius, angle, name, cache, progress):
    """Return texture coordinates around a point, (n, 2), and how far they go: the radius, or to the farthest point."""
    if laplacian.component[center] < 0:
        raise core.PointCloudError(
            f'The center is a point of "{name}" that the operator left out, because it is an outlier.'
            " Choose a point of the surface."
        )
    place = cache.result(
        laplacian,
        "map",
        center,
        compute=lambda: _transport(laplacian, cache, progress).logarithmic_map(
            center, geodesics=cache.geodesics(laplacian, progress), progress=progress
        ),
    )
    reached = np.isfinite(place[:, 0])
    place = place @ [1.0, 1.0j]
    border = radius or np.abs(place[reached]).max()
    found = 0.5 + 0.5j + 0.5 * np.exp(1j * angle) * place / border
    return np.where(reached[:, None], np.column_stack([found.real, found.imag]), OUTSIDE), border


def texture_line(border, name, length_text) -> str:
    """Return how far texture coordinates go as a text."""
    return f"{name}: texture coordinates up to {length_text(border)} from the center"


def directions(laplacian, sources, direction, cache, progress):
    """Return directions, (n, 3), of any length along the surface; zero where no source reaches."""
    return cache.result(
        laplacian,
        "directions",
        sources,
        direction,
        compute=lambda: _transport(laplacian, cache, progress).extend(sources, direction, progress=progress),
    )


def unit_directions(found, local=lambda vectors: vectors):
    """Return directions as unit vectors, (n, 3), after a linear map; those of zero length stay zero."""
    reached, result = found.any(axis=1), np.zeros_like(found)
    turned = local(found[reached])
    result[reached] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return result


def told_directions(found, name) -> Told:
    """Return directions with what there is to tell of them."""
    notices = unreached(found.any(axis=1), name, "They have no direction.")
    return Told(found, notices, f"{name}: directions on {len(found):,} points")


def beside_curve(laplacian, places, closed, cache, progress):
    """Return signed distances from a curve through the points nearest to places, (k, 3), in their order.

    Positive on its left, infinite where it does not reach. Its last point is joined with the first if it is closed.
    """
    known = np.flatnonzero(laplacian.component >= 0)
    nearest = known[core.geometry.nearest_rows(laplacian.points[known], places)]
    _, first = np.unique(nearest, return_index=True)
    curve = nearest[np.sort(first)]
    if len(curve) < 2:
        raise core.PointCloudError("All of the curve lies at one point of the cloud. Draw it along the surface.")
    return cache.result(
        laplacian,
        "sides of a curve",
        curve,
        closed,
        compute=lambda: cache.geodesics(laplacian, progress).signed_distance(
            curve, closed and len(curve) > 2, progress=progress
        ),
    )


def told_sides(found, name, length_text) -> Told:
    """Return signed distances as they are written, with what there is to tell of them."""
    reached = np.isfinite(found)
    low, high = (length_text(value) for value in (found[reached].min(), found[reached].max()))
    notices = unreached(reached, name, "Their distance is 0.")
    return Told(np.where(reached, found, 0.0), notices, f"{name}: {low} on the right to {high} on the left")


def _transport(laplacian, cache, progress):
    return cache.result(laplacian, "transport", compute=lambda: core.distance.Transport(laplacian, progress=progress))
