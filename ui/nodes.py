"""The node group of all displays: round points or discs for vertices, ellipsoids, strokes, and slopes within discs."""

import math
from functools import partial

import bpy

from ..operators.objects.attributes import CORNER, DISC, RISE, SLOPE, SLOPE_2, SLOPE_OF, SOLID, TILT
from ..operators.objects.modifiers import (
    DISPLAY_TAG,
    add_input,
    add_math,
    add_node,
    has_input,
    is_intact,
    new_group,
)
from ..operators.objects.splats import HARMONIC, ROTATION, SCALE

MOST = "Viewport Points"  # input of the display: how many it draws there
DISCS = "Discs"  # another: whether it draws discs
STROKES = "Strokes"  # another: the attribute that has them
FILLED = "Filled"  # another: whether dots are as large as discs
SPLATS = "Splats"  # another: whether it draws their ellipsoids
SMOOTH = "Smooth"  # another: the attribute that changes within discs
SOLID_NAME = "Solid Colors"  # another: the color attribute that viewports in Solid look at
LENGTH, INK = "Stroke Length", "Stroke Material"  # others: what they look like
DISC_COST = 2  # dots that take as long to draw without a graphics card as one disc
_SIDES = 6  # of a disc
_SLOPE = 0.25  # by which discs fall off from their points, so that each place shows the point nearest to it
_SHARE = 1.0 / 40.0  # length of strokes in the diagonal of the object, so that they are seen where all of it is
_LEAST = 2.0  # that length in radii of the points at least
_SLIM = 0.16  # width of a stroke in its length
_APART = 0.5  # how far strokes are apart, in their lengths
_LIFTED = 0.2  # how far they lie above the surface, in radii of the points
_CELLS = 256.0  # of the grid that spreads strokes, along each axis, beyond which it repeats: single precision tells
_ROUNDING = 1e-5  # share by which values may differ that are the same
DEVIATIONS = 2.0  # standard deviations at which the ellipsoid of a splat ends
_UNSEEN = f"{HARMONIC}*", "ply_*", ".splat_*", "lb_*"  # attributes of splats that do not show


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
    limited = add_math(group, 3, -1200, "GREATER_THAN", given.outputs[MOST], 0.0)
    limited = add_math(group, 4, -1200, "MULTIPLY", limited, viewport.outputs[0])
    count = add_math(group, 3, -800, "ADD", *(node.outputs["Point Count"] for node in counts))
    share = add_math(group, 4, -800, "MINIMUM", add_math(group, 3, -1000, "DIVIDE", given.outputs[MOST], count), 1.0)
    share = add_math(group, 5, -800, "POWER", share, limited)  # one where there is no limit
    random = add_node(group, "FunctionNodeRandomValue", 5, -1000, data_type="FLOAT")
    drawn = add_math(
        group, 6, -1000, "LESS_THAN", random.outputs["Value"], add_math(group, 6, -800, "ADD", share, 1e-6)
    )
    costly = add_math(group, 4, -1400, "MULTIPLY", count, float(DISC_COST))
    costly = add_math(group, 5, -1400, "GREATER_THAN", costly, given.outputs[MOST])
    return drawn, add_math(group, 6, -600, "POWER", share, -0.5), add_math(group, 6, -1400, "MULTIPLY", costly, limited)


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
    unknown = add_math(group, 7, -1300, "LESS_THAN", length.outputs["Value"], 1e-6)  # of points added since: like a dot
    reach = add_math(group, 7, -1100, "ADD", length.outputs["Value"], unknown)
    scale = add_math(group, 7, -900, "MULTIPLY", reach, size)
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
        (add_math(group, 9, -700, "MULTIPLY", larger.outputs["Result"], size), dots.inputs["Radius"]),
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
    first = add_math(group, 3, 400, "LESS_THAN", place.outputs[0], 0.5)
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
    single = add_math(group, 10, -2900, "SUBTRACT", 1.0, second.outputs["Exists"])
    combined = add_node(group, "ShaderNodeCombineXYZ", 12, -2300)
    valid = add_node(group, "ShaderNodeVectorMath", 13, -2500, operation="SCALE")
    stored, value = _stored(group, 14, -2300, RISE, "FLOAT_VECTOR")
    steep_or_none = add_math(group, 11, -2700, "MULTIPLY", steep.outputs["Value"], single)
    for source, target in (
        (place.outputs["Position"], step.inputs[0]),
        (middle.outputs["Attribute"], step.inputs[1]),
        (step.outputs[0], along.inputs[0]),
        (step.outputs[0], across.inputs[0]),
        (first.outputs["Attribute"], along.inputs[1]),
        (second.outputs["Attribute"], across.inputs[1]),
        (first.outputs["Attribute"], steep.inputs[0]),
        (along.outputs["Value"], combined.inputs["X"]),
        (add_math(group, 11, -2500, "ADD", across.outputs["Value"], steep_or_none), combined.inputs["Y"]),
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
    same = add_math(group, 11, -3100, "COMPARE", now.outputs["Attribute"], then.outputs["Attribute"])
    size = add_math(group, 10, -3300, "ABSOLUTE", then.outputs["Attribute"])
    group.links.new(add_math(group, 10, -3500, "MULTIPLY", size, _ROUNDING), same.node.inputs[2])
    return add_math(group, 12, -3100, "MULTIPLY", same, then.outputs["Exists"])


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
    ball.inputs["Radius"].default_value, ball.inputs["Subdivisions"].default_value = DEVIATIONS, 1
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
    there = add_math(group, 8, -1700, "GREATER_THAN", size.outputs["Value"], 1e-6)
    box = add_node(group, "GeometryNodeBoundBox", 7, -1500)
    for radius in box.inputs[1:]:  # which Blender 4.2 cannot leave out
        radius.default_value = False
    diagonal = add_node(group, "ShaderNodeVectorMath", 8, -1500, operation="DISTANCE")
    share = add_math(group, 9, -1500, "MULTIPLY", diagonal.outputs["Value"], _SHARE)
    least = add_math(group, 9, -1300, "MULTIPLY", given.outputs["Radius"], _LEAST)
    length = add_math(
        group, 11, -1500, "MULTIPLY", add_math(group, 10, -1500, "MAXIMUM", share, least), given.outputs[LENGTH]
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
    first = add_math(
        group, 18, -1900, "MULTIPLY", add_math(group, 17, -1900, "LESS_THAN", before.outputs["Trailing"], 0.5), there
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
        (add_math(group, 11, -2100, "DIVIDE", 1.0 / _APART, length), cell.inputs["Scale"]),
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
        (add_math(group, 17, -2500, "MULTIPLY", given.outputs["Radius"], _LIFTED), above.inputs["Scale"]),
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
