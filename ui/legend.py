"""A legend for renders: the colours on show, their values and a title, fixed in front of a camera."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core import PointCloudError
from ..operators.registration import Registration, Row
from ..operators.running.ready import ReadyOperator, reporting
from .canvas import PLATE_CORNERS
from .colormaps import to_linear
from .display import shown_attribute
from .materials import new_tree
from .plots import HEIGHT, legend_picture
from .scale import shown_scale

NAME = "Mesh-Free Legend"  # of new data; found by the properties below, whatever its name
_OF = "meshfree_legend_of"  # custom property of the collection: the object whose colours it explains
_TITLE = "meshfree_legend_title"  # custom property of the collection: the default title, the name of the attribute
_PART = "meshfree_legend_part"  # custom property of an object in it: its part of the legend
_FONT = "meshfree_legend_font"  # custom property of the font of its texts
_BUILT_IN = "<builtin>"  # file path of the default font, whose 1 looks like I
_COLOR = "legend_color"  # attribute of the parts
_HEIGHT, _GAP = 0.7, 0.03  # of the plate, and to the right edge, as shares of the picture's shorter side
_WIDTH, _EDGE, _FONT_SIZE = 100.0, 6.0, 13.8  # of the plate, its margin, and the texts, in its own units


def make_legend(scene, obj, camera, title: str = ""):
    """Add a legend of an object's display at the right edge of the picture, in place of the scene's earlier one.

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
        scene.collection.children.unlink(collection)  # kept by the other scene
        collection = None
    if collection is None:
        collection = bpy.data.collections.new(NAME)
        scene.collection.children.link(collection)
    collection[_OF] = obj
    _fill(collection, scene, obj, camera, title)
    return collection


def find_legend(scene, obj):
    """Return the collection with the legend of an object in a scene, or None without objects in it."""
    return next((item for item in _legends(scene) if item[_OF] == obj and item.objects), None)


def renew(obj):
    """Update the legends of an object."""
    for scene in bpy.data.scenes:
        legend = find_legend(scene, obj)
        if legend is None:
            continue
        legend.hide_viewport = legend.hide_render = shown_scale(obj, scene) is None  # such as for colors of its own
        camera = next((part.parent for part in legend.objects if part.parent is not None), scene.camera)
        if camera is not None and camera.type == "CAMERA" and not legend.hide_render:
            _fill(legend, scene, obj, camera, written_title(legend))


def written_title(legend) -> str:
    """Return a custom title, from the operator or the text object; empty if it is the attribute's name."""
    title = next((part.data.body for part in legend.objects if part.get(_PART) == "title" and part.type == "FONT"), "")
    return title if title != legend.get(_TITLE) else ""


def remove_legend(scene, legend):
    """Remove a legend from a scene, with its data unless another scene has it."""
    if _is_shared(legend, scene):
        scene.collection.children.unlink(legend)
        return
    _remove(list(legend.objects))
    bpy.data.collections.remove(legend)
    fonts = [font for font in bpy.data.fonts if _FONT in font]
    used = bpy.data.user_map(subset=fonts)  # users of loaded fonts are one too many
    bpy.data.batch_remove([font for font in fonts if not used[font]])


class MESHFREE_OT_legend(ReadyOperator, bpy.types.Operator):
    """Put a legend in front of the camera, which renders show; it follows the colors"""

    bl_idname = "meshfree.legend"
    bl_label = "Legend in Renders"
    works_in = ("OBJECT", "EDIT")

    show: BoolProperty(name="Show", description="Add the legend; otherwise remove it", default=True)
    title: StringProperty(
        name="Title",
        description="Text above the colors, whatever is shown; empty for the name of the attribute",
        options={"SKIP_SAVE"},
    )

    @reporting
    def execute(self, context):
        obj, scene = context.object, context.scene
        if not self.show:
            legend = find_legend(scene, obj)
            if legend is None:
                raise PointCloudError(f'There is no legend of "{obj.name}" in this scene to remove.')
            remove_legend(scene, legend)
            return {"FINISHED"}
        if scene.camera is None:
            raise PointCloudError("The scene has no camera to put a legend in front of. Add one with Add > Camera.")
        if shown_scale(obj, scene) is None:
            what = "its own colors, which are not values" if shown_attribute(obj) else "no colors yet"
            raise PointCloudError(f'"{obj.name}" shows {what}. Choose what to see under Show first.')
        make_legend(scene, obj, scene.camera, self.title)
        return {"FINISHED"}


def _legends(scene):
    """Return the editable legends in a scene: one, unless it was copied."""
    return (item for item in scene.collection.children_recursive if _OF in item and item.is_editable)


def _is_shared(legend, scene):
    """Whether another scene, such as a linked copy, has the same legend, and this one can unlink it.

    It cannot if the legend is in a collection that both scenes share.
    """
    if legend.name not in scene.collection.children:
        return False
    return any(legend in other.collection.children_recursive for other in bpy.data.scenes if other != scene)


def _fill(collection, scene, obj, camera, title):
    """Update a legend, laid out as over the view, on its objects.

    Missing objects are added, and superfluous ones removed.
    """
    scale = shown_scale(obj, scene)
    collection[_TITLE] = scale.title
    picture = legend_picture(scale._replace(title=title or scale.title), _WIDTH)
    known = {}
    for part in collection.objects:
        if _PART in part and part.type == ("MESH" if part[_PART] == "colors" else "FONT"):
            known.setdefault(part[_PART], part)
    surplus = [part for part in collection.objects if _PART in part and part not in known.values()]
    _remove(surplus + [known.pop(name) for name in known.keys() - {"colors", *(text.part for text in picture.texts)}])
    unit, place = _frame(scene, camera, picture)
    mesh = _part(collection, known, camera, "colors").data
    mesh.clear_geometry()
    corners = range(0, len(picture.places), 3)
    mesh.from_pydata(
        [place(x, y, depth=1.0 if index >= PLATE_CORNERS else 1.01) for index, (x, y) in enumerate(picture.places)],
        [],
        [(corner, corner + 1, corner + 2) for corner in corners],
    )
    colors = mesh.attributes.new(_COLOR, "FLOAT_COLOR", "POINT")
    colors.data.foreach_set("color", [value for color in picture.colors for value in to_linear(color)])
    mesh.update()
    for text in picture.texts:
        part = _part(collection, known, camera, text.part)
        room = picture.width - _EDGE - text.x
        size = min(_FONT_SIZE, room / (0.5 * len(text.text)))
        part.data.body, part.data.size, part.location = text.text, unit * size, place(text.x, text.y)
        if part.data.font.filepath == _BUILT_IN:
            part.data.font = _font() or part.data.font


def _frame(scene, camera, picture):
    """Lay a picture out at the right edge of a camera's view; return its unit, and a function that places its points.

    They lie close in front of the camera, where the depth is 1.
    """
    near = 1.5 * camera.data.clip_start
    corners = camera.data.view_frame(scene=scene)
    scale = 1.0 if camera.data.type == "ORTHO" else near / -corners[0].z
    right, top = (scale * max(corner[axis] for corner in corners) for axis in (0, 1))
    left, bottom = (scale * min(corner[axis] for corner in corners) for axis in (0, 1))
    side = min(right - left, top - bottom)
    unit = _HEIGHT * side / max(picture.height, HEIGHT)
    first_x, first_y = right - _GAP * side - unit * picture.width, 0.5 * (bottom + top - unit * picture.height)

    def place(x, y, depth=1.0):
        return depth * (first_x + unit * x), depth * (first_y + unit * y), -depth * near

    return unit, place


def _part(collection, known, camera, name):
    """Return the object that is a part of a legend, as a child of the camera."""
    part = known.get(name) or _new_part(collection, name)
    if part.data.users > 1:  # shared with a copy of the legend
        part.data = part.data.copy()
    if part.parent != camera:
        part.parent = camera
    return part


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


def _font():
    """Return the font of Blender's interface, packed for other machines; None if Blender does not have it."""
    known = next((font for font in bpy.data.fonts if _FONT in font), None)
    path = Path(bpy.utils.system_resource("DATAFILES", path="fonts")) / "Inter.woff2"
    if known is not None or not path.is_file():
        return known
    font = bpy.data.fonts.load(str(path))
    font.pack()
    font[_FONT] = True
    return font


def _remove(parts):
    """Remove objects with their data, unless others use these."""
    bpy.data.batch_remove([*parts, *{part.data for part in parts if part.data is not None and part.data.users == 1}])


def _material(name, attribute):
    """Return a material that emits the colours of an attribute, or white."""
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    tree = new_tree(material)
    source = tree.node("ShaderNodeAttribute", attribute_name=attribute) if attribute else (1.0, 1.0, 1.0, 1.0)
    tree.output("ShaderNodeOutputMaterial", tree.node("ShaderNodeEmission", source))
    return material


TOOLS = (Registration(MESHFREE_OT_legend, menu=Row("Object", 1, 8)),)
