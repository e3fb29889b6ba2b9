"""Spectral smoothing and enhancement of shapes, and deformation by a vibration mode."""

from types import SimpleNamespace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ... import core
from ...command import smoothing
from ...core import PointCloudError
from ..objects.animation import curves
from ..objects.carried import carries
from ..objects.groups import chosen_weights
from ..objects.positions import check_movable, target_property, write_positions
from ..objects.result import length_text
from ..objects.splats import has_splats
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator, Tool, operator_reader
from ..running.discs import disc_finder

_READY = 20  # modes computed at least, so that Adjust Last Operation can step through them


class Smooth(Tool):
    """The settings and the work of `meshfree.smooth`."""

    at_zero = {"wavelength": "Automatic"}

    method: EnumProperty(
        name="Method",
        items=[
            ("EDGES", "Keep Edges", "Remove noise along the normals, and keep edges"),
            ("NOISE", "Remove Noise", "Remove the noise of single points and keep the shape, by frequency"),
            ("HEAT", "Soften", "Attenuate details as heat diffusion does, the finer the more"),
            ("MODES", "Keep Modes", "Project the shape onto the lowest vibration modes"),
            ("DETAIL", "Scale Details", "Make details stronger or weaker and keep the coarse shape"),
        ],
        **smoothing.SMOOTH["method"].keywords,
    )
    wavelength: FloatProperty(name="Wavelength", subtype="DISTANCE", **smoothing.SMOOTH["wavelength"].keywords)
    modes: IntProperty(name="Modes", soft_max=500, **smoothing.SMOOTH["modes"].keywords)
    gain: FloatProperty(name="Gain", soft_max=3.0, **smoothing.SMOOTH["gain"].keywords)
    strength: FloatProperty(name="Strength", subtype="FACTOR", **smoothing.SMOOTH["strength"].keywords)
    group: StringProperty(name="Vertex Group", **smoothing.SMOOTH["group"].keywords)
    keep: EnumProperty(
        name="Keep",
        items=[
            ("NONE", "Nothing", "Let the shape shrink"),
            ("AREA", "Area", "Keep the area of each component"),
            ("VOLUME", "Volume", "Keep the volume of each component; for closed surfaces"),
        ],
        **smoothing.SMOOTH["keep"].keywords,
    )
    keep_boundary: BoolProperty(name="Keep Boundary", **smoothing.SMOOTH["keep_boundary"].keywords)
    target: target_property()

    @property
    def asks(self):
        """Names of the settings that the method takes."""
        names = {"EDGES": [], "MODES": ["modes"], "DETAIL": ["wavelength", "gain"]}.get(self.method, ["wavelength"])
        return ["method", *names, "strength", "group", "keep", "keep_boundary", "target"]

    @property
    def adjustable(self):
        """Names of the settings that need no new solution; keeping a size needs a scale factor."""
        return ("strength", "target") if self.keep == "NONE" else ("target",)

    def plan(self, context, obj):
        check_movable(obj, self.target)
        reading, operator = operator_reader(context, obj)
        mask = chosen_weights(obj, self.group, "Vertex Group") if self.group else None
        own = SimpleNamespace(**{name: getattr(self, name) for name in smoothing.SMOOTH})
        name, splats = obj.name, has_splats(obj.data)
        find_discs = disc_finder(obj, reading)

        def compute(progress):
            laplacian = operator(progress)
            points, full = smoothing.smoothed(laplacian, own, mask, name, cache, progress)
            gradients = core.deform.deformation_gradients(laplacian, points) if splats else None
            return reading, points, gradients, find_discs(full, points)

        return compute

    def write(self, context, obj, result):
        reading, points, gradients, discs = result
        write_positions(obj, reading, points, self.target, "Smooth", gradients, discs)
        return [smoothing.smooth_line(reading.points, points, obj.name, length_text)]


class MESHFREE_OT_smooth(Smooth, ApplicationOperator, bpy.types.Operator):
    """Smooth the shape of the points: remove noise, soften details, keep a few modes, or strengthen details"""

    bl_idname = "meshfree.smooth"
    bl_label = "Smooth Points"
    keeps_line = True


class ModeShape(Tool):
    """The settings and the work of `meshfree.mode_shape`."""

    adjustable = ("mode", "amplitude", "phase", "animate", "period", "target")
    at_zero = {"amplitude": "Automatic"}

    mode: IntProperty(name="Mode", soft_max=100, **smoothing.MODE_SHAPE["mode"].keywords)
    amplitude: FloatProperty(name="Amplitude", subtype="DISTANCE", **smoothing.MODE_SHAPE["amplitude"].keywords)
    phase: FloatProperty(name="Phase", subtype="ANGLE", **smoothing.MODE_SHAPE["phase"].keywords)
    animate: BoolProperty(
        name="Animate", description="Keyframe the shape key as a vibration over the frames of the scene", default=False
    )
    period: IntProperty(name="Period", description="Frames of one vibration", default=48, min=4, soft_max=250)
    target: target_property()

    @property
    def asks(self):
        """Names of the settings; an animation needs a shape key."""
        return "mode", "amplitude", "phase", "animate", "period" if self.animate else "target"

    def plan(self, context, obj):
        target = "SHAPE_KEY" if self.animate else self.target
        if self.animate and obj.type != "MESH":
            raise PointCloudError(
                f'"{obj.name}" is a Point Cloud, which has no shape keys to animate. Turn off Animate, or'
                " convert it with Object > Convert > Mesh."
            )
        check_movable(obj, target)
        reading, operator = operator_reader(context, obj)
        mode, amplitude, phase = self.mode, self.amplitude, self.phase
        repeated, carried = self.is_repeated(context), carries(obj) and not self.animate

        def compute(progress):
            laplacian = operator(progress)
            number = mode
            if repeated and cache.known_modes(laplacian):
                number = min(mode, cache.known_modes(laplacian))
            else:
                several = max(mode, min(_READY, len(reading.points) // 3))
                cache.lowest_modes(laplacian, several, progress, raw=True)
            points = smoothing.by_mode(laplacian, number, amplitude, phase, cache, progress)
            return reading, points, number, core.deform.deformation_gradients(laplacian, points) if carried else None

        return compute

    def write(self, context, obj, result):
        reading, points, mode, gradients = result
        target = "SHAPE_KEY" if self.animate else self.target
        key = write_positions(obj, reading, points, target, f"Mode {mode}", gradients)
        if self.animate:
            key.slider_min = -1.0
            scene, quarter = context.scene, 0.25 * self.period
            for index in range(int((scene.frame_end - scene.frame_start) / quarter) + 2):
                key.value = (1.0, 0.0, -1.0, 0.0)[index % 4]
                key.keyframe_insert("value", frame=scene.frame_start + index * quarter)
            key.value = _animated_value(key, scene.frame_current_final)  # else unchanged until the next frame
        again = f"Only {mode} modes are computed: this is the last. Start Deform by Mode again for more."
        line = smoothing.mode_line(reading.points, points, mode, obj.name, length_text)
        return [again, line] if mode < self.mode else [line]


def _animated_value(key, frame):
    """Return the value that its keyframes give a shape key at a frame."""
    return curves(key.id_data).find(key.path_from_id("value")).evaluate(frame)


class MESHFREE_OT_mode_shape(ModeShape, ApplicationOperator, bpy.types.Operator):
    """Displace the points along their normals by a vibration mode, optionally animated"""

    bl_idname = "meshfree.mode_shape"
    bl_label = "Deform by Mode"


TOOLS = (
    Registration(
        MESHFREE_OT_smooth,
        panel=Row("Clean", 2, 1),
        menu=Row("Object", 4, 1),
        quick=Row("Object", 1, 1, "Clean"),
    ),
    Registration(MESHFREE_OT_mode_shape, panel=Row("Spectrum", 1, 1), menu=Row("Object", 4, 2)),
)
