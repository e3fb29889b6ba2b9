"""Stray points: shown, selected, hidden, separated or deleted; points left out of an analysis, selected."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from ... import core
from ...core import PointCloudError
from ...tools import stray_points, thin_out
from ...tools.quantities import COMPONENT, STRAY, quantity
from ...tools.settings import Choice, by_name
from ..objects.attributes import point_count, read_attribute, tag_changed
from ..objects.deleting import check_deletable, keep_points, split_off
from ..objects.handlers import notify
from ..objects.properties import property_of, values_of, with_properties
from ..objects.reading import read_points
from ..objects.result import is_analyzed, is_stale
from ..registration import Registration, Row
from ..running import cache
from ..running.stages import Stages
from .declared import registration_of
from .select import SelectionOperator, select, selection

_ACTION = by_name(stray_points.TOOL.settings)["action"]
_SHOW, _DELETE = _ACTION.choices
_ACTIONS = (
    _SHOW,
    Choice("SELECT", "Select", "Select them, and no other points"),
    Choice("HIDE", "Hide", "Hide them in Edit Mode"),
    Choice("SEPARATE", "Separate", "Move them to an object of their own"),
    _DELETE,
)


class StraySettings(with_properties(stray_points.SIZES)):
    """The settings that say which points are stray."""

    only_selected: BoolProperty(name="Among Selected", description="Look among the selected points only", default=False)

    def finder(self, context, obj):
        """Read an object, and return its points, and a function of a progress callback that finds stray ones, (n,)."""
        reading = read_points(context, obj)
        among = selection(obj) if self.only_selected else np.ones(len(reading.points), dtype=bool)
        if not among.any():
            raise PointCloudError(f'No points of "{obj.name}" are selected. Select some, or turn off Among Selected.')
        own, out = values_of(self, stray_points.SIZES), cache.floating(reading.splats)

        def find(progress):
            key = cache.content("strays", reading.points)
            strays = cache.fetch(key, lambda: core.clean.Strays(reading.points, progress=progress))
            return stray_points.chosen(strays, out, own) & among

        return find


class StrayActions(StraySettings):
    """What Blender adds to the tool: more that is done with stray points, also with those that are shown."""

    asks = ()

    action: property_of(_ACTION._replace(choices=_ACTIONS))
    as_shown: BoolProperty(
        name="As Shown",
        description="Take the stray points that were found last, and do not look again",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def description(cls, context, properties):
        """Return the tooltip of a button; empty for that of the class."""
        if not properties.as_shown:
            delete = properties.action == "DELETE"
            return "Delete stray points: single ones off the surface, and small floating parts" if delete else ""
        return {
            "SELECT": "Select the stray points that are shown",
            "HIDE": "Hide the stray points that are shown, in Edit Mode",
            "SEPARATE": "Move the stray points that are shown to an object of their own",
            "DELETE": "Delete the stray points that are shown",
        }.get(properties.action, "")

    @property
    def adjustable(self):
        return ("action",) if self.as_shown else ("action", "strictness", "smallest", "smallest_area", "only_selected")

    def plan(self, context, obj):
        if self.action == "HIDE" and obj.type != "MESH":
            raise PointCloudError(f'Points of the point cloud "{obj.name}" cannot be hidden. Separate them instead.')
        if self.action in {"SEPARATE", "DELETE"}:
            check_deletable(obj)
        find, own = self._known(obj) if self.as_shown else self.finder(context, obj), self.own()

        def compute(progress):
            found = find(progress)
            stray_points.check_some_stay(found)
            return found, None, own, None

        return compute

    def _known(self, obj):
        if STRAY not in obj.data.attributes:
            raise PointCloudError(f'No stray points of "{obj.name}" were found yet. Press Stray Points first.')
        found = read_attribute(obj.data, STRAY).astype(bool)
        return lambda progress: found

    def write(self, context, obj, result):
        [line] = super().write(context, obj, result)
        return [line + (self._act(context, obj, result[0]) if result[0].any() else "")]

    def _act(self, context, obj, found):
        """Do with the stray points, (n,) bool, what only Blender can do, and return a text on it."""
        if self.action == "SELECT":
            select(context, obj, found)
            return ", selected"
        if self.action == "HIDE":
            obj.data.vertices.foreach_set("hide", found)
            obj.data.vertices.foreach_set("select", selection(obj) & ~found)
            tag_changed(obj.data)
            return ", hidden in Edit Mode"
        if self.action == "SHOW":
            return ""
        parts, text = [obj], ""
        if self.action == "SEPARATE":
            parts.append(split_off(context, obj, f"{obj.name} Stray", found))
            keep_points(context, obj, ~found)
            text = f', in "{parts[-1].name}"'
        for part in parts:
            notify("strays_gone", part)
        return text

    def conclude(self, context, objects):
        if self.action == "SHOW":
            super().conclude(context, objects)


class ThinActions:
    """What Blender adds to the tool: a number in the dialog that suits the object, unless the last one does."""

    def invoke(self, context, event):
        points = point_count(context.object.data)
        if not 0 < self.count < points:
            self.count = round(float(f"{points / thin_out.SHARE:.1e}"))
        return super().invoke(context, event)


class MESHFREE_OT_select_strays(SelectionOperator, StraySettings, bpy.types.Operator):
    """Select stray points: single ones off the surface, small floating parts, and floaters among splats"""

    bl_idname = "meshfree.select_strays"
    bl_label = "Select Stray Points"
    needs_selection = False
    surface = False

    def prepare(self, context, obj):
        find = self.finder(context, obj)
        with Stages(context.window_manager, self.bl_label) as stages:
            found = find(stages)
        if not found.any():
            raise PointCloudError(f'No points of "{obj.name}" are stray. Raise Strictness to find more.')
        return lambda: select(context, obj, found)


class MESHFREE_OT_select_left_out(SelectionOperator, bpy.types.Operator):
    """Select the points that the analysis left out: stray ones, and those of components of too few points"""

    bl_idname = "meshfree.select_left_out"
    bl_label = "Select Points Left Out"
    needs_selection = False
    surface = False

    edit_mode: BoolProperty(
        name="Edit Mode", description="Switch to Edit Mode, where selected points are seen", default=False
    )

    def prepare(self, context, obj):
        if not is_analyzed(obj) or COMPONENT not in obj.data.attributes:
            raise PointCloudError(f'"{obj.name}" is not analyzed. Press Analyze Points first.')
        if is_stale(obj):
            raise PointCloudError(f'The results of "{obj.name}" are stale. Press Analyze Points again.')
        left_out = read_attribute(obj.data, COMPONENT) == quantity(COMPONENT).left_out
        if not left_out.any():
            raise PointCloudError(f'No points of "{obj.name}" were left out.')
        return lambda: select(context, obj, left_out)

    def execute(self, context):
        done = super().execute(context)
        if self.edit_mode and done == {"FINISHED"} and context.object.mode == "OBJECT":
            bpy.ops.object.mode_set(mode="EDIT")
        return done


TOOLS = (
    registration_of(stray_points.TOOL, StrayActions),
    registration_of(thin_out.TOOL, ThinActions),
    Registration(MESHFREE_OT_select_strays, menu=Row("Points", 1, 7)),
    Registration(MESHFREE_OT_select_left_out, menu=Row("Points", 1, 8)),
)
