"""Equations solved with this project's coarse versions of their matrix, and with those of pyamg, if it is installed.

python -m benchmarks.multigrid POINTS METHOD, with a number of random points of a sphere or a file with points, and the
method ours, aggregation or ruge-stuben
"""

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

import core
from core.algebra.hierarchy import approximate_inverse
from core.algebra.solvers import conjugate_gradients
from core.cores import cores
from core.files import read_points

from .samplings import random_sphere


def ours(matrix, load):
    """Yield when all is ready, after the setup, and after the solution the number of steps."""
    with ThreadPoolExecutor(cores()) as pool:
        yield None
        inverse = approximate_inverse(matrix, pool, lambda: None)
        yield None
        yield conjugate_gradients(matrix, load, scaling=inverse).products


def peer(setup, **settings):
    """Return the like for one of pyamg's hierarchies."""

    def solve(matrix, load):
        import pyamg

        yield None
        levels, residuals = getattr(pyamg, setup)(sparse.csr_matrix(matrix), max_coarse=1000, **settings), []
        yield None
        levels.solve(load, tol=1e-9, accel="cg", residuals=residuals, maxiter=200)
        yield len(residuals) - 1

    return solve


METHODS = {
    "ours": ours,
    "aggregation": peer("smoothed_aggregation_solver", symmetry="symmetric", strength=("symmetric", {"theta": 0.01})),
    "ruge-stuben": peer("ruge_stuben_solver"),
}


def main(points, method):
    """Print the processor time of setup and solution, and the steps."""
    points = random_sphere(int(points)) if points.isdigit() else read_points(Path(points)).points
    laplacian = core.build_laplacian(points)
    low, high = np.quantile(points[:, 2], [0.002, 0.998])
    inside = (points[:, 2] > low) & (points[:, 2] < high) & (laplacian.component == 0)
    free = np.flatnonzero(inside)[cKDTree(points[inside]).indices]
    rows = laplacian.stiffness[free]
    matrix, load = rows[:, free].tocsr(), -(rows @ (points[:, 2] >= high).astype(np.float64))
    marks, steps = zip(*((time.process_time(), result) for result in METHODS[method](matrix, load)), strict=True)
    setup, solution = np.diff(marks)
    print(f"{method}: setup {setup:.2f} s, solution {solution:.2f} s, {steps[-1]} steps")


if __name__ == "__main__":
    main(*sys.argv[1:])
