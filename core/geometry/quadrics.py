"""Local quadrics around each point: normal and curvature of the surface."""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from ..algebra import blocks, by_blocks, eliminate, on_all_cores
from ..errors import NotASurfaceError
from ..linalg import eigh
from ..types import Array, Floats, Ints

_BLOCK = 1 << 13  # points fitted at one time
_CURVE = 5e-3  # roundness of neighbors on a curve
MANY = 0.1  # share of the points: fewer are a few places, and not the whole scan
CURVED = 0.3  # share by which curvature may change a length, an area or a weight at most, where the fit is poor
_FADING = 0.84  # scatter of fits by fading weights, over that of fits by as many equal ones
_LOOSE = 15.0  # bend over noise, in units of the neighborhood: up to 7 at edges, 18 and more through two even rows
_FORM = np.array([1.0, 0.5, 1.0])  # weights of the squares of u^2, u v and v^2: the same whatever way u and v point
_RIDGE = 1e-10  # keeps the normal equations solvable where the neighbors lie on a conic


@dataclass(frozen=True)
class Quadrics:
    """A quadric through the neighbors of every point."""

    normals: Floats  # (m, 3), unit normals
    gaussian_curvature: Floats  # (m,), Gaussian curvature [1 / L^2]
    height: Floats  # (m, 3), from the point to the quadric, across it [L]
    # (m, 3, 3), second fundamental form: ``t . shape_operator t`` is the curvature along the unit tangent t, positive
    # where the surface curves away from the normal
    shape_operator: Floats
    misfit: Floats  # (m,), root mean square distance of the neighbors from the quadric [L]
    # (m,), standard deviation of the mean curvature over that of noise across the surface [1 / L^2], by the places of
    # the neighbors, within a tenth where these lie around the point
    scatter: Floats
    # (m,), variance of the neighbors across over that along: next to zero on a curve, which has no normal; one where
    # the normal was given
    roundness: Floats

    def take(self, rows: Ints) -> "Quadrics":
        """Return those of some rows, (k,) int."""
        return Quadrics(**{quantity.name: getattr(self, quantity.name)[rows] for quantity in fields(self)})

    def put(self, rows: Ints, others: "Quadrics") -> "Quadrics":
        """Return the same but for some rows, (k,) int, with the quadrics of others, of k points, in their place."""
        result = self.take(np.arange(len(self.normals)))
        result.assign(rows, others)
        return result

    def assign(self, rows: Ints, others: "Quadrics") -> None:
        """Put the quadrics of others in the place of some, in these arrays themselves."""
        for quantity in fields(self):
            getattr(self, quantity.name)[rows] = getattr(others, quantity.name)


def fit_quadrics(
    points: Floats, index: Ints, weight: Floats, rows: Ints | None = None, normals: Floats | None = None
) -> Quadrics:
    """Fit ``z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2`` around points.

    Neighbors that lie in two rows, as at the edge of scan lines, leave the slope across free: of all quadrics that fit
    them, the least bent one counts there.

    Parameters
    ----------
    points : ndarray, (m, 3)
        Coordinates.
    index : ndarray, (k, neighbors) int
        Neighbors of k points, ordered by distance, the point itself first.
    weight : ndarray, (k, neighbors)
        Weights of the neighbors.
    rows : ndarray, (k,) int, optional
        The points; all m of them if not given.
    normals : ndarray, (k, 3), optional
        Where the axis z points; the direction of least variance of the same neighbors if not given.

    Returns
    -------
    Quadrics
        Of the k points. The signs of the normals are arbitrary.
    """
    rows = np.arange(len(points)) if rows is None else rows
    count = len(rows)
    fitted = Quadrics(
        normals=np.empty((count, 3)),
        gaussian_curvature=np.empty(count),
        height=np.empty((count, 3)),
        shape_operator=np.empty((count, 3, 3)),
        misfit=np.empty(count),
        scatter=np.empty(count),
        roundness=np.ones(count),
    )

    def fit_block(block: slice) -> None:
        offset = chords(points, rows[block], index[block])
        share = weight[block] / weight[block].sum(axis=1, keepdims=True)
        spread = covariance(offset, share)
        if normals is None:
            variance, frame = eigh(spread)
            fitted.roundness[block] = roundness(variance)
        else:
            frame = frames(normals[block])
        unit = 3.0 * np.sqrt(0.5 * np.trace(spread, axis1=1, axis2=2))  # makes the equations well scaled
        z, v, u = (along(offset, axis.T / unit) for axis in np.moveaxis(frame, 2, 0))
        basis = np.ones_like(u), u, v, u * u, u * v, v * v
        powers = 0, 1, 5, 2, 6, 10  # a + 5 b of u^a v^b: where their sums are equal, so are the products
        equations, known = np.empty((6, 7, len(u))), dict[int, Floats]()
        for row, weighted in enumerate(share * values for values in basis):
            equations[row, 6] = _sums(weighted, z)
            for column in range(row + 1):
                power = powers[row] + powers[column]
                known[power] = known[power] if power in known else _sums(weighted, basis[column])
                equations[row, column] = equations[column, row] = known[power]
        equations[range(6), range(6)] += _RIDGE
        solved = eliminate(equations)
        bend = solved[:, 3] + solved[:, 5]  # of the inverse: with its own variance for noise of equal weight
        scatter = _FADING * np.sqrt((bend[3] + bend[5]) * _sums(share, share))
        fitted.scatter[block] = scatter / unit**2
        least = (bend * solved[:, 6])[3:].T @ _FORM / ((bend**2)[3:].T @ _FORM)
        # A point away from all others, such as an outlier, has no rows around it.
        near, last = (sum(step[:, end] ** 2 for step in offset) for end in (1, -1))
        fit = (solved[:, 6] - np.where((scatter > _LOOSE) & (4.0 * near < last), least, 0.0) * bend).T
        missed = z - sum(values * part[:, None] for values, part in zip(basis, fit.T, strict=True))
        slope = 1.0 + fit[:, 1] ** 2 + fit[:, 2] ** 2
        local = np.stack([np.ones_like(slope), -fit[:, 2], -fit[:, 1]], axis=1) / np.sqrt(slope)[:, None]
        fitted.normals[block] = np.einsum("iab,ib->ia", frame, local)
        fitted.gaussian_curvature[block] = (4.0 * fit[:, 3] * fit[:, 5] - fit[:, 4] ** 2) / (slope * unit) ** 2
        form = np.empty((len(fit), 2, 2))
        form[:, 0, 0], form[:, 1, 1] = -2.0 * fit[:, 3], -2.0 * fit[:, 5]
        form[:, 0, 1] = form[:, 1, 0] = -fit[:, 4]
        tangents = frame[:, :, :0:-1]  # u, v
        fitted.shape_operator[block] = (tangents @ form @ np.swapaxes(tangents, 1, 2)) / unit[:, None, None]
        fitted.height[block] = (fit[:, 0] * unit)[:, None] * frame[:, :, 0]
        fitted.misfit[block] = np.sqrt(_sums(share * missed, missed)) * unit

    on_all_cores(fit_block, blocks(count, _BLOCK))
    return fitted


def covariance(offset: Floats, share: Floats) -> Floats:
    """Return the covariance of offsets, (3, k, neighbors), whose shares sum to one, (k, 3, 3)."""
    result = np.empty((len(share), 3, 3))
    centered = [step - _sums(share, step)[:, None] for step in offset]
    for row, weighted in enumerate(share * step for step in centered):
        for column in range(row + 1):
            result[:, row, column] = result[:, column, row] = _sums(weighted, centered[column])
    return result


def _sums(left: Floats, right: Floats) -> Floats:
    return np.einsum("ik,ik->i", left, right)


def roundness(variances: Array) -> Floats:
    """Return the second over the largest variance of neighborhoods, (k,), by variances in ascending order, (k, 3)."""
    return variances[:, 1] / np.maximum(variances[:, 2], 1e-300)


def count_curves(roundness: Floats) -> int:
    """Return around how many points the neighbors lie along a curve, by how round their neighborhoods are, (m,)."""
    return int(np.count_nonzero(roundness < _CURVE))


def check_surface(curves: int, count: int) -> None:
    """Check that so many points are those of a surface, by `count_curves`.

    If the points of many neighborhoods lie along a curve, `NotASurfaceError` is raised.
    """
    if curves > MANY * count:
        raise NotASurfaceError(
            f"Around {curves} of {count} points the neighbors lie along a curve, so there is no tangent plane."
            " Use points of a surface."
        )


def heights_over(quadrics: Quadrics, points: Floats, rows: Ints, other: Ints) -> Floats:
    """Return how far other points are from the quadrics of some, with a sign, along their normals, (k, views).

    Rows and others, the points with the quadrics and those above them, have shapes that broadcast to that.
    """
    x, y, z = (
        place[other] - (place[rows] + height[rows])  # not of all points, for some rows
        for place, height in zip(points.T, quadrics.height.T, strict=True)
    )
    a, b, c = (normal[rows] for normal in quadrics.normals.T)
    return a * x + b * y + c * z + rises(entries(quadrics.shape_operator, rows), x, y, z)


def entries(form: Floats, rows: Ints) -> list[Floats]:
    """Return the entries on and above the diagonal of the symmetric forms, (m, 3, 3), of some rows: arrays of these."""
    return [form[:, row, column][rows] for row in range(3) for column in range(row, 3)]


def rises(form: list[Floats], x: Floats, y: Floats, z: Floats) -> Floats:
    """Return by how much surfaces rise over their tangent planes along steps, by the `entries` of their forms."""
    xx, xy, xz, yy, yz, zz = form
    return x * (0.5 * xx * x + xy * y + xz * z) + y * (0.5 * yy * y + yz * z) + 0.5 * zz * z**2


def chords(points: Floats, rows: Ints, index: Ints) -> Floats:
    """Return the chords from some of the points, (k,) int, to others, (k, views) int: (3, k, views).

    One coordinate after the other, as arrays whose last axis is three long take several times as long.
    """
    result = np.empty((3, *index.shape))
    for place, own, chord in zip(components(points, index), points[rows].T, result, strict=True):
        np.subtract(place, own[:, None], out=chord)
    return result


def gathered(values: Array, index: Ints) -> Array:
    """Return the values, (m,), of points, all in range: to check that takes longer than to take them."""
    return np.take(values, index, mode="clip")


def components(vectors: Floats, index: Ints) -> Iterator[Floats]:
    """Yield the components of vectors, (m, 3), of points, one after the other, (k, views) each.

    They are taken from one line of numbers: of a column, numpy would make a copy first, whole, for the few of a block.
    """
    line, start = vectors.reshape(-1), 3 * index.astype(np.intp)
    return (gathered(line[axis:], start) for axis in range(3))


def in_plane(chord: Floats, normals: Floats) -> Floats:
    """Return the coordinates of chords, (3, k, views), in the tangent planes, by normals, (k, 3): (2, k, views)."""
    tangents = frames(normals)[:, :, 1:].transpose(2, 1, 0)
    return np.stack([along(chord, tangent) for tangent in tangents])


def along(chord: Floats, directions: Floats) -> Floats:
    """Return the components of chords, (3, k, views), along directions, (3, k): (k, views)."""
    x, y, z = (step * part[:, None] for step, part in zip(chord, directions, strict=True))
    x += y
    x += z
    return x


def lengthened(x: Floats, y: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Return steps in a plane, of any shape, with other lengths."""
    size = length / np.maximum(np.sqrt(x * x + y * y), 1e-300)  # hypot, right for the smallest too, takes much longer
    return x * size, y * size


def eighths(x: Floats, y: Floats) -> Ints:
    """Return in which eighth of the plane places lie, from 0 to 7 in no order: quarters, halved by their diagonals."""
    return (x > 0.0) * np.int16(4) + (y > 0.0) * np.int16(2) + (np.abs(x) > np.abs(y))


def frames(normals: Floats) -> Floats:
    """Return orthonormal frames as columns (normal, and two tangents), (k, 3, 3)."""

    def frame(rows: slice) -> Floats:
        normal = normals[rows]
        axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
        tangent = np.cross(normal, axis)
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        return np.stack([normal, np.cross(normal, tangent), tangent], axis=2)

    return by_blocks(frame, len(normals))
