"""The last steps of the walk in tiles: sides, areas, and all results."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..geometry import (
    Cloud,
    Decisions,
    arc_length,
    measure_surface,
    near_edges,
    orient_patches,
    side_sums,
    signs_by_sums,
)
from ..operator import LaplaceBeltrami, assemble_laplacian, measure_mean_curvature, solve_areas
from ..options import LaplacianOptions
from ..types import Array, Floats, Ints
from .labels import agree_on_signs, starts
from .neighborhoods import Fitted, divided
from .roughness import agree_on_wavelength, tell_lengths, tell_roughness
from .seen import signs_by_seen, tell_seen
from .site import Site
from .store import Record, Store, Told

_LINK = 1e-3  # weight of links between patches of one tile, against points that two tiles have in common


class Solved(NamedTuple):
    """A cloud with distances of pairs along the surface, and areas, (m,), before they are scaled by component."""

    cloud: Cloud
    areas: Floats


def orient_tile(site: Site, fitted: Fitted) -> tuple[Fitted | None, Told]:
    """Divide sheets, and orient the patches of a tile."""
    surface, changed = divided(site, fitted)
    nearest, scaled = surface.sample.nearest, surface.sample.scaled
    normals, patch = orient_patches(nearest, surface.quadrics.normals, surface.sample.places)
    first, second = near_edges(nearest)
    count = int(patch.max()) + 1
    inner = site.inner(scaled)
    within = 0.5 * (inner[first].astype(float) + inner[second])  # the tile in which a patch lies decides
    edges = sparse.coo_array((within, (patch[first], patch[second])), shape=(count, count)).tocsr().tocoo()
    across = edges.row != edges.col
    return Fitted(surface) if changed else None, {
        "normal": site.own(scaled, normals, 0.0),
        "patch": site.own(scaled, patch, -1),
        "normals": normals,  # of all distinct points, with the halo
        "patches": patch,
        "count": np.array(count),
        "links": np.stack([edges.row, edges.col], axis=1)[across],
        "edges": edges.data[across],
    }


def compare_sides(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Compare the sides of patches with those of the tiles around."""
    part, first = site.part, fitted.surface.sample.scaled.first
    owner, normals, patch = part.owner[first], site.told("patches", "normals"), site.told("patches", "patches")
    theirs, beside = site.around("patches", "patch", -1)[first], site.around("patches", "normal", 0.0)[first]
    common = (part.close & ~part.inner)[first] & (theirs >= 0)
    alike = np.sign(np.einsum("ij,ij->i", normals, beside))[common]
    kinds, kind = np.unique(np.stack([patch[common], owner[common], theirs[common]]), axis=1, return_inverse=True)
    return None, {"pairs": kinds.T, "votes": np.bincount(kind.reshape(-1), alike, kinds.shape[1])}


def agree_on_flips(store: Store, options: LaplacianOptions) -> Record:
    """Agree on which patches are reversed, so that all agree."""
    alive = store.visited("sides")
    start = starts(store, "patches", map(int, store.told("patches", "count")))
    votes: list[Array] = []
    for number in alive:
        links, edges = store.read("patches", number, "links"), store.read("patches", number, "edges")
        votes.append(np.column_stack([links + start[number], _LINK * edges]))
        pairs, alike = store.read("sides", number, "pairs"), store.read("sides", number, "votes")
        known = np.isin(pairs[:, 1], alive)  # not one that has failed since
        pairs, alike = pairs[known], alike[known]
        votes.append(np.column_stack([pairs[:, 0] + start[number], start[pairs[:, 1]] + pairs[:, 2], alike]))
    first, second, weight = np.concatenate(votes).T
    sign = agree_on_signs(first.astype(int), second.astype(int), weight, int(start[-1]))
    return {"flip": sign, "flip start": start}


def tell_sides(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Reverse patches, and tell what decides the outer side of each component: sums, or what is seen."""
    record, sample = site.record, fitted.surface.sample
    begin = int(record["flip start"][site.number])
    side = site.told("patches", "normals") * record["flip"][begin + site.told("patches", "patches"), None]
    rows = np.flatnonzero(site.inner(sample.scaled))
    label = site.labels()[sample.scaled.first[rows]]
    told = {"side": site.own(sample.scaled, side, 0.0)}
    if record["orient"] != "outside":
        return None, {**told, **tell_seen(site, sample, rows, side[rows], label)}
    names, label = np.unique(label, return_inverse=True)
    sums = side_sums(sample.places[rows], side[rows], label.reshape(-1), np.ones(len(rows)))
    return None, {**told, "name": names, "sums": sums}


def agree_on_outside(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the outer side of each component."""
    if store.record["orient"] != "outside":
        return {"outer": signs_by_seen(store, "outside")}
    return {"outer": signs_by_sums(_added(store, "outside", "sums"))}


def find_areas(site: Site, fitted: Fitted) -> tuple[Solved, Told]:
    """Go on to pairs, and solve for areas."""
    agreed = replace(site.agreed(), ratio=np.ones(int(site.labels().max(initial=0)) + 1))
    sample = fitted.surface.sample
    decisions = Decisions(agreed)
    counts = len(site.part.points), int(site.told("spacing", "distinct"))
    cloud = measure_surface(replace(fitted.surface, sample=replace(sample, decisions=decisions)), site.options, counts)
    distance = arc_length(cloud)
    areas = solve_areas(cloud, distance)
    cloud = replace(cloud, pairs=replace(cloud.pairs, distance=distance))
    inner = site.inner(cloud.scaled)
    names, label = np.unique(decisions.names(cloud.scaled, cloud.component)[inner], return_inverse=True)
    label = label.reshape(-1)
    sums = np.column_stack([np.bincount(label, values[inner], len(names)) for values in (cloud.cell_areas, areas)])
    return Solved(cloud, areas), {"name": names, "sums": sums, **tell_lengths(site, cloud)}


def agree_on_areas(store: Store, options: LaplacianOptions) -> Record:
    """Agree on by how much the areas of each component are scaled, and on the wavelength of the roughness."""
    total, found = _added(store, "areas", "sums").T
    return {"ratio": total / np.where(found > 0.0, found, 1.0), **agree_on_wavelength(store, "areas")}


def measure(site: Site, solved: Solved) -> tuple[None, Told]:
    """Build the operator of a tile, and tell the results in its box."""
    cloud, decisions = solved.cloud, site.decisions()
    names = decisions.names(cloud.scaled, cloud.component)
    cloud = replace(cloud, decisions=decisions)
    laplacian = assemble_laplacian(site.part.points, cloud, solved.areas * site.record["ratio"][names], site.options)
    inner = site.part.inner
    found, notices = results(laplacian, site.labels(), np.flatnonzero(inner))
    return None, {**found, **tell_roughness(site, laplacian), "notices": np.array(notices, dtype=str)}


def results(laplacian: LaplaceBeltrami, label: Ints | None, rows: Ints) -> tuple[Told, list[str]]:
    """Return the results at some points of a tile, by their names, and notices.

    Components are by labels of all, (k,).
    """
    component = laplacian.component[rows]
    found = {
        name: getattr(laplacian, name)[rows]
        for name in (
            "normals",
            "areas",
            "smoothing_lengths",
            "quadric_mean_curvature",
            "gaussian_curvature",
            "boundary",
            "trust",
            "doubt",
            "surface_points",
        )
    }
    curvature = measure_mean_curvature(laplacian)
    found["mean_curvature"] = curvature.values[rows]
    found["component"] = component if label is None else np.where(component < 0, -1, label[rows])
    return found, [*laplacian.notices, *curvature.notices]


def _added(store: Store, step: str, name: str) -> Floats:
    """Return sums over all tiles, (labels, k), of what a step has told of each for the names of some labels."""
    names, parts = list(store.told(step, "name")), list(store.told(step, name))
    total = np.zeros((max(int(label.max(initial=-1)) for label in names) + 1, parts[0].shape[1]))
    for label, part in zip(names, parts, strict=True):
        total[label] += part
    return total
