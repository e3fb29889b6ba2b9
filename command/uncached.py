"""What Blender's cache offers, for command lines: results that depend on an operator are kept by it."""


def result(laplacian, name, *settings, compute):
    """Return the result of a function without arguments that uses an operator, which keeps it."""
    return laplacian.kept.result(name, compute, *settings)
