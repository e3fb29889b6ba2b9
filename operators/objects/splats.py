"""Gaussian splats as Blender 5.3 keeps them: attributes of the points of a point cloud, or of a mesh before 4.5."""

from dataclasses import replace
from itertools import count, takewhile

import numpy as np

from ... import core
from ...core import PointCloudError
from ...tools.quantities import DISPLACEMENT, PREFIX
from .attributes import (
    REST,
    SPLAT_HARMONIC,
    SPLAT_ROTATION,
    SPLAT_SCALE,
    own_positions,
    read_attribute,
    tag_changed,
    write_attribute,
    write_own_positions,
)
from .modifiers import get_input, is_deform

SCALE, ROTATION, BASE, HARMONIC = "scale", "rotation", "radiance:base", "radiance:sh_"
PLACE = ".splat_place"  # attribute: where a splat was when its ellipsoid was written, up to a common translation
LEFT_BEHIND = (
    "some of its splats were rotated or scaled without their ellipsoids, as Blender's own Join and Apply do. Undo that,"
    " and use Join Splats or Apply Transform to Splats instead"
)
MOST_DRAWN = 200_000  # splats that a viewport draws, unless the user asks for more
_MOST_STEPS = 32  # different translations of splats: more of them mean rotation or scaling
_STEP = 1e-5  # of the largest coordinate: smaller steps count as equal
_GLANCE = 4000  # splats that a panel checks
_FIRST = "scale_0"  # column that all files of splats have
_NUMBERS = ("FLOAT", "INT")  # types of columns
_TYPES = {SCALE: ("FLOAT_VECTOR",), ROTATION: ("QUATERNION",), BASE: ("FLOAT4", "FLOAT_COLOR")}


def has_splats(data) -> bool:
    """Whether the points of a mesh or a point cloud are Gaussian splats."""
    return all(
        name in data.attributes and data.attributes[name].data_type in types and data.attributes[name].domain == "POINT"
        for name, types in _TYPES.items()
    )


def column_names(data) -> list:
    """Return the names of the attributes of points that may be columns of a file: numbers, and no results."""
    return [
        item.name
        for item in data.attributes
        if item.domain == "POINT" and item.data_type in _NUMBERS and not item.name.startswith((".", PREFIX))
    ]


def holds_columns(data) -> bool:
    """Whether attributes of loose points are the columns of a file of splats, as Blender's PLY importer leaves them."""
    if _FIRST not in data.attributes or has_splats(data) or getattr(data, "polygons", ()):
        return False
    return core.splats.hold_enough((*"xyz", *column_names(data)))


def harmonic_names(data) -> list:
    """Return the names of the attributes of the harmonics, in their order, of whole degrees."""
    names = list(takewhile(lambda name: name in data.attributes, (f"{HARMONIC}{number}" for number in count())))
    return names[: max(known for known in core.splats.COUNTS if known <= len(names))]


def read_splats(data, with_harmonics=True) -> "core.splats.Splats":
    """Read the splats of a mesh or a point cloud, in local space, without harmonics as if they were of degree 0.

    Points that are no splats raise `PointCloudError`.
    """
    if not has_splats(data):
        raise PointCloudError(
            f'"{data.name}" holds no Gaussian splats: its points need the attributes {SCALE}, {ROTATION} and {BASE}.'
            " Import a file of splats."
        )
    base, names = read_attribute(data, BASE), harmonic_names(data) if with_harmonics else []
    harmonics = np.empty((len(base), len(names), 3), np.float32)
    for number, name in enumerate(names):
        harmonics[:, number] = read_attribute(data, name)
    return core.splats.Splats(
        own_positions(data),
        read_attribute(data, SCALE),
        read_attribute(data, ROTATION),
        base[:, 3],
        base[:, :3],
        harmonics,
    )


def write_splats(data, splats):
    """Move the splats of a mesh or a point cloud, and write their sizes, rotations and harmonics, in local space.

    Other attributes that are lengths are scaled with their sizes.
    """
    moved = splats.positions - own_positions(data)
    write_own_positions(data, splats.positions)
    if PLACE in data.attributes:
        write_attribute(data, PLACE, read_attribute(data, PLACE) + moved, "FLOAT_VECTOR")
    else:
        remember_places(data)
    grown = growth(read_attribute(data, SCALE), splats.scales)
    for name in core.splats.LENGTHS:
        if name in data.attributes:
            write_attribute(data, name, read_attribute(data, name) * grown, "FLOAT")
    write_attribute(data, SCALE, splats.scales, "FLOAT_VECTOR")
    write_attribute(data, ROTATION, splats.rotations, "QUATERNION")
    for number, name in enumerate(harmonic_names(data)):
        write_attribute(data, name, splats.harmonics[:, number], "FLOAT_VECTOR")
    tag_changed(data)


def shown_splats(obj) -> "core.splats.Splats":
    """Return the splats of an object as its deformation shows them, interpolated from rest by its strength."""
    data = obj.data
    splats = read_splats(data)
    modifier = next(filter(is_deform, obj.modifiers), None)
    if modifier is None or DISPLACEMENT not in data.attributes:
        return splats
    strength = get_input(modifier, "Strength")
    positions = read_attribute(data, REST) + strength * read_attribute(data, DISPLACEMENT)
    if SPLAT_SCALE not in data.attributes:
        return replace(splats, positions=positions)
    scales = _between(splats.scales, read_attribute(data, SPLAT_SCALE), strength)
    rotations = _slerp(splats.rotations, read_attribute(data, SPLAT_ROTATION), strength)
    harmonics = splats.harmonics.copy()
    for number in range(harmonics.shape[1]):
        name = f"{SPLAT_HARMONIC}{number}"
        if name in data.attributes:
            harmonics[:, number] = _between(harmonics[:, number], read_attribute(data, name), strength)
    return replace(splats, positions=positions, scales=scales, rotations=rotations, harmonics=harmonics)


def growth(before, after):
    """Return the factors of the lengths of splats, (n,), as the cube roots of their volumes; 1 without a volume."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.exp(np.mean(np.log(after, dtype=np.float64) - np.log(before, dtype=np.float64), axis=1))
    return np.where(np.isfinite(factors) & (factors > 0.0), factors, 1.0)


def remember_places(data):
    """Keep the positions at which ellipsoids were written."""
    write_attribute(data, PLACE, own_positions(data), "FLOAT_VECTOR")


def are_left_behind(data, glance=False) -> bool:
    """Whether splats were rotated or scaled without their ellipsoids, as Blender's own Join and Apply do.

    Splats that are only translated share one translation, or few. A glance, quick enough for a panel, checks some of
    them.
    """
    if PLACE not in data.attributes or not has_splats(data):
        return False
    now, before = own_positions(data), read_attribute(data, PLACE)
    every = 1 + len(now) // _GLANCE if glance else 1
    return _count_steps(now[::every], before[::every]) > _MOST_STEPS


def _count_steps(now, before):
    """Count the different translations of splats from earlier positions, (n, 3) both."""
    known = before.any(axis=1)  # splats from elsewhere have zeros
    size = max(np.abs(values[known]).max(initial=0.0) for values in (now, before)) or 1.0
    steps = np.round((now - before)[known].astype(np.float64) / (_STEP * size)).astype(np.int64)
    return len(np.unique(steps @ [1, 1 << 20, 1 << 40]))


def _between(one, other, share):
    return one + share * (other - one)


def _slerp(one, other, share):
    """Interpolate unit quaternions, (n, 4), on the shortest arc."""
    cosine = np.einsum("nk,nk->n", one, other, dtype=np.float64)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = [np.where(angle > 1e-6, np.sin(part * angle) / np.sin(angle), part) for part in (1.0 - share, share)]
    mixed = shares[0] * one + shares[1] * np.where(cosine < 0.0, -1.0, 1.0)[:, None] * other
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
