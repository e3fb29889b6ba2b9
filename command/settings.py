"""Settings as options of the command line."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from . import tools

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tools.tool import Array

Setting = tools.settings.Setting
LAPLACIAN = tools.laplacian.LAPLACIAN
laplacian_options, default_options = tools.laplacian.laplacian_options, tools.laplacian.default_options


def add_setting(parser: argparse.ArgumentParser, setting: Setting) -> None:
    """Add an option for a setting; without it the value is None."""
    shown = _shown(setting)
    text = f"{setting.description} (default {shown})" if shown else setting.description
    kind: dict[str, Any] = {"help": text.replace("%", "%%"), "default": None}
    if setting.choices:
        kind.update(type=str.upper, choices=setting.values)
    elif isinstance(setting.default, bool):
        kind.update(action=argparse.BooleanOptionalAction)
    elif isinstance(setting.default, str):
        kind.update(metavar="NAME")
    else:
        kind.update(type=_number(setting), metavar=setting.form or type(setting.default).__name__.upper())
    parser.add_argument(f"--{setting.name.replace('_', '-')}", **kind)


def _shown(setting: Setting) -> str:
    """Return the default of a setting as its option takes it."""
    if isinstance(setting.default, bool):
        return "on" if setting.default else "off"
    if isinstance(setting.default, str):
        return setting.default
    values = math.degrees(setting.default) if setting.form == "DEGREES" else setting.default
    return ",".join(f"{value:.6g}" for value in np.atleast_1d(values).tolist())


def _number(setting: Setting) -> Callable[[str], Any]:
    """Return a function that parses a number, or several, for a setting, and refuses what is out of its bounds."""
    low, high = (
        bound if bound is not None else end for bound, end in ((setting.least, -np.inf), (setting.most, np.inf))
    )
    convert = _FORMS.get(setting.form, type(setting.default))

    def number(text: str) -> Any:
        value = convert(text)
        if np.ndim(value) == 0 and not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not from {low:g} to {high:g}")
        return value

    return number


def chosen(settings: Iterable[Setting], arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the values of settings by name: those given as options, and else the defaults."""
    given = {setting.name: getattr(arguments, setting.name) for setting in settings}
    return {
        setting.name: setting.default if given[setting.name] is None else given[setting.name] for setting in settings
    }


def radians(text: str) -> float:
    """Parse an angle in degrees."""
    return math.radians(float(text))


def place(text: str) -> Array:
    """Parse X,Y,Z as a position or a direction, (3,) float64."""
    found = as_place(text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z")
    return found


def as_place(text: str) -> Array | None:
    """Parse X,Y,Z as a position, (3,) float64; None if the text is something else."""
    try:
        found = np.array([float(word) for word in text.split(",")])
    except ValueError:
        return None
    return found if found.shape == (3,) and np.isfinite(found).all() else None


_FORMS = {"DEGREES": radians, "X,Y,Z": place}  # of texts that are converted
