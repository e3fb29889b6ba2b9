"""New positions of the points: smoothed or sharpened by frequency, faired without eigenvectors, displaced by a mode.

And roughness, the displacement from the smooth ones.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..algebra import solve_symmetric
from ..arguments import check_switches, positive, real, whole
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import check_values
from ..operator import LaplaceBeltrami, Spectrum
from ..progress import ends_at_one
from ..types import Floats, Progress, Response
from .filters import chebyshev_filter, fairing, spectral_filter
from .sizes import SurfaceSize, match_size

_KEPT = (None, "area", "volume")
_TOLERANCE = 1e-5  # of the factors: the coordinates are large next to the spacing
_NOISE = 1.25  # mean squares of the smoothing lengths: time that removes the noise of single points
DETAIL = 9.0  # smoothing lengths of a wavelength below which details count as roughness
_EXACT = 1e-8  # error of roughness, as a share of the smoothing length, however large the cloud is against that
_AROUND = 4  # neighbors along the boundary that a boundary point is joined to


@ends_at_one
def smooth_points(
    laplacian: LaplaceBeltrami,
    response: int | Response,
    spectrum: Spectrum | None = None,
    *,
    strength: float = 1.0,
    mask: ArrayLike | None = None,
    keep: str | None = None,
    dirichlet: bool = False,
    progress: Progress | None = None,
) -> Floats:
    """Filter the shape of the surface by frequency.

    The coordinates are three functions on the points. Each component keeps its centre, so that the result moves
    and rotates with the points, and components do not collapse into each other.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    response : int or callable
        A whole number m keeps the first m modes, a low-pass whose cost follows m. A callable maps an array of
        eigenvalues [1 / L^2] to factors, such as `exponential`, `band` and `boost` return; without a spectrum it needs
        no eigenvectors and should be smooth.
    spectrum : Spectrum, optional
        Of this operator, with the same dirichlet. The residual outside its modes gets the response at its highest
        eigenvalue, or is dropped where the response is a number. Eigenvalues matter for callables only: for many modes,
        beyond those that are resolved, ``eigenpairs(count, raw=True)`` suffices.
    strength : float
        Factor of the displacements to the filtered positions: 1 is the full effect, above exaggerates, below 0
        sharpens.
    mask : array_like, (n,), optional
        Weight of each point from 0, which stays where it is, to 1, such as those of a vertex group.
    keep : {None, "area", "volume"}
        Scale the filtered shape about the centre of each component (of the masked region) so that the result has
        the same area, or enclosed volume. The volume needs a closed surface and normals that point outwards.
    dirichlet : bool
        Boundary points stay where they are: displacements from the harmonic surface that spans the boundary are
        filtered, with Dirichlet conditions. Otherwise a boundary shrinks as well, with Neumann conditions.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        New positions of ``laplacian.points`` [L]. Points that the operator leaves out stay.

    Raises
    ------
    PointCloudError
        An invalid response, mask, strength or choice, modes that are constants only, or a volume to keep of a surface
        that encloses none.
    TooFewPointsError, SolverError
        From the spectrum, where it is computed here; no scale restores the size.

    See Also
    --------
    fair_points : An implicit step against noise.
    spectral_filter : Filters any function by modes.
    chebyshev_filter : Filters any function without modes.
    exponential, fairing, band, boost : Responses.

    References
    ----------
    Vallet, Levy. Spectral geometry processing with manifold harmonics. 2008. Section 4 and Figure 12 of the paper.

    Examples
    --------
    Coordinates of the unit sphere are modes of eigenvalue 2, so that the flow of heat for the time 0.1 shrinks it by
    exp(-0.2), unless its area is kept:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> smaller = mf.clean.smooth_points(laplacian, mf.clean.exponential(0.1))
    >>> print(np.linalg.norm(smaller, axis=1).mean().round(2))
    0.82
    >>> same = mf.clean.smooth_points(laplacian, mf.clean.exponential(0.1), keep="area")
    >>> print(np.linalg.norm(same, axis=1).mean().round(2))
    1.0
    """
    if not (callable(response) or whole(response) < np.inf):
        raise PointCloudError(f"The response is {response!r}. Give a whole number of modes, or a function.")
    blend = PointBlend(laplacian, strength=strength, mask=mask, keep=keep, dirichlet=dirichlet)
    base = smoothing_base(laplacian, dirichlet=dirichlet, progress=progress)
    rest = laplacian.points - base
    if callable(response):
        if spectrum is None:
            filtered = chebyshev_filter(
                laplacian, rest, response, dirichlet=dirichlet, tolerance=_TOLERANCE, progress=progress
            )
        else:
            end = float(np.ravel(response(spectrum.eigenvalues[-1:]))[0])
            filtered = spectral_filter(rest, spectrum, laplacian.areas, response, rest=end)
    else:
        if spectrum is None:
            spectrum = laplacian.eigenpairs(response, raw=True, dirichlet=dirichlet, progress=progress)
        components = laplacian.component.max() + 1
        if not dirichlet and response <= components:
            raise PointCloudError(
                f"The first {response} modes move {components} component(s) as a whole and have no shape. Keep"
                f" at least {components + 3} modes."
            )
        filtered = spectral_filter(rest, spectrum, laplacian.areas, response)
    return blend(base + filtered)


@ends_at_one
def fair_points(
    laplacian: LaplaceBeltrami,
    time: float | None = None,
    *,
    order: int = 3,
    strength: float = 1.0,
    mask: ArrayLike | None = None,
    keep: str | None = None,
    dirichlet: bool = False,
    progress: Progress | None = None,
) -> Floats:
    """Smooth the surface by an implicit step, without eigenvectors: for noise, also on large clouds.

    Solves ``(1 + (time L)^order) x = x0`` with the negated operator L, whose eigenvalues are the symbol-corrected ones.
    With ``order=1`` this is implicit fairing, ``(areas + time K) x = areas x0``, which also shrinks large features. The
    third order preserves them, at the same effect on noise.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    time : float, optional
        [L^2]. Details of a wavelength below ``2 pi sqrt(time)`` are more than halved. If not given, 1.25 times
        the mean square of the smoothing lengths, which removes the noise of single points.
    order : int
        1, 2 or 3: the higher, the sharper the cutoff.
    strength, mask, keep, dirichlet, progress
        As in `smooth_points`.

    Returns
    -------
    ndarray, (n, 3)
        New positions of ``laplacian.points`` [L]. Points that the operator leaves out stay.

    Raises
    ------
    PointCloudError
        An invalid time, order, mask, strength or choice, or a volume to keep of a surface that encloses none.
    SolverError
        No scale restores the size.

    See Also
    --------
    smooth_points : Filters by any response, or by modes.
    fairing : The response.

    Notes
    -----
    The operator's spectrum is bounded by its wide kernel. A polynomial of the operator solves the equations in fewer
    products than conjugate gradients, whose steps grow with the power ``order / 2`` of the time, not with its root.

    References
    ----------
    Desbrun, Meyer, Schroder, Barr. Implicit fairing of irregular meshes using diffusion and curvature flow. 1999.

    Examples
    --------
    Radii that scatter by 0.02 scatter by a quarter of that afterwards:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> noisy = points * np.random.default_rng(0).normal(1, 0.02, (800, 1))
    >>> smooth = mf.clean.fair_points(mf.build_laplacian(noisy))
    >>> print(np.linalg.norm(noisy, axis=1).std().round(3), np.linalg.norm(smooth, axis=1).std().round(3))
    0.02 0.005
    """
    if time is None:
        known = laplacian.component >= 0
        time = _NOISE * float(np.average(laplacian.smoothing_lengths[known] ** 2, weights=laplacian.areas[known]))
    return smooth_points(
        laplacian,
        fairing(time, order),
        strength=strength,
        mask=mask,
        keep=keep,
        dirichlet=dirichlet,
        progress=progress,
    )


@ends_at_one
def roughness(
    laplacian: LaplaceBeltrami, wavelength: float | None = None, *, progress: Progress | None = None
) -> Floats:
    """Measure the signed height of points above the smoothed surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals must agree in sign, as estimated ones do.
    wavelength : float, optional
        Wavelength [L] of which half counts as roughness: finer details count fully, wider ones as shape. If not given,
        9 times the median smoothing length of the points that take part.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,)
        Distance from the smoothed surface along the normal [L], positive on the side that the normals point to. Zero
        for points that the operator leaves out.

    Raises
    ------
    PointCloudError
        A wavelength that is not above zero.

    See Also
    --------
    fair_points : Computes the smoothed surface.
    measure.principal_curvatures : Curvature of the surface itself.

    Examples
    --------
    One point of the unit sphere is 0.02 too far out:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> points[400] *= 1.02
    >>> rough = mf.clean.roughness(mf.build_laplacian(points))
    >>> print(np.argmax(np.abs(rough)), rough[400].round(2))
    400 0.02
    """
    kept = laplacian.component >= 0
    usual = float(np.median(laplacian.smoothing_lengths[kept]))
    length = positive(DETAIL * usual if wavelength is None else wavelength, "wavelength of the roughness")
    rest = laplacian.points - smoothing_base(laplacian)
    smooth = chebyshev_filter(
        laplacian,
        rest,
        fairing((length / (2.0 * np.pi)) ** 2),
        tolerance=_EXACT * usual / float(np.abs(rest).max()),
        progress=progress,
    )
    return np.einsum("ij,ij->i", rest - smooth, laplacian.normals)


def displace_by_mode(
    laplacian: LaplaceBeltrami, mode: ArrayLike, amplitude: float | None = None, *, phase: float = 0.0
) -> Floats:
    """Move the points along their normals by a vibration mode (Figure 9 of the paper).

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals must agree in sign, as estimated ones do.
    mode : array_like, (n,)
        A column of the eigenvectors, or any function; only its shape matters, not its size.
    amplitude : float, optional
        Largest displacement [L]; a tenth of the points' root mean square radius if not given.
    phase : float
        Angle of the vibration [rad]: 0 is full displacement, pi / 2 none, pi the opposite.

    Returns
    -------
    ndarray, (n, 3)
        ``points + amplitude cos(phase) mode / max |mode| normals``.

    Raises
    ------
    InvalidPointsError
        A mode that does not fit the points.
    PointCloudError
        A mode that is zero, or an amplitude or phase that is not finite.

    See Also
    --------
    LaplaceBeltrami.eigenpairs : Computes modes.
    spectral.nodal_domains : Where a mode keeps its sign.

    Examples
    --------
    The height is a mode of the unit sphere. It moves both poles up by 0.2, one of them outwards and the other inwards:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> moved = mf.clean.displace_by_mode(laplacian, z, 0.2)
    >>> print(moved[:, 2].min().round(1), moved[:, 2].max().round(1))
    -0.8 1.2
    """
    points = laplacian.points
    mode = check_values(mode, len(points), columns=False)
    if amplitude is None:
        amplitude = 0.1 * np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    most, angle = real(amplitude), real(phase)
    if not (np.isfinite(most) and np.isfinite(angle)):
        raise PointCloudError(f"Amplitude {amplitude!r} and phase {phase!r} must be finite numbers.")
    largest = np.abs(mode).max()
    if largest == 0.0:
        raise PointCloudError(
            f"The mode is zero at all {len(points)} points, so that no point would move. Choose another one."
        )
    return points + (most * np.cos(angle)) * (mode / largest)[:, None] * laplacian.normals


@ends_at_one
def smoothing_base(laplacian: LaplaceBeltrami, *, dirichlet: bool = False, progress: Progress | None = None) -> Floats:
    """Return the positions that filters do not change: they filter displacements from these.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    dirichlet : bool
        As in `smooth_points`.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        The centre of each component or, with a fixed boundary, the harmonic surface that spans it [L].

    Raises
    ------
    PointCloudError
        A fixed boundary without points of its own.
    SolverError
        The solver did not converge.
    """
    return laplacian.kept.result("smoothing base", lambda: _base(laplacian, dirichlet, progress), dirichlet)


def _base(laplacian: LaplaceBeltrami, dirichlet: bool, progress: Progress | None) -> Floats:
    """Compute what `smoothing_base` returns."""
    points, component = laplacian.points, laplacian.component
    base = points.copy()
    known = component >= 0
    base[known] = _centers(laplacian, laplacian.areas)[component[known]]
    if dirichlet:
        boundary = boundary_places(laplacian)
        stiffness, pull = laplacian.dirichlet
        # As distances from the centre: where nothing is coupled with a boundary all stays in place.
        force = pull @ np.where(laplacian.near_boundary[:, None], boundary - base, 0.0)
        coupled = connected_components(stiffness, directed=False)[1]
        rows = np.flatnonzero(known & np.isin(coupled, coupled[pull.diagonal() > 0.0]))
        rows = rows[cKDTree(points[rows]).indices]  # neighbors near in memory make the products faster
        base[rows] += solve_symmetric(stiffness[rows][:, rows], force[rows], progress=progress)
    return base


def _centers(laplacian: LaplaceBeltrami, weights: Floats) -> Floats:
    """Return the weighted mean of the points of each component, (components, 3); that of weight zero is not used."""
    known = laplacian.component >= 0
    component, weights = laplacian.component[known], weights[known]
    total = np.bincount(component, weights)
    total[total == 0.0] = 1.0
    sums = [np.bincount(component, weights * column) for column in laplacian.points[known].T]
    return np.column_stack(sums) / total[:, None]


def boundary_places(laplacian: LaplaceBeltrami) -> Floats:
    """Return the nearest position on the boundary of points near one, (n, 3) [L]; elsewhere the points themselves.

    The boundary is straight from each boundary point to its neighbors on the boundary, moved outwards by the distance
    that the operator assumes: of random points, those at the boundary lie a little inside.
    """
    places = laplacian.points.copy()
    near = laplacian.near_boundary & (laplacian.component >= 0)
    boundary = np.flatnonzero(laplacian.boundary & near)
    rows = np.flatnonzero(near)
    if not len(rows):
        return places
    if not len(boundary):
        raise PointCloudError(
            f"{len(rows)} points are next to a boundary that has no points, so that it cannot be fixed. Give the"
            " boundary's points."
        )
    # Components are searched separately, by a fourth coordinate.
    far = 4.0 * np.ptp(laplacian.points, axis=0).max()
    located = np.column_stack([laplacian.points, far * laplacian.component])
    tree = cKDTree(located[boundary])
    _, nearest = tree.query(located[rows])
    count = min(_AROUND + 1, len(boundary))
    length, index = tree.query(located[boundary], k=np.arange(1, count + 1))
    start = laplacian.points[boundary[nearest]]
    along = laplacian.points[boundary[index[nearest]]] - start[:, None]
    along[length[nearest] > laplacian.smoothing_lengths[boundary[nearest], None]] = (
        0.0  # not across to another boundary
    )
    squared = np.einsum("ikc,ikc->ik", along, along)
    offset = laplacian.points[rows] - start
    share = np.einsum("ikc,ic->ik", along, offset) / np.where(squared > 0.0, squared, 1.0)
    foot = np.clip(share, 0.0, 1.0)[:, :, None] * along
    distance = np.linalg.norm(offset[:, None] - foot, axis=2)
    every, best = np.arange(len(rows)), np.argmin(distance, axis=1)
    beyond = np.maximum(laplacian.boundary_distance[rows] - distance[every, best], 0.0)
    places[rows] = start + foot[every, best] + beyond[:, None] * laplacian.boundary_direction[rows]
    return places


class PointBlend:
    """Strength, mask and the size to keep, checked before any work: called with filtered positions, it blends them.

    Parameters
    ----------
    laplacian, strength, mask, keep, dirichlet
        As in `smooth_points`, whose results without these are filtered positions.

    Attributes
    ----------
    mask, weights : ndarray, (n,)
        Weight of each point, zero where it stays, and the same times the strength.

    Raises
    ------
    PointCloudError
        An invalid mask, strength or choice.
    """

    def __init__(
        self,
        laplacian: LaplaceBeltrami,
        *,
        strength: float = 1.0,
        mask: ArrayLike | None = None,
        keep: str | None = None,
        dirichlet: bool = False,
    ) -> None:
        n = len(laplacian.points)
        self.laplacian, self.keep = laplacian, keep
        check_switches(dirichlet=dirichlet)
        if not np.isfinite(real(strength)):
            raise PointCloudError(f"The strength is {strength!r}. Use a finite number, 1 for the full effect.")
        weights = np.ones(n) if mask is None else check_values(mask, n, columns=False)
        if weights.min() < -1e-6 or weights.max() > 1.0 + 1e-6:
            raise InvalidPointsError(
                f"The mask has values from {weights.min():.3g} to {weights.max():.3g}. Give {n} weights from 0 to 1."
            )
        weights = np.clip(weights, 0.0, 1.0)
        weights[laplacian.component < 0] = 0.0
        if dirichlet:
            weights[laplacian.boundary] = 0.0  # also in corners, where the images are not exact
        if not weights.any():
            raise PointCloudError(f"The mask is zero at all {n} points, so that no point would move. Choose some.")
        self.mask, self.weights = weights, real(strength) * weights
        if not (keep is None or isinstance(keep, str)) or keep not in _KEPT:
            raise PointCloudError(f"What to keep is {keep!r}. Choose one of None, 'area', 'volume'.")
        if keep is not None and dirichlet:
            raise PointCloudError("A fixed boundary determines the size: keep neither area nor volume with it.")
        if keep == "volume" and laplacian.boundary.any():
            components = len(np.unique(laplacian.component[laplacian.boundary]))
            raise PointCloudError(
                f"Components that have a boundary and enclose no volume: {components}. Keep the area instead."
            )

    def __call__(self, filtered: Floats) -> Floats:
        """Return the result for filtered positions.

        Parameters
        ----------
        filtered : ndarray, (n, 3)
            Positions by the filter at full strength [L].

        Returns
        -------
        ndarray, (n, 3)
            New positions of ``laplacian.points`` [L].

        Raises
        ------
        SolverError
            No scale restores the size.
        """
        points = self.laplacian.points
        if self.keep is None or not self.weights.any():
            return points + self.weights[:, None] * (filtered - points)
        known = self.laplacian.component >= 0
        component = np.where(known, self.laplacian.component, 0)
        center = _centers(self.laplacian, self.laplacian.areas * self.mask)[component]

        def result(scale: Floats) -> Floats:
            return points + self.weights[:, None] * (center + scale[component][:, None] * (filtered - center) - points)

        measure = SurfaceSize(self.laplacian, self.keep)
        touched = np.bincount(component, self.weights) != 0.0
        return result(match_size(lambda scale: measure(result(scale)), measure.before, touched))
