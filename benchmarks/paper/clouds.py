"""The samplings of the evaluation, by the number of points, and the true meshes that some of the peers need."""

import functools

import numpy as np
from scipy.spatial import ConvexHull, Delaunay
from scipy.special import ellipeinc, ellipkinc

from ..samplings import fibonacci_sphere, icosahedral_sphere, marching_cubes_sphere, random_sphere


def density_varying_sphere(count):
    """Return an icosahedral sphere whose upper half quadric edge collapse has brought to a quarter, about (count, 3).

    Collapse by fast_simplification (Garland, Heckbert 1997) of the triangles above the equator; the points that are
    left are put back on the sphere.
    """
    import fast_simplification

    points = icosahedral_sphere(round(np.sqrt(0.16 * count)))  # 5/8 of its 10 f^2 points stay
    triangles = ConvexHull(points).simplices
    outwards = np.einsum("ij,ij->i", np.cross(*np.moveaxis(points[triangles], 1, 0)[:2]), points[triangles[:, 2]]) > 0.0
    triangles = np.where(outwards[:, None], triangles, triangles[:, ::-1])
    upper = points[triangles, 2].mean(axis=1) > 0.0
    kept, half = np.unique(triangles[upper], return_inverse=True)
    half = half.reshape(-1, 3).astype(np.int32)
    few = fast_simplification.simplify(points[kept], half, target_reduction=0.75)[0]
    lower = np.setdiff1d(triangles[~upper], kept)
    points = np.concatenate([points[lower], few])
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points[np.sort(np.unique(np.round(points, 9), axis=0, return_index=True)[1])]


# Points on the unit sphere by their number, which is met to some percent.
SPHERES = {
    "icosahedral": lambda count: icosahedral_sphere(round(np.sqrt(0.1 * count))),
    "Fibonacci": fibonacci_sphere,
    "marching cubes": lambda count: marching_cubes_sphere(round(np.sqrt(count / 3.9))),
    "density varying": density_varying_sphere,
    "random": random_sphere,
}
UNIFORM = ("icosahedral", "Fibonacci")


@functools.cache
def sphere(sampling, count):
    """Return points of a sampling and the triangles of their hull, the best mesh a method could be given."""
    points = SPHERES[sampling](count)
    return points, ConvexHull(points).simplices


def torus_triangles(points, major=1.0, minor=0.4):
    """Return the Delaunay triangles of points on a torus in coordinates that keep its angles, (m, 3)."""
    n = len(points)
    around = np.arctan2(points[:, 1], points[:, 0])
    theta = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1]) - major)
    # The integral of minor / (major + minor cos(theta)), so that both coordinates are stretched alike.
    slow = np.sqrt((major - minor) / (major + minor))
    tube = 2.0 * minor / np.sqrt(major**2 - minor**2) * np.arctan(slow * np.tan(0.5 * theta))
    periods = np.array([2.0 * np.pi, 2.0 * np.pi * minor / np.sqrt(major**2 - minor**2)])
    flat = np.column_stack([around, tube])
    shifts = np.array([(a, b) for a in (0, -1, 1) for b in (0, -1, 1)])
    tiles = (flat[None] + (shifts * periods)[:, None]).reshape(-1, 2)
    corners = Delaunay(tiles).simplices
    middle = tiles[corners].mean(axis=1)
    inside = ((middle >= -0.5 * periods) & (middle < 0.5 * periods)).all(axis=1)
    return corners[inside] % n


def ellipsoid(points, axes):
    """Stretch points of the unit sphere."""
    return points * np.asarray(axes)


def ellipsoid_area(axes):
    """Return the area of an ellipsoid with semi-axes a > b > c, by Legendre's incomplete elliptic integrals."""
    a, b, c = axes
    angle = np.arccos(c / a)
    modulus = (a * a * (b * b - c * c)) / (b * b * (a * a - c * c))
    sine, cosine = np.sin(angle), np.cos(angle)
    bent = ellipeinc(angle, modulus) * sine**2 + ellipkinc(angle, modulus) * cosine**2
    return 2.0 * np.pi * (c * c + a * b / sine * bent)
