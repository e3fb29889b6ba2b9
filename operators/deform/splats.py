"""Gaussian splats that a deformation carries along: what is shown of them beside the places of their points."""

from dataclasses import replace

import numpy as np

from ..objects.attributes import SPLAT_HARMONIC, SPLAT_ROTATION, SPLAT_SCALE, read_attribute, write_attribute
from ..objects.splats import harmonic_names


def write_carried(data, splats):
    """Keep how splats are carried, those harmonics that they have here; None for as they are at rest."""
    if splats is None:
        for name in carried_names(data):
            data.attributes.remove(data.attributes[name])
        return
    write_attribute(data, SPLAT_SCALE, splats.scales)
    write_attribute(data, SPLAT_ROTATION, splats.rotations)
    for number in range(splats.harmonics.shape[1]):
        write_attribute(data, f"{SPLAT_HARMONIC}{number}", splats.harmonics[:, number])


def carried_names(data) -> list:
    """Return the names of the attributes that are there for splats carried along."""
    return [name for name in (item.name for item in data.attributes) if name.startswith("lb_splat_")]


def shown_splats(data, splats, positions, strength: float):
    """Return splats as the modifier shows them: in between those at rest and those carried.

    Parameters
    ----------
    data : bpy.types.Mesh or bpy.types.PointCloud
    splats : Splats
        At rest.
    positions : ndarray, (n, 3)
        Where they are shown.
    strength : float
        Share of the deformation, 0 to 1.
    """
    if SPLAT_SCALE not in data.attributes:
        return replace(splats, positions=positions)
    scales = _between(splats.scales, read_attribute(data, SPLAT_SCALE), strength)
    rotations = _turned_between(splats.rotations, read_attribute(data, SPLAT_ROTATION), strength)
    harmonics = splats.harmonics.copy()
    for number in range(len(harmonic_names(data))):
        name = f"{SPLAT_HARMONIC}{number}"
        if name in data.attributes:
            harmonics[:, number] = _between(harmonics[:, number], read_attribute(data, name), strength)
    return replace(splats, positions=positions, scales=scales, rotations=rotations, harmonics=harmonics)


def _between(one, other, share):
    return one + share * (other - one)


def _turned_between(one, other, share):
    """Return the quaternions on the short way between unit quaternions, (n, 4)."""
    cosine = np.einsum("nk,nk->n", one, other, dtype=np.float64)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = [np.where(angle > 1e-6, np.sin(part * angle) / np.sin(angle), part) for part in (1.0 - share, share)]
    mixed = shares[0] * one + shares[1] * np.where(cosine < 0.0, -1.0, 1.0)[:, None] * other
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
