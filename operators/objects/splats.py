"""Gaussian splats as Blender 5.3 keeps them: attributes of the points of a point cloud, or of a mesh before 4.5."""

from itertools import count, takewhile

import numpy as np

from ...core import PointCloudError, Splats
from ...core.splats.harmonics import COUNTS
from .attributes import own_positions, read_attribute, tag_changed, write_attribute, write_own_positions

SCALE, ROTATION, BASE, HARMONIC = "scale", "rotation", "radiance:base", "radiance:sh_"
_TYPES = {SCALE: ("FLOAT_VECTOR",), ROTATION: ("QUATERNION",), BASE: ("FLOAT4", "FLOAT_COLOR")}


def has_splats(data) -> bool:
    """Whether the points of a mesh or a point cloud are Gaussian splats."""
    return all(
        name in data.attributes and data.attributes[name].data_type in types and data.attributes[name].domain == "POINT"
        for name, types in _TYPES.items()
    )


def harmonic_names(data) -> list:
    """Return the names of the attributes of the harmonics, in their order, of whole degrees."""
    names = list(takewhile(lambda name: name in data.attributes, (f"{HARMONIC}{number}" for number in count())))
    return names[: max(known for known in COUNTS if known <= len(names))]


def read_splats(data) -> Splats:
    """Read the splats of a mesh or a point cloud, in local space.

    Raises
    ------
    PointCloudError
        Its points are no splats.
    """
    if not has_splats(data):
        raise PointCloudError(
            f'"{data.name}" holds no Gaussian splats: its points need the attributes {SCALE}, {ROTATION} and {BASE}.'
            " Import a file of splats."
        )
    base, names = read_attribute(data, BASE), harmonic_names(data)
    harmonics = np.empty((len(base), len(names), 3), np.float32)
    for number, name in enumerate(names):
        harmonics[:, number] = read_attribute(data, name)
    return Splats(
        own_positions(data),
        read_attribute(data, SCALE),
        read_attribute(data, ROTATION),
        base[:, 3],
        base[:, :3],
        harmonics,
    )


def write_splats(data, splats):
    """Move the splats of a mesh or a point cloud, and write their sizes, rotations and harmonics, in local space."""
    write_own_positions(data, splats.positions)
    write_attribute(data, SCALE, splats.scales, "FLOAT_VECTOR")
    write_attribute(data, ROTATION, splats.rotations, "QUATERNION")
    for number, name in enumerate(harmonic_names(data)):
        write_attribute(data, name, splats.harmonics[:, number], "FLOAT_VECTOR")
    tag_changed(data)
