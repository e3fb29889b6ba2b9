"""Settings of the deformation of each object: `Object.meshfree.deform`."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...tools.groups import ANCHOR, HANDLE
from .handlers import notify, telling

_follow = telling("deform_changed")


def _find_bound(settings, context):
    notify("bound_changed")


class MESHFREE_PG_handle(bpy.types.PropertyGroup):
    """How one group of handles is moved"""

    has_empty: BoolProperty(
        name="Has Empty", description="An empty moves the points; otherwise they are moved in Edit Mode"
    )
    empty: PointerProperty(type=bpy.types.Object, name="Empty", description="The object that moves the points")
    rest: FloatVectorProperty(
        name="Rest Matrix", description="Matrix of the empty in the object's space when it was bound", size=16
    )


class MESHFREE_PG_bone(bpy.types.PropertyGroup):
    """A bone that points follow, as it was when they were bound; its name is that of the bone"""

    rest: FloatVectorProperty(name="Rest Matrix", description="Matrix of the bone at rest in its armature", size=16)


def _is_armature(settings, obj):
    return obj.type == "ARMATURE"


class MESHFREE_PG_deform(bpy.types.PropertyGroup):
    """Deformation of one object by handles or bones"""

    handles: StringProperty(
        name="Handles",
        description="Group with the points that are moved; groups of this name with a number are handles of their own",
        default=HANDLE,
    )
    anchors: StringProperty(
        name="Anchors", description="Group with the points that stay; may be missing", default=ANCHOR
    )
    add_empties: BoolProperty(
        name="Add Empties",
        description="Add an empty to each group of handles, which moves, rotates and scales it; without one they are"
        " moved in Edit Mode",
        default=True,
    )
    rotation_aware: BoolProperty(
        name="Rotate Details",
        description="Rotate details with the surface, as bending requires",
        default=True,
        update=_follow,
    )
    soft: BoolProperty(
        name="Soft",
        description="Soft constraints: handles and anchors may deviate for a smoother surface",
        default=False,
        update=_follow,
    )
    weight: FloatProperty(
        name="Weight",
        description="Stiffness of soft handles and anchors, relative to that of the surface; the weights of their"
        " groups multiply it",
        default=1.0,
        min=0.0,
        soft_max=100.0,
        update=_follow,
    )
    steps: IntProperty(
        name="Steps",
        description="Maximum number of iterations for these rotations; stops at convergence",
        default=30,
        min=1,
        soft_max=100,
        update=_follow,
    )

    preserve_volume: BoolProperty(
        name="Preserve Volume",
        description="Blend the motions of bones as screws, by dual quaternions, so that bent and twisted limbs keep"
        " their volume",
        default=False,
        update=_follow,
    )

    # What the object is bound with.
    is_bound: BoolProperty(name="Bound", description="The object follows handles or bones", update=_find_bound)
    kind: EnumProperty(
        name="Kind",
        description="What the points follow",
        items=[("HANDLES", "Handles", "Groups of points"), ("BONES", "Bones", "The bones of an armature")],
    )
    armature: PointerProperty(
        type=bpy.types.Object,
        name="Armature",
        description="The armature whose bones the points follow",
        poll=_is_armature,
    )
    bone_items: CollectionProperty(
        type=MESHFREE_PG_bone, name="Bones", description="The bones that the points follow, at rest"
    )
    handle_items: CollectionProperty(
        type=MESHFREE_PG_handle, name="Handles", description="How the groups of handles are moved"
    )
    binding_id: StringProperty(name="Binding", description="Name that no other binding has")
    point_count: IntProperty(name="Points", description="How many points were bound", min=0)
    fingerprint: StringProperty(name="Fingerprint", description="Checksum of the points that were bound")
    groups_used: StringProperty(name="Groups Used", description="Checksum of the groups that were bound")
    settings_used: StringProperty(name="Settings Used", description="Settings of the operator when it was bound")
    matrix: FloatVectorProperty(name="Matrix", description="Scale and shear when it was bound", size=9)


CLASSES = (MESHFREE_PG_handle, MESHFREE_PG_bone, MESHFREE_PG_deform)
