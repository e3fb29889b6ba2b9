"""Gaussian splats as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..algebra import nearest_rotations
from ..arguments import as_array, check_array, check_finite
from ..frozen import Frozen
from ..linalg import det
from ..types import Array, Floats
from .columns import SplatFile
from .ellipsoids import mapped, matrices_of
from .harmonics import COUNTS, rotated


@dataclass(frozen=True)
class Splats(Frozen):
    """Gaussian splats: points with an ellipsoid each, and a view-dependent colour.

    Attributes
    ----------
    positions : ndarray, (n, 3)
        Centres [L].
    scales : ndarray, (n, 3)
        Half axes of the ellipsoids at one standard deviation [L].
    rotations : ndarray, (n, 4)
        Unit quaternions w x y z that rotate the coordinate axes to those of the ellipsoids.
    opacities : ndarray, (n,)
        In the centre, from 0 to 1.
    colors : ndarray, (n, 3)
        Coefficients of the constant harmonic: red, green and blue are 0.5 + 0.2821 times these.
    harmonics : ndarray, (n, k, 3)
        Coefficients of the harmonics of degree 1 on; k is 0, 3, 8, 15 or 24 for the highest degree 0 to 4.
    notices : list of str
        Which data of a file were left out.
    file : SplatFile or None
        The contents of a file, so that unchanged data are written as they were.
    owner : object or None
        What the splats belong to, where a program holds more of it than splats, and writes to it.

    Raises
    ------
    InvalidPointsError
        Arrays of wrong shapes, or not of real numbers.

    See Also
    --------
    read_splats, write_splats : Files of splats.
    deform.deformation_gradients : The maps by which a moved surface deforms splats.

    References
    ----------
    Kerbl, Kopanas, Leimkuehler, Drettakis. 3D Gaussian Splatting for Real-Time Radiance Field Rendering. ACM Trans.
    Graph. 42, 2023.
    """

    positions: Floats
    scales: Floats
    rotations: Floats
    opacities: Floats
    colors: Floats
    harmonics: Floats
    notices: list[str] = field(default_factory=list)
    file: SplatFile | None = None
    owner: Any = None

    def __post_init__(self) -> None:
        count = len(as_array(self.positions, "Positions")) if np.ndim(self.positions) else -1
        rest = np.shape(as_array(self.harmonics, "Harmonics"))
        shapes = {
            "positions": (count, 3),
            "scales": (count, 3),
            "rotations": (count, 4),
            "opacities": (count,),
            "colors": (count, 3),
            "harmonics": (count, rest[1] if len(rest) == 3 and rest[1] in COUNTS else 0, 3),
        }
        for name, shape in shapes.items():
            object.__setattr__(self, name, _numbers(getattr(self, name), shape, name))
        super().__post_init__()

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def covariances(self) -> Floats:
        """R S^2 R^T of each splat, (n, 3, 3) [L^2]."""
        axes = matrices_of(self.rotations) * self.scales.T
        return np.einsum("abn,cbn->nac", axes, axes)

    def deformed(self, positions: ArrayLike, gradients: ArrayLike) -> Self:
        """Return these splats after a deformation.

        Parameters
        ----------
        positions : array_like, (n, 3)
            Their positions after it [L].
        gradients : array_like, (n, 3, 3)
            Its gradients F: maps of small steps around each of them, of `deform.deformation_gradients` or any other.

        Returns
        -------
        Splats
            With the covariances F R S^2 R^T F^T. Harmonics are rotated by the orthogonal matrix next to F. Further
            lengths of their file are scaled by the cubic root of its determinant.

        Raises
        ------
        InvalidPointsError
            Arrays of wrong shapes, or with numbers that are not finite.
        """
        moved = _numbers(positions, self.positions.shape, "positions")
        maps = _numbers(gradients, (len(self), 3, 3), "gradients")
        check_finite(moved, "positions of splats", "Give a position for each.")
        check_finite(maps, "gradients of splats", "Give a map for each.")
        shapes = self.scales, self.rotations, self.harmonics
        rows = np.flatnonzero((maps != np.eye(3)).any(axis=(1, 2)))
        if len(rows) == len(self):
            shapes = _mapped(*shapes, maps)
        elif len(rows):  # the others keep every bit
            changed = _mapped(self.scales[rows], self.rotations[rows], self.harmonics[rows], maps[rows])
            shapes = (shapes[0].copy(), shapes[1].copy(), shapes[2].copy())
            for values, new in zip(shapes, changed, strict=True):
                values[rows] = new
        scales, rotations, harmonics = shapes
        file = self.file and self.file.scaled(np.cbrt(np.abs(det(maps))))
        return replace(self, positions=moved, scales=scales, rotations=rotations, harmonics=harmonics, file=file)


def _mapped(scales: Floats, rotations: Floats, harmonics: Array, maps: Floats) -> tuple[Floats, Floats, Array]:
    """Return half axes, rotations and harmonics after linear maps, (n, 3, 3)."""
    if harmonics.shape[1]:
        harmonics = rotated(harmonics, orthogonal_parts(maps))
    return *mapped(scales, rotations, maps), harmonics


def orthogonal_parts(gradients: Floats) -> Floats:
    """Return the orthogonal matrices nearest to maps, (n, 3, 3): rotations, mirrored where the maps mirror."""
    sign = np.where(det(gradients) < 0.0, -1.0, 1.0)
    rotations = nearest_rotations(np.ascontiguousarray(np.moveaxis(gradients * sign[:, None, None], 0, 2)))
    return np.moveaxis(rotations * sign, 2, 0)


def _numbers(given: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """Return an argument as an array of floating-point numbers of a shape."""
    wanted = f"Give {shape} real numbers: one row per splat, and 0, 3, 8, 15 or 24 harmonics."
    array = check_array(given, name.capitalize(), [shape], wanted)
    return array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)
