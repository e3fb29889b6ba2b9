"""What all tiles of a cloud must agree on, found tile by tile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..geometry import (
    COUNT,
    FILLING,
    MANY,
    Agreed,
    Decisions,
    Sample,
    Surface,
    arc_length,
    check_points,
    choose_bridges,
    divide_components,
    divide_sheets,
    drop_outliers,
    find_gaps,
    fit_surface,
    gap_reach,
    gather,
    join_touching,
    measure_noise,
    mirrored_cosine,
    near_edges,
    near_misfit,
    number_by_size,
    number_large,
    number_sheets,
    orient_patches,
    outer_signs,
    read_cloud,
    remove_noise,
    scale_points,
    sheet_neighbors,
)
from ..operator import build_laplacian, solve_areas
from ..options import LaplacianOptions, check_options
from ..types import Array, Bools, Floats, Ints, Progress
from .cut import Tile
from .labels import agree_on_signs, merge_links

DEGREE = 24  # of the polynomials for areas: they reach less than a halo of 60 spacings, see docs/tiles.md
_LINK = 1e-3  # weight of links between patches of one tile, against points that two tiles have in common
_TRIAL = 8000  # points on which the weights are balanced, for the shares


def survey(
    points: ArrayLike,
    tiles: Sequence[Tile],
    options: LaplacianOptions = LaplacianOptions(),
    *,
    degree: int = DEGREE,
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
    degree : int
        Of the polynomials that solve for areas. A lower one asks for less of a halo: 12 for 45 spacings. An operator of
        all points at once has 100.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Agreed
        The same, up to rounding, however the cloud was cut.

    Raises
    ------
    PointCloudError
        The points, or those of a tile, have no sound neighbourhoods; see `build_laplacian`.

    See Also
    --------
    measure_tile : Takes it.

    Examples
    --------
    >>> import core
    >>> points = core.example_sphere()
    >>> tiles = core.tiles.cut(points, 2)
    >>> agreed = core.tiles.survey(points, tiles)
    >>> print(round(agreed.scale, 3), agreed.component.max(), agreed.noisy)
    1.0 0 False
    """
    check_options(options)
    walk = _Walk(check_points(points), tiles, options, degree)
    report = progress or (lambda stage, fraction: None)
    stages: tuple[Callable[[], None], ...] = (
        walk.place,
        walk.divide_components,
        walk.remove_noise,
        walk.divide_sheets,
        walk.choose_sides,
        walk.find_bridges,
        walk.scale_areas,
        walk.share_weights,
    )
    for number, stage in enumerate(stages):
        report("Survey", number / len(stages))
        stage()
    return walk.agreed


class _Walk:
    """The walk from coordinates to areas, on all tiles up to each decision, which then is made for all of them."""

    def __init__(self, points: Floats, tiles: Sequence[Tile], options: LaplacianOptions, degree: int) -> None:
        self._points, self._tiles, self._options = points, tiles, options
        self._needed = options.neighbors + 1
        self._samples: list[Sample] = []
        self._surfaces: list[Surface] = []
        self.agreed = Agreed(degree=degree)

    def place(self) -> None:
        """Find the center, the scale and the usual spacing, and leave outliers out."""
        center = self._points.mean(axis=0)
        scale = float(np.sqrt(np.mean(np.sum((self._points - center) ** 2, axis=1))))
        self.agreed = replace(self.agreed, center=center, scale=scale)
        self._samples = [
            gather(scale_points(self._points[tile.rows], self._needed, Decisions(self.agreed)), Decisions())
            for tile in self._tiles
        ]
        usual = self._median([sample.nearest.spacing for sample in self._samples])
        self._settle(spacing=usual)
        self._samples = [drop_outliers(sample, self._needed) for sample in self._samples]

    def divide_components(self) -> None:
        """Number the components that gaps divide."""
        usual = self._median([gap_reach(sample.nearest) for sample in self._samples])
        gaps = [find_gaps(sample.nearest, usual) for sample in self._samples]
        label = self._linked([strict for strict, _ in gaps], 1)
        large = np.zeros(len(label), dtype=bool)
        large[label >= 0] = number_by_size(label[label >= 0], COUNT) >= 0
        joined = []
        for (strict, loose), sample, rows in zip(gaps, self._samples, self._rows(), strict=True):
            both = large[rows][:, None] & large[rows[sample.nearest.index[:, 1:]]]
            joined.append(strict | (loose & both))
        component = number_large(self._linked(joined, 1), large)
        smallest = int(np.bincount(component[component >= 0]).min())
        self._settle(reach=usual, component=self._spread(component), smallest=smallest)
        self._samples = [divide_components(sample, self._needed) for sample in self._samples]

    def remove_noise(self) -> None:
        """Decide whether noise is to be smoothed, and smooth it."""
        surfaces = [fit_surface(sample, self._options.sheets) for sample in self._samples]
        if self._options.projection == "auto":
            noise = [measure_noise(surface, near_misfit(surface.sample.nearest)) for surface in surfaces]
            self._settle(noisy=bool(np.mean(np.concatenate(self._inner(noise)) > 0.0) >= MANY))
            most = int(np.argmax([np.count_nonzero(values > FILLING) for values in self._inner(noise)]))
            surfaces = [
                replace(surface, sample=sample) for surface, sample in zip(surfaces, self._samples, strict=True)
            ]
            found = remove_noise(surfaces[most], self._options).sample.decisions.made.filling
            if found is not None:
                self._settle(filling=found)
        surfaces = [replace(surface, sample=sample) for surface, sample in zip(surfaces, self._samples, strict=True)]
        self._put([remove_noise(surface, self._options) for surface in surfaces])

    def divide_sheets(self) -> None:
        """Number the components that sheets divide, too."""
        if not self._options.sheets:
            return
        near = [sheet_neighbors(part.sample.nearest, part.quadrics.normals, False) for part in self._surfaces]
        label = self._linked(near, 0)
        sheet = np.full(len(label), -1)
        sheet[label >= 0] = number_by_size(label[label >= 0], COUNT)
        joined = [
            join_touching(sample.nearest, sheet[rows]) for sample, rows in zip(self._samples, self._rows(), strict=True)
        ]
        sheet = self._gathered(joined, -1)
        known = label >= 0
        assert self.agreed.component is not None
        sheet[known] = number_sheets(sheet[known], self.agreed.component[known])
        self._settle(sheet=self._spread(sheet))
        self._put([divide_sheets(surface, self._needed) for surface in self._surfaces])

    def choose_sides(self) -> None:
        """Choose the outer side of the surface: each tile for its patches, then all tiles for these."""
        oriented, patches, votes, offset = [], [], [], 0
        for surface in self._surfaces:
            nearest = surface.sample.nearest
            normals, patch = orient_patches(nearest, surface.quadrics.normals, surface.sample.places)
            first, second = near_edges(nearest)
            alike = np.sign(mirrored_cosine(nearest.points, normals, first, second))
            patch = patch + offset
            across = patch[first] != patch[second]
            votes.append(np.stack([patch[first], patch[second], _LINK * alike])[:, across])
            oriented.append(normals)
            patches.append(patch)
            offset = patch.max() + 1
        side, owner = self._gathered(oriented, 0.0), self._gathered(patches, -1)
        for number, (normals, patch, rows) in enumerate(zip(oriented, patches, self._rows(), strict=True)):
            tile, first = self._tiles[number], self._samples[number].scaled.first
            common = (tile.close & ~tile.inner)[first] & (owner[rows] >= 0)
            alike = np.sign(np.einsum("ij,ij->i", normals[common], side[rows[common]]))
            votes.append(np.stack([patch[common], owner[rows[common]], alike]))
        first, second, weight = np.concatenate(votes, axis=1)
        sign = agree_on_signs(first.astype(int), second.astype(int), weight, offset)
        known = owner >= 0
        side[known] *= sign[owner[known], None]
        label = self.agreed.component if self.agreed.sheet is None else self.agreed.sheet
        assert label is not None
        place = self._gathered([sample.places for sample in self._samples], 0.0)
        side[known] *= outer_signs(place[known], side[known], label[known])[label[known], None]
        self._settle(side=self._spread(side, 0.0))

    def find_bridges(self) -> None:
        """Find the edges over which sheets hang together that nothing else joins."""
        if not self._options.sheets:
            return
        assert self.agreed.side is not None
        near = [
            sheet_neighbors(sample.nearest, self.agreed.side[rows], True)
            for sample, rows in zip(self._samples, self._rows(), strict=True)
        ]
        label, ends, gaps = self._linked(near, 0), [], []
        for sample, rows, inner in zip(self._samples, self._rows(), self._masks(), strict=True):
            nearest, own = sample.nearest, label[rows]
            row, column = np.nonzero((own[nearest.index] != own[:, None]) & inner[:, None])
            ends.append(np.stack([rows[row], rows[nearest.index[row, column]]], axis=1))
            gaps.append(nearest.distance[row, column])
        edges = np.concatenate(ends)
        self._settle(bridges=edges[choose_bridges(label[edges[:, 0]], label[edges[:, 1]], np.concatenate(gaps))])

    def scale_areas(self) -> None:
        """Find by how much the areas of each component are to be scaled."""
        label = self.agreed.component if self.agreed.sheet is None else self.agreed.sheet
        assert label is not None
        count = int(label.max()) + 1
        total, found = np.zeros((2, count))
        self._samples, self._surfaces = [], []  # their memory is needed
        for tile in self._tiles:
            agreed = replace(self.agreed.among(tile.rows, len(label)), ratio=np.ones(count))
            cloud = read_cloud(self._points[tile.rows], self._options, agreed=agreed)
            areas = solve_areas(cloud, arc_length(cloud))
            inner = tile.inner[cloud.scaled.first]
            names = cloud.decisions.names(cloud.scaled, cloud.component)[inner]
            total += np.bincount(names, cloud.cell_areas[inner], count)
            found += np.bincount(names, areas[inner], count)
        self._settle(ratio=total / np.where(found > 0.0, found, 1.0))

    def share_weights(self) -> None:
        """Balance the weights of the points around the middle, for what each round takes from the earlier ones."""
        middle = self._points[cKDTree(self._points).query(np.median(self._points, axis=0))[1]]
        count = len(self._points)
        rows = np.sort(cKDTree(self._points).query(middle, k=min(_TRIAL, count))[1])
        trial = build_laplacian(self._points[rows], options=self._options, agreed=self.agreed.among(rows, count))
        self._settle(shares=trial.agreed.shares)

    def _settle(self, **values: Any) -> None:
        """Agree on something, and tell all tiles."""
        self.agreed = replace(self.agreed, **values)
        self._samples = [
            replace(sample, decisions=Decisions(self.agreed.among(tile.rows, len(self._points))))
            for sample, tile in zip(self._samples, self._tiles, strict=False)  # no samples at the end
        ]
        self._surfaces = [
            replace(surface, sample=sample) for surface, sample in zip(self._surfaces, self._samples, strict=False)
        ]

    def _put(self, surfaces: list[Surface]) -> None:
        self._surfaces, self._samples = surfaces, [surface.sample for surface in surfaces]

    def _rows(self) -> list[Ints]:
        """Return which of the cloud's points each tile's distinct points are."""
        return [tile.rows[sample.scaled.first] for tile, sample in zip(self._tiles, self._samples, strict=True)]

    def _masks(self) -> list[Bools]:
        """Return which of each tile's distinct points lie in its box."""
        return [tile.inner[sample.scaled.first] for tile, sample in zip(self._tiles, self._samples, strict=True)]

    def _inner(self, values: Sequence[Array]) -> list[Array]:
        return [of_tile[inner] for of_tile, inner in zip(values, self._masks(), strict=True)]

    def _median(self, values: Sequence[Floats]) -> float:
        return float(np.median(np.concatenate(self._inner(values))))

    def _gathered(self, values: Sequence[Array], neutral: float) -> Array:
        """Return quantities of the points in all boxes, (n, ...), from those of each tile's distinct points."""
        result = np.full((len(self._points), *values[0].shape[1:]), neutral, dtype=values[0].dtype)
        for own, rows, inner in zip(values, self._rows(), self._masks(), strict=True):
            result[rows[inner]] = own[inner]
        return result

    def _spread(self, values: Array, neutral: float = -1) -> Array:
        """Return quantities, (n, ...), of the first points at each place for all points there."""
        result = np.full_like(values, neutral)
        for tile, sample, rows in zip(self._tiles, self._samples, self._rows(), strict=True):
            result[tile.own] = sample.scaled.scatter(values[rows], neutral)[tile.inner]
        return result

    def _linked(self, joined: Sequence[Bools], start: int) -> Ints:
        """Number the points of all tiles that neighbours, from one on, (m, k) bool, join."""

        def links(sample: Sample, near: Bools, inner: Bools) -> tuple[Ints, Ints]:
            row, column = np.nonzero(near & inner[:, None])
            return row, sample.nearest.index[row, start + column]

        parts = zip(self._samples, joined, self._rows(), self._masks(), strict=True)
        return merge_links(
            ((rows, *links(sample, near, inner)) for sample, near, rows, inner in parts), len(self._points)
        )
