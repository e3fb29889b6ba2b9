"""What volumes of parts are measured over: planes and other clouds, for the command line and for Blender's tools."""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import core, tools
from .settings import place

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Sequence

    from tools.measure_parts import PartRow
    from tools.tool import Array, Progress

_VOLUMES = "above", "below", "difference", "difference_uncertainty"  # over a plane or a cloud
_TOLD = 5  # notices of volumes over a plane that are told


class Base(NamedTuple):
    """What volumes are measured over: a plane, or along its normal the surface of another cloud."""

    # (3,) each
    point: Array
    normal: Array
    # Function of a progress callback that returns the operator of the other cloud
    ground: Callable[[Progress], core.LaplaceBeltrami] | None = None
    shift: Array = np.zeros(3)  # (3,), from the coordinates of the points to those of the other cloud
    name: str = ""  # of the other cloud


def pile_over(
    laplacian: core.LaplaceBeltrami, chosen: Array, base: Base | None, progress: Progress
) -> core.measure.Pile:
    """Measure the volume between a part, (n,) bool, and a `Base`, None for the plane through its rim."""
    if base is None:
        return core.measure.pile_volume(laplacian, chosen)
    heights = None
    if base.ground is not None:
        rows = np.flatnonzero(chosen & (laplacian.component >= 0))
        points, normals = laplacian.surface_points[rows] + base.shift, np.broadcast_to(base.normal, (len(rows), 3))
        found = core.measure.surface_deviation(base.ground(progress), points, normals, progress=progress)
        heights = np.full(len(chosen), nan)
        heights[rows] = np.where(found.known, found.distance, nan)
    return core.measure.pile_volume(laplacian, chosen, plane=(base.point, base.normal), heights=heights)


def base_of(
    plane: Array | None,
    normal: Array | None,
    place: Array,
    ground: Callable[[Progress], core.LaplaceBeltrami] | None = None,
    ground_place: Array | None = None,
    name: str = "",
) -> Base | None:
    """Return the `Base` that options give, None for none.

    The plane goes through a position in the coordinates of the file; the normal is upwards if none is given. Points are
    less `place`, (3,), those of the other cloud less `ground_place`.
    """
    if plane is None and ground is None:
        return None
    point = np.zeros(3) if plane is None else plane - place
    shift = np.zeros(3) if ground is None else place - ground_place
    return Base(point, tools.cross_section.UP if normal is None else normal, ground, shift, name)


def add_normal(parser: ArgumentParser, more: str = "") -> None:
    """Add the option for the normal of a plane, with `more` on it."""
    parser.add_argument("--normal", type=place, metavar="X,Y,Z", help=f"vector across the plane{more}; else upwards")


def add_base(parser: ArgumentParser) -> None:
    """Add the options for the plane over which volumes are measured; that for another cloud is `--reference`."""
    parser.add_argument(
        "--plane",
        type=place,
        metavar="X,Y,Z",
        help="measure the volume of every part over a plane through this position, in the coordinates of the file",
    )
    add_normal(parser, ", to what counts as above, along which heights over --reference are")


def check_base(parser: ArgumentParser, arguments: Namespace) -> None:
    """Refuse a normal without what volumes are measured over."""
    if arguments.normal is not None and arguments.plane is None and not arguments.reference:
        parser.error("--normal goes with --plane or --reference")


def volumes_over(
    laplacian: core.LaplaceBeltrami,
    rows: Sequence[PartRow],
    labels: Array | None,
    base: Base | None,
    progress: Progress,
) -> tuple[list[dict[str, Any]], list[str]]:
    """Measure the volumes of parts over a `Base`.

    Return them by name for each of the rows of a table of parts, empty without a base; and notices, which name the
    part.
    """
    if base is None:
        return [{} for _ in rows], []
    volumes, notices, failed = [], [], []
    for row in rows:
        kind, label = row.name.split()
        part: Any = (laplacian.component if kind == "Component" else labels) == int(label)
        try:
            found = pile_over(laplacian, part, base, progress)
        except core.InvalidPointsError as error:  # no part of the other cloud is above or below it
            volumes.append(dict.fromkeys(_VOLUMES))
            failed.append(error)
            notices.append(f"{row.name}: {error}")
            continue
        numbers = found.above, found.below, found.above - found.below, found.uncertainty
        volumes.append(dict(zip(_VOLUMES, numbers, strict=True)))
        notices += [f"{row.name}: {notice}" for notice in found.notices]
    if len(failed) == len(rows):
        raise failed[0]
    more = len(notices) - _TOLD
    if more > 0:
        notices[_TOLD:] = [f"There are {more:,} more such notices of parts."]
    of_ground = [] if base.ground is None else base.ground(progress).notices
    return volumes, [*(f"{base.name}: {notice}" for notice in of_ground), *notices]
