"""Wrapping of texts in panels: Blender elides the middle of a line that does not fit."""

import re

import blf
import bpy

_FONT = 0  # Blender's own
_MARGIN = 38.0  # around what is in a panel, in units of the user interface
_TABS = 20.0  # of a sidebar
_ICON = 20.0
_WORD = re.compile(r"\S*\d (?:%|[a-zµ]{0,2}m[²³]?)(?!\w)\S*|\S+")  # a number stays with its unit
_PADDING = 12.0  # of a button beside its text
_SPLIT = 210.0  # width above which names are drawn before settings
_DIALOG = 300.0  # width of a dialog


def draw_text(layout, context, text: str, icon: str = "NONE", taken: float = 0.0):
    """Draw a text as labels, one below the other, wrapped to the width of the region.

    `taken` is the width of other items in its row, or around it, in units of the user interface.
    """
    column = layout.column(align=True)
    for line in wrapped(text, _room(context, taken + (_ICON if icon != "NONE" else 0.0)), _measure(context)):
        column.label(text=line, icon=icon)
        icon = "BLANK1" if icon != "NONE" else icon


def beside_or_below(layout, context, *texts: str):
    """Return a row for items of equal width with these texts; a column if one would not fit."""
    measure = _measure(context)
    widest = max(map(measure, texts)) + _PADDING * context.preferences.system.ui_scale
    return (layout.row if len(texts) * widest <= _room(context, 0.0) else layout.column)(align=True)


def fitting(context, taken: float, *texts: str) -> str:
    """Return the first of some texts that fits into a line beside other items, or the last one."""
    measure, room = _measure(context), _room(context, taken)
    return next((text for text in texts[:-1] if measure(text) <= room), texts[-1])


def split_properties(layout, context):
    """Draw names of settings before them, or within them if there is no room."""
    layout.use_property_split = _room(context, 0.0) >= _SPLIT * context.preferences.system.ui_scale
    layout.use_property_decorate = False


def split_where_it_fits(layout, context, setting):
    """Draw the name of a setting, an item of `bl_rna.properties`, within it or after its box if there is no room."""
    share, beside = (0.6, _ICON) if setting.type == "BOOLEAN" else (0.4, 0.0)
    room = share * _room(context, 0.0) - beside * context.preferences.system.ui_scale
    layout.use_property_split = layout.use_property_split and _measure(context)(setting.name) <= room


def wrapped(text: str, room: float, measure) -> list:
    """Break a text between words into lines that fit into some room, by a function that measures a line."""
    lines = []
    for word in _WORD.findall(text):
        if lines and measure(f"{lines[-1]} {word}") <= room:
            lines[-1] = f"{lines[-1]} {word}"
        else:
            lines.append(word)
    return lines


def _room(context, taken):
    """Return the pixels that a line of text may take in a panel, or in a dialog."""
    region, area, scale = context.region, context.area, context.preferences.system.ui_scale
    if region is None and bpy.app.background:
        return float("inf")
    if region is not None and (region.type in {"UI", "HUD"} or (area is not None and area.type == "PROPERTIES")):
        tabs = _TABS if region.type == "UI" else 0.0
        left, right = (region.view2d.region_to_view(x, 0.0)[0] for x in (0.0, region.width))  # it may be zoomed
        return right - left - scale * (_MARGIN + tabs + taken)
    return scale * (_DIALOG - _MARGIN - taken)  # the region is where a dialog came from, if there is one


def _measure(context):
    """Return a function that gives the width of a text as panels write it, in pixels."""
    points = context.preferences.ui_styles[0].widget.points
    blf.size(_FONT, points * context.preferences.system.ui_scale)
    return lambda text: blf.dimensions(_FONT, text)[0]
