"""The operators built last, so that a spectrum after an analysis does not build one again."""

import hashlib
import weakref
from collections import OrderedDict
from typing import NamedTuple

import numpy as np

from ..core import LaplaceBeltrami, Spectrum, build_laplacian, mean_curvature

_LIMIT = 2  # each holds all pairs of neighbours: 1 GB and more for large scans
_built = OrderedDict()
_spectra = weakref.WeakKeyDictionary()  # of the operators that are kept, the longest one computed


class Built(NamedTuple):
    """An operator and the mean curvature computed by it."""

    laplacian: LaplaceBeltrami
    mean_curvature: np.ndarray


def build(points, options, rim, progress) -> Built:
    """Return the operator of these points, options and rim, built only if it is not among the last ones.

    Parameters
    ----------
    points : ndarray, (n, 3)
    options : LaplacianOptions
    rim : ndarray, (n,) bool, or None
        The points at the rim; None leaves it to the options.
    progress : callable
        Called as ``progress(stage, fraction)``.
    """
    checksum = hashlib.blake2b(points)
    if rim is not None:
        checksum.update(rim)
    key = (checksum.digest(), options)
    built = _built.pop(key, None)
    if built is None:
        while len(_built) >= _LIMIT:
            _built.popitem(last=False)
        laplacian = build_laplacian(points, options=options, boundary=rim, progress=progress)
        progress("Curvature", 1.0)
        built = Built(laplacian, mean_curvature(laplacian))
    _built[key] = built
    return built


def lowest_modes(laplacian, count: int, progress) -> Spectrum:
    """Return the lowest modes of an operator, computed only if there are not as many from before."""
    progress("Spectrum", 0.0)
    if known_modes(laplacian, count) is None:
        _spectra[laplacian] = laplacian.eigenpairs(count, progress=progress)
    return known_modes(laplacian, count)


def known_modes(laplacian, count: int) -> Spectrum | None:
    """Return the lowest modes of an operator if there are as many from before."""
    known = _spectra.get(laplacian)
    if known is None or len(known.eigenvalues) < count:
        return None
    return Spectrum(known.eigenvalues[:count], known.eigenvectors[:, :count])


def clear():
    """Give the memory back."""
    _built.clear()
