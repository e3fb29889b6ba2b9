"""The table of measures in the panel, and its texts, in the units of the scene."""

from math import ceil, floor, isfinite, log10

import bpy

from ..command.units import attribute_power, unit
from ..operators.objects.parts import are_outdated, kept_rows
from ..operators.registration import Registration, Row
from ..operators.running.ready import ReadyOperator
from ..operators.tools.measure_live import followed
from ..tools.quantities import quantity
from .wrapping import beside_or_below, draw_text, split_properties

_SHOWN = 8  # parts in the panel
_MOST = 7  # digits, as single precision keeps them
_DIGITS = 4  # of numbers without an uncertainty


def rounded(value: float, uncertainty: float) -> tuple:
    """Write a number and its uncertainty with as many decimals as that leaves: one digit of it, or two after a 1.

    The uncertainty is rounded up.
    """
    if not uncertainty > 0.0:
        return f"{value:.{_DIGITS}g}", "0"
    exponent = floor(log10(uncertainty))
    decimals = (1 if uncertainty < 2.0 * 10.0**exponent else 0) - exponent
    if value:
        decimals = min(decimals, _MOST - 1 - floor(log10(abs(value))))
    steps = ceil(uncertainty * 10.0**decimals * (1.0 - 1e-6))
    return tuple(f"{round(number, decimals):.{max(decimals, 0)}f}" for number in (value, steps * 10.0**-decimals))


def columns(obj, settings) -> list:
    """Return the columns of an object's table as texts: title with the unit, and a pair of texts for each part.

    Units are as the settings of a scene say. A pair is a number and its uncertainty, which is empty where there is
    none.
    """
    rows, attribute = kept_rows(obj), obj.meshfree.part_attribute
    label = quantity(attribute).label or attribute
    kinds = (
        ("Area", "area", "area_uncertainty", 2),
        ("Boundary", "boundary_length", "length_uncertainty", 1),
        ("Volume", "volume", "volume_uncertainty", 3),
        (f"Mean {label}", "mean", "", attribute_power(attribute)),
        (f"Root Mean Square {label}", "root_mean_square", "", attribute_power(attribute)),
    )
    found = []
    for title, name, off, power in kinds:
        values = [getattr(row, name) for row in rows]
        known = [abs(value) for value in values if isfinite(value)]
        if not any(known):
            continue
        raised, factor = unit(power, max(known), settings)
        offs = [getattr(row, off) for row in rows] if off else [None] * len(rows)
        cells = [_cell(value, doubt, factor) for value, doubt in zip(values, offs, strict=True)]
        found.append((f"{title} ({raised})" if raised else title, cells))
    return found


def _cell(value, uncertainty, factor):
    if not isfinite(value):
        return "", ""
    if uncertainty is None:
        return f"{value * factor:.{_DIGITS}g}", ""
    return rounded(value * factor, uncertainty * factor)


def as_text(obj, settings) -> str:
    """Return an object's table with tabs, a line for each part, as spreadsheets take it."""
    found = columns(obj, settings)
    titles = ["Part", "Points"]
    for title, cells in found:
        titles += [title, "±"] if any(off for _, off in cells) else [title]
    lines = ["\t".join(titles)]
    for number, row in enumerate(kept_rows(obj)):
        texts = [row.name, str(row.points)]
        for _, cells in found:
            texts += cells[number] if any(off for _, off in cells) else cells[number][:1]
        lines.append("\t".join(texts))
    return "\n".join(lines) + "\n"


def draw_measures(layout, context):
    """Draw the table of the active object, if it has one, with the buttons that take it elsewhere."""
    obj = context.object
    rows = kept_rows(obj)[:_SHOWN]
    if not rows:
        return
    found = columns(obj, context.scene.unit_settings)
    for number, row in enumerate(rows):
        column = layout.column(align=True)
        draw_text(column, context, f"{row.name}: {row.points:,} points")
        for title, cells in found:
            value, off = cells[number]
            if value:
                _draw_line(column, context, title, f"{value} ± {off}" if off else value)
    left = len(obj.meshfree.parts) - len(rows)
    if left:
        draw_text(layout, context, f"and {left:,} more, which Copy and Export hold, too")
    if are_outdated(obj):
        draw_text(layout, context, "Measures are stale: measure the parts again", "ERROR")
    row = layout.row(align=True)
    row.operator("meshfree.copy_measures", text="Copy")
    row.operator("meshfree.export_measures", text="Export CSV...")


def _draw_line(layout, context, title, text):
    line = beside_or_below(layout, context, title, text)
    line.label(text=title)
    line.label(text=text)


def draw_selection(layout, context):
    """Draw the button that lets measures follow the selection of the active object, the plane, and the figures."""
    obj, known = context.object, followed(context.object)
    layout.operator("meshfree.measure_live", depress=known is not None)
    column = layout.column(align=True)
    split_properties(column, context)
    column.prop(obj.meshfree, "volume_over")
    if obj.meshfree.volume_over == "LEVEL":
        column.prop(obj.meshfree, "volume_height")
    elif obj.meshfree.volume_over in {"OBJECT", "POINTS"}:
        text = "Plane" if obj.meshfree.volume_over == "OBJECT" else "Points"
        column.prop_search(obj.meshfree, "volume_plane", context.scene, "objects", text=text)
    if known is None:
        return
    box = layout.box().column(align=True)
    for figure in known.figures:
        _draw_line(box, context, figure.title, figure_text(figure, context.scene.unit_settings))
    for notice in known.notices:
        draw_text(box, context, notice, "INFO")


def figure_text(figure, settings) -> str:
    """Write a measure with its uncertainty and its unit."""
    raised, factor = unit(figure.power, max(figure.uncertainty, *map(abs, figure.values)), settings)
    numbers = [rounded(value * factor, figure.uncertainty * factor) for value in figure.values]
    text = " x ".join(number for number, _ in numbers)
    if figure.uncertainty > 0.0:
        text = f"{text} ± {numbers[0][1]}"
    return f"{text} {raised}".rstrip()


class MESHFREE_OT_copy_measures(ReadyOperator, bpy.types.Operator):
    """Copy the measures of the parts to the clipboard, with tabs, as spreadsheets take them"""

    bl_idname = "meshfree.copy_measures"
    bl_label = "Copy Measures"
    bl_options = {"REGISTER"}  # the scene is not changed

    @classmethod
    def lack(cls, context, obj):
        return "" if len(obj.meshfree.parts) else f'"{obj.name}" has no measures. Press Measure Parts first'

    def execute(self, context):
        context.window_manager.clipboard = as_text(context.object, context.scene.unit_settings)
        self.report({"INFO"}, f"{len(context.object.meshfree.parts):,} parts are in the clipboard")
        return {"FINISHED"}


TOOLS = (Registration(MESHFREE_OT_copy_measures, menu=Row("Object", 3, 6)),)
