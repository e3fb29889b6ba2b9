"""Groups of points: their names by what they are for, and columns of files and positions that stand for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import core, tools
from .clouds import kind_of
from .settings import place

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Sequence

    from tools.tool import Array

    from .clouds import Cloud

SOURCE = tools.groups.SOURCE
column_weights, check_enough = tools.groups.column_weights, tools.groups.check_enough


def read_weights(cloud: Cloud, name: str, option: str, least: int = 1, outside: float = 0.0) -> Array:
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


def add_at(parser: ArgumentParser) -> None:
    """Add the option for sources by positions."""
    parser.add_argument(
        "--at",
        type=place,
        action="append",
        metavar="X,Y,Z",
        help="position in the coordinates of the file: the nearest point is a source. Give it once for each source,"
        " as --at=X,Y,Z where X is below zero",
    )


def check_sources(parser: ArgumentParser, arguments: Namespace) -> None:
    """Refuse command lines that name sources twice or not at all, by `parser.error`; objects may have such a group."""
    if arguments.at and arguments.group:
        parser.error("--at and --group both say which points are the sources: give one of them")
    if not (arguments.at or arguments.group or all(map(kind_of, arguments.inputs))):
        parser.error("nothing says which points are the sources: give --at X,Y,Z, or --group with a column's name")


def read_sources(cloud: Cloud, arguments: Namespace) -> Array:
    """Return the source points of a cloud, (n,) bool: the nearest ones of positions, or those in a column."""
    if not arguments.at:
        return read_weights(cloud, arguments.group or SOURCE, "--group") > 0.0
    return np.isin(np.arange(len(cloud.points)), nearest_to(cloud, arguments.at))


def nearest_to(cloud: Cloud, places: Sequence[Array]) -> Array:
    """Return the points of a cloud that are nearest to places in the coordinates of its file, (k,) int."""
    return core.geometry.nearest_rows(cloud.points, np.asarray(places) - cloud.place)
