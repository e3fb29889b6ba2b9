"""The pictures over the view: the legend, the histogram of what is shown, and the eigenvalues."""

import numpy as np

from ..command.ticks import round_ticks, tick_texts
from .canvas import DIM, WHITE, Picture, text_width
from .colormaps import to_display

HEIGHT = 230.0
_EDGE = 12.0  # between the plate's border and what is on it
_LINE = 16.0  # height of a line of text
_BEYOND = (0.45, 0.45, 0.45, 1.0)
_MARK = (1.0, 0.75, 0.2, 1.0)
_BOX = 18.0  # height of a box in a legend
_ROWS = 6  # lines that its colors are as high as, at least
_NAMED = 24  # letters in the names of bins, at most: of more only the first and the last bin have one


def legend_picture(scale, width: float = 0.0) -> Picture:
    """Draw the colours of a scale with their numbers: for renders of some width, for the view as large as needed."""
    left, right, bottom = _EDGE, _EDGE + 20.0, _EDGE
    heading, rows = _title_height(scale.unit) + _EDGE, max(len(scale.ticks), _ROWS) * _LINE
    height = heading + len(scale.boxes) * _BOX if scale.boxes else HEIGHT if width else heading + rows
    picture = Picture(width or _EDGE + _widest(scale, right + 10.0), height)
    picture.movable = True
    top = _title(picture, scale.title, scale.unit)
    if scale.boxes:
        for index, (name, color) in enumerate(scale.boxes.items()):
            y = top - (index + 1) * _BOX
            if color[3]:
                picture.rectangle(left, y + 0.1 * _BOX, right, y + 0.9 * _BOX, to_display(color))
            picture.text(name, right + 8.0, y + 0.5 * _BOX, part=f"box {index}")
        return picture
    bottom, top = bottom + 0.4 * _LINE, top - 0.4 * _LINE  # half the height of a number
    colors = [to_display(color) for color in scale.colors]
    rows = np.linspace(bottom, top, len(colors))
    for index in range(len(colors) - 1):
        picture.rectangle(left, rows[index], right, rows[index + 1], colors[index], colors[index + 1])
    for index, (share, text) in enumerate(scale.ticks):
        y = bottom + share * (top - bottom)
        picture.line((right, y), (right + 5.0, y), WHITE)
        picture.text(text, right + 10.0, y, part=f"tick {index}")
    return picture


def _widest(scale, right):
    """Return where the texts of a legend end at most, of which the numbers begin at the right of the colors."""
    beside = [*scale.boxes, *(text for _, text in scale.ticks)]
    return max(
        _EDGE + max(map(text_width, (scale.title, scale.unit))), right + max(map(text_width, beside), default=0.0)
    )


def histogram_picture(scale, edges, counts, beyond) -> Picture:
    """Draw a histogram in the colours of a scale, with the range marked."""
    picture = Picture(260.0, HEIGHT)
    total = int(counts.sum())
    top = _title(picture, "Histogram", f"{scale.full_title}")
    left, right, bottom = _EDGE, picture.width - _EDGE, _EDGE + 2.0 * _LINE
    low, high = scale.bounds
    if scale.boxes:
        low, high = low - 0.5, high + 0.5

    def across(value):
        return left + (value - edges[0]) / (edges[-1] - edges[0]) * (right - left)

    highest = max(int(counts.max()), 1)
    for index in np.flatnonzero(counts):
        middle = 0.5 * (edges[index] + edges[index + 1])
        gap = 1.0 if scale.boxes else 0.0
        picture.rectangle(
            across(edges[index]) + gap,
            bottom,
            across(edges[index + 1]) - gap,
            bottom + max(counts[index] / highest * (top - bottom), 1.0),
            _color_at(scale, index, (middle - low) / (high - low)),
        )
    picture.line((left, bottom), (right, bottom), DIM)
    if not scale.boxes:
        for bound in (low, high):
            picture.line((across(bound), bottom - 3.0), (across(bound), top), _MARK)
        _write_axis(picture, scale.factor * edges[0], scale.factor * edges[-1], left, right, bottom - 0.7 * _LINE)
    elif total:
        names = list(scale.boxes)
        if len(names) != len(counts):
            names = [f"{low + 0.5 + index:.0f}" for index in range(len(counts))]
        few = len("".join(names)) <= _NAMED
        for index in range(len(counts)) if few else {0, len(counts) - 1}:
            picture.text(names[index], across(0.5 * (edges[index] + edges[index + 1])), bottom - 0.7 * _LINE, "CENTER")
    y = _EDGE + 0.2 * _LINE
    if any(beyond):
        picture.text(f"{beyond[0]:,} below", left, y)
        picture.text(f"{beyond[1]:,} above", right, y, "RIGHT")
    return picture


def spectrum_picture(eigenvalues, shown_mode: int, unit: str, factor: float, area: float) -> Picture:
    """Draw eigenvalues over their numbers, and for comparison those of Weyl's law.

    The mode on show has a number from 1; 0 for none. Eigenvalues times the factor are in the unit; an empty one is
    none. Weyl's law, about 4 pi k / area, is left out for an area of 0.
    """
    picture = Picture(300.0, HEIGHT)
    top = _title(picture, "Eigenvalues", unit) - 0.5 * _LINE
    numbers = factor * np.asarray(eigenvalues, dtype=np.float64)
    count = len(numbers)
    slope = factor * 4.0 * np.pi / area if area > 0.0 else 0.0
    greatest = max(numbers.max(), slope * count) or 1.0
    ticks = round_ticks(0.0, greatest, most=6)
    texts = tick_texts(ticks)
    left, right, bottom = _EDGE + 7.0 * max(map(len, texts)) + 6.0, picture.width - _EDGE, _EDGE + 2.2 * _LINE

    def place(mode, number):
        return left + mode / count * (right - left), bottom + number / greatest * (top - bottom)

    for tick, text in zip(ticks, texts, strict=True):
        y = place(0, tick)[1]
        picture.line((left, y), (right, y), (1.0, 1.0, 1.0, 0.12))
        picture.text(text, left - 6.0, y, "RIGHT")
    picture.line((left, bottom), (left, top), DIM)
    picture.line((left, bottom), (right, bottom), DIM)
    if slope:
        picture.line(place(0, 0.0), place(count, slope * count), _MARK)
        picture.text("4 π k / Area", left + 8.0, top - 0.5 * _LINE, color=_MARK)
    radius = float(np.clip(150.0 / count, 1.2, 3.0))
    for mode, number in enumerate(numbers, start=1):
        if mode != shown_mode:
            picture.dot(*place(mode, number), radius, (0.45, 0.75, 1.0, 1.0))
    if 0 < shown_mode <= count:
        picture.dot(*place(shown_mode, numbers[shown_mode - 1]), radius + 2.5, WHITE)
    for tick in (tick for tick in round_ticks(0.0, count) if tick == round(tick) and tick > 0.0):
        x = place(tick, 0.0)[0]
        picture.line((x, bottom), (x, bottom - 3.0), DIM)
        picture.text(f"{tick:.0f}", x, bottom - 0.7 * _LINE, "CENTER")
    picture.text("Mode k", 0.5 * (left + right), _EDGE + 0.2 * _LINE, "CENTER")
    return picture


def _title(picture, title, unit):
    """Write a title and below it a unit, if there is one; return where the room below them begins."""
    y = picture.height - _EDGE - 0.3 * _LINE
    picture.text(title, _EDGE, y, part="title")
    if unit:
        picture.text(unit, _EDGE, y - _LINE, color=(1.0, 1.0, 1.0, 0.7), part="unit")
    return picture.height - _title_height(unit)


def _title_height(unit):
    """Height of a title with its unit, if there is one, and of the border above."""
    return _EDGE + (2.2 if unit else 1.2) * _LINE


def _color_at(scale, index, share):
    """Return the colour of a bin: of the whole number, or of its relative position in the range."""
    if scale.boxes:
        colors = [color for color in scale.boxes.values() if color[3]]
        return to_display(colors[index]) if index < len(colors) else _BEYOND
    if not 0.0 <= share <= 1.0:
        return _BEYOND
    return to_display(scale.colors[round(share * (len(scale.colors) - 1))])


def _write_axis(picture, low, high, left, right, y):
    ticks = round_ticks(low, high, most=5)
    for tick, text in zip(ticks, tick_texts(ticks), strict=True):
        picture.text(text, left + (tick - low) / (high - low) * (right - left), y, "CENTER")
