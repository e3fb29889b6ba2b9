"""Figure 8: a Poisson equation on tori."""

import numpy as np

from ..peers import METHODS, build
from ..samplings import torus_low_discrepancy, torus_points, torus_potential
from ..tables import Table, goal
from . import plots
from .clouds import torus_triangles
from .pointwise import COUNTS, cells, label_of


def figure_8():
    """Errors of the solution against the number of points, by sampling and method."""
    rows, panels, goals = [], {}, []
    for sampling, make in {"uniform": torus_low_discrepancy, "random": torus_points}.items():
        found = {}
        for count in COUNTS:
            points = make(count)
            count = len(points)
            triangles = torus_triangles(points)
            source = -points[:, 0] / np.hypot(points[:, 0], points[:, 1])
            exact = torus_potential(points)
            for name in METHODS:
                if name == "ours_paper" and (sampling == "random" or not 3000 < count < 10000):
                    continue
                operator = build(name, points, triangles)
                solution = operator.solve_poisson(source)
                off = solution - exact
                off -= off.mean()  # a constant is free; the exact solution's mean vanishes for the true areas
                norms = np.linalg.norm(off) / np.linalg.norm(exact), np.abs(off).max() / np.abs(exact).max()
                found.setdefault(name, {})[count] = norms
        ratio = min(
            (errors[count][norm] / found["ours"][count][norm], f"{label_of(name)}, {count:,} points")
            for name, errors in found.items()
            if name in ("cotangent", "levy", "pcl")
            for count in errors
            for norm in (0, 1)
        )
        quantity = f"Figure 8: best of COT and PCL over ours, {sampling} torus, at the worst ({ratio[1]})"
        goals.append(goal(quantity, "> 1", f"{ratio[0]:.3g}", ratio[0] > 1.0))
        for norm, which in enumerate(("l2", "max")):
            panels[f"{sampling} torus, {which}"] = {
                name: (list(errors), [pair[norm] for pair in errors.values()]) for name, errors in found.items()
            }
            for name, errors in found.items():
                values = {count: pair[norm] for count, pair in errors.items()}
                rows.append([sampling, which, label_of(name), *cells(values)])
    return Table(
        "Figure 8: Poisson's equation on tori",
        ["torus", "norm", "method", *(f"{count:,}" for count in COUNTS), "order"],
        rows,
        "-Delta u = -x / sqrt(x^2 + y^2) on a torus with radii 1 and 0.4 (the paper gives none), relative errors of u"
        " without its mean, against a solution that is exact to rounding. Triangles: Delaunay in conformal"
        " coordinates.",
        plots=[plots.convergence("figure08", panels)],
        goals=goals,
    )
