"""Parallel transport of directions along the surface, and maps of it around a point."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..algebra import TwoGrid
from ..arguments import as_doubles, check_array, check_finite
from ..errors import InvalidPointsError
from ..geometry import as_indices
from ..operator import LaplaceBeltrami, connection_laplacian, tangent_frames
from ..progress import ends_at_one
from ..types import Floats, Progress
from .geodesics import Geodesics, geodesics_of

_TIME = 3.0  # smoothing lengths that heat spreads over: fewer do not average out the randomness of points
_FARTHEST = 200.0  # extent of the object in such lengths, at most, or the heat there underflows


@ends_at_one
def transport(
    laplacian: LaplaceBeltrami, sources: ArrayLike, directions: ArrayLike, *, progress: Progress | None = None
) -> Floats:
    """Extend directions at some points to the whole surface by parallel transport.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    sources : array_like, (k,) int or (n,) bool
        Points with known directions, at least one.
    directions : array_like, (k, 3) or (3,)
        Their directions, of any length, in the order of the indices; one serves all. Normal parts do not count.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        Unit tangent vectors: the direction of the nearest source, parallel along the geodesic. Where geodesics from
        several sources meet, directions blend. Zero on components without a source.

    Raises
    ------
    InvalidPointsError
        No sources, points or directions of another shape, not finite, or a direction along the normal.
    SolverError
        The solver did not converge.

    See Also
    --------
    logarithmic_map : Directions and distances from one point.

    References
    ----------
    Sharp, Soliman, Crane. The Vector Heat Method. 2019.

    Examples
    --------
    From near the pole of the unit sphere a direction is transported to the equator along meridians:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> direction = mf.distance.transport(laplacian, [0], [1, 0, 0])
    >>> ahead = np.argmax(points[:, 0])
    >>> print(np.abs(direction[ahead, 2]).round(1))
    1.0
    """
    return transport_of(laplacian, progress).extend(sources, directions, progress=progress)


def transport_of(laplacian: LaplaceBeltrami, progress: Progress | None = None) -> "Transport":
    """Return the factors for an operator, which keeps them."""
    alone = replace(laplacian)  # keeps nothing, so that the two do not hold each other
    return laplacian.kept.result("transport", lambda: Transport(alone, progress=progress))


class Transport:
    """Parallel transport along a surface, prepared once for several sets of directions."""

    def __init__(self, laplacian: LaplaceBeltrami, *, progress: Progress | None = None) -> None:
        report = progress or _silent
        report("Equations", 0.0)
        self._laplacian = laplacian
        self.frames = tangent_frames(laplacian.normals)
        areas = laplacian.areas
        length = max(
            _TIME * (areas @ laplacian.smoothing_lengths) / areas.sum(),
            np.linalg.norm(np.ptp(laplacian.points, axis=0)) / _FARTHEST,
        )
        mass = areas / length**2
        flow = connection_laplacian(
            laplacian.stiffness, laplacian.normals, self.frames, mass, lambda: report("Equations", 0.1)
        )
        self._flow = TwoGrid(flow, mass, laplacian.points, report)

    def extend(self, sources: ArrayLike, directions: ArrayLike, *, progress: Progress | None = None) -> Floats:
        """See `transport`."""
        index = as_indices(sources, len(self.frames), "sources")
        if not len(index):
            raise InvalidPointsError("There are no points with directions. Choose at least one point.")
        advice = f"Give three numbers for each of {len(index)} points."
        directions = as_doubles(check_array(directions, "Directions", [(3,), (len(index), 3)], advice))
        check_finite(directions.reshape(-1, 3), "directions", advice)
        given = np.einsum("ij,ij->i", np.broadcast_to(directions, (len(index), 3)), self.frames[index])
        size = np.abs(given)
        wrong = np.count_nonzero(size <= 1e-9 * np.linalg.norm(directions, axis=-1))
        if wrong:
            raise InvalidPointsError(
                f"{wrong} of {len(index)} directions are zero or normal to the surface. Give tangential ones."
            )
        load = np.zeros(len(self.frames), dtype=complex)
        load[index] = given / size
        found = self._flow.solve(load, self._laplacian.component >= 0, progress or _silent)
        size = np.abs(found)
        return np.einsum("i,ij->ij", found.conj() / np.where(size > 0.0, size, 1.0), self.frames).real

    def logarithmic_map(
        self,
        source: int,
        geodesics: Geodesics,
        direction: ArrayLike | None = None,
        *,
        progress: Progress | None = None,
    ) -> Floats:
        """See `logarithmic_map`."""
        frames = self.frames
        chosen = as_indices(source, len(frames), "sources")
        if len(chosen) != 1:
            raise InvalidPointsError(f"There are {len(chosen)} sources. Give the one point at the center of the map.")
        source = int(chosen[0])
        axis = self.extend([source], frames[source].real if direction is None else direction, progress=progress)
        distance = geodesics.distance([source], progress=progress)
        outward = geodesics.outward(distance) * np.einsum("ij,ij->i", axis, frames).conj()
        position = np.where(np.isfinite(distance), distance, np.nan) * np.exp(1j * np.angle(outward))
        return np.column_stack([position.real, position.imag]) + 0.0  # not -0


@ends_at_one
def logarithmic_map(
    laplacian: LaplaceBeltrami, source: int, direction: ArrayLike | None = None, *, progress: Progress | None = None
) -> Floats:
    """Map the surface around a point to the plane: polar coordinates by distance and direction along the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    source : int
        The point at the center.
    direction : array_like, (3,), optional
        Direction of the first coordinate, of any length; the second one is to the left of it, as seen against the
        normal. Without one, the coordinate axis that is most tangential there.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 2)
        Coordinates [L]: the geodesic distance from the center, in the initial direction of the geodesic. NaN on other
        components and at points left out.

    Raises
    ------
    InvalidPointsError
        A source that is not on the surface, or a direction along the normal.
    SolverError
        The solver did not converge.

    See Also
    --------
    geodesic_distance : Distances alone.
    transport : Directions alone.

    Notes
    -----
    The initial direction of a geodesic is the angle, at its end, between the gradient of the distance and a direction
    transported there from the center, as in the Vector Heat Method; distances are those of `geodesic_distance`.

    Examples
    --------
    From a pole of the unit sphere, all points lie within a disc of radius pi:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> place = mf.distance.logarithmic_map(mf.build_laplacian(points), 0)
    >>> print(place[0], np.hypot(*place.T).max().round(1))
    [0. 0.] 3.1
    """
    carried, geodesics = transport_of(laplacian, progress), geodesics_of(laplacian, progress)
    return carried.logarithmic_map(source, geodesics, direction, progress=progress)


def _silent(stage: str, fraction: float) -> None:
    """Report nothing."""
