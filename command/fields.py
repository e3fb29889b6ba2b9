"""Harmonic fields and solutions of Poisson's equation, for the command line and for Blender's tool."""

import numpy as np

from . import core
from .groups import HIGH, LOW, VALUE, is_chosen
from .settings import Setting

HARMONIC = {
    setting.name: setting
    for setting in (
        Setting("values", "Where the given values come from", "AUTO", choices=("AUTO", "WEIGHTS", "GROUPS")),
        Setting("low_group", "Vertex group of the points with the low value", LOW),
        Setting("high_group", "Vertex group of the points with the high value", HIGH),
        Setting("group", "Vertex group whose weights are the values", VALUE),
        Setting("low", "Value of the low group, or of weight 0", 0.0),
        Setting("high", "Value of the high group, or of weight 1", 1.0),
        Setting(
            "source",
            "Attribute with the source f of Poisson's equation -Laplacian u = f; empty for a harmonic field",
            "",
        ),
    )
}
_ENDS, _WEIGHTS = {"low_group": 0.0, "high_group": 1.0}, {"group": None}


def giving(own, has) -> dict:
    """Return the settings whose groups give values, with the relative values, None for the weights.

    Parameters
    ----------
    own : object
        With the values of the settings in `HARMONIC` as its attributes.
    has : callable
        Whether there is a group of some name.
    """
    if own.values == "GROUPS":
        return _ENDS
    if own.values == "WEIGHTS" or own.group not in ("", VALUE):
        return _WEIGHTS if own.group or not own.source else {}
    every = _ENDS | _WEIGHTS
    names = {setting: getattr(own, setting) for setting in every}
    return {
        setting: every[setting]
        for setting, name in names.items()
        if is_chosen(name, HARMONIC[setting].default, has(name))
    }


def title(setting) -> str:
    """Return the label of a setting that names a group."""
    return setting.replace("_", " ").title()


def given_shares(own, weights, count, kind, where, how, has):
    """Return the given values relative to the low (0) and the high value (1), (n,); NaN where none is given.

    Parameters
    ----------
    own : object
        With the values of the settings as its attributes.
    weights : dict of str to ndarray, (n,)
        By the settings of `giving`, in their order; NaN for points outside.
    count : int
        How many points there are.
    kind, where, how : str
        For errors: the word for groups, the name of what has them, and how values are given.
    has : callable
        Whether there is a group of some name.
    """
    shares, known = np.full(count, np.nan), {}
    for setting, held_weights in weights.items():
        name, share = getattr(own, setting), (_ENDS | _WEIGHTS)[setting]
        held = np.isfinite(held_weights) if share is None else held_weights > 0.0  # a value may be a weight of 0, too
        for other, there in known.items():
            both = np.count_nonzero(held & there)
            if both:
                raise core.PointCloudError(
                    f'{both} points are both in "{other}" and in "{name}". Remove them from one.'
                )
        known[name] = held
        shares[held] = held_weights[held] if share is None else share
    if own.group or not own.source:
        _check_given(own, {name for name, held in known.items() if held.any()}, kind, where, how, has)
    return shares


def _check_given(own, names, kind, where, how, has):
    """Refuse missing values, or those of one end alone, by the names of the groups that hold points."""
    if not names and has(own.group):
        raise core.PointCloudError(f'The {kind} "{own.group}" of {where} holds no points. Assign some to it.')
    if not names:
        raise core.PointCloudError(f"{where} has no points with given values. {how}")
    ends = {own.low_group, own.high_group}
    if own.values == "AUTO" and len(names) == 1 and names < ends and not own.source:
        (missing,) = ends - names
        raise core.PointCloudError(
            f'Only the {kind} "{min(names)}" of {where} gives values, so that all would be the same. Assign points to'
            f' "{missing}", too.'
        )


def check_source(source, name, where):
    """Refuse an attribute of vectors as a source."""
    if source.ndim > 1:
        raise core.PointCloudError(
            f'The attribute "{name}" of {where} holds vectors. Choose one with a number for each point as the source.'
        )


def solved(laplacian, shares, source, low, high, cache, progress):
    """Return the field, (n,), by given relative values, NaN where there are none, and a source or None."""
    fixed = np.isfinite(shares)
    given = shares[fixed]
    if source is None:  # between 0 and 1, so that both values can change without solving again
        field = harmonic(laplacian, fixed, given, cache, progress)
        return low + (high - low) * field
    values = low + (high - low) * given
    return cache.result(
        laplacian,
        "poisson",
        source,
        fixed,
        values,
        compute=lambda: core.distance.solve_poisson(laplacian, source, fixed, values, progress=progress),
    )


def harmonic(laplacian, fixed, given, cache, progress):
    """Return the harmonic field, (n,), with given values at the points that are fixed, (n,) bool."""
    return cache.result(
        laplacian,
        "harmonic",
        fixed,
        given,
        compute=lambda: core.distance.harmonic_field(laplacian, fixed, given, progress=progress),
    )


def field_line(field, name) -> str:
    """Return the range of a field as a text."""
    return f"{name}: a field from {field.min():.4g} to {field.max():.4g}"
