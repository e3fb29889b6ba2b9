"""What goes along with points that a deformation moves: the discs that the display draws, or splats."""

from typing import NamedTuple

import bpy
import numpy as np

from ... import core
from .attributes import (
    DISC,
    MOVED_DISC,
    SPLAT_HARMONIC,
    SPLAT_ROTATION,
    SPLAT_SCALE,
    has_vectors,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from .splats import HARMONIC, ROTATION, SCALE, harmonic_names, has_splats, shown_splats


class Carried(NamedTuple):
    """An attribute that a deformation changes.

    Attributes
    ----------
    name : str
        Of the attribute at rest, whose place is taken where the deformation is shown.
    moved : str
        Of the attribute that holds it after the deformation; there is none where that changes nothing.
    data_type : str
    """

    name: str
    moved: str
    data_type: str


def carried(data) -> tuple:
    """Return what goes along with the points of a mesh or a point cloud, as `Carried`."""
    if has_splats(data):
        harmonics = range(len(harmonic_names(data)))
        numbered = (Carried(f"{HARMONIC}{number}", _harmonic(number), "FLOAT_VECTOR") for number in harmonics)
        return (
            Carried(SCALE, SPLAT_SCALE, "FLOAT_VECTOR"),
            Carried(ROTATION, SPLAT_ROTATION, "QUATERNION"),
            *numbered,
        )
    return (Carried(DISC, MOVED_DISC, "FLOAT_VECTOR"),) if has_vectors(data, DISC) else ()


def carries(obj) -> bool:
    """Whether more than places has to follow a deformation; in Edit Mode that is out of reach."""
    data = obj.data
    if isinstance(data, bpy.types.Mesh) and data.is_editmode:
        return False
    return has_splats(data) or (has_vectors(data, DISC) and obj.meshfree.point_shape == "DISCS")


def discs_at_rest(obj):
    """Read the discs that the display of an object draws at rest, normals times radii, (n, 3); None for none."""
    return read_attribute(obj.data, DISC) if carries(obj) and not has_splats(obj.data) else None


def local_gradients(gradients, matrix):
    """Return deformation gradients, (n, 3, 3), of points that a matrix, (3, 3), takes from local space, as there."""
    # Two large products: n small ones take five times as long.
    right = (gradients.reshape(-1, 3) @ matrix).reshape(-1, 3, 3)
    return np.moveaxis(np.tensordot(np.linalg.inv(matrix), right, (1, 1)), 1, 0)


def moved_discs(vectors, gradients):
    """Return discs, normals times radii, (n, 3), after a deformation with these gradients, (n, 3, 3)."""
    radii = np.linalg.norm(vectors, axis=1)
    known = radii > 0.0  # of points that were added since, nothing is known
    moved = core.Discs(vectors[known] / radii[known, None], radii[known]).deformed(gradients[known])
    result = np.zeros(vectors.shape)
    result[known] = moved.normals * moved.radii[:, None]
    return result


def moved_splats(splats) -> dict:
    """Return splats after a deformation, those harmonics that they have, by the names of their attributes."""
    harmonics = {_harmonic(number): splats.harmonics[:, number] for number in range(splats.harmonics.shape[1])}
    return {SPLAT_SCALE: splats.scales, SPLAT_ROTATION: splats.rotations, **harmonics}


def shown_moved(obj, strength) -> dict:
    """Return what goes along as a deformation shows it, by a share of it, by the names of its attributes."""
    data = obj.data
    if not moved_names(data):
        return {}
    if has_splats(data):
        return moved_splats(shown_splats(obj))
    rest, moved = read_attribute(data, DISC), read_attribute(data, MOVED_DISC)
    return {MOVED_DISC: rest + strength * (moved - rest)}


def write_moved(data, moved):
    """Keep what was carried, by the names of the attributes; nothing for as it is at rest."""
    if not moved:
        remove_attributes(data, *moved_names(data))
    for name, values in moved.items():
        write_attribute(data, name, values)


def moved_names(data) -> list:
    """Return the names of the attributes that hold what was carried."""
    return [item.moved for item in carried(data) if item.moved in data.attributes]


def _harmonic(number):
    return f"{SPLAT_HARMONIC}{number}"
