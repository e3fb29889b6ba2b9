"""The low vibration modes of a cloud in tiles: of evenly spread points of it, carried to all of them tile by tile."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidPointsError
from ..geometry import Prolongation, blue_noise_subset
from ..memory import needed_memory
from ..operator import build_laplacian
from .site import Site
from .steps import Step, at_first
from .store import Store, Told

_CANDIDATES = 3  # for each point wanted, from all tiles
_MOST = 1_000_000  # points by which modes are computed, where the memory allows: more are slow to factorize
_NEIGHBORS = 9  # as of Prolongation
_WANTED = "modes wanted"  # the name under which a store keeps that


def ask_for_modes(store: Store, modes: int, most: int | None = None) -> None:
    """Let a store have the low modes of its cloud, by further steps; those that it has for another question go.

    Parameters
    ----------
    store : Store
    modes : int
        How many.
    most : int, optional
        Points by which they are computed; else a million, or fewer if the memory of a worker is not enough.

    Raises
    ------
    InvalidPointsError
        No modes.
    """
    if most is None:
        memory = store.manifest["memory"]
        most = _MOST if memory is None else min(_MOST, memory // needed_memory(1, store.options, modes))
    if min(modes, most) < 1:
        raise InvalidPointsError(f"{modes} modes by {most} points were asked for. Ask for at least one.")
    if store.agreed_after(_WANTED):
        had, by = int(store.record["modes"]), int(store.record["mode points"])
        if (had, by) == (modes, most):
            return
        store.take_back([step.name for step in (MODES if by != most else MODES[1:])])
    store.settle(_WANTED, {"modes": np.array(modes), "mode points": np.array(most)})


def find_candidates(site: Site, state: Any) -> tuple[None, Told]:
    """Choose evenly spread points of a tile, more than are needed."""
    component, points = site.told("measure", "component"), site.store.own(site.number)
    on = points[component >= 0]
    sizes = site.store.manifest["tiles"]
    total = sum(sizes[number]["points"] for number in site.store.alive)
    wanted = -(-_CANDIDATES * int(site.record["mode points"]) * len(on) // total)
    chosen = blue_noise_subset(on, wanted) if len(on) else np.arange(0)
    return None, {"points": on[chosen]}


def find_modes(site: Site, state: Any) -> tuple[None, Told]:
    """Compute the modes on evenly spread points of all tiles."""
    points = np.concatenate(list(site.store.told("candidates", "points")))
    points = points[blue_noise_subset(points, int(site.record["mode points"]))]
    laplacian = build_laplacian(points, options=site.options)
    spectrum = laplacian.eigenpairs(int(site.record["modes"]))
    return None, {
        "points": points,
        "normals": laplacian.normals,
        "component": laplacian.component,
        "vectors": spectrum.eigenvectors,
        "values": spectrum.eigenvalues,
    }


def carry_modes(site: Site, state: Any) -> tuple[None, Told]:
    """Carry the modes to the points in the box of a tile."""
    source = site.store.alive[0]
    names = ("points", "normals", "component", "vectors")
    points, normals, component, vectors = (site.store.read("spectrum", source, name) for name in names)
    own = site.store.own(site.number)
    near = np.unique(cKDTree(points).query(own, k=min(_NEIGHBORS, len(points)))[1])
    every = Prolongation(np.concatenate([points[near], own]), np.arange(len(near)), normals[near], component[near])
    modes = every.interpolate(vectors[near])[len(near) :]
    modes[site.told("measure", "component") < 0] = 0.0
    return None, {"modes": modes}


MODES = (
    Step("candidates", "Modes", 0.1, find_candidates),
    Step("spectrum", "Modes", 32.0, find_modes, where=at_first),
    Step("modes", "Modes", 3.4, carry_modes),
)
