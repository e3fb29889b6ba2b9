"""New places for the points: smoothed or sharpened by frequency, faired without eigenvectors, moved by a mode."""

import numpy as np
from scipy.sparse.linalg import LinearOperator
from scipy.spatial import cKDTree

from ..errors import InvalidPointsError, PointCloudError
from ..geometry import check_values
from ..operator import solve_symmetric
from .filters import chebyshev_filter, corrected_operator, fairing, spectral_filter
from .sizes import SurfaceSize, match_size

_KEPT = (None, "area", "volume")
_TOLERANCE = 1e-5  # of the factors: the coordinates are large next to the spacing
_AROUND = 4  # neighbours along the rim that a rim point is joined to


def smooth_points(
    laplacian,
    response,
    spectrum=None,
    strength=1.0,
    mask=None,
    keep=None,
    fixed_rim=False,
    progress=None,
    base=None,
):
    """Filter the shape of the surface by frequency.

    The coordinates are three functions on the points. Each connected part keeps its centre, so that the result moves
    and turns with the points, and parts do not collapse into each other.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    response : int or callable
        A whole number m keeps the first m modes, a low-pass whose cost follows m. A callable maps an array of
        eigenvalues [1 / L^2] to factors, such as `exponential`, `band` and `boost` return; without a spectrum it needs
        no eigenvectors and should be smooth.
    spectrum : Spectrum, optional
        Of this operator, with its fixed_rim. What it does not hold takes the response at its highest eigenvalue, or is
        dropped where the response is a number. Eigenvalues matter for callables alone: for many modes, beyond those
        that are resolved, ``eigenpairs(count, raw=True)`` will do.
    strength : float
        Share of the way from the points to the filtered ones: 1 is all of it, above exaggerates, below 0 sharpens.
    mask : array_like, (n,), optional
        Weight of each point from 0, which stays where it is, to 1, such as those of a vertex group.
    keep : {None, "area", "volume"}
        Scale the filtered shape about the centre of each connected part (of the masked region) so that the result has
        its area, or enclosed volume, before. The volume needs a closed surface and normals that point outwards.
    fixed_rim : bool
        Rim points stay where they are: what is filtered is the distance from the surface that spans the rim like a soap
        film. Otherwise a rim shrinks like all else, as the modes meet it level.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.
    base : ndarray, (n, 3), optional
        From `smoothing_base` with the same fixed_rim, to save its time.

    Returns
    -------
    ndarray, (n, 3)
        New places for ``laplacian.points`` [L]. Points that the operator leaves out stay.

    Raises
    ------
    PointCloudError
        A response, mask, strength or choice that makes no sense, or modes that are constants alone.
    UnresolvedModesError, TooFewPointsError, SolverError
        From the spectrum, where it is computed here, or a scale that is not found.

    References
    ----------
    Vallet, Levy. Spectral geometry processing with manifold harmonics. 2008. Section 4 and Figure 12 of the paper.
    """
    if not callable(response) and (isinstance(response, bool) or not isinstance(response, (int, np.integer))):
        raise PointCloudError(f"The response is {response!r}. Give a whole number of modes, or a function.")
    blend = PointBlend(laplacian, strength, mask, keep, fixed_rim)
    base = smoothing_base(laplacian, fixed_rim, progress) if base is None else base
    rest = laplacian.points - base
    if spectrum is None and callable(response):
        filtered = chebyshev_filter(laplacian, rest, response, fixed_rim, tolerance=_TOLERANCE, progress=progress)
    elif callable(response):
        end = float(np.ravel(response(spectrum.eigenvalues[-1:]))[0])
        filtered = spectral_filter(rest, spectrum, laplacian.areas, response, end)
    else:
        if spectrum is None:
            spectrum = laplacian.eigenpairs(response, raw=True, fixed_rim=fixed_rim, progress=progress)
        parts = laplacian.component.max() + 1
        if not fixed_rim and response <= parts:
            raise PointCloudError(
                f"The first {response} modes move {parts} connected part(s) as a whole and have no shape. Keep"
                f" at least {parts + 3} modes."
            )
        filtered = spectral_filter(rest, spectrum, laplacian.areas, response)
    return blend(base + filtered)


def fair_points(
    laplacian,
    time=None,
    order=3,
    strength=1.0,
    mask=None,
    keep=None,
    fixed_rim=False,
    progress=None,
    base=None,
):
    """Smooth the surface by an implicit step, without eigenvectors: for noise, also on large clouds.

    Solves ``(1 + (time L)^order) x = x0`` with the negated operator L, whose eigenvalues are the symbol-corrected ones.
    With ``order=1`` this is implicit fairing, ``(areas + time K) x = areas x0``, which also shrinks what is wide. The
    third order spares it, at the same effect on noise.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    time : float, optional
        [L^2]. Details of a wavelength below ``2 pi sqrt(time)`` are more than halved. If not given, half the mean
        square of the smoothing lengths, which removes the noise of single points.
    order : int
        1, 2 or 3: the higher, the sharper the line between what stays and what goes.
    strength, mask, keep, fixed_rim, progress, base
        As in `smooth_points`.

    Returns
    -------
    ndarray, (n, 3)
        New places for ``laplacian.points`` [L]. Points that the operator leaves out stay.

    Raises
    ------
    PointCloudError
        A time, order, mask, strength or choice that makes no sense.
    SolverError
        A scale is not found.

    References
    ----------
    Desbrun, Meyer, Schroder, Barr. Implicit fairing of irregular meshes using diffusion and curvature flow. 1999.

    Notes
    -----
    The operator's spectrum is bounded by its wide kernel. A polynomial of it then inverts the equations in fewer
    products than conjugate gradients, whose steps grow with the power ``order / 2`` of the time, not with its root.
    """
    if time is None:
        known = laplacian.component >= 0
        time = 0.5 * np.average(laplacian.smoothing_lengths[known] ** 2, weights=laplacian.areas[known])
    return smooth_points(laplacian, fairing(time, order), None, strength, mask, keep, fixed_rim, progress, base)


def displace_by_mode(laplacian, mode, amplitude=None, phase=0.0):
    """Move the points along their normals by a vibration mode (Figure 9 of the paper).

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals must agree in sign, as those from quadrics do, and others with ``LaplacianOptions(orient=True)``.
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
    """
    points = laplacian.points
    mode = check_values(mode, len(points), columns=False)
    if amplitude is None:
        amplitude = 0.1 * np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    if not (np.isfinite(amplitude) and np.isfinite(phase)):
        raise PointCloudError(f"Amplitude {amplitude!r} and phase {phase!r} must be finite numbers.")
    largest = np.abs(mode).max()
    if largest == 0.0:
        raise PointCloudError(f"The mode is zero at all {len(points)} points, which moves none. Choose another one.")
    return points + (amplitude * np.cos(phase) / largest) * mode[:, None] * laplacian.normals


def smoothing_base(laplacian, fixed_rim=False, progress=None):
    """Return the part of the points' places that filters leave alone.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    fixed_rim : bool
        As in `smooth_points`.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        The centre of each connected part or, with a fixed rim, the harmonic surface that spans it [L].
    """
    points, part = laplacian.points, laplacian.component
    base = points.copy()
    known = part >= 0
    base[known] = _centers(laplacian, laplacian.areas)[part[known]]
    if fixed_rim:
        rim = rim_places(laplacian)
        pull = laplacian.fixed_rim[1]
        order, root, multiply = corrected_operator(laplacian, fixed_rim=True, raw=True)
        # In terms of the distance from the centre: parts without a rim, whose equations are singular, stay there.
        force = (pull @ np.where(laplacian.near_rim[:, None], rim - base, 0.0))[order] * root[:, None]
        operator = LinearOperator((len(order),) * 2, matvec=multiply, dtype=np.float64)
        base[order] += root[:, None] * np.column_stack(
            [solve_symmetric(operator, column, progress=progress) for column in force.T]
        )
    return base


def _centers(laplacian, weights):
    """Return the weighted mean of the points of each connected part, (parts, 3); that of weight zero is not used."""
    known = laplacian.component >= 0
    part, weights = laplacian.component[known], weights[known]
    total = np.bincount(part, weights)
    total[total == 0.0] = 1.0
    sums = [np.bincount(part, weights * column) for column in laplacian.points[known].T]
    return np.column_stack(sums) / total[:, None]


def rim_places(laplacian):
    """Return the place on the rim nearest to every point next to one, (n, 3) [L]; other rows are the points themselves.

    The rim runs straight from each rim point to its neighbours on the rim, moved outwards to where the operator takes
    it to be: of random points, those at the rim lie a little inside.
    """
    places = laplacian.points.copy()
    near = laplacian.near_rim & (laplacian.component >= 0)
    rim = np.flatnonzero(laplacian.boundary & near)
    rows = np.flatnonzero(near)
    if not len(rows):
        return places
    if not len(rim):
        raise PointCloudError(
            f"{len(rows)} points are next to a rim that has no points, so that nothing holds it. Name the rim's points."
        )
    # Parts are searched apart from each other, by a fourth coordinate that divides them.
    far = 4.0 * np.ptp(laplacian.points, axis=0).max()
    located = np.column_stack([laplacian.points, far * laplacian.component])
    tree = cKDTree(located[rim])
    _, nearest = tree.query(located[rows])
    count = min(_AROUND + 1, len(rim))
    length, index = tree.query(located[rim], k=np.arange(1, count + 1))
    start = laplacian.points[rim[nearest]]
    along = laplacian.points[rim[index[nearest]]] - start[:, None]
    along[length[nearest] > laplacian.smoothing_lengths[rim[nearest], None]] = 0.0  # not across to another course
    squared = np.einsum("ikc,ikc->ik", along, along)
    offset = laplacian.points[rows] - start
    share = np.einsum("ikc,ic->ik", along, offset) / np.where(squared > 0.0, squared, 1.0)
    foot = np.clip(share, 0.0, 1.0)[:, :, None] * along
    distance = np.linalg.norm(offset[:, None] - foot, axis=2)
    every, best = np.arange(len(rows)), np.argmin(distance, axis=1)
    beyond = np.maximum(laplacian.rim_distance[rows] - distance[every, best], 0.0)
    places[rows] = start + foot[every, best] + beyond[:, None] * laplacian.rim_direction[rows]
    return places


class PointBlend:
    """Strength, mask and what is kept, checked before any work: called with filtered places, it gives the result.

    Parameters
    ----------
    laplacian, strength, mask, keep, fixed_rim
        As in `smooth_points`, whose results without these are filtered places.

    Raises
    ------
    PointCloudError
        A mask, strength or choice that makes no sense.
    """

    def __init__(self, laplacian, strength=1.0, mask=None, keep=None, fixed_rim=False):
        n = len(laplacian.points)
        self.laplacian, self.keep = laplacian, keep
        if not np.isfinite(strength):
            raise PointCloudError(f"The strength is {strength!r}. Use a finite number, 1 for the full effect.")
        weights = np.ones(n) if mask is None else check_values(mask, n)
        if weights.ndim != 1 or weights.min() < -1e-6 or weights.max() > 1.0 + 1e-6:
            raise InvalidPointsError(
                f"The mask has the shape {weights.shape} and values from {weights.min():.3g} to"
                f" {weights.max():.3g}. Give {n} weights from 0 to 1."
            )
        weights = np.clip(weights, 0.0, 1.0)
        weights[laplacian.component < 0] = 0.0
        if fixed_rim:
            weights[laplacian.boundary] = 0.0  # also in corners, where the images are not exact
        if not weights.any():
            raise PointCloudError(f"The mask is zero at all {n} points, so that none would move. Choose some points.")
        self.mask, self.weights = weights, strength * weights
        if keep not in _KEPT:
            raise PointCloudError(f"What to keep is {keep!r}. Choose one of None, 'area', 'volume'.")
        if keep is not None and fixed_rim:
            raise PointCloudError("A rim that stays fixes the size already: keep neither area nor volume with it.")
        if keep == "volume" and laplacian.boundary.any():
            parts = len(np.unique(laplacian.component[laplacian.boundary]))
            raise PointCloudError(
                f"Connected parts that have a rim and enclose no volume: {parts}. Keep the area instead."
            )

    def __call__(self, filtered):
        """Return the result for filtered places, (n, 3)."""
        points = self.laplacian.points
        if self.keep is None or not self.weights.any():
            return points + self.weights[:, None] * (filtered - points)
        known = self.laplacian.component >= 0
        part = np.where(known, self.laplacian.component, 0)
        center = _centers(self.laplacian, self.laplacian.areas * self.mask)[part]

        def result(scale):
            return points + self.weights[:, None] * (center + scale[part][:, None] * (filtered - center) - points)

        measure = SurfaceSize(self.laplacian, self.keep)
        touched = np.bincount(part, self.weights) != 0.0
        return result(match_size(lambda scale: measure(result(scale)), measure.before, touched))
