"""The symmetrised mesh-free Laplace-Beltrami operator, eq. (10) of the paper."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from .areas import NO_AREA, solve_areas
from .cloud import read_cloud
from .curvature import weight_factor
from .distances import arc_length, projected_distance
from .errors import InvalidPointsError
from .images import mirror, own_images
from .kernel import SECOND_MOMENT, pair_kernel
from .moments import balance_weights
from .options import LaplacianOptions
from .points import check_points
from .spectrum import Spectrum, correct_eigenvalues, solve_spectrum

_NATURAL, _FIXED = 2.0, 2.0 / 3.0  # growth of the images' weights over that of their areas next to a curved rim


@dataclass(frozen=True, eq=False, repr=False)
class LaplaceBeltrami:
    """A discrete Laplace-Beltrami operator on points.

    Made by `build_laplacian`. One sign convention: `stiffness` K is positive semi-definite, `apply` gives the operator
    itself, which is negative semi-definite for the inner product ``f . (areas * g)``.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The caller's points [L], unchanged and in order.
    surface_points : ndarray, (n, 3)
        Where the operator takes them to be [L]: other places than `points` only where noise was smoothed.
    normals : ndarray, (n, 3)
        Unit normals, as given or estimated.
    areas : ndarray, (n,)
        Area elements [L^2], all positive: the lumped mass. Those of points left out are too small to count.
    mean_bend, gaussian_curvature : ndarray, (n,)
        Mean [1 / L] and product [1 / L^2] of the two principal curvatures, from local quadrics; the product is zero
        without the curvature correction.
    boundary : ndarray, (n,) bool
        Points at a rim of the surface.
    near_rim : ndarray, (n,) bool
        Points whose kernel reaches beyond a rim.
    rim_distance : ndarray, (n,)
        Distance to the nearest rim along the surface [L]; infinite where there is none near.
    rim_direction : ndarray, (n, 3)
        Unit vector across that rim, out of the surface; zero where it is not known.
    component : ndarray, (n,) int
        Connected part of each point, the largest first; -1 for points that were left out.
    smoothing_lengths : ndarray, (n,)
        h of each point [L]; the kernel reaches 3 h.
    stiffness : csr_array, (n, n)
        Symmetric positive semi-definite, rows sum to zero, no units. At a rim it is the natural one: no flow across.
    natural_images, fixed_images : csr_array, (n, n)
        Weights of the mirror images in the rim that `stiffness` holds, and of those that `fixed_rim` puts in their
        place; symmetric, not negative.
    options : LaplacianOptions
        The settings it was built with.
    notices : list of str
        What a user should know: merged duplicates, points left out, noise, a solver that stopped early.
    """

    points: np.ndarray
    surface_points: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    mean_bend: np.ndarray
    gaussian_curvature: np.ndarray
    boundary: np.ndarray
    near_rim: np.ndarray
    rim_distance: np.ndarray
    rim_direction: np.ndarray
    component: np.ndarray
    smoothing_lengths: np.ndarray
    stiffness: sparse.csr_array
    natural_images: sparse.csr_array
    fixed_images: sparse.csr_array
    options: LaplacianOptions
    notices: list

    @property
    def fixed_rim(self):
        """The operator of functions with fixed values at the rim, such as zero.

        Returns
        -------
        stiffness : csr_array, (n, n)
            Symmetric positive semi-definite, definite where there is a rim: the image of a point in the rim carries
            ``2 c - f`` instead of f.
        pull : csr_array, (n, n)
            ``stiffness @ f = areas * source + pull @ c`` solves -Delta f = source with the values c at the rim; c (n,)
            holds at every point the value at the nearest rim point.
        """
        natural = sparse.diags_array(self.natural_images.sum(axis=1)) - self.natural_images
        pull = sparse.diags_array(self.fixed_images.sum(axis=1)) + self.fixed_images
        return (self.stiffness - natural + pull).tocsr(), pull.tocsr()

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

    def eigenpairs(self, count, raw=False, fixed_rim=False, progress=None):
        """Compute the lowest eigenpairs of the negated operator, eq. (12).

        Parameters
        ----------
        count : int
            How many, the constant mode included.
        raw : bool
            Leave out the symbol correction of the eigenvalues.
        fixed_rim : bool
            Modes that vanish at the rim, instead of those that meet it level.
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
        stiffness = self.fixed_rim[0] if fixed_rim else self.stiffness
        spectrum = solve_spectrum(self, stiffness, count, progress)
        return spectrum if raw else self.corrected(spectrum)

    def corrected(self, spectrum):
        """Apply the symbol correction to the eigenvalues of a raw spectrum.

        Parameters
        ----------
        spectrum : Spectrum
            From ``eigenpairs(..., raw=True)``, or the lowest modes of one.

        Returns
        -------
        Spectrum
            As of `eigenpairs`; the same one without ``options.symbol_correction``.

        Raises
        ------
        UnresolvedModesError
            Modes that vary faster than the smoothing length resolves.
        """
        if not self.options.symbol_correction:
            return spectrum
        values, vectors = spectrum.eigenvalues, spectrum.eigenvectors
        return Spectrum(correct_eigenvalues(self, values, vectors), vectors)


def build_laplacian(
    points, normals=None, options=LaplacianOptions(), boundary=None, boundary_distance=None, progress=None
):
    """Build the operator from a point cloud.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals : array_like, (n, 3), optional
        Normals to use as they are, of any length and sign; estimated where not given.
    options : LaplacianOptions
        Settings.
    boundary : array_like, (k,) int or (n,) bool, optional
        The points at the rim, instead of those that the options would find.
    boundary_distance : array_like, (n,), optional
        Distance of every point to the rim along the surface [L], instead of a measured one; infinity where it is far.
        With `boundary`, measured ones stand next to corners, where there are two rims.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` in each stage; may raise `Cancelled`.

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

    cloud = read_cloud(points, options, normals, boundary, boundary_distance, report)
    scaled, pairs, notices = cloud.scaled, cloud.neighborhoods, cloud.notices
    if 2 * len(pairs.first) > len(scaled.points) ** 2 / 3:
        notices.append(
            "The kernel of most points reaches over a third of the object, which is too wide for good results."
            " Add points, or lower the number of neighbors."
        )

    report("Areas", 0.5)
    distance = arc_length(cloud) if options.curvature_correction else pairs.distance
    solution = solve_areas(cloud, distance, options, lambda: report("Areas", 0.6))
    if not solution.converged:
        notices.append(f"The areas stopped after {solution.products} steps, close to their best values.")

    report("Operator", 0.8)
    if not options.curvature_correction:
        distance = projected_distance(pairs, cloud.normals)
    stiffness, natural, fixed = assemble_stiffness(
        cloud, distance, solution.areas, options.curvature_correction, lambda: report("Operator", 0.8)
    )
    return LaplaceBeltrami(
        points=points,
        surface_points=points + scaled.hand_out(cloud.moved * scaled.scale, 0.0),
        normals=scaled.hand_out(cloud.normals, (0.0, 0.0, 1.0)),
        areas=scaled.share(solution.areas * scaled.scale**2, NO_AREA),
        mean_bend=scaled.hand_out(cloud.mean_bend / scaled.scale, 0.0),
        gaussian_curvature=scaled.hand_out(cloud.gaussian / scaled.scale**2, 0.0),
        boundary=scaled.hand_out(cloud.rim.at_rim, False),
        near_rim=scaled.hand_out(cloud.rim.reached(pairs.lengths), False),
        rim_distance=scaled.hand_out(cloud.rim.distance[:, 0] * scaled.scale, np.inf),
        rim_direction=scaled.hand_out(cloud.rim.outward[:, 0], 0.0),
        component=scaled.hand_out(cloud.label, -1),
        smoothing_lengths=scaled.hand_out(pairs.lengths * scaled.scale, pairs.lengths.mean() * scaled.scale),
        stiffness=stiffness,
        natural_images=natural,
        fixed_images=fixed,
        options=options,
        notices=notices,
    )


def assemble_stiffness(cloud, distance, areas, balanced=False, report=lambda: None):
    """Assemble K = -D G D of eq. (10) for the caller's points.

    Points at the same place take equal parts of its area and couple as neighbours at distance zero. The image of a
    point in a rim has the point's value, so that it adds to the weight of the pair.

    Parameters
    ----------
    cloud : Cloud
        Of m distinct points, with p pairs, that stand for n of the caller's.
    distance : ndarray, (p,)
        Distance of each pair in the mean-normal plane, or along the surface.
    areas : ndarray, (m,)
        Area elements in scaled coordinates.
    balanced : bool
        Give the weights around every point the moments of the kernel, by `balance_weights`.
    report : callable
        Called now and then while that is done; may raise `Cancelled`.

    Returns
    -------
    stiffness : csr_array, (n, n)
        Symmetric, rows sum to zero, columns sorted; without units, so the same in any scale.
    natural_images, fixed_images : csr_array, (n, n)
        Symmetric weights of the images in one rim, those of points in their own image on the diagonal: the part of the
        stiffness that is theirs, and what takes its place for fixed values at the rim. (An image of an image, across a
        corner, has the point's value either way.)

    Notes
    -----
    Next to a rim of curvature k the energy of a function along the rim comes out low by mu2 h^2 k / 4 of its own on the
    rim, because the kernel's pairs there have their middle inside more often than outside; twice the growth of the
    images' areas makes up for it. For functions that vanish at the rim two thirds do, as measured on discs.
    """
    pairs = cloud.neighborhoods
    factor = weight_factor(pairs.lengths, cloud.gaussian)
    lengths = pairs.mean(pairs.lengths)
    scale = pairs.mean(factor) / lengths**4 * areas[pairs.first] * areas[pairs.second]
    own_scale = factor / pairs.lengths**4 * areas**2
    # Weights of pairs, and of points with themselves, without images; then those of the images in one rim.
    plain = pair_kernel(distance / lengths) * scale, pair_kernel(0.0) * own_scale
    if balanced:
        plain = plain[0] * balance_weights(cloud, distance, plain[0], areas, report), plain[1]
    natural, fixed = (tuple(np.zeros_like(part) for part in plain) for _ in range(2))
    for part, images, h, units in (
        (0, mirror(pairs, distance, cloud.rim), lengths, scale),
        (1, own_images(pairs, cloud.rim), pairs.lengths, own_scale),
    ):
        nearest, second, across = images
        for rows, image, larger in (nearest, second):
            weight = pair_kernel(image / h[rows]) * units[rows]
            natural[part][rows] += (1.0 + _NATURAL * (larger - 1.0)) * weight
            fixed[part][rows] += (1.0 + _FIXED * (larger - 1.0)) * weight
        rows, image, larger = across
        plain[part][rows] += (1.0 + _NATURAL * (larger - 1.0)) * pair_kernel(image / h[rows]) * units[rows]
    weights = _for_callers_points(cloud, plain[0] + natural[0], plain[1] + natural[1])
    stiffness = (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
    if not natural[1].any():
        return stiffness, sparse.csr_array(stiffness.shape), sparse.csr_array(stiffness.shape)
    known = natural[0] > 0.0
    cloud = replace(cloud, neighborhoods=pairs.keep(known))
    return stiffness, *(_for_callers_points(cloud, images[0][known], images[1]) for images in (natural, fixed))


def _for_callers_points(cloud, weights, own):
    """Return the symmetric matrix of pair weights and own weights for the caller's points, columns sorted."""
    scaled, pairs = cloud.scaled, cloud.neighborhoods
    n = len(scaled.inverse)
    if scaled.duplicates:
        known = np.flatnonzero(scaled.inverse >= 0)
        row = scaled.inverse[known]
        spread = sparse.csr_array((1.0 / scaled.copies[row], (known, row)), shape=(n, len(own)))
        half = pairs.half(weights)
        return (spread @ (half + half.T + sparse.diags_array(own)) @ spread.T).tocsr()
    caller = scaled.first.astype(np.int32)
    half = sparse.csr_array((weights, (caller[pairs.first], caller[pairs.second])), shape=(n, n))
    half = half.T.tocsr()  # transposing sorts the columns, which makes the sums fast
    diagonal = np.zeros(n)
    diagonal[caller] = own
    return (half + half.T.tocsr() + sparse.diags_array(diagonal, format="csr")).tocsr()
