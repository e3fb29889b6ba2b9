"""Objects that follow the bones of an armature: the kind of their binding, and how it is made."""

import zlib
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from ...core import PointCloudError
from ...core.linalg import cond, inv
from ..deform import binding, kinds, live
from ..deform.handles import groups_checksum
from ..deform.nodes import add_deform
from ..deform.pose import POSE, State, is_there, relative_matrix, write_displacement
from ..objects.attributes import point_count, read_attribute
from ..objects.carried import carries
from ..objects.counting import all_members
from ..objects.handlers import add_handlers, notify, remove_handlers
from ..objects.modifiers import is_own
from ..objects.place import moves_with
from ..objects.reading import read_points
from ..objects.splats import has_splats, read_splats
from .bone_follower import BoneBinding, BoneFollower, BonePose
from .bones import bone_matrices, envelopes
from .weights import BONES, NAMES, WEIGHTS, has_weights, listed, takes_groups, weight_names, weight_table

_LEAST = 1e-4  # sum of the weights of a point below which Blender lets it follow no bone
_SAME = 1e-5  # of the size of an armature: bones at the same place at rest


class Bones:
    """The kind of bindings to the bones of an armature; see `Kind`."""

    name = "BONES"
    followed = "bones"
    at_once = True

    def key(self, obj):
        settings = obj.meshfree.deform
        if not is_there(settings.armature):
            return (settings.binding_id,)
        found = envelopes(settings.armature, _names(obj))
        if not found.multiplies.any():
            return settings.binding_id, found.deforms.tobytes()
        place = np.array(_to_armature(obj, settings.armature), np.float32)  # which envelopes lie elsewhere by
        return settings.binding_id, found.deforms.tobytes(), found.text, place.tobytes()

    def read_pose(self, obj, depsgraph=None):
        armature = obj.meshfree.deform.armature
        posed = armature if depsgraph is None else armature.evaluated_get(depsgraph)
        now = bone_matrices(posed.pose.bones, _names(obj), "matrix")
        changes = (now @ inv(_rest(obj)))[:, :3]
        relative, key, preserve = _to_armature(obj, armature, depsgraph), self.key(obj), _preserves_volume(obj)
        asked = (*key[1:], obj.meshfree.deform.groups_used, preserve, carries(obj))
        checksums = [zlib.crc32(repr(asked).encode()), 0]
        numbers = np.concatenate([checksums, relative[:3].ravel(), changes.ravel()])
        return BonePose(key, numbers, changes, relative, preserve)

    def plan_follower(self, obj):
        bound = _read_binding(obj)
        return lambda progress: BoneFollower(bound)

    def gone(self, obj):
        armature = obj.meshfree.deform.armature
        if not is_there(armature):
            return "The armature was deleted. Select another one, too, and bind again"
        missing = [name for name in _names(obj) if name not in armature.data.bones]
        if missing:
            return f'Bones of "{armature.name}" were renamed or deleted: {listed(missing)}. Bind again'
        return ""

    def changed(self, obj, glance, trusting):
        settings = obj.meshfree.deform
        if trusting:
            return "", ()
        rest = _rest(obj)
        now = bone_matrices(settings.armature.data.bones, _names(obj), "matrix_local")
        if not _same(rest, now).all():
            return f'The rest pose of "{settings.armature.name}" changed. Bind again', ()
        used = _weights_checksum(obj, glance=True) if has_weights(obj) else ""
        if used is None:
            return None
        if used != settings.groups_used:
            return "The weights of the bones changed. Bind again", ()
        return "", ()

    def copied_from(self, obj):
        return None  # copies follow the same bones

    def copy_reason(self, obj, original):
        return ""

    def movers(self, obj):
        armature = obj.meshfree.deform.armature
        posed = {} if armature is None else {bone.name: bone for bone in armature.pose.bones}
        return {**posed, None: obj, **({} if armature is None else {armature.session_uid: armature})}

    def written(self, obj):
        return []

    def held(self, obj):
        if takes_groups(obj):
            return "Its Armature modifier moves the points. Apply that"
        return ""

    def kept(self, obj):
        return "The pose is that of the armature. Clear it there, in Pose Mode: Pose, Clear Transform"

    def put_back(self, context, obj):
        """The pose of the armature is not the object's own."""

    def plan_rest(self, context, obj, operator):
        name = obj.meshfree.deform.armature.name

        def take(positions):
            binding.forget(obj)
            return f"{obj.name}: {len(positions):,} points stay where they are now, and no longer follow {name}"

        return take


def followers_of(armature) -> list:
    """Return the objects that are bound to the bones of an armature."""
    return [obj for obj in binding.bound_objects() if obj.meshfree.deform.armature == armature]


class Bound(NamedTuple):
    """What binding an object to an armature writes."""

    rest: np.ndarray  # (n, 3) float32, points at rest in local space
    matrix: np.ndarray  # (3, 3), from local space to world lengths
    names: list  # of str, the bones that the object has weights of
    renamed: dict  # new names of bones by those of the weights
    notices: list  # of str


def bind(obj, armature) -> list:
    """Let the points of an object follow the bones of an armature by its weights; return notices.

    Meshes without splats keep Blender's Armature modifier for their points; their discs are turned. An object that
    follows handles, or has no weights of these bones, raises `PointCloudError`.
    """
    return write_bound(obj, armature, plan_bound(bpy.context, obj, armature))


def check_bindable(obj, armature):
    """Refuse an object that follows handles, or that the armature moves with."""
    if moves_with(armature, obj):
        raise PointCloudError(
            f'"{armature.name}" moves with "{obj.name}", its parent. Clear the parent of the armature (Alt P).'
        )
    if obj.meshfree.deform.is_bound and obj.meshfree.deform.kind != Bones.name:
        raise PointCloudError(f'"{obj.name}" follows handles. Apply or unbind it first.')


def plan_bound(context, obj, armature) -> Bound:
    """Read what `bind` needs, and refuse what it cannot bind."""
    check_bindable(obj, armature)
    if not has_weights(obj):
        raise PointCloudError(f'"{obj.name}" has no weights of bones. Run Automatic Weights first.')
    bones, known = armature.data.bones, weight_names(obj)
    renamed = _renamed(obj, armature, known)
    names = [renamed.get(name, name) for name in known if renamed.get(name, name) in bones]
    if not names:
        raise PointCloudError(
            f'"{obj.name}" has weights of no bone of "{armature.name}". Run Automatic Weights, or name its bones as'
            f" they were: {listed(known)}."
        )
    reading = read_points(context, obj)
    notices = [] if takes_groups(obj) else _notices(obj, armature, known, renamed)
    rest = reading.local(reading.points).astype(np.float32)
    return Bound(rest, reading.matrix, names, renamed, notices)


def write_bound(obj, armature, bound: Bound) -> list:
    """Write a binding to bones, and move the points; return notices."""
    settings, context = obj.meshfree.deform, bpy.context
    if bound.renamed:
        obj.data[NAMES] = [bound.renamed.get(name, name) for name in weight_names(obj)]
    settings.armature = armature
    settings.bone_items.clear()
    for name in bound.names:
        item = settings.bone_items.add()
        item.name, item.rest = name, np.array(armature.data.bones[name].matrix_local).ravel()
    binding.record(obj, Bones.name, bound.rest, bound.matrix, _weights_checksum(obj))
    add_deform(obj)
    notify("shape_changed", obj)
    context.scene.render.use_lock_interface = True  # Blender crashes when it draws what handlers change in a render
    obj.data.pop(POSE, None)
    write_displacement(obj, np.zeros_like(bound.rest), np.zeros(0), State.PREPARING, {})
    context.view_layer.update()
    live.update(obj)
    return bound.notices


def add_modifier(obj, armature):
    """Give a mesh an Armature modifier for an armature, before our own ones, unless it has one; splats need none."""
    if not takes_groups(obj) or any(item.type == "ARMATURE" and item.object == armature for item in obj.modifiers):
        return
    first = next((index for index, item in enumerate(obj.modifiers) if is_own(item)), len(obj.modifiers))
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    obj.modifiers.move(len(obj.modifiers) - 1, first)


def set_parent(obj, armature):
    """Make an armature the parent of an object, which stays where it is, with its own channels as they are."""
    if obj.parent == armature and obj.parent_type == "OBJECT":
        return
    inverse = armature.matrix_world.inverted() @ _from_parent(obj)
    obj.parent, obj.parent_type = armature, "OBJECT"
    obj.matrix_parent_inverse = inverse


def _from_parent(obj):
    """Return the transform that an object has from its parent; constraints come after it."""
    if obj.parent is None:
        return Matrix()
    if obj.parent_type == "OBJECT":
        return obj.parent.matrix_world @ obj.matrix_parent_inverse
    return obj.matrix_world @ obj.matrix_basis.inverted()


def _notices(obj, armature, known, renamed):
    """Return what is to be told about bones and weights that a binding goes by."""
    bones = armature.data.bones
    notices = [f'"{old}" is called "{new}" now, and followed on.' for old, new in renamed.items()]
    table, shares = weight_table(obj)
    used = np.unique(table[shares > 0.0])
    followed = [renamed.get(known[number], known[number]) for number in used]
    gone = [name for name in followed if name not in bones]
    if gone:
        notices.append(f'"{armature.name}" has no bones {listed(gone)}: their points follow their other bones.')
    idle = [name for name in followed if name in bones and not bones[name].use_deform]
    if idle:
        notices.append(f"Bones that do not deform, and are not followed: {listed(idle)}.")
    bendy = [name for name in followed if name in bones and bones[name].bbone_segments > 1]
    if bendy:
        notices.append(f"Bendy bones, followed as straight ones: {listed(bendy)}.")
    there = np.array([renamed.get(name, name) in bones for name in known])
    without = np.count_nonzero((shares * there[table]).sum(axis=1) <= _LEAST)
    if without:
        notices.append(f"Points that follow no bone, and stay: {without:,}.")
    return notices


def _renamed(obj, armature, known):
    """Return the new names of bones that were renamed since the object was bound, known by their places at rest."""
    settings, bones = obj.meshfree.deform, armature.data.bones
    missing = [name for name in known if name not in bones]
    if not missing or settings.armature != armature or takes_groups(obj):
        return {}
    items = {item.name: np.reshape(item.rest, (4, 4)) for item in settings.bone_items}
    others = [bone.name for bone in bones if bone.name not in known]
    places = bone_matrices(bones, others, "matrix_local")
    found = {}
    for name in missing:
        if name in items:
            same = np.flatnonzero(_same(items[name][None], places)) if others else ()
            if len(same) == 1:
                found[name] = others[same[0]]
    return found


def _same(rest, now):
    """Return which bones at rest, (b, 4, 4) both, are the same."""
    size = max(np.abs(now[:, :3, 3]).max(initial=0.0), 1.0)
    return np.abs(rest - now).max(axis=(1, 2)) <= _SAME * size


def _read_binding(obj):
    """Read the binding of an object to bones."""
    armature, names = obj.meshfree.deform.armature, _names(obj)
    table, shares = weight_table(obj)
    found = envelopes(armature, names)
    numbers = {name: number for number, name in enumerate(names)}
    columns = np.array([numbers.get(name, -1) for name in weight_names(obj)])
    table = columns[table]
    shares = np.where((table >= 0) & found.deforms[table], shares, 0.0)
    table = np.maximum(table, 0)
    rest, places = binding.read_rest(obj), not takes_groups(obj)
    if found.multiplies.any():
        relative = _to_armature(obj, armature)
        points = rest @ relative[:3, :3].T + relative[:3, 3]
        rows, place = np.nonzero((shares > 0.0) & found.multiplies[table])
        shares[rows, place] *= found.shares(points[rows], table[rows, place])
    total = shares.sum(axis=1, keepdims=True)
    weights = np.where(total > _LEAST, shares / np.where(total > 0.0, total, 1.0), 0.0)
    return BoneBinding(
        rest, read_splats(obj.data) if has_splats(obj.data) else None, table, weights, len(names), places
    )


def _to_armature(obj, armature, depsgraph=None):
    """Return the matrix from the space of an object to that of an armature, (4, 4)."""
    inverse = relative_matrix(obj, armature, depsgraph)
    if not cond(inverse[:3, :3]) < 1e9:
        raise PointCloudError(
            f'"{armature.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )
    return inv(inverse)


def _preserves_volume(obj):
    """Whether the motions of bones are blended as screws; of meshes by their Armature modifier."""
    settings = obj.meshfree.deform
    if not takes_groups(obj):
        return settings.preserve_volume
    return any(
        item.type == "ARMATURE" and item.object == settings.armature and item.use_deform_preserve_volume
        for item in obj.modifiers
    )


def _names(obj):
    return [item.name for item in obj.meshfree.deform.bone_items]


def _rest(obj):
    """Return the matrices of the bones when they were bound, (b, 4, 4)."""
    items = obj.meshfree.deform.bone_items
    return np.array([item.rest for item in items], np.float64).reshape(-1, 4, 4)


def _weights_checksum(obj, glance=False):
    """Return the checksum of the table of weights, or of the vertex groups of the bones; for glances see `all_members`.

    It is None where these were not counted yet.
    """
    if takes_groups(obj):
        names = _names(obj)
        found = all_members(obj, names, glance)
        return None if None in found else groups_checksum(names, [group.weighted for group in found])
    checksum = zlib.crc32(repr(weight_names(obj)).encode())
    for name in (BONES, WEIGHTS):
        checksum = zlib.crc32(read_attribute(obj.data, name), checksum)
    return f"{checksum:08x}"


def _on_weights(obj):
    """Let a bound object follow by weights that the extension has changed."""
    settings = obj.meshfree.deform
    if settings.is_bound and settings.kind == Bones.name and settings.point_count == point_count(obj.data):
        settings.groups_used = _weights_checksum(obj)
        binding.renew(obj)
        live.settle_later(obj)


_BONES = Bones()
_HANDLERS = {"weights_changed": _on_weights}


def attach():
    """Let objects follow bones."""
    kinds.add(_BONES)
    add_handlers(_HANDLERS)


def detach():
    """End that."""
    remove_handlers(_HANDLERS)
    kinds.remove(_BONES)
