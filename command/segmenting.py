"""Segmentation into parts, and signatures, for the command line and for Blender's tools."""

from . import analysis, core
from .quantities import HEAT_SIGNATURE, WAVE_SIGNATURE
from .settings import Setting

SEGMENT = {
    setting.name: setting
    for setting in (
        Setting("method", "What makes a part", "PARTS", choices=("PARTS", "NODAL")),
        Setting("parts", "How many parts", 6, 1),
        Setting("mode", "Number of the mode; 1 is the constant one", 2, 1),
    )
}
SIGNATURE = {
    setting.name: setting
    for setting in (
        Setting("kind", "What spreads over the surface", "HEAT", choices=("HEAT", "WAVE")),
        Setting("count", "How many scales, from fine to coarse", 8, 1, 999),
        Setting("modes", "How many vibration modes they are made of", 100, 10),
    )
}


def segmented(laplacian, method, parts, mode, cache, progress):
    """Return the number of the part of each point, (n,) int, by the values of the settings in `SEGMENT`."""
    if method == "NODAL":
        return cache.result(laplacian, "nodal", mode, compute=lambda: _by_mode(laplacian, mode, cache, progress))
    return cache.result(laplacian, "parts", parts, compute=lambda: _by_shape(laplacian, parts, cache, progress))


def _by_mode(laplacian, mode, cache, progress):
    """Divide the points by the signs of a mode."""
    vector = cache.lowest_modes(laplacian, mode, progress).eigenvectors[:, mode - 1]
    progress("Regions", 0.5)
    return core.spectral.nodal_domains(laplacian, vector)


def _by_shape(laplacian, parts, cache, progress):
    """Divide the points into parts, by kept modes if there are enough."""
    count, spectrum = core.spectral.modes_needed(laplacian, parts), None
    if cache.known_modes(laplacian) >= count:
        spectrum, _ = analysis.resolved_modes(count, lambda many: cache.lowest_modes(laplacian, many, progress))
    return core.spectral.segment(laplacian, parts, spectrum=spectrum, progress=progress)


def parts_line(found, name) -> str:
    """Return how many parts there are as a text."""
    count = int(found.max()) + 1
    return f"{name}: {count} part{'s' if count > 1 else ''}"


def signatures(laplacian, kind, count, modes, cache, progress):
    """Return signatures, (n, count), by the values of the settings in `SIGNATURE`."""
    signature = core.spectral.heat_kernel_signature if kind == "HEAT" else core.spectral.wave_kernel_signature
    return signature(cache.lowest_modes(laplacian, modes, progress), count=count)


def signature_prefix(kind) -> str:
    """Return what the names of the attributes of a kind begin with."""
    return HEAT_SIGNATURE if kind == "HEAT" else WAVE_SIGNATURE


def signature_names(kind, count) -> list:
    """Return the names of the attributes that hold signatures."""
    return [f"{signature_prefix(kind)}{number:03d}" for number in range(1, count + 1)]


def signature_line(count, name) -> str:
    """Return how many signatures there are as a text."""
    return f"{name}: signatures at {count} scales"
