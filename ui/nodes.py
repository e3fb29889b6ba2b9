"""The node group of all displays: round points or discs for vertices, ellipsoids, strokes, and slopes within discs."""

import math

import bpy

from ..operators.objects.attributes import CORNER, DISC, RISE, SLOPE, SLOPE_2, SLOPE_OF, SOLID, TILT
from ..operators.objects.modifiers import DISPLAY_TAG, has_input, is_intact, new_group
from ..operators.objects.node_trees import TreeBuilder
from ..operators.objects.splats import BASE, HARMONIC, ROTATION, SCALE

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
TINT, OPACITY = "lb_tint", "lb_opacity"  # attributes of ellipsoids: the constant harmonic, and how opaque they are
DEVIATIONS = 2.0  # standard deviations at which the ellipsoid of a splat ends
_UNSEEN = f"{HARMONIC}*", "ply_*", ".splat_*", "lb_*"  # attributes of splats that do not show

_INPUTS = (  # of the display
    ("Radius", "Float", "Size of the points", {"subtype": "DISTANCE", "default_value": 0.01, "min_value": 0.0}),
    ("Material", "Material", "Colors of the points"),
    (MOST, "Int", "How many points the viewport draws at most, dots from half of that on; 0 for all", {"min_value": 0}),
    (DISCS, "Bool", f"Draw discs that lie in the surface, as the attribute {DISC} says"),
    (FILLED, "Bool", f"Draw dots as large as the discs of {DISC}, so that they leave no holes"),
    (SPLATS, "Bool", f"Draw ellipsoids, as the attributes {SCALE} and {ROTATION} say"),
    (SMOOTH, "String", "Attribute that changes within discs, by its slopes along the surface; empty for none"),
    (SOLID_NAME, "String", "Color attribute that gets the colors of what is shown, for Solid; empty for none"),
    (STROKES, "String", "Attribute with directions along the surface, which strokes show; empty for none"),
    (
        LENGTH,
        "Float",
        "Length of the strokes, 1 for a fortieth of the object",
        {"default_value": 1.0, "min_value": 0.0},
    ),
    (INK, "Material", "Color of the strokes"),
)


def display_group():
    """Return the node group that all displays share: round points where there are no faces, and the material."""
    for group in bpy.data.node_groups:
        if DISPLAY_TAG in group and group.library is None and is_intact(group) and has_input(group, SOLID_NAME):
            return group
    return _new_display()


def _new_display():
    """Make that group."""
    group = new_group("Mesh-Free Display", DISPLAY_TAG, _INPUTS)
    tree = TreeBuilder(group)
    given = tree.node("NodeGroupInput").outputs
    parts = tree.node("GeometryNodeSeparateComponents", given["Geometry"]).outputs
    neighbors = tree.node("GeometryNodeInputMeshVertexNeighbors").outputs["Face Count"]
    loose = tree.node("FunctionNodeCompare", neighbors, data_type="INT", operation="EQUAL")
    drawn, larger, many = _thinned(tree, given, parts)
    size = tree.math("MULTIPLY", given["Radius"], larger)
    chosen = tree.node("FunctionNodeBooleanMath", loose, drawn, operation="AND")
    points = tree.node("GeometryNodeMeshToPoints", parts["Mesh"], chosen, Radius=size)
    given_points = tree.node("GeometryNodeSetPointRadius", parts["Point Cloud"], Radius=size)
    given_drawn = tree.node("GeometryNodeSeparateGeometry", given_points, drawn)
    every = tree.node("GeometryNodeJoinGeometry", [given_drawn, points])
    disc = tree.attribute(DISC)
    model = _with_active_color(tree, parts["Mesh"], loose, _disc(tree))
    shaped = _shaped(tree, given, disc, model, every, size, many)
    faces = tree.node("GeometryNodeDeleteGeometry", parts["Mesh"], loose)  # loose vertices would be drawn over points
    joined = _in_solid(tree, given, tree.node("GeometryNodeJoinGeometry", [shaped, faces]))
    colored = tree.node("GeometryNodeSetMaterial", joined, Material=given["Material"])
    strokes = _stroked(tree, given, disc, every)
    tree.output("NodeGroupOutput", tree.node("GeometryNodeJoinGeometry", [colored, strokes]))
    return group


def _thinned(tree, given, parts):
    """Add the nodes that choose which points the viewport draws.

    They are chosen at random, so that no pattern of a scanner shows, and cover what all would. Return the nodes that
    tell whether a point is drawn, by what its radius grows, and whether there are too many for discs.
    """
    most = given[MOST]
    limited = tree.math("MULTIPLY", tree.math("GREATER_THAN", most, 0.0), tree.node("GeometryNodeIsViewport"))
    counts = [
        tree.node("GeometryNodeAttributeDomainSize", parts[part], component=component)
        for part, component in (("Mesh", "MESH"), ("Point Cloud", "POINTCLOUD"))
    ]
    count = tree.math("ADD", *counts)
    share = tree.math("MINIMUM", tree.math("DIVIDE", most, count), 1.0)
    share = tree.math("POWER", share, limited)  # one where there is no limit
    random = tree.node("FunctionNodeRandomValue", data_type="FLOAT")
    drawn = tree.math("LESS_THAN", random, tree.math("ADD", share, 1e-6))
    costly = tree.math("GREATER_THAN", tree.math("MULTIPLY", count, float(DISC_COST)), most)
    return drawn, tree.math("POWER", share, -0.5), tree.math("MULTIPLY", costly, limited)


def _shaped(tree, given, disc, model, points, size, many):
    """Add the nodes that make points into discs where that is asked for and they are not many; return what is drawn."""
    length = tree.vector("LENGTH", disc)
    unknown = tree.math("LESS_THAN", length, 1e-6)  # of points added since: like a dot
    reach = tree.math("ADD", length, unknown)
    discs = tree.node(
        "GeometryNodeInstanceOnPoints",
        _with_middles(tree, given, points),
        Instance=model,
        Rotation=tree.node("FunctionNodeAlignRotationToVector", Vector=disc, axis="Z"),
        Scale=tree.math("MULTIPLY", reach, size),
    )
    larger = tree.node("ShaderNodeMix", given[FILLED], 1.0, reach)
    dots = tree.node("GeometryNodeSetPointRadius", points, Radius=tree.math("MULTIPLY", larger, size))
    as_discs = tree.node("FunctionNodeBooleanMath", given[DISCS], many, operation="NIMPLY")
    chosen = tree.switch("GEOMETRY", as_discs, dots, _rising(tree, given, _corners(tree, discs)))
    return tree.switch("GEOMETRY", given[SPLATS], chosen, _ellipsoids(tree, points))


def _disc(tree):
    """Add the nodes that make a disc of radius 1 in the plane z = 0; return it.

    Flat discs stick out of each other where the surface bends outwards, like scales; cones as flat as these do not. A
    second cone that hangs from the rim of the first lets all normals be that of the disc, by which Solid shades.
    """
    outer = 1.0 / math.cos(math.pi / _SIDES)  # no less than a disc
    upper, lower = (
        tree.node(
            "GeometryNodeTransform",
            tree.node("GeometryNodeMeshCone", _SIDES, **radii, Depth=_SLOPE, fill_type="NONE"),
            Translation=(0.0, 0.0, low),
        )
        for radii, low in (
            ({"Radius Top": 0.0, "Radius Bottom": outer}, -_SLOPE),
            ({"Radius Top": outer, "Radius Bottom": 0.0}, -2.0 * _SLOPE),
        )
    )
    joined = tree.node("GeometryNodeJoinGeometry", [upper, tree.node("GeometryNodeFlipFaces", lower)])
    return tree.node("GeometryNodeSetShadeSmooth", tree.node("GeometryNodeMergeByDistance", joined))


def _with_active_color(tree, mesh, loose, disc):
    """Add the nodes that tell a disc which color attribute of a mesh is active, the one that Solid shows; return it.

    The name comes along with the first of the meshes that are joined: here one vertex without any values, which goes.
    """
    first = tree.math("LESS_THAN", tree.node("GeometryNodeInputIndex"), 0.5)
    alone = _without(tree, tree.node("GeometryNodeSeparateGeometry", mesh, first), "*")
    joined = tree.node("GeometryNodeJoinGeometry", [disc, alone])  # the later link is the first
    return tree.node("GeometryNodeDeleteGeometry", joined, loose)


def _without(tree, geometry, names):
    """Add a node that removes the attributes whose names fit; return it."""
    removed = tree.node("GeometryNodeRemoveAttribute", geometry, Name=names)
    if "Pattern Mode" in removed.inputs:  # since Blender 5
        removed.inputs["Pattern Mode"].default_value = "Wildcard"
    else:
        removed.pattern_mode = "WILDCARD"
    return removed


def _with_middles(tree, given, points):
    """Add the nodes that let points know their places, which the corners of their discs get too; return the points."""
    stored = tree.store(points, RISE, tree.node("GeometryNodeInputPosition"))
    return _where_named(tree, given[SMOOTH], points, stored)


def _rising(tree, given, corners):
    """Add the nodes that tell by how much what is shown rises from the middle of a disc to each corner.

    That of texture coordinates is x and y; that of a number is x, with y how steep it is, and z to tell that it is
    known. All is zero where values have changed since their slopes were found.
    """
    first, second = tree.attribute(SLOPE), tree.attribute(SLOPE_2)
    step = tree.vector("SUBTRACT", tree.node("GeometryNodeInputPosition"), tree.attribute(RISE))
    single = tree.math("SUBTRACT", 1.0, second.outputs["Exists"])
    steep = tree.math("MULTIPLY", tree.vector("LENGTH", first), single)
    across = tree.math("ADD", tree.vector("DOT_PRODUCT", step, second), steep)
    rise = tree.node("ShaderNodeCombineXYZ", tree.vector("DOT_PRODUCT", step, first), across, single)
    stored = tree.store(corners, RISE, tree.vector("SCALE", rise, _unchanged(tree, given)))
    return _where_named(tree, given[SMOOTH], corners, stored)


def _unchanged(tree, given):
    """Add the nodes that tell whether an attribute has the values that slopes were found of; return that, 1 or 0."""
    now, then = tree.attribute(given[SMOOTH], "FLOAT"), tree.attribute(SLOPE_OF, "FLOAT")
    rounding = tree.math("MULTIPLY", tree.math("ABSOLUTE", then), _ROUNDING)
    return tree.math("MULTIPLY", tree.math("COMPARE", now, then, rounding), then.outputs["Exists"])


def _in_solid(tree, given, geometry):
    """Add the nodes that put the colors of what is shown where viewports in Solid look for colors; return the geometry.

    Along a disc they change as fast as between its middle and its edge.
    """
    rise = tree.node("ShaderNodeSeparateXYZ", tree.attribute(RISE))
    change = tree.vector("SCALE", tree.attribute(TILT), rise)
    shown = tree.vector("ADD", tree.attribute(SOLID, "FLOAT_COLOR"), change)
    return _where_named(
        tree, given[SOLID_NAME], geometry, tree.store(geometry, given[SOLID_NAME], shown, "FLOAT_COLOR")
    )


def _where_named(tree, name, plain, other):
    """Add nodes that take the other geometry where an input of the display names something; else it costs no time."""
    asked = tree.node("FunctionNodeCompare", name, data_type="STRING", operation="NOT_EQUAL")
    return tree.switch("GEOMETRY", asked, plain, other)


def _ellipsoids(tree, points):
    """Add the nodes that make splats into ellipsoids of two standard deviations; return what is drawn."""
    for names in _UNSEEN:  # or each corner would get a copy
        points = _without(tree, points, names)
    base = tree.attribute(BASE, "FLOAT_COLOR")
    points = tree.store(points, OPACITY, tree.node("FunctionNodeSeparateColor", base).outputs["Alpha"], "FLOAT")
    points = _without(tree, tree.store(points, TINT, base), BASE)  # which Solid would take for colors, and draw black
    ball = tree.node("GeometryNodeMeshIcoSphere", DEVIATIONS, 1)
    placed = tree.node(
        "GeometryNodeInstanceOnPoints",
        points,
        Instance=tree.node("GeometryNodeSetShadeSmooth", ball),
        Rotation=tree.attribute(ROTATION, "QUATERNION"),
        Scale=tree.attribute(SCALE),
    )
    return _corners(tree, placed)


def _corners(tree, instances):
    """Add the nodes that make instances real, and mark their corners, which are no points."""
    return tree.store(tree.node("GeometryNodeRealizeInstances", instances), CORNER, True, "BOOLEAN")


def _stroked(tree, given, disc, points):
    """Add the nodes that draw directions along the surface as strokes a little above it; return the strokes.

    All strokes would hide each other where points are many. So of the points in each cell of a grid the first one that
    has a direction has a stroke, which points along it.
    """
    points = _where_named(tree, given[STROKES], None, points)  # else nothing below costs any time
    direction = tree.attribute(given[STROKES])
    box = tree.node("GeometryNodeBoundBox", points)
    for radius in box.inputs[1:]:  # which Blender 4.2 cannot leave out
        radius.default_value = False
    low, high = box.outputs["Min"], box.outputs["Max"]
    share = tree.math("MULTIPLY", tree.vector("DISTANCE", low, high), _SHARE)
    least = tree.math("MULTIPLY", given["Radius"], _LEAST)
    length = tree.math("MULTIPLY", tree.math("MAXIMUM", share, least), given[LENGTH])

    offset = tree.vector("SUBTRACT", tree.node("GeometryNodeInputPosition"), low)
    cell = tree.vector("FLOOR", tree.vector("SCALE", offset, tree.math("DIVIDE", 1.0 / _APART, length)))
    number = tree.vector("DOT_PRODUCT", tree.vector("MODULO", cell, (_CELLS,) * 3), (1.0, _CELLS, _CELLS**2))
    there = tree.math("GREATER_THAN", tree.vector("LENGTH", direction), 1e-6)
    before = tree.node("GeometryNodeAccumulateField", there, number, data_type="FLOAT", domain="POINT")
    first = tree.math("MULTIPLY", tree.math("LESS_THAN", before.outputs["Trailing"], 0.5), there)

    stroke = tree.node("GeometryNodeMeshCircle", 3, fill_type="NGON")  # a triangle, its first corner at x
    slim = tree.node(
        "GeometryNodeTransform",
        stroke,
        Translation=(-0.25 / 1.5, 0.0, 0.0),  # its middle
        Scale=(1.0 / 1.5, _SLIM / math.sqrt(3.0), 1.0),
    )
    along = tree.node("FunctionNodeAlignRotationToVector", Vector=direction, axis="X")
    flat = tree.node("FunctionNodeAlignRotationToVector", along, Vector=disc, axis="Z", pivot_axis="X")
    above = tree.vector("SCALE", tree.vector("NORMALIZE", disc), tree.math("MULTIPLY", given["Radius"], _LIFTED))
    lifted = tree.node("GeometryNodeSetPosition", points, Offset=above)
    placed = tree.node("GeometryNodeInstanceOnPoints", lifted, first, slim, Rotation=flat, Scale=length)
    return tree.node("GeometryNodeSetMaterial", _corners(tree, placed), Material=given[INK])
