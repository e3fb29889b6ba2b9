"""The first steps of the walk in tiles: spacing, outliers, components, noise and sheets."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..arguments import check_points
from ..geometry import (
    COUNT,
    FILLING,
    MANY,
    Sample,
    ScaledPoints,
    Surface,
    check_surface,
    choose_bridges,
    count_curves,
    divide_components,
    divide_sheets,
    drop_outliers,
    find_gaps,
    find_rounding,
    fit_surface,
    gap_reach,
    gather,
    join_touching,
    measure_noise,
    near_misfit,
    neighbor_distance,
    number_sizes,
    remove_noise,
    scale_points,
    sheet_neighbors,
    with_scatter,
)
from ..linalg import eigh
from ..memory import check_memory
from ..options import LaplacianOptions
from ..types import Floats, Ints
from .labels import label_links, merge_labels, names_of, starts
from .medians import median
from .places import points_around
from .site import Site
from .store import Record, Store, Told

_FILLED = 50_000  # points by which that is judged which fill volumes


class Fitted(NamedTuple):
    """A surface, and what quadrics through 20 neighbors miss these by, (m,), until noise is smoothed."""

    surface: Surface
    near: Floats | None = None


def look_for_rounding(site: Site, state: Any) -> tuple[ScaledPoints, Told]:
    """Look whether the points of a tile are rounded in steps, and along which direction."""
    points = check_points(site.part.points)
    check_memory(len(points), site.options)
    scaled = scale_points(points, site.decisions())
    rounding, count = find_rounding(cKDTree(scaled.points)), np.count_nonzero(site.inner(scaled))
    return scaled, {"count": np.array(count), "squares": count * np.outer(rounding, rounding)}


def agree_on_rounding(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the direction along which most points are rounded in steps, and on these; zero where most are not."""
    found = np.array([np.trace(squares) > 0.0 for squares in store.told("rounding", "squares")])
    count = np.array(list(store.told("rounding", "count")))
    if count[found].sum() <= 0.5 * count.sum():
        return {"rounded": np.zeros(3)}
    square, axes = eigh(sum(store.told("rounding", "squares")) / count[found].sum())
    return {"rounded": np.sqrt(square[2]) * axes[:, 2]}


def find_spacing(site: Site, scaled: ScaledPoints) -> tuple[Sample, Told]:
    """Find the neighbors of the points of a tile."""
    sample = gather(scaled, site.decisions())
    inner = site.inner(scaled)
    return sample, {"spacing": sample.nearest.spacing[inner], "distinct": np.array(len(scaled.points))}


def agree_on_spacing(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the usual spacing."""
    return {"spacing": np.array(median(lambda: store.told("spacing", "spacing")))}


def find_reach(site: Site, sample: Sample) -> tuple[Sample | None, Told]:
    """Leave outliers out."""
    left = drop_outliers(replace(sample, decisions=site.decisions()))
    changed = left.nearest is not sample.nearest
    return left if changed else None, {"reach": gap_reach(left.nearest)[site.inner(left.scaled)]}


def agree_on_reach(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the usual edge that is no gap."""
    return {"reach": np.array(median(lambda: store.told("reach", "reach")))}


def link_strictly(site: Site, sample: Sample) -> tuple[None, Told]:
    """Join neighbors over edges that are no gaps."""
    strict, _ = find_gaps(sample.nearest, float(site.record["reach"]))
    return None, label_links(site, sample.scaled, sample.nearest.index[:, 1:], strict)


def agree_on_large(store: Store, options: LaplacianOptions) -> Record:
    """Agree on which components have some size."""
    merged = merge_labels(store, "gaps")
    return names_of("gaps", "large", merged.start, (number_sizes(merged.size, COUNT) >= 0)[merged.label])


def link_loosely(site: Site, sample: Sample) -> tuple[None, Told]:
    """Join components of some size over wider edges."""
    strict, loose = find_gaps(sample.nearest, float(site.record["reach"]))
    large = site.named("gaps", "large", False)[sample.scaled.first]
    index = sample.nearest.index[:, 1:]
    told = label_links(site, sample.scaled, index, strict | (loose & large[:, None] & large[index]))
    many = np.zeros(len(told["size"]), dtype=bool)
    own = told["label"]
    many[own[own >= 0]] = large[sample.scaled.inverse[site.part.inner][own >= 0]]
    return None, {**told, "large": many}


def agree_on_components(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the numbers of components."""
    merged = merge_labels(store, "components")
    large = np.zeros(len(merged.size), dtype=bool)
    np.logical_or.at(large, merged.label, np.concatenate(list(store.told("components", "large"))))
    number = np.full(len(merged.size), -1)
    number[large] = number_sizes(merged.size[large], COUNT)
    smallest = merged.size[number >= 0].min()
    return {**names_of("components", "component", merged.start, number[merged.label]), "smallest": smallest}


def find_noise(site: Site, sample: Sample) -> tuple[Fitted, Told]:
    """Fit quadrics, and measure the noise."""
    sample = divide_components(replace(sample, decisions=site.decisions()))
    surface = with_scatter(fit_surface(sample, site.options.sheets))
    inner = site.inner(surface.sample.scaled)
    curves = count_curves(surface.sample.nearest.quadrics.roundness[inner])
    if site.options.projection != "auto":
        return Fitted(surface), {"counts": np.array([np.count_nonzero(inner), curves, 0, 0])}
    near = near_misfit(surface.sample.nearest)
    noise = measure_noise(surface, near)
    fills = site.own(surface.sample.scaled, noise > FILLING, False)
    offset = site.part.points[site.part.inner][fills] - site.record["center"]
    return Fitted(surface, near), {
        "counts": np.array([np.count_nonzero(inner), curves, np.count_nonzero(noise[inner] > 0.0), len(offset)]),
        "fills": fills,
        "offset": offset.sum(axis=0),
    }


def agree_on_noise(store: Store, options: LaplacianOptions) -> Record:
    """Agree on whether there is noise to smooth, and on the middle of the points that fill volumes.

    If the points of many neighborhoods lie along a curve, `NotASurfaceError` is raised.
    """
    count, curves, noisy, filling = np.sum(list(store.told("noise", "counts")), axis=0).tolist()
    check_surface(curves, count)
    if options.projection != "auto":
        return {}
    agreed = {"noisy": np.array(noisy / count >= MANY)}
    if filling:
        agreed["filled"] = store.record["center"] + np.sum(list(store.told("noise", "offset")), axis=0) / filling
    return agreed


def find_filling(site: Site, state: object) -> tuple[None, Told]:
    """Follow how points that fill volumes fare as noise is smoothed, around the one next to the middle of all."""
    around = points_around(site.store, site.record["filled"], _FILLED, "fills")
    trial = Site(site.store, -1, site.options, around)
    sample, _ = find_spacing(trial, look_for_rounding(trial, None)[0])
    left, _ = find_reach(trial, sample)
    fitted, _ = find_noise(trial, left or sample)
    found = remove_noise(_with_decisions(trial, fitted.surface), site.options, fitted.near)
    filling = found.sample.decisions.made.filling
    return None, {"filling": np.array(() if filling is None else filling)}


def agree_on_filling(store: Store, options: LaplacianOptions) -> Record:
    """Agree on that."""
    told = list(store.told("filling", "filling"))
    return {"filling": told[0]} if told and len(told[0]) else {}


def link_sheets(site: Site, fitted: Fitted) -> tuple[Fitted | None, Told]:
    """Smooth noise, and join neighbors on sheets."""
    given = _with_decisions(site, fitted.surface)
    surface = remove_noise(given, site.options, fitted.near)
    told = _link_neighbors(site, surface, surface.quadrics.normals, False) if site.options.sheets else {}
    return None if surface is given else Fitted(surface), told


def agree_on_large_sheets(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the numbers of sheets of some size."""
    if not options.sheets:
        return {}
    merged = merge_labels(store, "sheets")
    return names_of("sheets", "large sheet", merged.start, number_sizes(merged.size, COUNT)[merged.label])


def join_sheets(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Join small sheets to those that they touch, and tell which sheets there are of which components."""
    sample = fitted.surface.sample
    sheet = join_touching(sample.nearest, site.named("sheets", "large sheet")[sample.scaled.first])
    component = site.named("components", "component")[sample.scaled.first]
    inner = site.inner(sample.scaled)
    rows = np.flatnonzero(inner & (sheet >= 0))
    kinds, number, size = np.unique(
        np.stack([component[rows], sheet[rows]]), axis=1, return_inverse=True, return_counts=True
    )
    label = np.full(len(sheet), -1)
    label[rows] = number.reshape(-1)
    return None, {"label": site.own(sample.scaled, label, -1), "kind": kinds.T, "size": size}


def agree_on_sheets(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the numbers of sheets within components."""
    kinds = list(store.told("touching", "kind"))
    _, label = np.unique(np.concatenate(kinds), axis=0, return_inverse=True)
    label = label.reshape(-1)
    size = np.bincount(label, np.concatenate(list(store.told("touching", "size")))).astype(np.int64)
    return names_of("touching", "sheet", starts(store, "touching", map(len, kinds)), number_sizes(size, 0)[label])


def link_pieces(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Join neighbors on the same side of sheets."""
    surface = fitted.surface
    return None, _link_neighbors(site, surface, site.sides()[surface.sample.scaled.first], True)


def agree_on_pieces(store: Store, options: LaplacianOptions) -> Record:
    """Agree on which pieces these make."""
    merged = merge_labels(store, "pieces")
    return names_of("pieces", "piece", merged.start, merged.label)


def find_bridges(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Find the shortest edges between pieces."""
    surface = fitted.surface
    nearest, first = surface.sample.nearest, surface.sample.scaled.first
    piece = site.named("pieces", "piece")[first]
    inner = site.inner(surface.sample.scaled)
    other = piece[nearest.index]
    row, column = np.nonzero((other != piece[:, None]) & (other >= 0) & inner[:, None])
    second = nearest.index[row, column]
    gap, ends = nearest.distance[row, column], np.stack([piece[row], piece[second]], axis=1)
    order = np.lexsort((gap, *np.sort(ends, axis=1).T))
    _, shortest = np.unique(np.sort(ends[order], axis=1), axis=0, return_index=True)
    kept = order[shortest]
    part = site.part
    rows = first[row[kept]], first[second[kept]]
    edge = np.column_stack([column for end in rows for column in (part.owner[end], part.place[end])])
    return None, {"piece": ends[kept], "gap": gap[kept], "edge": edge.reshape(-1, 4).astype(np.int64)}


def agree_on_bridges(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the edges over which pieces hang together."""
    piece, gap, edge = (np.concatenate(list(store.told("bridges", name))) for name in ("piece", "gap", "edge"))
    bridges: Ints = edge[choose_bridges(piece[:, 0], piece[:, 1], gap)]
    return {"bridges": bridges}


def find_length(site: Site, fitted: Fitted) -> tuple[None, Told]:
    """Sum up how far the neighbor is by whose distance the kernel of all points is as wide."""
    sample = fitted.surface.sample
    distance = neighbor_distance(sample.nearest.tree, site.options.neighbors, sample.component)
    own = distance[site.inner(sample.scaled)]
    return None, {"sum": np.array(own.sum()), "count": np.array(len(own))}


def agree_on_length(store: Store, options: LaplacianOptions) -> Record:
    """Agree on the mean of that."""
    total, count = (sum(map(float, store.told("length", name))) for name in ("sum", "count"))
    return {"length": np.array(total / count)}


def divided(site: Site, fitted: Fitted) -> tuple[Surface, bool]:
    """Return the surface of a tile, divided into sheets if the options ask for it, and whether that is another one."""
    given = _with_decisions(site, fitted.surface)
    surface = divide_sheets(given) if site.options.sheets else given
    return surface, surface is not given


def _with_decisions(site: Site, surface: Surface) -> Surface:
    return replace(surface, sample=replace(surface.sample, decisions=site.decisions()))


def _link_neighbors(site: Site, surface: Surface, normals: Floats, oriented: bool) -> Told:
    sample = surface.sample
    near = sheet_neighbors(sample.nearest, normals, oriented)
    return label_links(site, sample.scaled, sample.nearest.index, near)
