"""A legend for renders: the colours on show, their values and a title, fixed in front of a camera."""

import bpy
from bpy.props import BoolProperty

from ..core import PointCloudError
from ..operators.ready import ReadyOperator
from ..operators.translation import translated
from .display import shown_attribute
from .nodes import add_node, new_tree
from .scale import shown_scale

NAME = "Mesh-Free Legend"
_OF = "meshfree_legend_of"  # custom property of the collection: the object whose colours it explains
_STEPS = 64  # of the bar's colours
_FEWEST = 6  # boxes that fill the plate
_COLOR = "legend_color"  # attribute of the parts
_WHITE = (1.0, 1.0, 1.0, 1.0)


def make_legend(scene, obj, camera, title: str = ""):
    """Put a legend of what an object shows at the right edge of the picture, in place of an earlier one.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its render resolution gives the shape of the picture, its units those of the numbers.
    obj : bpy.types.Object
        An object with a display, as `meshfree.colormap` makes it.
    camera : bpy.types.Object
        The legend becomes its child, close in front of it.
    title : str
        Text above the colours; empty for the name of the attribute, and its unit below.

    Returns
    -------
    bpy.types.Collection
        The legend's objects.
    """
    scale = shown_scale(obj, scene)
    legend = _Legend(scene, camera)
    legend.collection[_OF] = obj
    legend.rectangle((0.0, 0.0, 1.0, 1.0), [(0.01, 0.01, 0.01, 1.0)] * 2, depth=1.01)
    legend.text(title or scale.title, 0.08, 0.94, width=0.84)
    low, high, bottom, top = 0.1, 0.32, 0.05, 0.86
    if scale.unit and not title:
        legend.text(scale.unit, 0.08, 0.88, width=0.3)
        top = 0.81
    if scale.boxes:
        height = (top - bottom) / max(len(scale.boxes), _FEWEST)
        for index, (name, color) in enumerate(scale.boxes.items()):
            y = top - (index + 1) * height
            if color[3]:
                legend.rectangle((low, y, high, y + 0.85 * height), [color] * 2)
            legend.text(name, high + 0.1, y + 0.42 * height)
        return legend.collection
    legend.rectangle((low, bottom, high, top), [_between(scale.colors, step / _STEPS) for step in range(_STEPS + 1)])
    for share, text in scale.ticks:
        y = bottom + share * (top - bottom)
        legend.rectangle((high, y - 0.002, high + 0.05, y + 0.002), [_WHITE] * 2)
        legend.text(text, high + 0.1, y)
    return legend.collection


def find_legend(scene, obj):
    """Return the collection with the legend of an object in a scene, or None."""
    return next((item for item in scene.collection.children if item.get(_OF) == obj), None)


def renew(obj):
    """Let the legend of an object, where there is one, say what the object shows now."""
    for scene in bpy.data.scenes:
        legend = find_legend(scene, obj)
        if legend is None:
            continue
        camera = next((part.parent for part in legend.objects if part.parent is not None), scene.camera)
        if camera is not None and camera.type == "CAMERA" and shown_attribute(obj):
            make_legend(scene, obj, camera)


def remove_legend(legend):
    """Remove a legend and all that belongs to it."""
    _remove_parts(legend)
    bpy.data.collections.remove(legend)


class MESHFREE_OT_legend(ReadyOperator, bpy.types.Operator):
    """Put a legend in front of the camera, which renders show; it follows the colors"""

    bl_idname = "meshfree.legend"
    bl_label = "Legend in Renders"
    works_in = ("OBJECT", "EDIT")

    show: BoolProperty(name="Show", description="Put the legend there; otherwise take it away", default=True)

    def execute(self, context):
        obj, scene = context.object, context.scene
        try:
            if not self.show:
                legend = find_legend(scene, obj)
                if legend is None:
                    raise PointCloudError(
                        'There is no legend of "{object}" in this scene to take away.', object=obj.name
                    )
                remove_legend(legend)
                return {"FINISHED"}
            if scene.camera is None:
                raise PointCloudError("The scene has no camera to put a legend in front of. Add one with Add > Camera.")
            if not shown_attribute(obj):
                raise PointCloudError(
                    '"{object}" shows no colors yet. Choose what to see under Display first.', object=obj.name
                )
        except PointCloudError as error:
            self.report({"ERROR"}, translated(error))
            return {"CANCELLED"}
        make_legend(scene, obj, scene.camera)
        return {"FINISHED"}


def _between(colors, share):
    """Return the colour at a share of the way through even samples."""
    place = share * (len(colors) - 1)
    index = min(int(place), len(colors) - 2)
    part = place - index
    return tuple((1.0 - part) * a + part * b for a, b in zip(colors[index], colors[index + 1], strict=True))


class _Legend:
    """A plate in front of a camera; places on it are given from 0 to 1, from the lower left corner."""

    def __init__(self, scene, camera):
        self.collection = _empty_collection(scene)
        self._camera = camera
        self._depth = 1.5 * camera.data.clip_start
        corners = camera.data.view_frame(scene=scene)
        scale = 1.0 if camera.data.type == "ORTHO" else self._depth / -corners[0].z
        right, top = (scale * max(corner[axis] for corner in corners) for axis in (0, 1))
        left, bottom = (scale * min(corner[axis] for corner in corners) for axis in (0, 1))
        unit = min(right - left, top - bottom)
        self._size = (0.3 * unit, 0.7 * unit)
        self._corner = (right - 0.33 * unit, 0.5 * (bottom + top) - 0.35 * unit)

    def rectangle(self, box, colors, depth=1.0):
        """Add a rectangle (left, bottom, right, top) with colours from its bottom to its top."""
        left, bottom, right, top = box
        steps = len(colors) - 1
        rows = [bottom + (top - bottom) * index / steps for index in range(len(colors))]
        mesh = bpy.data.meshes.new(NAME)
        mesh.from_pydata(
            [self._place(x, y, depth) for y in rows for x in (left, right)],
            [],
            [(2 * index, 2 * index + 1, 2 * index + 3, 2 * index + 2) for index in range(steps)],
        )
        attribute = mesh.attributes.new(_COLOR, "FLOAT_COLOR", "POINT")
        attribute.data.foreach_set("color", [value for color in colors for _ in (0, 1) for value in color])
        self._add(mesh, _material(f"{NAME} Colors", _COLOR))

    def text(self, text, x, y, width=0.5):
        """Add white text, centred in height, small enough to end within a width."""
        curve = bpy.data.curves.new(NAME, "FONT")
        curve.body = text
        curve.align_y = "CENTER"
        curve.size = min(0.06 * self._size[1], width * self._size[0] / (0.5 * len(text)))
        self._add(curve, _material(f"{NAME} Text", "")).location = self._place(x, y)

    def _place(self, x, y, depth=1.0):
        return (
            depth * (self._corner[0] + x * self._size[0]),
            depth * (self._corner[1] + y * self._size[1]),
            -depth * self._depth,
        )

    def _add(self, data, material):
        obj = bpy.data.objects.new(NAME, data)
        data.materials.append(material)
        obj.parent = self._camera
        obj.hide_select = True
        obj.visible_shadow = obj.visible_diffuse = obj.visible_glossy = obj.visible_transmission = False
        self.collection.objects.link(obj)
        return obj


def _empty_collection(scene):
    collection = bpy.data.collections.get(NAME)
    if collection is None:
        collection = bpy.data.collections.new(NAME)
    if NAME not in scene.collection.children:
        scene.collection.children.link(collection)
    _remove_parts(collection)
    return collection


def _remove_parts(collection):
    parts = list(collection.objects)
    bpy.data.batch_remove([*parts, *(part.data for part in parts)])


def _material(name, attribute):
    """Return a material that shines in the colours of an attribute, or in white."""
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    tree = new_tree(material)
    emission = add_node(tree, "ShaderNodeEmission", 1, 0)
    emission.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    output = add_node(tree, "ShaderNodeOutputMaterial", 2, 0)
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    if attribute:
        source = add_node(tree, "ShaderNodeAttribute", 0, 0, attribute_name=attribute)
        tree.links.new(source.outputs["Color"], emission.inputs["Color"])
    return material


CLASSES = (MESHFREE_OT_legend,)
