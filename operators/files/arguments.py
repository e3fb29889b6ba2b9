"""Options of the command line for settings, and positions."""

import argparse
import math

import numpy as np


def add_setting(parser, setting):
    """Add an option for a setting of the panel, with its description as help."""
    kind = {"help": setting.description.replace("%", "%%"), "default": None}
    if setting.type == "ENUM":
        kind.update(type=str.upper, choices=setting.enum_items.keys())
    elif setting.type == "BOOLEAN":
        kind.update(action=argparse.BooleanOptionalAction)
    elif setting.type == "STRING":
        kind.update(metavar="NAME")
    elif setting.is_array:
        kind.update(type=place, metavar="X,Y,Z")
    elif setting.subtype == "ANGLE":
        kind.update(type=_number(setting, lambda text: math.radians(float(text))), metavar="DEGREES")
    else:
        kind.update(type=_number(setting, int if setting.type == "INT" else float), metavar=setting.type)
    parser.add_argument(f"--{setting.identifier.replace('_', '-')}", **kind)


def _number(setting, convert):
    """Return a function that parses a number for a setting, and refuses those that Blender would silently clamp."""

    def number(text):
        value = convert(text)
        if not setting.hard_min <= value <= setting.hard_max:
            raise argparse.ArgumentTypeError(f"{text} is not from {setting.hard_min:g} to {setting.hard_max:g}")
        return value

    return number


def place(text):
    """Parse X,Y,Z as a position or a direction, (3,) float64."""
    found = as_place(text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z")
    return found


def as_place(text):
    """Parse X,Y,Z as a position, (3,) float64; None if the text is something else."""
    try:
        found = np.array([float(word) for word in text.split(",")])
    except ValueError:
        return None
    return found if found.shape == (3,) and np.isfinite(found).all() else None
