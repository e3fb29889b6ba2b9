"""What tools told of an object: notices in one line of the panel that unfolds, and figures in small tables."""

from typing import NamedTuple

from ..operators import registration
from ..operators.objects.modifiers import is_own
from ..operators.objects.reading import obstacle, sharing_objects
from ..operators.objects.result import is_analyzed, is_stale
from ..operators.objects.splats import LEFT_BEHIND, are_left_behind
from ..operators.running.job import running
from .wrapping import beside_or_below, draw_text, fitting

_MOST = 6  # notices shown at a time
_CROSS = 44.0  # width of the dismiss button of a notice, and of the margins around it


class Notice(NamedTuple):
    """A notice of an object."""

    text: str
    acts: bool  # whether there is something to do
    index: int | None = None  # among those that are kept, and can be dismissed


def draw_status(layout, context, obj, name="notices"):
    """Draw one line with what runs, or with the number of an object's notices, which unfolds.

    It is always there, so that nothing below it moves when results arrive. At the end of a panel, whose `name` it is.
    """
    head, body = layout.panel(f"meshfree_{name}", default_closed=True)
    job, told = running(), notices(obj) if obj is not None else []
    if job is not None:
        row = head.row(align=True)
        text = fitting(context, _CROSS, f"{job.label}: {job.progress}", job.progress)
        row.progress(text=text, factor=job.fraction)
        row.operator("meshfree.stop", text="", icon="X")
    else:
        row = head.row()
        row.active = bool(told)
        count = f"{len(told)} Notices" if len(told) > 1 else "1 Notice" if told else "No Notices"
        row.label(text=count, icon="ERROR" if any(notice.acts for notice in told) else "INFO")
    if body is not None:
        body.context_pointer_set("object", obj)  # whose notices are dismissed
        _draw_notices(body.column(), context, told)


def notices(obj) -> list:
    """Return the notices of an object, what is to be done first: those that are kept, and what is seen of it now."""
    figures = _figures(obj)
    kept = [
        Notice(f"{told.tool}: {_without(obj, told.text)}", told.level == "WARNING", index)
        for index, told in enumerate(obj.meshfree.notices)
        if told.tool not in figures or told.level != "INFO"
    ]
    return sorted([*_seen(obj), *kept], key=lambda notice: not notice.acts)


def _without(obj, text):
    """Return a text without the name of the object that it is about."""
    return text.removeprefix(f"{obj.name}: ")


def _seen(obj):
    """Yield what is seen of an object now, and is gone when what it asks for is done."""
    if obstacle(obj):
        return
    if is_analyzed(obj) and is_stale(obj, glance=True):
        yield Notice("Results are stale: press Analyze Points again", True)
    if are_left_behind(obj.data, glance=True):
        yield Notice(LEFT_BEHIND[0].upper() + LEFT_BEHIND[1:], True)
    scale = obj.matrix_world.to_scale()
    if max(abs(factor - 1.0) for factor in scale) > 1e-5:
        shown = " x ".join(f"{factor:.4g}" for factor in scale)
        yield Notice(f"Lengths and areas are those in the scene, where the object is scaled by {shown}", False)
    modifiers = sum(not is_own(modifier) for modifier in obj.modifiers)
    if modifiers:
        what = "used" if obj.meshfree.use_modifiers else "left out"
        yield Notice(f"Modifiers are {what}: {modifiers}. Use Modifiers, under Settings, decides", False)
    if sharing_objects(obj):
        yield Notice("Other objects share its points. Make Single User, under Settings, gives it its own", False)


def _draw_notices(column, context, told):
    if not told:
        column.label(text="There is nothing to tell")
    for notice in told[:_MOST]:
        row = column.row(align=True)
        draw_text(row, context, notice.text, "ERROR" if notice.acts else "INFO", taken=_CROSS)
        if notice.index is not None:
            row.operator("meshfree.dismiss", text="", icon="X").index = notice.index
    if len(told) > _MOST:
        draw_text(column, context, f"and {len(told) - _MOST} more, seen when these are dismissed")
    if sum(notice.index is not None for notice in told) > 1:
        column.operator("meshfree.dismiss", text="Dismiss All").index = -1


def _figures(obj):
    """Return the tools that an object keeps figures of, by their labels, with the panels that they are in."""
    told = {notice.tool for notice in obj.meshfree.notices if notice.level == "INFO"}
    rows = [(tool.operator.bl_label, tool.panel) for tool in registration.registered()] if told else []
    return {label: row.home for label, row in rows if row is not None and label in told}


def draw_figures(layout, context, home: str):
    """Draw the figures that tools of a panel told of the active object, below these."""
    obj = context.object
    homes = _figures(obj)
    for index, told in enumerate(obj.meshfree.notices):
        if told.level == "INFO" and homes.get(told.tool) == home:
            row = layout.box().row(align=True)
            draw_text(row, context, f"{told.tool}: {_without(obj, told.text)}", taken=_CROSS)
            row.operator("meshfree.dismiss", text="", icon="X", emboss=False).index = index


def draw_table(layout, context, lines):
    """Draw names with their values, pairs of texts."""
    column = layout.column(align=True)
    for name, value in lines:
        row = beside_or_below(column, context, name, value)
        row.label(text=name)
        row.label(text=value)
