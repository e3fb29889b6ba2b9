"""Read the points of a Blender object, in world lengths."""

import zlib
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ... import core
from ...core import PointCloudError
from ...core.linalg import cond, inv
from ...tools.quantities import ORIENTATION, quantity
from .attributes import CORNER, has_vectors, own_positions, point_count, read_attribute
from .counting import members
from .evaluated import evaluated_positions
from .groups import chosen_members
from .modifiers import is_own, is_sequence, modifier_settings
from .splats import LEFT_BEHIND, are_left_behind, has_splats, read_splats

TYPES = ("MESH", "POINTCLOUD")  # of objects that are read
_CONVERTIBLE = ("CURVE", "SURFACE", "FONT", "META", "CURVES", "GREASEPENCIL")  # which Blender converts to meshes


def shape_keys(obj):
    """Return the shape keys of an object, or None; point clouds have none."""
    return obj.data.shape_keys if obj.type == "MESH" else None


def obstacle(obj, modes=("OBJECT",)) -> str:
    """Return why an object cannot be read and written in these modes, and what to do; empty if it can."""
    if obj is None:
        return "No active object. Select a mesh with the points of a surface"
    if obj.type == "EMPTY" and obj.instance_collection is not None:
        return (
            f'"{obj.name}" shows the collection "{obj.instance_collection.name}". Select an object of that,'
            " or use Object > Apply > Make Instances Real"
        )
    if obj.type not in TYPES:
        kind = obj.bl_rna.properties["type"].enum_items[obj.type].name
        article = "an" if kind[0] in "AE" else "a"
        advice = "Convert it with Object > Convert > Mesh, or select" if obj.type in _CONVERTIBLE else "Select"
        return f'"{obj.name}" is {article} {kind}, not a Mesh. {advice} a mesh'
    if not obj.is_editable or not obj.data.is_editable:
        return f'"{obj.name}" is linked from a library. Use Object > Relations > Make Local > Selected Objects and Data'
    if obj.data.override_library is not None:
        return (
            f'"{obj.name}" is a library override, whose results would not be saved. Use Object > Relations > Make Local'
            " > Selected Objects and Data"
        )
    edited = getattr(obj.data, "is_editmode", False) and obj.mode != "EDIT"  # by another object with that mesh
    if obj.mode not in modes or edited:
        return f'"{obj.name}" is not in Object Mode. Switch to Object Mode first'
    # Object > Convert applies the display, which makes dots or discs.
    kind = "vertices" if obj.type == "MESH" else "points"
    lost = obj.meshfree.point_count and not point_count(obj.data)
    if lost or CORNER in obj.data.attributes:
        return f'"{obj.name}" has lost its {kind}. Undo, and instead of Object > Convert use Convert under Make'
    if any(map(is_sequence, obj.modifiers)):
        return (
            f'"{obj.name}" shows the objects of a collection, one at each frame. Turn on the check box of that'
            " collection in the Outliner, and select its objects"
        )
    if not point_count(obj.data):
        if any(item.type == "NODES" and not is_own(item) for item in obj.modifiers):
            return (
                f'"{obj.name}" has no {kind} but those that its nodes make. Put the node Points to Vertices at the end'
                " of the nodes, and apply them"
            )
        return f'"{obj.name}" has no {kind}. Add points, or select another object'
    return ""


@dataclass(frozen=True)
class Reading:
    """Points of an object."""

    # (n, 3) float64, positions with the object's scale, rotation and shear, without its location, to keep numbers small
    points: np.ndarray
    matrix: np.ndarray  # (3, 3) float64, the linear part of the object's matrix: points = local positions @ matrix.T
    boundary: np.ndarray | None = None  # (n,) bool, boundary points, where the user's vertex group names them
    notices: list = field(default_factory=list)  # of str, notices about how the object was read
    # (n, 3) float64, vectors that orient the normals, where Orient Normals or the user chose a side
    orientation: np.ndarray | None = None
    # The splats of the points in local space, without harmonics, if floaters are to be left out
    splats: "core.splats.Splats | None" = None

    def local(self, vectors):
        """Transform points or displacements, as read, to local space."""
        return vectors @ inv(self.matrix).T

    def placed(self, vectors):
        """Transform local points or displacements to those as read."""
        return vectors @ self.matrix.T

    def local_directions(self, directions):
        """Transform tangent directions, as read, to local unit vectors; none to none."""
        return _units(self.local(directions))

    def local_normals(self, normals):
        """Transform normals, as read, to local unit normals: covectors, so by M^T, not M^-1."""
        return _units(normals @ self.matrix)

    def placed_normals(self, normals):
        """Transform local normals to those of the points as read, of any length."""
        return normals @ inv(self.matrix)


def local_values(reading, name, values):
    """Return values of an attribute of some name in local space: vectors, (n, 3), by what they are; others as given."""
    if values.shape[1:] != (3,):
        return values
    row = quantity(name)
    if name == ORIENTATION or row.carried == "normal":
        return reading.local_normals(values)
    return (reading.local_directions if row.is_direction else reading.local)(values)


def _units(vectors):
    lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
    return vectors / np.where(lengths > 0.0, lengths, 1.0)


def read_points(context, obj) -> Reading:
    """Read an object's points as displayed, after modifiers only if the settings ask for them.

    Points that cannot be read or used raise `PointCloudError`, whose text says what to do.
    """
    positions, matrix = seen_positions(context, obj), checked_matrix(obj)
    judged = obj.meshfree.leave_out_floaters and has_splats(obj.data)
    splats = read_splats(obj.data, with_harmonics=False) if judged else None
    reading = Reading(
        core.check_points(positions) @ matrix.T, matrix, boundary_points(obj), reading_notices(obj), splats=splats
    )
    sides = chosen_sides(obj)
    return reading if sides is None else replace(reading, orientation=reading.placed_normals(sides))


def checked_matrix(obj):
    """Return the linear part of an object's matrix, (3, 3) float64, which must not be flat."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    if not cond(matrix) < 1e6:
        raise PointCloudError(
            f'"{obj.name}" is scaled to nothing along an axis, so its {point_count(obj.data)} points have no area.'
            " Give it a scale above zero along each axis."
        )
    return matrix


def reading_notices(obj) -> list:
    """Return notices about how an object is read."""
    notices = []
    if obj.type == "MESH" and obj.data.polygons:
        faces = len(obj.data.polygons)
        notices.append(f"The mesh has {faces} faces: only its {point_count(obj.data)} vertices are used.")
    if are_left_behind(obj.data):
        notices.append(f"{obj.name}: {LEFT_BEHIND}.")
    return notices


def chosen_sides(obj):
    """Read the local vectors that orient an object's normals, (n, 3) float64; None if none were chosen."""
    if not has_vectors(obj.data, ORIENTATION):
        return None
    sides = read_attribute(obj.data, ORIENTATION).astype(np.float64)
    return np.where(np.isfinite(sides).all(axis=1)[:, None], sides, 0.0)


def seen_positions(context, obj):
    """Read the local positions of an object's points for `read_points`, unchecked, (n, 3) float32."""
    context.view_layer.update()  # a script may have moved the object a line ago
    if obj.meshfree.use_modifiers or shape_keys(obj) is not None:
        return evaluated_positions(context, obj)
    return own_positions(obj.data)


def boundary_points(obj):
    """Read the points in an object's boundary group, (n,) bool; None if the settings name no group."""
    name = obj.meshfree.boundary_group
    return chosen_members(obj, name, "Boundary Group", core.geometry.FEWEST) if name else None


def key_positions(key):
    """Read the positions that a shape key holds, (n, 3) float32."""
    positions = np.empty((len(key.points), 3), np.float32)
    key.points.foreach_get("co", positions.reshape(-1))
    return positions


def metric(obj):
    """Return the metric of an object's matrix M, M^T M, which rotation and location do not change."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    return matrix.T @ matrix


def fingerprint(obj, glance=False, left_out=()) -> str:
    """Return a checksum of positions, without those of some points, of shape keys and of the boundary group.

    A glance is quick enough for a panel, some milliseconds for 1 million points; it may notice a change of the boundary
    group some seconds late, and is empty until that is counted. Of modifiers, if they are used, names and settings
    count, not the contents of other data that they refer to.
    """
    positions = own_positions(obj.data)
    positions[np.asarray(left_out, dtype=int)] = 0.0
    checksum = zlib.crc32(positions)
    keys = shape_keys(obj)
    if keys is not None:
        state = [keys.use_relative, keys.eval_time, obj.show_only_shape_key and obj.active_shape_key_index]
        for block in keys.key_blocks:
            state += [block.name, block.value, block.mute, block.vertex_group, block.relative_key.name]
            checksum = zlib.crc32(key_positions(block), checksum)
        checksum = zlib.crc32(repr(state).encode(), checksum)
    if obj.meshfree.use_modifiers:
        state = [modifier_settings(item) for item in obj.modifiers if not is_own(item)]
        checksum = zlib.crc32(repr(state).encode(), checksum)
    if obj.meshfree.boundary_group:
        boundary = members(obj, obj.meshfree.boundary_group, glance)
        if boundary is None:
            return ""
        checksum = zlib.crc32(repr(boundary.checksum).encode(), checksum)
    return f"{checksum:08x}"


def sharing_objects(obj) -> list:
    """Return all other objects with the same mesh."""
    if obj.data.users == 1:  # the usual case, quick for panels
        return []
    return [other for other in bpy.data.objects if other.data == obj.data and other != obj]


def find_object(uid):
    """Find an object by its session_uid, which is independent of undo and names; None if it was removed."""
    return next((obj for obj in bpy.data.objects if obj.session_uid == uid), None)


def spacing(data) -> float:
    """Return the typical distance of neighboring points of a mesh or a point cloud, in local lengths; 0 if unknown."""
    return core.geometry.typical_distance(own_positions(data))


def discs(normals, radii, points):
    """Return discs in the form of the display, (n, 3): unit normals times radii in units of the spacing."""
    spacing = core.geometry.typical_distance(points) or np.median(radii)  # zero where many points coincide
    return normals * (radii / spacing)[:, None]
