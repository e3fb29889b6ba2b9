"""The height or an attribute along the shortest path between two points, for the command line and Blender's tool."""

import csv
import io
from typing import NamedTuple

import numpy as np

from . import core
from .settings import Setting, place

AXES = "XYZ"

PROFILE = {
    setting.name: setting
    for setting in (
        Setting("source", "Attribute of one number at each point; without one, the height along the axis", ""),
        Setting("axis", "Axis of the world along which heights are measured", "Z", choices=tuple(AXES)),
    )
}


def add_options(parser):
    """Add the options for both ends of the path, and for the picture."""
    for option, what in (("from", "begins"), ("to", "ends")):
        parser.add_argument(
            f"--{option}",
            dest=f"path_{option}",
            type=place,
            required=True,
            metavar="X,Y,Z",
            help=f"position in the coordinates of the file, at whose nearest point the path {what}; as"
            f" --{option}=X,Y,Z where X is below zero",
        )
    parser.add_argument(
        "--svg", action="store_true", help="write a small picture, too, beside the output with the ending .svg"
    )


def picture_path(output):
    """Return the path of the picture beside an output."""
    return output.with_suffix(".svg")


class Measured(NamedTuple):
    """A profile.

    Attributes
    ----------
    distance, values, off : ndarray, (k,)
        Along the path, the height or attribute, and its uncertainty.
    columns : list of ndarray, (k,)
        Of the table.
    """

    distance: np.ndarray
    values: np.ndarray
    off: np.ndarray
    columns: list


def path_between(laplacian, ends, cache, progress):
    """Return the corners of the shortest path between two points, (k, 3), as points are read."""
    return cache.result(
        laplacian,
        "path",
        ends,
        compute=lambda: core.distance.geodesic_path(laplacian, *ends.tolist(), progress=progress),
    )


def measured(laplacian, path, given, own, base, origin) -> Measured:
    """Measure along a path.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    path : ndarray, (k, 3)
    given : ndarray, (n,), or None
        Numbers at the points; None for heights alone.
    own : object
        With the values of the settings in `PROFILE` as its attributes.
    base, origin : ndarray, (3,)
        From where heights are measured, and to where places are told, each added to the points of the operator.
    """
    across = AXES.index(own.axis)
    heights = laplacian.points[:, across]
    found = core.measure.profile(laplacian, path, np.column_stack([heights] if given is None else [heights, given]))
    values, off = found.values[:, -1], found.uncertainty
    if given is None:
        values = base[across] + path[:, across]  # on the surface, as between its points
    if np.isfinite(values).sum() < 2:
        raise core.PointCloudError(f'"{own.source}" has no values along the path. Select other points.')
    columns = [found.distance, *(path + origin).T, base[across] + path[:, across], off[:, 0]]
    if given is not None:
        columns += [values, off[:, 1]]
    return Measured(found.distance, values, off[:, -1], columns)


def check_varying(varies, name, where):
    """Refuse an attribute that does not hold a number at each point that may lie between those of others."""
    if not varies:
        raise core.PointCloudError(
            f'The attribute "{name}" of {where} is not one number at each point that changes along the surface. Choose'
            " another one."
        )


def missing(found, name) -> list:
    """Return a notice of the places of the path without a value."""
    count = np.count_nonzero(~np.isfinite(found.values))
    return [f"{name}: {count:,} of {len(found.values):,} places of the path have no value."] if count else []


def profile_line(found, own, name, length_text) -> str:
    """Return the range of a profile as a text."""
    what = own.source or f"height along {own.axis}"
    low, high, off = np.nanmin(found.values), np.nanmax(found.values), np.sqrt(np.nanmean(found.off**2))
    return f"{name}: {length_text(found.distance[-1])} long, {what} from {low:.4g} to {high:.4g}, +- {off:.2g}"


def figures(found) -> dict:
    """Return what the command line prints of a profile."""
    return {
        "length": float(found.distance[-1]),
        "lowest": float(np.nanmin(found.values)),
        "highest": float(np.nanmax(found.values)),
        "uncertainty": float(np.sqrt(np.nanmean(found.off**2))),
    }


class Ends(NamedTuple):
    """The points nearest to two places, between which a path leads.

    Attributes
    ----------
    rows : ndarray, (2,) int
    points : ndarray, (2, 3)
        In the coordinates of the file.
    away : ndarray, (2,)
        How far they are from the places.
    """

    rows: np.ndarray
    points: np.ndarray
    away: np.ndarray

    @property
    def figures(self) -> dict:
        """What the command line prints of them."""
        return {"ends": self.points.tolist(), "distances_of_ends": self.away.tolist()}


def nearest_ends(points, places) -> Ends:
    """Return the points, of (n, 3), that are nearest to two places, (2, 3)."""
    rows = core.geometry.nearest_rows(points, places)
    if rows[0] == rows[1]:
        raise core.PointCloudError("The same point is the nearest one to both ends of the path. Give others.")
    return Ends(rows, points[rows], np.linalg.norm(points[rows] - places, axis=1))


def table(columns, source) -> str:
    """Return a table as text with commas: of heights alone, or with an attribute."""
    names = ["distance", "x", "y", "z", "height", "height_uncertainty"]
    if source:
        names += [source, f"{source}_uncertainty"]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    np.savetxt(text, np.column_stack(columns), "%.12g", ",")
    return text.getvalue()
