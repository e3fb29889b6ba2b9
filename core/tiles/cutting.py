"""A cloud larger than memory cut into the files of a store, in two passes over its points."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import as_path, check_points
from ..errors import InvalidPointsError, NotEnoughMemoryError, PointCloudError, TooFewPointsError
from ..files import alone_in, writing
from ..memory import needed_memory
from ..options import LaplacianOptions
from ..types import Array, FilePath, Floats
from .cut import HALO, NARROWEST, Plan, Room, spacing_around, spacings_away
from .roughness import asked_wavelength
from .seen import checked_viewpoint, orientation
from .site import Site
from .steps import Step
from .store import COLUMNS, POINTS, Record, Store, Told, tile_folder, write_manifest

Chunks: TypeAlias = Iterable[tuple[Floats, dict[str, Array]]]  # coordinates, and what is told of the points besides

_EACH = 5000  # of these, for each tile, are enough
_FEW = 8  # of so many tiles, one may be divided once more; where more had to be, all are made smaller
_SAMPLE = 1 << 20  # points by whose medians the cloud is cut, at least half of them
_PLACE = "coordinates of the point"  # in rows, beside columns of any names


def cut_to_store(
    chunks: Callable[[], Chunks],
    folder: FilePath,
    most: int,
    options: LaplacianOptions = LaplacianOptions(),
    *,
    halo: float = HALO,
    orient: str = "outside",
    viewpoint: ArrayLike | None = None,
    wavelength: float | None = None,
    memory: int | None = None,
    workers: int = 1,
    known: dict[str, Any] | None = None,
) -> Store:
    """Cut a cloud that need not fit the memory into tiles on disk.

    Parameters
    ----------
    chunks : callable
        Returns an iterable of coordinates, (k, 3) [L], and of other columns by name, (k,) or (k, m);
        the same each time.
    folder : path-like
        Of the store; it must not exist, and appears when all is written.
    most : int
        Points that a tile has about, at most.
    options : LaplacianOptions
        Settings.
    halo : float
        How far points in them are from the nearest in the box, in spacings around them, and at least of those in it.
    orient : {"outside", "up", "viewpoint"}
        The side that normals are on: away from the middle of each component, or up where that is a sheet, as of
        `estimate_normals`; the side that is seen from above; or that which is seen from a place.
    viewpoint : array_like, (3,), optional
        For 'viewpoint': one place [L]; else that of the column "scanner" at each point.
    wavelength : float, optional
        Of the roughness [L], see `mf.clean.roughness`; zero for the usual one. If not given, there is no roughness.
    memory : int, optional
        Bytes that a tile may take: larger ones are left out, with an error.
    workers : int
        The number of tiles is a multiple of theirs, so that none waits for others, where tiles stay wide against halos.
    known : dict, optional
        What else the manifest is to tell, such as the sources.

    Returns
    -------
    Store

    Raises
    ------
    PointCloudError
        The folder exists, or cannot be written; there are no points, or chunks that differ when read again; another
        orientation, or no viewpoint for it.

    Examples
    --------
    >>> import tempfile
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     store = mf.tiles.cut_to_store(lambda: [(points, {})], folder + "/store", 200)
    ...     print([len(store.own(number)) for number in range(store.count)])
    [200, 200, 200, 200]
    """
    folder = as_path(folder)
    if folder.exists():
        raise PointCloudError(f"{folder} exists. Go on with it, or choose another folder.")
    if most < 1:
        raise InvalidPointsError(f"Tiles of {most} points were asked for. Ask for at least one.")
    place, asked = checked_viewpoint(viewpoint), asked_wavelength(wavelength)
    counted = _count(chunks())
    sides = orientation(orient, place, counted.columns)
    fitting = None if memory is None else memory // needed_memory(1, options)
    plan = _plan(counted, _tiles(counted.count, most, halo, workers), halo, fitting)
    building = folder.with_name(f".{folder.name}.part")
    with alone_in(folder.parent, f".{folder.name}.lock"), writing(folder):
        try:
            shutil.rmtree(building, ignore_errors=True)  # of a cut that was killed
            building.mkdir()
            sizes = _spread(chunks(), building, plan, counted)
            agreed = {"center": counted.center, "scale": counted.scale, **sides, **asked}
            left_out = {"columns left out": counted.left_out, "halo": halo, "memory": memory}
            write_manifest(building, options, sizes, agreed, {**(known or {}), **left_out, "points": counted.count})
            os.replace(building, folder)
        finally:
            shutil.rmtree(building, ignore_errors=True)  # it may be what has filled the disk
    return Store(folder)


def points_of_tile(memory: int, options: LaplacianOptions, halo: float = HALO) -> int:
    """Return how many points a tile may have so that it fits some memory, in bytes, with its halo.

    Raises
    ------
    NotEnoughMemoryError
        Little more than halos would fit.
    """
    side = np.sqrt(memory / needed_memory(1, options)) - 2.0 * halo
    least = needed_memory(1, options) * ((NARROWEST + 2.0) * halo) ** 2
    if memory < least:
        raise NotEnoughMemoryError(
            f"A tile with its halo takes {least / 2**30:.1f} GB at least, and {memory / 2**30:.1f} GB are allowed."
            " Allow more, or ask for a narrower kernel."
        )
    return int(side**2)


@dataclass(frozen=True)
class _Counted:
    """What the first pass tells of a cloud."""

    count: int
    center: Floats
    scale: float
    sample: Floats
    columns: dict[str, tuple[np.dtype[Any], tuple[int, ...]]]
    left_out: list[str]

    @property
    def row(self) -> np.dtype[Any]:
        """A point with its columns."""
        return np.dtype([(_PLACE, np.float64, (3,)), *self.fields])

    @property
    def fields(self) -> list[Any]:
        """Its columns."""
        return [(name, *kind) for name, kind in self.columns.items()]


def _count(chunks: Chunks) -> _Counted:
    count, stride, sample = 0, 1, np.zeros((0, 3))
    origin: Floats | None = None
    first, square = np.zeros(3), 0.0
    columns: dict[str, tuple[np.dtype[Any], tuple[int, ...]]] = {}
    names: set[str] = set()
    for points, others in chunks:
        points = check_points(points)
        found = {name: (values.dtype, values.shape[1:]) for name, values in others.items()}
        if origin is None:
            origin, columns = points.mean(axis=0), found
        names |= found.keys()
        columns = {
            name: (np.promote_types(kind[0], found[name][0]), kind[1])
            for name, kind in columns.items()
            if name in found and kind[1] == found[name][1]
        }
        offset = points - origin
        first += offset.sum(axis=0)
        square += float(np.einsum("ij,ij->", offset, offset))
        sample = np.concatenate([sample, points[-count % stride :: stride]])
        count += len(points)
        while len(sample) > _SAMPLE:
            sample, stride = sample[::2], 2 * stride
    if origin is None:
        raise TooFewPointsError("There are no points. Name files with points.")
    mean = first / count
    scale = max(square / count - float(mean @ mean), 0.0) ** 0.5
    return _Counted(count, origin + mean, scale, sample, columns, sorted(names - columns.keys()))


def _spread(chunks: Chunks, folder: Path, plan: Plan, counted: _Counted) -> list[int]:
    """Append all points to the files of their tiles, and return how many each has."""
    raw = [folder / f"{number:06d}.raw" for number in range(plan.tiles)]
    for path in raw:
        path.touch()
    for points, others in chunks:
        table = np.empty(len(points), counted.row)
        table[_PLACE] = points
        for name in counted.columns:
            table[name] = others[name]
        tile = plan.tile(np.asarray(points, dtype=np.float64))
        order = np.argsort(tile, kind="stable")
        ends = np.searchsorted(tile[order], np.arange(plan.tiles + 1))
        for number in np.flatnonzero(np.diff(ends)):
            with open(raw[number], "ab") as file:
                file.write(table[order[ends[number] : ends[number + 1]]].tobytes())
    sizes = []
    for number, path in enumerate(raw):
        table = np.fromfile(path, counted.row)
        home = tile_folder(folder, number)
        home.mkdir()
        np.save(home / POINTS, table[_PLACE])
        if counted.columns:
            columns = np.empty(len(table), counted.fields)
            for name in counted.columns:
                columns[name] = table[name]
            np.save(home / COLUMNS, columns)
        path.unlink()
        sizes.append(len(table))
    if sum(sizes) != counted.count:
        raise PointCloudError(
            f"The files held {counted.count:,} points at first and {sum(sizes):,} when read again. Cut them again."
        )
    return sizes


def _tiles(count: int, most: int, halo: float, workers: int) -> int:
    """Return how many tiles so many points make, as many for each worker where they stay wide against halos."""
    least = -(-count // most)
    shared = -(-least // workers) * workers
    return shared if count / shared >= (NARROWEST * halo) ** 2 else least


def _plan(counted: _Counted, tiles: int, halo: float, fitting: int | None) -> Plan:
    """Divide a cloud into about so many tiles, or more, so that each has room with its halo."""
    sample = counted.sample[:: max(1, len(counted.sample) // (_EACH * tiles))]
    if fitting is None or len(sample) < 2:
        return Plan(sample, tiles)
    room = Room(sample, counted.count / len(sample), halo, fitting)
    while (plan := Plan(sample, tiles, room)).split > plan.tiles // _FEW:
        tiles += -(-tiles // _FEW)
    return plan


def find_extent(site: Site, state: Any) -> tuple[None, Told]:
    """Find the box of a tile, and the spacing in it."""
    points = site.store.own(site.number)
    if not len(points):
        raise TooFewPointsError("The tile has no points.")
    points = check_points(points)
    spacing = spacing_around(points)
    return None, {
        "low": points.min(axis=0),
        "high": points.max(axis=0),
        "usual": np.median(spacing),
        "widest": spacing.max(),
        "spacing": spacing,
    }


def find_halo(site: Site, state: Any) -> tuple[None, Told]:
    """Gather the points around a tile that belong to others."""
    store, number = site.store, site.number
    halo, memory = store.manifest["halo"], store.manifest["memory"]
    low, high = store.bounds(number)
    tree, usual = cKDTree(store.own(number)), float(site.told("extent", "usual"))
    count = tree.n
    found: list[tuple[Array, ...]] = [
        (np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool))
    ]
    gap = np.maximum(np.maximum(low - store.record["high"], store.record["low"] - high), 0.0)
    near = np.linalg.norm(gap, axis=1) <= halo * np.maximum(usual, store.record["widest"])  # not where there is none
    near[number] = False
    for other in np.flatnonzero(near).tolist():
        points = store.own(other)
        place, away = spacings_away(tree, usual, points, store.read("extent", other, "spacing"), halo)
        count += len(place)
        if memory is not None and needed_memory(count, site.options) > memory:
            raise NotEnoughMemoryError(
                f"The tile and its halo have {count:,} points or more, which would take more than the"
                f" {memory / 2**30:.1f} GB that are allowed: its points fill a volume, or lie in heaps. Thin them out"
                " there, or allow more memory."
            )
        found.append((points[place], np.full(len(place), other), place, away <= 0.5 * halo))
    names = ("points", "owner", "place", "close")
    return None, {name: np.concatenate(column) for name, column in zip(names, zip(*found, strict=True), strict=True)}


def list_boxes(store: Store, options: LaplacianOptions) -> Record:
    """List the boxes of all tiles, and the widest spacing in each; NaN where that is not known."""
    record = {
        "low": np.full((store.count, 3), np.nan),
        "high": np.full((store.count, 3), np.nan),
        "widest": np.full(store.count, np.nan),
    }
    for name, column in record.items():
        for number in store.alive:
            column[number] = store.read("extent", number, name)
    return record


HALOS = (Step("extent", "Tiles", 1.4, find_extent, list_boxes), Step("halo", "Tiles", 0.1, find_halo))
