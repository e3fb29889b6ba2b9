"""Keep close sheets of a surface apart: which points lie on the same sheet, by normals and by paths along it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..algebra import blocks, eliminate, on_all_cores
from ..kernel import SUPPORT
from ..types import Bools, Floats, Ints
from .components import label_connected, number_by_size
from .distances import heights_of_ends, pair_heights
from .nearest import COUNT, ENOUGH, FEW, NEXT, ON, SMOOTH, WIDER, Nearest
from .pairs import Pairs
from .patches import Patch
from .quadrics import Quadrics, along, chords, eighths, fit_quadrics, in_plane

_LEANING = 0.1  # error of the normals: heights may be off by this share of the distance
_SEEDS = 9  # nearest neighbors, every two of which span a candidate plane with the point
_BLOCK = 1 << 11  # points worked on at one time: of fewer, cores wait for each other
_AROUND = 1.6  # path along a sheet over the chord, at most: 1.41 across a right angle, in steps that zigzag by an
# eighth; points that many spacings apart touch
_NEARBY, _SOURCES = 1 << 8, 1 << 5  # points that share a neighborhood; of them, from which paths are followed at once


def same_sheet(
    left: Floats, right: Floats, dot: Floats, distance: Floats, spacing: Floats, close: float = 2.0
) -> Bools:
    """Tell which pairs lie on one sheet: their chord is orthogonal to their mean normal, within what may be off.

    Parameters
    ----------
    left, right : ndarray
        Height of the second point above the tangent plane of the first, and above its own plane as seen from the first.
    dot : ndarray
        Cosine of the two normals; its sign flips the second one.
    distance, spacing : ndarray
        Of the pair.
    close : float
        How far apart the sheets may be that are taken as one, in units of what a point on a surface may be off.

    Returns
    -------
    ndarray of bool
    """
    return np.abs(left + np.where(dot < 0.0, -right, right)) <= 2.0 * (close * ON * spacing + _LEANING * distance)


def on_sheet(
    nearest: Nearest, normals: Floats, rows: Ints, other: Ints, distance: Floats, close: float = 2.0
) -> tuple[Bools, Floats]:
    """Tell which of other points, (k, views) int, lie on the sheet of some points, (k,) int.

    Return also the cosines of the angles between their unit normals, (m, 3). Distances are (k, views); for `close` see
    `same_sheet`.
    """
    cosine, left, right = heights_of_ends(chords(nearest.points, rows, other), normals, rows, other)
    return same_sheet(left, right, cosine, distance, nearest.spacing[rows, None], close), cosine


class Sheets(NamedTuple):
    """What is known of the sheet around every point, made by `fit_sheets`."""

    quadrics: Quadrics  # of the m points, through neighbors on their own sheets
    nearest: Nearest  # with the neighbors on other sheets at weight zero
    mixed: Quadrics  # through all neighbors
    planes: Floats  # (m, 3), unit normals by which neighbors on other sheets were found

    def take(self, rows: Ints, nearest: Nearest) -> Sheets:
        """Return those of some rows, (k,) int, by the neighbors of these points."""
        kept = replace(nearest, weight=self.nearest.weight[rows])
        return Sheets(self.quadrics.take(rows), kept, self.mixed.take(rows), self.planes[rows])


def fit_sheets(nearest: Nearest, before: Sheets | None = None, changed: Bools | None = None) -> Sheets:
    """Fit a quadric around every point to the neighbors of its own sheet.

    Where the quadric of all neighbors misses them, a plane is looked for among those through the point and two of its
    nearest neighbors that has most neighbors near it, and moved to fit these best. With these normals neighbors on
    other sheets are separated from those on the point's own, and left out of its quadric. The sheets `before` some
    points moved are kept but at points in `changed`, (m,) bool, which moved, or have neighbors that did or that are
    others than before.
    """
    points, index, whole = nearest.points, nearest.index, nearest.weight
    if before is None or changed is None:
        changed = np.ones(len(points), dtype=bool)
    mixed = nearest.quadrics
    spacing = nearest.spacing
    missed = mixed.misfit > ON * spacing
    planes = mixed.normals.copy()
    if before is not None:
        planes[missed] = before.planes[missed]
    looked = np.flatnonzero(missed & changed)

    def find(part: slice) -> None:
        block = looked[part]
        chord = chords(points, block, index[block]) / (ON * spacing[block, None])
        planes[block] = _own_plane(chord, whole[block], planes[block])

    on_all_cores(find, blocks(len(looked), _BLOCK))
    changed = changed | changed[index].any(axis=1)
    asked = np.flatnonzero(changed & (missed | missed[index].any(axis=1)))
    kept = np.ones(index.shape, dtype=bool)

    def judge(part: slice) -> None:
        block = asked[part]
        kept[block] = on_sheet(nearest, planes, block, index[block], nearest.distance[block])[0]

    on_all_cores(judge, blocks(len(asked), _BLOCK))
    nearest, quadrics = nearest.keep(kept), mixed
    again = changed & (nearest.weight != whole).any(axis=1)
    if before is not None:
        nearest = replace(nearest, weight=np.where(changed[:, None], nearest.weight, before.nearest.weight))
        rows = np.flatnonzero(changed)
        quadrics = before.quadrics.put(rows, mixed.take(rows))
    again = np.flatnonzero(again)
    if len(again):
        fitted = fit_quadrics(points, index[again], nearest.weight[again], again, planes[again])
        quadrics = quadrics.put(again, fitted)
    return Sheets(quadrics, nearest, mixed, planes)


def _own_plane(chord: Floats, weight: Floats, planes: Floats) -> Floats:
    """Return unit normals of the planes that have most neighbors near them, (k, 3).

    Chords to the neighbors, (3, k, views), are in units of what a point on a surface may be off. Where the nearest ones
    span no plane, as in a row, that of some normals, (k, 3), is where the search starts.
    """
    nearby = chord[:, :, 1 : COUNT // 2 + 1]
    first, second = np.triu_indices(min(_SEEDS, nearby.shape[2]), 1)
    normal = np.cross(nearby[:, :, first], nearby[:, :, second], axis=0)
    length, side = np.linalg.norm(normal, axis=0), np.linalg.norm(nearby[:, :, :_SEEDS], axis=0)
    narrow = length < 0.25 * side[:, first] * side[:, second]
    normal /= np.where(length > 0.0, length, 1.0)
    height = normal.transpose(1, 2, 0) @ nearby.transpose(1, 0, 2)
    height *= height
    cost = np.minimum(height, 1.0, out=height).sum(axis=2) + np.where(narrow, chord.shape[2], 0.0)
    rows, best = np.arange(len(weight)), cost.argmin(axis=1)
    axis = np.where(narrow[rows, best], planes.T, normal[:, rows, best])
    equations = np.empty((3, 4, len(weight)))
    for _ in range(4):
        near = weight / (1.0 + along(chord, axis) ** 2) ** 2
        equations[:, :3] = np.einsum("aik,bik->abi", near * chord, chord)
        equations[:, 3] = axis
        # A step of inverse iteration towards the direction of the least variance, which the next one goes on from.
        equations[range(3), range(3)] += 1e-6 * equations[range(3), range(3)].sum(axis=0)
        axis = eliminate(equations)[:, 3]
        axis /= np.linalg.norm(axis, axis=0)
    return axis.T


def label_sheets(nearest: Nearest, normals: Floats, component: Ints) -> Ints:
    """Divide components, (m,) int, into sheets that are close to each other but nowhere meet; return their numbers.

    None of the components, which gaps divide, is negative. The largest is 0; points off the surface are -1. Unit
    normals, (m, 3), may have any sign.
    """
    sheet = number_by_size(label_connected(nearest.index, sheet_neighbors(nearest, normals, False)), COUNT)
    return number_sheets(join_touching(nearest, sheet), component)


def join_touching(nearest: Nearest, sheet: Ints) -> Ints:
    """Return the sheets of points, (m,), those on small ones, -1 before, with the sheet that they touch."""
    # Few points, such as sharp tips, are joined to the sheet that they touch; what touches none lies off the surface.
    lost = np.flatnonzero(sheet < 0)
    while len(lost):
        index = nearest.index[lost]
        touching = nearest.distance[lost] <= _AROUND * nearest.spacing[index]
        sheet[lost] = np.where(touching, sheet[index], -1).max(axis=1)
        left = lost[sheet[lost] < 0]
        if len(left) == len(lost):
            break
        lost = left
    return sheet


def number_sheets(sheet: Ints, component: Ints) -> Ints:
    """Number sheets within components, the largest 0; points on no sheet are -1."""
    result = np.full(len(sheet), -1)
    known = sheet >= 0
    result[known] = number_by_size(sheet[known] + (sheet.max() + 1) * component[known], smallest=0)
    return result


def sheet_neighbors(nearest: Nearest, normals: Floats, oriented: bool) -> Bools:
    """Tell which neighbors of every point are the nearest ones on its sheet in one of eight directions, (m, 41) bool.

    Unlike a number of nearest neighbors, they lie all around a point where points crowd along lines, too.
    """
    result = np.zeros(nearest.index.shape, dtype=bool)

    def find(part: slice) -> None:
        block = np.arange(part.start, part.stop)
        index = nearest.index[block]
        x, y = in_plane(chords(nearest.points, block, index), normals[block])
        # Counted from the nearest neighbor, so that they turn with the points: it lies in the middle of an eighth.
        nearest_one = x[:, 1] + 1j * y[:, 1]
        turn = np.where(nearest_one == 0.0, 1.0, nearest_one) * np.exp(-1j * np.pi / NEXT)
        cosine, sine = turn.real[:, None], turn.imag[:, None]
        eighth = eighths(cosine * x + sine * y, cosine * y - sine * x)
        same, cosine = on_sheet(nearest, normals, block, index, nearest.distance[block], close=1.0)
        # Across an edge only points that touch are next to each other, others may be so across a gap.
        same &= ((cosine if oriented else np.abs(cosine)) > SMOOTH) | (
            nearest.distance[block] < _AROUND * nearest.spacing[block, None]
        )
        eighth[~same] = NEXT
        every, first = np.arange(len(block)), np.zeros((len(block), NEXT + 1), dtype=np.intp)
        for place in reversed(range(1, index.shape[1])):
            first[every, eighth[:, place]] = place  # the last assignment, of the nearest, stays
        result[block[:, None], first[:, :NEXT]] = True
        result[block, 0] = False  # the point itself

    on_all_cores(find, blocks(len(result), _BLOCK))
    return result


def separate_sheets(
    pairs: Pairs,
    nearest: Nearest,
    oriented: Floats,
    sides: Floats,
    settle: Callable[[Callable[[], Ints]], Ints] = lambda find: find(),
) -> Pairs:
    """Leave out the pairs whose ends lie on different sheets, which face each other across a gap.

    Normals decide it for most pairs. Where they leave a doubt, two points lie on one sheet if a path of short steps
    joins them along it that is not much longer than their distance, nor, where it leads around an edge, than the kernel
    reaches. At the rim of the support, beyond the next narrower kernel, a pair weighs next to nothing: next to points
    that pairs nearer by are left out of, it is left out, too, unless fewer than two dozen others are left. A point that
    would keep fewer than a dozen, such as one that lies off all sheets, keeps all of them, as in `Nearest.keep`: so few
    would hardly couple it.

    Parameters
    ----------
    pairs : Pairs
        Of m points.
    nearest : Nearest
        Of the m points.
    oriented : ndarray, (m, 3)
        Unit normals whose signs agree.
    sides : ndarray, (m, 3)
        Those of the smooth side that each point lies on, between edges, by which the steps go: next to an edge or in
        the mouth of a narrow slot the others are a mean of both sides, which leads across. For whole pairs that mean is
        right: by the normals of sides all pairs over edges would be in doubt, where steps are long detours.
    settle : callable
        See `step_lengths`.

    Returns
    -------
    Pairs
        The same ones where all lie on one sheet.
    """
    doubtful = ~_plainly_on_one_sheet(pairs, oriented, nearest.spacing)
    if not doubtful.any():
        return pairs
    steps = step_lengths(nearest, sides, settle)
    reach = SUPPORT * pairs.mean(pairs.lengths)

    def apart(some: Ints) -> Bools:
        first, second = pairs.first[some], pairs.second[some]
        # Between points that face away from each other an arc would span more than a right angle. What joins them is a
        # path around an edge: longer than the kernel reaches, but for its zigzag, it joins nothing.
        away = np.einsum("pc,pc->p", oriented[first], oriented[second]) < 0.0
        longest = _AROUND * np.minimum(pairs.distance[some], np.where(away, np.sqrt(0.5) * reach[some], np.inf))
        return ways_along(steps, nearest.tree, first, second, longest) > longest

    def count(some: Bools | Ints) -> Ints:
        return np.bincount(np.append(pairs.first[some], pairs.second[some]), minlength=len(sides))

    def at_either(points: Bools) -> Bools:
        return points[pairs.first] | points[pairs.second]

    kept, rim = ~doubtful, WIDER * pairs.distance > reach
    inside = np.flatnonzero(doubtful & ~rim)
    kept[inside] = ~apart(inside)
    parted = count(inside[~kept[inside]]) > 0
    needed = np.flatnonzero(doubtful & rim & (at_either(count(kept) < ENOUGH) | ~at_either(parted)))
    kept[needed] = ~apart(needed)
    kept |= at_either(count(kept) < FEW)
    return pairs if kept.all() else pairs.keep(kept)


def _plainly_on_one_sheet(pairs: Pairs, oriented: Floats, spacing: Floats) -> Bools:
    """Tell of which pairs the normals say that they lie on one sheet, (p,) bool."""
    result = np.empty(len(pairs.first), dtype=bool)
    points, normals = pairs.points.T.copy(), oriented.T.copy()

    def judge(patch: Patch) -> None:
        _, left, right, cosine = pair_heights(patch.first, patch.second, points, normals)
        same = same_sheet(left, right, cosine, pairs.distance[patch.pairs], patch.mean(spacing))
        result[patch.pairs] = same & (cosine > SMOOTH)

    on_all_cores(judge, pairs.patches)
    return result


def step_lengths(
    nearest: Nearest, oriented: Floats, settle: Callable[[Callable[[], Ints]], Ints] = lambda find: find()
) -> sparse.csr_array:
    """Return the lengths of the steps along sheets between adjacent points, symmetric, (m, m).

    Sharp folds, whose normals join them to nothing, are joined to what is nearest to them: there are no more parts than
    the neighborhoods themselves hang together in. Signs of the unit normals, (m, 3), agree. `settle` takes
    `find_bridges` without arguments, and returns what it finds, or others that are agreed on.
    """
    next_to = sheet_neighbors(nearest, oriented, True)
    count = len(next_to)
    first = np.repeat(np.arange(count, dtype=np.int32), np.count_nonzero(next_to, axis=1))
    second, length = nearest.index[next_to], nearest.distance[next_to]
    steps = sparse.csr_array((length, (first, second)), shape=(count, count))
    row, other = settle(lambda: find_bridges(nearest, connected_components(steps, directed=False)[1])).T
    if len(row):
        column = (nearest.index[row] == other[:, None]).argmax(axis=1)
        ends = np.append(first, row).astype(np.int32), np.append(second, other)
        steps = sparse.csr_array((np.append(length, nearest.distance[row, column]), ends), shape=(count, count))
    return steps.maximum(steps.T).tocsr()


def find_bridges(nearest: Nearest, label: Ints) -> Ints:
    """Return the shortest edges between neighbors that join points of different labels, (m,): (k, 2) int."""
    row, column = np.nonzero(label[nearest.index] != label[:, None])
    other, gap = nearest.index[row, column], nearest.distance[row, column]
    return np.column_stack([row, other])[choose_bridges(label[row], label[other], gap)]


def choose_bridges(left: Ints, right: Ints, gap: Floats) -> Ints:
    """Return which edges join all labels with the least gaps, (k,) int, by the labels of their ends."""
    if not len(gap):
        return np.zeros(0, dtype=np.int64)
    low, high = np.sort([left, right], axis=0)
    order = np.lexsort((gap, high, low))
    shortest = order[np.append(True, np.diff(low[order]) | np.diff(high[order]) != 0)]
    low, high, gap = (values[shortest] for values in (low, high, gap))
    shape = (high.max() + 1,) * 2
    bridge = minimum_spanning_tree(sparse.csr_array((gap, (low, high)), shape=shape)).tocoo()
    chosen = np.isin(low.astype(np.int64) * shape[0] + high, bridge.row.astype(np.int64) * shape[0] + bridge.col)
    chosen_edges: Ints = shortest[chosen]
    return chosen_edges


def ways_along(steps: sparse.csr_array, tree: cKDTree, first: Ints, second: Ints, longest: Floats) -> Floats:
    """Return the length of the shortest path along steps between the ends of pairs, (k,); infinite if it is longer.

    `steps`, (m, m), are their lengths, symmetric; `longest`, (k,), is the greatest length of the path.
    """
    if not len(first):
        return np.zeros(0)
    # Search from the end that has more pairs: one search serves all pairs of its start.
    often = np.bincount(first, minlength=tree.n) + np.bincount(second, minlength=tree.n)
    swap = often[second] > often[first]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    furthest = np.zeros(tree.n)
    np.maximum.at(furthest, first, longest)
    # Starts near each other share a subgraph; among them, those with paths of similar length are searched at once.
    start = np.flatnonzero(furthest)
    groups = [start[some] for some in _near_each_other(tree.data[start], _NEARBY)]
    groups = [some[np.argsort(furthest[some], kind="stable")] for some in groups]
    start = np.concatenate(groups)
    number = np.empty(tree.n, dtype=np.int64)
    number[start] = np.arange(len(start))
    order = np.argsort(number[first], kind="stable")
    ends = np.searchsorted(number[first[order]], np.arange(len(start) + 1))
    result = np.empty(len(first))
    for some in groups:
        places = tree.data[some]
        low, high = places.min(axis=0), places.max(axis=0)
        reach = 0.5 * np.linalg.norm(high - low) + furthest[some[-1]]
        around = np.array(tree.query_ball_point(0.5 * (low + high), reach, return_sorted=True))
        local = steps[around][:, around]
        for part in blocks(len(some), _SOURCES):
            source = some[part]
            begin = number[source[0]]
            rows = order[ends[begin] : ends[begin + len(source)]]
            limit = 1.001 * furthest[source[-1]]
            length = dijkstra(local, indices=np.searchsorted(around, source), limit=limit)
            result[rows] = length[number[first[rows]] - begin, np.searchsorted(around, second[rows])]
    return result


def _near_each_other(points: Floats, most: int) -> Iterator[Ints]:
    """Yield which of some points, (k, 3), lie near each other, at most so many: the leaves of a tree."""
    nodes = [cKDTree(points, leafsize=most).tree]
    while nodes:
        node = nodes.pop()
        if node.lesser is None:
            yield node.indices
        else:
            nodes += [node.greater, node.lesser]
