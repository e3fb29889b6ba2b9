"""Divide a surface into parts: nodal domains of a mode, and clusters of points in the spectral embedding."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from ..arguments import real, whole
from ..errors import ComponentError, PointCloudError, TooFewPointsError, UnresolvedModesError
from ..geometry import check_values
from ..kernel import RESOLVED
from ..linalg import eigh
from ..operator import LaplaceBeltrami, NearGraph, near_graph
from ..progress import ends_at_one
from ..types import Array, Floats, Ints, Progress

_NEIGHBORS = 8  # nearest points on the same sheet that a domain may continue to
_STEP = 0.75  # from level to level, down the hills of a function
_LOWEST = 1e-4  # the last but one of these levels, if all signs are trusted
_MODES = 3  # modes for each part: with fewer, limbs are missed; with more, small features get parts
_WEAK = 1e-6  # of the largest eigenvalue: lower bound of others, so that nearly disconnected parts do not dominate
_STEPS = 300  # of k-means at most; a few dozen are needed
_ROUGH = 1e-3  # accuracy at which the starts of k-means are compared
_LEAST = 0.03  # share of the mean area below which a cluster is a spike or an outlier, not a part
_ROUNDS = 4  # of leaving such clusters out


def nodal_domains(
    laplacian: LaplaceBeltrami, values: ArrayLike, *, threshold: float = 0.02, bridge: float = 0.1, smallest: int = 5
) -> Ints:
    """Divide the points into connected sets on which a function keeps its sign.

    Points are connected to their nearest neighbors on the same sheet, so that two domains of one sign do not join
    through a narrow one of the other sign between them. Where the function is near zero its sign is not trusted: such
    points, and specks of a few points, go to the nearest domain of their sign, or else to the nearest one. Where nodal
    lines cross, the least change connects two of the four domains; so low bridges do not join domains.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    values : array_like, (n,)
        A function on the points, such as a column of ``Spectrum.eigenvectors``.
    threshold : float
        Share of the largest size of the values below which a sign is not trusted.
    bridge : float
        Two hills of one sign are two domains if all paths between them go below this share of the lower one.
    smallest : int
        Points of the smallest domain; smaller ones are specks.

    Returns
    -------
    ndarray, (n,) int
        Domain of each point: 0 for the one of most points, and so on; -1 for points left out of the operator. Of
        equally large domains the one with the larger mean value comes first. Where the function is near zero on a
        whole component, that is one domain.

    Raises
    ------
    InvalidPointsError
        Values of another length than the points, or not finite.
    PointCloudError
        A threshold or bridge outside of [0, 1), or a smallest size below 1.

    See Also
    --------
    LaplaceBeltrami.eigenpairs : Computes modes.
    segment : Parts by many modes at once.

    References
    ----------
    Figures 10, 11 and 16 of the paper. Counted as there, from 1, mode k is column k - 1; mode 1 is constant.

    Examples
    --------
    On a sphere the height changes its sign at the equator, and x y has a domain in each quarter:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> print(np.bincount(mf.spectral.nodal_domains(laplacian, z)))
    [400 400]
    >>> print(mf.spectral.nodal_domains(laplacian, points[:, 0] * points[:, 1]).max() + 1)
    4
    """
    n = len(laplacian.points)
    values = check_values(values, n, columns=False)
    for name, share in (("threshold", threshold), ("bridge", bridge)):
        if not 0.0 <= real(share) < 1.0:
            raise PointCloudError(f"The {name} of nodal domains is {share!r}. Use a number from 0 to below 1.")
    if not real(smallest) >= 1.0:
        raise PointCloudError(f"The smallest nodal domain is {smallest!r} points. Use a number of at least 1.")
    graph = near_graph(laplacian, _NEIGHBORS)
    value, part = values[graph.first], laplacian.component[graph.first]
    positive = (value > 0.0).astype(int)
    domain = _hills(graph.lengths, positive, np.abs(value), threshold, bridge)
    domain[np.bincount(domain + 1)[domain + 1] < smallest] = -1
    # A component where no domain is left is one.
    empty = np.bincount(part, domain >= 0) == 0
    domain = np.where(empty[part], domain.max() + 1 + part, domain)
    domain = _join_nearest(_keep_edges(graph.lengths, positive), domain)
    domain = _join_nearest(graph.lengths, domain)
    return _by_size(graph, domain, values)


@ends_at_one
def segment(laplacian: LaplaceBeltrami, parts: int, *, progress: Progress | None = None) -> Ints:
    """Divide the surface into a number of parts, such as the limbs of a figure.

    Points are clustered by k-means in the global point signature: coordinates ``phi_k / sqrt(lambda_k)``, here with a
    factor that fades to zero at the last mode used, so that their distances depend neither on the signs of modes nor on
    the basis among those of one eigenvalue. All is weighted by areas and deterministic. Of each cluster the connected
    component of largest area is a part; its other points go to the nearest part.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    parts : int
        How many parts; at least one for each component of the cloud. The others are distributed by area.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,) int
        Part of each point: 0 for the one of most points, and so on; -1 for points left out of the operator. Moving,
        rotating or scaling the cloud, or the order of its points, make no difference but for points at a border
        between two parts. (On a surface that rotations map to itself, such as a sphere, all choices are equally good.)

    Raises
    ------
    TooFewPointsError
        A number of parts below 1, or more than the points can be divided into.
    ComponentError
        Fewer parts than components.
    SolverError
        The eigenvalue solver did not converge.

    See Also
    --------
    modes_needed : How many modes it uses.
    nodal_domains : Parts by the sign of one function.
    heat_kernel_signature : Distinguishes points by modes.

    References
    ----------
    Rustamov. Laplace-Beltrami eigenfunctions for deformation invariant shape representation. 2007.

    Examples
    --------
    A dumbbell is divided at its waist, where z is zero:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> dumbbell = points * (0.4 + np.abs(z))[:, None]
    >>> labels = mf.spectral.segment(mf.build_laplacian(dumbbell), 2)
    >>> print(labels.max() + 1, np.ptp(labels[z > 0.1]), np.ptp(labels[z < -0.1]))
    2 0 0
    """
    n = len(laplacian.points)
    parts = _check_parts(parts)
    components = int(laplacian.component.max()) + 1
    if parts < components:
        raise ComponentError(
            f"{parts} parts were asked for, but the {n} points lie in {components} components that cannot be"
            f" joined. Ask for at least {components}, or delete the small ones."
        )
    if parts > components and components + parts >= n // 3:  # as many modes as n points carry
        raise TooFewPointsError(
            f"{parts} parts need {components + parts + 1} modes, but {n} points carry at most {n // 3}."
            f" {_advice(n // 3, components)}"
        )
    report = progress or (lambda stage, fraction: None)
    report("Parts", 0.0)
    graph = near_graph(laplacian, _NEIGHBORS)
    component, known = laplacian.component[graph.first], graph.place >= 0
    areas: Array = np.bincount(graph.place[known], laplacian.areas[known], minlength=len(graph.first))
    share = _distribute(parts, np.bincount(component, areas))
    part = component.copy()
    if parts > components:
        signature = _signature(laplacian, parts, report)[graph.first]
        report("Parts", 0.0)
        label = np.concatenate([[0], np.cumsum(share)])
        for number in np.flatnonzero(share > 1):
            own = np.flatnonzero(component == number)
            part[own] = label[number] + _cluster(signature[own], areas[own], share[number])
        for number in np.flatnonzero(share == 1):
            part[component == number] = label[number]
    part = _join_nearest(graph.lengths, _largest_only(graph.lengths, part, areas))
    center = laplacian.areas @ laplacian.points / laplacian.areas.sum()
    return _by_size(graph, part, np.linalg.norm(laplacian.points - center, axis=1))


def modes_needed(laplacian: LaplaceBeltrami, parts: int) -> int:
    """Return how many modes `segment` uses, the constant ones included.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    parts : int
        How many parts.

    Returns
    -------
    int

    Raises
    ------
    TooFewPointsError
        Not a whole number of at least 1.
    """
    return _constant_modes(laplacian) + _MODES * _check_parts(parts) + 1


def _advice(modes: int, components: int) -> str:
    """Return what to do where there are only so many modes."""
    most = modes - components - 1
    return f"Ask for at most {most}, or add points." if most > components else "Add points."


def _check_parts(parts: int) -> int:
    """Return the number of parts."""
    if not whole(parts) >= 1:
        raise TooFewPointsError(f"{parts!r} parts were asked for. Ask for a whole number of at least 1.")
    return int(whole(parts))


def _constant_modes(laplacian: LaplaceBeltrami) -> int:
    """Return the number of modes of eigenvalue zero, one for each connected component of the stiffness."""
    label = connected_components(laplacian.stiffness, directed=False)[1]
    return len(np.unique(label[laplacian.component >= 0]))


def _signature(laplacian: LaplaceBeltrami, parts: int, progress: Progress) -> Floats:
    """Return the faded global point signature, (n, modes)."""
    constant, count = _constant_modes(laplacian), modes_needed(laplacian, parts)
    # Weyl's law, doubled: with more, all eigenvalues would be computed only to be refused.
    resolved = 2.0 * RESOLVED**2 / (4.0 * np.pi) * np.sum(laplacian.areas / laplacian.smoothing_lengths**2)
    count = min(count, len(laplacian.points) // 3, int(resolved) + constant)
    try:
        spectrum = laplacian.eigenpairs(count, progress=progress)
    except UnresolvedModesError as error:
        count = error.resolved
        spectrum = laplacian.eigenpairs(count, progress=progress)
    if count <= constant + parts:
        raise TooFewPointsError(
            f"{parts} parts need {constant + parts + 1} modes, but {len(laplacian.points)} points resolve"
            f" {count}. {_advice(count, constant)}"
        )
    values, last = spectrum.eigenvalues[constant : count - 1], spectrum.eigenvalues[count - 1]
    values = np.maximum(values, _WEAK * last)
    return spectrum.eigenvectors[:, constant : count - 1] * ((1.0 - values / last) / np.sqrt(values))


def _distribute(parts: int, areas: Array) -> Ints:
    """Return the number of parts of each component: one, and each other one where the area per part is largest."""
    share = np.ones(len(areas), dtype=int)
    for _ in range(parts - len(areas)):
        share[np.argmax(areas / share)] += 1
    return share


def _cluster(signature: Floats, weight: Floats, count: int) -> Ints:
    """Cluster points, (m, modes), and return labels, (m,); clusters far too small for a part are left to the others."""
    for _ in range(_ROUNDS):
        centers = _k_means(signature, weight, count)
        label = _nearest(signature, centers)
        size = np.bincount(label, weight, minlength=count)
        small = size < _LEAST * size.mean()
        if not small.any():
            break
        weight = np.where(small[label], 0.0, weight)
    return label


def _k_means(signature: Floats, weight: Floats, count: int) -> Floats:
    """Return the centers, (count, modes), of the better clusters that Lloyd's steps find from two starts.

    One start are points far from each other, which are the ends of limbs; the other halves the most scattered cluster
    across its longest axis, again and again.
    """
    known = weight > 0.0
    points, weight = signature[known], weight[known]
    starts = (_far_points(points, weight, count), _halves(points, weight, count))
    found = min((_lloyd(points, weight, start, _ROUGH) for start in starts), key=lambda result: result[1])
    return _lloyd(points, weight, found[0], 0.0)[0]


def _far_points(points: Floats, weight: Floats, count: int) -> Floats:
    """Return the point farthest from the mean of all, then repeatedly the one farthest from those."""
    chosen = [points[np.argmax(_squares(points, weight @ points / weight.sum()))]]
    away = np.full(len(points), np.inf)
    while len(chosen) < count:
        away = np.minimum(away, _squares(points, chosen[-1]))
        chosen.append(points[np.argmax(away)])
    return np.array(chosen)


def _halves(points: Floats, weight: Floats, count: int) -> Floats:
    """Return the centers of clusters that halving across the axis of largest scatter gives."""
    clusters = [np.arange(len(points))]
    axes = [_main_axis(points, weight)]
    while len(clusters) < count:
        widest = max(range(len(axes)), key=lambda number: axes[number][0])
        own, (_, mean, axis) = clusters.pop(widest), axes.pop(widest)
        beyond = (points[own] - mean) @ axis > 0.0
        for half in (own[beyond], own[~beyond]):
            clusters.append(half)
            axes.append(_main_axis(points[half], weight[half]))
    return np.array([mean for _, mean, _ in axes])


def _main_axis(points: Floats, weight: Floats) -> tuple[float, Floats, Floats]:
    """Return the scatter along the axis where it is largest, the mean of the points, and the axis."""
    if not len(points):
        return 0.0, np.zeros(points.shape[1]), np.zeros(points.shape[1])
    mean = weight @ points / weight.sum()
    offset = points - mean
    scatter, axes = eigh((offset * weight[:, None]).T @ offset)
    return scatter[-1], mean, axes[:, -1]


def _lloyd(points: Floats, weight: Floats, centers: Floats, rtol: float) -> tuple[Floats, float]:
    """Move centers to the means of their clusters until these stay, or their squares fall by less than rtol."""
    centers, total, label = centers.copy(), np.inf, np.zeros(0, dtype=int)
    for _ in range(_STEPS):
        last, label = label, _nearest(points, centers)
        share = sparse.csr_array((weight, (label, np.arange(len(label)))), shape=(len(centers), len(label)))
        size = share.sum(axis=1)
        filled = size > 0.0
        centers[filled] = (share @ points)[filled] / size[filled, None]
        squares = np.sum((points - centers[label]) ** 2, axis=1)
        before, total = total, weight @ squares
        if not filled.all():  # a cluster that lost its points starts again where the others fit worst
            centers[np.flatnonzero(~filled)[0]] = points[np.argmax(squares)]
        elif before - total < rtol * total or np.array_equal(label, last):
            break
    return centers, total


def _nearest(points: Floats, centers: Floats) -> Ints:
    return (np.sum(centers**2, axis=1) - 2.0 * (points @ centers.T)).argmin(axis=1)


def _squares(points: Floats, center: Floats) -> Floats:
    return np.sum((points - center) ** 2, axis=1)


def _largest_only(lengths: sparse.csr_array, part: Ints, areas: Floats) -> Ints:
    """Keep the label of each part on its connected component of the largest area, -1 elsewhere."""
    component = _components(lengths, part)
    size = np.bincount(component, areas)
    order = np.argsort(size[component], kind="stable")
    main = np.zeros(part.max() + 1, dtype=int)
    main[part[order]] = component[order]
    return np.where(main[part] == component, part, -1)


def _hills(lengths: sparse.csr_array, sign: Ints, size: Floats, threshold: float, bridge: float) -> Ints:
    """Number the hills of a function's size, by connected components above lower and lower levels; -1 for no hill.

    Hills of one sign that meet at a level become one, unless the level is below a share `bridge` of both.
    """
    lengths = sparse.triu(lengths, format="csr")  # one entry per edge connects its ends
    hill, top = np.full(len(size), -1), np.empty(0, dtype=int)  # top: the highest point of each hill
    steps = int(np.ceil(np.log(max(threshold, _LOWEST)) / np.log(_STEP)))
    levels = size.max() * np.append(_STEP ** np.arange(1, steps), threshold)
    by_size = np.argsort(size, kind="stable")
    for level in levels:
        component = _components(lengths, np.where(size > level, sign, -1))
        count = component.max() + 1
        known = by_size[component[by_size] >= 0]
        highest = np.empty(count, dtype=int)
        highest[component[known]] = known
        order = np.argsort(size[top], kind="stable")
        head = np.full(count, -1)
        head[component[top[order]]] = order
        new = head < 0
        # A hill that stays is alone in its component, the highest one there, or reaches far above the level.
        number = np.where(bridge * size[top] > level, np.arange(len(top)), head[component[top]])
        hill[hill >= 0] = number[hill[hill >= 0]]
        alone = np.bincount(component[top[np.unique(number)]], minlength=count) == 1
        head[new] = len(top) + np.arange(np.count_nonzero(new))
        top = np.append(top, highest[new])
        fresh = (hill < 0) & (component >= 0)
        fresh[fresh] = (alone | new)[component[fresh]]
        hill[fresh] = head[component[fresh]]
        left, hill = np.unique(hill, return_inverse=True)
        hill = hill.reshape(-1) - (left[0] < 0)
        top = top[left[left >= 0]]
    return hill


def _keep_edges(lengths: sparse.csr_array, label: Ints) -> sparse.csr_array:
    """Return the graph without edges between different labels, or from labels below zero."""
    edges = lengths.tocoo()
    kept = (label[edges.row] == label[edges.col]) & (label[edges.row] >= 0)
    return sparse.csr_array((edges.data[kept], (edges.row[kept], edges.col[kept])), shape=lengths.shape)


def _components(lengths: sparse.csr_array, label: Ints) -> Ints:
    """Number the connected components of equal label; labels below zero stay -1."""
    component, known = connected_components(_keep_edges(lengths, label), directed=False)[1], label >= 0
    result = np.full(len(label), -1)
    result[known] = np.unique(component[known], return_inverse=True)[1].reshape(-1)
    return result


def _join_nearest(lengths: sparse.csr_array, label: Ints) -> Ints:
    """Give every point of label -1 the label of the nearest one that has one, where a path leads there."""
    start = np.flatnonzero(label >= 0)
    if len(start) in (0, len(label)):
        return label
    _, _, source = dijkstra(lengths, directed=False, indices=start, min_only=True, return_predecessors=True)
    reached = source >= 0
    result = label.copy()
    result[reached] = label[source[reached]]
    return result


def _by_size(graph: NearGraph, label: Ints, values: Floats) -> Ints:
    """Return labels for the caller's points, numbered by how many points have them, and by mean values among equals."""
    label = graph.scatter(label, -1)
    known = label >= 0
    _, inverse, size = np.unique(label[known], return_inverse=True, return_counts=True)
    mean = np.bincount(inverse, values[known]) / size
    number = np.empty_like(size)
    number[np.lexsort((-mean, -size))] = np.arange(len(size))
    label[known] = number[inverse]
    return label
