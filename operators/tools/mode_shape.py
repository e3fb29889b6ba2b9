"""Deform by Mode: a vibration that is keyframed."""

from bpy.props import BoolProperty, IntProperty

from ...core import PointCloudError
from ...tools import mode_shape
from ..objects.animation import curves
from ..objects.carried import carries
from .declared import registration_of


class Animated:
    """What Blender adds to the tool: keyframes of a shape key."""

    animate: BoolProperty(
        name="Animate", description="Keyframe the shape key as a vibration over the frames of the scene", default=False
    )
    period: IntProperty(name="Period", description="Frames of one vibration", default=48, min=4, soft_max=250)

    @property
    def asks(self):
        return "mode", "amplitude", "phase", "animate", "period" if self.animate else "target"

    @property
    def adjustable(self):
        return "mode", "amplitude", "phase", "animate", "period", "target"

    @property
    def goal(self):
        return "SHAPE_KEY" if self.animate else self.target

    def carries(self, obj):
        return carries(obj) and not self.animate

    def plan(self, context, obj):
        if self.animate and obj.type != "MESH":
            raise PointCloudError(
                f'"{obj.name}" is a Point Cloud, which has no shape keys to animate. Turn off Animate, or'
                " convert it with Object > Convert > Mesh."
            )
        return super().plan(context, obj)

    def put(self, context, key):
        if not self.animate:
            return
        key.slider_min = -1.0
        scene, quarter = context.scene, 0.25 * self.period
        for index in range(int((scene.frame_end - scene.frame_start) / quarter) + 2):
            key.value = (1.0, 0.0, -1.0, 0.0)[index % 4]
            key.keyframe_insert("value", frame=scene.frame_start + index * quarter)
        key.value = _animated_value(key, scene.frame_current_final)  # else unchanged until the next frame


def _animated_value(key, frame):
    """Return the value that its keyframes give a shape key at a frame."""
    return curves(key.id_data).find(key.path_from_id("value")).evaluate(frame)


TOOLS = (registration_of(mode_shape.TOOL, Animated),)
