"""A legend for renders: the colours on show, their values and a title, fixed in front of a camera."""

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core import PointCloudError
from ..operators.running.ready import ReadyOperator
from .display import shown_attribute
from .nodes import add_node, new_tree
from .scale import shown_scale

NAME = "Mesh-Free Legend"  # of what is made; found by the marks below, whatever it is called since
_OF = "meshfree_legend_of"  # custom property of the collection: the object whose colours it explains
_TITLE = "meshfree_legend_title"  # another one: the name of the attribute, which is the title unless somebody wrote one
_PART = "meshfree_legend_part"  # custom property of an object in it: what part of the legend it is
_STEPS = 64  # of the bar's colours
_FEWEST = 6  # boxes that fill the plate
_COLOR = "legend_color"  # attribute of the parts
_WHITE = (1.0, 1.0, 1.0, 1.0)
_BLACK = (0.01, 0.01, 0.01, 1.0)


def make_legend(scene, obj, camera, title: str = ""):
    """Put a legend of what an object shows at the right edge of the picture, in place of the scene's earlier one.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its render resolution gives the shape of the picture, its units those of the numbers.
    obj : bpy.types.Object
        An object with a display, as `meshfree.colormap` makes it.
    camera : bpy.types.Object
        The legend becomes its child, close in front of it.
    title : str
        Text above the colours, which stays when others are shown; empty for the name of the attribute.

    Returns
    -------
    bpy.types.Collection
        The legend's objects.
    """
    collection = next(_legends(scene), None)
    if collection is not None and _is_shared(collection, scene):
        scene.collection.children.unlink(collection)  # the other scene keeps it
        collection = None
    if collection is None:
        collection = bpy.data.collections.new(NAME)
        scene.collection.children.link(collection)
    collection[_OF] = obj
    _fill(collection, scene, obj, camera, title)
    return collection


def find_legend(scene, obj):
    """Return the collection with the legend of an object in a scene, or None; one whose objects are gone is none."""
    return next((item for item in _legends(scene) if item[_OF] == obj and item.objects), None)


def renew(obj):
    """Let the legends of an object, where there are any, say what the object shows now."""
    for scene in bpy.data.scenes:
        legend = find_legend(scene, obj)
        if legend is None:
            continue
        camera = next((part.parent for part in legend.objects if part.parent is not None), scene.camera)
        if camera is not None and camera.type == "CAMERA" and shown_attribute(obj):
            _fill(legend, scene, obj, camera, written_title(legend))


def written_title(legend) -> str:
    """Return the title that somebody wrote, here or into the text object; empty if it is the attribute's name."""
    title = next((part.data.body for part in legend.objects if part.get(_PART) == "title" and part.type == "FONT"), "")
    return title if title != legend.get(_TITLE) else ""


def remove_legend(scene, legend):
    """Remove a legend from a scene, with all that belongs to it if no other scene has it."""
    if _is_shared(legend, scene):
        scene.collection.children.unlink(legend)
        return
    _remove(list(legend.objects))
    bpy.data.collections.remove(legend)


class MESHFREE_OT_legend(ReadyOperator, bpy.types.Operator):
    """Put a legend in front of the camera, which renders show; it follows the colors"""

    bl_idname = "meshfree.legend"
    bl_label = "Legend in Renders"
    works_in = ("OBJECT", "EDIT")

    show: BoolProperty(name="Show", description="Put the legend there; otherwise take it away", default=True)
    title: StringProperty(
        name="Title",
        description="Text above the colors, whatever is shown; empty for the name of the attribute",
        options={"SKIP_SAVE"},
    )

    def execute(self, context):
        obj, scene = context.object, context.scene
        try:
            if not self.show:
                legend = find_legend(scene, obj)
                if legend is None:
                    raise PointCloudError(f'There is no legend of "{obj.name}" in this scene to take away.')
                remove_legend(scene, legend)
                return {"FINISHED"}
            if scene.camera is None:
                raise PointCloudError("The scene has no camera to put a legend in front of. Add one with Add > Camera.")
            if not shown_attribute(obj):
                raise PointCloudError(f'"{obj.name}" shows no colors yet. Choose what to see under Display first.')
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        make_legend(scene, obj, scene.camera, self.title)
        return {"FINISHED"}


def _legends(scene):
    """All legends in a scene that can be changed: one, unless somebody has copied it."""
    return (item for item in scene.collection.children_recursive if _OF in item and item.is_editable)


def _is_shared(legend, scene):
    """Whether another scene, such as a linked copy, has the same legend, and this one can do without it alone.

    In a collection that both scenes show it belongs to both.
    """
    if legend.name not in scene.collection.children:
        return False
    return any(legend in other.collection.children_recursive for other in bpy.data.scenes if other != scene)


def _fill(collection, scene, obj, camera, title):
    """Write a legend anew, on the objects that it has."""
    scale = shown_scale(obj, scene)
    collection[_TITLE] = scale.title
    legend = _Legend(scene, camera)
    legend.rectangle((0.0, 0.0, 1.0, 1.0), [_BLACK] * 2, depth=1.01)
    legend.text("title", title or scale.title, 0.08, 0.94, width=0.84)
    low, high, bottom, top = 0.1, 0.32, 0.05, 0.86
    if scale.unit:
        legend.text("unit", scale.unit, 0.08, 0.88, width=0.3)
        top = 0.81
    height = (top - bottom) / max(len(scale.boxes), _FEWEST)
    for index, (name, color) in enumerate(scale.boxes.items()):
        y = top - (index + 1) * height
        if color[3]:
            legend.rectangle((low, y, high, y + 0.85 * height), [color] * 2)
        legend.text(f"box {index}", name, high + 0.1, y + 0.42 * height)
    if not scale.boxes:
        bar = [_between(scale.colors, step / _STEPS) for step in range(_STEPS + 1)]
        legend.rectangle((low, bottom, high, top), bar)
    for index, (share, text) in enumerate(scale.ticks):
        y = bottom + share * (top - bottom)
        legend.rectangle((high, y - 0.002, high + 0.05, y + 0.002), [_WHITE] * 2)
        legend.text(f"tick {index}", text, high + 0.1, y)
    legend.write(collection)


def _between(colors, share):
    """Return the colour at a share of the way through even samples."""
    place = share * (len(colors) - 1)
    index = min(int(place), len(colors) - 2)
    part = place - index
    return tuple((1.0 - part) * a + part * b for a, b in zip(colors[index], colors[index + 1], strict=True))


class _Legend:
    """A plate in front of a camera; places on it are given from 0 to 1, from the lower left corner."""

    def __init__(self, scene, camera):
        self._camera = camera
        self._places, self._faces, self._colors, self._texts = [], [], [], {}
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
        steps, first = len(colors) - 1, len(self._places)
        rows = [bottom + (top - bottom) * index / steps for index in range(len(colors))]
        self._places += [self._place(x, y, depth) for y in rows for x in (left, right)]
        self._colors += [color for color in colors for _ in (0, 1)]
        corners = range(first, first + 2 * steps, 2)
        self._faces += [(corner, corner + 1, corner + 3, corner + 2) for corner in corners]

    def text(self, part, text, x, y, width=0.5):
        """Add white text, centred in height, small enough to end within a width."""
        size = min(0.06 * self._size[1], width * self._size[0] / (0.5 * len(text)))
        self._texts[part] = text, size, self._place(x, y)

    def write(self, collection):
        """Give all of it to the objects in a collection; make those that are missing, and remove those left over."""
        known = {}
        for obj in collection.objects:
            if _PART in obj and obj.type == ("MESH" if obj[_PART] == "colors" else "FONT"):
                known.setdefault(obj[_PART], obj)
        surplus = [obj for obj in collection.objects if _PART in obj and obj not in known.values()]
        _remove(surplus + [known.pop(part) for part in known.keys() - {"colors", *self._texts}])
        mesh = self._object(collection, known, "colors").data
        mesh.clear_geometry()
        mesh.from_pydata(self._places, [], self._faces)
        colors = mesh.attributes.new(_COLOR, "FLOAT_COLOR", "POINT")
        colors.data.foreach_set("color", [value for color in self._colors for value in color])
        mesh.update()
        for part, (text, size, place) in self._texts.items():
            obj = self._object(collection, known, part)
            obj.data.body, obj.data.size, obj.location = text, size, place

    def _object(self, collection, known, part):
        obj = known.get(part) or _new_part(collection, part)
        if obj.data.users > 1:  # of a copy of the legend
            obj.data = obj.data.copy()
        if obj.parent != self._camera:
            obj.parent = self._camera
        return obj

    def _place(self, x, y, depth=1.0):
        return (
            depth * (self._corner[0] + x * self._size[0]),
            depth * (self._corner[1] + y * self._size[1]),
            -depth * self._depth,
        )


def _new_part(collection, part):
    if part == "colors":
        data, material = bpy.data.meshes.new(NAME), _material(f"{NAME} Colors", _COLOR)
    else:
        data, material = bpy.data.curves.new(NAME, "FONT"), _material(f"{NAME} Text", "")
        data.align_y = "CENTER"
    data.materials.append(material)
    obj = bpy.data.objects.new(NAME, data)
    obj[_PART] = part
    obj.hide_select = True
    obj.visible_shadow = obj.visible_diffuse = obj.visible_glossy = obj.visible_transmission = False
    collection.objects.link(obj)
    return obj


def _remove(parts):
    """Remove objects and what they are made of, unless others are made of it too."""
    bpy.data.batch_remove([*parts, *{part.data for part in parts if part.data is not None and part.data.users == 1}])


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
