"""A profile as a small picture: a line over the distance, within its uncertainty."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from . import core, quantities
from .ticks import round_ticks, tick_texts
from .units import attribute_power, unit

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tools.tool import Array

_SIZE = 640, 280  # in pixels
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 16, 14, 46  # margins
_TICKS = 7, 5  # along each axis, at most
_LINE, _BAND, _GRID = "#1f5f9f", "#c5d9ec", "#e4e4e4"  # colors


def profile_picture(table: str, settings: Any) -> str:
    """Draw the last values of a table of *Profile*, as the tool writes it, over the distance: return an SVG document.

    The units are those of a scene in Blender, or `NO_UNITS`. A text that holds something else raises `PointCloudError`.
    """
    lines = table.splitlines()
    try:
        (names,) = csv.reader(lines[:1])
        columns = np.loadtxt(lines[1:], delimiter=",", ndmin=2).T
        across, values, doubts = columns[0], columns[-2], columns[-1]
    except (ValueError, IndexError) as error:
        raise core.PointCloudError(
            f"The table of the profile is not as it was written: {error}. Press Profile again."
        ) from error
    name = names[-2]
    power = 1 if name == "height" else attribute_power(name)
    label = "Height" if name == "height" else quantities.quantity(name).label or name
    titles = []
    for text, column, of_length in (("Distance", across, 1), (label, values, power)):
        raised, factor = unit(of_length, float(np.nanmax(np.abs(column))), settings)
        column *= factor
        titles.append(f"{text} ({raised})" if raised else text)
        if column is values:
            doubts *= factor
    return _document(across, values, np.nan_to_num(doubts), titles)


def _document(across: Array, values: Array, doubts: Array, titles: Sequence[str]) -> str:
    low, high = float(np.nanmin(values - doubts)), float(np.nanmax(values + doubts))
    pad = 0.04 * (high - low) or 0.5 * abs(high) or 1.0
    low, high = low - pad, high + pad
    width, height = _SIZE
    right, bottom = width - _RIGHT, height - _BOTTOM

    def x(value: Any) -> Any:
        return _LEFT + value / max(across[-1], 1e-300) * (right - _LEFT)

    def y(value: Any) -> Any:
        return bottom - (value - low) / (high - low) * (bottom - _TOP)

    parts = [f'<rect width="{width}" height="{height}" fill="white"/>']
    for ends, place, most, upright in (((0.0, across[-1]), x, _TICKS[0], True), ((low, high), y, _TICKS[1], False)):
        ticks = round_ticks(ends[0], ends[1], most)
        for tick, text in zip(ticks, tick_texts(ticks), strict=True):
            at = f"{place(tick):.1f}"
            line = f"M{at},{_TOP}V{bottom}" if upright else f"M{_LEFT},{at}H{right}"
            parts.append(f'<path d="{line}" stroke="{_GRID}"/>')
            where = (at, bottom + 17, "middle") if upright else (_LEFT - 7, f"{float(at) + 4:.1f}", "end")
            parts.append(_text(text, *where))
    for run in _runs(np.isfinite(values)):
        rims = [zip(x(across[run]), y(values[run] + sign * doubts[run]), strict=True) for sign in (1, -1)]
        band = [*rims[0], *reversed(list(rims[1]))]
        parts.append(f'<polygon points="{_places(band)}" fill="{_BAND}"/>')
        middle = zip(x(across[run]), y(values[run]), strict=True)
        parts.append(f'<polyline points="{_places(middle)}" fill="none" stroke="{_LINE}" stroke-width="1.5"/>')
    parts.append(f'<path d="M{_LEFT},{_TOP}V{bottom}H{right}" fill="none" stroke="black"/>')
    parts.append(_text(titles[0], (_LEFT + right) / 2, height - 8, "middle"))
    turned = f' transform="rotate(-90 14 {(_TOP + bottom) / 2})"'
    parts.append(_text(titles[1], 14, (_TOP + bottom) / 2, "middle", turned))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif"'
    return "\n".join([f'{head} font-size="12">', *parts, "</svg>"]) + "\n"


def _runs(known: Array) -> list[Array]:
    """Return the rows of each run without a gap."""
    runs = np.split(np.arange(len(known)), np.flatnonzero(np.diff(known)) + 1)
    return [run for run in runs if known[run[0]]]


def _places(pairs: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in pairs)


def _text(text: str, x: object, y: object, anchor: str, more: str = "") -> str:
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}"{more}>{escape(text)}</text>'
