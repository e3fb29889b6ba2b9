"""Settings and results of each object: `Object.meshfree`."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...tools.laplacian import LAPLACIAN
from . import deform_settings, notices, parts
from .color_choices import color_choice
from .handlers import notify, telling
from .properties import property_of, with_properties

_recolor = telling("colors_changed")
_resize = telling("size_changed")
_reshape = telling("shape_changed")
_show_groups = telling("groups_changed")


def _recolor_locked(settings, context):
    """Follow bounds that are set; in other modes they only show the resulting range."""
    if settings.range_mode == "LOCKED":
        _recolor(settings, context)


def _redraw(settings, context):
    notify("views_changed")


def _measure_again(settings, _context):
    notify("measuring_changed")


class MESHFREE_PG_stage(bpy.types.PropertyGroup):
    """How long one stage of the last analysis took"""

    seconds: FloatProperty(name="Seconds", description="Time that this stage took, in seconds", min=0.0)


class MESHFREE_PG_settings(with_properties(LAPLACIAN.values()), bpy.types.PropertyGroup):
    """Settings and results of the Mesh-Free Laplacian for one object"""

    # What else results depend on.
    bandwidth_factor: property_of(LAPLACIAN["bandwidth_factor"], step=5)
    use_modifiers: BoolProperty(
        name="Use Modifiers",
        description="Read the points after the modifiers, which must keep their number and order",
        default=False,
    )
    point_budget: EnumProperty(
        name="Point Budget",
        description="How many points Analyze Points and Compute Modes work on; results of a subset, evenly spread over"
        " the surface, are transferred to all points. Other tools always take all",
        items=(
            ("AUTO", "Automatic", "All points if the free memory is enough for them, else a subset that fits well"),
            ("ALL", "All Points", "Every point, or a message that says how many fit the free memory"),
            ("NUMBER", "Most Points", "A subset of the number below where there are more points"),
        ),
        default="AUTO",
    )
    most_points: IntProperty(
        name="Most Points",
        description="How many points to analyze at most, with Point Budget set to Most Points",
        default=1_000_000,
        min=1000,
        soft_max=10_000_000,
    )
    make_single_user: BoolProperty(
        name="Make Single User",
        description="Give the object a mesh of its own if it shares its mesh with other objects",
        default=False,
    )

    # Choices of the panel.
    modes: IntProperty(
        name="Modes",
        description="How many vibration modes to compute, the constant one included",
        default=10,
        min=1,
        soft_max=100,
    )
    color_map: color_choice("color_map", update=_recolor)
    reverse: color_choice("reverse", update=_recolor)
    range_mode: color_choice("range_mode", update=_recolor)
    coverage: color_choice("coverage", update=_recolor)
    range_low: FloatProperty(
        name="From", description="Value of the first color", default=0.0, precision=4, update=_recolor_locked
    )
    range_high: FloatProperty(
        name="To", description="Value of the last color", default=1.0, precision=4, update=_recolor_locked
    )
    outside: EnumProperty(
        name="Out of Range",
        description="Display of points whose values lie outside the range",
        items=(
            ("CLAMP", "End Colors", "In the color of the nearer end"),
            ("GRAY", "Gray", "In dark gray"),
            ("HIDE", "Hidden", "Hidden, in Material Preview and renders"),
        ),
        default="CLAMP",
        update=_recolor,
    )
    iso_lines: IntProperty(
        name="Iso Lines",
        description="Number of dark lines at even steps of the color range, such as lines of equal distance; 0 for"
        " none",
        default=0,
        min=0,
        soft_max=50,
        update=_recolor,
    )
    component: EnumProperty(
        name="Vector",
        description="Part of vectors that is shown",
        items=(
            ("AUTO", "Automatic", "The length of displacements, the direction of normals"),
            ("DIRECTION", "Direction", "Red, green and blue for the directions x, y and z"),
            ("LENGTH", "Length", "The length as a number"),
            ("X", "X", "The x component as a number"),
            ("Y", "Y", "The y component as a number"),
            ("Z", "Z", "The z component as a number"),
        ),
        default="AUTO",
        update=_recolor,
    )
    point_size: FloatProperty(
        name="Point Size",
        description="Radius of the points as a multiple of their spacing, which it follows when they change",
        default=1.1,
        min=0.01,
        soft_max=3.0,
        max=100.0,
        step=5,
        update=_resize,
    )
    point_shape: EnumProperty(
        name="Point Shape",
        description="Shape of the points, once Show as Surface has computed their discs",
        items=(
            (
                "DISCS",
                "Discs",
                "Discs tangent to the surface, as large as the gaps between the points; of splats ellipsoids",
            ),
            ("DOTS", "Dots", "Round dots of one size"),
        ),
        default="DISCS",
        update=_reshape,
    )
    strokes: BoolProperty(
        name="Strokes",
        description="Draw strokes along displayed tangent directions",
        default=True,
        update=_reshape,
    )
    smooth: BoolProperty(
        name="Smooth Colors",
        description="Interpolate colors within discs by the gradient of the values; otherwise each disc has the one"
        " color of its point, as labels and directions have",
        default=True,
        update=_recolor,
    )
    shaded: FloatProperty(
        name="Shaded",
        description="How the form is seen in Material Preview and renders: 0 flat colors, as in the legend; 0.5 as if"
        " lit beside the camera, whatever the lights; 1 by the lights of the scene alone. Solid has shading of its own",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_recolor,
    )
    dim_back: BoolProperty(
        name="Dim Back Side",
        description="Darken discs that are seen from behind, such as those of the inside of an open scan",
        default=False,
        update=_recolor,
    )
    show_groups: BoolProperty(
        name="Group Colors",
        description="Color the points of the groups that tools use, on top of the display",
        default=False,
        update=_show_groups,
    )
    legend: BoolProperty(
        name="Legend", description="Draw the colors with their values over the 3D view", default=True, update=_redraw
    )
    legend_place: FloatVectorProperty(
        name="Legend Place",
        description="Relative position of the legend in the 3D view; drag it with the mouse",
        default=(1.0, 0.0),
        min=0.0,
        max=1.0,
        size=2,
        update=_redraw,
    )
    histogram: BoolProperty(
        name="Histogram",
        description="Draw over the 3D view how often each value occurs, with the range of the colors",
        default=False,
        update=_redraw,
    )
    plot_eigenvalues: BoolProperty(
        name="Plot", description="Draw the eigenvalues over the 3D view", default=False, update=_redraw
    )
    compare_weyl: BoolProperty(
        name="Weyl's Law",
        description="Draw a line for comparison at 4 pi k / area, which the eigenvalues of any surface approach",
        default=True,
        update=_redraw,
    )
    volume_over: EnumProperty(
        name="Volume Over",
        description="The plane or surface from which the volume under selected points is measured",
        items=(
            ("RIM", "Rim", "The plane through the rim of the selection, as of a heap on the ground"),
            ("LEVEL", "Height", "The horizontal plane at a height"),
            ("OBJECT", "Object", "The local XY plane of an object, such as an empty"),
            ("POINTS", "Points", "The surface of another object's points: fill above it and cut below, along Z"),
        ),
        default="RIM",
        update=_measure_again,
    )
    volume_height: FloatProperty(
        name="Height",
        description="Height of the horizontal plane in the world",
        default=0.0,
        soft_min=-1000.0,
        soft_max=1000.0,
        subtype="DISTANCE",
        update=_measure_again,
    )
    volume_plane: StringProperty(
        name="Plane of Volume",
        description="Object whose local XY plane volumes are measured from, its Z axis to what is above, or whose"
        " points",
        update=_measure_again,
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Typical distance of neighboring points when the Point Size was applied, in local lengths",
        min=0.0,
        subtype="DISTANCE",
    )
    own_material: PointerProperty(
        type=bpy.types.Material,
        name="Own Material",
        description="Material of the first slot that the display shows and follows",
    )
    profile: PointerProperty(type=bpy.types.Text, name="Profile", description="Text with the table of the last profile")
    shown_before: StringProperty(
        name="Shown Before", description="What was shown before stray points were; empty for no display"
    )
    slopes_of: StringProperty(name="Slopes of", description="What is shown with slopes, and its checksum")
    slopes_later: BoolProperty(name="Slopes Later", description="Whether slopes of what is shown are still to be found")
    spacing_of: StringProperty(name="Spacing of", description="Checksum of the points whose spacing was measured")
    discs_of: StringProperty(name="Discs of", description="Checksum of the points whose discs were found")
    colors_behind: BoolProperty(
        name="Colors Behind",
        description="Whether colors for Solid are outdated, since Edit Mode prevents writing them",
    )

    motion_file: StringProperty(
        name="Motion File", description="File with the frames of the motion on the surface; empty for none"
    )
    motion_first: IntProperty(
        name="First Frame", description="Frame of the scene with which the motion begins", min=0, soft_max=1000
    )
    motion_step: IntProperty(
        name="Frame Step",
        description="Frames of the scene from one frame on disk to the next",
        default=1,
        min=1,
        soft_max=100,
    )
    notices: CollectionProperty(
        type=notices.MESHFREE_PG_notice, name="Notices", description="Notices of tools, until dismissed"
    )
    deform: PointerProperty(
        type=deform_settings.MESHFREE_PG_deform, name="Deform", description="How the object follows handles"
    )

    # Results of the last analysis, for the panel and for scripts.
    total_area: FloatProperty(name="Total Area", description="Area of the whole surface", unit="AREA", min=0.0)
    trusted_area: FloatProperty(
        name="Trusted Area", description="Area of the parts whose results are not in doubt", unit="AREA", min=0.0
    )
    point_count: IntProperty(name="Points", description="How many points the last analysis had", min=0)
    subset_count: IntProperty(
        name="Points in the Subset",
        description="How many points the last analysis worked on, whose results were transferred to all; 0 if on all",
        min=0,
    )
    component_count: IntProperty(name="Components", description="How many components the surface has", min=0)
    boundary_count: IntProperty(
        name="Boundary Points", description="How many points lie at a boundary of the surface", min=0
    )
    left_out_count: IntProperty(
        name="Points Left Out", description="How many points are outliers or in small components", min=0
    )
    stages: CollectionProperty(
        type=MESHFREE_PG_stage, name="Stages", description="How long each stage of the last analysis took"
    )
    compared_with: PointerProperty(
        type=bpy.types.Object, name="Compared With", description="Object that the last comparison measured from"
    )
    compared_nearest: BoolProperty(
        name="Compared by Nearest",
        description="Whether the last comparison measured the nearest distance",
        options={"HIDDEN"},
    )
    compared_within: FloatProperty(
        name="Compared Within",
        description="Greatest distance of the last comparison; 0 for any distance",
        min=0.0,
        subtype="DISTANCE",
    )
    parts: CollectionProperty(
        type=parts.MESHFREE_PG_part, name="Parts", description="Measures of components and segments"
    )
    part_attribute: StringProperty(name="Attribute of the Means", description="Whose means the measures of parts hold")
    parts_of: StringProperty(name="Parts of", description="Checksum of the points whose parts were measured")
    fingerprint: StringProperty(name="Fingerprint", description="Checksum of the points that were analyzed")
    metric: FloatVectorProperty(name="Metric", description="Scale and shear that were analyzed", size=9)
    settings_used: StringProperty(name="Settings Used", description="Settings of the last analysis")


CLASSES = (
    MESHFREE_PG_stage,
    parts.MESHFREE_PG_part,
    *notices.PROPERTY_GROUPS,
    *deform_settings.CLASSES,
    MESHFREE_PG_settings,
)


def attach():
    """Add the settings to objects."""
    bpy.types.Object.meshfree = PointerProperty(
        type=MESHFREE_PG_settings,
        name="Mesh-Free Laplacian",
        description="Settings and results of the Mesh-Free Laplacian for this object",
    )


def detach():
    """Remove the settings from objects."""
    del bpy.types.Object.meshfree
