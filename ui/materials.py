"""The materials that show values: as colours of a map, directions, checks, groups, splats, and strokes."""

import bpy

from ..operators.objects.attributes import DISC, RISE
from ..operators.objects.modifiers import add_math, add_node
from ..operators.objects.splats import BASE
from . import colormaps
from .nodes import DEVIATIONS
from .value_range import CLASSES, STEPPED

ATTRIBUTE, RANGE, COLORS = "Attribute", "Range", "Colors"  # nodes of the material that are read again
LINES, BELOW, ABOVE, GRAY = "Iso Lines", "Below", "Above", "Gray"  # and such that only get other values
BACK = "Back Side"  # another: how dark what is seen from behind is
EVEN = "Even Lines"  # another: how wide a line is by the slope
LIT = "Unlit"  # another: how much of the color is flat
_INK = (0.012, 0.012, 0.016, 1.0)  # color of strokes
_INK_TAG = "meshfree_strokes"  # custom property of the material of strokes
_KIND = "meshfree_kind"  # custom property of the material: which nodes it has
_LINE, _DARK = 0.2, (0.02, 0.02, 0.02, 1.0)  # share of a step that a line takes, and its color
_BROADEST = 0.3  # of that, half of it, where steps are narrow
BEYOND = (0.12, 0.12, 0.12, 1.0)  # color of what lies beyond the range
_DIM = 0.85  # how dark the back side becomes where it is dimmed
_PLAIN, _GRAY = "PLAIN", (0.25, 0.25, 0.25, 1.0)  # where nothing is on show but groups
_COLORED = "COLOR"  # where points have colors of their own
_CHECKERED, _CHECKS = "CHECKER", 20  # along the texture
CHECKER = {"Even": (0.9, 0.82, 0.6, 1.0), "Odd": (0.02, 0.12, 0.25, 1.0)}  # colors of the checks
_SPLATTED, _CONSTANT = "SPLATS", 0.28209479  # the harmonic of degree 0
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
    emission = add_node(tree, "ShaderNodeEmission", 0, 0)
    emission.inputs["Color"].default_value = _INK
    output = add_node(tree, "ShaderNodeOutputMaterial", 1, 0)
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def color_plain(material, groups):
    """Let a material show nothing but groups, see `color_by_number`."""
    kind = f"{_PLAIN} {groups}"
    if (
        material.get(_KIND) != kind
        or material.node_tree is None
        or not {BACK, LIT} <= set(material.node_tree.nodes.keys())
    ):
        gray = add_node(new_tree(material), "ShaderNodeRGB", 0, 0)
        gray.outputs[0].default_value = _GRAY
        _shine(material.node_tree, gray.outputs[0], groups)
        material[_KIND] = kind


def color_splats(material):
    """Let a material show splats in their own colors, fading from their middles, as far as they are opaque."""
    if material.get(_KIND) == _SPLATTED and material.node_tree is not None:
        return
    tree = new_tree(material)
    base = add_node(tree, "ShaderNodeAttribute", 0, 0, attribute_name=BASE, name="Splats")  # no result on show
    color = add_node(tree, "ShaderNodeVectorMath", 1, 0, operation="MULTIPLY_ADD")
    color.inputs[1].default_value, color.inputs[2].default_value = (_CONSTANT,) * 3, (0.5,) * 3
    above = add_node(tree, "ShaderNodeVectorMath", 2, 0, operation="MAXIMUM")
    above.inputs[1].default_value = 0.0, 0.0, 0.0
    linear = add_node(tree, "ShaderNodeGamma", 3, 0)
    linear.inputs["Gamma"].default_value = _GAMMA  # splats are trained in sRGB
    light = add_node(tree, "ShaderNodeEmission", 4, 0)
    # A ray that passes the middle of a ball at the share b of its radius meets it at an angle whose sine is b.
    place = add_node(tree, "ShaderNodeNewGeometry", 0, -300)
    facing = add_node(tree, "ShaderNodeVectorMath", 1, -300, operation="DOT_PRODUCT")
    squared = add_math(tree, 2, -300, "MULTIPLY", facing.outputs["Value"], facing.outputs["Value"])
    passed = add_math(tree, 3, -300, "SUBTRACT", 1.0, squared)
    fading = add_math(tree, 4, -300, "EXPONENT", add_math(tree, 3, -500, "MULTIPLY", passed, -0.5 * DEVIATIONS**2))
    front = add_math(tree, 4, -500, "SUBTRACT", 1.0, place.outputs["Backfacing"])
    alpha = add_math(
        tree, 5, -300, "MULTIPLY", add_math(tree, 5, -500, "MULTIPLY", fading, base.outputs["Alpha"]), front
    )
    through = add_node(tree, "ShaderNodeBsdfTransparent", 5, 200)
    mixed = add_node(tree, "ShaderNodeMixShader", 6, 0)
    output = add_node(tree, "ShaderNodeOutputMaterial", 7, 0)
    for source, target in (
        (base.outputs["Vector"], color.inputs[0]),
        (color.outputs[0], above.inputs[0]),
        (above.outputs[0], linear.inputs["Color"]),
        (linear.outputs[0], light.inputs["Color"]),
        (place.outputs["Normal"], facing.inputs[0]),
        (place.outputs["Incoming"], facing.inputs[1]),
        (alpha, mixed.inputs[0]),
        (through.outputs[0], mixed.inputs[1]),
        (light.outputs[0], mixed.inputs[2]),
        (mixed.outputs[0], output.inputs["Surface"]),
    ):
        tree.links.new(source, target)
    material[_KIND] = _SPLATTED


def shade(material, lit):
    """Let a material show how the surface is lit, from not at all at 0 to nothing but that at 1."""
    material.node_tree.nodes[LIT].inputs[0].default_value = 1.0 - lit


def dim_back(material, dimmed):
    """Let a material show what is seen from behind darker, such as the inside of an open scan, or alike."""
    material.node_tree.nodes[BACK].inputs[1].default_value = _DIM if dimmed else 0.0


def is_plain(material) -> bool:
    """Whether a material shows nothing but groups."""
    return material.get(_KIND, "").startswith(_PLAIN)


def color_by_direction(material, name, groups):
    """Let a material show the directions of an attribute of vectors, and groups as in `color_by_number`."""
    if _begin(material, name, f"DIRECTION {groups}"):
        tree = material.node_tree
        _shine(tree, _direction_color(tree, tree.nodes[ATTRIBUTE].outputs["Vector"]), groups)


def color_by_checker(material, name, groups):
    """Let a material show texture coordinates as a checkerboard, and groups as in `color_by_number`."""
    if _begin(material, name, f"{_CHECKERED} {groups}"):
        tree = material.node_tree
        checker = add_node(tree, "ShaderNodeTexChecker", 1, 0)
        checker.inputs["Scale"].default_value = _CHECKS
        checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = CHECKER.values()
        # Across the planes between checks rounding would decide.
        level = add_node(tree, "ShaderNodeVectorMath", 1, -300, operation="ADD")
        level.inputs[1].default_value = 0.0, 0.0, 0.5 / _CHECKS
        rising = add_node(tree, "ShaderNodeVectorMath", 1, -500, operation="ADD")
        tree.links.new(tree.nodes[ATTRIBUTE].outputs["Vector"], rising.inputs[0])
        tree.links.new(_rise(tree).outputs["Vector"], rising.inputs[1])
        tree.links.new(rising.outputs[0], level.inputs[0])
        tree.links.new(level.outputs[0], checker.inputs["Vector"])
        _shine(tree, checker.outputs["Color"], groups)


def color_by_own(material, name, groups):
    """Let a material show the colors that an attribute holds, and groups as in `color_by_number`."""
    if _begin(material, name, f"{_COLORED} {groups}"):
        _shine(material.node_tree, material.node_tree.nodes[ATTRIBUTE].outputs["Color"], groups)


def shows_own(material) -> bool:
    """Whether a material shows colors that points have of their own."""
    return material.get(_KIND, "").startswith(_COLORED)


def _rise(tree):
    """Add the node that reads by how much what is shown rises within a disc; zero where nothing does."""
    return add_node(tree, "ShaderNodeAttribute", 0, -500, attribute_name=RISE, name="Rise")


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
    repeated, hiding = color_map == "CATEGORICAL", settings.outside == "HIDE"
    needed = (RANGE, COLORS, LINES, EVEN, BELOW, ABOVE, *(() if hiding else (GRAY,)))
    if _begin(material, name, f"{component} {repeated} {hiding} {groups}", needed):
        _build_number_tree(material.node_tree, component, repeated, hiding, groups)
    nodes = material.node_tree.nodes
    colors = colormaps.colors(color_map, settings.reverse)
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
    """Let a material read an attribute; return whether it is empty but for that.

    So it is where its nodes were of another kind, or somebody has deleted one that is needed.
    """
    fits = material.get(_KIND) == kind and {ATTRIBUTE, BACK, LIT, *needed} <= set(material.node_tree.nodes.keys())
    if not fits:
        add_node(new_tree(material), "ShaderNodeAttribute", 0, 0, name=ATTRIBUTE)
        material[_KIND] = kind
    attribute = material.node_tree.nodes[ATTRIBUTE]
    if attribute.attribute_name != name:
        attribute.attribute_name = name
    return not fits


def _build_number_tree(tree, component, repeated, hiding, groups):
    """Add the nodes from a number to its colour: range, map, iso lines, and what lies beyond the range."""
    number = tree.nodes[ATTRIBUTE].outputs["Fac"]
    if component == "LENGTH":
        length = add_node(tree, "ShaderNodeVectorMath", 1, 0, operation="LENGTH")
        tree.links.new(tree.nodes[ATTRIBUTE].outputs["Vector"], length.inputs[0])
        number = length.outputs["Value"]
    elif component:
        separate = add_node(tree, "ShaderNodeSeparateXYZ", 1, 0)
        tree.links.new(tree.nodes[ATTRIBUTE].outputs["Vector"], separate.inputs[0])
        number = separate.outputs[component]
    rise = add_node(tree, "ShaderNodeSeparateXYZ", 1, -500)
    tree.links.new(_rise(tree).outputs["Vector"], rise.inputs[0])
    place = number = add_math(tree, 2, 0, "ADD", number, rise.outputs["X"])
    if repeated:  # -1 and below have one colour, 0 and above repeat; on discs Cycles gives a little less than 7 for 7
        whole = add_math(tree, 1, 400, "ROUND", number)
        place = add_math(tree, 2, 200, "MODULO", add_math(tree, 1, 200, "MAXIMUM", whole, -1.0), CLASSES)
    bounds = add_node(tree, "ShaderNodeMapRange", 3, 0, name=RANGE)
    ramp = add_node(tree, "ShaderNodeValToRGB", 4, 0, name=COLORS)
    tree.links.new(place, bounds.inputs["Value"])
    tree.links.new(bounds.outputs["Result"], ramp.inputs[0])
    # Lines in the middle of so many even steps of the range, where values beyond it end.
    part = add_math(tree, 5, -300, "FRACT", add_math(tree, 4, -300, "MULTIPLY", bounds.outputs["Result"], name=LINES))
    even = add_math(tree, 3, -1000, "MULTIPLY", rise.outputs["Y"], name=EVEN)
    even = add_math(tree, 4, -1000, "MINIMUM", even, _BROADEST)
    unknown = add_math(tree, 3, -1200, "SUBTRACT", 1.0, rise.outputs["Z"])
    share = add_math(tree, 4, -1200, "MULTIPLY", unknown, 0.5 * _LINE)
    line = add_math(tree, 6, -300, "COMPARE", part, 0.5)
    tree.links.new(add_math(tree, 5, -1000, "ADD", even, share), line.node.inputs[2])
    color = _mix(tree, 7, line, ramp.outputs["Color"], _DARK)
    below = add_math(tree, 4, -600, "LESS_THAN", number, name=BELOW)
    above = add_math(tree, 4, -800, "GREATER_THAN", number, name=ABOVE)
    beyond = add_math(tree, 5, -600, "ADD", below, above)
    if hiding:
        _shine(tree, color, groups, hidden=beyond)
    else:
        _shine(tree, _mix(tree, 8, add_math(tree, 6, -600, "MULTIPLY", beyond, name=GRAY), color, BEYOND), groups)


def _shine(tree, color, groups, hidden=None):
    """Give the surface a colour, and points of groups theirs; nothing is seen where a number, if there is one, is 1.

    By emission, so that colours read as in the legend, and by diffuse light, so that shapes show: see `shade` for their
    shares, and `dim_back` for the back side.
    """
    column = 9
    for name, group_color in groups.items():
        weight = add_node(tree, "ShaderNodeAttribute", column, -600, attribute_name=name, name=f"Group {name}")
        inside = add_math(tree, column + 1, -600, "GREATER_THAN", weight.outputs["Fac"], 0.0)
        color = _mix(tree, column + 2, inside, color, group_color)
        column += 1
    column += 2 if groups else 0
    seen = add_node(tree, "ShaderNodeNewGeometry", column, -900)
    behind = add_math(tree, column + 1, -900, "MULTIPLY", seen.outputs["Backfacing"], name=BACK)
    color = _mix(tree, column + 2, behind, color, BEYOND)
    column += 3
    diffuse = add_node(tree, "ShaderNodeBsdfDiffuse", column, 100)
    _light_discs(tree, column - 3, diffuse)
    emission = add_node(tree, "ShaderNodeEmission", column, -100)
    mixed = add_node(tree, "ShaderNodeMixShader", column + 1, 0, name=LIT)
    output = add_node(tree, "ShaderNodeOutputMaterial", column + 3, 0)
    tree.links.new(color, diffuse.inputs["Color"])
    tree.links.new(color, emission.inputs["Color"])
    tree.links.new(diffuse.outputs[0], mixed.inputs[1])
    tree.links.new(emission.outputs[0], mixed.inputs[2])
    if hidden is not None:
        nothing = add_node(tree, "ShaderNodeBsdfTransparent", column + 1, -200)
        shown, mixed = mixed, add_node(tree, "ShaderNodeMixShader", column + 2, 0)
        tree.links.new(hidden, mixed.inputs[0])
        tree.links.new(shown.outputs[0], mixed.inputs[1])
        tree.links.new(nothing.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], output.inputs["Surface"])


def _light_discs(tree, column, diffuse):
    """Light a disc by the normal of its point, as if it were flat, on the side that is seen; all else as it is."""
    disc = add_node(tree, "ShaderNodeAttribute", column, 500, attribute_name=DISC, name="Disc")
    seen = add_node(tree, "ShaderNodeNewGeometry", column, 800)
    turned = add_node(tree, "ShaderNodeVectorTransform", column + 1, 500, vector_type="VECTOR")
    turned.convert_from, turned.convert_to = "OBJECT", "WORLD"
    facing = add_node(tree, "ShaderNodeVectorMath", column + 1, 800, operation="DOT_PRODUCT")
    side = add_math(
        tree, column + 2, 800, "MULTIPLY", add_math(tree, column + 1, 1000, "SIGN", facing.outputs["Value"]), 1e6
    )
    scaled = add_node(tree, "ShaderNodeVectorMath", column + 2, 500, operation="SCALE")
    summed = add_node(
        tree, "ShaderNodeVectorMath", column + 2, 300, operation="ADD"
    )  # its own one alone without a disc
    unit = add_node(tree, "ShaderNodeVectorMath", column + 3, 300, operation="NORMALIZE")
    for source, target in (
        (disc.outputs["Vector"], turned.inputs["Vector"]),
        (turned.outputs["Vector"], facing.inputs[0]),
        (seen.outputs["Incoming"], facing.inputs[1]),
        (turned.outputs["Vector"], scaled.inputs[0]),
        (side, scaled.inputs["Scale"]),
        (scaled.outputs[0], summed.inputs[0]),
        (seen.outputs["Normal"], summed.inputs[1]),
        (summed.outputs[0], unit.inputs[0]),
        (unit.outputs[0], diffuse.inputs["Normal"]),
    ):
        tree.links.new(source, target)


def _mix(tree, column, share, first, second):
    """Add a node that turns a colour into a fixed one by a share; return its result."""
    node = add_node(tree, "ShaderNodeMixRGB", column, -300)
    node.inputs["Color2"].default_value = second
    tree.links.new(share, node.inputs["Fac"])
    tree.links.new(first, node.inputs["Color1"])
    return node.outputs["Color"]


def _set_colors(elements, colors, last):
    places = [index / last for index in range(len(colors))]
    if [round(element.position, 5) for element in elements] != [round(place, 5) for place in places]:
        while len(elements) > 1:
            elements.remove(elements[-1])
        elements[0].position = 0.0
        for place in places[1:]:
            elements.new(place)
    for element, color in zip(elements, colors, strict=True):
        element.color = color


def _direction_color(tree, vector):
    """Colour directions: red, green and blue for x, y and z, each from dark for -1 to bright for 1."""
    unit = add_node(tree, "ShaderNodeVectorMath", 1, 0, operation="NORMALIZE")
    shifted = add_node(tree, "ShaderNodeVectorMath", 2, 0, operation="MULTIPLY_ADD")
    shifted.inputs[1].default_value = shifted.inputs[2].default_value = (0.5, 0.5, 0.5)
    gamma = add_node(tree, "ShaderNodeGamma", 3, 0)
    gamma.inputs["Gamma"].default_value = _GAMMA
    tree.links.new(vector, unit.inputs[0])
    tree.links.new(unit.outputs[0], shifted.inputs[0])
    tree.links.new(shifted.outputs[0], gamma.inputs["Color"])
    return gamma.outputs["Color"]


def direction_color(direction):
    """Colour of a unit vector, or of the three columns of such, as linear (r, g, b, 1)."""
    return (*((0.5 * value + 0.5) ** _GAMMA for value in direction), 1.0)


def new_tree(material):
    """Return the node tree of a material, emptied."""
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material.node_tree
