"""The operators built last, so that a spectrum after an analysis does not build one again."""

import hashlib
from collections import OrderedDict

from ..core import build_laplacian

_LIMIT = 2  # each holds all pairs of neighbours: 1 GB and more for large scans
_laplacians = OrderedDict()


def laplacian_for(points, options, progress):
    """Return the operator of these points and options, built only if it is not among the last ones."""
    key = (hashlib.blake2b(points).digest(), options)
    laplacian = _laplacians.pop(key, None)
    if laplacian is None:
        while len(_laplacians) >= _LIMIT:
            _laplacians.popitem(last=False)
        laplacian = build_laplacian(points, options=options, progress=progress)
    _laplacians[key] = laplacian
    return laplacian


def clear():
    """Give the memory back."""
    _laplacians.clear()
