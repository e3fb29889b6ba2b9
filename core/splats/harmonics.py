"""Real spherical harmonics of Gaussian splats, and rotation of functions on the sphere.

The functions of degree 1 to 4 follow each other, without the constant one: 3, 8, 15 or 24 of them. Their signs are
those of the files of Kerbl, Kopanas, Leimkuehler, Drettakis: 3D Gaussian Splatting for Real-Time Radiance Field
Rendering. ACM Trans. Graph. 42, 2023.
"""

import numpy as np

from ..algebra import blocks, on_all_cores
from ..linalg import inv
from ..types import Array, Floats

COUNTS = (0, 3, 8, 15, 24)  # of harmonics up to the degrees 0 to 4
CONSTANT = 0.5 / np.sqrt(np.pi)  # the harmonic of degree 0
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_BLOCK = 1 << 13  # functions worked on at one time


def harmonics(directions: Floats, count: int) -> Floats:
    """Evaluate spherical harmonics.

    Parameters
    ----------
    directions : ndarray, (..., 3)
        Unit vectors.
    count : int
        One of `COUNTS`.

    Returns
    -------
    ndarray, (..., count)
        Orthonormal on the unit sphere.
    """
    values = [_of_degree(degree, directions) for degree in range(1, COUNTS.index(count) + 1)]
    return np.concatenate([np.empty((*np.shape(directions)[:-1], 0)), *values], axis=-1)


def rotated(coefficients: Array, rotations: Floats) -> Array:
    """Rotate functions on the sphere that are given by their coefficients.

    Parameters
    ----------
    coefficients : ndarray, (n, count, m)
        Of m functions each, such as three colours.
    rotations : ndarray, (n, 3, 3)
        Orthogonal matrices Q, which may mirror.

    Returns
    -------
    ndarray, (n, count, m)
        Of the functions d -> f(Q^T d), in the type of the coefficients.

    Notes
    -----
    Rotations map harmonics of one degree l to each other. Values of the rotated function in 2 l + 1 fixed directions
    are those of the given one in the inversely rotated directions, and a constant matrix gives its coefficients.
    """
    result = np.empty_like(coefficients)

    def rotate(rows: slice) -> None:
        for degree, (directions, fit) in enumerate(_FITS[: COUNTS.index(coefficients.shape[1])], 1):
            own = slice(COUNTS[degree - 1], COUNTS[degree])
            back = np.einsum("kd,nde->nke", directions, rotations[rows])
            result[rows, own] = fit @ (_of_degree(degree, back) @ coefficients[rows, own])

    on_all_cores(rotate, blocks(len(coefficients), _BLOCK))
    return result


def _of_degree(degree: int, directions: Floats) -> Floats:
    """Evaluate the harmonics of a degree, in the order of m from -degree to degree."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    result = _DEGREES[degree - 1](x, y, z, x * x, y * y, z * z)
    return np.stack([factor / np.sqrt(np.pi) * function for factor, function in result], axis=-1)


_DEGREES = (
    lambda x, y, z, xx, yy, zz: (
        (-np.sqrt(3 / 4), y),
        (np.sqrt(3 / 4), z),
        (-np.sqrt(3 / 4), x),
    ),
    lambda x, y, z, xx, yy, zz: (
        (np.sqrt(15 / 4), x * y),
        (-np.sqrt(15 / 4), y * z),
        (np.sqrt(5 / 16), 2 * zz - xx - yy),
        (-np.sqrt(15 / 4), x * z),
        (np.sqrt(15 / 16), xx - yy),
    ),
    lambda x, y, z, xx, yy, zz: (
        (-np.sqrt(35 / 32), y * (3 * xx - yy)),
        (np.sqrt(105 / 4), x * y * z),
        (-np.sqrt(21 / 32), y * (4 * zz - xx - yy)),
        (np.sqrt(7 / 16), z * (2 * zz - 3 * xx - 3 * yy)),
        (-np.sqrt(21 / 32), x * (4 * zz - xx - yy)),
        (np.sqrt(105 / 16), z * (xx - yy)),
        (-np.sqrt(35 / 32), x * (xx - 3 * yy)),
    ),
    lambda x, y, z, xx, yy, zz: (
        (np.sqrt(315 / 16), x * y * (xx - yy)),
        (-np.sqrt(315 / 32), y * z * (3 * xx - yy)),
        (np.sqrt(45 / 16), x * y * (6 * zz - xx - yy)),
        (-np.sqrt(45 / 32), y * z * (4 * zz - 3 * xx - 3 * yy)),
        (np.sqrt(9 / 256), 8 * zz * zz - 24 * zz * (xx + yy) + 3 * (xx + yy) ** 2),
        (-np.sqrt(45 / 32), x * z * (4 * zz - 3 * xx - 3 * yy)),
        (np.sqrt(45 / 64), (xx - yy) * (6 * zz - xx - yy)),
        (-np.sqrt(315 / 32), x * z * (xx - 3 * yy)),
        (np.sqrt(315 / 256), xx * (xx - 3 * yy) - yy * (3 * xx - yy)),
    ),
)


def _fit(degree: int) -> tuple[Floats, Array]:
    """Return 2 degree + 1 directions, and the matrix from values there to coefficients."""
    # Of one half of the sphere: on the other one values are the same, or opposite.
    z = 1.0 - (np.arange(2 * degree + 1) + 0.5) / (2 * degree + 1)
    angle = _GOLDEN * np.arange(2 * degree + 1)
    ring = np.sqrt(1.0 - z * z)
    directions = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return directions, inv(_of_degree(degree, directions))


_FITS = tuple(map(_fit, range(1, len(COUNTS))))
