"""Spectral smoothing and enhancement of shapes, and deformation by a vibration mode."""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ... import core
from ...command.results import check_wavelength
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

_HEAT, _DETAIL = 9.0, 18.0  # default wavelengths in smoothing lengths: those of details of some points
_READY = 20  # modes computed at least, so that Adjust Last Operation can step through them
_FINEST = 8.0  # details finer than the wavelength by this factor count as noise, which is not amplified


class Smooth(Tool):
    """The settings and the work of `meshfree.smooth`."""

    at_zero = {"wavelength": "Automatic"}

    method: EnumProperty(
        name="Method",
        description="What is smoothed, and how",
        items=[
            ("EDGES", "Keep Edges", "Remove noise along the normals, and keep edges"),
            ("NOISE", "Remove Noise", "Remove the noise of single points and keep the shape, by frequency"),
            ("HEAT", "Soften", "Attenuate details as heat diffusion does, the finer the more"),
            ("MODES", "Keep Modes", "Project the shape onto the lowest vibration modes"),
            ("DETAIL", "Scale Details", "Make details stronger or weaker and keep the coarse shape"),
        ],
        default="EDGES",
    )
    wavelength: FloatProperty(
        name="Wavelength",
        description="Wavelength that is halved, or the longest one that is scaled; 0 for a default suited to the"
        " points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    modes: IntProperty(
        name="Modes", description="How many modes are kept, the constant one included", default=100, min=4, soft_max=500
    )
    gain: FloatProperty(name="Gain", description="How much stronger details become", default=1.5, min=0.0, soft_max=3.0)
    strength: FloatProperty(
        name="Strength",
        description="Factor of the displacements to the smooth positions",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    group: StringProperty(
        name="Vertex Group", description="Smooth the points of this group only, by their weights; empty for all points"
    )
    keep: EnumProperty(
        name="Keep",
        description="Scale the result so that it keeps its size",
        items=[
            ("NONE", "Nothing", "Let the shape shrink"),
            ("AREA", "Area", "Keep the area of each component"),
            ("VOLUME", "Volume", "Keep the volume of each component; for closed surfaces"),
        ],
        default="NONE",
    )
    keep_boundary: BoolProperty(name="Keep Boundary", description="Leave the boundary where it is", default=True)
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
        method, modes, gain, wavelength = self.method, self.modes, self.gain, self.wavelength
        shared = {"strength": self.strength, "mask": mask, "keep": self.keep.lower() if self.keep != "NONE" else None}
        keep_boundary, name, splats = self.keep_boundary, obj.name, has_splats(obj.data)
        find_discs = disc_finder(obj, reading)

        def compute(progress):
            laplacian = operator(progress)
            points, full = smoothed(laplacian, progress)
            gradients = core.deformation_gradients(laplacian, points) if splats else None
            return reading, points, gradients, find_discs(full, points)

        def smoothed(laplacian, progress):
            """Return the points, and those at full strength."""
            dirichlet = keep_boundary and bool(laplacian.boundary.any())
            if dirichlet and shared["keep"]:
                raise PointCloudError(
                    f'"{name}" has a boundary, which determines the size already. Set Keep to Nothing, or turn off'
                    " Keep Boundary."
                )
            check_wavelength(wavelength, reading.points, name)
            blend = core.PointBlend(laplacian, dirichlet=dirichlet, **shared)
            settings = (
                method,
                dirichlet,
                modes if method == "MODES" else wavelength,
                gain if method == "DETAIL" else 0,
            )

            def filtered():
                return cache.result(
                    laplacian,
                    "smooth",
                    *settings,
                    compute=lambda: _smooth(laplacian, method, dirichlet, modes, wavelength, gain, progress),
                )

            if not shared["keep"]:
                return blend(filtered()), filtered()

            def scaled():
                places = filtered()
                progress("Size", 0.9)
                return blend(places)

            return cache.result(laplacian, "scaled", *settings, *shared.values(), compute=scaled), filtered()

        return compute

    def write(self, context, obj, result):
        reading, points, gradients, discs = result
        write_positions(obj, reading, points, self.target, "Smooth", gradients, discs)
        moved = np.linalg.norm(points - reading.points, axis=1)
        average, most = length_text(np.sqrt(np.mean(moved**2))), length_text(moved.max())
        return [f"{obj.name}: {len(points):,} points moved by {average} on average, at most by {most}"]


class MESHFREE_OT_smooth(Smooth, ApplicationOperator, bpy.types.Operator):
    """Smooth the shape of the points: remove noise, soften details, keep a few modes, or strengthen details"""

    bl_idname = "meshfree.smooth"
    bl_label = "Smooth Points"
    keeps_line = True


def _smooth(laplacian, method, dirichlet, modes, wavelength, gain, progress):
    """Return the points, (n, 3), by a method at full strength."""
    if method == "EDGES":
        return core.clean_points(laplacian, dirichlet=dirichlet, progress=progress)
    base = cache.result(
        laplacian,
        "base",
        dirichlet,
        compute=lambda: core.smoothing_base(laplacian, dirichlet=dirichlet, progress=progress),
    )
    settings = {"dirichlet": dirichlet, "progress": progress, "base": base}
    length = np.median(laplacian.smoothing_lengths)
    if method == "NOISE":
        return core.fair_points(laplacian, (wavelength / (2.0 * np.pi)) ** 2 if wavelength else None, **settings)
    if method == "MODES":
        spectrum = cache.lowest_modes(laplacian, modes, progress, dirichlet, raw=True)
        return core.smooth_points(laplacian, modes, spectrum, **settings)
    if method == "HEAT":
        squared = ((wavelength or _HEAT * length) / (2.0 * np.pi)) ** 2
        return core.smooth_points(laplacian, core.exponential(np.log(2.0) * squared), **settings)
    low = (2.0 * np.pi / (wavelength or _DETAIL * length)) ** 2
    return core.smooth_points(laplacian, core.boost(gain, low, _FINEST**2 * low), **settings)


class ModeShape(Tool):
    """The settings and the work of `meshfree.mode_shape`."""

    adjustable = ("mode", "amplitude", "phase", "animate", "period", "target")
    at_zero = {"amplitude": "Automatic"}

    mode: IntProperty(
        name="Mode", description="Number of the mode; 1 is the constant one", default=2, min=1, soft_max=100
    )
    amplitude: FloatProperty(
        name="Amplitude",
        description="Largest displacement; 0 for a tenth of the object's radius",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    phase: FloatProperty(
        name="Phase",
        description="Angle of the vibration: 0 is full displacement, 180 degrees the opposite one",
        default=0.0,
        subtype="ANGLE",
    )
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
        mode, amplitude, phase = self.mode, self.amplitude or None, self.phase
        repeated, carried = self.is_repeated(context), carries(obj) and not self.animate

        def compute(progress):
            laplacian = operator(progress)
            number = mode
            if repeated and cache.known_modes(laplacian):
                number = min(mode, cache.known_modes(laplacian))
            else:
                several = max(mode, min(_READY, len(reading.points) // 3))
                cache.lowest_modes(laplacian, several, progress, raw=True)
            vector = cache.lowest_modes(laplacian, number, progress).eigenvectors[:, number - 1]
            points = core.displace_by_mode(laplacian, vector, amplitude, phase=phase)
            return reading, points, number, core.deformation_gradients(laplacian, points) if carried else None

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
        largest = np.linalg.norm(points - reading.points, axis=1).max()
        again = f"Only {mode} modes are computed: this is the last. Start Deform by Mode again for more."
        line = f"{obj.name}: moved by mode {mode}, at most by {length_text(largest)}"
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
        verb=Smooth,
    ),
    Registration(MESHFREE_OT_mode_shape, panel=Row("Spectrum", 1, 1), menu=Row("Object", 4, 2), verb=ModeShape),
)
