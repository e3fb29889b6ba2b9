"""Directions carried along the surface, and maps of it around a point."""

import numpy as np
from scipy import sparse

from ..arguments import as_array, as_doubles
from ..errors import InvalidPointsError, SolverError
from ..geometry import as_indices
from ..operator import connection_laplacian, dissect, factorize, sparsify, tangent_frames
from .geodesics import Geodesics

_TIME = 2.0  # smoothing lengths that heat spreads over: with fewer, the randomness of points is not averaged out
_FARTHEST = 200.0  # times as far the object may reach, or the heat there is below the least number
_FAINT = 1e-200  # of the largest value: less is not compared
_ACCURACY = 1e-3  # largest change in the last step, relative to the value of each point
_STEPS = 100


def transport(laplacian, sources, directions, *, progress=None):
    """Carry directions at some points along the surface to all others.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    sources : array_like, (k,) int or (n,) bool
        Points with known directions, at least one.
    directions : array_like, (k, 3) or (3,)
        Their directions, of any length, in the order of the indices; one serves all. What they have along the normal
        does not count.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        Unit tangent vectors: each the direction of the nearest source, carried along the shortest way without turning
        it in the surface. Where ways of several sources meet, directions blend. Zero on components without a source.

    Raises
    ------
    InvalidPointsError
        No sources, points or directions of another shape, not finite, or a direction along the normal.
    SolverError
        The solver did not converge.

    See Also
    --------
    Transport : Factors once, for several sets of directions.
    logarithmic_map : Directions and distances from one point.

    References
    ----------
    Sharp, Soliman, Crane. The Vector Heat Method. 2019.

    Examples
    --------
    From near the pole of the unit sphere a direction comes to the equator along meridians:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> laplacian = core.build_laplacian(points)
    >>> direction = core.transport(laplacian, [0], [1, 0, 0])
    >>> ahead = np.argmax(points[:, 0])
    >>> print(np.abs(direction[ahead, 2]).round(1))
    1.0
    """
    return Transport(laplacian, progress=progress).extend(sources, directions)


class Transport:
    """Parallel transport along a surface, factored once for several sets of directions.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Raises
    ------
    SolverError
        The equations have no single solution.

    See Also
    --------
    transport : For one set of directions.

    Notes
    -----
    One step of heat flow by the connection Laplacian (Sharp, Soliman, Crane, 2019). The factors are those of an
    operator with a third of the pairs; a few steps of refinement make the solution that of all pairs, so that far from
    the sources too it is right relative to its own size, which is all that its direction asks for.

    Examples
    --------
    Opposite directions stay opposite:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> carried = core.Transport(core.build_laplacian(points))
    >>> print(np.abs(carried.extend([0], [1, 0, 0]) + carried.extend([0], [-1, 0, 0])).max().round(6))
    0.0
    """

    def __init__(self, laplacian, *, progress=None):
        report = progress or (lambda stage, fraction: None)
        report("Equations", 0.0)
        self._laplacian = laplacian
        self.frames = tangent_frames(laplacian.normals)
        mass = sparse.diags_array(laplacian.areas.astype(complex), format="csr")
        share = laplacian.areas / laplacian.areas.sum()
        reach = max(
            _TIME * share @ laplacian.smoothing_lengths, np.linalg.norm(np.ptp(laplacian.points, axis=0)) / _FARTHEST
        )

        def flow(stiffness):
            return (mass + reach**2 * connection_laplacian(stiffness, laplacian.normals, self.frames)).tocsr()

        self._flow = flow(laplacian.stiffness)
        coarse = sparsify(laplacian.stiffness)
        self._order, starts = dissect(coarse, laplacian.points, lambda: report("Equations", 0.2))
        coarse = flow(coarse)[self._order][:, self._order]
        # Complex numbers as pairs of real ones.
        real = sparse.kron(coarse.real, np.eye(2)) + sparse.kron(coarse.imag, [[0.0, -1.0], [1.0, 0.0]])
        self._solve = factorize(real.tocsr(), 2 * starts, lambda share: report("Factors", 0.3 + 0.6 * share))

    def extend(self, sources, directions):
        """Carry directions to all points; see `transport`.

        Parameters
        ----------
        sources : array_like, (k,) int or (n,) bool
            Points with known directions, at least one.
        directions : array_like, (k, 3) or (3,)
            Their directions, of any length.

        Returns
        -------
        ndarray, (n, 3)
            Unit tangent vectors, zero on components without a source.

        Raises
        ------
        InvalidPointsError
            No sources, points or directions of another shape, not finite, or a direction along the normal.
        SolverError
            The solver did not converge.
        """
        index = as_indices(sources, len(self.frames), "sources")
        if not len(index):
            raise InvalidPointsError("There are no points with directions. Choose at least one point.")
        directions = as_array(directions, "Directions")
        numbers = directions.dtype.kind in "iuf"
        directions = as_doubles(directions) if numbers else directions
        if not numbers or directions.shape not in ((3,), (len(index), 3)) or not np.isfinite(directions).all():
            raise InvalidPointsError(
                f"The directions have the shape {directions.shape}, or are not finite numbers. Give three of these for"
                f" each of {len(index)} points."
            )
        given = np.einsum("ij,ij->i", np.broadcast_to(directions, (len(index), 3)), self.frames[index])
        size = np.abs(given)
        wrong = np.count_nonzero(size <= 1e-9 * np.linalg.norm(directions, axis=-1))
        if wrong:
            raise InvalidPointsError(
                f"{wrong} of {len(index)} directions are zero or stand at a right angle to the surface. Give ones"
                " that lead along it."
            )
        return np.einsum("i,ij->ij", self._extend(index, given / size).conj(), self.frames).real

    def _extend(self, index, given):
        """Carry unit complex numbers in the frames of some points to all, (n,) complex."""
        load = np.zeros(len(self.frames), dtype=complex)
        load[index] = given
        result = self._coarse(load)
        for _ in range(_STEPS):
            change = self._coarse(load - self._flow @ result)
            result += change
            size = np.abs(result)
            seen = size > _FAINT * size.max()
            if np.all(np.abs(change[seen]) < _ACCURACY * size[seen]):
                return np.where(size > 0.0, result / np.where(size > 0.0, size, 1.0), 0.0)
        raise SolverError(
            f"Directions were not found in {_STEPS} steps of refinement. The points may be too uneven: analyze fewer"
            " of them, or clean them."
        )

    def _coarse(self, load):
        result = np.empty_like(load)
        result[self._order] = self._solve(load[self._order].view(float)).view(complex)
        return result

    def logarithmic_map(self, source, direction=None, *, progress=None):
        """Lay the surface out flat around a point; see `logarithmic_map`.

        Parameters
        ----------
        source : int
            The point in the middle.
        direction : array_like, (3,), optional
            Where the first coordinate grows.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        ndarray, (n, 2)
            Coordinates [L]; not a number on other components and at points left out.

        Raises
        ------
        InvalidPointsError
            A source that is no point of the surface, or a direction along the normal.
        SolverError
            The solver did not converge.
        """
        laplacian, frames = self._laplacian, self.frames
        chosen = as_indices(np.atleast_1d(as_array(source, "Sources")), len(frames), "sources")
        if len(chosen) != 1:
            raise InvalidPointsError(f"There are {len(chosen)} sources. Name the one point in the middle of the map.")
        source = int(chosen[0])
        axis = self.extend([source], frames[source].real if direction is None else direction)
        distance = Geodesics(laplacian, progress=progress).distance([source], progress=progress)
        reached = np.isfinite(distance)
        outwards = _gradient(laplacian, frames, np.where(reached, distance, 0.0))
        angle = np.angle(outwards * np.einsum("ij,ij->i", axis, frames).conj())
        # The distance has no gradient at the point itself: around it, the tangent plane tells the direction.
        near = laplacian.stiffness[[source]].tocoo().col
        offset = (laplacian.surface_points[near] - laplacian.surface_points[source]) @ frames[source]
        angle[near] = np.angle(offset * (axis[source] @ frames[source]).conj())
        place = np.where(reached, distance, np.nan) * np.exp(1j * angle)
        return np.column_stack([place.real, place.imag])


def logarithmic_map(laplacian, source, direction=None, *, progress=None):
    """Lay the surface out flat around a point: polar coordinates by distance and direction along the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    source : int
        The point in the middle.
    direction : array_like, (3,), optional
        Where the first coordinate grows, of any length; the second one grows to the left of it, seen from where the
        normal points to. Without one, the coordinate axis that leads most along the surface there.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 2)
        Coordinates [L]: the distance from the middle along the surface, in the direction in which the shortest way
        begins. Not a number on other components and at points left out.

    Raises
    ------
    InvalidPointsError
        A source that is no point of the surface, or a direction along the normal.
    SolverError
        The solver did not converge.

    See Also
    --------
    geodesic_distance : Distances alone.
    transport : Directions alone.

    Notes
    -----
    The direction in which a way begins is the angle, where it ends, between the gradient of the distance and a
    direction carried there from the middle, as in the Vector Heat Method; distances are those of `geodesic_distance`.
    On regular grids, where shortest paths keep to the directions of the grid, directions are off by up to a few
    degrees.

    Examples
    --------
    From a pole of the unit sphere, all points lie within a disc of radius pi:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> place = core.logarithmic_map(core.build_laplacian(points), 0)
    >>> print(place[0], np.hypot(*place.T).max().round(1))
    [0. 0.] 3.1
    """
    return Transport(laplacian, progress=progress).logarithmic_map(source, direction, progress=progress)


def _gradient(laplacian, frames, values):
    """Return the gradient of a function, (n,) complex in the frames, by least squares over all pairs."""
    pairs = laplacian.stiffness.tocoo()
    apart = pairs.row != pairs.col
    first, second, weight = pairs.row[apart], pairs.col[apart], -pairs.data[apart]
    points, count = laplacian.surface_points, len(values)
    offset = np.einsum("ij,ij->i", points[second] - points[first], frames[first])
    rise = weight * (values[second] - values[first])

    def total(terms):
        return np.bincount(first, terms, minlength=count)

    u, v = offset.real, offset.imag
    xx, xy, yy = total(weight * u * u), total(weight * u * v), total(weight * v * v)
    x, y = total(rise * u), total(rise * v)
    determinant = xx * yy - xy**2
    return (yy * x - xy * y + 1j * (xx * y - xy * x)) / np.where(determinant > 0.0, determinant, 1.0)
