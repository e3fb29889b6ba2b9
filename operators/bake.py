"""Bake an animated deformation into the file, so that it plays and renders where the extension is not installed."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import IntProperty

from ..core import PointCloudError
from ..core.phrases import Phrase
from . import live
from .attributes import DISPLACEMENT, point_count, read_attribute, write_attribute
from .binding import stale_reason
from .deform import BoundOperator, check_fresh, delete_bake
from .deform_nodes import find_deform, is_baked, show_baked
from .translation import translated

_LAST = 1048574  # frame of Blender
_TICK = 0.01  # seconds between two frames, for the window to notice Esc


class MESHFREE_OT_deform_bake(BoundOperator, bpy.types.Operator):
    """Keep the deformation of each frame in the file, for machines without the extension"""

    bl_idname = "meshfree.deform_bake"
    bl_label = "Bake"

    first: IntProperty(
        name="First Frame",
        description="First frame to bake; 0 for both takes the range of the scene",
        default=0,
        min=0,
        max=_LAST,
    )
    last: IntProperty(name="Last Frame", description="Last frame to bake", default=0, min=0, max=_LAST)

    _timer = None

    def invoke(self, context, event):
        self._attended = True
        self.first, self.last = context.scene.frame_start, context.scene.frame_end
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        obj, scene, attended = self.subject(context), context.scene, self.takes_window()
        if not self.first and not self.last:
            self.first, self.last = scene.frame_start, scene.frame_end
        try:
            check_fresh(obj)
            if self.last < self.first:
                raise PointCloudError(
                    "The last frame, {last}, comes before the first one, {first}. Swap them.",
                    last=self.last,
                    first=self.first,
                )
        except PointCloudError as error:
            self.report({"ERROR"}, translated(error))
            return {"CANCELLED"}
        self._uid, self._frames, self._kept = obj.session_uid, [], (scene.frame_current, scene.frame_subframe)
        if attended:
            self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        context.window_manager.progress_begin(self.first, self.last)
        problem = ""
        while not problem and len(self._frames) <= self.last - self.first:
            problem = self._take(context)
            context.window_manager.progress_update(self.first + len(self._frames))
        context.window_manager.progress_end()
        return self._finish(context, problem)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            return self._finish(context, Phrase("Stopped: nothing was baked"), "INFO")
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        problem = self._take(context)
        count = self.last - self.first + 1
        if problem or len(self._frames) == count:
            return self._finish(context, problem)
        text = Phrase(
            "Bake: Frame {frame}, {share:.0%}    Esc to stop",
            frame=self.first + len(self._frames),
            share=len(self._frames) / count,
        )
        context.workspace.status_text_set(translated(text, iface_))
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Leave nothing in the window, should it be closed; also called when the dialog is."""
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.workspace.status_text_set(None)
            self._timer = None

    def _find(self, context):
        return next((obj for obj in context.scene.objects if obj.session_uid == self._uid), None)

    def _take(self, context) -> str:
        """Read the displacements of the next frame; return what is in the way, or an empty text."""
        context.scene.frame_set(self.first + len(self._frames))
        obj = self._find(context)
        if obj is None:
            return Phrase("The object was deleted. Nothing was baked.")
        try:
            live.update(obj)
        except PointCloudError as error:
            return error.text
        reason = stale_reason(obj)
        if reason:
            return Phrase('"{object}" is not up to date. {reason}.', object=obj.name, reason=reason)
        self._frames.append(read_attribute(obj.data, DISPLACEMENT))
        return ""

    def _finish(self, context, problem, kind="ERROR"):
        """Go back to the frame that was shown, and write what was baked, or report why there is nothing."""
        self.cancel(context)
        frame, subframe = self._kept
        context.scene.frame_set(frame, subframe=subframe)
        if problem:
            self.report({kind}, translated(problem))
            return {"CANCELLED"}
        obj = self._find(context)
        mesh = bpy.data.meshes.new(f"{obj.name} Bake")
        mesh.vertices.add(point_count(obj.data))
        for number, displacement in enumerate(self._frames):
            write_attribute(mesh, str(number), displacement, "FLOAT_VECTOR")
        cache = bpy.data.objects.new(mesh.name, mesh)  # of no collection: only the modifier uses it
        show_baked(find_deform(obj), cache, self.first, len(self._frames))
        size = np.prod([len(self._frames), *self._frames[0].shape]) * 4 / 2**20
        text = Phrase(
            "{object}: {count} frames are baked, {size:.1f} MB in the file",
            object=obj.name,
            count=len(self._frames),
            size=size,
        )
        self.report({"INFO"}, translated(text))
        return {"FINISHED"}


class MESHFREE_OT_deform_free(BoundOperator, bpy.types.Operator):
    """Remove what was baked, and let the points follow the handles again"""

    bl_idname = "meshfree.deform_free"
    bl_label = "Delete Bake"
    works_stale = True

    @classmethod
    def obstacle(cls, context):
        reason = super().obstacle(context)
        obj = cls.subject(context)
        return reason or ("" if is_baked(obj) else Phrase('Nothing of "{object}" is baked', object=obj.name))

    def change(self, context, obj):
        delete_bake(obj)
        context.view_layer.update()
        live.update(obj)
        return Phrase("{object}: follows its handles again", object=obj.name)


CLASSES = (MESHFREE_OT_deform_bake, MESHFREE_OT_deform_free)
