"""Which side of a surface is outside, by winding numbers: signs of patches within which all normals agree."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores, runs
from ..linalg import eigh
from ..types import Array, Floats, Ints
from .nearest import Nearest, spacing_of
from .normals import NEIGHBORS, outer_signs, propagate_signs

_CERTAIN = 0.9  # cosine of a link that carries a sign without doubt: 26 degrees from a circular arc
_PATCHES = 200  # that a surface is divided into at most
_CLUMPS = 1500  # of points, each a dipole; pairs of them are summed in blocks
_FINE = 32_000  # clumps that stand for the points where they are near, so that close sheets are separated
_NEAR = 3.0  # sizes of a clump
_BLOCK = 1 << 17  # pairs of dipoles taken at one time: of fewer, cores wait for each other
_COUPLED = 0.1  # common energy over the size of the smaller of two groups of patches that have one outside
_SAMPLE = 2000  # points whose spacing gives the median one


def orient_by_winding(nearest: Nearest, normals: Floats, place: Floats, part: Ints) -> Floats:
    """Flip unit normals, (m, 3), so that neighbors agree, and every patch of the surface with all others, outwards.

    Where sheets come close, neighbors tell little: a leg of a figure may get its sign from the other leg that it
    touches. The winding number, of all points, decides; the sides of each component, (m,), are as `outer_signs` has
    them. `place`, (m, 3), is where the points are, components not moved apart.
    """
    normals, _ = orient_patches(nearest, normals, place)
    return normals * outer_signs(place, normals, part)[part, None]


def orient_patches(nearest: Nearest, normals: Floats, place: Floats) -> tuple[Floats, Ints]:
    """Flip normals so that all patches agree, on either side; return them, (m, 3), and the patch of each, (m,) int.

    Within a patch signs are beyond doubt.
    """
    normals, tree = propagate_signs(nearest, normals)
    patch = divide_patches(nearest.points, normals, tree)
    if patch.max() > 0:
        normals = normals * _least(_patch_energies(place, normals, nearest.spacing**2, patch))[patch][:, None]
    return normals, patch


def divide_patches(points: Floats, normals: Floats, tree: sparse.csr_array) -> Ints:
    """Number patches of points, (m,), joined by links of the tree over which the sign is beyond doubt.

    Small patches are joined to their surest neighbor, round by round, until none is left, and larger ones as well
    while there are too many: a wall in a narrow slot of which half the points belong to no patch but that of the other
    wall would get its sign from there.
    """
    count = len(points)
    tree = tree.tocoo()
    first, second = tree.coords
    certainty = _certainty(points, normals, first, second)
    joined = certainty > _CERTAIN
    least = NEIGHBORS
    while True:
        links = sparse.csr_array((joined[joined], (first[joined], second[joined])), shape=(count, count))
        _, patch = connected_components(links, directed=False)
        small = np.bincount(patch) < least
        open_ = np.flatnonzero(~joined & (small[patch[first]] | small[patch[second]]))
        if not len(open_):
            if len(small) <= _PATCHES or small.all():
                return patch
            least *= 2
            continue
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


def winding_signs(points: Floats, normals: Floats, weight: Floats, patch: Ints, part: Ints) -> Floats:
    """Return the sign of each patch by which the winding number changes least off the surface, outside 0.

    Weights, (m,), are areas up to a factor; patches and parts are numbers, (m,), the latter of the connected parts of
    the surface that patches divide.
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
    return _energies(*coarse, count, _near_energies(fine, coarse, clump) if len(coarse[0]) < len(fine[0]) else ())


def _clumps(
    points: Floats, moments: Floats, weight: Floats, patch: Ints, most: int
) -> tuple[tuple[Array, Array, Array, Ints, float], Ints]:
    """Gather dipoles of one patch and place, until there are at most so many.

    Return place, moment, weight and patch of each clump, and the size of a place; and the clump of each dipole, (m,)
    int.
    """
    size, count = _median_spacing(points), len(points)
    if count <= most:
        return (points, moments, weight, patch, size), np.arange(count)
    size *= np.sqrt(count / most)
    while True:
        clump = patch
        for column in np.floor((points - points.min(axis=0)) / size).astype(np.int64).T:
            clump = np.unique(clump * (column.max() + 1) + column, return_inverse=True)[1]
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
    return (place, moment, total, owner, size), clump


def _median_spacing(points: Floats) -> float:
    """Return the spacing around most points."""
    some = points[:: max(1, len(points) // _SAMPLE)]
    return float(np.median(spacing_of(cKDTree(points).query(some, k=min(NEIGHBORS + 1, len(points)))[0])))


def _energies(
    place: Floats, moment: Floats, _: Floats, owner: Ints, width: float, count: int, near: tuple[Array, ...] = ()
) -> Floats:
    """Return the mutual energy of each two patches, (count, count), by dipoles smoothed over a width.

    `near` are the first and the second ones of some pairs, the first ones less, and energies to take for them, (p,).
    """
    energy, place = np.zeros((len(place),) * 2), place - place.mean(axis=0)

    def measure(part: slice) -> None:
        on = slice(part.start, None)  # each pair once
        energy[part, on] = _between(place[part], moment[part], place[on], moment[on], width)
        energy[part, part] *= 0.5

    on_all_cores(measure, blocks(len(place), max(1, _BLOCK // len(place))))
    if near:
        first, second, exact = near
        energy[first, second], energy[second, first] = exact, 0.0
    patches = sparse.csr_array((np.ones(len(owner)), (np.arange(len(owner)), owner)), shape=(len(owner), count))
    half: Floats = patches.T @ energy @ patches
    return half + half.T


def _near_energies(fine: Any, coarse: Any, clump: Any) -> tuple[Array, ...]:
    """Return the pairs of near clumps of different patches, (p,) each, and their energies by what they consist of."""
    first, second = cKDTree(coarse[0]).query_pairs(_NEAR * coarse[4], output_type="ndarray").T
    apart = coarse[3][first] != coarse[3][second]
    order = np.argsort(first[apart], kind="stable")
    first, second = first[apart][order], second[apart][order]
    member, size = np.argsort(clump, kind="stable"), np.bincount(clump)
    place, moment, start = fine[0][member], fine[1][member], np.cumsum(size) - size
    turn = np.cumsum(size[first] * size[second]) // _BLOCK
    cuts = np.flatnonzero(np.diff(first, prepend=-1, append=-1) | np.diff(turn, prepend=-1, append=-1))
    result = np.empty(len(first))

    def measure(part: slice) -> None:
        for low, high in pairwise(cuts[part.start : part.stop + 1]):
            one, near = first[low], second[low:high]
            own, other = slice(start[one], start[one] + size[one]), runs(start[near], size[near])
            middle = coarse[0][one]
            energy = _between(place[own] - middle, moment[own], place[other] - middle, moment[other], fine[4])
            result[low:high] = np.add.reduceat(energy.sum(axis=0), np.cumsum(size[near]) - size[near])

    on_all_cores(measure, blocks(len(cuts) - 1, _CLUMPS))
    return first, second, result


def _between(place: Floats, moment: Floats, others: Floats, moments: Floats, width: float) -> Floats:
    """Return the energy of each two of k dipoles and l others, (k, l), smoothed over a width."""
    along = moment @ others.T
    along -= np.einsum("ij,ij->i", moment, place)[:, None]
    there = place @ -moments.T
    there += np.einsum("ij,ij->i", moments, others)
    along *= there
    square = np.matmul(-2.0 * place, others.T, out=there)
    square += np.einsum("ij,ij->i", place, place)[:, None]
    square += np.einsum("ij,ij->i", others, others) + width**2
    return coupling(moment @ moments.T, along, np.maximum(square, width**2, out=square), width**2)


def coupling(alike: Floats, along: Floats, square: Floats, smoothed: float = 0.0) -> Floats:
    """Return the energy of dipoles by the product of their moments, of those along their distance, and its square.

    The squared width over which they are smoothed, which the square of the distance holds, too, makes layers of dipoles
    thick. What they do to each other within that thickness is left out: two parallel layers have no energy in common,
    however close, as those that are thin.
    """
    near = 1.0 / square
    return (alike - 3.0 * near * (along + smoothed * alike)) * (0.25 / np.pi * near * np.sqrt(near))


def _least(energy: Floats) -> Floats:
    """Return signs, (m,), that no flip of one patch improves: the better of two local optima."""
    mutual = energy - np.diag(np.diag(energy))
    mutual = 0.5 * (mutual + mutual.T)
    scale = np.sqrt(np.maximum(np.abs(np.diag(energy)), np.finfo(float).tiny))
    leading = eigh(mutual / scale / scale[:, None])[1][:, -1]
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
        if total > most * (1.0 + 1e-9):  # the propagated signs come first, and stay where both are equal
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
