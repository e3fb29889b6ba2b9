"""Settings of the Laplacian and of tools, for properties of Blender and for options of the command line."""

import argparse
import math
from typing import NamedTuple

import numpy as np

from . import core

_DEFAULTS, _PAPER = core.LaplacianOptions(), core.PaperOptions()


class Setting(NamedTuple):
    """A setting.

    Attributes
    ----------
    name, description : str
        Its name in Python, and what it is in the words of the manual.
    default : bool, int, float, str or sequence of float
        Its type is that of the values. For one of several choices in upper case.
    least, most : float or None
        Bounds of a number.
    choices : tuple of str
        In upper case.
    convert : callable or None
        Function from the text of an option to the value, if not the type of the default.
    form : str
        Of the option's text, in the help: "LENGTH" and "AREA" are in the units of the file.
    """

    name: str
    description: str
    default: object
    least: float | None = None
    most: float | None = None
    choices: tuple = ()
    convert: object = None
    form: str = ""

    @property
    def keywords(self) -> dict:
        """What a property of Blender takes, but its name and what is of the interface alone."""
        given = {"description": self.description, "default": self.default, "min": self.least, "max": self.most}
        return {name: value for name, value in given.items() if value is not None}


def add_setting(parser, setting):
    """Add an option for a setting; without it the value is None."""
    shown = _shown(setting)
    text = f"{setting.description} (default {shown})" if shown else setting.description
    kind = {"help": text.replace("%", "%%"), "default": None}
    if setting.choices:
        kind.update(type=str.upper, choices=setting.choices)
    elif isinstance(setting.default, bool):
        kind.update(action=argparse.BooleanOptionalAction)
    elif isinstance(setting.default, str):
        kind.update(metavar="NAME")
    else:
        kind.update(type=_number(setting), metavar=setting.form or type(setting.default).__name__.upper())
    parser.add_argument(f"--{setting.name.replace('_', '-')}", **kind)


def _shown(setting) -> str:
    """Return the default of a setting as its option takes it."""
    if isinstance(setting.default, bool):
        return "on" if setting.default else "off"
    if isinstance(setting.default, str):
        return setting.default
    values = math.degrees(setting.default) if setting.form == "DEGREES" else setting.default
    return ",".join(f"{value:.6g}" for value in np.atleast_1d(values).tolist())


def _number(setting):
    """Return a function that parses a number, or several, for a setting, and refuses what is out of its bounds."""
    low, high = (
        bound if bound is not None else end for bound, end in ((setting.least, -np.inf), (setting.most, np.inf))
    )
    convert = setting.convert or type(setting.default)

    def number(text):
        value = convert(text)
        if np.ndim(value) == 0 and not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not from {low:g} to {high:g}")
        return value

    return number


def chosen(settings, arguments) -> dict:
    """Return the values of settings by name: those given as options, and else the defaults."""
    given = {setting.name: getattr(arguments, setting.name) for setting in settings}
    return {
        setting.name: setting.default if given[setting.name] is None else given[setting.name] for setting in settings
    }


def radians(text):
    """Parse an angle in degrees."""
    return math.radians(float(text))


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


LAPLACIAN = {  # in the order of the panel
    setting.name: setting
    for setting in (
        Setting("laplacian", "How the Laplacian is built", "DEFAULT", choices=("DEFAULT", "PAPER")),
        Setting(
            "bandwidth",
            "How the radius of the kernel is chosen at each point",
            _DEFAULTS.bandwidth.upper(),
            choices=("ADAPTIVE", "LOCAL", "GLOBAL"),
        ),
        Setting(
            "neighbors",
            "With Local and Global, the smoothing length follows the distance to this neighbor; where there"
            " are no more points than that it is extrapolated",
            _DEFAULTS.neighbors,
            6,
        ),
        Setting(
            "bandwidth_factor",
            "Smoothing length as a multiple of the distance to the neighbor above; with Adaptive, as a"
            " multiple of the length that is chosen",
            _DEFAULTS.bandwidth_factor,
            0.05,
            5.0,
        ),
        Setting(
            "normals",
            "How the normal of a point is estimated from its neighbors",
            _PAPER.normals.upper(),
            choices=("WPCA", "PCA"),
        ),
        Setting(
            "areas",
            "How the area of each point is computed",
            _PAPER.areas.upper(),
            choices=("REGULARIZED", "CONSTRAINED", "UNIFORM"),
        ),
        Setting(
            "regularization",
            "Weight of the regularization of the areas, independent of the object's size",
            _PAPER.regularization,
            1e-9,
        ),
        Setting(
            "boundary",
            "Where the boundary of the surface is, if no Boundary Group is named",
            _DEFAULTS.boundary.upper(),
            choices=("AUTO", "OFF"),
        ),
        Setting(
            "sheets",
            "Never take points of two close sheets as neighbors, such as the two sides of a thin wall",
            _DEFAULTS.sheets,
        ),
        Setting(
            "projection",
            "Whether noise is smoothed within the computation; your points are not moved, but sharp edges count"
            " as rounded",
            _DEFAULTS.projection.upper(),
            choices=("AUTO", "OFF", "QUADRIC"),
        ),
        Setting(
            "denoise",
            "Project each point onto a plane through its neighbors first, against noise; your points are not moved",
            _PAPER.denoise,
        ),
        Setting(
            "boundary_group",
            "Vertex group with the points of the boundary, instead of finding them; weights above 0 count",
            "",
        ),
        Setting(
            "leave_out_floaters",
            "Leave Gaussian splats out of the operator that are nearly transparent, huge or isolated; they"
            " follow the others",
            True,
        ),
    )
}


def laplacian_options(values):
    """Return the options of the operator by the values of settings, choices in upper or lower case."""
    kind = core.PaperOptions if values["laplacian"].lower() == "paper" else core.LaplacianOptions
    return _options(kind, values)


def default_options(values):
    """Return the options of the default method, where the paper's operator is not usable."""
    return _options(core.LaplacianOptions, values)


def _options(kind, values):
    return kind(**{name: _lower(values[name]) for name in kind.__dataclass_fields__})


def _lower(value):
    return value.lower() if isinstance(value, str) else value
