"""The height or an attribute along the shortest path between two points."""

import csv
import io
from typing import Any, NamedTuple

import numpy as np

from . import core
from .settings import Choice, Setting
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

_AXES = "XYZ"


class Measured(NamedTuple):
    """A profile."""

    # (k,), along the path, the height or attribute, and its uncertainty
    distance: Array
    values: Array
    off: Array
    columns: list[Array]  # (k,) each, of the table
    ends: Array  # (2, 3), the points that the path is between, in the coordinates of the file
    away: list[float]  # how far they are from where they were wanted

    def table(self, source: str) -> str:
        """Return a table as text with commas: of heights alone, or with an attribute."""
        names = ["distance", "x", "y", "z", "height", "height_uncertainty"]
        if source:
            names += [source, f"{source}_uncertainty"]
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(names)
        np.savetxt(text, np.column_stack(self.columns), "%.12g", ",")
        return text.getvalue()


class Profile(Tool):
    """The tool."""

    name, label = "profile", "Profile"
    help = "Measure the height or an attribute along the shortest path between two points, as a table"
    settings = (
        Setting(
            "source",
            "Attribute of one number at each point; without one, the height along the axis",
            "",
            label="Attribute",
        ),
        Setting(
            "axis",
            "Axis of the world along which heights are measured",
            "Z",
            choices=tuple(Choice(axis, axis, f"Along the {axis} axis of the world") for axis in _AXES),
            label="Height Along",
        ),
    )
    panel, menu = Row("Measure", 1, 3), Row("Points", 2, 3)
    extended = True

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return both ends, how far away they are, where heights begin and places, and numbers, (n,), or None."""
        values = cloud.numbers("source", own.source) if own.source else None
        if values is not None and (values.dtype.kind != "f" or values.ndim > 1):
            raise core.PointCloudError(
                f'The attribute "{own.source}" of {cloud.where} is not one number at each point that changes along the'
                " surface. Choose another one."
            )
        return *cloud.ends(), cloud.heights_from, cloud.place, values

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        ends, away, base, place, given = inputs
        path = path_between(laplacian, ends, progress)
        across = _AXES.index(own.axis)
        heights = laplacian.points[:, across]
        found = core.measure.profile(laplacian, path, np.column_stack([heights] if given is None else [heights, given]))
        values, off = found.values[:, -1], found.uncertainty
        if given is None:
            values = base[across] + path[:, across]  # on the surface, as between its points
        if np.isfinite(values).sum() < 2:
            raise core.PointCloudError(f'"{own.source}" has no values along the path. Select other points.')
        columns = [found.distance, *(path + place).T, base[across] + path[:, across], off[:, 0]]
        if given is not None:
            columns += [values, off[:, 1]]
        return Measured(found.distance, values, off[:, -1], columns, laplacian.points[ends] + place, away.tolist())

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        what = own.source or f"height along {own.axis}"
        low, high, off = np.nanmin(found.values), np.nanmax(found.values), np.sqrt(np.nanmean(found.off**2))
        line = f"{length(found.distance[-1])} long, {what} from {low:.4g} to {high:.4g}, ± {off:.2g}"
        missing, count = np.count_nonzero(~np.isfinite(found.values)), len(found.values)
        notices = [f"{missing:,} of {count:,} places of the path have no value."] if missing else []
        figures = {
            "length": float(found.distance[-1]),
            "lowest": float(low),
            "highest": float(high),
            "uncertainty": float(off),
            "ends": found.ends.tolist(),
            "distances_of_ends": found.away,
        }
        return Outcome({}, line, notices, figures=figures, made=(found, found.table(own.source)))


def path_between(laplacian: Laplacian, ends: Array, progress: Progress) -> Array:
    """Return the corners of the shortest path between two points, (2,) int, as points are read, (k, 3)."""
    work = lambda: core.distance.geodesic_path(laplacian, *ends.tolist(), progress=progress)  # noqa: E731
    return laplacian.kept.result("path", work, ends)


TOOL = Profile()
