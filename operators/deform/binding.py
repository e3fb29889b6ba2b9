"""The binding of an object to its handles, kept in the file, and whether it is valid.

The points at rest are the attribute `lb_rest`, in local space. Which empties move which groups is in
`Object.meshfree.deform`.
"""

import zlib
from dataclasses import dataclass
from uuid import uuid4

import bmesh
import bpy
import numpy as np

from ... import core
from ...command.quantities import DISPLACEMENT
from ...core import LaplacianOptions, PointCloudError
from ..objects.attributes import (
    REST,
    in_edit_mesh,
    point_count,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from ..objects.carried import moved_names
from ..objects.counting import members, weighted_checksum
from ..objects.groups import ANCHOR, chosen_weights, handle_names, is_chosen
from ..objects.handlers import notify
from ..objects.options import laplacian_options, settings_values
from ..objects.reading import TYPES, boundary_points, fingerprint, sharing_objects
from ..objects.splats import has_splats, read_splats
from ..running import cache
from .nodes import find_deform, is_baked
from .pose import POSE, Pose, is_there

WRITES = DISPLACEMENT, REST
_bound = b"", ()  # session_uids of all objects at the last search, and the indices of the bound ones


@dataclass(frozen=True)
class Constraints:
    """Constrained points: handles and anchors.

    Attributes
    ----------
    names : list of str
        The groups of the handles.
    moved, owner : ndarray, (h,) int
        The points that are moved, and for each the number of its group.
    kept : ndarray, (a,) int
        The points that stay.
    strength : ndarray, (h + a,)
        Their weights in their groups.
    checksum : str
        Of all of these.
    """

    names: list
    moved: np.ndarray
    owner: np.ndarray
    kept: np.ndarray
    strength: np.ndarray
    checksum: str


@dataclass(frozen=True)
class Binding:
    """The binding of an object, read from it once.

    Attributes
    ----------
    rest : ndarray, (n, 3) float32
        Points at rest in local space.
    matrix : ndarray, (3, 3)
        From local space to world lengths, when it was bound.
    constraints : Constraints or None
        None where the operator is needed to choose them.
    splats : Splats or None
        At rest in local space, if the points are splats.
    rotation_aware : bool
    softness : float or None
        Factor of the weights of constraints; None for hard ones.
    options : LaplacianOptions
    boundary : ndarray, (n,) bool, or None
    leave_out_floaters : bool
        Whether floaters are excluded from the surface.
    """

    rest: np.ndarray
    matrix: np.ndarray
    constraints: Constraints | None
    splats: "core.Splats | None"
    rotation_aware: bool
    softness: float | None
    options: LaplacianOptions
    boundary: np.ndarray | None
    leave_out_floaters: bool

    def laplacian(self, progress) -> "core.LaplaceBeltrami":
        """Return the operator of the points at rest, in lengths of the world."""
        points, judged = self.rest.astype(np.float64) @ self.matrix.T, self.splats if self.leave_out_floaters else None
        return cache.build(points, self.options, self.boundary, progress, splats=judged).laplacian

    def handles(self, pose: Pose):
        """Return the positions of the handles in a pose, in local space, (h, 3)."""
        moved, owner = self.constraints.moved, self.constraints.owner
        placed = self.rest[moved].astype(np.float64)
        for index, name in enumerate(self.constraints.names):
            rows, change = owner == index, pose.changes.get(name)
            if change is not None:
                placed[rows] = placed[rows] @ change[:3, :3].T + change[:3, 3]
            elif pose.edited is not None:
                placed[rows] = pose.edited[moved[rows]]
        return placed


def read_binding(obj) -> Binding:
    """Read the binding of a bound object."""
    matrix = np.reshape(obj.meshfree.deform.matrix, (3, 3)).astype(np.float64)
    return plan_binding(obj, read_rest(obj), matrix, read_constraints(obj))


def plan_binding(obj, rest, matrix, constraints=None) -> Binding:
    """Make the binding of an object for these points at rest; see `Binding`."""
    settings, deform = obj.meshfree, obj.meshfree.deform
    return Binding(
        rest,
        matrix,
        constraints,
        read_splats(obj.data) if has_splats(obj.data) else None,
        deform.rotation_aware,
        deform.weight if deform.soft else None,
        laplacian_options(settings),
        boundary_points(obj),
        settings.leave_out_floaters,
    )


def read_constraints(obj) -> Constraints:
    """Read the handles and anchors of an object.

    Raises
    ------
    PointCloudError
        There are no handles, or points that are in several groups.
    """
    settings = obj.meshfree.deform
    names = handle_names(obj) or [settings.handles]  # whose error names the missing group
    weights = np.array([chosen_weights(obj, name, "Handles") for name in names])
    several = int(np.count_nonzero(np.count_nonzero(weights > 0.0, axis=0) > 1))
    if several:
        raise PointCloudError(
            f'{several} points of "{obj.name}" are in more than one of the groups {", ".join(names)}. Leave'
            " each in one."
        )
    anchors = np.zeros(weights.shape[1])
    if is_chosen(obj, settings.anchors, ANCHOR):
        anchors = chosen_weights(obj, settings.anchors, "Anchors")
    return constrain(names, weights, anchors)


def constrain(names, weights, anchors) -> Constraints:
    """Return the constraints by the groups of handles, with their weights, (g, n), and those of the anchors, (n,)."""
    moved, kept = np.flatnonzero(weights.max(axis=0) > 0.0), np.flatnonzero(anchors > 0.0)
    owner = weights.argmax(axis=0)[moved]
    strength = np.concatenate([weights.max(axis=0)[moved], anchors[kept]])
    checksum = _groups_checksum(names, [weighted_checksum(held) for held in (*weights, anchors)])
    return Constraints(names, moved, owner, kept, strength, checksum)


def _groups_checksum(names, weighted) -> str:
    """Checksum of the groups of the handles, given by name, and of the anchors, by the checksums of their weights."""
    return f"{zlib.crc32(repr((names, weighted)).encode()):08x}"


def _groups_now(obj, glance, trusting):
    """Return the checksum of the groups and the points moved in Edit Mode; None until these are counted."""
    names = handle_names(obj)
    found = [members(obj, name, glance, trusting) for name in (*names, obj.meshfree.deform.anchors)]
    if None in found:
        return None
    by_empty = _moved_by_empties(obj)
    edited = [group.rows for name, group in zip(names, found[:-1], strict=True) if name not in by_empty]
    checksum = _groups_checksum(names, [group.weighted for group in found])
    return checksum, np.concatenate(edited) if edited else np.empty(0, int)


def forget_bound():
    """Search for bound objects again at the next use."""
    global _bound
    _bound = b"", ()


def bound_objects(scene=None) -> list:
    """Find all bound objects, or those of a scene.

    Objects are searched only if they differ from those at the last call, since this is called at each mouse move: a
    search of 5,000 objects takes 9 ms.
    """
    global _bound
    objects = bpy.data.objects
    uids = np.empty(len(objects), np.int32)
    objects.foreach_get("session_uid", uids)
    known, places = _bound
    if uids.tobytes() != known:  # in the order of their names
        places = [place for place, obj in enumerate(objects) if obj.type in TYPES and is_bound(obj)]
        _bound = uids.tobytes(), places
    found = [objects[place] for place in places]
    return found if scene is None else [obj for obj in found if is_there(obj, scene)]


def is_bound(obj) -> bool:
    """Whether an object is bound to handles, stale or not."""
    return obj is not None and obj.meshfree.deform.is_bound


def handled_object(obj, scene):
    """Return the object in a scene that an empty deforms as a handle, or else the object itself."""
    if obj is None or obj.type in TYPES:
        return obj
    for other in bound_objects(scene):
        if any(item.empty == obj for item in other.meshfree.deform.handle_items) and copied_from(other) is None:
            return other
    return obj


def copied_from(obj):
    """Return the bound object from which another one was copied without the empties; None for others.

    Empties belong to the object that is their parent; copies keep their shape when these are moved.
    """
    empties = [item.empty for item in obj.meshfree.deform.handle_items if item.has_empty and is_there(item.empty)]
    parents = [empty.parent for empty in empties]
    if not is_bound(obj) or obj in parents:
        return None
    for parent in parents:
        bound = parent is not None and parent.type in TYPES and is_bound(parent)
        if bound and any(item.empty in empties for item in parent.meshfree.deform.handle_items):
            return parent
    return None


def edited_rows(obj, constraints):
    """Return which handles have no empty, and are moved in Edit Mode, (h,) bool."""
    by_empty = _moved_by_empties(obj)
    return ~np.isin(constraints.owner, [index for index, name in enumerate(constraints.names) if name in by_empty])


def _moved_by_empties(obj) -> set:
    """Return the groups of handles that empties move."""
    return {item.name for item in obj.meshfree.deform.handle_items if item.has_empty}


def settings_text(obj) -> str:
    """Return the settings of the operator that deformations depend on, as text."""
    settings = obj.meshfree
    floaters = () if settings.leave_out_floaters else ("floaters",)
    return repr((settings_values(settings), settings.boundary_group, settings.use_modifiers, *floaters))


def stale_reason(obj, glance=False, trusting=False) -> str:
    """Return why a bound object no longer follows its handles, and what to do; empty if it does.

    A glance is quick enough for a panel; see `fingerprint`. A trusting one is quick enough for a drag: it uses the last
    count of groups.
    """
    settings = obj.meshfree.deform
    count = len(bmesh.from_edit_mesh(obj.data).verts) if in_edit_mesh(obj) else point_count(obj.data)
    if is_baked(obj):
        return "Its animation is baked. Delete the bake to let it follow the handles again"
    original = copied_from(obj)
    if original is not None and original.data == obj.data:
        return f'It shares its mesh with "{original.name}", whose handles move both'
    if original is not None:
        return f'It has no handles of its own, "{original.name}" has them. Bind again to get copies of them'
    if count != settings.point_count:
        return f"It had {settings.point_count:,} points and has {count:,} now. Bind again"
    gone = [item.name for item in settings.handle_items if item.has_empty and not is_there(item.empty)]
    if gone:
        return f"The empty of {', '.join(gone)} was deleted. Bind again to get a new one"
    if find_deform(obj) is None:
        return 'The modifier "Mesh-Free Deform" or an input of its nodes was removed. Bind again'
    if settings.settings_used != settings_text(obj):
        return "Settings changed. Bind again"
    others = [other.name for other in sharing_objects(obj) if is_bound(other) and copied_from(other) != obj]
    if others:
        return f'It shares its mesh with "{others[0]}", which is bound, too. Make it a single user'
    if in_edit_mesh(obj):  # groups and positions can only be checked outside
        return ""
    if any(obj.data.attributes.get(name) is None for name in WRITES):
        return f"The attributes {WRITES[0]} and {WRITES[1]} were removed. Bind again"
    groups = _groups_now(obj, glance, trusting)
    if groups is None:
        return ""
    checksum, edited = groups
    if settings.groups_used != checksum:
        return "The groups of handles or anchors changed. Bind again"
    known = fingerprint(obj, glance, left_out=edited)
    if known and settings.fingerprint != known:
        return "The points at rest were moved. Bind again"
    return ""


def read_rest(obj):
    """Read the points at rest in local space, (n, 3) float32."""
    if not in_edit_mesh(obj):
        return read_attribute(obj.data, REST)
    edited = bmesh.from_edit_mesh(obj.data)
    layer = edited.verts.layers.float_vector[REST]
    return np.array([vertex[layer][:] for vertex in edited.verts], np.float32)


def record(obj, rest, matrix, constraints, empties):
    """Write the binding of an object to the file: the first three fields of a `Binding`.

    Parameters
    ----------
    obj : bpy.types.Object
    rest, matrix, constraints
        As of `Binding`.
    empties : list
        For each group of handles its empty and the matrix of that at rest in local space, (4, 4), or None.
    """
    settings = obj.meshfree.deform
    settings.handle_items.clear()
    for name, moved_by in zip(constraints.names, empties, strict=True):
        item = settings.handle_items.add()
        item.name, item.has_empty = name, moved_by is not None
        if moved_by is not None:
            item.empty, item.rest = moved_by[0], np.reshape(moved_by[1], -1)
    write_attribute(obj.data, REST, rest)
    settings.matrix = np.reshape(matrix, -1)
    settings.groups_used, settings.settings_used = constraints.checksum, settings_text(obj)
    settings.point_count = len(rest)
    settings.is_bound = True
    renew(obj, constraints)


def renew(obj, constraints):
    """Take the present points of a bound object, which `lb_rest` holds, as those at rest."""
    settings = obj.meshfree.deform
    # Points that are moved in Edit Mode do not count.
    settings.fingerprint = fingerprint(obj, left_out=constraints.moved[edited_rows(obj, constraints)])
    settings.binding_id = uuid4().hex


def forget(obj):
    """Remove the binding of an object from the file."""
    settings = obj.meshfree.deform
    settings.is_bound = False
    settings.handle_items.clear()
    remove_attributes(obj.data, *WRITES, *moved_names(obj.data))
    obj.data.pop(POSE, None)
    modifier = find_deform(obj)
    if modifier is not None:
        obj.modifiers.remove(modifier)
        notify("shape_changed", obj)
