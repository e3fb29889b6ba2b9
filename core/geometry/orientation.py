"""Which side is outside: signs of normals, by propagation, by where they were seen from, or by winding numbers."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from ..arguments import as_array, as_doubles, check_array, check_finite
from ..errors import InvalidPointsError
from ..options import LaplacianOptions
from ..types import Array, Bools, Floats, Ints
from .cloud import read_surface
from .nearest import Nearest, find_nearest
from .normals import NEIGHBORS, orient_outwards, outer_signs, propagate_signs, unit_normals
from .points import check_points

METHODS = ("outside", "viewpoint", "winding")
_CERTAIN = 0.9  # cosine of a link that carries a sign without doubt: 26 degrees from a circular arc
_PATCHES = 200  # that a surface is divided into at most
_CLUMPS = 4000  # of points, each a dipole; pairs of them are summed in blocks
_FINE = 32_000  # clumps that stand for the points where they are near, so that close sheets are separated
_NEAR = 3.0  # sizes of a clump
_BLOCK = 250
_PAIRS = 1_000_000  # of fine clumps that are summed at once
_SPHERE = 30.0  # radius that points are mirrored in to see which are hidden, over that of the cloud
_COUPLED = 0.1  # common energy over the size of the smaller of two groups of patches that have one outside


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
        'outside' lets neighbours agree and each connected part point away from its middle, or up along z where it is a
        sheet that hardly bulges nor overhangs, such as terrain; 'viewpoint' lets patches look to where they were seen
        from, of one place by the points that are not hidden from it; 'winding' decides patch by patch so that the
        winding number is as close to constant off the surface as it can be, which holds in noise and where parts of
        the surface are missing.
    viewpoint : array_like, (3,) or (n, 3), optional
        For 'viewpoint': one place, or the place of the scanner for each point [L].
    areas : array_like, (n,), optional
        For 'winding' and 'viewpoint': areas of the points [L^2]; from the distances of neighbours where not given.

    Returns
    -------
    ndarray, (n, 3)
        The normals with unit length, each either as given or reversed.

    Raises
    ------
    InvalidPointsError
        Normals, viewpoints or areas that do not fit the points, are not finite, or no area above zero; another method.
    PointCloudError
        The points have no sound neighbourhoods; see `build_laplacian`.

    See Also
    --------
    estimate_normals : Normals themselves.
    LaplaceBeltrami.toward : The operator with normals so oriented.

    Notes
    -----
    Links between neighbours over which the sign is beyond doubt join points to patches, within which all normals agree.
    What remains is a sign for each patch. The double layer of all patches, of areas a and normals n, has the energy

    .. math:: E = \\sum_{ij} \\frac{a_i a_j}{4 \\pi} \\left( \\frac{n_i \\cdot n_j}{r^3}
              - \\frac{3 (n_i \\cdot r) (n_j \\cdot r)}{r^5} \\right) ,

    up to its sign the integral of the squared gradient of the generalized winding number off the surface. That is
    zero for a closed surface with one outside, and for any surface grows with every edge at which the normals change
    sides: the signs with the least integral are looked for, from the propagated ones by flipping patches one by one. To
    bound the work the dipoles of at most 4,000 clumps of points stand for the points, of at most 32,000 between clumps
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
    >>> import core
    >>> points = core.example_sphere()
    >>> given = points * np.random.default_rng(0).choice([-1, 1], (800, 1))
    >>> print(np.abs(core.orient_normals(points, given) - points).max().round(6))
    0.0
    >>> inner = core.orient_normals(points, given, method="viewpoint", viewpoint=[0, 0, 0.5])
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
        patch = _patches(nearest.points, oriented, tree)
        place = scaled.points + sample.moved  # where components stand as they do
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
            sign = _winding_signs(place, oriented, weight, patch, sample.component)
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


def _patches(points: Floats, normals: Floats, tree: sparse.csr_array) -> Ints:
    """Number patches of points, (m,), joined by links of the tree over which the sign is beyond doubt.

    Small patches are joined to their surest neighbour, round by round, until none is left.
    """
    count = len(points)
    tree = tree.tocoo()
    first, second = tree.coords
    certainty = _certainty(points, normals, first, second)
    joined = certainty > _CERTAIN
    least = max(NEIGHBORS, count // _PATCHES)
    while True:
        links = sparse.csr_array((joined[joined], (first[joined], second[joined])), shape=(count, count))
        _, patch = connected_components(links, directed=False)
        small = np.bincount(patch) < least
        open_ = np.flatnonzero(~joined & (small[patch[first]] | small[patch[second]]))
        if not len(open_):
            return patch
        surest = open_[np.argsort(certainty[open_], kind="stable")]
        best = np.full(len(small), -1)
        best[patch[first[surest]]] = surest  # the last assignment, of the surest, stays
        other = np.full(len(small), -1)
        other[patch[second[surest]]] = surest
        for links in best[small], other[small]:
            joined[links[links >= 0]] = True


def _certainty(points: Floats, normals: Floats, first: Ints, second: Ints) -> Floats:
    """Return how surely two points lie on one smooth sheet: the cosine of normals, less the chord's slope over both."""
    chord = points[second] - points[first]
    chord /= np.linalg.norm(chord, axis=1)[:, None]
    left, right = normals[first], normals[second]
    slope = np.maximum(np.abs(np.einsum("ij,ij->i", chord, left)), np.abs(np.einsum("ij,ij->i", chord, right)))
    return np.abs(np.einsum("ij,ij->i", left, right)) - 2.0 * slope**2


def _winding_signs(points: Floats, normals: Floats, weight: Floats, patch: Ints, part: Ints) -> Floats:
    """Return the sign of each patch by which the winding number changes least off the surface, outside 0.

    Parameters
    ----------
    points, normals : ndarray, (m, 3)
    weight : ndarray, (m,)
        Areas, up to a factor.
    patch, part : ndarray, (m,) int
        Numbers of patches, and of the connected parts of the surface that they divide.
    """
    count = part.max() + 1
    energy = _patch_energies(points, normals, weight, patch)
    sign = _least(energy)
    owner = np.empty(len(sign), dtype=int)
    owner[patch] = part
    signed = sparse.csr_array((sign, (np.arange(len(sign)), owner)), shape=(len(sign), count))
    area = np.bincount(part, weight, count) + np.finfo(float).tiny
    group = _grouped(signed.T @ energy @ signed, area)[part]
    outside = outer_signs(points, sign[patch][:, None] * normals, group, weight)
    group_of_patch = np.empty(len(sign), dtype=int)
    group_of_patch[patch] = group
    return sign * outside[group_of_patch]


def _patch_energies(points: Floats, normals: Floats, weight: Floats, patch: Ints) -> Floats:
    """Return the mutual energy of each two patches: of clumps of points, and of finer ones where those are near."""
    count = patch.max() + 1
    fine, _ = _clumps(points, weight[:, None] * normals, weight, patch, _FINE)
    coarse, clump = _clumps(*fine[:4], _CLUMPS)
    energy = _energies(*coarse, count)
    return energy if len(coarse[0]) == len(fine[0]) else energy + _corrections(fine, coarse, clump, count)


def _clumps(
    points: Floats, moments: Floats, weight: Floats, patch: Ints, most: int
) -> tuple[tuple[Array, Array, Array, Ints, float], Ints]:
    """Gather dipoles of one patch and place, until there are at most so many.

    Returns
    -------
    tuple
        Place, moment, weight and patch of each clump, and the size of a place.
    ndarray, (m,) int
        The clump of each given dipole.
    """
    size = 0.0 if len(points) <= most else np.sqrt(len(points) / most) * np.median(spacing_to_next(points))
    while True:
        if not size:
            clump, count = np.arange(len(points)), len(points)
        else:
            cell = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
            _, clump = np.unique(np.column_stack([patch, cell]), axis=0, return_inverse=True)
            clump = clump.reshape(-1)
            count = clump.max() + 1
        if count <= most:
            break
        size *= 1.2
    total = np.bincount(clump, weight, count)
    share = np.where(total[clump] > 0.0, weight, 1.0)
    share = share / np.bincount(clump, share, count)[clump]
    place = np.column_stack([np.bincount(clump, share * points[:, axis], count) for axis in range(3)])
    moment = np.column_stack([np.bincount(clump, moments[:, axis], count) for axis in range(3)])
    owner = np.empty(count, dtype=int)
    owner[clump] = patch
    return (place, moment, total, owner, max(size, float(np.median(spacing_to_next(points))))), clump


def spacing_to_next(points: Floats) -> Floats:
    """Return the spacing around each point."""
    return find_nearest(points).spacing


def _energies(place: Floats, moment: Floats, _: Floats, owner: Ints, width: float, count: int) -> Floats:
    """Return the mutual energy of each two patches, (count, count), by dipoles smoothed over a width."""
    result = np.zeros((count, count))
    patches = sparse.csr_array((np.ones(len(owner)), (np.arange(len(owner)), owner)), shape=(len(owner), count))
    for start in range(0, len(place), _BLOCK):
        block = slice(start, start + _BLOCK)
        offset = place[None, :, :] - place[block, None, :]
        square = np.einsum("ijk,ijk->ij", offset, offset) + width**2
        here = np.einsum("ik,ijk->ij", moment[block], offset)
        there = np.einsum("jk,ijk->ij", moment, offset)
        result += patches[block].T @ (_coupling(moment[block] @ moment.T, here * there, square) @ patches)
    return result


def _corrections(fine: Any, coarse: Any, clump: Any, count: Any) -> Any:
    """Return by how much the energy of each two patches is more, (count, count), where near clumps are taken finely.

    Within a clump there is one patch, whose energy with itself does not matter.
    """
    first, second = cKDTree(coarse[0]).query_pairs(_NEAR * coarse[4], output_type="ndarray").T
    apart = coarse[3][first] != coarse[3][second]
    first, second = first[apart], second[apart]
    member, size = np.argsort(clump, kind="stable"), np.bincount(clump)
    start = np.cumsum(size) - size
    ends = np.cumsum(size[first] * size[second])
    result = np.zeros((count, count))
    for rows in np.split(np.arange(len(first)), np.searchsorted(ends, np.arange(_PAIRS, ends[-1:].sum(), _PAIRS))):
        one, other = first[rows], second[rows]
        times = size[one] * size[other]
        row = np.repeat(np.arange(len(rows)), times)
        place = np.arange(len(row)) - np.repeat(np.cumsum(times) - times, times)
        left = member[start[one][row] + place // size[other][row]]
        right = member[start[other][row] + place % size[other][row]]
        more = np.bincount(row, _pair_energies(fine, left, right), len(rows)) - _pair_energies(coarse, one, other)
        np.add.at(result, (coarse[3][one], coarse[3][other]), more)
    return result + result.T


def _pair_energies(dipoles: Any, first: Any, second: Any) -> Any:
    """Return the energy of pairs of dipoles."""
    place, moment, _, _, width = dipoles
    offset = place[second] - place[first]
    left, right = moment[first], moment[second]
    along = np.einsum("ij,ij->i", left, offset) * np.einsum("ij,ij->i", right, offset)
    return _coupling(np.einsum("ij,ij->i", left, right), along, np.einsum("ij,ij->i", offset, offset) + width**2)


def _coupling(alike: Floats, along: Floats, square: Floats) -> Floats:
    """Return the energy of dipoles by the product of their moments, of those along their distance, and its square."""
    return (alike - 3.0 * along / square) / (4.0 * np.pi * square**1.5)


def _near_energies(place: Floats, nearest: Nearest, normals: Floats, weight: Floats) -> sparse.csr_array:
    """Return the mutual energy of each two near points, (m, m) CSR, by dipoles smoothed over their spacing."""
    count, width = nearest.index.shape
    first, second = np.repeat(np.arange(count), width - 1), nearest.index[:, 1:].ravel()
    offset = place[second] - place[first]
    square = np.einsum("ij,ij->i", offset, offset) + nearest.spacing[first] * nearest.spacing[second]
    left, right = normals[first], normals[second]
    alike = np.einsum("ij,ij->i", left, right)
    along = np.einsum("ij,ij->i", left, offset) * np.einsum("ij,ij->i", right, offset)
    energy = weight[first] * weight[second] * _coupling(alike, along, square)
    energy = sparse.csr_array((energy, (first, second)), shape=(count, count))
    return (0.5 * (energy + energy.T)).tocsr()


def _settled(energy: sparse.csr_array) -> Floats:
    """Return signs, (m,), from which no flip of one point improves the energy of pairs, (m, m) CSR without empty rows.

    In each round those points flip that gain most among their neighbours, no two of which are neighbours.
    """
    sign = np.ones(energy.shape[0])
    least = 1e-9 * (abs(energy) @ sign)  # below it a gain may be one of rounding
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


def _least(energy: Floats) -> Floats:
    """Return signs, (m,), that no flip of one patch improves, the best of two beginnings."""
    mutual = energy - np.diag(np.diag(energy))
    mutual = 0.5 * (mutual + mutual.T)
    scale = np.sqrt(np.maximum(np.abs(np.diag(energy)), np.finfo(float).tiny))
    leading = np.linalg.eigh(mutual / scale / scale[:, None])[1][:, -1]
    best, most = np.ones(len(mutual)), -np.inf
    for sign in np.ones(len(mutual)), np.where(leading < 0.0, -1.0, 1.0):
        field = mutual @ sign
        for _ in range(20 * len(sign)):
            worst = np.argmin(sign * field)
            if sign[worst] * field[worst] >= 0.0:
                break
            sign[worst] = -sign[worst]
            field += 2.0 * sign[worst] * mutual[worst]
        total = float(sign @ field)
        if total > most * (1.0 + 1e-9):  # the propagated signs, where both are alike
            best, most = sign, total
    return best


def _grouped(energy: Floats, area: Floats) -> Ints:
    """Number groups of parts of the surface that have one outside, (m,).

    Parts, and then groups of them, are joined one by one as long as the energy that two have in common, which is a
    length, is some share of the smaller one's size. Closed surfaces have none in common with others.
    """
    energy, area, group = energy.copy(), area.copy(), np.arange(len(area))
    np.fill_diagonal(energy, -np.inf)
    while True:
        share = energy / np.sqrt(np.minimum(area[:, None], area))
        into, gone = np.unravel_index(np.argmax(share), share.shape)
        if not share[into, gone] > _COUPLED:
            return np.unique(group, return_inverse=True)[1]
        group[group == gone] = into
        area[into] += area[gone]
        for rows in (energy, energy.T):
            rows[into] += rows[gone]
        energy[gone] = energy[:, gone] = -np.inf
