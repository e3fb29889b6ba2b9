"""The materials that show values: as colours of a map, directions, checks, groups, splats, and strokes."""

import bpy
import numpy as np

from ..operators.objects.attributes import DISC, RISE
from ..operators.objects.node_trees import TreeBuilder
from . import colormaps
from .nodes import DEVIATIONS, OPACITY, TINT
from .value_range import STEPPED

ATTRIBUTE, RANGE, COLORS = "Attribute", "Range", "Colors"  # nodes of the material that are read again
LINES, BELOW, ABOVE, GRAY = "Iso Lines", "Below", "Above", "Gray"  # and such that only get other values
BACK = "Back Side"  # another: how dark what is seen from behind is
EVEN = "Even Lines"  # another: how wide a line is by the slope
LIT = "Unlit"  # another: how much of the light is no light of the scene
FORM = "Form"  # another: how much that shows the form
_LIGHT = (-0.36, 0.36, -0.86)  # where it comes from, as the camera sees it: left, above, and behind the camera
_FALL = 3.0  # the power of that brightness
_DARKEST = 0.08  # how bright what faces away from it is
_INK = (0.012, 0.012, 0.016, 1.0)  # color of strokes
_INK_TAG = "meshfree_strokes"  # custom property of the material of strokes
_KIND = "meshfree_kind"  # custom property of the material: which nodes it has
_LINE, _DARK = 0.2, (0.02, 0.02, 0.02, 1.0)  # share of a step that a line takes, and its color
_BROADEST = 0.3  # of that, half of it, where steps are narrow
BEYOND = (0.12, 0.12, 0.12, 1.0)  # color of what lies beyond the range
DIM = 0.85  # how dark the back side becomes where it is dimmed
_PLAIN, _GRAY = "PLAIN", (0.25, 0.25, 0.25, 1.0)  # where nothing is on show but groups
_COLORED = "COLOR"  # where points have colors of their own
_CHECKERED, CHECKS = "CHECKER", 20  # along the texture
CHECKER = {"Even": (0.9, 0.82, 0.6, 1.0), "Odd": (0.02, 0.12, 0.25, 1.0)}  # colors of the checks
_SPLATTED, _CONSTANT = "SPLATS BY TINT", 0.28209479  # the harmonic of degree 0
_GAMMA = 2.2  # makes the steps of direction colours even to the eye


def stroke_material():
    """Return the material that all strokes share, which reads alike in every light."""
    for material in bpy.data.materials:
        if _INK_TAG in material and material.library is None:
            return material
    material = bpy.data.materials.new("Mesh-Free Strokes")
    material[_INK_TAG] = True
    material.diffuse_color = _INK  # in Solid
    tree = new_tree(material)
    tree.output("ShaderNodeOutputMaterial", tree.node("ShaderNodeEmission", _INK))
    return material


def color_plain(material, groups):
    """Let a material show nothing but groups, see `color_by_number`."""
    kind = f"{_PLAIN} {groups}"
    if (
        material.get(_KIND) != kind
        or material.node_tree is None
        or not {BACK, FORM, LIT} <= set(material.node_tree.nodes.keys())
    ):
        tree = new_tree(material)
        gray = tree.node("ShaderNodeRGB")
        gray.outputs[0].default_value = _GRAY
        _shine(tree, gray, groups)
        material[_KIND] = kind


def color_splats(material, mean):
    """Let a material show splats in their own colors, fading from their middles, as far as they are opaque.

    Solid, which draws no materials but by one color, shows the mean of theirs.
    """
    material.diffuse_color = mean
    if material.get(_KIND) == _SPLATTED and material.node_tree is not None:
        return
    tree = new_tree(material)
    base = tree.node("ShaderNodeAttribute", attribute_name=TINT, name="Splats").outputs  # no result on show
    opacity = tree.node("ShaderNodeAttribute", attribute_name=OPACITY, name="Opacity").outputs["Fac"]
    color = tree.vector("MULTIPLY_ADD", base["Vector"], (_CONSTANT,) * 3, (0.5,) * 3)
    linear = tree.node("ShaderNodeGamma", tree.vector("MAXIMUM", color, (0.0,) * 3), _GAMMA)  # splats are of sRGB
    # A ray that passes the middle of a ball at the share b of its radius meets it at an angle whose sine is b.
    place = tree.node("ShaderNodeNewGeometry").outputs
    facing = tree.vector("DOT_PRODUCT", place["Normal"], place["Incoming"])
    passed = tree.math("SUBTRACT", 1.0, tree.math("MULTIPLY", facing, facing))
    fading = tree.math("EXPONENT", tree.math("MULTIPLY", passed, -0.5 * DEVIATIONS**2))
    front = tree.math("SUBTRACT", 1.0, place["Backfacing"])
    alpha = tree.math("MULTIPLY", tree.math("MULTIPLY", fading, opacity), front)
    through, light = tree.node("ShaderNodeBsdfTransparent"), tree.node("ShaderNodeEmission", linear)
    tree.output("ShaderNodeOutputMaterial", tree.node("ShaderNodeMixShader", alpha, through, light))
    material[_KIND] = _SPLATTED


def shade(material, lit):
    """Let a material show the form: not at all at 0, by a light beside the camera at 0.5, by the scene's alone at 1."""
    nodes = material.node_tree.nodes
    nodes[FORM].inputs[1].default_value = min(2.0 * lit, 1.0)
    nodes[LIT].inputs[0].default_value = min(2.0 - 2.0 * lit, 1.0)


def dim_back(material, dimmed):
    """Let a material show what is seen from behind darker, such as the inside of an open scan, or alike."""
    material.node_tree.nodes[BACK].inputs[1].default_value = DIM if dimmed else 0.0


def is_plain(material) -> bool:
    """Whether a material shows nothing but groups."""
    return material.get(_KIND, "").startswith(_PLAIN)


def color_by_direction(material, name, groups):
    """Let a material show the directions of an attribute of vectors, and groups as in `color_by_number`."""
    if tree := _begin(material, name, f"DIRECTION {groups}"):
        _shine(tree, _direction_color(tree, tree.nodes[ATTRIBUTE].outputs["Vector"]), groups)


def color_by_checker(material, name, groups):
    """Let a material show texture coordinates as a checkerboard, and groups as in `color_by_number`."""
    if tree := _begin(material, name, f"{_CHECKERED} {groups}"):
        place = tree.vector("ADD", tree.nodes[ATTRIBUTE].outputs["Vector"], _rise(tree))
        # Across the planes between checks rounding would decide.
        level = tree.vector("ADD", place, (0.0, 0.0, 0.5 / CHECKS))
        _shine(tree, tree.node("ShaderNodeTexChecker", level, *CHECKER.values(), CHECKS), groups)


def color_by_own(material, name, groups):
    """Let a material show the colors that an attribute holds, and groups as in `color_by_number`."""
    if tree := _begin(material, name, f"{_COLORED} {groups}"):
        _shine(tree, tree.nodes[ATTRIBUTE], groups)


def shows_own(material) -> bool:
    """Whether a material shows colors that points have of their own."""
    return material.get(_KIND, "").startswith(_COLORED)


def _rise(tree):
    """Add the node that reads by how much what is shown rises within a disc, zero where nothing does; return that."""
    return tree.node("ShaderNodeAttribute", attribute_name=RISE, name="Rise").outputs["Vector"]


def is_checkered(material) -> bool:
    """Whether a material shows texture coordinates."""
    return material.get(_KIND, "").startswith(_CHECKERED)


def color_by_number(material, name, component, color_map, low, high, settings, groups, width=0.0):
    """Let a material show numbers as colours; only values of its nodes change where it did so before.

    Parameters
    ----------
    material : bpy.types.Material
    name : str
        The attribute.
    component : {"", "LENGTH", "X", "Y", "Z"}
        What of a vector is the number.
    color_map : str
        One of the names of `colormaps.colors`.
    low, high : float
        Range of the numbers.
    settings : MESHFREE_PG_settings
        Reverse, iso lines, and what becomes of numbers beyond the range.
    groups : dict of str to tuple
        Names of groups, whose points have these colours instead; (r, g, b, 1), linear.
    width : float
        Of iso lines in local lengths, where slopes are known.
    """
    stepped = color_map in STEPPED
    colors, hiding = colormaps.colors(color_map, settings.reverse), settings.outside == "HIDE"
    repeated = len(colors) - 1 if stepped and color_map != "TRUTH" else 0
    needed = (RANGE, COLORS, LINES, EVEN, BELOW, ABOVE, *(() if hiding else (GRAY,)))
    if tree := _begin(material, name, f"{component} {repeated} {hiding} {groups}", needed):
        _build_number_tree(tree, component, repeated, hiding, groups)
    nodes = material.node_tree.nodes
    # Of a stepped map each number is in the middle of its colour, and the last one as wide as the others.
    ends = (-1.5, len(colors) - 1.5) if repeated else (-0.5, len(colors) - 0.5) if stepped else (low, high)
    nodes[RANGE].inputs["From Min"].default_value, nodes[RANGE].inputs["From Max"].default_value = ends
    ramp = nodes[COLORS].color_ramp
    ramp.interpolation = "CONSTANT" if stepped else "LINEAR"
    _set_colors(ramp.elements, colors, last=len(colors) if stepped else len(colors) - 1)
    nodes[LINES].inputs[1].default_value = 0 if stepped else settings.iso_lines
    nodes[EVEN].inputs[1].default_value = 0 if stepped else 0.5 * width * settings.iso_lines / (high - low)
    nodes[BELOW].inputs[1].default_value = low - 0.5 if stepped else low
    nodes[ABOVE].inputs[1].default_value = high + 0.5 if stepped else high
    if not hiding:
        nodes[GRAY].inputs[1].default_value = float(settings.outside == "GRAY")


def _begin(material, name, kind, needed=()):
    """Let a material read an attribute; return the builder of its nodes if it has none but for that, otherwise None.

    So it is where its nodes were of another kind, or somebody has deleted one that is needed.
    """
    tree = None
    if material.get(_KIND) != kind or not {ATTRIBUTE, BACK, FORM, LIT, *needed} <= set(material.node_tree.nodes.keys()):
        tree = new_tree(material)
        tree.node("ShaderNodeAttribute", name=ATTRIBUTE)
        material[_KIND] = kind
    attribute = material.node_tree.nodes[ATTRIBUTE]
    if attribute.attribute_name != name:
        attribute.attribute_name = name
    return tree


def _build_number_tree(tree, component, repeated, hiding, groups):
    """Add the nodes from a number to its colour: range, map, iso lines, and what lies beyond the range."""
    source = tree.nodes[ATTRIBUTE].outputs
    number = source["Fac"]
    if component == "LENGTH":
        number = tree.vector("LENGTH", source["Vector"])
    elif component:
        number = tree.node("ShaderNodeSeparateXYZ", source["Vector"]).outputs[component]
    rise, steep, known = tree.node("ShaderNodeSeparateXYZ", _rise(tree)).outputs
    place = number = tree.math("ADD", number, rise)
    if repeated:  # -1 and below have one colour, 0 and above repeat; on discs Cycles gives a little less than it is
        place = tree.math("MODULO", tree.math("MAXIMUM", tree.math("ROUND", number), -1.0), repeated)
    bounds = tree.node("ShaderNodeMapRange", place, name=RANGE)
    ramp = tree.node("ShaderNodeValToRGB", bounds, name=COLORS)
    # Lines in the middle of so many even steps of the range, where values beyond it end.
    part = tree.math("FRACT", tree.math("MULTIPLY", bounds, name=LINES))
    even = tree.math("MINIMUM", tree.math("MULTIPLY", steep, name=EVEN), _BROADEST)
    share = tree.math("MULTIPLY", tree.math("SUBTRACT", 1.0, known), 0.5 * _LINE)
    line = tree.math("COMPARE", part, 0.5, tree.math("ADD", even, share))
    color = _mix(tree, line, ramp, _DARK)
    below = tree.math("LESS_THAN", number, name=BELOW)
    above = tree.math("GREATER_THAN", number, name=ABOVE)
    beyond = tree.math("ADD", below, above)
    if hiding:
        _shine(tree, color, groups, hidden=beyond)
    else:
        _shine(tree, _mix(tree, tree.math("MULTIPLY", beyond, name=GRAY), color, BEYOND), groups)


def _shine(tree, color, groups, hidden=None):
    """Give the surface a colour, and points of groups theirs; nothing is seen where a number, if there is one, is 1.

    By emission, as if lit beside the camera, so that colors and form are seen in every scene, and by the lights of the
    scene: see `shade` for their shares, and `dim_back` for the back side.
    """
    for name, group_color in groups.items():
        weight = tree.node("ShaderNodeAttribute", attribute_name=name, name=f"Group {name}")
        color = _mix(tree, tree.math("GREATER_THAN", weight.outputs["Fac"], 0.0), color, group_color)
    seen = tree.node("ShaderNodeNewGeometry").outputs
    color = _mix(tree, tree.math("MULTIPLY", seen["Backfacing"], 0.0, name=BACK), color, BEYOND)
    normal = _disc_normal(tree, seen)
    form = tree.math("MULTIPLY", tree.math("SUBTRACT", _brightness(tree, normal), 1.0), name=FORM)
    light = tree.node("ShaderNodeEmission", color, tree.math("ADD", form, 1.0))
    mixed = tree.node(
        "ShaderNodeMixShader", None, tree.node("ShaderNodeBsdfDiffuse", color, Normal=normal), light, name=LIT
    )
    if hidden is not None:
        mixed = tree.node("ShaderNodeMixShader", hidden, mixed, tree.node("ShaderNodeBsdfTransparent"))
    tree.output("ShaderNodeOutputMaterial", mixed)


def _brightness(tree, normal):
    """Add the nodes for how bright a surface is in a light beside the camera, which reaches around it; return that."""
    facing = tree.node(
        "ShaderNodeVectorTransform", normal, vector_type="NORMAL", convert_from="WORLD", convert_to="CAMERA"
    )
    around = tree.math("MULTIPLY_ADD", tree.vector("DOT_PRODUCT", facing, _LIGHT), 0.5, 0.5)
    return tree.math("MULTIPLY_ADD", tree.math("POWER", around, _FALL), 1.0 - _DARKEST, _DARKEST)


def _disc_normal(tree, seen):
    """Add the nodes for the normal by which surfaces are lit; return it.

    That of a disc is the one of its point, as if it were flat, on the side that is seen; all else has its own.
    """
    disc = tree.node("ShaderNodeAttribute", attribute_name=DISC, name="Disc").outputs["Vector"]
    turned = tree.node(
        "ShaderNodeVectorTransform", disc, vector_type="VECTOR", convert_from="OBJECT", convert_to="WORLD"
    )
    side = tree.math("MULTIPLY", tree.math("SIGN", tree.vector("DOT_PRODUCT", turned, seen["Incoming"])), 1e6)
    summed = tree.vector("ADD", tree.vector("SCALE", turned, side), seen["Normal"])  # its own one alone without a disc
    return tree.vector("NORMALIZE", summed)


def _mix(tree, share, first, second):
    """Add a node that turns a colour into a fixed one by a share; return it."""
    return tree.node("ShaderNodeMixRGB", share, first, second)


def _set_colors(elements, colors, last):
    places = [index / last for index in range(len(colors))]
    if [round(element.position, 5) for element in elements] != [round(place, 5) for place in places]:
        while len(elements) > 1:
            elements.remove(elements[-1])
        elements[0].position = 0.0
        for place in places[1:]:
            elements.new(place)
    elements.foreach_set("color", np.float32(colors).ravel())
    elements[0].color = colors[0]  # after each that is set alone Blender updates all nodes of the file


def _direction_color(tree, vector):
    """Colour directions: red, green and blue for x, y and z, each from dark for -1 to bright for 1."""
    shifted = tree.vector("MULTIPLY_ADD", tree.vector("NORMALIZE", vector), (0.5,) * 3, (0.5,) * 3)
    return tree.node("ShaderNodeGamma", shifted, _GAMMA)


def direction_color(direction):
    """Colour of a unit vector, or of the three columns of such, as linear (r, g, b, 1)."""
    return (*((0.5 * value + 0.5) ** _GAMMA for value in direction), 1.0)


def new_tree(material):
    """Remove the nodes of a material; return the builder of new ones."""
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return TreeBuilder(material.node_tree)
