"""Handles: groups of points that empties, or Edit Mode, move, and anchors."""

import zlib
from dataclasses import dataclass

import numpy as np

from ... import core
from ...core import LaplacianOptions, PointCloudError
from ...tools.groups import ANCHOR
from ..objects.counting import weighted_checksum
from ..objects.groups import chosen_weights, handle_names, is_chosen
from ..objects.options import laplacian_options, settings_values
from ..objects.reading import TYPES, boundary_points
from ..objects.splats import has_splats, read_splats
from ..running import cache
from .binding import bound_objects, is_bound, read_rest
from .pose import Pose, is_there


@dataclass(frozen=True)
class Constraints:
    """Constrained points: handles and anchors."""

    names: list  # of str, the groups of the handles
    # (h,) int, the points that are moved, and for each the number of its group
    moved: np.ndarray
    owner: np.ndarray
    kept: np.ndarray  # (a,) int, the points that stay
    strength: np.ndarray  # (h + a,), their weights in their groups
    checksum: str  # of all of these


@dataclass(frozen=True)
class Binding:
    """The binding of an object, read from it once."""

    rest: np.ndarray  # (n, 3) float32, points at rest in local space
    matrix: np.ndarray  # (3, 3), from local space to world lengths, when it was bound
    constraints: Constraints | None  # None where the operator is needed to choose them
    splats: "core.splats.Splats | None"  # at rest in local space, if the points are splats
    rotation_aware: bool
    softness: float | None  # factor of the weights of constraints; None for hard ones
    options: LaplacianOptions
    boundary: np.ndarray | None  # (n,) bool
    leave_out_floaters: bool  # whether floaters are excluded from the surface

    def laplacian(self, progress) -> "core.LaplaceBeltrami":
        """Return the operator of the points at rest, in lengths of the world."""
        points, judged = self.rest.astype(np.float64) @ self.matrix.T, self.splats if self.leave_out_floaters else None
        return cache.build(points, self.options, self.boundary, progress, splats=judged).laplacian

    def handles(self, pose: "HandlePose"):
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

    Without handles, or with points in several groups, `PointCloudError` is raised.
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
    checksum = groups_checksum(names, [weighted_checksum(held) for held in (*weights, anchors)])
    return Constraints(names, moved, owner, kept, strength, checksum)


def groups_checksum(names, weighted) -> str:
    """Checksum of the groups of the handles, given by name, and of the anchors, by the checksums of their weights."""
    return f"{zlib.crc32(repr((names, weighted)).encode()):08x}"


@dataclass(frozen=True)
class HandlePose(Pose):
    """A pose of the handles."""

    changes: dict  # (4, 4) each, transforms of groups by their empties since they were bound, in local space
    edited: np.ndarray | None  # (n, 3), positions in local space, where some handles are moved in Edit Mode
    steps: int  # maximum number of a settled result


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
    by_empty = moved_by_empties(obj)
    return ~np.isin(constraints.owner, [index for index, name in enumerate(constraints.names) if name in by_empty])


def moved_by_empties(obj) -> set:
    """Return the groups of handles that empties move."""
    return {item.name for item in obj.meshfree.deform.handle_items if item.has_empty}


def settings_text(obj) -> str:
    """Return the settings of the operator that deformations depend on, as text."""
    settings = obj.meshfree
    floaters = () if settings.leave_out_floaters else ("floaters",)
    return repr((settings_values(settings), settings.boundary_group, settings.use_modifiers, *floaters))
