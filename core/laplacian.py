"""The symmetrised mesh-free Laplace-Beltrami operator, eq. (10) of the paper."""

import numpy as np
from scipy import sparse

from .areas import solve_areas
from .distances import arc_length, projected_distance
from .errors import InvalidPointsError
from .kernel import SECOND_MOMENT, pair_kernel
from .neighbors import find_neighborhoods
from .normals import unit_normals
from .options import LaplacianOptions
from .points import check_points
from .spectrum import solve_spectrum
from .surface import fit_surface


class LaplaceBeltrami:
    """A discrete Laplace-Beltrami operator on points.

    Made by `build_laplacian`. One sign convention: `stiffness` K is positive semi-definite, `apply` gives the operator
    itself, which is negative semi-definite for the inner product ``f . (areas * g)``.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The caller's points [L], unchanged and in order.
    normals : ndarray, (n, 3)
        Unit normals, as given or estimated.
    areas : ndarray, (n,)
        Area elements [L^2], all positive: the lumped mass.
    smoothing_lengths : ndarray, (n,)
        h of each point [L]; the kernel reaches 3 h.
    stiffness : csr_array, (n, n)
        Symmetric positive semi-definite, rows sum to zero, no units.
    options : LaplacianOptions
        The settings it was built with.
    notices : list of str
        What a user should know: merged duplicates, a solver that stopped early.
    """

    def __init__(self, points, normals, areas, smoothing_lengths, stiffness, options, notices):
        self.points = points
        self.normals = normals
        self.areas = areas
        self.smoothing_lengths = smoothing_lengths
        self.stiffness = stiffness
        self.options = options
        self.notices = notices

    def apply(self, values, raw=False):
        """Apply the operator in its strong form.

        Parameters
        ----------
        values : array_like, (n,) or (n, m)
            A function on the points, or several as columns.
        raw : bool
            Leave out the symbol correction, giving ``-K f / areas``.

        Returns
        -------
        ndarray
            Same shape as the values, their Laplacian [unit of values / L^2]: ``L f - mu2 / 8 L(h^2 L f)``, which takes
            the kernel's width out to second order and stays self-adjoint and negative semi-definite; with `raw`, or
            without ``options.symbol_correction``, L f.

        Raises
        ------
        InvalidPointsError
            Values of another length than the points.
        """
        values = np.asarray(values, dtype=np.float64)
        if values.ndim not in (1, 2) or len(values) != len(self.areas):
            raise InvalidPointsError(
                f"Values have the shape {values.shape}, the operator {len(self.areas)} points. Give one row per point."
            )
        areas, lengths = self.areas, self.smoothing_lengths
        if values.ndim == 2:
            areas, lengths = areas[:, None], lengths[:, None]
        result = -(self.stiffness @ values) / areas
        if raw or not self.options.symbol_correction:
            return result
        return result + (SECOND_MOMENT / 8.0) * (self.stiffness @ (lengths**2 * result)) / areas

    def eigenpairs(self, count, raw=False, progress=None):
        """Compute the lowest eigenpairs of the negated operator, eq. (12).

        Parameters
        ----------
        count : int
            How many, the constant mode included.
        raw : bool
            Leave out the symbol correction of the eigenvalues.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        Spectrum

        Raises
        ------
        TooFewPointsError
            More modes than the points can have.
        UnresolvedModesError
            Modes asked for that vary faster than the smoothing length resolves, unless `raw`.
        SolverError
            The eigenvalue solver did not converge.
        """
        return solve_spectrum(self, count, raw or not self.options.symbol_correction, progress)


def build_laplacian(points, normals=None, options=LaplacianOptions(), progress=None):
    """Build the operator from a point cloud.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals : array_like, (n, 3), optional
        Normals to use as they are, of any length; estimated where not given.
    options : LaplacianOptions
        Settings.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` at the beginning of each stage; may raise `Cancelled`.

    Returns
    -------
    LaplaceBeltrami

    Raises
    ------
    PointCloudError
        The input has no sound answer; the text says why and what to do.

    References
    ----------
    Petronetto, Paiva, Helou, Stewart, Nonato. Mesh-free discrete Laplace-Beltrami operator. 2013.
    """
    report = progress or (lambda stage, fraction: None)
    points = check_points(points)
    if normals is not None:
        normals = unit_normals(normals, len(points))

    report("Neighbors", 0.0)
    neighborhoods = find_neighborhoods(points, options)
    scaled = neighborhoods.scaled
    notices = []
    if scaled.duplicates:
        notices.append(f"Points that lie exactly on another one: {scaled.duplicates}. They share one area.")
    if 2 * len(neighborhoods.first) > len(scaled.points) ** 2 / 3:
        notices.append(
            "The kernel of most points reaches over a third of the object, which is too wide for good results. Add"
            " points, or lower the number of neighbors."
        )

    report("Normals", 0.35)
    given = None if normals is None else normals[scaled.first]
    surface = fit_surface(neighborhoods, options, given)

    report("Areas", 0.5)
    distance = arc_length(neighborhoods, surface.normals) if options.curvature_correction else neighborhoods.distance
    solution = solve_areas(neighborhoods, distance, surface.kernel_integral, options)
    if not solution.converged:
        notices.append(f"The areas stopped after {solution.products} steps, close to their best values.")

    report("Operator", 0.8)
    if not options.curvature_correction:
        distance = projected_distance(neighborhoods, surface.normals)
    return LaplaceBeltrami(
        points,
        surface.normals[scaled.inverse] if normals is None else normals,
        scaled.share(solution.areas) * scaled.scale**2,
        neighborhoods.lengths[scaled.inverse] * scaled.scale,
        assemble_stiffness(neighborhoods, distance, solution.areas, surface.weight_factor),
        options,
        notices,
    )


def assemble_stiffness(neighborhoods, distance, areas, factor):
    """Assemble K = -D G D of eq. (10) for the caller's points.

    Points at the same place take equal parts of its area and couple as neighbours at distance zero.

    Parameters
    ----------
    neighborhoods : Neighborhoods
        Of m distinct points, with p pairs, that stand for n of the caller's.
    distance : ndarray, (p,)
        Distance of each pair in the mean-normal plane, or along the surface.
    areas : ndarray, (m,)
        Area elements in scaled coordinates.
    factor : ndarray, (m,)
        Factor of the pair weights; a pair takes the mean of its ends.

    Returns
    -------
    csr_array, (n, n)
        Symmetric, rows sum to zero, columns sorted; without units, so the same in any scale.
    """
    lengths = neighborhoods.mean(neighborhoods.lengths)
    weights = pair_kernel(distance / lengths) / lengths**4 * neighborhoods.mean(factor)
    weights *= areas[neighborhoods.first] * areas[neighborhoods.second]
    scaled = neighborhoods.scaled
    n = len(scaled.inverse)
    if scaled.duplicates:
        own = areas**2 * factor * pair_kernel(0.0) / neighborhoods.lengths**4
        spread = sparse.csr_array((1.0 / scaled.copies[scaled.inverse], (np.arange(n), scaled.inverse)))
        half = neighborhoods.half(weights)
        half = sparse.triu(spread @ (half + half.T + sparse.diags_array(own)) @ spread.T, 1, format="csr")
        half.indices, half.indptr = half.indices.astype(np.int32), half.indptr.astype(np.int32)
    else:
        caller = scaled.first.astype(np.int32)
        half = sparse.csr_array((weights, (caller[neighborhoods.first], caller[neighborhoods.second])), shape=(n, n))
    half = half.T.tocsr()  # transposing sorts the columns, which makes the sums fast
    weights = half + half.T.tocsr()
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
