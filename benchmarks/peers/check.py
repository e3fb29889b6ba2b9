"""The peers beside their figures of an earlier measurement: ``python -m benchmarks.peers.check [points] [method ...]``.

An implementation that does worse here than that measurement would flatter this project.
"""

import sys
import time

import numpy as np

from ..accuracy import SPHERE, sphere_errors
from ..samplings import fibonacci_sphere, random_sphere, sphere_eigenvalues
from ..tables import Table
from . import METHODS, build, sphere_triangles

MODES = 36  # the constant one included: whole shells up to degree 5
SAMPLINGS = {"Fibonacci": fibonacci_sphere, "random": random_sphere}
# Area, L x, L x^2, L e^x, 36 eigenvalues, mean and max, measured before on 8,000 points with other implementations.
REFERENCE = {
    ("robust", "Fibonacci"): (-1.8e-4, 0.166, 0.082, 0.137, 1.9e-3, 4.2e-3),
    ("robust", "random"): (-1.3e-3, 6.7, 4.0, 5.5, 5.3e-2, 6.1e-2),
    ("tufted", "random"): (-1.5e-3, 6.7, 4.0, 5.5, 5.3e-2, 6.1e-2),
    ("cotangent", "random"): (-7.5e-4, 0.54, 0.57, 0.52, 3.5e-3, 7.6e-3),
    ("pcl", "Fibonacci"): (-5e-4, 6.8e-3, 4.9e-3, 6.1e-3, 1.3e-2, 2.2e-2),
    ("pcl", "random"): (1e-4, 1.0, 0.57, 0.83, 3.0e-2, 4.7e-2),
    ("gmls2", "random"): (None, 7.7e-4, 9.9e-3, 7.0e-3, None, None),
}
HEADER = ["method", "points", "build s", "area", "L x", "L x^2", "L e^x", "36 eigenvalues, mean", "max", "36 modes, s"]


def figures(operator):
    """Measure an operator of points on the unit sphere.

    Returns
    -------
    errors : list
        Relative ones of area, L x, L x^2, L e^x (l2), and the first 36 eigenvalues (mean, max); None for none.
    seconds : float
        Of the eigenpairs.
    note : str
        What is odd about the eigenvalues.
    """
    area = None if operator.areas is None else operator.areas.sum() / SPHERE - 1.0
    errors = [area, *sphere_errors(operator)]
    began = time.perf_counter()
    modes = operator.eigenpairs(MODES)
    seconds = time.perf_counter() - began
    off = np.abs(modes.eigenvalues[1:] / sphere_eigenvalues(MODES)[1:] - 1.0)
    errors += [off.mean(), off.max()]
    odd = {"complex": modes.complex, "negative": modes.negative}
    return errors, seconds, ", ".join(f"{count} {kind}" for kind, count in odd.items() if count)


def rows(count=8000, names=()):
    """Yield a row per sampling and method, with the earlier figure in brackets where there is one."""
    for sampling, sample in SAMPLINGS.items():
        points = sample(count)
        triangles = sphere_triangles(points)
        for name in names or METHODS:
            operator = build(name, points, triangles)
            errors, seconds, note = figures(operator)
            reference = REFERENCE.get((name, sampling), (None,) * 6) if count == 8000 else (None,) * 6
            cells = [
                "-" if error is None else f"{error:.1e}" + (f" ({before:.1e})" if before is not None else "")
                for error, before in zip(errors, reference, strict=True)
            ]
            cells[-1] += f"; {note}" if note else ""
            label = METHODS[name].label
            yield [label, f"{sampling}, {count:,}", f"{operator.seconds:.2f}", *cells, f"{seconds:.2f}"]


def check():
    """Measure all methods on even and on random spheres."""
    return Table(
        "Peers on spheres",
        HEADER,
        list(rows()),
        "Relative errors, l2 of functions; in brackets those of an earlier measurement with other implementations.",
    )


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 8000
    for row in [HEADER, ["---"] * len(HEADER)]:
        print("| " + " | ".join(row) + " |")
    for row in rows(count, sys.argv[2:]):
        print("| " + " | ".join(row) + " |", flush=True)
