"""Settings that limit the weights of a point, for all tools that make weights."""

from bpy.props import FloatProperty, IntProperty


def influences(default):
    """How many bones a point follows at most."""
    return IntProperty(
        name="Influences",
        description="How many bones a point follows at most; 0 for any number, in point clouds and splats 4 at most",
        default=default,
        min=0,
        soft_max=8,
        max=999,
    )


def least_weight():
    """From which on weights are kept."""
    return FloatProperty(
        name="Least Weight",
        description="Smaller weights become zero; the largest of a point stays",
        default=0.01,
        min=0.0,
        max=0.5,
        subtype="FACTOR",
    )
