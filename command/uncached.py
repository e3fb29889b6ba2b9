"""What the cache of recent results in Blender offers, for command lines: they use each result once, and keep none."""

from . import core


def result(laplacian, *settings, compute):
    """Return the result of a function without arguments that uses an operator."""
    return compute()


def geodesics(laplacian, progress):
    """Return the solver of geodesic distances of an operator."""
    return core.distance.Geodesics(laplacian, progress=progress)


def lowest_modes(laplacian, count, progress, dirichlet=False, raw=False):
    """Return the lowest modes of an operator."""
    return laplacian.eigenpairs(count, raw=raw, dirichlet=dirichlet, progress=progress)


def known_modes(laplacian) -> int:
    """Return how many modes of an operator are kept."""
    return 0
