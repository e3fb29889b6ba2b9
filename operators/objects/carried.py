"""What deforms with the points: the discs of the display, or splats."""

from typing import NamedTuple

import bpy
import numpy as np

from ... import core
from ...core.linalg import inv
from .attributes import (
    DISC,
    MOVED_DISC,
    SPLAT_HARMONIC,
    SPLAT_ROTATION,
    SPLAT_SCALE,
    has_vectors,
    points_checksum,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from .reading import sharing_objects
from .splats import HARMONIC, ROTATION, SCALE, harmonic_names, has_splats, shown_splats


class Carried(NamedTuple):
    """An attribute that a deformation changes."""

    name: str  # of the attribute at rest, which the modifier replaces where the deformation is shown
    moved: str  # of the attribute that holds it after the deformation; missing at rest
    data_type: str


def carried(data) -> tuple:
    """Return what deforms with the points of a mesh or a point cloud, as `Carried`."""
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
    """Whether more than positions has to be deformed; in Edit Mode attributes cannot be written."""
    data = obj.data
    if isinstance(data, bpy.types.Mesh) and data.is_editmode:
        return False
    return has_splats(data) or (has_vectors(data, DISC) and obj.meshfree.point_shape == "DISCS")


def discs_at_rest(obj):
    """Read the discs of an object's display at rest, normals times radii, (n, 3); None without discs."""
    return read_attribute(obj.data, DISC) if carries(obj) and not has_splats(obj.data) else None


def write_discs(obj, values):
    """Write the discs of an object's points where they are now, (n, 3), as `DISC` holds them."""
    write_attribute(obj.data, DISC, values)
    points = points_checksum(obj.data)
    for owner in (obj, *sharing_objects(obj)):
        owner.meshfree.discs_of = points


def local_gradients(gradients, matrix):
    """Transform deformation gradients, (n, 3, 3), to local space, from which a matrix, (3, 3), leads."""
    both = np.kron(inv(matrix).T, matrix)  # one large product: n small ones take ten times as long
    return (gradients.reshape(-1, 9) @ both).reshape(-1, 3, 3)


def moved_discs(vectors, gradients):
    """Return discs, normals times radii, (n, 3), after a deformation with these gradients, (n, 3, 3)."""
    radii = np.linalg.norm(vectors, axis=1)
    known = radii > 0.0  # added points have zeros
    moved = core.surface.Discs(vectors[known] / radii[known, None], radii[known]).deformed(gradients[known])
    result = np.zeros(vectors.shape)
    result[known] = moved.normals * moved.radii[:, None]
    return result


def moved_splats(splats) -> dict:
    """Return deformed splats, with the harmonics that they have, by the names of attributes."""
    harmonics = {_harmonic(number): splats.harmonics[:, number] for number in range(splats.harmonics.shape[1])}
    return {SPLAT_SCALE: splats.scales, SPLAT_ROTATION: splats.rotations, **harmonics}


def shown_moved(obj, strength) -> dict:
    """Return what deforms with the points, interpolated by the strength of the deformation, by attribute."""
    data = obj.data
    if not moved_names(data):
        return {}
    if has_splats(data):
        return moved_splats(shown_splats(obj))
    rest, moved = read_attribute(data, DISC), read_attribute(data, MOVED_DISC)
    return {MOVED_DISC: rest + strength * (moved - rest)}


def write_moved(data, moved):
    """Write what was deformed, by the names of attributes; remove them if there is nothing, as at rest."""
    if not moved:
        remove_attributes(data, *moved_names(data))
    for name, values in moved.items():
        write_attribute(data, name, values)


def moved_names(data) -> list:
    """Return the names of the attributes that hold what was deformed."""
    return [item.moved for item in carried(data) if item.moved in data.attributes]


def _harmonic(number):
    return f"{SPLAT_HARMONIC}{number}"
