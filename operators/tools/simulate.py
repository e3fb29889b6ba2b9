"""Simulate Along Surface: the settings of a motion, and where it is kept: as frames on disk, or as modes."""

import math
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ...core import PointCloudError
from ...tools import simulate
from ...tools.motions import InModes, find_touched, in_modes
from ...tools.quantities import MOTION, NORMAL
from ..objects import motion_files
from ..objects.motion import TEMPORARY, show_frame, show_values, write_frames
from ..objects.motion_nodes import forget_groups, mode_name, show_motion
from ..objects.result import length_text, length_writer
from ..objects.touching import places_of
from ..running.application import operator_reader
from .declared import registration_of
from .select import read_sources

_IN_MODES = ("HEAT", "WAVE")
_BLURRED = 0.99  # share of a pulse that the modes should hold
_MEGABYTE = 1 << 20


class Simulated(NamedTuple):
    """What was simulated."""

    motion: "_Frames | InModes"
    # Frames of the scene, and how many are from one on disk to the next
    frames: int
    step: int
    reached: np.ndarray  # (n,) bool, points of components with sources
    normals: np.ndarray  # (n, 3), in local space


class _Frames(NamedTuple):
    """A motion as frames on disk, with the range of all values, and the largest size on show in the end."""

    path: Path
    low: float
    high: float
    last: float
    distance: float  # how far it went, or the size of a pattern


class Kept:
    """What Blender adds to the tool: frames on disk, or modes with nodes; and an object that touches the points."""

    adjustable = ()  # everything but Show changes the frames
    at_zero = {"height": "None"}

    toucher: StringProperty(
        name="Touching Object",
        description="Object of the scene that starts the motion at each frame where its vertices touch the points, in"
        " place of the sources",
    )
    keep: EnumProperty(
        name="Kept",
        description="How the motion is kept",
        items=[
            ("FRAMES", "As Frames", "Frames on disk, which the extension plays"),
            (
                "MODES",
                "As Modes",
                "Heat or a wave as a few modes and a formula of the time, by nodes: plays and renders anywhere",
            ),
        ],
        default="FRAMES",
    )
    modes: IntProperty(
        name="Modes",
        description="How many modes, each a number at every point: the more, the narrower a pulse they hold",
        default=30,
        min=2,
        soft_max=100,
        max=300,
    )
    height: FloatProperty(
        name="Height",
        description="Displacement along the normals where the value is 1, by a modifier; 0 for colors alone",
        default=0.0,
        soft_min=-1.0,
        soft_max=1.0,
        subtype="DISTANCE",
    )
    budget: IntProperty(
        name="Disk Budget",
        description="Megabytes on disk at most; where all frames take more, some are left out and interpolated. Former"
        " ones stay for Undo as far as they fit beside them",
        default=1024,
        min=1,
        soft_max=100_000,
    )
    folder: StringProperty(
        name="Folder",
        description="Where frames are kept, beside the file that is saved; empty for a temporary folder",
        default=motion_files.FOLDER,
        subtype="DIR_PATH",
    )

    @property
    def asks(self):
        """Names of the settings that the motion has."""
        own = {"REACTION": ("pattern",), "HEAT": ("width",), "WAVE": ("width",), "FRONT": ("width",)}[self.kind]
        kept = ("modes",) if _as_modes(self) else ("budget", "folder")
        how = ("keep", *kept) if self.kind in _IN_MODES else kept
        return "kind", "group", "toucher", *own, "distance", "frames", "height", *how, "show"

    @property
    def writes(self):
        """Names of the attributes: normals only where points are displaced along them."""
        modes = map(mode_name, range(1, self.modes + 1)) if _as_modes(self) else ()
        return MOTION, *([NORMAL] if self.height else []), *modes

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        touches = bool(self.toucher)
        sources = np.zeros(len(reading.points), dtype=bool) if touches else read_sources(obj, self.group)
        first, count = context.scene.frame_start, self.frames
        count = count or context.scene.frame_end - first + 1
        if not all(map(math.isfinite, (self.distance, self.width, self.height))):
            raise PointCloudError("Distance, Width and Height must be numbers. Set them again.")
        modes = self.modes if _as_modes(self) else 0
        step = 1 if modes else self._step(count, len(sources))
        chosen = simulate.chosen(self.own(), sources, count, step)
        places = places_of(context, obj, self.toucher, range(first, first + count)) if touches else []
        path, length = None if modes else motion_files.new_path(obj, self.folder), length_writer()

        def compute(progress):
            laplacian = operator(progress)
            motion_of = find_touched(laplacian, chosen, places, length) if touches else chosen
            if modes:
                motion = in_modes(laplacian, motion_of, modes, progress)
            else:
                motion = _on_disk(path, laplacian, motion_of, progress)
            reached = simulate.reached(laplacian, motion_of.sources)
            return Simulated(motion, count, step, reached, reading.local_normals(laplacian.normals))

        return compute

    def _step(self, count, points):
        """Return how many frames of the scene are one frame on disk, so that all fit the budget."""
        fitting = max(int(self.budget * _MEGABYTE // (4 * points)), 2)
        return max(1, math.ceil((count - 1) / (fitting - 1)))

    def write(self, context, obj, result):
        settings, scene, motion = obj.meshfree, context.scene, result.motion
        before, first = settings.motion_file, scene.frame_start
        settings.motion_first, settings.motion_step = first, result.step
        formula = motion.formula if isinstance(motion, InModes) else None
        motion_files.note_replaced(obj, before, self.folder)
        if formula is None:
            settings.motion_file = motion_files.as_kept(motion.path, self.folder)
            scene.render.use_lock_interface = True  # for each frame an attribute is written
            show_frame(obj, scene.frame_current_final)
        else:
            settings.motion_file = ""
            show_values(obj, formula.at((scene.frame_current_final - first) / max(result.frames - 1, 1)))
        show_motion(obj, self.height, result.normals, formula, first, result.frames)
        if self.show:
            _lock_range(settings, self.kind, motion)
        notices = simulate.motion_notices(self, motion, result.reached)
        return [*notices, *self._about_kept(result), self._line(obj, result)]

    def _about_kept(self, result):
        motion, notices = result.motion, []
        if isinstance(motion, InModes):
            if motion.held < _BLURRED:
                notices.append(
                    f"The modes hold {motion.held:.0%} of the pulse, which is blurred by that. Raise Modes or Width."
                )
            return notices
        if result.step > 1:
            notices.append(
                f"One of {result.step} frames is kept, since all take more than the Disk Budget of {self.budget} MB;"
                " those between are interpolated."
            )
        if motion.path.is_relative_to(Path(bpy.app.tempdir).resolve()):
            notices.append(TEMPORARY)
        return notices

    def _line(self, obj, result):
        motion = result.motion
        if isinstance(motion, InModes):
            size = f"{len(motion.formula.rates)} modes"
        else:
            size = f"{motion.path.stat().st_size / _MEGABYTE:.1f} MB"
        return f"{obj.name}: {simulate.motion_line(self, motion, length_text)}, {size}. Press Space to play it"

    def conclude(self, context, objects):
        super().conclude(context, objects)
        forget_groups()
        own = motion_files.size_of(filter(None, map(motion_files.frames_of, objects)))
        removed = motion_files.shrink_former(self.budget * _MEGABYTE - own)
        if removed:
            self.warn(
                f"{'A former motion' if removed == 1 else f'{removed} former motions'} cannot come back by Undo: those"
                f" frames did not fit into the Disk Budget of {self.budget} MB beside the new ones.",
                objects[0],
            )


def _as_modes(tool) -> bool:
    """Whether a motion is kept as modes, by the settings of a tool."""
    return tool.keep == "MODES" and tool.kind in _IN_MODES


def _on_disk(path, laplacian, chosen, progress) -> _Frames:
    """Simulate, and write the frames to a file."""
    seen = simulate.Watched(laplacian, chosen, progress)
    write_frames(path, chosen.kept, len(chosen.sources), seen)
    return _Frames(path, seen.low, seen.high, seen.last, seen.distance)


def _lock_range(settings, kind, motion):
    """Show all frames in one range of colors: that of the last ones, which all but a front grow or fade to."""
    settings.range_mode = "LOCKED"
    settings.range_low, settings.range_high = (-motion.last, motion.last) if kind == "WAVE" else (0.0, motion.last)
    if kind == "WAVE" and settings.color_map == "AUTO":
        settings.color_map = "COOL_WARM"


TOOLS = (registration_of(simulate.TOOL, Kept),)
