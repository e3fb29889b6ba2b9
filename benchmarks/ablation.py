"""What each constant and each correction between the coordinates and the stiffness matrix does.

    MESHFREE_ZOO=folder python -m benchmarks.ablation [constant or correction ...]

The table goes to docs/ablation.md.
"""

import inspect
import itertools
import sys
from pathlib import Path

import numpy as np

import core
from core.geometry import (
    bandwidth,
    boundary,
    cells,
    cloud,
    components,
    distances,
    edges,
    moments,
    nearest,
    noise,
    outliers,
    quadrics,
    rows,
    sheets,
    voids,
)
from core.operator import areas, curvature, images, stiffness, weights

from .real_shapes import (
    MODES,
    eigenvalue_error,
    noisy_points,
    random_points,
    seen_points,
    shapes,
    with_outliers,
)
from .samplings import fibonacci_sphere, random_sphere
from .tables import Table

MODULES = (
    *(
        nearest,
        outliers,
        components,
        quadrics,
        rows,
        sheets,
        noise,
        edges,
        boundary,
        voids,
        cells,
        moments,
        bandwidth,
        distances,
    ),
    *(cloud, areas, weights, images, curvature, stiffness),
)
UNTUNED = {  # why a number is no constant: its names, with the module where others have the same one
    "how much is done at one time": ("_BLOCK", "_SOURCES", "_NEARBY", "areas._MANY", "nearest._MEASURED"),
    "how many neighbors are searched among": ("moments._MORE", "rows._WIDER", "boundary._REACH"),
    "how many points tell the median of all": ("cloud._SAMPLE",),
    "what is lost in rounding": ("_SAME", "_EVEN", "_SMALLEST", "_RIDGE", "_AT_BOUNDARY", "cells._CLOSEST", "NO_AREA"),
    "rounds after which an iteration has long ended": ("moments._STEPS", "edges._ROUNDS"),
    "how many terms or directions there are": ("TERMS", "edges._COEFFICIENTS", "NEXT"),
    "what only a notice or a drawing goes by": ("_NARROW", "bandwidth._STEPS", "cloud._DRAWN", "_TOLD"),
    "what follows from others": ("HOLE",),
    "what the matrix does not go by": ("quadrics._FADING",),
}
DOCUMENT = Path(__file__).parents[1] / "docs" / "ablation.md"
NOTE = """\
The effect of each correction and each constant between the coordinates and the stiffness matrix. Every figure is the
ratio of the error with the change to the error without it, as geometric mean of a group; above 1 the change increases
the error. *Zoo*: 1,200 points of two shapes at random, of one as seen from four viewpoints, of one with noise of 0.3
spacings, and of one with 5 % of outliers. *Awkward*: a sphere whose halves have densities of 30 : 1, a sphere sampled
on circles of latitude, and one with noise of 0.8 spacings. *Smooth*: random and even spheres, one with noise of 0.05
spacings, a hemisphere, and a square of 400 random points. Errors of area and eigenvalues below 0.1 % count as 0.1 %, on
smooth shapes below 0.01 % as 0.01 %. Boundary: number of points wrongly found at a boundary, plus one. So few points
show which constants matter; what they cost or gain on real shapes is in the messages of the commits.

Made by `MESHFREE_ZOO=folder python -m benchmarks.ablation`.
"""
GROUPS = "zoo", "awkward", "smooth"
LEAST = {"area": 1e-3, "eigenvalues": 1e-3, "boundary": 1.0}  # errors below these are none, on smooth shapes a tenth


def constants():
    """Yield the module, name and place in its tuple, if it is one, of every number that somebody chose."""
    untuned = set(itertools.chain(*UNTUNED.values()))
    for module in MODULES:
        for name, value in vars(module).items():
            own = (
                f"\n{name} = " in (source := inspect.getsource(module))
                or f", {name} = " in source
                or f"\n{name}, " in source
            )
            tuned = not {name, f"{module.__name__.rpartition('.')[2]}.{name}"} & untuned
            if name.lstrip("_").isupper() and own and tuned:
                if isinstance(value, int | float):
                    yield module, name, None
                elif isinstance(value, tuple) and all(isinstance(part, int | float) for part in value):
                    yield from ((module, name, place) for place in range(len(value)))


def change(value, factor):
    """A constant larger or smaller; whole numbers by one at least, shares halfway to one at most."""
    if isinstance(value, int):
        return max(round(value * factor), value + 1) if factor > 1.0 else min(round(value * factor), value - 1)
    return value * factor if value * factor < 1.0 or value >= 1.0 else 0.5 * (1.0 + value)


def jump(ratio, count=3000):
    """A sphere whose lower half is denser."""
    many = random_sphere(20 * count, 2)
    dense = round(count * ratio / (1.0 + ratio))
    return np.concatenate([many[many[:, 2] <= 0.0][:dense], many[many[:, 2] > 0.0][: count - dense]])


def globe(rings, sides):
    """Points of a unit sphere on circles of latitude."""
    height, around = np.meshgrid((np.arange(rings) + 0.5) * np.pi / rings, np.arange(sides) * 2.0 * np.pi / sides)
    parts = np.sin(height) * np.cos(around), np.sin(height) * np.sin(around), np.cos(height)
    return np.stack(parts, axis=2).reshape(-1, 3)


def square():
    """Random points of a unit square: all that four corners of a boundary ask for."""
    return np.column_stack([np.random.default_rng(0).random((400, 2)), np.zeros(400)])


def noisy_sphere(noise, count=900):
    """A random sphere with noise of so many spacings."""
    points = random_sphere(count, 3)
    return points * (1.0 + noise * np.sqrt(4.0 * np.pi / count) * np.random.default_rng(1).standard_normal((count, 1)))


def cases():
    """Points, their area, their eigenvalues, and whether they have a boundary, by group and name."""
    zoo = shapes()
    sphere = np.repeat(np.arange(7) * (np.arange(7) + 1.0), 2 * np.arange(7) + 1)[:MODES]
    whole = 4.0 * np.pi
    flat = np.sort((np.pi**2 * (np.arange(12)[:, None] ** 2 + np.arange(12) ** 2)).ravel())[:MODES]
    samplings = {
        "random": lambda v, f: random_points(v, f, 1_200)[0],
        "seen": lambda v, f: seen_points(v, f, 1_200),
        "noise": lambda v, f: noisy_points(v, f, 1_200, 0.3),
        "outliers": lambda v, f: with_outliers(v, f, 1_200, 0.05),
    }
    for name, sampling in (
        *(("rocker-arm", "random"), ("face", "random"), ("rocker-arm", "seen"), ("cat", "noise")),
        ("arm", "outliers"),
    ):
        vertices, faces, exact = zoo[name]
        yield "zoo", f"{name} {sampling}", samplings[sampling](vertices, faces), 1.0, exact, name == "face"
    yield "awkward", "jump", jump(30.0, 1_200), whole, sphere, False
    yield "awkward", "globe", globe(24, 48), whole, sphere, False
    yield "awkward", "much noise", noisy_sphere(0.8), whole, sphere, False
    yield "smooth", "random sphere", random_sphere(1_200), whole, sphere, False
    yield "smooth", "even sphere", fibonacci_sphere(800), whole, sphere, False
    yield "smooth", "little noise", noisy_sphere(0.05), whole, sphere, False
    yield "smooth", "square", square(), 1.0, flat, True
    half = random_sphere(1_800, 1)
    degree = np.repeat(np.arange(12), np.arange(12) + 1)[:MODES]  # l + 1 of the modes of degree l are even in z
    yield "smooth", "half sphere", half[half[:, 2] > 0.0], 0.5 * whole, degree * (degree + 1.0), True


def measure(points, area, exact, has_boundary):
    """Errors of area and eigenvalues, and how many points are wrongly at a boundary."""
    try:
        laplacian = core.build_laplacian(points)
        error = eigenvalue_error(laplacian.eigenpairs(MODES).eigenvalues, exact)[0]
    except core.PointCloudError:
        return {"area": 1.0, "eigenvalues": 1.0, "boundary": 1.0}
    found = laplacian.boundary.sum()
    return {
        "area": abs(laplacian.areas.sum() / area - 1.0),
        "eigenvalues": error,
        "boundary": float(not found) if has_boundary else float(found),
    }


def changes(before, after):
    """Mean factors of the errors of each group, and the worst one of eigenvalues with its case."""

    def factor(case, kind):
        least = LEAST[kind] * (0.1 if case[0] == "smooth" and kind != "boundary" else 1.0)
        return max(after[case][kind], least) / max(before[case][kind], least)

    means = [
        np.exp(np.mean([np.log(factor(case, kind)) for case in before if case[0] == group]))
        for group in GROUPS
        for kind in LEAST
    ]
    worst = max(before, key=lambda case: factor(case, "eigenvalues"))
    return [*(f"{mean:.2f}" for mean in means), f"{factor(worst, 'eigenvalues'):.2f} {worst[1]}"]


def constants_changed(names):
    """Yield every constant that is named a third larger and a quarter smaller: labels, and what to set."""
    for (module, name, place), factor in itertools.product(constants(), (0.75, 4.0 / 3.0)):
        if names and name not in names:
            continue
        value = getattr(module, name)
        one = value if place is None else value[place]
        new = change(one, factor)
        label = f"{module.__name__.split('.')[-1]}.{name}" + ("" if place is None else f"[{place}]")
        changed = new if place is None else (*value[:place], new, *value[place + 1 :])
        yield [label, f"{one:.4g}", f"{new:.4g}"], ((module, name, changed),)


def corrections_off(names):
    """Yield every correction that is named, switched off: labels, and what to set."""

    def plain_arc(squared, left, right, cosine=1.0):
        return squared + (right - left) ** 2 / 12.0

    def even_arc(squared, left, right, cosine=1.0):
        return squared + (right - left) ** 2 * (1.0 / 12.0 + (1.0 - cosine) / 45.0)

    def without_corners(images):
        def changed(*args):
            nearest, second, across = images(*args)
            return [nearest, second, tuple(part[:0] for part in across)]

        return changed

    mirrors = [
        (module, name, without_corners(getattr(images, name)))
        for module in (areas, stiffness)
        for name in ("mirror", "own_images")
    ]
    corrections = {
        "arcs of sixth order": [(module, "arc_squared", plain_arc) for module in (distances, cells, boundary)],
        "arcs of uneven curvature": [(module, "arc_squared", even_arc) for module in (distances, cells, boundary)],
        "Gaussian curvature": [(curvature, "_curved", lambda lengths, *_: np.ones(len(lengths)))],
        "squared slope": [(cloud, "measure_squared_slope", lambda nearest, _: np.zeros(len(nearest.points)))],
        "h that varies": [(areas, "uneven", np.zeros_like), (weights, "uneven", np.zeros_like)],
        "images across corners": mirrors,
        "areas of the kernel": [(areas, "fast_areas", lambda _, __, cell, *more: cell)],
        "areas of the cells": [(areas, "_like_cells", lambda _, values, __: values)],
        "balance of the weights": [(weights, "_ROUNDS", 0)],
        "width of the weights": [(stiffness, "_widths", lambda pairs, *_: pairs.lengths)],
        "outliers": [(cloud, "find_outliers", lambda nearest, *_: np.zeros(len(nearest.points), dtype=bool))],
        "noise": [(cloud, "noise_level", lambda nearest, *misfits: np.zeros(len(nearest.points)))],
        "sheets apart": [(cloud, "separate_sheets", lambda pairs, *_: pairs)],
    }
    for label, changed in corrections.items():
        if not names or label in names:
            yield [label, "on", "off"], changed


def ablation(title, chosen):
    """Change constants or corrections, one at a time."""
    every = list(cases())
    before = {case[:2]: measure(*case[2:]) for case in every}
    rows = []
    for label, changed in chosen:
        as_it_was = [(module, name, getattr(module, name)) for module, name, _ in changed]
        _set(changed)
        after = {case[:2]: measure(*case[2:]) for case in every}
        _set(as_it_was)
        rows.append([*label, *changes(before, after)])
        print(" | ".join(rows[-1]), flush=True)
    header = [kind if at else f"{group}: {kind}" for group in GROUPS for at, kind in enumerate(LEAST)]
    return Table(title, ["constant or correction", "value", "changed", *header, "worst eigenvalues"], rows)


def _set(values):
    for module, name, value in values:
        before = getattr(module, name)
        for user in MODULES:  # others may have imported it, or have one of their own by that name
            if getattr(user, name, None) is before:
                setattr(user, name, value)
    areas._inverse.cache_clear()


def main(names):
    """Change those named and print what it does, or change all and renew the document."""
    tables = [
        ablation("Corrections switched off", corrections_off(names)),
        ablation("Constants a quarter smaller and a third larger", constants_changed(names)),
    ]
    if not names:
        text = "\n".join([f"# Ablation\n\n{NOTE}", *(table.markdown() for table in tables)])
        DOCUMENT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
