"""Choices of colours, for the settings of objects and for the operator that shows colors."""

from functools import partial

from bpy.props import BoolProperty, EnumProperty, FloatProperty

_COLOR_MAPS = (
    (
        "AUTO",
        "Automatic",
        "Cool to Warm for signed values, a color each for few whole numbers, for true or false, and for classes of"
        " lidar, Viridis otherwise",
    ),
    ("VIRIDIS", "Viridis", "From dark blue to yellow, in even steps to the eye"),
    ("MAGMA", "Magma", "From black over red to light yellow, in even steps to the eye"),
    ("COOL_WARM", "Cool to Warm", "From blue over light gray to red, centered on zero"),
    ("CYCLIC", "Cyclic", "Through all hues back to the first one, for angles and phases"),
    ("CATEGORICAL", "Categorical", "A color for each whole number; seven, which then repeat"),
    (
        "LIDAR",
        "Lidar Classes",
        "Brown ground, green plants, red buildings, blue water: the classes of LAS files, 0 to 30",
    ),
)
_RANGE_MODES = (
    (
        "AUTO",
        "Automatic",
        "Symmetric for Cool to Warm and signed values, Data for Cyclic, Percentile otherwise",
    ),
    ("DATA", "Data", "From the least to the greatest value"),
    ("PERCENTILE", "Percentile", "Between percentiles, so that the share Coverage of the values is inside"),
    ("SYMMETRIC", "Symmetric", "As far below zero as above, so that the share Coverage of the values is inside"),
    ("LOCKED", "Locked", "The values below, whatever is shown"),
)
_CHOICES = {
    "color_map": partial(
        EnumProperty,
        name="Color Map",
        description="Colors from low to high values",
        items=_COLOR_MAPS,
        default="AUTO",
    ),
    "reverse": partial(BoolProperty, name="Reverse", description="Reverse the color map", default=False),
    "range_mode": partial(
        EnumProperty,
        name="Range",
        description="Which values the colors cover",
        items=_RANGE_MODES,
        default="AUTO",
    ),
    "coverage": partial(
        FloatProperty,
        name="Coverage",
        description="Share of the values inside the color range, so that a few outliers do not dominate",
        default=98.0,
        min=50.0,
        max=100.0,
        subtype="PERCENTAGE",
    ),
}
COLOR_CHOICES = tuple(_CHOICES)


def color_choice(name: str, **more):
    """Return the property of a choice, to annotate a class, with further arguments."""
    return _CHOICES[name](**more)
