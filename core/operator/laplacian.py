"""The symmetrised mesh-free Laplace-Beltrami operator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..algebra import multiply_rows, workers
from ..arguments import check_points, check_switches, positive
from ..errors import InvalidPointsError
from ..frozen import Frozen
from ..geometry import (
    Agreed,
    Cloud,
    Doubt,
    arc_length,
    check_values,
    move_apart,
    read_cloud,
    scatter_radii,
    toward,
)
from ..kernel import SECOND_MOMENT
from ..memory import check_memory
from ..options import LaplacianOptions, check_options
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress, Report
from .areas import NO_AREA, solve_areas
from .kept import Kept
from .spectrum import TOLERANCE, Spectrum, check_count, correct_eigenvalues, solve_spectrum
from .stiffness import Stiffness, assemble_stiffness
from .trust import doubt_notices, measure_trust

NARROW = 45  # neighbors inside the support of a narrow operator: the fewest that suffice for random points


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class LaplaceBeltrami(Frozen):
    """A discrete Laplace-Beltrami operator on points.

    Made by `build_laplacian`. One sign convention: `stiffness` K is positive semi-definite, `apply` gives the operator
    itself, which is negative semi-definite for the inner product ``f . (areas * g)``.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The caller's points [L], unchanged and in order.
    surface_points : ndarray, (n, 3)
        The same as the operator uses them [L]: at other positions only where noise was smoothed.
    normals : ndarray, (n, 3)
        Unit normals, as given or estimated.
    areas : ndarray, (n,)
        Area elements [L^2], all positive: the lumped mass. Those of points left out are too small to count.
    shape_operator : ndarray, (n, 3, 3)
        Second fundamental form of local quadrics [1 / L]: ``t . shape_operator t`` is the curvature along the unit
        tangent t, positive where the surface curves away from the normal.
    gaussian_curvature : ndarray, (n,)
        Product of the two principal curvatures [1 / L^2], from local quadrics.
    curvature_scatter : ndarray, (n,)
        Standard deviation of the mean curvature of local quadrics over that of noise across the surface [1 / L^2].
    cell_radius : ndarray, (n,)
        Radius of the Voronoi cell [L], up to its furthest corner.
    disc_radii : ndarray, (n,)
        Radii of discs that cover the surface [L], at most three spacings of the points around, to be drawn.
    boundary : ndarray, (n,) bool
        Points at a boundary of the surface.
    near_boundary : ndarray, (n,) bool
        Points whose kernel extends beyond a boundary.
    boundary_distance : ndarray, (n,)
        Distance to the nearest boundary along the surface [L]; infinite far from any.
    boundary_direction : ndarray, (n, 3)
        Unit vector across that boundary, out of the surface; zero where it is not known.
    component : ndarray, (n,) int
        Component of each point, the largest first; -1 for points that were left out.
    trust : ndarray, (n,)
        How reliable results are, from 0 to 1: less than a half where no positive weights have the moments of the kernel
        within a tenth, or where the neighbors deviate from a quadric by their spacing. 0 for points left out.
    doubt : ndarray, (n,) int
        Why it is less than a half, of `Doubt`; 0 where it is not.
    smoothing_lengths : ndarray, (n,)
        h of each point [L]; the radius of the kernel is 3 h.
    kernel_widths : ndarray, (n,)
        Smoothing length of a kernel with the fourth moment of the balanced weights [L], for the symbol correction.
        Zero in the paper's operator, which has none.
    stiffness : csr_array, (n, n)
        Symmetric positive semi-definite, rows sum to zero, no units. At a boundary it is the Neumann one: no flow
        across.
    images : csr_array, (n, n)
        Weights of the mirror images in the boundary that `stiffness` holds; symmetric, not negative.
    options : LaplacianOptions
        The settings it was built with.
    agreed : Agreed
        What was decided for the cloud as a whole.
    notices : list of str
        Texts for the user: merged duplicates, points left out, noise, a solver that stopped early.
    """

    points: Floats
    surface_points: Floats
    normals: Floats
    areas: Floats
    shape_operator: Floats
    gaussian_curvature: Floats
    curvature_scatter: Floats
    cell_radius: Floats
    disc_radii: Floats
    boundary: Bools
    near_boundary: Bools
    boundary_distance: Floats
    boundary_direction: Floats
    component: Ints
    trust: Floats
    doubt: Ints
    smoothing_lengths: Floats
    kernel_widths: Floats
    stiffness: sparse.csr_array
    images: sparse.csr_array
    options: LaplacianOptions
    agreed: Agreed
    notices: list[str]

    def __repr__(self) -> str:
        components = np.max(self.component, initial=-1) + 1
        left_out = np.count_nonzero(self.component < 0)
        return (
            f"<LaplaceBeltrami: {len(self.points)} points, {components} component{'' if components == 1 else 's'},"
            f" area {self.areas.sum():.6g}{f', {left_out} left out' if left_out else ''}>"
        )

    @cached_property
    def kept(self) -> Kept:
        """What was computed of it and may be needed again: modes, factors, distances, a mesh."""
        return Kept()

    @property
    def known_modes(self) -> int:
        """How many modes `eigenpairs` has at once."""
        found = self.kept.known("modes")
        return 0 if found is None else len(found.eigenvalues)

    def release(self) -> None:
        """Drop what was computed of the operator and is kept: its modes, factors, distances and mesh.

        All of it is computed again when it is needed.

        See Also
        --------
        LaplaceBeltrami.eigenpairs : Keeps the modes that it computed.

        Examples
        --------
        >>> import numpy as np
        >>> import meshfree_laplacian as mf
        >>> points = mf.example_sphere()
        >>> laplacian = mf.build_laplacian(points)
        >>> spectrum = laplacian.eigenpairs(9)
        >>> laplacian.release()
        """
        self.kept.clear()

    @property
    def quadric_mean_curvature(self) -> Floats:
        """Mean curvature of local quadrics through the nearest points, (n,) [1 / L].

        `measure.mean_curvature` is nearer to the truth: without noise the operator's own is, by 3 % on 800 even points
        of a sphere and by 0.3 % on 8,000; with noise that scatters three to ten times as much as this, and averages of
        this scatter less.
        """
        return 0.5 * np.trace(self.shape_operator, axis1=1, axis2=2)

    @property
    def dirichlet(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """The operator of functions with fixed values at the boundary, such as zero.

        Returns
        -------
        stiffness : csr_array, (n, n)
            Symmetric positive semi-definite, definite where there is a boundary: the image of a point in the boundary
            carries ``2 c - f`` instead of f.
        pull : csr_array, (n, n)
            ``stiffness @ f = areas * source + pull @ c`` solves -Delta f = source with the values c at the boundary; c
            (n,) holds at every point the value at the nearest boundary point.
        """
        pull = sparse.diags_array(self.images.sum(axis=1)) + self.images
        return (self.stiffness + 2.0 * self.images).tocsr(), pull.tocsr()

    def toward(self, directions: ArrayLike) -> LaplaceBeltrami:
        """Return the same operator with normals that point to the side of given directions.

        Parameters
        ----------
        directions : array_like, (n, 3)
            Such as of `orient_normals`; where they are zero the normal stays as it is.

        Returns
        -------
        LaplaceBeltrami
            Normals, and the curvature that takes its sign from them, are reversed where they pointed against the
            directions. All else is the same: the Laplacian does not depend on the side.

        Raises
        ------
        InvalidPointsError
            Directions that do not fit the points, or are not finite.

        See Also
        --------
        orient_normals : Finds the sides.
        measure.mean_curvature : Has the sign that the normals give it.

        Examples
        --------
        A sphere seen from within is hollow:

        >>> import numpy as np
        >>> import meshfree_laplacian as mf
        >>> points = mf.example_sphere()
        >>> inner = mf.build_laplacian(points).toward(-points)
        >>> print(mf.measure.mean_curvature(inner).mean().round(2))
        -1.0
        """
        given = check_values(directions, len(self.normals))
        if given.ndim != 2 or given.shape[1] != 3:
            raise InvalidPointsError(
                f"Directions of shape {given.shape} do not fit {len(self.normals)} normals. Give three numbers"
                " for each."
            )
        normals = toward(self.normals, given)
        reversed_ = np.einsum("ij,ij->i", normals, self.normals) < 0.0
        shape_operator = np.where(reversed_[:, None, None], -self.shape_operator, self.shape_operator)
        return replace(self, normals=normals, shape_operator=shape_operator)

    def apply(self, values: ArrayLike, raw: bool = False) -> Floats:
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
            Same shape as the values, their Laplacian [unit of values / L^2]: ``L f - mu2 / 8 L(h^2 L f)``, which
            corrects for the kernel's width to second order and stays self-adjoint and negative semi-definite; with
            `raw`, L f.

        Raises
        ------
        InvalidPointsError
            Values that do not fit the points, or are not finite.

        See Also
        --------
        LaplaceBeltrami.eigenpairs : Its eigenfunctions.
        measure.mean_curvature : Applies it to the coordinates.
        distance.solve_poisson : Its inverse.

        Examples
        --------
        On the unit sphere the Laplacian of a coordinate is -2 times it:

        >>> import numpy as np
        >>> import meshfree_laplacian as mf
        >>> points = mf.example_sphere()
        >>> z = points[:, 2]
        >>> laplacian = mf.build_laplacian(points)
        >>> print(np.abs(laplacian.apply(z) + 2 * z).max().round(1))
        0.0
        """
        check_switches(raw=raw)
        checked = check_values(values, len(self.areas))
        areas, widths = self.areas, self.kernel_widths
        if checked.ndim == 2:
            areas, widths = areas[:, None], widths[:, None]
        result: Floats = -multiply_rows(self.stiffness, checked) / areas
        if raw:
            return result
        return result + (SECOND_MOMENT / 8.0) * multiply_rows(self.stiffness, widths**2 * result) / areas

    @ends_at_one
    def eigenpairs(
        self,
        count: int,
        raw: bool = False,
        *,
        dirichlet: bool = False,
        tolerance: float = TOLERANCE,
        progress: Progress | None = None,
    ) -> Spectrum:
        """Compute the lowest eigenpairs of the negated operator, eq. (12).

        They are kept: as many or fewer are had at once the next time. `release` drops them.

        Parameters
        ----------
        count : int
            How many, the constant mode included.
        raw : bool
            Leave out the symbol correction of the eigenvalues.
        dirichlet : bool
            Dirichlet modes, which vanish at the boundary, instead of Neumann modes, whose derivative across it does.
        tolerance : float
            Largest residual, see `Spectrum`. Errors of eigenvectors are proportional to it, over the relative gap to
            the next eigenvalue; those of eigenvalues to its square.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        Spectrum

        Raises
        ------
        TooFewPointsError
            More modes than a third of the points, or a count below 1.
        UnresolvedModesError
            Modes asked for that vary faster than the smoothing length resolves; never with `raw`.
        NotEnoughMemoryError
            More modes than the free memory is enough for, before the start.
        SolverError
            The eigenvalue solver did not converge.

        See Also
        --------
        LaplaceBeltrami.corrected : The symbol correction alone.
        clean.spectral_filter : Filters functions by modes.
        spectral.heat_kernel_signature : Distinguishes points by modes.
        spectral.segment : Finds parts by modes.

        Examples
        --------
        On the unit sphere ``l (l + 1)`` is an eigenvalue 2 l + 1 times:

        >>> import numpy as np
        >>> import meshfree_laplacian as mf
        >>> points = mf.example_sphere()
        >>> laplacian = mf.build_laplacian(points)
        >>> print(laplacian.eigenpairs(9).eigenvalues.round(1))
        [0. 2. 2. 2. 6. 6. 6. 6. 6.]
        """
        check_switches(raw=raw, dirichlet=dirichlet)

        def solve() -> Spectrum:
            stiffness = self.dirichlet[0] if dirichlet else self.stiffness
            places = self.points, self.areas, self.component, self.smoothing_lengths
            return solve_spectrum(stiffness, *places, count, tolerance, progress)

        def serves(solved_to: tuple[float, ...], found: Spectrum) -> bool:
            return solved_to <= (tolerance,) and len(found.eigenvalues) >= count

        check_count(count, len(self.points))
        positive(tolerance, "tolerance of the modes")
        found = self.kept.serving("Dirichlet modes" if dirichlet else "modes", solve, serves, (tolerance,))
        lowest = found.lowest(int(count))
        return lowest if raw else self.corrected(lowest)

    def corrected(self, spectrum: Spectrum) -> Spectrum:
        """Apply the symbol correction to the eigenvalues of a raw spectrum.

        Parameters
        ----------
        spectrum : Spectrum
            From ``eigenpairs(..., raw=True)``, or the lowest modes of one.

        Returns
        -------
        Spectrum
            As of `eigenpairs`.

        Raises
        ------
        UnresolvedModesError
            Modes that vary faster than the smoothing length resolves.
        """
        values, vectors = spectrum.eigenvalues, spectrum.eigenvectors
        values = correct_eigenvalues(self.areas, self.kernel_widths, values, vectors)
        return Spectrum(values, vectors, spectrum.residuals)


@ends_at_one
@workers()
def build_laplacian(
    points: ArrayLike,
    normals: ArrayLike | None = None,
    options: LaplacianOptions = LaplacianOptions(),
    *,
    boundary: ArrayLike | None = None,
    boundary_distance: ArrayLike | None = None,
    left_out: ArrayLike = (),
    agreed: Agreed | None = None,
    progress: Progress | None = None,
) -> LaplaceBeltrami:
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
        The points at the boundary, instead of detected ones.
    boundary_distance : array_like, (n,), optional
        Distance of every point to the boundary along the surface [L], instead of a measured one; infinity where it is
        far. With `boundary`, distances next to corners, where there are two boundaries, are measured nevertheless.
    left_out : array_like, (k,) int or (n,) bool, optional
        Points to leave out, such as `splats.floaters`: on the others the operator is that of them alone.
    agreed : Agreed, optional
        What was decided for a cloud that these points are all of, or a part of with a halo around; see `Agreed`.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` in each stage; may raise `Cancelled`.

    Returns
    -------
    LaplaceBeltrami

    Raises
    ------
    PointCloudError
        The input has no sound answer; the text says why and what to do. Its subclasses: points, normals or a boundary
        of a wrong shape, or not finite (`InvalidPointsError`), fewer points than the neighborhoods need
        (`TooFewPointsError`), points along a curve (`NotASurfaceError`), components of too few points alone
        (`ComponentError`), more points than the free memory is enough for, before the start (`NotEnoughMemoryError`).

    See Also
    --------
    LaplacianOptions : All settings.
    estimate_areas : Areas alone.
    estimate_normals : Normals alone.
    paper.check_stability : Judges the operator.
    paper.build_laplacian : The operator of the paper below, to the letter.

    References
    ----------
    Petronetto, Paiva, Helou, Stewart, Nonato. Mesh-free discrete Laplace-Beltrami operator. 2013.

    Examples
    --------
    The unit sphere has the area 4 pi and no boundary, and its modes after the constant one the eigenvalue 2:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> print(laplacian.areas.sum().round(1), laplacian.boundary.any(), laplacian.notices)
    12.6 False []
    >>> print(laplacian.eigenpairs(4).eigenvalues.round(1))
    [0. 2. 2. 2.]
    """
    report = progress or (lambda stage, fraction: None)
    check_options(options)
    checked = check_points(points)
    check_memory(len(checked), options)

    cloud = read_cloud(checked, options, normals, boundary, boundary_distance, report, left_out, agreed)
    report("Areas", 0.72)
    distance = arc_length(cloud)
    areas = solve_areas(cloud, distance, lambda: report("Areas", 0.73))

    report("Operator", 0.75)
    cloud = replace(cloud, pairs=replace(cloud.pairs, distance=distance))  # frees the memory of distances in space
    return assemble_laplacian(checked, cloud, areas, options, lambda: report("Operator", 0.75))


def assemble_laplacian(
    points: Floats, cloud: Cloud, areas: Floats, options: LaplacianOptions, report: Report = lambda: None
) -> LaplaceBeltrami:
    """Assemble the operator from what it consists of.

    Points, (n, 3) [L], are the caller's; the cloud is of the m distinct ones, with the distances of pairs along the
    surface; areas, (m,), are from `solve_areas`. `report` is called now and then; it may raise `Cancelled`.
    """
    stiffness = assemble_stiffness(cloud, cloud.pairs.distance, areas, report)
    return laplacian_of(points, cloud, areas, stiffness, options)


def laplacian_of(
    points: Floats, cloud: Cloud, areas: Floats, assembled: Stiffness, options: LaplacianOptions
) -> LaplaceBeltrami:
    """Transfer the results for the distinct points in scaled coordinates to the caller's points and units."""
    scaled, pairs, notices = cloud.scaled, cloud.pairs, cloud.notices
    if 2 * len(pairs.first) > len(scaled.points) ** 2 / 3:
        notices.append(
            "The kernel of most points covers more than a third of the object, which is too wide for good results."
            " Add points, or make the kernel narrower."
        )
    component = scaled.scatter(cloud.component, -1)
    alone = (component >= 0) & (assembled.matrix.diagonal() == 0.0)
    component[alone] = -1
    if alone.any():
        notices.append(f"Points of a surface with no others within their kernels, left out: {np.count_nonzero(alone)}.")
    trust = measure_trust(cloud, assembled.residual)
    doubt = np.where(trust < 0.5, cloud.cause, Doubt.NONE)
    if options.bandwidth == "adaptive":  # the width of others is the caller's choice
        notices += doubt_notices(doubt, areas)
    return LaplaceBeltrami(
        points=points,
        surface_points=points + scaled.scatter(cloud.moved * scaled.scale, 0.0),
        normals=scaled.scatter(cloud.normals, (0.0, 0.0, 1.0)),
        areas=np.where(alone, NO_AREA, scaled.scatter(areas * scaled.scale**2 / scaled.copies, NO_AREA)),
        shape_operator=scaled.scatter(cloud.shape_operator / scaled.scale, 0.0),
        gaussian_curvature=scaled.scatter(cloud.gaussian_curvature / scaled.scale**2, 0.0),
        curvature_scatter=scaled.scatter(cloud.curvature_scatter / scaled.scale**2, 0.0),
        cell_radius=scaled.scatter(
            cloud.cell_radius * scaled.scale, float(np.median(cloud.cell_radius)) * scaled.scale
        ),
        disc_radii=scatter_radii(cloud.disc_radii, scaled, points),
        boundary=scaled.scatter(cloud.boundary.at_boundary, False),
        near_boundary=scaled.scatter(cloud.boundary.reached(pairs.lengths), False),
        boundary_distance=scaled.scatter(cloud.boundary.distance[:, 0] * scaled.scale, np.inf),
        boundary_direction=scaled.scatter(cloud.boundary.outward[:, 0], 0.0),
        component=component,
        trust=np.where(alone, 0.0, scaled.scatter(trust, 0.0)),
        doubt=np.where(alone, Doubt.LEFT_OUT, scaled.scatter(doubt, Doubt.LEFT_OUT)),
        smoothing_lengths=scaled.scatter(pairs.lengths * scaled.scale, pairs.lengths.mean() * scaled.scale),
        kernel_widths=scaled.scatter(assembled.widths * scaled.scale, pairs.lengths.mean() * scaled.scale),
        stiffness=assembled.matrix,
        images=assembled.images,
        options=options,
        agreed=cloud.decisions.made,
        notices=notices,
    )


@ends_at_one
def narrow_laplacian(
    laplacian: LaplaceBeltrami, neighbors: int = NARROW, *, rows: Ints | None = None, progress: Progress | None = None
) -> LaplaceBeltrami:
    """Build an operator with few neighbors on the same points, to be factorised, or on some of them.

    Neighbors are those inside the kernel's support. It is less accurate for functions, but sharp at fixed points, and
    with small factors. Points, normals, boundary and `surface_points` are those of the given one, which is returned if
    it is as narrow already. Of `rows`, (k,) int, components do not join those of the given operator.
    """
    options = replace(
        laplacian.options,
        bandwidth="local",
        neighbors=neighbors,
        bandwidth_factor=1.0 / 3.0,  # the support of 3 h ends at the last neighbor
        projection="off",
    )
    points, normals, boundary = laplacian.surface_points, laplacian.normals, laplacian.boundary
    if rows is None:
        if laplacian.options == options:
            return laplacian
        # What was decided for these points stands; they are not rounded any more, and other pairs need other bridges.
        agreed = replace(laplacian.agreed, rounded=np.zeros(3), bridges=None, length=None, ratio=None)
        built = build_laplacian(
            points,
            normals,
            options,
            boundary=boundary,
            left_out=laplacian.component < 0,
            agreed=agreed,
            progress=progress,
        )
        return replace(built, points=laplacian.points)
    apart = move_apart(points[rows], laplacian.component[rows])
    built = build_laplacian(apart, normals[rows], options, boundary=boundary[rows], progress=progress)
    return replace(built, points=laplacian.points[rows], surface_points=points[rows])
