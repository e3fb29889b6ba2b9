"""Point clouds with known answers, for tests and benchmarks."""

import numpy as np
from scipy.linalg import eigvalsh
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull
from scipy.special import jnp_zeros

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
SIDES = 1.2, 1.0  # of the parabolic cylinder, so that the modes that the paper shows are simple


def random_sphere(count, seed=0):
    """Return points distributed evenly at random on the unit sphere, (count, 3)."""
    points = np.random.default_rng(seed).standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def fibonacci_sphere(count):
    """Return the Fibonacci lattice on the unit sphere, (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z * z)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def rough_sphere(points, wavelength, slope, seed=0, waves=60):
    """Return points of the unit sphere with roughness, (count, 3), and the area of the surface that they are on.

    Parameters
    ----------
    points : ndarray, (count, 3)
        On the unit sphere.
    wavelength : float
        Shortest wavelength of the roughness, in mean spacings of the points.
    slope : float
        Root mean square slope of the roughness, about.
    seed, waves : int
        Of the plane waves of random directions and phases that make it.
    """
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(waves, 3))
    frequency = 2.0 * np.pi / (wavelength * np.sqrt(4.0 * np.pi / len(points)))
    direction *= frequency / np.linalg.norm(direction, axis=1)[:, None]
    phase = rng.uniform(0.0, 2.0 * np.pi, waves)
    size = slope / frequency * np.sqrt(3.0 / waves)

    # r = 1 + f over the unit sphere u: the area is the integral of r (r^2 + |grad f|^2)^(1/2).
    u = fibonacci_sphere(40_000)
    gradient = -size * np.sin(u @ direction.T + phase) @ direction
    gradient -= np.einsum("ia,ia->i", gradient, u)[:, None] * u
    radius = 1.0 + size * np.cos(u @ direction.T + phase).sum(axis=1)
    area = 4.0 * np.pi * np.mean(radius * np.sqrt(radius**2 + (gradient**2).sum(axis=1)))
    return points * (1.0 + size * np.cos(points @ direction.T + phase).sum(axis=1))[:, None], area


def beaded_sphere(radius, count, body=3000):
    """Return a unit sphere with a bead on its pole, (n, 3), which points are the bead's, and both exposed areas.

    Parameters
    ----------
    radius : float
        Of the bead, whose middle is 0.6 radii above the pole.
    count, body : int
        Points of the whole bead and of the whole sphere.
    """
    away = 1.0 + 0.6 * radius
    middle = np.array([0.0, 0.0, away])
    sphere, bead = fibonacci_sphere(body), middle + radius * fibonacci_sphere(count)
    sphere = sphere[np.linalg.norm(sphere - middle, axis=1) > radius]
    bead = bead[np.linalg.norm(bead, axis=1) > 1.0]
    seam = (away**2 + 1.0 - radius**2) / (2.0 * away)  # height of the circle where they meet
    areas = 2.0 * np.pi * (1.0 + seam), 2.0 * np.pi * radius * (radius + away - seam)
    return np.concatenate([sphere, bead]), np.arange(len(sphere) + len(bead)) >= len(sphere), areas


def icosahedral_sphere(frequency):
    """Return an icosahedron's faces divided ``frequency`` times per edge, on the unit sphere: 10 f^2 + 2 points."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = np.array([(0.0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
    corners = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    faces = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if max(apart[a, b], apart[b, c], apart[a, c]) < 2.1
    ]
    i, j = np.divmod(np.arange((frequency + 1) ** 2), frequency + 1)
    inside = i + j <= frequency
    weights = np.column_stack([i, j, frequency - i - j])[inside] / frequency
    points = np.concatenate([weights @ corners[list(face)] for face in faces])
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points[np.unique(np.round(points, 9), axis=0, return_index=True)[1]]


def marching_cubes_sphere(cells):
    """Return the vertices that marching cubes puts on the unit sphere: one per grid edge that crosses it.

    Edges of a grid with ``cells`` cells per axis over [-1.1, 1.1]^3; the crossing is interpolated linearly in the
    signed distance, as marching cubes does, and then moved onto the sphere along its radius.
    """
    axis = np.linspace(-1.1, 1.1, cells + 1)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    value = np.linalg.norm(grid, axis=-1) - 1.0
    points = []
    for direction in range(3):
        low = np.moveaxis(value, direction, 0)[:-1]
        high = np.moveaxis(value, direction, 0)[1:]
        crossing = (low < 0.0) != (high < 0.0)
        low, high = low[crossing], high[crossing]
        share = (low / (low - high))[:, None]
        start = np.moveaxis(grid, direction, 0)[:-1][crossing]
        end = np.moveaxis(grid, direction, 0)[1:][crossing]
        points.append(start + share * (end - start))
    points = np.concatenate(points)
    return points / np.linalg.norm(points, axis=1)[:, None]


def uneven_sphere(count, seed=0, ratio=9.0):
    """Return random points on the unit sphere whose density changes by ``ratio`` between two halves, (count, 3)."""
    generator = np.random.default_rng(seed)
    points = random_sphere(4 * count, seed)
    chance = np.where(points[:, 2] > 0.0, 1.0, 1.0 / ratio)
    return points[generator.random(len(points)) < chance][:count]


def torus_points(count, major=1.0, minor=0.4, seed=0):
    """Return points distributed evenly by area at random on a torus around the z axis, (count, 3)."""
    generator = np.random.default_rng(seed)
    angle = 2.0 * np.pi * generator.random(3 * count)
    # The area element is proportional to the distance from the axis: accept the tube angle with that chance.
    angle = angle[generator.random(len(angle)) * (major + minor) < major + minor * np.cos(angle)][:count]
    around = 2.0 * np.pi * generator.random(len(angle))
    radius = major + minor * np.cos(angle)
    return np.column_stack([radius * np.cos(around), radius * np.sin(around), minor * np.sin(angle)])


def sphere_eigenvalues(count):
    """Return the first eigenvalues l (l + 1) of the unit sphere, each 2 l + 1 times, (count,)."""
    degree = np.arange(int(np.sqrt(count)) + 1)
    return np.repeat(degree * (degree + 1.0), 2 * degree + 1)[:count]


def tube_angles(fraction, ratio):
    """Return the angles around a bent tube that have this fraction of its area before them, (n,).

    The area element is proportional to ``1 + ratio cos(angle)``: solve ``angle + ratio sin(angle) = 2 pi fraction``.
    """
    table = np.linspace(0.0, 2.0 * np.pi, 4097)
    target = 2.0 * np.pi * fraction
    angle = np.interp(target, table + ratio * np.sin(table), table)
    for _ in range(5):
        angle -= (angle + ratio * np.sin(angle) - target) / (1.0 + ratio * np.cos(angle))
    return angle


def torus_low_discrepancy(count, major=1.0, minor=0.4):
    """Return a golden-ratio lattice, mapped by area to a torus around the z axis, (count, 3)."""
    k = np.arange(count)
    angle = tube_angles((k + 0.5) / count, minor / major)
    around = 2.0 * np.pi * (k * GOLDEN % 1.0)
    radius = major + minor * np.cos(angle)
    return np.column_stack([radius * np.cos(around), radius * np.sin(around), minor * np.sin(angle)])


def torus_area(major=1.0, minor=0.4):
    """Return the area of a torus."""
    return 4.0 * np.pi**2 * major * minor


def torus_eigenvalues(count, major=1.0, minor=0.4):
    """Return the first eigenvalues of a torus, (count,).

    With exp(i m theta) g(phi) and w = major + minor cos(phi) it is -(w g')' / (minor^2 w) + m^2 g / w^2 = lambda g,
    solved by Fourier collocation; all m > 0 count twice.
    """
    weyl = 4.0 * np.pi * count / torus_area(major, minor)
    half = int(64 + 2.0 * minor * np.sqrt(weyl))
    nodes = 2 * half + 1
    step = np.arange(nodes)[:, None] - np.arange(nodes)
    with np.errstate(divide="ignore"):
        derivative = 0.5 * (-1.0) ** step / np.sin(np.pi * step / nodes)
    np.fill_diagonal(derivative, 0.0)
    w = major + minor * np.cos(2.0 * np.pi * np.arange(nodes) / nodes)
    flow = np.sqrt(w)[:, None] * derivative / np.sqrt(w) / minor
    values = np.empty(0)
    m = 0
    while len(values) < count or (m / (major + minor)) ** 2 <= values[count - 1]:  # a bound of the lowest one for m
        found = eigvalsh(flow.T @ flow + np.diag((m / w) ** 2))[:count]
        values = np.sort(np.concatenate([values, np.repeat(found, 2 if m else 1)]))[:count]
        m += 1
    values[0] = 0.0
    return values


def edge_collapsed_sphere(count=8001, seed=0):
    """Return what collapses of the shortest edges leave of a random triangulation with twice the points, (count, 3).

    Round by round, of the shortest tenth of the edges, those that are the shortest at both ends shrink to their middle.
    """
    points = random_sphere(2 * count, seed)
    while len(points) > count:
        corners = ConvexHull(points).simplices
        edges = np.unique(np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        edges = edges[np.argsort(length)[: len(edges) // 10 + 1]]
        rank = np.arange(len(edges))
        least = np.full(len(points), len(edges))
        np.minimum.at(least, edges, rank[:, None])
        chosen = edges[(least[edges] == rank[:, None]).all(axis=1)][: len(points) - count]
        middle = points[chosen].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        points = np.concatenate([np.delete(points, chosen.ravel(), axis=0), middle])
    return points


def noisy_sphere(count, level, seed=0):
    """Return the Fibonacci sphere with Gaussian noise of ``level`` spacings in every coordinate, (count, 3)."""
    spacing = np.sqrt(4.0 * np.pi / count)
    return fibonacci_sphere(count) + level * spacing * np.random.default_rng(seed).standard_normal((count, 3))


def hemisphere_random(count, seed=0):
    """Return points distributed evenly at random on the half of the unit sphere with z >= 0, (count, 3)."""
    points = random_sphere(count, seed)
    points[:, 2] = np.abs(points[:, 2])
    return points


def square_grid(side=60):
    """Return a square grid on the unit square in the plane z = 0, its boundary included, (side^2, 3)."""
    return grid_points(np.linspace(0.0, 1.0, side), np.linspace(0.0, 1.0, side), [0.0])


def square_random(count, seed=0):
    """Return points distributed evenly at random in the unit square in the plane z = 0, (count, 3)."""
    return np.random.default_rng(seed).random((count, 3)) * (1.0, 1.0, 0.0)


def square_eigenvalues(count):
    """Return the first Neumann eigenvalues of the unit square, (count,)."""
    squares = np.arange(count) ** 2
    return np.pi**2 * np.sort(np.add.outer(squares, squares), axis=None)[:count]


def disc_random(count, seed=0):
    """Return points distributed evenly at random in the unit disc in the plane z = 0, and their distances to its
    boundary.

    Returns
    -------
    points : ndarray, (count, 3)
    distance : ndarray, (count,)
    """
    share, turn = np.random.default_rng(seed).random((2, count))
    radius, around = np.sqrt(share), 2.0 * np.pi * turn
    return np.column_stack([radius * np.cos(around), radius * np.sin(around), np.zeros(count)]), 1.0 - radius


def disc_eigenvalues(count):
    """Return the first Neumann eigenvalues of the unit disc, zeros of J_m' squared, m > 0 twice, (count,)."""
    most = int(2.0 * np.sqrt(count)) + 4  # Weyl: the highest zero wanted is below, and so is m
    zeros = [np.repeat(jnp_zeros(m, most // 3 + 2), 2 if m else 1) for m in range(most)]
    return np.sort(np.concatenate([[0.0], *zeros]))[:count] ** 2


def open_cylinder():
    """Return a regular grid, 196 around and 40 up, on an open cylinder of radius and height 2, (7840, 3)."""
    around = 2.0 * np.pi * np.arange(196) / 196
    around, height = (part.ravel() for part in np.meshgrid(around, np.linspace(-1.0, 1.0, 40), indexing="ij"))
    return np.column_stack([2.0 * np.cos(around), 2.0 * np.sin(around), height])


def grid_points(x, y, z):
    """Return all points with these coordinates, (n, 3)."""
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)


def parallel_sheets(side=40, apart=1.5):
    """Return two square sheets of side x side points at unit spacing, one above the other.

    Returns
    -------
    points : ndarray, (2 side^2, 3)
    sheet : ndarray, (2 side^2,)
        0 or 1.
    area : float
        Of each sheet.
    """
    points = grid_points(np.arange(side), np.arange(side), [0.0, apart])
    return points, (points[:, 2] > 0.0).astype(int), (side - 1.0) ** 2


def closed_plate(side=40, thickness=2):
    """Return a grid of unit spacing on the surface of a closed box of side x side x thickness.

    Returns
    -------
    points : ndarray, (n, 3)
    face : ndarray, (n,)
        0 or 1 on the two large faces, their boundaries included, -1 on the narrow ones.
    inset : ndarray, (n,)
        Distance to the nearest narrow face: the way around from face to face is at least both insets and the thickness.
    area : float
    """
    points = grid_points(np.arange(side + 1.0), np.arange(side + 1.0), np.arange(thickness + 1.0))
    inset = np.minimum(points[:, :2], side - points[:, :2]).min(axis=1)
    bottom, top = points[:, 2] == 0.0, points[:, 2] == thickness
    face = np.select([bottom, top], [0, 1], -1)
    outside = bottom | top | (inset == 0.0)
    return points[outside], face[outside], inset[outside], 2.0 * side**2 + 4.0 * side * thickness


def parabolic_cylinder(bend, side=21):
    """Return ``(u, bend u^2, v)`` over a rectangle of sides 1.2 and 1, even along the parabola's arc, (side^2, 3).

    All bends are isometric to each other; zero is the plane. (v runs along y, the height is z.)
    """
    along, across = (part.ravel() for part in np.meshgrid(*(np.linspace(-0.5, 0.5, side) * s for s in SIDES)))
    u = along.copy()
    if bend:
        slope = 2.0 * bend
        for _ in range(30):  # Newton's steps for arc(u) = along
            t = slope * u
            root = np.sqrt(1.0 + t * t)
            u -= (0.5 * (t * root + np.arcsinh(t)) / slope - along) / root
    return np.column_stack([u, across, bend * u**2])


def trimmed_star(count=5000, arms=6, seed=None):
    """Return points on a closed star with sharp edges: a thick star polygon whose arms end in straight cuts.

    Parameters
    ----------
    count : int
    arms : int
    seed : int, optional
        Of random points; without it they are those of a golden-ratio lattice on each face.

    Returns
    -------
    ndarray, (count, 3)
        As many on every face as its area asks for; the tips are 1 from the axis, the thickness is 0.3.
    """
    inner, thickness, trim = 0.45, 0.3, 0.12
    # Corners of one arm from one valley to the next: in the middle the cut, of half width ``trim``.
    angle = np.pi / arms
    turns = 2.0 * np.pi * np.arange(arms) / arms
    arm = np.array([[inner * np.cos(angle), -inner * np.sin(angle)], [1.0, -trim], [1.0, trim]])
    rotation = np.stack([np.cos(turns), -np.sin(turns), np.sin(turns), np.cos(turns)], axis=1).reshape(-1, 2, 2)
    outline = np.concatenate([arm @ turn.T for turn in rotation])
    after = np.roll(outline, -1, axis=0)
    length = np.linalg.norm(after - outline, axis=1)
    face = 0.5 * np.abs(outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0])  # triangles from the axis
    weights = np.concatenate([face, face, length * thickness])
    k = np.arange(count)
    place = (k + 0.5) / count if seed is None else np.random.default_rng(seed).random(count)
    ends = np.cumsum(weights / weights.sum())
    kind = np.minimum(np.searchsorted(ends, place), len(ends) - 1)
    edge = kind % len(length)
    t = 1.0 - (ends[kind] - place) * weights.sum() / weights[kind]
    s = k * GOLDEN % 1.0 if seed is None else np.random.default_rng(seed + 1).random(count)
    boundary = (outline[edge].T * (1.0 - s) + after[edge].T * s).T
    flat = kind < 2 * len(length)
    height = np.where(flat, np.where(kind < len(length), 0.5, -0.5), t - 0.5) * thickness
    return np.column_stack([np.where(flat, np.sqrt(t), 1.0)[:, None] * boundary, height])


def sausage_bend(count, radius=0.25, length=6.0):
    """Return the radius of the centre line's half circle that leaves a gap of one mean spacing between the arms."""
    area = 2.0 * np.pi * radius * (length + 2.0 * radius)
    return radius + 0.5 * np.sqrt(area / count)


def sausage(count=3000, bent=False, radius=0.25, length=6.0):
    """Return a golden-ratio lattice, mapped by area to a capsule, straight or bent into a U.

    Both have the same area on every stretch of the centre line, and the same points on their straight parts.

    Parameters
    ----------
    count : int
    bent : bool
        Bend the middle to a half circle, so that the arms come as near as one mean spacing.
    radius, length : float
        Of the tube and of its centre line, half spheres at both ends excluded.

    Returns
    -------
    points : ndarray, (count, 3)
    along : ndarray, (count,)
        Position along the centre line, from -radius to length + radius.
    """
    k = np.arange(count)
    along = (k + 0.5) / count * (length + 2.0 * radius) - radius
    fraction = k * GOLDEN % 1.0
    beyond = along - np.clip(along, 0.0, length)
    width = np.sqrt(radius**2 - beyond**2)
    angle = 2.0 * np.pi * fraction
    if not bent:
        return np.column_stack([along, width * np.cos(angle), width * np.sin(angle)]), along
    bend = sausage_bend(count, radius, length)
    arm = 0.5 * (length - np.pi * bend)
    turn = np.clip((along - arm) / bend, 0.0, np.pi)
    angle = np.where((turn > 0.0) & (turn < np.pi), tube_angles(fraction, radius / bend), angle)
    out = bend + width * np.cos(angle)
    straight = np.minimum(along - arm, 0.0) - np.maximum(along - arm - np.pi * bend, 0.0)
    return np.column_stack([straight + out * np.sin(turn), out * np.cos(turn), width * np.sin(angle)]), along


def sausage_eigenvalue(bend=None, radius=0.25, length=6.0, cells=48):
    """Return the first nonzero eigenvalue of a capsule to about 1e-4, bent to a half circle of radius ``bend`` or not.

    Finite volumes along the meridians (metric (w ds)^2 + (r dtheta)^2, w = 1 + cos(theta) radius / bend in the bend),
    over the half 0 < theta < pi, which holds the mode.
    """
    values = [_sausage_eigenvalue(bend, radius, length, n) for n in (cells, 2 * cells)]
    return (4.0 * values[1] - values[0]) / 3.0  # the error falls with the square of the cell


def _sausage_eigenvalue(bend, radius, length, cells):
    """Solve `sausage_eigenvalue` on this many cells over half of the circumference."""
    size = np.pi * radius / cells
    bow = np.pi * bend if bend else 0.0
    parts = [0.5 * np.pi * radius, 0.5 * (length - bow), bow, 0.5 * (length - bow), 0.5 * np.pi * radius]
    steps = [max(1, round(part / size)) if part else 0 for part in parts]
    ds = np.repeat([part / max(n, 1) for part, n in zip(parts, steps, strict=True)], steps)[:, None]
    end = np.cumsum(ds)[:, None]
    position = np.minimum(end - 0.5 * ds, end[-1] - end + 0.5 * ds)  # from the nearer pole
    r = radius * np.sin(np.minimum(position / radius, 0.5 * np.pi))
    face = np.minimum(end[:-1], end[-1] - end[:-1])
    r_face = radius * np.sin(np.minimum(face / radius, 0.5 * np.pi))
    angle = np.pi * (np.arange(cells) + 0.5) / cells
    bowed = np.repeat([False, False, True, False, False], steps)[:, None]
    ratio = radius / bend if bend else 0.0
    w = np.where(bowed, 1.0 + ratio * np.cos(angle), 1.0)
    w_face = np.where(bowed, 1.0 + ratio * np.cos(angle[:-1] + 0.5 * np.pi / cells), 1.0)
    dt = np.pi / cells
    lengthwise = r_face * dt / (0.5 * (w * ds)[:-1] + 0.5 * (w * ds)[1:])
    around = w_face * ds / (r * dt)
    index = np.arange(w.size).reshape(w.shape)
    weight = np.concatenate([lengthwise.ravel(), around.ravel()])
    a = np.concatenate([index[:-1].ravel(), index[:, :-1].ravel()])
    b = np.concatenate([index[1:].ravel(), index[:, 1:].ravel()])
    coupling = coo_array((weight, (a, b)), shape=(w.size, w.size)).tocsr()
    coupling = coupling + coupling.T
    stiffness = diags_array(coupling.sum(axis=1)) - coupling
    mass = diags_array((w * r * ds * dt).ravel(), format="csc")
    start = np.random.default_rng(0).standard_normal(w.size)
    return eigsh(stiffness.tocsc(), k=2, M=mass, sigma=-0.01, v0=start, return_eigenvectors=False).max()


def bar(cells=15, rows=60, length=4.0):
    """Return a closed bar of unit square section along x, from 0 to its length, as a grid with its quads.

    Returns
    -------
    points : ndarray, (n, 3)
        4,052 with the defaults.
    quads : ndarray, (m, 4) int
    section : ndarray, (rows + 1, 4 cells) int
        The points around each cross-section, in order.
    """
    j, k = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    side = np.arange(cells)
    full = np.full(cells, cells)
    ring = np.concatenate(
        [
            np.column_stack(edge)
            for edge in ((side, 0 * side), (full, side), (full - side, full), (0 * side, full - side))
        ]
    )
    section = np.arange((rows + 1) * len(ring)).reshape(rows + 1, len(ring))
    inner = np.column_stack([j.ravel(), k.ravel()])
    inner = inner[(inner > 0).all(axis=1)]
    at = np.repeat(np.arange(rows + 1), len(ring))
    points = [np.column_stack([at * length / rows, np.tile(ring / cells - 0.5, (rows + 1, 1))])]
    after = np.roll(section, -1, axis=1)
    quads = [np.stack([section[:-1], section[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)]
    for row in (0, rows):
        number = np.empty((cells + 1, cells + 1), dtype=int)
        number[tuple(ring.T)] = section[row]
        number[tuple(inner.T)] = sum(len(part) for part in points) + np.arange(len(inner))
        points.append(np.column_stack([np.full(len(inner), row * length / rows), inner / cells - 0.5]))
        corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
        quads.append(np.stack(corners if row else corners[::-1], axis=-1).reshape(-1, 4))
    return np.concatenate(points), np.concatenate(quads), section


def bent_end(points, angle, length=4.0):
    """Carry points at the end of a bar along an arc in the x-z plane as long as the bar, turned with it."""
    radius = length / angle
    beyond, height = points[:, 0] - length, points[:, 2]
    return np.column_stack(
        [
            radius * np.sin(angle) + beyond * np.cos(angle) - height * np.sin(angle),
            points[:, 1],
            radius * (1.0 - np.cos(angle)) + beyond * np.sin(angle) + height * np.cos(angle),
        ]
    )


def strip_points(count=None, seed=0):
    """Return points on a flat strip of 3 x 1: a grid of 91 x 31, or so many random ones, (n, 3)."""
    if count is None:
        return grid_points(np.linspace(0.0, 3.0, 91), np.linspace(0.0, 1.0, 31), [0.0])
    return np.random.default_rng(seed).random((count, 3)) * [3.0, 1.0, 0.0]


def torus_potential(points, major=1.0, minor=0.4):
    """Solve -Delta u = -x / sqrt(x^2 + y^2) on the torus (the paper's Figure 8) to rounding.

    With u = g(theta) cos(phi) and w = major + minor cos(theta) it is the ordinary equation
    ``-(w g')' / (minor^2 w) + g / w^2 = -1``, here by trigonometric collocation.
    """
    count = 128
    waves = np.fft.fftfreq(count, 1.0 / count)
    w = major + minor * np.cos(2.0 * np.pi * np.arange(count) / count)
    odd = np.where(np.abs(waves) < count // 2, waves, 0.0)
    derive = np.fft.ifft(1j * odd[:, None] * np.fft.fft(np.eye(count), axis=0), axis=0).real
    matrix = -derive @ (w[:, None] * derive) / (minor**2 * w[:, None]) + np.diag(1.0 / w**2)
    series = np.fft.fft(np.linalg.solve(matrix, -np.ones(count))) / count
    radius = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(points[:, 2], radius - major)
    return (np.exp(1j * theta[:, None] * waves) @ series).real * points[:, 0] / radius
