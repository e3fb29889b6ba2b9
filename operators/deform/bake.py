"""Bake an animated deformation, so that it plays and renders without the extension."""

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty

from ...core import NotEnoughMemoryError, PointCloudError
from ...core.memory import available_memory
from ...tools.quantities import DISPLACEMENT
from ..objects.all_or_nothing import all_or_nothing
from ..objects.animation import TRANSFORM
from ..objects.attributes import point_count, read_attribute, write_attribute
from ..objects.carried import carried, carries, moved_names
from ..objects.reading import find_object
from ..objects.splats import HARMONIC, harmonic_names
from ..registration import Registration, Row
from ..running.job import Job, JobOperator, SteppedJob, all_steps
from ..running.ready import reporting
from ..running.stages import Stages
from . import live
from .binding import stale_reason
from .kinds import kind_of
from .nodes import baked_suffix, find_deform, is_baked, show_baked
from .pose import POSE, State, write_displacement
from .tools import BoundOperator, check_fresh, delete_bake

_LAST = 1048574  # frame of Blender


class MESHFREE_OT_deform_bake(JobOperator, BoundOperator, bpy.types.Operator):
    """Store the deformation of each frame in the file, for machines without the extension"""

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
    harmonics: BoolProperty(
        name="View-Dependent Colors",
        description="Rotate the harmonics of Gaussian splats in each frame, which takes 12 bytes for each of them",
        default=True,
    )
    asks = ("first", "last")

    def invoke(self, context, event):
        self._attended = True
        self.first, self.last = context.scene.frame_start, context.scene.frame_end
        if harmonic_names(self.subject(context).data):
            self.asks = (*self.asks, "harmonics")
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context):
        obj, scene, attended = self.subject(context), context.scene, self.takes_window()
        if not self.first and not self.last:
            self.first, self.last = scene.frame_start, scene.frame_end
        check_fresh(obj)
        if self.last < self.first:
            raise PointCloudError(f"The last frame, {self.last}, comes before the first one, {self.first}. Swap them.")
        along = carried(obj.data) if carries(obj) else ()
        along = [item for item in along if self.harmonics or not item.name.startswith(HARMONIC)]
        _check_memory(self.last - self.first + 1, point_count(obj.data), along)
        self._kept = _Kept(scene, obj, along)
        if attended:
            return self.start(context, [obj], self._prepared_frames, SteppedJob)
        try:
            with Stages(context.window_manager, self.bl_label) as stages:
                frames = all_steps(self._frames(stages))
        finally:
            self.leave(context)
        return self.finish(context, [obj], frames)

    def _prepared_frames(self, progress):
        """Factorize in a thread first, if necessary; see `_frames`."""
        obj = self._kept.find()[1]
        if not live.is_prepared(live.find(obj)):
            make = live.plan_follower(obj)
            work = Job(self.bl_label, [], lambda report: make(report).prepare(report))
            try:
                while not work.ended:
                    progress(work.stage, 0.0)
                    yield
                live.keep(self._kept.find()[1], work.result())
            finally:
                work.stop()
        return (yield from self._frames(progress))

    def _frames(self, progress):
        """Read the attributes of all frames, one at each step; return a list of results of `_read_frame`."""
        frames = []
        for number in range(self.first, self.last + 1):
            progress("Frames", len(frames) / (self.last + 1 - self.first))
            scene, obj = self._kept.find()
            if scene is None:
                raise PointCloudError("The scene was deleted meanwhile. Nothing was baked.")
            if frames and not self._kept.holds():
                raise PointCloudError(
                    f'What "{obj.name}" follows or the frame were changed meanwhile. Nothing was baked.'
                )
            scene.frame_set(number)
            self._kept.expect()
            live.update(obj, wanted=State.PREPARING if live.is_prepared(live.find(obj)) else State.SETTLED)
            reason = stale_reason(obj, glance=True, trusting=True)
            if reason:
                raise PointCloudError(f'"{obj.name}" is not up to date. {reason}.')
            frames.append(_read_frame(obj.data, self._kept.along))
            yield
        return frames

    def leave(self, context):
        """Restore the frame and what the points follow."""
        self._kept.put_back()

    def finish(self, context, objects, results):
        """Write what was baked."""
        (obj,) = objects
        with all_or_nothing(objects):
            mesh = bpy.data.meshes.new(f"{obj.name} Bake")
            mesh.vertices.add(point_count(obj.data))
            for number, frame in enumerate(results):
                for suffix, (values, data_type) in frame.items():
                    write_attribute(mesh, f"{number}{suffix}", values, data_type)
            cache = bpy.data.objects.new(mesh.name, mesh)  # in no collection: used by the modifier only
            show_baked(find_deform(obj), cache, self.first, len(results), self._kept.along)
        size = len(results) * sum(values.nbytes for values, _ in results[0].values()) / 2**20
        self.report({"INFO"}, f"{obj.name}: {len(results)} frames are baked, {size:.1f} MB in the file")
        return {"FINISHED"}


def _check_memory(frames, points, along):
    """Refuse what does not fit into memory, which holds all frames twice."""
    numbers = 3 + sum(4 if item.data_type == "QUATERNION" else 3 for item in along)
    each, free = 2 * 4 * numbers * points, available_memory()
    if free is not None and frames * each > free:
        harmonics = any(item.name.startswith(HARMONIC) for item in along)
        raise NotEnoughMemoryError(
            f"{frames:,} frames of {points:,} points would take {frames * each / 2**30:.1f} GB of memory, and"
            f" {free / 2**30:.1f} GB are free: enough for {free // each:,} frames. Bake fewer"
            f"{', or turn off View-Dependent Colors' if harmonics else ''}.",
            fitting=free // each,
        )


def _read_frame(data, along):
    """Return the displayed attributes of a frame, `Carried` included, with types, by suffix of their names."""
    frame = {"": (read_attribute(data, DISPLACEMENT), "FLOAT_VECTOR")}
    for item in along:
        shown = item.moved if item.moved in data.attributes else item.name
        frame[baked_suffix(item.name)] = read_attribute(data, shown), item.data_type
    return frame


class _Kept:
    """The frame, what the points follow, and displacements before baking."""

    def __init__(self, scene, obj, along=()):
        self.along = along  # `Carried` that is baked
        self._scene, self._uid = scene.session_uid, obj.session_uid
        self._time = scene.frame_current, scene.frame_subframe
        self._places = self._expected = self._now()
        self._displacement = read_attribute(obj.data, DISPLACEMENT)
        self._moved = {name: read_attribute(obj.data, name) for name in moved_names(obj.data)}
        self._shown = obj.data[POSE].to_list()

    def find(self):
        """Return the scene and the object; None for what was removed."""
        scene = next((scene for scene in bpy.data.scenes if scene.session_uid == self._scene), None)
        return scene, find_object(self._uid)

    def _now(self):
        """Read the frame, the binding, and the transforms of what moves the points."""
        scene, obj = self.find()
        if scene is None or obj is None:
            return None
        places = {
            key: {name: tuple(getattr(thing, name)) for name in TRANSFORM}
            for key, thing in kind_of(obj).movers(obj).items()
        }
        return scene.frame_current, obj.meshfree.deform.binding_id, places

    def expect(self):
        """Keep the present state as the expected one."""
        self._expected = self._now()

    def holds(self) -> bool:
        """Whether the state is the expected one: nothing was moved since."""
        obj = self.find()[1]
        return (
            self._expected is not None
            and self._now() == self._expected
            and point_count(obj.data) == len(self._displacement)
        )

    def put_back(self):
        """Restore the state; what was moved meanwhile is left alone."""
        scene, obj = self.find()
        if scene is None:
            return
        holds = self.holds()
        frame, subframe = self._time
        scene.frame_set(frame, subframe=subframe)
        if not holds:
            return
        things = kind_of(obj).movers(obj)
        for key, place in self._places[2].items():
            thing = things[key]
            for name, value in place.items():
                if tuple(getattr(thing, name)) != value:  # moved after its keyframe
                    setattr(thing, name, value)
        settled, *numbers = self._shown
        state = State.SETTLED if settled else State.QUICK
        write_displacement(obj, self._displacement, np.array(numbers), state, self._moved)


class MESHFREE_OT_deform_free(BoundOperator, bpy.types.Operator):
    """Remove the baked animation, and let the points follow handles or bones again"""

    bl_idname = "meshfree.deform_free"
    bl_label = "Delete Bake"
    works_stale = True

    @classmethod
    def lack(cls, context, obj):
        return super().lack(context, obj) or ("" if is_baked(obj) else f'Nothing of "{obj.name}" is baked')

    def change(self, context, obj):
        delete_bake(obj)
        context.view_layer.update()
        live.update(obj)
        return f"{obj.name}: follows its {kind_of(obj).followed} again"


TOOLS = (
    Registration(MESHFREE_OT_deform_bake, panel=Row("Bend", 1, 5), menu=Row("Object", 9, 1)),
    Registration(MESHFREE_OT_deform_free, panel=Row("Bend", 1, 6), menu=Row("Object", 9, 2)),
)
