"""Clouds in tiles on disk, and what is known of them in the order of the points; for tests, too."""

from dataclasses import replace

import numpy as np

import core
from core.tiles.site import Site


def survey(folder, points, count, halo=core.tiles.HALO, options=None, until="measure", **choice):
    """Cut points into so many tiles on disk, and take all steps before one; return the store."""
    columns = {"row": np.arange(len(points)), **choice.pop("columns", {})}
    most = -(-len(points) // count)
    store = core.tiles.cut_to_store(
        lambda: [(points, columns)], folder, most, options or core.LaplacianOptions(), halo=halo, **choice
    )
    while (waiting := core.tiles.pending(store))[0].name != until:
        for number in waiting[1]:
            core.tiles.visit_tile(store.folder, waiting[0].name, number)
        core.tiles.settle(store)
    return store


def agreed_among(store):
    """Return for each tile what is agreed on for its points, with the halo, and the rows of these among all points."""
    rows = [store.columns(number)["row"] for number in range(store.count)]
    start = np.cumsum([0, *map(len, rows)])
    sites = [Site(store, number, store.options) for number in store.alive]
    return [(site.agreed(), np.concatenate(rows)[start[site.part.owner] + site.part.place]) for site in sites]


def agreed_on(store):
    """Return what is agreed on for all points, in their order."""
    found, joined = agreed_among(store), {}
    for name in ("component", "sheet", "side"):
        if getattr(found[0][0], name) is not None:
            values = getattr(found[0][0], name)
            joined[name] = np.empty((store.manifest["points"], *values.shape[1:]), values.dtype)
            for number, (agreed, rows) in zip(store.alive, found, strict=True):
                inner = slice(len(store.own(number)))
                joined[name][rows[inner]] = getattr(agreed, name)[inner]
    if found[0][0].bridges is not None:
        joined["bridges"] = np.unique(np.concatenate([rows[agreed.bridges] for agreed, rows in found]), axis=0)
    return replace(found[0][0], **joined)


def in_order(store, name):
    """Return a result at all points, in their order."""
    rows = np.concatenate([store.columns(number)["row"] for number in store.alive])
    return np.concatenate(list(store.told("measure", name)))[np.argsort(rows)]
