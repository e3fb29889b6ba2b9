"""Kinds of columns without names, by their values: colors, normals, corners of triangles, or unknown."""

import numpy as np

from ..types import Array, Floats

_COLORS = ("r", "g", "b")
_SCANNED = ("intensity", *_COLORS)
_NORMALS = ("nx", "ny", "nz")
_FULL = 255.0
_SAMPLE = 10_000  # rows that are examined first
_MOST = 30  # columns that are examined
_PER_CORNER = 2.5  # triangles of a mesh have half as many corners, but for handles
_LENGTH = 0.02  # by which lengths of normals, rounded to a few digits, may differ from 1
_STEP = 1e-4  # by which shares of 255 may differ from whole ones, in a file of a few digits


def are_triangles(rows: Floats) -> bool:
    """Whether numbers, (n, 3), are indices of the corners of triangles: most edges, pairs of numbers, are of two rows.

    Of points of whole numbers they are of one row or of many; or of two where these are a shell of voxels, which has
    fewer numbers: triangles are twice as many as their corners, or fewer.
    """
    if not (rows.min(initial=0.0) >= 0.0 and rows.max(initial=0.0) < 2.0**31 and (rows == np.rint(rows)).all()):
        return False
    corners = np.sort(rows.astype(np.int64), axis=1)
    if len(rows) > _PER_CORNER * len(np.unique(corners)) or (corners[:, :2] == corners[:, 1:]).any():
        return False
    edges = np.concatenate([(corners[:, a] << 32) + corners[:, b] for a, b in ((0, 1), (1, 2), (0, 2))])
    _, shared = np.unique(edges, return_counts=True)
    return 2 * int(np.count_nonzero(shared == 2)) > len(shared)


class Guess:
    """Kinds of columns that a file does not name, gathered from their values, as many rows at once as one likes."""

    def __init__(self, width: int) -> None:
        self._triples = [_Triple() for _ in range(min(width, _MOST) - 2)]
        self._all_full, self._all_one = np.ones((2, width), dtype=bool)

    def add(self, values: Array) -> None:
        """Look at further rows, (n, k)."""
        values = values[np.isfinite(values).all(axis=1)]
        if not len(values):
            return
        self._all_full &= (values == _FULL).all(axis=0)
        self._all_one &= (values == 1.0).all(axis=0)
        for first, triple in enumerate(self._triples):
            triple.add(values[:, first : first + 3])

    def names(self, unknown: list[str], scanned: bool = True) -> list[str]:
        """Name the columns r g b, alpha, nx ny nz, intensity, or by the names that are given for unknown ones.

        A single number before colors may be an intensity if `scanned`; one before the coordinates counts points.
        """
        names = list(unknown)
        color, normal = self._best_pair()
        if normal is not None:
            names[normal : normal + 3] = _NORMALS
        if color is not None:
            names[color : color + 3] = _COLORS
            alpha = color + 3
            full = self._all_full if self._triples[color].largest > 1.0 else self._all_one
            if alpha < len(names) and alpha != normal and full[alpha]:
                names[alpha] = "alpha"
            if scanned and color == 1 and len(names) == len(_SCANNED):
                names = list(_SCANNED)
        return names

    def _best_pair(self) -> tuple[int | None, int | None]:
        """Choose columns of colors and of normals that explain most; of colors those whose channels differ least.

        Opacities, intensities and labels beside them differ more.
        """
        colors = [None, *(first for first, triple in enumerate(self._triples) if triple.are_colors)]
        normals = [None, *(first for first, triple in enumerate(self._triples) if triple.are_normals)]
        pairs = [
            (color, normal)
            for color in colors
            for normal in normals
            if color is None or normal is None or abs(color - normal) >= 3
        ]

        def quality(pair: tuple[int | None, int | None]) -> tuple[int, float, bool]:
            color, normal = pair
            explained = (color is not None) + (normal is not None)
            return explained, -self._spread(color), color is not None

        return max(pairs, key=quality)

    def _spread(self, first: int | None) -> float:
        """Return how much the channels of colors differ."""
        if first is None:
            return 0.0
        triple = self._triples[first]
        alpha = 2.0 * _FULL if self._all_full[first : first + 3].any() else 0.0  # the same everywhere
        return triple.spread / triple.count + alpha


class _Triple:
    """What the values of three columns are.

    The rows that were looked at in full are counted; the spread is by how much the three differ, summed over them.
    """

    def __init__(self) -> None:
        self.count, self.largest, self.spread = 0, 0.0, 0.0
        self._within = self._whole = self._shares = self._unit = True  # holds for all values
        self._there, self._mixed = 0, False

    @property
    def are_normals(self) -> bool:
        """Whether they are vectors of length 1, but for some that are zero or missing."""
        return self._unit and 2 * self._there > self.count

    @property
    def are_colors(self) -> bool:
        """Whether they are whole numbers from 0 to 255, or their shares, and not all 0 or 1."""
        if not self.count or not self._within or self.are_normals:
            return False
        return self._whole if self.largest > 1.0 else self._shares and self._mixed

    def add(self, values: Floats) -> None:
        """Look at further rows, (n, 3), unless it is clear already that they are neither."""
        there, mixed = 0, False
        for part in (values[:: max(len(values) // _SAMPLE, 1)], values):
            if self._unit:
                lengths = np.linalg.norm(part, axis=1)
                long = lengths > 0.0
                there = int(np.count_nonzero(long))
                self._unit = bool((np.abs(lengths[long] - 1.0) < _LENGTH).all())
            self._within = self._within and bool(((part >= 0.0) & (part <= _FULL)).all())
            self._whole = self._within and self._whole and bool((part == np.round(part)).all())
            if self._within and self._shares:
                shares = _FULL * part
                mixed = bool((shares % _FULL != 0.0).any())
                self._shares = bool((np.abs(shares - np.round(shares)) < _FULL * _STEP).all())
            if not (self._unit or self._whole or (self._within and self._shares)):
                return
        self.count += len(values)
        self.largest = max(self.largest, float(values.max()))
        self.spread += float(np.ptp(values, axis=1).sum())
        self._there += there
        self._mixed = self._mixed or mixed
