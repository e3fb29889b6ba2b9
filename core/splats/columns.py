"""The columns of files of Gaussian splats by trainers: their names, and encodings of numbers."""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..files import LARGEST_SINGLE, SMALLEST_SINGLE
from ..types import Array, Floats

PLACES = ("x", "y", "z")
COLORS = tuple(f"f_dc_{channel}" for channel in range(3))
OPACITY = "opacity"
SCALES = tuple(f"scale_{axis}" for axis in range(3))
ROTATIONS = tuple(f"rot_{number}" for number in range(4))
NEEDED = (*PLACES, *COLORS, OPACITY, *SCALES, *ROTATIONS)
REST = "f_rest_"  # the harmonics, channel by channel
LENGTHS = ("filter_3D",)  # further columns that are lengths: the filter of Mip-Splatting
_NEAR = 2.0**-25  # half a step of single precision below one


class SplatFile(NamedTuple):
    """The contents of a file of splats, from which unchanged data are written again.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        By the names of the properties, in their order and types: scales as logarithms, opacities as logits.
    order : str
        Of the bytes, "<" or ">".
    comments : list of str
        Lines of the header.
    """

    columns: dict[str, Array]
    order: str = "<"
    comments: Sequence[str] = ()

    def scaled(self, factors: Floats) -> Self:
        """Return this with those columns that are lengths multiplied by a factor for each splat, (n,)."""
        lengths = {name: self.columns[name] for name in LENGTHS if name in self.columns}
        scaled = {name: (values * factors).astype(values.dtype) for name, values in lengths.items()}
        return self._replace(columns={**self.columns, **scaled})


def stack(columns: dict[str, Array], names: Sequence[str], dtype: DTypeLike = np.float64) -> Array:
    """Return columns by their names as one array, (n, k)."""
    count = len(next(iter(columns.values())))
    result = np.empty((count, len(names)), dtype)
    for index, name in enumerate(names):
        result[:, index] = columns[name]
    return result


def split(names: Sequence[str], values: Array) -> dict[str, Array]:
    """Return an array (n, k) as columns of single precision by their names; the reverse of `stack`."""
    return {name: np.ascontiguousarray(column, np.float32) for name, column in zip(names, values.T, strict=True)}


def rest_names(per_channel: int, used: int) -> list[str]:
    """Return the names of the first harmonics of each channel, of which a file has so many."""
    return [f"{REST}{channel * per_channel + number}" for channel in range(3) for number in range(used)]


def decode_scales(logarithms: Floats) -> Floats:
    """Return half axes of their logarithms; zero for NaN."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(np.exp(logarithms), nan=0.0, posinf=LARGEST_SINGLE)


def encode_scales(scales: Floats) -> Floats:
    """Return the logarithms of half axes; for zero that of the smallest number."""
    return np.log(np.maximum(scales, SMALLEST_SINGLE))


def decode_opacities(logits: Floats) -> Floats:
    """Return opacities from 0 to 1 of their logits; zero for NaN."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(1.0 / (1.0 + np.exp(-logits)), nan=0.0)


def encode_opacities(opacities: ArrayLike) -> Array:
    """Return the logits of opacities, finite ones of 0 and 1, too."""
    inside = np.clip(opacities, SMALLEST_SINGLE, 1.0 - _NEAR)
    return np.log(inside) - np.log1p(-inside)


def decode_rotations(quaternions: Floats) -> Floats:
    """Return unit quaternions; the identity for those of zero length."""
    length = np.sqrt(np.einsum("nk,nk->n", quaternions, quaternions))[:, None]
    valid = np.isfinite(length) & (length > 0.0)
    return np.where(valid, quaternions / np.where(valid, length, 1.0), [1.0, 0.0, 0.0, 0.0])


def encode_rotations(rotations: Floats) -> Floats:
    """Return unit quaternions as they are."""
    return rotations
