"""Smoothing of shapes, and displacement by a mode, for the command line and for Blender's tools."""

import numpy as np

from . import core
from .results import check_wavelength
from .settings import Setting, radians

_HEAT, _DETAIL = 9.0, 18.0  # default wavelengths in smoothing lengths: those of details of some points
_FINEST = 8.0  # details finer than the wavelength by this factor count as noise, which is not amplified

SMOOTH = {
    setting.name: setting
    for setting in (
        Setting(
            "method",
            "What is smoothed, and how",
            "EDGES",
            choices=("EDGES", "NOISE", "HEAT", "MODES", "DETAIL"),
        ),
        Setting(
            "wavelength",
            "Wavelength that is halved, or the longest one that is scaled; 0 for a default suited to the points",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting("modes", "How many modes are kept, the constant one included", 100, 4),
        Setting("gain", "How much stronger details become", 1.5, 0.0),
        Setting("strength", "Factor of the displacements to the smooth positions", 1.0, 0.0, 1.0),
        Setting("group", "Smooth the points of this group only, by their weights; empty for all points", ""),
        Setting(
            "keep",
            "Scale the result so that it keeps its size",
            "NONE",
            choices=("NONE", "AREA", "VOLUME"),
        ),
        Setting("keep_boundary", "Leave the boundary where it is", True),
    )
}
MODE_SHAPE = {
    setting.name: setting
    for setting in (
        Setting("mode", "Number of the mode; 1 is the constant one", 2, 1),
        Setting("amplitude", "Largest displacement; 0 for a tenth of the object's radius", 0.0, 0.0, form="LENGTH"),
        Setting(
            "phase",
            "Angle of the vibration: 0 is full displacement, 180 degrees the opposite one",
            0.0,
            convert=radians,
            form="DEGREES",
        ),
    )
}


def smoothed(laplacian, own, mask, name, cache, progress):
    """Smooth points.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    own : object
        With the values of the settings in `SMOOTH`, but the group, as its attributes.
    mask : ndarray, (n,), or None
        Weights of the points; None for all.
    name : str
        Of the cloud, for errors.
    cache : object
        What keeps results: the cache of Blender's side, or the module `uncached`.
    progress : callable

    Returns
    -------
    ndarray, (n, 3)
        The points.
    ndarray, (n, 3)
        Those at full strength, without a mask and a size to keep.
    """
    keep = own.keep.lower() if own.keep != "NONE" else None
    dirichlet = own.keep_boundary and bool(laplacian.boundary.any())
    if dirichlet and keep:
        raise core.PointCloudError(
            f'"{name}" has a boundary, which determines the size already. Set Keep to Nothing, or turn off Keep'
            " Boundary."
        )
    check_wavelength(own.wavelength, laplacian.points, name)
    shared = {"strength": own.strength, "mask": mask, "keep": keep}
    blend = core.clean.PointBlend(laplacian, dirichlet=dirichlet, **shared)
    method, modes, gain, wavelength = own.method, own.modes, own.gain, own.wavelength
    settings = (
        method,
        dirichlet,
        modes if method == "MODES" else wavelength,
        gain if method == "DETAIL" else 0,
    )

    def filtered():
        return cache.result(
            laplacian,
            "smooth",
            *settings,
            compute=lambda: _filtered(laplacian, method, dirichlet, modes, wavelength, gain, cache, progress),
        )

    full = filtered()
    if not keep:
        return blend(full), full

    def scaled():
        places = filtered()
        progress("Size", 0.9)
        return blend(places)

    return cache.result(laplacian, "scaled", *settings, *shared.values(), compute=scaled), full


def _filtered(laplacian, method, dirichlet, modes, wavelength, gain, cache, progress):
    """Return the points, (n, 3), by a method at full strength."""
    if method == "EDGES":
        return core.clean.clean_points(laplacian, dirichlet=dirichlet, progress=progress)
    base = cache.result(
        laplacian,
        "base",
        dirichlet,
        compute=lambda: core.clean.smoothing_base(laplacian, dirichlet=dirichlet, progress=progress),
    )
    settings = {"dirichlet": dirichlet, "progress": progress, "base": base}
    length = np.median(laplacian.smoothing_lengths)
    if method == "NOISE":
        return core.clean.fair_points(laplacian, (wavelength / (2.0 * np.pi)) ** 2 if wavelength else None, **settings)
    if method == "MODES":
        spectrum = cache.lowest_modes(laplacian, modes, progress, dirichlet, raw=True)
        return core.clean.smooth_points(laplacian, modes, spectrum, **settings)
    if method == "HEAT":
        squared = ((wavelength or _HEAT * length) / (2.0 * np.pi)) ** 2
        return core.clean.smooth_points(laplacian, core.clean.exponential(np.log(2.0) * squared), **settings)
    low = (2.0 * np.pi / (wavelength or _DETAIL * length)) ** 2
    return core.clean.smooth_points(laplacian, core.clean.boost(gain, low, _FINEST**2 * low), **settings)


def smooth_line(before, after, name, length_text) -> str:
    """Return how far points, (n, 3), are moved as a text."""
    moved = np.linalg.norm(after - before, axis=1)
    average, most = length_text(np.sqrt(np.mean(moved**2))), length_text(moved.max())
    return f"{name}: {len(after):,} points moved by {average} on average, at most by {most}"


def by_mode(laplacian, mode, amplitude, phase, cache, progress):
    """Return points, (n, 3), displaced along their normals, by the values of the settings in `MODE_SHAPE`."""
    vector = cache.lowest_modes(laplacian, mode, progress).eigenvectors[:, mode - 1]
    return core.clean.displace_by_mode(laplacian, vector, amplitude or None, phase=phase)


def mode_line(before, after, mode, name, length_text) -> str:
    """Return how far points, (n, 3), are moved by a mode as a text."""
    largest = np.linalg.norm(after - before, axis=1).max()
    return f"{name}: moved by mode {mode}, at most by {length_text(largest)}"
