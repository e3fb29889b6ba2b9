"""Transfer Weights: objects take weights of bones from the surface of a rigged one."""

from fnmatch import fnmatchcase
from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.attributes import point_count
from ..registration import Registration, Row
from .bones import followed_armature
from .transfer import Transfer, TransferOperator, sides
from .weights import MOST, has_weights, named, read_weights, takes_groups, weight_names, write_weights


class Weights(NamedTuple):
    """The weights of an object."""

    names: list  # of str, of all groups
    table: np.ndarray  # (n, b)
    bones: list  # of str, those of deforming bones; all of a point cloud; none without an armature
    active: str  # the active group, empty if there is none

    def columns(self, names):
        """Return the weights of these names, (n, k); zero for those that there are not."""
        result = np.zeros((len(self.table), len(names)))
        for place, name in enumerate(names):
            if name in self.names:
                result[:, place] = self.table[:, self.names.index(name)]
        return result

    @property
    def summed(self) -> list:
        """Names of the groups whose weights are to sum to one: those of bones, or all without an armature."""
        return self.bones or self.names

    @property
    def are_normalized(self) -> bool:
        """Whether these sums are one: without an armature at all points, for groups may be parts of the surface."""
        table = self.columns(self.summed)
        return core.rig.are_normalized(table) and (bool(self.bones) or bool(table.any(axis=1).all()))


class _Change(NamedTuple):
    """The weights of an object after a transfer: of which groups, where the points took them, and notices."""

    names: list
    table: np.ndarray
    match: object
    sources: list
    count: int  # groups that were taken
    notices: list


def read(obj) -> Weights:
    """Read the weights of an object, which may have none."""
    there = has_weights(obj)
    names = weight_names(obj) if there else []
    table = read_weights(obj) if there else np.zeros((point_count(obj.data), 0))
    active = obj.vertex_groups.active if takes_groups(obj) else None
    bones = names
    if takes_groups(obj):
        armature = followed_armature(obj)
        deforming = {bone.name for bone in armature.data.bones if bone.use_deform} if armature is not None else ()
        bones = [name for name in names if name in deforming]
    return Weights(names, table, bones, active.name if active is not None else "")


class TransferWeights(Transfer):
    """The settings and the work of `meshfree.transfer_weights`."""

    asks = ("reverse", "distance", "angle", "groups", "pattern", "mix", "replace", "preview", "show")

    groups: EnumProperty(
        name="Groups",
        description="Which groups of the source are transferred",
        items=[
            ("ALL", "All Groups", "All vertex groups of the source"),
            ("DEFORM", "Deform Bones", "Those of deforming bones of the armature that the source follows"),
            ("ACTIVE", "Active Group", "The active vertex group of the source"),
            ("NAMES", "By Name", "Those whose names match the pattern"),
        ],
        default="ALL",
    )
    pattern: StringProperty(
        name="Pattern",
        description="Names of groups, for By Name: * stands for any text, ? for one character, as in *.L",
        default="*",
    )
    mix: FloatProperty(
        name="Mix",
        description="Share of the weights that are taken; the rest is that of the weights before",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    replace: BoolProperty(
        name="Replace",
        description="Empty groups of other bones, where all groups or those of deforming bones are transferred;"
        " otherwise they keep their weights, and those transferred share the rest",
        default=True,
    )

    def read_values(self, obj):
        found = read(obj)
        if not found.names:
            raise PointCloudError(
                f'"{obj.name}" has no weights to transfer. Make the rigged object the active one, or turn on Reverse'
                " Transfer; Automatic Weights makes some."
            )
        return found

    def plan(self, context, obj):
        sources = self.sources(context, obj)
        given = [source.values for source in sources]
        names = list(dict.fromkeys(name for source in sources for name in self._wanted(source)))
        own = read(obj)
        bones = {name for values in (*given, own) for name in values.bones}
        others = [name for name in own.names if name in bones and name not in names]
        every = [*names, *others]
        groups = obj.vertex_groups if takes_groups(obj) else {}
        locked = [name for name in every if name in groups and groups[name].lock_weight]
        _check_groups(obj, names, locked)

        whole = self.groups in {"ALL", "DEFORM"}
        even = all(values.are_normalized for values in given)
        stay = [*locked, *(others if whole and not self.replace else ())]
        kept = [] if whole else others
        normalized = even and (whole or bool(others))
        summed = np.isin(every, [name for values in given for name in values.summed] + others)
        mix, locked_ones, kept_ones = self.mix, np.isin(every, stay), np.isin(every, kept)
        members = [values.columns(values.summed).any(axis=1) | (not even) for values in given]
        _, find = self.matcher(context, obj, sources, members)
        preview, before = self.preview, own.columns(every)
        moved = [name for name in every if name not in stay and (name not in kept or normalized)]
        written = moved if takes_groups(obj) else every  # else they are one table
        emptied = [name for name in others if name not in (*kept, *stay)]
        notices = [
            *named(locked, "Locked vertex groups, left as they are"),
            *named(emptied, "Groups of bones that the source has none of, emptied by Replace"),
        ]

        def compute(progress):
            match, table = find(progress), before.copy()
            if not preview:
                taken = core.rig.transfer_values(
                    match.laplacian,
                    match.places,
                    np.concatenate([values.columns(names) for values in given]),
                    progress=lambda stage, share: progress(stage, 0.8 + 0.2 * share),
                )
                taken = np.column_stack([taken, np.zeros((len(taken), len(others)))])
                for some, normalize in ((summed, normalized), (~summed, False)):
                    if not some.any():
                        continue
                    table[:, some] = core.rig.mix_weights(
                        before[:, some],
                        taken[:, some],
                        mix=mix,
                        locked=locked_ones[some],
                        kept=kept_ones[some],
                        normalize=normalize,
                    )
            table = table[:, [every.index(name) for name in written]]
            return _Change(written, table, match, sources, len(names), notices)

        return compute

    def _wanted(self, source):
        """Return the names of the groups of a source that are transferred."""
        values = source.values
        found = {
            "ALL": values.names,
            "DEFORM": values.bones,
            "ACTIVE": [values.active] if values.active else [],
            "NAMES": [name for name in values.names if fnmatchcase(name, self.pattern)],
        }[self.groups]
        if not found:
            what, advice = {
                "ALL": ("groups", "Choose another source"),
                "DEFORM": ("groups of deforming bones of an armature that it follows", "Choose All Groups"),
                "ACTIVE": ("active vertex group", "Choose All Groups, or make one active"),
                "NAMES": (f'groups that match "{self.pattern}"', "Choose another Pattern"),
            }[self.groups]
            raise PointCloudError(f'"{source.name}" has no {what}. {advice}.')
        return found

    def write(self, context, obj, result):
        what = f"weights of {result.count} {'group' if result.count == 1 else 'groups'}"
        texts = self.write_state(obj, result.match, result.sources, what)
        if self.preview:
            return texts
        notices = list(result.notices)
        if not takes_groups(obj):
            many = np.count_nonzero(np.count_nonzero(result.table > 0.0, axis=1) > MOST)
            if many:
                notices.append(f"Points that would follow more than {MOST} bones, and keep the largest: {many:,}.")
        write_weights(obj, result.names, result.table)
        return [*notices, *texts]


def _check_groups(obj, names, locked):
    """Refuse an object that cannot hold these groups."""
    if all(name in locked for name in names):
        told = named(names, f'All groups of "{obj.name}" that would be taken are locked')
        raise PointCloudError(f"{' '.join(told)} Unlock some.")
    taken = [name for name in names if name in obj.data.attributes and name not in obj.vertex_groups]
    if takes_groups(obj) and taken:
        raise PointCloudError(
            f'"{obj.name}" has attributes named {", ".join(taken)}, and vertex groups share their names. Rename these'
            " attributes."
        )


class MESHFREE_OT_transfer_weights(TransferWeights, TransferOperator, bpy.types.Operator):
    """Transfer weights from the surface of the active object to the other selected ones, and fill in the rest"""

    bl_idname = "meshfree.transfer_weights"
    bl_label = "Transfer Weights"

    @classmethod
    def lack(cls, context, obj):
        rigged = any(has_weights(each) for group in sides(context, False) for each in group)
        there = "" if rigged else "No selected object has weights. Select a rigged one, too, or run Automatic Weights"
        return super().lack(context, obj) or there


TOOLS = (Registration(MESHFREE_OT_transfer_weights, panel=Row("Rig", 3, 1), menu=Row("Object", 8, 14)),)
