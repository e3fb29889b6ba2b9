"""The table of measures of an object's parts, kept with its settings."""

from math import isfinite, nan

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty

from ...tools.measure_parts import PartRow
from .reading import fingerprint, metric


class MESHFREE_PG_part(bpy.types.PropertyGroup):
    """Measures of one part of the surface"""

    points: IntProperty(name="Points", description="How many points the part has", min=0, soft_max=1_000_000)
    area: FloatProperty(name="Area", description="Area of the part", unit="AREA", min=0.0)
    area_uncertainty: FloatProperty(
        name="Uncertainty of the Area", description="Within which the true area is expected", unit="AREA", min=0.0
    )
    boundary_length: FloatProperty(
        name="Boundary", description="Length of the boundary of the part", unit="LENGTH", min=0.0
    )
    length_uncertainty: FloatProperty(
        name="Uncertainty of the Boundary",
        description="Within which the true length of the boundary is expected",
        unit="LENGTH",
        min=0.0,
    )
    is_closed: BoolProperty(name="Closed", description="Whether a volume was measured within the part")
    volume: FloatProperty(name="Volume", description="Volume within a closed component", unit="VOLUME", min=0.0)
    volume_uncertainty: FloatProperty(
        name="Uncertainty of the Volume", description="Within which the true volume is expected", unit="VOLUME", min=0.0
    )
    has_mean: BoolProperty(name="Has a Mean", description="Whether the attribute has numbers in the part")
    mean: FloatProperty(
        name="Mean", description="Mean of the attribute by area, in world lengths", soft_min=-1e6, soft_max=1e6
    )
    root_mean_square: FloatProperty(
        name="Root Mean Square", description="Quadratic mean of the attribute by area, in world lengths", min=0.0
    )


def keep_rows(obj, rows, attribute: str):
    """Keep the measures of all parts, and the name of the attribute whose means are among them."""
    kept = obj.meshfree
    kept.parts.clear()
    for row in rows:
        part = kept.parts.add()
        part.is_closed, part.has_mean = isfinite(row.volume), isfinite(row.mean)
        for name, value in row._asdict().items():
            if value == value:
                setattr(part, name, value)
    kept.part_attribute, kept.parts_of = attribute, _state(obj)


def kept_rows(obj) -> list:
    """Return the kept measures."""
    return [_row(part) for part in obj.meshfree.parts]


def are_outdated(obj) -> bool:
    """Whether the points or the scale have changed since the measures were kept; quick enough for a panel."""
    state = _state(obj, glance=True)
    return bool(state) and state != obj.meshfree.parts_of


def _row(part):
    values = {name: getattr(part, name) for name in PartRow._fields}
    if not part.is_closed:
        values.update(volume=nan, volume_uncertainty=nan)
    if not part.has_mean:
        values.update(mean=nan, root_mean_square=nan)
    return PartRow(**values)


def _state(obj, glance=False):
    """Return a text of what areas depend on, empty if it takes long; scales up to rounding."""
    known = fingerprint(obj, glance)
    return known and f"{known} {' '.join(f'{value:.4g}' for value in metric(obj).reshape(-1))}"
