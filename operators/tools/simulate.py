"""Heat, waves, patterns and fronts along the surface, frame by frame."""

import math
import uuid
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.groups import SOURCE
from ..objects.motion import show_frame, write_frames
from ..objects.motion_nodes import displace
from ..objects.quantities import MOTION, NORMAL
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources, unreached

FOLDER = "//motion"  # beside the file
_WIDTH = 6.0  # smoothing lengths: a pulse that the points resolve
_SPOT = 10.0  # smoothing lengths in the size of a pattern: finer ones are not resolved, and die out
_ACROSS = 12.0  # patterns of automatic size across the root of the area, at most
_SEED = 0.4  # of that size, around the sources: where a reaction starts
_PATTERN_TIME = 5000.0  # units of time in which patterns cover the surface, over all frames
_LONGEST = 5.0  # of these, in one step of a reaction
_DEAD = 0.05  # highest concentration where a reaction has ended
_MEGABYTE = 1 << 20


class Simulated(NamedTuple):
    """What was simulated.

    Attributes
    ----------
    path : Path
        Of the frames.
    frames, step : int
        Frames of the scene, and how many are from one on disk to the next.
    low, high, last : float
        Range of all values, and the highest one of the last frame.
    reached : ndarray, (n,) bool
        Points of components with sources.
    distance : float
        How far it went, or the size of a pattern.
    normals : ndarray, (n, 3)
        In local space.
    """

    path: Path
    frames: int
    step: int
    low: float
    high: float
    last: float
    reached: np.ndarray
    distance: float
    normals: np.ndarray


class Simulate(Tool):
    """The settings and the work of `meshfree.simulate`."""

    at_zero = {"distance": "Automatic", "width": "Automatic", "frames": "Scene", "height": "None"}

    kind: EnumProperty(
        name="Motion",
        description="What moves along the surface",
        items=[
            ("HEAT", "Heat", "Spreads from the sources and becomes even"),
            ("WAVE", "Wave", "A pulse at the sources, which runs in all directions and is reflected at boundaries"),
            ("REACTION", "Reaction", "Two substances that react and spread: patterns of spots or stripes"),
            ("FRONT", "Front", "Travels from the sources at one speed, as fire does"),
        ],
        default="HEAT",
    )
    group: StringProperty(
        name="Sources",
        description="Vertex group of the sources; where there is none of that name, the points selected in Edit Mode",
        default=SOURCE,
    )
    pattern: EnumProperty(
        name="Pattern",
        description="What the reaction makes",
        items=[
            ("SPOTS", "Spots", "Spots that divide until they cover the surface"),
            ("STRIPES", "Stripes", "Winding stripes"),
        ],
        default="SPOTS",
    )
    distance: FloatProperty(
        name="Distance",
        description="How far heat spreads, or a wave or front travels, within all frames; for patterns, from one spot"
        " or stripe to the next. 0 for a distance that fits the object",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    width: FloatProperty(
        name="Width",
        description="Width of the pulse of a wave, or of the edge of a front; 0 for as narrow as the points resolve",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    frames: IntProperty(
        name="Frames",
        description="How many frames, from the first frame of the scene on; 0 for all of the scene",
        default=0,
        min=0,
        soft_max=1000,
        max=10000,
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
        description="Megabytes on disk at most; where all frames take more, some are left out and interpolated",
        default=1024,
        min=1,
        soft_max=100_000,
    )
    folder: StringProperty(
        name="Folder",
        description="Where frames are kept, beside the file that is saved; empty for a temporary folder",
        default=FOLDER,
        subtype="DIR_PATH",
    )

    @property
    def asks(self):
        """Names of the settings that the motion has."""
        own = {"REACTION": ("pattern",), "HEAT": (), "WAVE": ("width",), "FRONT": ("width",)}[self.kind]
        return "kind", "group", *own, "distance", "frames", "height", "budget", "folder", "show"

    @property
    def writes(self):
        """Names of the attributes: normals only where points are displaced along them."""
        return (MOTION, NORMAL) if self.height else (MOTION,)

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        reading, operator = operator_reader(context, obj)
        count = self.frames or context.scene.frame_end - context.scene.frame_start + 1
        step = self._step(count, len(sources))
        path = _new_path(obj, self.folder)
        make = {"HEAT": _heat, "WAVE": _wave, "REACTION": _reaction, "FRONT": _front}[self.kind]
        chosen = _Chosen(sources, count, step, self.distance, self.width, self.pattern.lower())
        if not all(map(math.isfinite, (self.distance, self.width, self.height))):
            raise PointCloudError("Distance, Width and Height must be numbers. Set them again.")

        def compute(progress):
            laplacian = operator(progress)
            rows, distance = make(laplacian, chosen, progress)
            seen = []

            def watched():
                for number, row in enumerate(rows):
                    progress("Frames", min(number / chosen.kept, 1.0))
                    seen.append((row.min(), row.max()))
                    yield row

            write_frames(path, chosen.kept, len(sources), watched())
            low, high = np.min(seen, axis=0)[0], np.max(seen, axis=0)[1]
            component = laplacian.component
            reached = np.isin(component, component[sources]) & (component >= 0)
            normals = reading.local_normals(laplacian.normals)
            return Simulated(path, count, step, low, high, seen[-1][1], reached, distance, normals)

        return compute

    def _step(self, count, points):
        """Return how many frames of the scene are one frame on disk, so that all fit the budget."""
        fitting = max(int(self.budget * _MEGABYTE // (4 * points)), 2)
        return max(1, math.ceil((count - 1) / (fitting - 1)))

    def write(self, context, obj, result):
        settings, scene = obj.meshfree, context.scene
        before = settings.motion_file
        kept = bpy.path.relpath(str(result.path)) if self.folder.startswith("//") and bpy.data.filepath else ""
        settings.motion_file = kept or str(result.path)
        settings.motion_first, settings.motion_step = scene.frame_start, result.step
        show_frame(obj, scene.frame_current_final)
        displace(obj, self.height, result.normals)
        if self.show:
            bound = max(-result.low, result.high)
            settings.range_mode = "LOCKED"
            settings.range_low, settings.range_high = (-bound, bound) if self.kind == "WAVE" else (0.0, result.high)
        _remove_old(obj, before, result.path)
        return [*self.about(obj, result), *self._about_files(result), self._line(obj, result)]

    def about(self, obj, result) -> list:
        """Return notices about what was simulated."""
        notices = unreached(obj, result.reached, "Nothing moves there.")
        if self.kind == "REACTION" and result.last < _DEAD:
            notices.append(
                f"The reaction has died out. Patterns need a Distance of {_SPOT:g} smoothing lengths of the points or"
                " more, and sources that are single points or small groups."
            )
        return notices

    def _about_files(self, result):
        notices = []
        if result.step > 1:
            notices.append(
                f"One of {result.step} frames is kept, since all take more than the Disk Budget of {self.budget} MB;"
                " those between are interpolated."
            )
        if result.path.is_relative_to(bpy.app.tempdir):
            notices.append(
                "The frames are in a temporary folder, which Blender empties when it quits. Save the file, and simulate"
                " again to keep them."
            )
        return notices

    def _line(self, obj, result):
        done = {
            "HEAT": "heat spreads by",
            "WAVE": "waves run",
            "REACTION": f"{self.pattern.lower()} at a distance of",
            "FRONT": "the front travels",
        }[self.kind]
        size = result.path.stat().st_size / _MEGABYTE
        span = f"values {result.low:.3g} to {result.high:.3g}"
        return f"{obj.name}: {done} {length_text(result.distance)}, {span}, {size:.1f} MB"


class _Chosen(NamedTuple):
    """The settings of a motion, with zero for automatic lengths."""

    sources: np.ndarray
    count: int  # frames of the scene
    step: int  # of these from one on disk to the next
    distance: float
    width: float
    pattern: str

    @property
    def kept(self) -> int:
        """How many frames are on disk."""
        return -(-(self.count - 1) // self.step) + 1

    @property
    def share(self) -> float:
        """Of the time of all frames, from one on disk to the next."""
        return self.step / max(self.count - 1, 1)


def _size(laplacian):
    known = laplacian.component >= 0
    return float(np.linalg.norm(np.ptp(laplacian.points[known], axis=0)))


def _width(laplacian, chosen):
    return chosen.width or _WIDTH * float(np.median(laplacian.smoothing_lengths))


def _heat(laplacian, chosen, progress):
    """Return the frames of heat, without end, and how far it spreads."""
    distance = chosen.distance or 0.5 * _size(laplacian)
    heat = core.Heat(laplacian, 0.25 * distance * distance * chosen.share, progress=progress)
    return _advance(heat, chosen.sources.astype(np.float64), lambda state: state), distance


def _wave(laplacian, chosen, progress):
    """Return the frames of a wave, without end, and how far it runs."""
    distance, width = chosen.distance or _size(laplacian), _width(laplacian, chosen)
    away = cache.geodesics(laplacian, progress).distance(chosen.sources, progress=progress)
    pulse = np.exp(-((away / width) ** 2))
    wave = core.Wave(laplacian, chosen.share, distance, progress=progress)
    return _advance(wave, (pulse, np.zeros_like(pulse)), lambda state: state[0]), distance


def _reaction(laplacian, chosen, progress):
    """Return the frames of what grows in a reaction, without end, and the size of the pattern."""
    known = laplacian.component >= 0
    resolved = _SPOT * float(np.median(laplacian.smoothing_lengths[known]))
    automatic = max(resolved, math.sqrt(float(laplacian.areas[known].sum())) / _ACROSS)
    size, time = chosen.distance or automatic, _PATTERN_TIME * chosen.share
    steps = math.ceil(time / _LONGEST)
    reaction = core.ReactionDiffusion.of_pattern(laplacian, time / steps, chosen.pattern, size, progress=progress)
    # A single point would fade before it reacts.
    near = cache.geodesics(laplacian, progress).distance(chosen.sources, limit=_SEED * size, progress=progress)
    eater = (near <= _SEED * size).astype(np.float64)
    return _advance(reaction, (1.0 - eater, eater), lambda state: state[1], steps), size


def _advance(motion, state, part, steps=1):
    while True:
        yield part(state)
        for _ in range(steps):
            state = motion.advance(state)


def _front(laplacian, chosen, progress):
    """Return the frames of a front, 1 behind it and 0 before, without end, and how far it travels."""
    distances = cache.geodesics(laplacian, progress).distance(chosen.sources, progress=progress)
    far = chosen.distance or float(distances[np.isfinite(distances)].max())
    width = _width(laplacian, chosen)

    def frames():
        travelled = 0.0
        while True:
            yield np.clip(1.0 + (travelled - distances) / width, 0.0, 1.0)
            travelled += far * chosen.share

    return frames(), far


def _new_path(obj, folder) -> Path:
    """Return a new path for the frames of an object."""
    if folder.startswith("//") and not bpy.data.filepath:
        folder = ""
    home = bpy.path.abspath(folder) if folder else bpy.app.tempdir
    return Path(home) / f"{_stem(obj)}-{uuid.uuid4().hex[:8]}.npy"


def _stem(obj):
    return bpy.path.clean_name(obj.name)


def _remove_old(obj, before, path):
    """Remove the earlier frames of an object beside the new ones, if no other object plays them."""
    old = Path(bpy.path.abspath(before)) if before else path
    used = any(other.meshfree.motion_file == before for other in bpy.data.objects if other != obj)
    if old != path and old.parent == path.parent and old.match(f"{_stem(obj)}-????????.npy") and not used:
        old.unlink(missing_ok=True)


class MESHFREE_OT_simulate(Simulate, ShownOperator, bpy.types.Operator):
    """Simulate heat, waves, patterns or a front along the surface, to be played with the frames of the scene"""

    bl_idname = "meshfree.simulate"
    bl_label = "Simulate Along Surface"


TOOLS = (Registration(MESHFREE_OT_simulate, panel=Row("Simulate", 1, 1), menu=Row("Object", 6, 3), verb=Simulate),)
