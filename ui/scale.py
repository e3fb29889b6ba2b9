"""The contents of a legend: title, unit, colours, and the numbers beside them."""

from typing import NamedTuple

from ..command.ticks import round_ticks, tick_texts
from ..command.units import attribute_power, unit
from .display import (
    color_node,
    find_material,
    is_colored,
    label,
    range_node,
    shown_attribute,
    shown_range,
    shows_zeros,
    step_colors,
)
from .materials import CHECKER, direction_color, is_checkered

_DIRECTIONS = {
    "+X": (1, 0, 0),
    "+Y": (0, 1, 0),
    "+Z": (0, 0, 1),
    "-X": (-1, 0, 0),
    "-Y": (0, -1, 0),
    "-Z": (0, 0, -1),
}
_MOST_BOXES = 12


class Scale(NamedTuple):
    """The colours of an attribute and their values."""

    title: str
    unit: str  # empty for plain numbers
    factor: float  # conversion of values to that unit
    bounds: tuple | None  # range of the values; None where directions are shown
    colors: list  # linear (r, g, b, 1) at even steps from low to high; none where each box has its own
    boxes: dict  # colours by the names of whole numbers, truth values or directions
    ticks: list  # (float, str), round numbers: relative position in the range, and text

    @property
    def full_title(self) -> str:
        """The title with the unit, if there is one."""
        return f"{self.title} ({self.unit})" if self.unit else self.title


def shown_scale(obj, scene) -> Scale | None:
    """Return the scale of what an object shows, in units of a scene; None if it shows nothing, or colors of its own."""
    name = shown_attribute(obj)
    if not name or is_colored(obj):
        return None
    title = label(name)
    if range_node(obj) is None:
        if is_checkered(find_material(obj)):
            return Scale(title, "", 1.0, None, [], CHECKER, [])
        boxes = {text: direction_color(direction) for text, direction in _DIRECTIONS.items()}
        return Scale(title, "", 1.0, None, [], boxes, [])
    low, high = shown_range(obj)
    boxes = {"All Zero": tuple(color_node(obj).color_ramp.evaluate(0.5))} if shows_zeros(obj) else step_colors(obj)
    if boxes:
        return Scale(title, "", 1.0, (low, high), [], _shortened(boxes), [])
    symbol, factor = unit(attribute_power(name), max(abs(low), abs(high)), scene.unit_settings)
    ticks = round_ticks(factor * low, factor * high, most=8)
    shares = [(tick - factor * low) / (factor * (high - low)) for tick in ticks]
    colors = [tuple(element.color) for element in color_node(obj).color_ramp.elements]
    return Scale(title, symbol, factor, (low, high), colors, {}, list(zip(shares, tick_texts(ticks), strict=True)))


def _shortened(boxes):
    """Keep the first boxes, and add one with the number of the others."""
    if len(boxes) <= _MOST_BOXES:
        return boxes
    kept = dict(list(boxes.items())[: _MOST_BOXES - 1])
    return kept | {f"{len(boxes) - len(kept)} more": (0.0, 0.0, 0.0, 0.0)}
