"""What all tiles of a cloud must agree on, found tile by tile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..files import SCANNER
from ..geometry import Agreed, check_points
from ..options import LaplacianOptions, check_options
from ..progress import ends_at_one
from ..types import Array, Progress
from .cut import Tile
from .seen import checked_viewpoint, orientation
from .shelf import Memory, Part
from .site import Site
from .steps import agree, part_of, survey_steps, visit


@ends_at_one
def survey(
    points: ArrayLike,
    tiles: Sequence[Tile],
    options: LaplacianOptions = LaplacianOptions(),
    *,
    orient: str = "outside",
    viewpoint: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Agreed:
    """Find what all tiles of a cloud must agree on.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    tiles : sequence of Tile
        From `cut`.
    options : LaplacianOptions
        Settings.
    orient : {"outside", "up", "viewpoint"}
        The side that normals are on: away from the middle of each component, or up where that is a sheet, as of
        `estimate_normals`; the side that is seen from above; or that which is seen from a place.
    viewpoint : array_like, (3,) or (n, 3), optional
        For 'viewpoint': one place, or the place of the scanner for each point [L].
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Agreed
        The same, up to rounding, however the cloud was cut.

    Raises
    ------
    InvalidPointsError
        Another orientation, or a viewpoint that is missing, or does not fit.
    PointCloudError
        The points, or those of a tile, have no sound neighbourhoods; see `build_laplacian`.

    See Also
    --------
    measure_tile : Takes it.

    Examples
    --------
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> tiles = mf.tiles.cut(points, 2)
    >>> agreed = mf.tiles.survey(points, tiles)
    >>> print(round(agreed.scale, 3), agreed.component.max(), agreed.noisy)
    1.0 0 False
    """
    check_options(options)
    points = check_points(points)
    center = points.mean(axis=0)
    scale = np.sqrt(np.mean(np.sum((points - center) ** 2, axis=1)))
    seen_from, columns = checked_viewpoint(viewpoint, len(points)), dict[str, Array]()
    if seen_from is not None and seen_from.ndim == 2:
        columns, seen_from = {SCANNER: seen_from}, None
    sides = orientation(orient, seen_from, columns)
    record = {"center": center, "scale": scale, **sides}
    shelf = Memory(points, tiles, record, "areas", columns)
    report = progress or (lambda stage, fraction: None)
    steps = survey_steps(options)
    for step in steps:
        where = step.where(shelf)
        begin, end = part_of(steps, step)
        for place, number in enumerate(where):
            report(step.stage, begin + (end - begin) * place / len(where))
            visit(shelf, step, number, options)
        shelf.record |= agree(shelf, step, options)
    return _whole(shelf, tiles, options)


def _whole(shelf: Memory, tiles: Sequence[Tile], options: LaplacianOptions) -> Agreed:
    """Return what is agreed on for all points of a cloud."""
    own = [Site(shelf, number, options, _box(shelf, number)).agreed() for number in range(len(tiles))]
    joined: dict[str, Any] = {
        name: shelf.joined([getattr(agreed, name) for agreed in own])
        for name in ("component", "sheet", "side")
        if getattr(own[0], name) is not None
    }
    if own[0].bridges is not None:
        bridges = shelf.record["bridges"]
        joined["bridges"] = np.stack([shelf.rows(*bridges[:, :2].T), shelf.rows(*bridges[:, 2:].T)], axis=1)
    return replace(own[0], **joined)


def _box(shelf: Memory, number: int) -> Part:
    """Return the points in the box of a tile, without a halo."""
    points = shelf.own(number)
    every = np.ones(len(points), dtype=bool)
    return Part(points, every, every, np.full(len(points), number), np.arange(len(points)))
