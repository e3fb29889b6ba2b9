"""Roughness in tiles: all smooth the surface over one wavelength, that of the whole cloud."""

from __future__ import annotations

import numpy as np

from ..arguments import not_negative
from ..clean import DETAIL, roughness
from ..geometry import Cloud
from ..operator import LaplaceBeltrami
from ..types import Floats
from .medians import median
from .site import Site
from .store import Record, Store, Told

ROUGHNESS = "roughness"  # the name of this result, which a store has if it was asked for
_WAVELENGTH = "wavelength"
_DOUBTED = 1e-3  # share of a wave that is told


def asked_wavelength(wavelength: float | None) -> Record:
    """Return what tiles agree on from the start for a wavelength [L]: zero for the usual one, None for no roughness."""
    if wavelength is None:
        return {}
    return {_WAVELENGTH: np.array(not_negative(wavelength, "wavelength of the roughness"))}


def tell_lengths(site: Site, cloud: Cloud) -> Told:
    """Tell the smoothing lengths in the box of a tile, if the wavelength depends on them."""
    if site.record.get(_WAVELENGTH) != 0.0:
        return {}
    lengths = site.own(cloud.scaled, cloud.pairs.lengths * cloud.scaled.scale, np.nan)
    return {"lengths": lengths[~np.isnan(lengths)]}


def agree_on_wavelength(store: Store, step: str) -> Record:
    """Agree on the wavelength of the whole cloud, by the lengths that a step has told; as of `mf.clean.roughness`."""
    if store.record.get(_WAVELENGTH) != 0.0:
        return {}
    return {_WAVELENGTH: np.array(DETAIL * median(lambda: store.told(step, "lengths")))}


def tell_roughness(site: Site, laplacian: LaplaceBeltrami) -> Told:
    """Tell the roughness in the box of a tile, if it was asked for."""
    if _WAVELENGTH not in site.record:
        return {}
    found: Floats = roughness(laplacian, float(site.record[_WAVELENGTH]))
    return {ROUGHNESS: found[site.part.inner]}


def doubted_wavelength(record: Record, halo: float) -> tuple[float, float] | None:
    """Return a wavelength [L] that is long against halos, with the share of a wave that reaches through these.

    Parameters
    ----------
    record : dict
        What all tiles have agreed on.
    halo : float
        Their width, in spacings.

    Returns
    -------
    tuple of float, or None
        None where there is no such wavelength.
    """
    if float(record.get(_WAVELENGTH, 0.0)) == 0.0 or "spacing" not in record:
        return None
    wavelength, width = float(record[_WAVELENGTH]), halo * float(record["spacing"] * record["scale"])
    share = float(np.exp(-np.pi * width / wavelength))  # of the slowest wave of an implicit step of the third order
    return (wavelength, share) if share > _DOUBTED else None
