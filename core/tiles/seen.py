"""Which side of a surface in tiles is seen: from above, from one place, or by the scanner that measured each point."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_array, as_doubles, check_array, check_finite
from ..errors import InvalidPointsError
from ..files import SCANNER
from ..geometry import Sample
from ..types import Array, Floats, Ints
from .site import Site
from .store import Record, Store, Told

ORIENTS = ("outside", "up", "viewpoint")
_CELL = 8.0  # spacings: a surface seen from the front has some 64 points in a cell, of which the nearest counts


def orientation(orient: str, viewpoint: Floats | None, columns: Iterable[str]) -> Record:
    """Return what tiles agree on from the start for the sides of surfaces: "outside", "up" or "viewpoint".

    A viewpoint is from `checked_viewpoint`; columns are the names of what all points tell besides: the place of their
    scanner, if none is given. Another choice, a viewpoint without need, or none raise `InvalidPointsError`.
    """
    if orient not in ORIENTS:
        raise InvalidPointsError(f"Orientation {orient!r} is unknown. Choose one of {', '.join(ORIENTS)}.")
    record = {"orient": np.array(orient)}
    if viewpoint is not None:
        if orient != "viewpoint":
            raise InvalidPointsError(f"A viewpoint does not go with the orientation {orient!r}. Use 'viewpoint'.")
        return {**record, "viewpoint": viewpoint}
    if orient == "viewpoint" and SCANNER not in columns:
        raise InvalidPointsError(
            "No viewpoint is given, and not all points tell where their scanner was, as those of E57 and PTX files do."
            " Give a viewpoint, or orient them outside or up."
        )
    return record


def checked_viewpoint(viewpoint: ArrayLike | None) -> Floats | None:
    """Check a place, (3,), and return it.

    Another shape, other than real numbers, or those that are not finite raise `InvalidPointsError`.
    """
    if viewpoint is None:
        return None
    advice = "Give one position of three numbers."
    given = as_doubles(check_array(as_array(viewpoint, "Viewpoints"), "Viewpoints", [(3,)], advice))
    check_finite(given.reshape(-1, 3), "viewpoints", advice)
    return given


def tell_seen(site: Site, sample: Sample, rows: Ints, side: Floats, surface: Ints) -> Told:
    """Tell what is seen of the surfaces in the box of a tile.

    From one place, or from above, a surface is seen where nothing of itself is before it: of the points of one surface
    in each cell of directions only the nearest counts. So a closed body shows its outer side, while all its points
    together would face the inner one. By scanners all points are seen. `rows`, (k,), are the distinct points in the
    box, `side`, (k, 3), their normals, which agree within each surface, `surface`, (k,), its numbers of all tiles.
    Surfaces, cells and distances are told, and the cosines between normals and the way to where they are seen from.
    """
    record, places = site.record, sample.places[rows]
    step = _CELL * float(record["spacing"])
    if record["orient"] == "up":
        towards = np.broadcast_to([0.0, 0.0, 1.0], places.shape)
        return _nearest(surface, _ground_cells(places[:, :2], step), -places[:, 2], _cosines(side, towards))
    if "viewpoint" in record:
        place = (record["viewpoint"] - record["center"]) / record["scale"]
        towards = place - places
        usual = max(float(np.linalg.norm(place)), 1.0)  # distance of most points
        distance = np.linalg.norm(towards, axis=1)
        return _nearest(surface, _cube_cells(towards, step / usual), distance, _cosines(side, towards))
    scanner = site.store.columns(site.number)[SCANNER][site.part.place[sample.scaled.first[rows]]]
    towards = (scanner.astype(np.float64) - record["center"]) / record["scale"] - places
    names, label = np.unique(surface, return_inverse=True)
    every = np.bincount(label.reshape(-1), _cosines(side, towards), len(names))
    return _nearest(names, np.full(len(names), site.number), np.zeros(len(names)), every)


def signs_by_seen(store: Store, step: str) -> Floats:
    """Return the sign of each surface, (surfaces,), by what a step has told of them with `tell_seen`."""
    names = ("surface", "cell", "depth", "cosine")
    told = _nearest(*(np.concatenate(list(store.told(step, name))) for name in names))
    return np.where(np.bincount(told["surface"], told["cosine"]) < 0.0, -1.0, 1.0)


def _nearest(surface: Ints, cell: Ints, depth: Array, cosine: Array) -> Told:
    """Return the nearest of each surface in each cell."""
    order = np.lexsort((depth, cell, surface))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(surface[order]) != 0) | (np.diff(cell[order]) != 0)
    kept = order[first]
    return {"surface": surface[kept], "cell": cell[kept], "depth": depth[kept], "cosine": cosine[kept]}


def _cosines(normals: Floats, towards: Floats) -> Floats:
    length = np.linalg.norm(towards, axis=1)
    cosines: Floats = np.einsum("ij,ij->i", normals, towards) / np.maximum(length, np.finfo(float).tiny)
    return cosines


def _ground_cells(places: Floats, step: float) -> Ints:
    """Return the square on the ground of each place, (k,)."""
    column, row = np.floor(places / step).astype(np.int64).T
    cells: Ints = (column << 32) + row
    return cells


def _cube_cells(towards: Floats, step: float) -> Ints:
    """Return the square on the faces of a cube around the viewpoint that each direction meets, (k,)."""
    axis = np.abs(towards).argmax(axis=1)
    largest = np.take_along_axis(towards, axis[:, None], axis=1)
    ahead = towards / np.where(largest == 0.0, 1.0, np.abs(largest))
    ahead[np.arange(len(axis)), axis] = 0.0
    column, row, level = np.floor(ahead / step).astype(np.int64).T
    face = 2 * axis + (largest[:, 0] < 0.0)
    width = int(np.ceil(1.0 / step)) + 1
    cells: Ints = ((face * 2 * width + column + width) * 2 * width + row + width) * 2 * width + level + width
    return cells
