"""Columns of files whose digits single precision would lose, and how an object stores them."""

import json
from typing import NamedTuple

import bpy
import numpy as np

from ...core.files import LARGEST_SINGLE, Digits, join_digits
from ..objects.attributes import point_count, read_attribute
from ..objects.place import COLUMNS

RENAMED = "file_"  # prefix of columns whose names Blender reserves


class Column(NamedTuple):
    """How a column is stored in attributes: how its parts are joined, and the attribute of the second one."""

    digits: Digits
    second: str = ""


def remember_columns(obj, columns):
    """Keep on an object how columns are stored, `Column` by attribute, and the number of points."""
    if columns:
        kept = {name: {**column.digits._asdict(), "second": column.second} for name, column in columns.items()}
        obj[COLUMNS] = json.dumps({"points": point_count(obj.data), "columns": kept})


def kept_columns(obj) -> dict:
    """Return how columns of an object are stored, `Column` by attribute."""
    kept = json.loads(obj.get(COLUMNS, "{}")).get("columns", {})
    return {name: Column(second=found.pop("second"), digits=Digits(**found)) for name, found in kept.items()}


def doubted_columns(obj) -> list:
    """Return a notice if an object has points of others, by Blender's Join, with possibly other offsets."""
    names = [name for name in kept_columns(obj) if name in obj.data.attributes]
    if not names or point_count(obj.data) <= json.loads(obj[COLUMNS])["points"]:
        return []
    return [f"{obj.name} has more points than were imported: {', '.join(names)} may be off by an offset at these"]


def known_digits(name):
    """Return how another object stores a column of this name, to keep both joinable, or None."""
    columns = (kept_columns(obj).get(name) for obj in bpy.data.objects)
    return next((column.digits for column in columns if column is not None), None)


def read_columns(obj, names) -> dict:
    """Read attributes of an object by name, with the digits that they had in the file."""
    kept = {name: column for name, column in kept_columns(obj).items() if name in names}
    seconds = {column.second for column in kept.values()}
    columns = {}
    for name in names:
        if name in kept:
            parts = [read_attribute(obj.data, part) for part in (name, kept[name].second) if part in names]
            columns[name] = join_digits(parts, kept[name].digits)
        elif name not in seconds:
            columns[name] = read_attribute(obj.data, name)
    return columns


def column_notices(obj, attributes) -> list:
    """Return notices of columns of a file, by name, that are renamed or stored in another form."""
    there = obj.data.attributes
    kept = kept_columns(obj).items()
    notices = [f"{obj.name}: {_description(name, *column)}" for name, column in kept]
    names = [name for name in attributes if RENAMED + name in there and RENAMED + name not in attributes]
    renamed = [f"{name} as {RENAMED}{name}" for name in names]
    if renamed:
        notices.append(f"{obj.name}: Blender keeps some names for itself: stored {', '.join(renamed)}")
    counts = {name: _too_large(values) for name, values in attributes.items() if name in there}
    endless = [f"{count:,} of {name}" for name, count in counts.items() if count]
    if endless:
        notices.append(f"{obj.name}: numbers too large for Blender are infinite: {', '.join(endless)}")
    return notices


def _too_large(values):
    """Count the numbers beyond single precision."""
    if values.dtype != np.float64:
        return 0
    return np.count_nonzero(np.isfinite(values) & (np.abs(values) > LARGEST_SINGLE))


def _description(name, digits, second):
    """Describe how a column is stored."""
    offset = digits.offset if isinstance(digits.offset, list) else [digits.offset]
    parts = f" in two parts, {name} and {second}" if second else ""
    less = f" less {', '.join(f'{value:,.15g}' for value in offset)}" if any(offset) else ""
    steps = f" in steps of {digits.step:,}" if digits.step > 1 else ""
    return f"{name} has more digits than Blender keeps and is stored{parts}{less}{steps}; exports write it as it was"
