"""Which side is outside: signs of normals, by propagation, by where they were seen from, or by winding numbers."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import ConvexHull

from ..arguments import as_array, as_doubles, check_array, check_finite, check_points
from ..errors import InvalidPointsError
from ..options import LaplacianOptions
from ..types import Array, Bools, Floats, Ints
from .cloud import read_surface
from .nearest import Nearest
from .normals import orient_outwards, propagate_signs, unit_normals
from .winding import coupling, divide_patches, winding_signs

METHODS = ("outside", "viewpoint", "winding")
_SPHERE = 30.0  # radius that points are mirrored in to see which are hidden, over that of the cloud


def orient_normals(
    points: ArrayLike,
    normals: ArrayLike,
    *,
    method: str = "winding",
    viewpoint: ArrayLike | None = None,
    areas: ArrayLike | None = None,
) -> Floats:
    """Choose the signs of normals.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals : array_like, (n, 3)
        Of any length and sign.
    method : {"winding", "outside", "viewpoint"}
        'outside' lets neighbors agree and each connected part point away from its middle, or up along z where it is a
        sheet that hardly bulges nor overhangs, such as terrain; 'viewpoint' lets patches look to where they were seen
        from, of one place by the points that are not hidden from it; 'winding' decides patch by patch so that the
        winding number is as close to constant off the surface as it can be, which holds in noise and where parts of
        the surface are missing.
    viewpoint : array_like, (3,) or (n, 3), optional
        For 'viewpoint': one place, or the place of the scanner for each point [L].
    areas : array_like, (n,), optional
        For 'winding' and 'viewpoint': areas of the points [L^2]; from the distances of neighbors where not given.

    Returns
    -------
    ndarray, (n, 3)
        The normals with unit length, each either as given or reversed.

    Raises
    ------
    InvalidPointsError
        Normals, viewpoints or areas that do not fit the points, are not finite, or no area above zero; another method.
    PointCloudError
        The points have no sound neighborhoods; see `build_laplacian`.

    See Also
    --------
    estimate_normals : Normals themselves.
    LaplaceBeltrami.toward : The operator with normals so oriented.

    Notes
    -----
    Links between neighbors over which the sign is beyond doubt join points to patches, within which all normals agree.
    What remains is a sign for each patch. The double layer of all patches, of areas a and normals n, has the energy

    .. math:: E = \\sum_{ij} \\frac{a_i a_j}{4 \\pi} \\left( \\frac{n_i \\cdot n_j}{r^3}
              - \\frac{3 (n_i \\cdot r) (n_j \\cdot r)}{r^5} \\right) ,

    up to its sign the integral of the squared gradient of the generalized winding number off the surface. That is
    zero for a closed surface with one outside, and for any surface grows with every edge at which the normals change
    sides: the signs with the least integral are looked for, from the propagated ones by flipping patches one by one. To
    bound the work the dipoles of at most 1,500 clumps of points stand for the points, of at most 32,000 between clumps
    that are near, and r is smoothed by their size.
    The volume that each part encloses decides which side is outside; of a sheet that hardly bulges nor overhangs, up is
    outside. At last, for 'viewpoint' too, single points, to which noise gave the wrong sign, are flipped as long as
    that lowers the energy among the nearest 40 of each.

    References
    ----------
    Hoppe et al. Surface reconstruction from unorganized points. 1992. Barill et al. Fast winding numbers for soups and
    clouds. 2018. Lin, Shi, Liu. Fast and globally consistent normal orientation based on the winding number normal
    consistency. 2024.

    Examples
    --------
    Normals of the unit sphere with random signs, and the same as seen from a place within:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> given = points * np.random.default_rng(0).choice([-1, 1], (800, 1))
    >>> print(np.abs(mf.orient_normals(points, given) - points).max().round(6))
    0.0
    >>> inner = mf.orient_normals(points, given, method="viewpoint", viewpoint=[0, 0, 0.5])
    >>> print(np.abs(inner + points).max().round(6))
    0.0
    """
    points = check_points(points)
    given_normals = unit_normals(normals, len(points))
    if not isinstance(method, str) or method not in METHODS:
        raise InvalidPointsError(f"Orientation {method!r} is unknown. Choose one of {', '.join(METHODS)}.")
    seen_from = as_array(() if viewpoint is None else viewpoint, "Viewpoints")
    towards = _directions(points, seen_from) if method == "viewpoint" else None
    sample = read_surface(points, LaplacianOptions(), lambda stage, fraction: None)[1].sample
    scaled, nearest = sample.scaled, sample.nearest
    chosen = given_normals[scaled.first]
    if method == "outside":
        oriented = orient_outwards(nearest, chosen)
    else:
        oriented, tree = propagate_signs(nearest, chosen)
        patch = divide_patches(nearest.points, oriented, tree)
        place = sample.places
        weight = nearest.spacing**2
        if areas is not None:
            given = _checked_areas(areas, len(points))[scaled.first]
            weight = given * (weight.sum() / max(given.sum(), np.finfo(float).tiny))
        if towards is not None:
            votes = np.einsum("ij,ij->i", oriented, towards[scaled.first])
            if seen_from.ndim == 1:
                votes = np.where(_seen(points[scaled.first] - seen_from), votes, 0.0)
            sign = _elected(votes, patch, sample.component)
        else:
            sign = winding_signs(place, oriented, weight, patch, sample.component)
        oriented = oriented * sign[patch][:, None]
        oriented *= _settled(_near_energies(place, nearest, oriented, weight))[:, None]
    return toward(given_normals, scaled.scatter(oriented, 0.0))


def toward(normals: Floats, directions: Floats) -> Floats:
    """Return unit normals, (n, 3), reversed where they point against directions, (n, 3); zero ones change nothing."""
    against = np.einsum("ij,ij->i", normals, directions) < 0.0
    return np.where(against[:, None], -normals, normals)


def _directions(points: Floats, given: Array) -> Floats:
    """Return the unit vectors from points to where they were seen from; zero where that is the point itself."""
    advice = f"Give one position of three numbers, or one for each of {len(points)} points."
    check_finite(check_array(given, "Viewpoints", [(3,), points.shape], advice).reshape(-1, 3), "viewpoints", advice)
    directions = as_doubles(given) - points
    directions /= np.maximum(np.abs(directions).max(axis=1, keepdims=True), np.finfo(float).tiny)
    return directions / np.maximum(np.linalg.norm(directions, axis=1)[:, None], np.finfo(float).tiny)


def _checked_areas(areas: ArrayLike, count: int) -> Floats:
    given = as_doubles(check_array(areas, "Areas", [(count,)], f"Give a number for each of {count} points."))
    if not (np.isfinite(given).all() and given.min() >= 0.0 and given.max() > 0.0):
        bad = np.count_nonzero(~(np.isfinite(given) & (given > 0.0)))
        raise InvalidPointsError(f"{bad} of {count} areas are not above zero. Leave the areas out to have them found.")
    return given / given.max()


def _seen(offset: Floats) -> Bools:
    """Return which points are not hidden by others, (m,) bool, by their places as seen from the viewpoint, (m, 3).

    Points mirrored in a large sphere about the viewpoint lie on the convex hull where they are seen (Katz, Tal, Basri
    2007. Direct visibility of point sets).
    """
    distance = np.linalg.norm(offset, axis=1)
    largest = distance.max()
    distance = np.maximum(distance, np.finfo(float).eps * largest)[:, None]
    mirrored = offset / distance * (2.0 * _SPHERE - distance / largest)
    hull = ConvexHull(np.append(mirrored, np.zeros((1, 3)), axis=0), qhull_options="QJ")  # flat clouds have one, too
    seen = np.zeros(len(offset) + 1, dtype=bool)
    seen[hull.vertices] = True
    return seen[:-1]


def _elected(votes: Floats, patch: Ints, component: Ints) -> Floats:
    """Return the sign of each patch for which its points vote, (m,); where none does, those of its component."""
    of_patch = np.empty(patch.max() + 1, dtype=int)
    of_patch[patch] = component
    total = np.bincount(patch, votes)
    return np.where(np.where(total == 0.0, np.bincount(component, votes)[of_patch], total) < 0.0, -1.0, 1.0)


def _near_energies(place: Floats, nearest: Nearest, normals: Floats, weight: Floats) -> sparse.csr_array:
    """Return the mutual energy of each two near points, (m, m) CSR, by dipoles smoothed over their spacing."""
    count, width = nearest.index.shape
    first, second = np.repeat(np.arange(count), width - 1), nearest.index[:, 1:].ravel()
    offset = place[second] - place[first]
    square = np.einsum("ij,ij->i", offset, offset) + nearest.spacing[first] * nearest.spacing[second]
    left, right = normals[first], normals[second]
    alike = np.einsum("ij,ij->i", left, right)
    along = np.einsum("ij,ij->i", left, offset) * np.einsum("ij,ij->i", right, offset)
    energy = weight[first] * weight[second] * coupling(alike, along, square)
    energy = sparse.csr_array((energy, (first, second)), shape=(count, count))
    return (0.5 * (energy + energy.T)).tocsr()


def _settled(energy: sparse.csr_array) -> Floats:
    """Return signs, (m,), from which no flip of one point improves the energy of pairs, (m, m) CSR without empty rows.

    In each round those points flip that gain most among their neighbors, no two of which are neighbors.
    """
    sign = np.ones(energy.shape[0])
    least = 1e-9 * (abs(energy) @ sign)  # a smaller gain may be rounding error
    while True:
        gain = -sign * (energy @ sign)
        gaining = gain > least
        if not gaining.any():
            return sign
        rank = np.zeros(len(gain), dtype=int)
        order = np.flatnonzero(gaining)[np.argsort(gain[gaining], kind="stable")]
        rank[order] = np.arange(1, len(order) + 1)
        rival = np.maximum.reduceat(rank[energy.indices], energy.indptr[:-1])
        sign[rank > rival] *= -1.0
