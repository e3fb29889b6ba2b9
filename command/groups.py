"""Groups of points: their names by what they are for, and columns of files and positions that stand for them."""

import numpy as np

from . import core
from .clouds import kind_of
from .settings import place

HANDLE, ANCHOR, FIXED, SOURCE, LOW, HIGH, VALUE, BOUNDARY_GROUP = ROLES = (
    "Handle",
    "Anchor",
    "Fixed",
    "Source",
    "Low",
    "High",
    "Value",
    "Boundary",
)


def is_chosen(name: str, default: str, there: bool) -> bool:
    """Whether a setting names a group that must exist: any but the default, which may not be there."""
    return bool(name) and (there or name != default)


def column_weights(values, name: str, where: str):
    """Return the weights, (n,) float64, that a column of a file or an object holds.

    Numbers from 0 to 1 are weights; of whole numbers all but 0 count.
    """
    if values.ndim > 1:
        raise core.PointCloudError(f'The column "{name}" of {where} holds vectors. Name one with a number a point.')
    weights = (values if values.dtype.kind == "f" else values.astype(bool)).astype(np.float64)
    if not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise core.PointCloudError(
            f'The column "{name}" of {where} has numbers that are not from 0 to 1, so they are no weights. Name'
            " another, or let it hold 1 for the points of the group and 0 for others."
        )
    return weights


def check_enough(weights, kind: str, name: str, setting: str, least: int = 1, how: str = ""):
    """Refuse weights, (n,), of which fewer than a number are above zero; `how` the group of a kind gets more."""
    count = np.count_nonzero(weights > 0.0)
    if count < least:
        raise core.PointCloudError(
            f'The {kind} "{name}" gives {count} of {len(weights)} points a weight above zero, and {setting}'
            f" takes at least {least}. Assign points to it{how}, or clear {setting}."
        )


def read_weights(cloud, name: str, option: str, least: int = 1, outside: float = 0.0):
    """Return the weights, (n,), in the group or column of a cloud that an option names, with those of points outside.

    Outside of a column are the points of weight 0.
    """
    if name in cloud.groups:
        weights = cloud.groups[name]
        inside, kind = np.isfinite(weights), "group"
    else:
        weights = column_weights(cloud.numbers(name, option), name, str(cloud.path))
        inside, kind = weights > 0.0, "column"
    check_enough(weights, kind, name, option, least)
    return np.where(inside, weights, outside)


def add_at(parser):
    """Add the option for sources by positions."""
    parser.add_argument(
        "--at",
        type=place,
        action="append",
        metavar="X,Y,Z",
        help="position in the coordinates of the file: the nearest point is a source. Give it once for each source,"
        " as --at=X,Y,Z where X is below zero",
    )


def check_sources(parser, arguments):
    """Refuse command lines that name sources twice or not at all, by `parser.error`; objects may have such a group."""
    if arguments.at and arguments.group:
        parser.error("--at and --group both say which points are the sources: give one of them")
    if not (arguments.at or arguments.group or all(map(kind_of, arguments.inputs))):
        parser.error("nothing says which points are the sources: give --at X,Y,Z, or --group with a column's name")


def read_sources(cloud, arguments):
    """Return the source points of a cloud, (n,) bool: the nearest ones of positions, or those in a column."""
    if not arguments.at:
        return read_weights(cloud, arguments.group or SOURCE, "--group") > 0.0
    return np.isin(np.arange(len(cloud.points)), nearest_to(cloud, arguments.at))


def nearest_to(cloud, places):
    """Return the points of a cloud that are nearest to places in the coordinates of its file, (k,) int."""
    return core.geometry.nearest_rows(cloud.points, np.asarray(places) - cloud.place)


def unreached(reached, name: str, consequence: str) -> list:
    """Return a notice of the points of some cloud that no source reaches, given those that one does, (n,) bool."""
    missed = np.count_nonzero(~reached)
    return [f"{missed:,} points of {name} are reached by no source. {consequence}"] if missed else []
