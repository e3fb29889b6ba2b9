"""Harmonic fields between given values, and solutions of Poisson's equation."""

from typing import Any

import numpy as np

from . import core
from .groups import HIGH, LOW, VALUE, is_chosen
from .quantities import FIELD
from .settings import Choice, Setting, by_name
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

_IN_BLENDER = (
    "Select those of one end in Edit Mode and press Assign to Low, and those of the other end and press Assign to High."
)
_IN_FILES = "Name columns of the file by --low-group and --high-group, or by --group."
_ENDS: dict[str, float | None] = {"low_group": 0.0, "high_group": 1.0}
_WEIGHTS: dict[str, float | None] = {"group": None}


class HarmonicField(Tool):
    """The tool."""

    name, label = "harmonic_field", "Harmonic Field"
    help = "Interpolate a harmonic field between given values, or solve Poisson's equation"
    settings = (
        Setting(
            "values",
            "Where the given values come from",
            "AUTO",
            choices=(
                Choice("AUTO", "All Groups", "From all of the groups below that are there"),
                Choice("WEIGHTS", "Weights", "The points of one group have their weights as values"),
                Choice("GROUPS", "Two Groups", "The points of each of two groups have one value"),
            ),
        ),
        Setting("low_group", "Vertex group of the points with the low value", LOW),
        Setting("high_group", "Vertex group of the points with the high value", HIGH),
        Setting("group", "Vertex group whose weights are the values", VALUE),
        Setting("low", "Value of the low group, or of weight 0", 0.0, label="Low Value"),
        Setting("high", "Value of the high group, or of weight 1", 1.0, label="High Value"),
        Setting(
            "source",
            "Attribute with the source f of Poisson's equation -Laplacian u = f; empty for a harmonic field",
            "",
        ),
    )
    panel, menu = Row("Advanced", 2, 3), Row("Object", 6, 2)

    def asks(self, own: Any) -> tuple[str, ...]:
        ends, weights = ("low_group", "high_group"), ("group",)
        groups = {"WEIGHTS": weights, "GROUPS": ends, "AUTO": (*ends, *weights)}[own.values]
        return "values", *groups, "low", "high", "source"

    def later(self, own: Any) -> tuple[str, ...]:
        return () if own.source else ("low", "high")

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return the given values relative to the low (0) and the high value (1), (n,); NaN where none is given.

        And the source, (n,), or None.
        """
        source = None
        if own.source:
            source = cloud.numbers("source", own.source).astype(np.float64)
            if source.ndim > 1:
                raise core.PointCloudError(
                    f'The attribute "{own.source}" of {cloud.where} holds vectors. Choose one with a number for each'
                    " point as the source."
                )
        shares = np.full(len(cloud.points), np.nan)
        known: dict[str, Array] = {}
        least = int(own.values == "GROUPS")
        for setting, share in _giving(own, cloud).items():
            name = getattr(own, setting)
            weights = cloud.weights(setting, name, least, outside=np.nan)
            held = np.isfinite(weights) if share is None else weights > 0.0  # a value may be a weight of 0, too
            for other, there in known.items():
                both = np.count_nonzero(held & there)
                if both:
                    raise core.PointCloudError(
                        f'{both} points are both in "{other}" and in "{name}". Remove them from one.'
                    )
            known[name] = held
            shares[held] = weights[held] if share is None else share
        if own.group or not own.source:
            _check_given(own, cloud, {name for name, held in known.items() if held.any()})
        return shares, source

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        shares, source = inputs
        fixed = np.isfinite(shares)
        given = shares[fixed]
        if source is None:  # between 0 and 1, so that both values can change without solving again
            return core.distance.harmonic_field(laplacian, fixed, given, progress=progress)
        values = own.low + (own.high - own.low) * given
        return core.distance.solve_poisson(laplacian, source, fixed, values, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        field = found if own.source else own.low + (own.high - own.low) * found
        return Outcome({FIELD: field}, f"a field from {field.min():.4g} to {field.max():.4g}")


def _giving(own: Any, cloud: Cloud) -> dict[str, float | None]:
    """Return the settings whose groups give values, with the relative values, None for the weights."""
    if own.values == "GROUPS":
        return _ENDS
    if own.values == "WEIGHTS" or own.group not in ("", VALUE):
        return _WEIGHTS if own.group or not own.source else {}
    every, declared = _ENDS | _WEIGHTS, by_name(HarmonicField.settings)
    names = {setting: getattr(own, setting) for setting in every}
    return {
        setting: every[setting]
        for setting, name in names.items()
        if is_chosen(name, declared[setting].default, cloud.has_group(name))
    }


def _check_given(own: Any, cloud: Cloud, names: set[str]) -> None:
    """Refuse missing values, or those of one end alone, by the names of the groups that hold points."""
    if not names and cloud.has_group(own.group):
        raise core.PointCloudError(f'The {cloud.kind} "{own.group}" of {cloud.where} holds no points. Assign some.')
    if not names:
        how = _IN_BLENDER if cloud.in_blender else _IN_FILES
        raise core.PointCloudError(f"{cloud.where} has no points with given values. {how}")
    ends = {own.low_group, own.high_group}
    if own.values == "AUTO" and len(names) == 1 and names < ends and not own.source:
        (missing,) = ends - names
        raise core.PointCloudError(
            f'Only the {cloud.kind} "{min(names)}" of {cloud.where} gives values, so that all would be the same. Assign'
            f' points to "{missing}", too.'
        )


TOOL = HarmonicField()
