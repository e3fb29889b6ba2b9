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
from ..objects.motion import close_frames, show_frame, show_values, write_frames
from ..objects.motion_nodes import Formula, forget_groups, mode_name, show_motion
from ..objects.quantities import MOTION, NORMAL
from ..objects.result import length_text
from ..objects.touching import places_of
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
_EDGE = math.exp(-1.0)  # of a pulse, at its width
_FAR = 6.0  # widths from which a pulse is nothing
_DEAD = 0.05  # highest concentration where a reaction has ended
_IN_MODES = ("HEAT", "WAVE")
_FADED = 0.4  # height of a wave that has left its pulse, over that
_BLURRED = 0.99  # share of a pulse that the modes should hold
_MEGABYTE = 1 << 20


class Simulated(NamedTuple):
    """What was simulated.

    Attributes
    ----------
    motion : _Frames or _Modes
    frames, step : int
        Frames of the scene, and how many are from one on disk to the next.
    reached : ndarray, (n,) bool
        Points of components with sources.
    normals : ndarray, (n, 3)
        In local space.
    """

    motion: "_Frames | _Modes"
    frames: int
    step: int
    reached: np.ndarray
    normals: np.ndarray


class _Frames(NamedTuple):
    """A motion as frames on disk, with the range of all values, and the largest size on show in the end."""

    path: Path
    low: float
    high: float
    last: float
    distance: float  # how far it went, or the size of a pattern

    @property
    def size(self) -> str:
        """What it takes."""
        return f"{self.path.stat().st_size / _MEGABYTE:.1f} MB"


class _Modes(NamedTuple):
    """A motion as modes, with the range of its first frame, and the share of the pulse that they hold.

    Waves are lower once they have left their pulse.
    """

    formula: Formula
    low: float
    high: float
    held: float
    distance: float

    @property
    def last(self) -> float:
        """The largest size on show in the end, about."""
        return (_FADED if self.formula.function == "COSINE" else 1.0) * self.high

    @property
    def size(self) -> str:
        """What it takes."""
        return f"{len(self.formula.rates)} modes"


class Simulate(Tool):
    """The settings and the work of `meshfree.simulate`."""

    adjustable = ()  # everything but Show changes the frames
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
    toucher: StringProperty(
        name="Touching Object",
        description="Object of the scene that starts the motion at each frame where its vertices touch the points, in"
        " place of the sources; not for fronts and modes",
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
        description="Width of the pulse from which heat or a wave starts, or of the edge of a front; 0 for as narrow as"
        " the points resolve",
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
        own = {"REACTION": ("pattern",), "HEAT": ("width",), "WAVE": ("width",), "FRONT": ("width",)}[self.kind]
        kept = ("modes",) if _as_modes(self) else ("budget", "folder")
        how = ("keep", *kept) if self.kind in _IN_MODES else kept
        touched = () if self.kind == "FRONT" or _as_modes(self) else ("toucher",)
        return "kind", "group", *touched, *own, "distance", "frames", "height", *how, "show"

    @property
    def writes(self):
        """Names of the attributes: normals only where points are displaced along them."""
        modes = map(mode_name, range(1, self.modes + 1)) if _as_modes(self) else ()
        return MOTION, *([NORMAL] if self.height else []), *modes

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        touches = bool(self.toucher) and self.kind != "FRONT" and not _as_modes(self)
        sources = np.zeros(len(reading.points), dtype=bool) if touches else read_sources(obj, self.group)
        count = self.frames or context.scene.frame_end - context.scene.frame_start + 1
        if not all(map(math.isfinite, (self.distance, self.width, self.height))):
            raise PointCloudError("Distance, Width and Height must be numbers. Set them again.")
        step = 1 if _as_modes(self) else self._step(count, len(sources))
        chosen = _Chosen(sources, count, step, self.distance, self.width, self.pattern.lower())
        if touches:
            first = context.scene.frame_start
            numbers = range(first, first + chosen.kept * step, step)
            chosen = chosen._replace(places=places_of(context, obj, self.toucher, numbers))
        path = Path() if _as_modes(self) else _new_path(obj, self.folder)
        kind, modes = self.kind, self.modes if _as_modes(self) else 0

        def compute(progress):
            laplacian, motion_of = operator(progress), chosen
            if touches:
                motion_of = _find_touched(laplacian, chosen)
            make = _modes(kind, modes) if modes else _frames(kind, path)
            motion = make(laplacian, motion_of, progress)
            component = laplacian.component
            reached = np.isin(component, component[motion_of.sources]) & (component >= 0)
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
        formula = motion if isinstance(motion, _Modes) else None
        if formula is None:
            settings.motion_file = _as_kept(motion.path, self.folder)
            scene.render.use_lock_interface = True  # for each frame an attribute is written
            show_frame(obj, scene.frame_current_final)
        else:
            settings.motion_file = ""
            time = (scene.frame_current_final - first) / max(result.frames - 1, 1)
            show_values(obj, formula.formula.at(time))
        show_motion(obj, self.height, result.normals, formula and formula.formula, first, result.frames)
        if self.show:
            _lock_range(settings, self.kind, motion)
        _remove_old(obj, before, self.folder)
        return [*self.about(obj, result), *self._about_kept(result), self._line(obj, result)]

    def about(self, obj, result) -> list:
        """Return notices about what was simulated."""
        notices = unreached(obj, result.reached, "Nothing moves there.")
        if self.kind == "REACTION" and result.motion.last < _DEAD:
            notices.append(
                f"The reaction has died out. Patterns need a Distance of {_SPOT:g} smoothing lengths of the points or"
                " more, and sources that are single points or small groups."
            )
        return notices

    def _about_kept(self, result):
        motion, notices = result.motion, []
        if isinstance(motion, _Modes):
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
        if motion.path.is_relative_to(bpy.app.tempdir):
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
        motion = result.motion
        span = f"values {motion.low:.3g} to {motion.high:.3g}"
        return f"{obj.name}: {done} {length_text(motion.distance)}, {span}, {motion.size}"


def _as_modes(tool) -> bool:
    """Whether a motion is kept as modes, by the settings of a tool."""
    return tool.keep == "MODES" and tool.kind in _IN_MODES


class _Chosen(NamedTuple):
    """The settings of a motion, with zero for automatic lengths."""

    sources: np.ndarray
    count: int  # frames of the scene
    step: int  # of these from one on disk to the next
    distance: float
    width: float
    pattern: str
    places: list | None = None  # of what touches the points, for each frame on disk
    touched: list | None = None  # and the points there, (n,) bool

    @property
    def kept(self) -> int:
        """How many frames are on disk."""
        return -(-(self.count - 1) // self.step) + 1

    @property
    def share(self) -> float:
        """Of the time of all frames, from one on disk to the next."""
        return self.step / max(self.count - 1, 1)


def _frames(kind, path):
    """Return a function that simulates and writes frames, and returns `_Frames`."""
    make = {"HEAT": _heat, "WAVE": _wave, "REACTION": _reaction, "FRONT": _front}[kind]

    def run(laplacian, chosen, progress):
        rows, distance = make(laplacian, chosen, progress)
        seen = []

        def watched():
            for number, row in enumerate(rows):
                progress("Frames", min(number / chosen.kept, 1.0))
                seen.append((row.min(), row.max()))
                yield row

        write_frames(path, chosen.kept, len(chosen.sources), watched())
        low, high = np.min(seen, axis=0)[0], np.max(seen, axis=0)[1]
        last = {"WAVE": np.abs(seen[len(seen) // 2 :]).max(), "REACTION": seen[-1][1]}.get(kind, high)
        return _Frames(path, low, high, last, distance)

    return run


def _modes(kind, count):
    """Return a function that computes modes, and returns `_Modes`."""

    def run(laplacian, chosen, progress):
        pulse, areas = _pulse(laplacian, chosen, progress), laplacian.areas
        spectrum = cache.lowest_modes(laplacian, count, progress)
        shares = (areas * pulse) @ spectrum.eigenvectors
        held = float(np.sum(shares**2) / np.sum(areas * pulse**2))
        distance = _reach(kind, laplacian, chosen)
        if kind == "WAVE":
            formula = "COSINE", distance * np.sqrt(spectrum.eigenvalues)
        else:
            formula = "EXPONENT", -0.25 * distance * distance * spectrum.eigenvalues
        formula = Formula(*formula, shares * spectrum.eigenvectors)
        first = formula.at(0.0)
        return _Modes(formula, first.min(), first.max(), held, distance)

    return run


def _reach(kind, laplacian, chosen):
    """Return how far heat spreads, or waves run, within all frames."""
    return chosen.distance or {"HEAT": 0.5, "WAVE": 1.0}[kind] * _size(laplacian)


def _size(laplacian):
    known = laplacian.component >= 0
    return float(np.linalg.norm(np.ptp(laplacian.points[known], axis=0)))


def _width(laplacian, chosen):
    return chosen.width or _WIDTH * float(np.median(laplacian.smoothing_lengths))


def _find_touched(laplacian, chosen):
    """Return the settings with the points that are touched: the nearest ones of places that are not too far off."""
    points, reach, touched = laplacian.points, _width(laplacian, chosen), []
    for places in chosen.places:
        rows = core.geometry.nearest_rows(points, places)
        near = np.linalg.norm(points[rows] - places, axis=1) <= reach
        mask = np.zeros(len(points), dtype=bool)
        mask[rows[near]] = True
        touched.append(mask & (laplacian.component >= 0))
    union = np.any(touched, axis=0)
    if not union.any():
        raise PointCloudError(
            f"The Touching Object comes within {length_text(reach)} of no point in any frame. Move it nearer, or raise"
            " Width."
        )
    return chosen._replace(sources=union, touched=touched)


def _pulse(laplacian, chosen, progress):
    """Return 1 at the sources, and less around them: a single point alone would be less than the points resolve."""
    return _pulse_at(laplacian, chosen, chosen.sources, progress)


def _pulse_at(laplacian, chosen, rows, progress):
    width = _width(laplacian, chosen)
    away = cache.geodesics(laplacian, progress).distance(rows, limit=_FAR * width, progress=progress)
    return np.exp(-((away / width) ** 2))


def _start_at(number, laplacian, chosen, progress):
    """Return the pulse that starts at a frame: of the sources at the first one, of what is touched at each."""
    if chosen.touched is None:
        return _pulse(laplacian, chosen, progress) if number == 0 else None
    rows = chosen.touched[number] if number < len(chosen.touched) else np.zeros(1, dtype=bool)
    return _pulse_at(laplacian, chosen, rows, progress) if rows.any() else None


def _heat(laplacian, chosen, progress):
    """Return the frames of heat, without end, and how far it spreads."""
    distance = _reach("HEAT", laplacian, chosen)
    heat = core.Heat(laplacian, 0.25 * distance * distance * chosen.share, progress=progress)

    def begin(state, number):
        pulse = _start_at(number, laplacian, chosen, progress)
        return state if pulse is None else np.maximum(state, pulse)

    return _advance(heat, np.zeros(len(laplacian.points)), begin, lambda state: state), distance


def _wave(laplacian, chosen, progress):
    """Return the frames of a wave, without end, and how far it runs."""
    distance = _reach("WAVE", laplacian, chosen)
    wave = core.Wave(laplacian, chosen.share, distance, progress=progress)

    def begin(state, number):
        pulse = _start_at(number, laplacian, chosen, progress)
        return state if pulse is None else (np.maximum(state[0], pulse), state[1])

    nothing = np.zeros(len(laplacian.points))
    return _advance(wave, (nothing, nothing), begin, lambda state: state[0]), distance


def _reaction(laplacian, chosen, progress):
    """Return the frames of what grows in a reaction, without end, and the size of the pattern."""
    known = laplacian.component >= 0
    resolved = _SPOT * float(np.median(laplacian.smoothing_lengths[known]))
    automatic = max(resolved, math.sqrt(float(laplacian.areas[known].sum())) / _ACROSS)
    size, time = chosen.distance or automatic, _PATTERN_TIME * chosen.share
    steps = math.ceil(time / _LONGEST)
    kind = core.ReactionDiffusion
    reaction = kind.of_pattern(laplacian, time / steps, chosen.pattern, size, progress=progress)
    chosen = chosen._replace(width=_SEED * size)  # a single point would fade before it reacts

    def begin(state, number):
        pulse = _start_at(number, laplacian, chosen, progress)
        if pulse is None:
            return state
        inside = pulse > _EDGE
        return np.where(inside, 0.0, state[0]), np.where(inside, 1.0, state[1])

    start = np.ones(len(laplacian.points)), np.zeros(len(laplacian.points))
    return _advance(reaction, start, begin, lambda state: state[1], steps), size


def _advance(motion, state, begin, part, steps=1):
    """Yield a part of the state at each frame, after what begins there."""
    number = 0
    while True:
        state = begin(state, number)
        yield part(state)
        for _ in range(steps):
            state = motion.advance(state)
        number += 1


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


def _home(folder) -> Path:
    """Return the folder of frames: a temporary one for a file that is not saved yet."""
    if folder.startswith("//") and not bpy.data.filepath:
        folder = ""
    return Path(bpy.path.abspath(folder) if folder else bpy.app.tempdir)


def _new_path(obj, folder) -> Path:
    """Return a new path for the frames of an object."""
    return _home(folder) / f"{_stem(obj)}-{uuid.uuid4().hex[:8]}.npy"


def _lock_range(settings, kind, motion):
    """Show all frames in one range of colors: that of the last ones, which waves and reactions grow or fade to."""
    settings.range_mode = "LOCKED"
    settings.range_low, settings.range_high = (-motion.last, motion.last) if kind == "WAVE" else (0.0, motion.last)
    if kind == "WAVE" and settings.color_map == "AUTO":
        settings.color_map = "COOL_WARM"


def _as_kept(path, folder) -> str:
    """Return a path as it is kept: relative where the folder is."""
    relative = folder.startswith("//") and bpy.data.filepath
    return bpy.path.relpath(str(path)) if relative else str(path)


def _stem(obj):
    return bpy.path.clean_name(obj.name)


def _remove_old(obj, before, folder):
    """Remove the earlier frames of an object where the new ones would be, if no other object plays them."""
    old = Path(bpy.path.abspath(before))
    used = any(other.meshfree.motion_file == before for other in bpy.data.objects)
    if before and not used and old.parent == _home(folder) and old.match(f"{_stem(obj)}-????????.npy"):
        close_frames()  # Windows removes no open file
        old.unlink(missing_ok=True)


class MESHFREE_OT_simulate(Simulate, ShownOperator, bpy.types.Operator):
    """Simulate heat, waves, patterns or a front along the surface, to be played with the frames of the scene"""

    bl_idname = "meshfree.simulate"
    bl_label = "Simulate Along Surface"

    def conclude(self, context, objects):
        super().conclude(context, objects)
        forget_groups()


TOOLS = (Registration(MESHFREE_OT_simulate, panel=Row("Simulate", 1, 1), menu=Row("Object", 6, 3), verb=Simulate),)
