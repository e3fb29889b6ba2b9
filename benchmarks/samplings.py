"""Point clouds with known answers, for tests and benchmarks."""

import numpy as np


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
