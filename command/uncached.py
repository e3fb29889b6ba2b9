"""What the cache of recent results in Blender offers, for command lines: they use each result once, and keep none."""


def result(laplacian, *settings, compute):
    """Return the result of a function without arguments that uses an operator."""
    return compute()


def lowest_modes(laplacian, count, progress, dirichlet=False, raw=False):
    """Return the lowest modes of an operator."""
    return laplacian.eigenpairs(count, raw=raw, dirichlet=dirichlet, progress=progress)


def known_modes(laplacian) -> int:
    """Return how many modes of an operator are kept."""
    return 0
