"""Smooth Weights: weights that flow along the surface, fill what is empty, and keep their sums."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.groups import chosen_members
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import Tool, operator_reader
from ..tools.select import selected
from .bones import deforming_bones
from .limits import influences, least_weight
from .painting import WeightOperator, in_selecting_mode
from .weights import MOST, read_weights, takes_groups, weight_names, write_weights

_SPACINGS = 4.0  # default length, in spacings of the points
_ONE = 1e-3  # how far from one the sum of normalized weights may be


class _Part(NamedTuple):
    """Groups that are smoothed in one go."""

    columns: np.ndarray  # (k,) int, among all groups of the object
    # (k,) bool, which are to change by themselves, and which not at all; the others make room
    smoothed: np.ndarray
    locked: np.ndarray
    bound: bool  # whether the weights of a point belong together, as those of bones


class SmoothWeights(Tool):
    """The settings and the work of `meshfree.smooth_weights`."""

    at_zero = {"length": "Automatic", "influences": "Any"}

    groups: EnumProperty(
        name="Groups",
        description="Which vertex groups are smoothed; locked ones stay as they are",
        items=[
            ("DEFORM", "Deforming", "The groups of bones that deform; all groups where no armature does"),
            ("ALL", "All", "All vertex groups"),
            ("ACTIVE", "Active", "The active vertex group; those of other bones make room for it"),
        ],
        default="DEFORM",
    )
    smooth: BoolProperty(
        name="Smooth",
        description="Let weights flow along the surface; off, points are filled and small weights removed only",
        default=True,
    )
    length: FloatProperty(
        name="Length",
        description="How far weights flow along the surface; 0 for four times the spacing of the points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    points: EnumProperty(
        name="Points",
        description="Whose weights change; those of the other points flow in, and stay",
        items=[
            ("ALL", "All", "All points"),
            ("SELECTED", "Selected", "The selected points; in Weight Paint those that its selection masks show"),
        ],
        default="ALL",
    )
    group: StringProperty(name="Within Group", description="Only points of this vertex group change; empty for all")
    fill: BoolProperty(
        name="Fill", description="Give points without any weights of bones those from around", default=True
    )
    across: BoolProperty(
        name="Across Loose Parts",
        description="Let weights flow between loose parts of a mesh that touch, as at doubled vertices of a seam",
        default=False,
    )
    influences: influences(0)
    least: least_weight()

    @property
    def asks(self):
        """Names of the settings; the length counts where weights flow."""
        length = ("length",) if self.smooth else ()
        return "groups", "smooth", *length, "points", "group", "fill", "across", "influences", "least"

    def plan(self, context, obj):
        names = weight_names(obj)
        weights = read_weights(obj)
        if not weights.any():
            raise PointCloudError(f'"{obj.name}" has no weights to smooth. Run Automatic Weights, or paint some.')
        parts, locked = self._parts(obj, names, weights)
        chosen = selected(obj) if self.points == "SELECTED" else None
        if self.group:
            members = chosen_members(obj, self.group, "Within Group")
            chosen = members if chosen is None else members & chosen
            if not chosen.any():
                raise PointCloudError(
                    f'No selected point of "{obj.name}" is in "{self.group}". Select others, or clear Within Group.'
                )
        edges = None if self.across else _edges(obj)
        _, operator = operator_reader(context, obj)
        length, smooth, settings = self.length, self.smooth, {"fill": self.fill, "least": self.least}
        most = self.influences or (None if takes_groups(obj) else MOST)

        def compute(progress):
            laplacian = operator(lambda stage, fraction: progress(stage, 0.5 * fraction))
            reach = (length or _SPACINGS * np.sqrt(np.median(laplacian.areas))) if smooth else 0.0
            result = weights.copy()
            for number, part in enumerate(parts):

                def report(stage, fraction, number=number):
                    progress(stage, 0.5 + 0.5 * (number + fraction) / len(parts))

                result[:, part.columns] = core.rig.smooth_weights(
                    laplacian,
                    weights[:, part.columns],
                    reach,
                    columns=None if part.smoothed.all() else part.smoothed,
                    locked=part.locked,
                    chosen=chosen,
                    edges=edges,
                    influences=most if part.bound else None,
                    progress=report,
                    **(settings if part.bound else settings | {"fill": False}),
                )
            return names, weights, result, reach, locked

        return compute

    def _parts(self, obj, names, weights):
        """Return what is smoothed together, and the names of the locked groups among it."""
        every = np.arange(len(names))
        if not takes_groups(obj):
            if self.groups == "ACTIVE":
                raise PointCloudError(f'The weights of "{obj.name}" are attributes: no active group. Choose All.')
            none = np.zeros(len(names), dtype=bool)
            return [_Part(every, ~none, none, True)], []
        held = np.array([group.lock_weight for group in obj.vertex_groups])
        deform, rigged = _deforming(obj, names)
        if self.groups == "ACTIVE":
            chosen = every == _active(obj)
        else:
            chosen = deform if self.groups == "DEFORM" else np.ones(len(names), dtype=bool)
        free = chosen & ~held & weights.any(axis=0)
        if not free.any():
            raise PointCloudError(
                f'No weights of "{obj.name}" can be smoothed: the groups are locked or empty. Unlock some, or choose'
                " other Groups."
            )
        together = rigged or (np.abs(weights[:, deform].sum(axis=1) - 1.0) < _ONE).all()
        bound = deform & together
        parts = []
        if (free & bound).any():
            columns = np.flatnonzero(bound)
            smoothed = free[columns] if self.groups == "ACTIVE" else np.ones(len(columns), dtype=bool)
            parts.append(_Part(columns, smoothed, held[columns], True))
        apart = np.flatnonzero(free & ~bound)
        if len(apart):
            parts.append(_Part(apart, np.ones(len(apart), dtype=bool), np.zeros(len(apart), dtype=bool), False))
        return parts, [names[index] for index in np.flatnonzero(chosen & held)]

    def write(self, context, obj, result):
        names, before, after, reach, locked = result
        changed = (after != before).any(axis=0)
        if not takes_groups(obj):
            changed[:] = True  # they are one table
        write_weights(obj, [name for name, new in zip(names, changed, strict=True) if new], after[:, changed])
        notices = [f"Locked vertex groups, left as they are: {', '.join(locked[:5])}."] if locked else []
        filled = np.count_nonzero(after.any(axis=1) & ~before.any(axis=1))
        if filled:
            notices.append(f"Points without weights that were filled from around: {filled:,}.")
        empty = np.count_nonzero(~after.any(axis=1))
        if empty and self.fill and self.groups != "ALL":
            notices.append(f"Points that are still without weights: {empty:,}.")
        over = f" over {length_text(reach)}" if reach else ""
        most = np.abs(after - before).max()
        return [
            *notices,
            f"{obj.name}: {np.count_nonzero(changed)} groups{over}, weights changed by {most:.2g} at most",
        ]


def _active(obj):
    """Return the index of the active vertex group; refuse one that is locked."""
    group = obj.vertex_groups.active
    if group is None:
        raise PointCloudError(f'"{obj.name}" has no active vertex group. Choose one, or other Groups.')
    if group.lock_weight:
        raise PointCloudError(f'The vertex group "{group.name}" of "{obj.name}" is locked. Unlock it first.')
    return group.index


def _deforming(obj, names):
    """Return which groups are those of bones that deform an object, (b,) bool, and whether an armature does."""
    armatures = {item.object for item in obj.modifiers if item.type == "ARMATURE"} | {obj.parent}
    bones = [
        name
        for armature in armatures
        if armature is not None and armature.type == "ARMATURE"
        for name in deforming_bones(armature).names
    ]
    found = np.isin(np.array(names, dtype=object), bones)
    return (found, True) if found.any() else (np.ones(len(names), dtype=bool), False)


def _edges(obj):
    """Read the edges of a mesh, (m, 2) int; None where it has none."""
    if obj.type != "MESH" or not obj.data.edges:
        return None
    edges = np.empty((len(obj.data.edges), 2), np.int32)
    obj.data.edges.foreach_get("vertices", edges.reshape(-1))
    return edges


class MESHFREE_OT_smooth_weights(SmoothWeights, WeightOperator, bpy.types.Operator):
    """Smooth weights along the surface, fill points without any, and keep them normalized"""

    bl_idname = "meshfree.smooth_weights"
    bl_label = "Smooth Weights"

    def invoke(self, context, event):
        if not self.properties.is_property_set("points"):
            self.points = "SELECTED" if in_selecting_mode(context.object) else "ALL"
        return super().invoke(context, event)


TOOLS = (Registration(MESHFREE_OT_smooth_weights, panel=Row("Rig", 2, 1), menu=Row("Object", 8, 13)),)
