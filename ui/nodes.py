"""The node trees that make values visible: round points or discs for vertices, strokes, and colours for values."""

import math
from functools import partial

import bpy

from ..operators.objects.attributes import CORNER, DISC, RISE, SLOPE, SLOPE_2, SLOPE_OF, SOLID, TILT
from ..operators.objects.modifiers import DISPLAY_TAG, add_input, add_node, has_input, is_intact, new_group
from ..operators.objects.splats import BASE, HARMONIC, ROTATION, SCALE
from . import colormaps
from .value_range import CLASSES, STEPPED

MOST = "Viewport Points"  # input of the display: how many it draws there
DISCS = "Discs"  # another: whether it draws discs
STROKES = "Strokes"  # another: the attribute that has them
FILLED = "Filled"  # another: whether dots are as large as discs
SPLATS = "Splats"  # another: whether it draws their ellipsoids
SMOOTH = "Smooth"  # another: the attribute that changes within discs
SOLID_NAME = "Solid Colors"  # another: the color attribute that viewports in Solid look at
LENGTH, INK = "Stroke Length", "Stroke Material"  # others: what they look like
ATTRIBUTE, RANGE, COLORS = "Attribute", "Range", "Colors"  # nodes of the material that are read again
LINES, BELOW, ABOVE, GRAY = "Iso Lines", "Below", "Above", "Gray"  # and such that only get other values
BACK = "Back Side"  # another: how dark what is seen from behind is
EVEN = "Even Lines"  # another: how wide a line is by the slope
LIT = "Unlit"  # another: how much of the color is flat
DISC_COST = 2  # dots that take as long to draw without a graphics card as one disc
_SIDES = 6  # of a disc
_SLOPE = 0.25  # by which discs fall off from their points, so that each place shows the point nearest to it
_SHARE = 1.0 / 40.0  # length of strokes in the diagonal of the object, so that they are seen where all of it is
_LEAST = 2.0  # that length in radii of the points at least
_SLIM = 0.16  # width of a stroke in its length
_APART = 0.5  # how far strokes are apart, in their lengths
_LIFTED = 0.2  # how far they lie above the surface, in radii of the points
_CELLS = 256.0  # of the grid that spreads strokes, along each axis, beyond which it repeats: single precision tells
_INK = (0.012, 0.012, 0.016, 1.0)  # color of strokes
_INK_TAG = "meshfree_strokes"  # custom property of the material of strokes
_KIND = "meshfree_kind"  # custom property of the material: which nodes it has
_LINE, _DARK = 0.2, (0.02, 0.02, 0.02, 1.0)  # share of a step that a line takes, and its color
_ROUNDING = 1e-5  # share by which values may differ that are the same
_BROADEST = 0.3  # of that, half of it, where steps are narrow
BEYOND = (0.12, 0.12, 0.12, 1.0)  # color of what lies beyond the range
_DIM = 0.85  # how dark the back side becomes where it is dimmed
_PLAIN, _GRAY = "PLAIN", (0.25, 0.25, 0.25, 1.0)  # where nothing is on show but groups
_COLORED = "COLOR"  # where points have colors of their own
_CHECKERED, _CHECKS = "CHECKER", 20  # along the texture
CHECKER = {"Even": (0.9, 0.82, 0.6, 1.0), "Odd": (0.02, 0.12, 0.25, 1.0)}  # colors of the checks
_DEVIATIONS = 2.0  # standard deviations at which the ellipsoid of a splat ends
_UNSEEN = f"{HARMONIC}*", "ply_*", ".splat_*", "lb_*"  # attributes of splats that do not show
_SPLATTED, _CONSTANT = "SPLATS", 0.28209479  # the harmonic of degree 0
_GAMMA = 2.2  # makes the steps of direction colours even to the eye


def display_group():
    """Return the node group that all displays share: round points where there are no faces, and the material."""
    for group in bpy.data.node_groups:
        if DISPLAY_TAG in group and group.library is None and is_intact(group) and has_input(group, SOLID_NAME):
            return group
    group = new_group("Mesh-Free Display", DISPLAY_TAG)
    radius = add_input(group, "Radius", "Float", "Size of the points")
    radius.subtype = "DISTANCE"
    radius.default_value = 0.01
    radius.min_value = 0.0
    add_input(group, "Material", "Material", "Colors of the points")
    most = add_input(
        group, MOST, "Int", "How many points the viewport draws at most, dots from half of that on; 0 for all"
    )
    most.min_value = 0
    add_input(group, DISCS, "Bool", f"Draw discs that lie in the surface, as the attribute {DISC} says")
    add_input(group, FILLED, "Bool", f"Draw dots as large as the discs of {DISC}, so that they leave no holes")
    add_input(group, SPLATS, "Bool", f"Draw ellipsoids, as the attributes {SCALE} and {ROTATION} say")
    add_input(
        group,
        SMOOTH,
        "String",
        "Attribute that changes within discs, by its slopes along the surface; empty for none",
    )
    add_input(
        group, SOLID_NAME, "String", "Color attribute that gets the colors of what is shown, for Solid; empty for none"
    )
    add_input(
        group, STROKES, "String", "Attribute with directions along the surface, which strokes show; empty for none"
    )
    length = add_input(group, LENGTH, "Float", "Length of the strokes, 1 for a fortieth of the object")
    length.default_value, length.min_value = 1.0, 0.0
    add_input(group, INK, "Material", "Color of the strokes")

    given = add_node(group, "NodeGroupInput", 0, 0)
    neighbors = add_node(group, "GeometryNodeInputMeshVertexNeighbors", 0, -200)
    loose = add_node(group, "FunctionNodeCompare", 1, -200, data_type="INT", operation="EQUAL")
    parts = add_node(group, "GeometryNodeSeparateComponents", 1, 0)
    drawn, larger, many = _thinned(group, given, parts)
    disc_of = partial(_with_active_color, group, parts.outputs["Mesh"], loose.outputs["Result"])
    chosen = add_node(group, "FunctionNodeBooleanMath", 2, -400, operation="AND")
    size = add_node(group, "ShaderNodeMath", 2, -600, operation="MULTIPLY")
    points = add_node(group, "GeometryNodeMeshToPoints", 3, -100)
    given_points = add_node(group, "GeometryNodeSetPointRadius", 3, -300)
    given_drawn = add_node(group, "GeometryNodeSeparateGeometry", 4, -300)
    faces = add_node(group, "GeometryNodeDeleteGeometry", 3, 100)  # loose vertices would be drawn over the points
    every = add_node(group, "GeometryNodeJoinGeometry", 5, -200)
    joined = add_node(group, "GeometryNodeJoinGeometry", 10, 0)
    colored = add_node(group, "GeometryNodeSetMaterial", 11, 0)
    drawn_over = add_node(group, "GeometryNodeJoinGeometry", 12, 0)
    result = add_node(group, "NodeGroupOutput", 13, 0)
    compared = next(socket for socket in loose.inputs if socket.name == "A" and socket.type == "INT")
    for source, target in (
        (neighbors.outputs["Face Count"], compared),
        (loose.outputs["Result"], chosen.inputs[0]),
        (drawn, chosen.inputs[1]),
        (given.outputs["Radius"], size.inputs[0]),
        (larger, size.inputs[1]),
        (chosen.outputs[0], points.inputs["Selection"]),
        (given.outputs["Geometry"], parts.inputs["Geometry"]),
        (parts.outputs["Mesh"], points.inputs["Mesh"]),
        (parts.outputs["Point Cloud"], given_points.inputs["Points"]),
        (size.outputs[0], given_points.inputs["Radius"]),
        (given_points.outputs["Points"], given_drawn.inputs["Geometry"]),
        (drawn, given_drawn.inputs["Selection"]),
        (given_drawn.outputs["Selection"], every.inputs["Geometry"]),
        (size.outputs[0], points.inputs["Radius"]),
        (points.outputs["Points"], every.inputs["Geometry"]),
        (_shaped(group, given, disc_of, every.outputs["Geometry"], size.outputs[0], many), joined.inputs["Geometry"]),
        (loose.outputs["Result"], faces.inputs["Selection"]),
        (parts.outputs["Mesh"], faces.inputs["Geometry"]),
        (faces.outputs["Geometry"], joined.inputs["Geometry"]),
        (_in_solid(group, given, joined.outputs["Geometry"]), colored.inputs["Geometry"]),
        (given.outputs["Material"], colored.inputs["Material"]),
        (colored.outputs["Geometry"], drawn_over.inputs["Geometry"]),
        (_stroked(group, given, every.outputs["Geometry"]), drawn_over.inputs["Geometry"]),
        (drawn_over.outputs["Geometry"], result.inputs["Geometry"]),
    ):
        group.links.new(source, target)
    return group


def _thinned(group, given, parts):
    """Add the nodes that choose which points the viewport draws.

    They are chosen at random, so that no pattern of a scanner shows, and cover what all would.

    Returns
    -------
    drawn, larger, many : bpy.types.NodeSocket
        Whether a point is drawn, by what its radius grows, and whether there are too many for discs.
    """
    counts = [
        add_node(group, "GeometryNodeAttributeDomainSize", 2, -800 - 200 * row, component=kind)
        for row, kind in enumerate(("MESH", "POINTCLOUD"))
    ]
    for node, part in zip(counts, ("Mesh", "Point Cloud"), strict=True):
        group.links.new(parts.outputs[part], node.inputs["Geometry"])
    viewport = add_node(group, "GeometryNodeIsViewport", 2, -1200)
    limited = _math(group, 3, -1200, "GREATER_THAN", given.outputs[MOST], 0.0)
    limited = _math(group, 4, -1200, "MULTIPLY", limited, viewport.outputs[0])
    count = _math(group, 3, -800, "ADD", *(node.outputs["Point Count"] for node in counts))
    share = _math(group, 4, -800, "MINIMUM", _math(group, 3, -1000, "DIVIDE", given.outputs[MOST], count), 1.0)
    share = _math(group, 5, -800, "POWER", share, limited)  # one where there is no limit
    random = add_node(group, "FunctionNodeRandomValue", 5, -1000, data_type="FLOAT")
    drawn = _math(group, 6, -1000, "LESS_THAN", random.outputs["Value"], _math(group, 6, -800, "ADD", share, 1e-6))
    costly = _math(group, 4, -1400, "MULTIPLY", count, float(DISC_COST))
    costly = _math(group, 5, -1400, "GREATER_THAN", costly, given.outputs[MOST])
    return drawn, _math(group, 6, -600, "POWER", share, -0.5), _math(group, 6, -1400, "MULTIPLY", costly, limited)


def _shaped(group, given, disc_of, points, size, many):
    """Add the nodes that make points into discs where that is asked for and they are not many; return what is drawn."""
    disc = add_node(group, "GeometryNodeInputNamedAttribute", 5, -500, data_type="FLOAT_VECTOR")
    disc.inputs["Name"].default_value = DISC
    turned = add_node(group, "FunctionNodeAlignRotationToVector", 6, -500, axis="Z")
    length = add_node(group, "ShaderNodeVectorMath", 6, -900, operation="LENGTH")
    placed = add_node(group, "GeometryNodeInstanceOnPoints", 7, -300)
    larger = add_node(group, "ShaderNodeMix", 8, -700)
    larger.inputs["A"].default_value = 1.0
    dots = add_node(group, "GeometryNodeSetPointRadius", 8, -500)
    discs = add_node(group, "FunctionNodeBooleanMath", 8, -100, operation="NIMPLY")
    chosen = add_node(group, "GeometryNodeSwitch", 9, -200, input_type="GEOMETRY")
    splats = add_node(group, "GeometryNodeSwitch", 9, -500, input_type="GEOMETRY")
    unknown = _math(group, 7, -1300, "LESS_THAN", length.outputs["Value"], 1e-6)  # of points added since: like a dot
    reach = _math(group, 7, -1100, "ADD", length.outputs["Value"], unknown)
    scale = _math(group, 7, -900, "MULTIPLY", reach, size)
    for source, target in (
        (disc.outputs["Attribute"], turned.inputs["Vector"]),
        (disc.outputs["Attribute"], length.inputs[0]),
        (_with_middles(group, given, points), placed.inputs["Points"]),
        (disc_of(_disc(group)), placed.inputs["Instance"]),
        (turned.outputs["Rotation"], placed.inputs["Rotation"]),
        (scale, placed.inputs["Scale"]),
        (given.outputs[DISCS], discs.inputs[0]),
        (many, discs.inputs[1]),
        (discs.outputs[0], chosen.inputs["Switch"]),
        (given.outputs[FILLED], larger.inputs["Factor"]),
        (reach, larger.inputs["B"]),
        (points, dots.inputs["Points"]),
        (_math(group, 9, -700, "MULTIPLY", larger.outputs["Result"], size), dots.inputs["Radius"]),
        (dots.outputs["Points"], chosen.inputs["False"]),
        (_rising(group, given, _corners(group, 8, -300, placed.outputs["Instances"])), chosen.inputs["True"]),
        (given.outputs[SPLATS], splats.inputs["Switch"]),
        (chosen.outputs["Output"], splats.inputs["False"]),
        (_ellipsoids(group, points), splats.inputs["True"]),
    ):
        group.links.new(source, target)
    return splats.outputs["Output"]


def _disc(group):
    """Add the nodes that make a disc of radius 1 in the plane z = 0; return it.

    Flat discs stick out of each other where the surface bends outwards, like scales; cones as flat as these do not. A
    second cone that hangs from the rim of the first lets all normals be that of the disc, by which Solid shades.
    """
    cones = []
    for row, (top, bottom, low) in enumerate(((0.0, 1.0, -_SLOPE), (1.0, 0.0, -2.0 * _SLOPE))):
        cone = add_node(group, "GeometryNodeMeshCone", 4, -700 - 300 * row, fill_type="NONE")
        cone.inputs["Vertices"].default_value, cone.inputs["Depth"].default_value = _SIDES, _SLOPE
        for name, radius in (("Radius Top", top), ("Radius Bottom", bottom)):
            cone.inputs[name].default_value = radius / math.cos(math.pi / _SIDES)  # no less than a disc
        lowered = add_node(group, "GeometryNodeTransform", 5, -700 - 300 * row)
        lowered.inputs["Translation"].default_value = 0.0, 0.0, low
        group.links.new(cone.outputs["Mesh"], lowered.inputs["Geometry"])
        cones.append(lowered.outputs["Geometry"])
    upwards = add_node(group, "GeometryNodeFlipFaces", 6, -1000)
    joined = add_node(group, "GeometryNodeJoinGeometry", 6, -700)
    merged = add_node(group, "GeometryNodeMergeByDistance", 7, -700)
    smooth = add_node(group, "GeometryNodeSetShadeSmooth", 8, -700)
    for source, target in (
        (cones[1], upwards.inputs[0]),
        (cones[0], joined.inputs[0]),
        (upwards.outputs[0], joined.inputs[0]),
        (joined.outputs[0], merged.inputs["Geometry"]),
        (merged.outputs[0], smooth.inputs[0]),
    ):
        group.links.new(source, target)
    return smooth.outputs[0]


def _with_active_color(group, mesh, loose, disc):
    """Add the nodes that tell a disc which color attribute of a mesh is active, the one that Solid shows; return it.

    The name comes along with the first of the meshes that are joined: here one vertex without any values, which goes.
    """
    place = add_node(group, "GeometryNodeInputIndex", 2, 400)
    first = _math(group, 3, 400, "LESS_THAN", place.outputs[0], 0.5)
    alone = add_node(group, "GeometryNodeSeparateGeometry", 4, 400)
    joined = add_node(group, "GeometryNodeJoinGeometry", 6, 400)
    left = add_node(group, "GeometryNodeDeleteGeometry", 7, 400)
    for source, target in (
        (mesh, alone.inputs["Geometry"]),
        (first, alone.inputs["Selection"]),
        (disc, joined.inputs[0]),
        (_without(group, 5, 400, alone.outputs["Selection"], "*"), joined.inputs[0]),  # the later link is the first
        (joined.outputs[0], left.inputs["Geometry"]),
        (loose, left.inputs["Selection"]),
    ):
        group.links.new(source, target)
    return left.outputs["Geometry"]


def _without(group, column, y, geometry, names):
    """Add a node that removes the attributes whose names fit; return what is left."""
    removed = add_node(group, "GeometryNodeRemoveAttribute", column, y)
    if "Pattern Mode" in removed.inputs:  # since Blender 5
        removed.inputs["Pattern Mode"].default_value = "Wildcard"
    else:
        removed.pattern_mode = "WILDCARD"
    removed.inputs["Name"].default_value = names
    group.links.new(geometry, removed.inputs["Geometry"])
    return removed.outputs["Geometry"]


def _with_middles(group, given, points):
    """Add the nodes that let points know their places, which the corners of their discs get too; return the points."""
    place = add_node(group, "GeometryNodeInputPosition", 5, -2300)
    stored, value = _stored(group, 6, -2300, RISE, "FLOAT_VECTOR")
    group.links.new(points, stored.inputs["Geometry"])
    group.links.new(place.outputs["Position"], value)
    return _where_named(group, given, SMOOTH, 7, -2300, points, stored.outputs["Geometry"])


def _rising(group, given, corners):
    """Add the nodes that tell by how much what is shown rises from the middle of a disc to each corner.

    That of texture coordinates is x and y; that of a number is x, with y how steep it is, and z to tell that it is
    known. All is zero where values have changed since their slopes were found.
    """
    middle, first, second = (
        _named(group, 8, -2300 - 200 * row, name) for row, name in enumerate((RISE, SLOPE, SLOPE_2))
    )
    place = add_node(group, "GeometryNodeInputPosition", 8, -2900)
    step = add_node(group, "ShaderNodeVectorMath", 9, -2300, operation="SUBTRACT")
    along, across = (
        add_node(group, "ShaderNodeVectorMath", 10, -2300 - 200 * row, operation="DOT_PRODUCT") for row in range(2)
    )
    steep = add_node(group, "ShaderNodeVectorMath", 10, -2700, operation="LENGTH")
    single = _math(group, 10, -2900, "SUBTRACT", 1.0, second.outputs["Exists"])
    combined = add_node(group, "ShaderNodeCombineXYZ", 12, -2300)
    valid = add_node(group, "ShaderNodeVectorMath", 13, -2500, operation="SCALE")
    stored, value = _stored(group, 14, -2300, RISE, "FLOAT_VECTOR")
    steep_or_none = _math(group, 11, -2700, "MULTIPLY", steep.outputs["Value"], single)
    for source, target in (
        (place.outputs["Position"], step.inputs[0]),
        (middle.outputs["Attribute"], step.inputs[1]),
        (step.outputs[0], along.inputs[0]),
        (step.outputs[0], across.inputs[0]),
        (first.outputs["Attribute"], along.inputs[1]),
        (second.outputs["Attribute"], across.inputs[1]),
        (first.outputs["Attribute"], steep.inputs[0]),
        (along.outputs["Value"], combined.inputs["X"]),
        (_math(group, 11, -2500, "ADD", across.outputs["Value"], steep_or_none), combined.inputs["Y"]),
        (single, combined.inputs["Z"]),
        (combined.outputs[0], valid.inputs[0]),
        (_unchanged(group, given), valid.inputs["Scale"]),
        (corners, stored.inputs["Geometry"]),
        (valid.outputs[0], value),
    ):
        group.links.new(source, target)
    return _where_named(group, given, SMOOTH, 15, -2300, corners, stored.outputs["Geometry"])


def _unchanged(group, given):
    """Add the nodes that tell whether an attribute has the values that slopes were found of; return that, 1 or 0."""
    now, then = (_named(group, 9, -3100 - 200 * row, SLOPE_OF, "FLOAT") for row in range(2))
    group.links.new(given.outputs[SMOOTH], now.inputs["Name"])
    same = _math(group, 11, -3100, "COMPARE", now.outputs["Attribute"], then.outputs["Attribute"])
    size = _math(group, 10, -3300, "ABSOLUTE", then.outputs["Attribute"])
    group.links.new(_math(group, 10, -3500, "MULTIPLY", size, _ROUNDING), same.node.inputs[2])
    return _math(group, 12, -3100, "MULTIPLY", same, then.outputs["Exists"])


def _in_solid(group, given, geometry):
    """Add the nodes that put the colors of what is shown where viewports in Solid look for colors; return the geometry.

    Along a disc they change as fast as between its middle and its edge.
    """
    color = _named(group, 9, 300, SOLID, "FLOAT_COLOR")
    tilt, rise = _named(group, 9, 500, TILT), _named(group, 9, 700, RISE)
    parts = add_node(group, "ShaderNodeSeparateXYZ", 10, 700)
    change = add_node(group, "ShaderNodeVectorMath", 11, 500, operation="SCALE")
    shown = add_node(group, "ShaderNodeVectorMath", 12, 300, operation="ADD")
    stored, value = _stored(group, 13, 300, "", "FLOAT_COLOR")
    for source, target in (
        (rise.outputs["Attribute"], parts.inputs[0]),
        (tilt.outputs["Attribute"], change.inputs[0]),
        (parts.outputs["X"], change.inputs["Scale"]),
        (color.outputs["Attribute"], shown.inputs[0]),
        (change.outputs[0], shown.inputs[1]),
        (given.outputs[SOLID_NAME], stored.inputs["Name"]),
        (geometry, stored.inputs["Geometry"]),
        (shown.outputs[0], value),
    ):
        group.links.new(source, target)
    return _where_named(group, given, SOLID_NAME, 14, 300, geometry, stored.outputs["Geometry"])


def _where_named(group, given, name, column, y, plain, other):
    """Add nodes that take the other geometry where an input of the display names something; else it costs no time."""
    asked = add_node(group, "FunctionNodeCompare", column, y - 200, data_type="STRING", operation="NOT_EQUAL")
    chosen = add_node(group, "GeometryNodeSwitch", column, y, input_type="GEOMETRY")
    for source, target in (
        (given.outputs[name], next(item for item in asked.inputs if item.name == "A" and item.type == "STRING")),
        (asked.outputs["Result"], chosen.inputs["Switch"]),
        (plain, chosen.inputs["False"]),
        (other, chosen.inputs["True"]),
    ):
        group.links.new(source, target)
    return chosen.outputs["Output"]


def _named(group, column, y, name, data_type="FLOAT_VECTOR"):
    """Add a node that reads an attribute; return it."""
    node = add_node(group, "GeometryNodeInputNamedAttribute", column, y, data_type=data_type)
    node.inputs["Name"].default_value = name
    return node


def _stored(group, column, y, name, data_type):
    """Add a node that keeps an attribute; return it, and its input for the values."""
    node = add_node(group, "GeometryNodeStoreNamedAttribute", column, y, data_type=data_type)
    node.inputs["Name"].default_value = name
    kind = {"FLOAT_VECTOR": "VECTOR", "FLOAT_COLOR": "RGBA"}.get(data_type, data_type)
    return node, next(socket for socket in node.inputs if socket.name == "Value" and socket.type == kind)


def _ellipsoids(group, points):
    """Add the nodes that make splats into ellipsoids of two standard deviations; return what is drawn."""
    ball = add_node(group, "GeometryNodeMeshIcoSphere", 5, -1700)
    ball.inputs["Radius"].default_value, ball.inputs["Subdivisions"].default_value = _DEVIATIONS, 1
    smooth = add_node(group, "GeometryNodeSetShadeSmooth", 6, -1700)
    scale = add_node(group, "GeometryNodeInputNamedAttribute", 5, -1900, data_type="FLOAT_VECTOR")
    scale.inputs["Name"].default_value = SCALE
    rotation = add_node(group, "GeometryNodeInputNamedAttribute", 5, -2100, data_type="QUATERNION")
    rotation.inputs["Name"].default_value = ROTATION
    placed = add_node(group, "GeometryNodeInstanceOnPoints", 7, -1700)
    for row, names in enumerate(_UNSEEN):  # or each corner would get a copy
        points = _without(group, 4, -1500 - 200 * row, points, names)
    for source, target in (
        (ball.outputs["Mesh"], smooth.inputs[0]),
        (points, placed.inputs["Points"]),
        (smooth.outputs[0], placed.inputs["Instance"]),
        (rotation.outputs["Attribute"], placed.inputs["Rotation"]),
        (scale.outputs["Attribute"], placed.inputs["Scale"]),
    ):
        group.links.new(source, target)
    return _corners(group, 8, -1700, placed.outputs["Instances"])


def _corners(group, column, y, instances):
    """Add the nodes that make instances real, and mark their corners, which are no points."""
    realized = add_node(group, "GeometryNodeRealizeInstances", column, y)
    marked, value = _stored(group, column, y - 200, CORNER, "BOOLEAN")
    value.default_value = True
    group.links.new(instances, realized.inputs["Geometry"])
    group.links.new(realized.outputs["Geometry"], marked.inputs["Geometry"])
    return marked.outputs["Geometry"]


def _stroked(group, given, points):
    """Add the nodes that draw directions along the surface as strokes a little above it; return the strokes.

    All strokes would hide each other where points are many. So of the points in each cell of a grid the first one that
    has a direction has a stroke, which points along it.
    """
    asked = add_node(group, "FunctionNodeCompare", 5, -1500, data_type="STRING", operation="NOT_EQUAL")
    some = add_node(group, "GeometryNodeSwitch", 6, -1500, input_type="GEOMETRY")  # else nothing below costs any time
    direction = add_node(group, "GeometryNodeInputNamedAttribute", 6, -1700, data_type="FLOAT_VECTOR")
    disc = add_node(group, "GeometryNodeInputNamedAttribute", 6, -1900, data_type="FLOAT_VECTOR")
    disc.inputs["Name"].default_value = DISC
    size = add_node(group, "ShaderNodeVectorMath", 7, -1700, operation="LENGTH")
    there = _math(group, 8, -1700, "GREATER_THAN", size.outputs["Value"], 1e-6)
    box = add_node(group, "GeometryNodeBoundBox", 7, -1500)
    for radius in box.inputs[1:]:  # which Blender 4.2 cannot leave out
        radius.default_value = False
    diagonal = add_node(group, "ShaderNodeVectorMath", 8, -1500, operation="DISTANCE")
    share = _math(group, 9, -1500, "MULTIPLY", diagonal.outputs["Value"], _SHARE)
    least = _math(group, 9, -1300, "MULTIPLY", given.outputs["Radius"], _LEAST)
    length = _math(
        group, 11, -1500, "MULTIPLY", _math(group, 10, -1500, "MAXIMUM", share, least), given.outputs[LENGTH]
    )

    place = add_node(group, "GeometryNodeInputPosition", 8, -2100)
    offset = add_node(group, "ShaderNodeVectorMath", 9, -2100, operation="SUBTRACT")
    cell = add_node(group, "ShaderNodeVectorMath", 12, -2100, operation="SCALE")
    whole = add_node(group, "ShaderNodeVectorMath", 13, -2100, operation="FLOOR")
    kept = add_node(group, "ShaderNodeVectorMath", 14, -2100, operation="MODULO")
    kept.inputs[1].default_value = (_CELLS,) * 3
    number = add_node(group, "ShaderNodeVectorMath", 15, -2100, operation="DOT_PRODUCT")
    number.inputs[1].default_value = 1.0, _CELLS, _CELLS**2
    before = add_node(group, "GeometryNodeAccumulateField", 16, -1900, data_type="FLOAT", domain="POINT")
    first = _math(
        group, 18, -1900, "MULTIPLY", _math(group, 17, -1900, "LESS_THAN", before.outputs["Trailing"], 0.5), there
    )

    stroke = add_node(group, "GeometryNodeMeshCircle", 12, -2500, fill_type="NGON")  # a triangle, its first corner at x
    stroke.inputs["Vertices"].default_value = 3
    slim = add_node(group, "GeometryNodeTransform", 13, -2500)
    slim.inputs["Scale"].default_value = 1.0 / 1.5, _SLIM / math.sqrt(3.0), 1.0
    slim.inputs["Translation"].default_value = -0.25 / 1.5, 0.0, 0.0  # its middle
    along = add_node(group, "FunctionNodeAlignRotationToVector", 12, -2300, axis="X")
    flat = add_node(group, "FunctionNodeAlignRotationToVector", 13, -2300, axis="Z", pivot_axis="X")
    unit = add_node(group, "ShaderNodeVectorMath", 17, -2300, operation="NORMALIZE")
    above = add_node(group, "ShaderNodeVectorMath", 18, -2300, operation="SCALE")
    lifted = add_node(group, "GeometryNodeSetPosition", 19, -1500)
    placed = add_node(group, "GeometryNodeInstanceOnPoints", 20, -1500)
    inked = add_node(group, "GeometryNodeSetMaterial", 23, -1500)
    for source, target in (
        (given.outputs[STROKES], next(item for item in asked.inputs if item.name == "A" and item.type == "STRING")),
        (asked.outputs["Result"], some.inputs["Switch"]),
        (points, some.inputs["True"]),
        (given.outputs[STROKES], direction.inputs["Name"]),
        (given.outputs[INK], inked.inputs["Material"]),
        (direction.outputs["Attribute"], size.inputs[0]),
        (some.outputs["Output"], box.inputs["Geometry"]),
        (box.outputs["Min"], diagonal.inputs[0]),
        (box.outputs["Max"], diagonal.inputs[1]),
        (place.outputs["Position"], offset.inputs[0]),
        (box.outputs["Min"], offset.inputs[1]),
        (offset.outputs[0], cell.inputs[0]),
        (_math(group, 11, -2100, "DIVIDE", 1.0 / _APART, length), cell.inputs["Scale"]),
        (cell.outputs[0], whole.inputs[0]),
        (whole.outputs[0], kept.inputs[0]),
        (kept.outputs[0], number.inputs[0]),
        (there, before.inputs[0]),
        (number.outputs["Value"], before.inputs["Group ID"]),
        (direction.outputs["Attribute"], along.inputs["Vector"]),
        (along.outputs["Rotation"], flat.inputs["Rotation"]),
        (disc.outputs["Attribute"], flat.inputs["Vector"]),
        (disc.outputs["Attribute"], unit.inputs[0]),
        (unit.outputs[0], above.inputs[0]),
        (_math(group, 17, -2500, "MULTIPLY", given.outputs["Radius"], _LIFTED), above.inputs["Scale"]),
        (some.outputs["Output"], lifted.inputs["Geometry"]),
        (above.outputs[0], lifted.inputs["Offset"]),
        (lifted.outputs["Geometry"], placed.inputs["Points"]),
        (first, placed.inputs["Selection"]),
        (stroke.outputs["Mesh"], slim.inputs["Geometry"]),
        (slim.outputs["Geometry"], placed.inputs["Instance"]),
        (flat.outputs["Rotation"], placed.inputs["Rotation"]),
        (length, placed.inputs["Scale"]),
        (_corners(group, 21, -1500, placed.outputs["Instances"]), inked.inputs["Geometry"]),
    ):
        group.links.new(source, target)
    return inked.outputs["Geometry"]


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
    squared = _math(tree, 2, -300, "MULTIPLY", facing.outputs["Value"], facing.outputs["Value"])
    passed = _math(tree, 3, -300, "SUBTRACT", 1.0, squared)
    fading = _math(tree, 4, -300, "EXPONENT", _math(tree, 3, -500, "MULTIPLY", passed, -0.5 * _DEVIATIONS**2))
    front = _math(tree, 4, -500, "SUBTRACT", 1.0, place.outputs["Backfacing"])
    alpha = _math(tree, 5, -300, "MULTIPLY", _math(tree, 5, -500, "MULTIPLY", fading, base.outputs["Alpha"]), front)
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
    place = number = _math(tree, 2, 0, "ADD", number, rise.outputs["X"])
    if repeated:  # -1 and below have one colour, 0 and above repeat; on discs Cycles gives a little less than 7 for 7
        whole = _math(tree, 1, 400, "ROUND", number)
        place = _math(tree, 2, 200, "MODULO", _math(tree, 1, 200, "MAXIMUM", whole, -1.0), CLASSES)
    bounds = add_node(tree, "ShaderNodeMapRange", 3, 0, name=RANGE)
    ramp = add_node(tree, "ShaderNodeValToRGB", 4, 0, name=COLORS)
    tree.links.new(place, bounds.inputs["Value"])
    tree.links.new(bounds.outputs["Result"], ramp.inputs[0])
    # Lines in the middle of so many even steps of the range, where values beyond it end.
    part = _math(tree, 5, -300, "FRACT", _math(tree, 4, -300, "MULTIPLY", bounds.outputs["Result"], name=LINES))
    even = _math(tree, 3, -1000, "MULTIPLY", rise.outputs["Y"], name=EVEN)
    even = _math(tree, 4, -1000, "MINIMUM", even, _BROADEST)
    unknown = _math(tree, 3, -1200, "SUBTRACT", 1.0, rise.outputs["Z"])
    share = _math(tree, 4, -1200, "MULTIPLY", unknown, 0.5 * _LINE)
    line = _math(tree, 6, -300, "COMPARE", part, 0.5)
    tree.links.new(_math(tree, 5, -1000, "ADD", even, share), line.node.inputs[2])
    color = _mix(tree, 7, line, ramp.outputs["Color"], _DARK)
    below = _math(tree, 4, -600, "LESS_THAN", number, name=BELOW)
    above = _math(tree, 4, -800, "GREATER_THAN", number, name=ABOVE)
    beyond = _math(tree, 5, -600, "ADD", below, above)
    if hiding:
        _shine(tree, color, groups, hidden=beyond)
    else:
        _shine(tree, _mix(tree, 8, _math(tree, 6, -600, "MULTIPLY", beyond, name=GRAY), color, BEYOND), groups)


def _shine(tree, color, groups, hidden=None):
    """Give the surface a colour, and points of groups theirs; nothing is seen where a number, if there is one, is 1.

    By emission, so that colours read as in the legend, and by diffuse light, so that shapes show: see `shade` for their
    shares, and `dim_back` for the back side.
    """
    column = 9
    for name, group_color in groups.items():
        weight = add_node(tree, "ShaderNodeAttribute", column, -600, attribute_name=name, name=f"Group {name}")
        inside = _math(tree, column + 1, -600, "GREATER_THAN", weight.outputs["Fac"], 0.0)
        color = _mix(tree, column + 2, inside, color, group_color)
        column += 1
    column += 2 if groups else 0
    seen = add_node(tree, "ShaderNodeNewGeometry", column, -900)
    behind = _math(tree, column + 1, -900, "MULTIPLY", seen.outputs["Backfacing"], name=BACK)
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
    side = _math(tree, column + 2, 800, "MULTIPLY", _math(tree, column + 1, 1000, "SIGN", facing.outputs["Value"]), 1e6)
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


def _math(tree, column, y, operation, first, second=0.0, name=""):
    """Add a node that calculates, from one or two numbers or results of other nodes; return its result."""
    node = add_node(tree, "ShaderNodeMath", column, y, operation=operation)
    node.name = name or node.name
    for number, socket in zip((first, second), node.inputs, strict=False):
        if isinstance(number, bpy.types.NodeSocket):
            tree.links.new(number, socket)
        else:
            socket.default_value = number
    return node.outputs[0]


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
