"""Errors on spheres, structure of the matrix, and invariances."""

import numpy as np
from scipy.sparse.linalg import eigsh

import core
from core.geometry.cloud import read_cloud

from .paper.unsymmetrized import unsymmetrized_operator
from .samplings import (
    fibonacci_sphere,
    icosahedral_sphere,
    marching_cubes_sphere,
    random_sphere,
    sphere_eigenvalues,
    torus_points,
    uneven_sphere,
)
from .tables import Table

SPHERE = 4.0 * np.pi
FUNCTIONS = {  # of x on the unit sphere, and what the Laplacian makes of them
    "x": (lambda x: x, lambda x: -2.0 * x),
    "x^2": (lambda x: x**2, lambda x: 2.0 - 6.0 * x**2),
    "e^x": (np.exp, lambda x: np.exp(x) * (1.0 - x**2 - 2.0 * x)),
}


def relative(found, exact):
    """Relative error in the l2 norm."""
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


def sphere_errors(laplacian):
    """Relative l2 errors of L x, L x^2 and L e^x on the unit sphere."""
    x = laplacian.points[:, 0]
    return tuple(relative(laplacian.apply(function(x)), exact(x)) for function, exact in FUNCTIONS.values())


def eigenvalue_errors(laplacian, exact):
    """Relative errors of the nonzero eigenvalues, as many as are resolved."""
    try:
        values = laplacian.eigenpairs(len(exact)).eigenvalues
    except core.UnresolvedModesError as error:
        values = laplacian.eigenpairs(error.resolved).eigenvalues
    return values[1:] / exact[1 : len(values)] - 1.0


def default_on_spheres():
    """Pointwise, area and eigenvalue errors of the default options."""
    clouds = {f"random, seed {seed}": random_sphere(8000, seed) for seed in range(6)}
    clouds["marching cubes"] = marching_cubes_sphere(39)
    clouds["Fibonacci"] = fibonacci_sphere(8000)
    clouds["icosahedral"] = icosahedral_sphere(28)
    clouds["density jump 9:1"] = uneven_sphere(9000)
    rows = []
    for name, points in clouds.items():
        laplacian = core.build_laplacian(points)
        errors = sphere_errors(laplacian)
        off = np.abs(eigenvalue_errors(laplacian, sphere_eigenvalues(100)))
        rows.append(
            [name, f"{len(points):,}", *(f"{error:.1e}" for error in errors)]
            + [f"{laplacian.areas.sum() / SPHERE - 1.0:+.1e}", f"{off.mean():.1e}", f"{off.max():.1e}", str(len(off))]
        )
    return Table(
        "Default options on unit spheres",
        ["points", "n", "L x", "L x^2", "L e^x", "area", "eigenvalues, mean", "max", "of the first"],
        rows,
        "Relative l2 errors; relative errors of area and eigenvalues.",
    )


def structure():
    """Symmetry, row sums and the ends of the spectrum; of eq. (5), before it is made symmetric, the first two."""
    rows = []
    for name, make in {"default": core.build_laplacian, "paper": core.paper.build_laplacian}.items():
        for kind, points in {"random sphere": random_sphere(4000), "torus": torus_points(4000)}.items():
            stiffness = make(points).stiffness
            diagonal = stiffness.diagonal()
            largest = eigsh(stiffness, k=1, which="LA", return_eigenvectors=False)[0]
            smallest = eigsh(stiffness, k=1, which="SA", return_eigenvectors=False)[0]
            rows.append(
                [
                    f"{kind}, {name}",
                    f"{abs(stiffness - stiffness.T).max() / diagonal.max():.0e}",
                    f"{np.max(np.abs(stiffness.sum(axis=1)) / diagonal):.1e}",
                    f"{smallest / largest:+.1e}",
                ]
            )
    for kind, points in {"random sphere": random_sphere(4000), "torus": torus_points(4000)}.items():
        cloud = read_cloud(points, core.PaperOptions().cloud)
        laplacian = core.paper.build_laplacian(points)
        areas = laplacian.areas[cloud.scaled.first]
        normals = laplacian.normals[cloud.scaled.first]
        weak = unsymmetrized_operator(cloud.pairs, normals, areas).multiply(areas[:, None])
        largest = np.abs(weak.diagonal()).max()
        rows.append(
            [
                f"{kind}, eq. (5) times the areas",
                f"{abs(weak - weak.T).max() / largest:.0e}",
                f"{np.max(np.abs(weak.sum(axis=1)) / np.abs(weak.diagonal())):.1e}",
                "",
            ]
        )
    return Table(
        "The stiffness matrix",
        ["operator", "asymmetry / largest entry", "row sum / diagonal", "smallest / largest eigenvalue"],
        rows,
    )


def invariance():
    """Largest relative changes under moves that must not matter."""
    rows = []
    for name, points in {"random torus": torus_points(4000), "marching cubes": marching_cubes_sphere(30)}.items():
        function = np.sin(3.0 * points[:, 0]) * points[:, 2]
        plain = core.build_laplacian(points)
        applied = plain.apply(function)
        turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
        order = np.random.default_rng(1).permutation(len(points))
        same = np.arange(len(points))
        extent = np.ptp(points, axis=0).max()
        for label, moved, index, scale in (
            ("scaled by 1e-3", 1e-3 * points, same, 1e-3),
            ("scaled by 1e3", 1e3 * points, same, 1e3),
            ("rotated", points @ turn, same, 1.0),
            ("permuted", points[order], order, 1.0),
            ("shifted by 1e6 extents", points + 1e6 * extent, same, 1.0),
        ):
            laplacian = core.build_laplacian(moved)
            areas = np.abs(laplacian.areas / scale**2 / plain.areas[index] - 1.0).max()
            total = abs(laplacian.areas.sum() / scale**2 / plain.areas.sum() - 1.0)
            change = relative(laplacian.apply(function[index]) * scale**2, applied[index])
            rows.append([f"{name}, {label}", f"{areas:.1e}", f"{total:.1e}", f"{change:.1e}"])
    return Table("Invariance", ["cloud", "largest change of an area", "of the total", "of L f, l2"], rows)
