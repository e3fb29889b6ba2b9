"""Automatic Weights: how much each point follows each bone of an armature, and what lets it follow."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty

from ... import core
from ...core import NotASurfaceError, PointCloudError, TooFewPointsError
from ..objects.attributes import DISC
from ..objects.groups import has_group
from ..objects.reading import find_object, sharing_objects
from ..registration import Registration, Row
from ..running.application import Tool, operator_reader
from .bones import chosen_armature, deforming_bones, ends_seen_from
from .follow import add_modifier, bind, check_bindable, set_parent
from .follow_tools import ArmatureOperator
from .limits import influences, least_weight
from .weights import MOST, named, read_weights, takes_groups, weight_names, write_weights

_BUILDING = 0.6  # share of the time that the operator takes
_MOVED = 1e-5  # of the extent of the bones: they were moved meanwhile


class _Weighted(NamedTuple):
    """Weights of the points of an object, and of which bones, as they lay when the points were read."""

    armature: int  # session_uid
    names: list
    ends: np.ndarray  # (2, b, 3)
    weights: np.ndarray  # (n, b)
    notices: list


class AutoWeights(Tool):
    """The settings and the work of `meshfree.auto_weights`."""

    asks = ("falloff", "influences", "least", "visible")
    at_zero = {"influences": "Any"}

    falloff: FloatProperty(
        name="Falloff",
        description="Width of the blend between two bones, in distances from the surface to the bones",
        default=1.0,
        min=0.01,
        soft_min=0.25,
        soft_max=4.0,
    )
    influences: influences(MOST)
    least: least_weight()
    visible: BoolProperty(
        name="Visible",
        description="Points follow only bones that they see within the body, and not those of a limb beside it",
        default=True,
    )

    @classmethod
    def armature_of(cls, context):
        """Return the armature whose bones the points shall follow, or None."""
        return chosen_armature(context)

    def plan(self, context, obj):
        armature = self.armature_of(context)
        bones = deforming_bones(armature)
        _check_objects(obj, armature, bones.names)
        uid, ends = armature.session_uid, np.array(ends_seen_from(obj, armature, bones))
        for other in [] if self.becomes_single(obj) else sharing_objects(obj):
            if _have_moved(ends, ends_seen_from(other, armature, bones)):
                raise PointCloudError(
                    f'"{other.name}" shares its mesh and lies elsewhere, where the bones give it other weights. Turn on'
                    " Make Single User to give each a mesh of its own."
                )
        reading, operator = operator_reader(context, obj)
        settings = {"falloff": self.falloff, "least": self.least, "visible": self.visible}
        most = self.influences or None
        settings["influences"] = most if takes_groups(obj) else min(most or MOST, MOST)

        def compute(progress):
            def part(first, share):
                return lambda stage, fraction: progress(stage, first + share * fraction)

            notices = []
            try:
                laplacian = operator(part(0.0, _BUILDING))
            except (TooFewPointsError, NotASurfaceError) as error:
                notices.append(f"Each point follows the nearest bone alone, since there is no surface: {error}")
                weights = core.rig.nearest_bones(reading.points, *ends)
            else:
                left = np.count_nonzero(laplacian.component < 0)
                if left:
                    notices.append(f"Points on no surface: {left:,}. They have the weights of the nearest one on it.")
                rest = part(_BUILDING, 1.0 - _BUILDING)
                weights = core.rig.bone_weights(laplacian, *ends, **settings, notices=notices, progress=rest)
            return _Weighted(uid, bones.names, ends, weights, notices)

        return compute

    def write(self, context, obj, result):
        armature = find_object(result.armature)
        if armature is None:
            raise PointCloudError("The armature was deleted meanwhile. Start it again with another one.")
        bones = deforming_bones(armature)
        if bones.names != result.names or _have_moved(result.ends, ends_seen_from(obj, armature, bones)):
            raise PointCloudError(f'Bones of "{armature.name}" were changed or moved meanwhile. Start it again.')
        locked = _write(obj, result.names, result.weights)
        others = _other_armatures(obj, armature)
        told = [notice for user in (obj, *sharing_objects(obj)) for notice in _bind(user, armature)]
        largest = result.weights.max(axis=0)
        without = [name for name, most in zip(result.names, largest, strict=True) if most == 0.0]
        notices = [
            *result.notices,
            *told,
            *named(locked, "Locked vertex groups, left as they are, with the others normalized around them"),
            *named(without, "Bones that no point follows"),
            *named(others, "Armatures that it follows beside this one, by modifiers"),
        ]
        followed = len(result.names) - len(without)
        line = f"{obj.name}: {len(result.weights):,} points follow {followed} bones of {armature.name}"
        return [*notices, line]


def _check_objects(obj, armature, names):
    """Refuse an object that cannot follow these bones, before anything is computed."""
    check_bindable(obj, armature)
    taken = [name for name in names if name in obj.data.attributes and not has_group(obj, name)]
    if taken and takes_groups(obj):
        raise PointCloudError(
            f'"{obj.name}" has attributes named {", ".join(taken)}, and vertex groups share their names. Rename these'
            " attributes or bones."
        )
    if obj.meshfree.use_modifiers and any(item.type == "ARMATURE" for item in obj.modifiers):
        raise PointCloudError(
            f'"{obj.name}" is read after its Armature modifier, in a pose. Turn off Use Modifiers, so that its points'
            " are read at rest, as the bones are."
        )


def _have_moved(ends, now):
    """Whether bones lie elsewhere, seen from the points."""
    return np.abs(np.array(now) - ends).max() > _MOVED * np.ptp(ends.reshape(-1, 3), axis=0).max()


def _write(obj, names, weights):
    """Write weights but for locked vertex groups, and return the names of these.

    Of a point they leave so much to the others that the sum is one.
    """
    groups = obj.vertex_groups if takes_groups(obj) else {}
    locked = [name for name in names if name in groups and groups[name].lock_weight]
    free = np.array([name not in locked for name in names])
    weights = weights[:, free]
    if locked:
        held = read_weights(obj)[:, [weight_names(obj).index(name) for name in locked]].sum(axis=1)
        total = weights.sum(axis=1)
        weights = weights * (np.maximum(1.0 - held, 0.0) / np.where(total > 0.0, total, 1.0))[:, None]
    write_weights(obj, [name for name in names if name not in locked], weights)
    return locked


def _other_armatures(obj, armature):
    """Names of other armatures that modifiers of an object refer to."""
    found = [item.object for item in obj.modifiers if item.type == "ARMATURE"]
    return [other.name for other in found if other is not None and other != armature]


def _bind(obj, armature):
    """Let an object follow an armature by its weights, as Blender's own Automatic Weights leaves it; return notices.

    It stays where it is. Blender's modifier turns no discs, and moves no splats: they are bound.
    """
    add_modifier(obj, armature)
    set_parent(obj, armature)
    return [] if takes_groups(obj) and DISC not in obj.data.attributes else bind(obj, armature)


class MESHFREE_OT_auto_weights(AutoWeights, ArmatureOperator, bpy.types.Operator):
    """Let selected points follow the bones of an armature, by weights that flow along the surface"""

    bl_idname = "meshfree.auto_weights"
    bl_label = "Automatic Weights"


TOOLS = (Registration(MESHFREE_OT_auto_weights, panel=Row("Rig", 1, 1), menu=Row("Object", 8, 11)),)
