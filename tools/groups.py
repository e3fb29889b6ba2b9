"""Groups of points: their names by what they are for, and what stands for them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import core
from .settings import Setting

HANDLE, ANCHOR, FIXED, SOURCE, LOW, HIGH, VALUE, BOUNDARY_GROUP = ROLES = (
    "Handle",
    "Anchor",
    "Fixed",
    "Source",
    "Low",
    "High",
    "Value",
    "Boundary",
)

Array = NDArray[Any]
Floats = NDArray[np.float64]


def source_setting(description: str, label: str = "Sources") -> Setting:
    """Return the setting that names the group of the sources of a tool."""
    return Setting(
        "group",
        f"{description}; where there is none of that name, the points selected in Edit Mode",
        SOURCE,
        label=label,
    )


def is_chosen(name: str, default: str, there: bool) -> bool:
    """Whether a setting names a group that must exist: any but the default, which may not be there."""
    return bool(name) and (there or name != default)


def column_weights(values: Array, name: str, where: str) -> Floats:
    """Return the weights, (n,) float64, that a column of a file or an object holds.

    Numbers from 0 to 1 are weights; of whole numbers all but 0 count.
    """
    if values.ndim > 1:
        raise core.PointCloudError(f'The column "{name}" of {where} holds vectors. Name one with a number a point.')
    weights = (values if values.dtype.kind == "f" else values.astype(bool)).astype(np.float64)
    if not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise core.PointCloudError(
            f'The column "{name}" of {where} has numbers that are not from 0 to 1, so they are no weights. Name'
            " another, or let it hold 1 for the points of the group and 0 for others."
        )
    return weights


def check_vectors(values: Array, name: str, where: str) -> Array:
    """Refuse an attribute that does not hold vectors, and return it."""
    if values.ndim != 2:
        raise core.PointCloudError(
            f'The attribute "{name}" of {where} holds no vectors. Choose one with a vector for each point.'
        )
    return values


def check_enough(weights: Floats, kind: str, name: str, setting: str, least: int = 1, how: str = "") -> None:
    """Refuse weights, (n,), of which fewer than a number are above zero; `how` the group of a kind gets more."""
    count = np.count_nonzero(weights > 0.0)
    if count < least:
        raise core.PointCloudError(
            f'The {kind} "{name}" gives {count} of {len(weights)} points a weight above zero, and {setting}'
            f" takes at least {least}. Assign points to it{how}, or clear {setting}."
        )


def unreached(reached: Array, consequence: str) -> list[str]:
    """Return a notice of the points that no source reaches, given those that one does, (n,) bool."""
    missed = np.count_nonzero(~reached)
    return [f"{missed:,} points are reached by no source. {consequence}"] if missed else []
