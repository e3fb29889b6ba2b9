"""Stray points: how many of those that were added are found, and how many points of the cloud are taken with them.

    MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.strays [sort ...]

The folders are those of `real_shapes` and `awkward`; either may be missing. The tables go to docs/strays.md.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import core
from core.cores import cores

from .real_shapes import noisy_points, random_points, seen_points, shapes
from .tables import Table

DOCUMENT = Path(__file__).parents[1] / "docs" / "strays.md"
SHARES = 0.01, 0.05, 0.1
TUNED = "rocker-arm", "cat", "arm", "cheburashka", "screwdriver", "fandisk"
ABOUT = """\
`mf.clean.stray_points` at its defaults. Stray points are added as a share of the points: *box*, all over 1.2 times the
bounding box; *near*, 2 to 6 spacings off the surface along its normals, to either side; *clumps*, floating heaps of 3
to 29 points, at least 8 spacings from the surface and 12 from each other, as many as there is room for. Marked are
those farther than two spacings from the nearest point of the cloud. Each figure: found share of the marked ones, and
share of the cloud that is taken with them. Alone: share of the cloud that is taken where nothing is added. Constants
were chosen on rocker-arm, cat, arm, cheburashka, screwdriver and fandisk, and checked on some raw clouds; the other
shapes were run with the same ones.

Made by `MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.strays`; the clouds are not part of the project.
"""
ABOUT_RAW = """\
Clouds as scanners give them. They hold stray points of their own: what is taken of poste_france lies more than 26
spacings from the rest, most of it a thousand. Human, man and horse are vertices of meshes, of uneven density, and
parts of Human and brain are nested shells, nearer to each other than strays are to them; tree is hardly a surface.

What is taken wrongly lies together. Of tree these are tips of twigs, up to 34 points each, whose third neighbors are
2.6 times as far as elsewhere, and two parts of 21 and 25 points; half of them have no three neighbors that show a
surface. Of building it is the ground before the wall, 31 points and three groups of 6 to 8, which denser points of
the wall judge; of Human the outer shell where a denser one is next to it, groups of 32 to 108 points. A weaker score
where no surface is shown (4 in place of infinite) would keep a third of those of tree, but find 91 in place of 96 %
of 10 % in its box.
"""


def spacings_and_normals(points):
    """Spacing at each point, by its twelve neighbors, and the normal of the plane through them."""
    distance, index = cKDTree(points).query(points, k=13, workers=cores())
    offset = points[index] - points[index].mean(axis=1, keepdims=True)
    return distance[:, 12] * np.sqrt(np.pi / 12.0), np.linalg.eigh(np.swapaxes(offset, 1, 2) @ offset)[1][:, :, 0]


def in_box(points, share, seed=2):
    """Points all over 1.2 times the bounding box."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.1 * (high - low)
    return np.random.default_rng(seed).uniform(low - margin, high + margin, (int(share * len(points)), 3))


def near(points, share, seed=3):
    """Points off the surface by 2 to 6 spacings."""
    rng = np.random.default_rng(seed)
    spacing, normals = spacings_and_normals(points)
    chosen = rng.choice(len(points), int(share * len(points)), replace=False)
    height = rng.uniform(2.0, 6.0, len(chosen)) * rng.choice([-1.0, 1.0], len(chosen)) * np.median(spacing)
    return points[chosen] + height[:, None] * normals[chosen]


def in_clumps(points, share, seed=4):
    """Floating heaps of 3 to 29 points each."""
    rng = np.random.default_rng(seed)
    spacing = np.median(spacings_and_normals(points)[0])
    centers = in_box(points, 1.0, seed)
    centers = centers[cKDTree(points).query(centers)[0] > 8.0 * spacing]
    first, second = cKDTree(centers).query_pairs(12.0 * spacing, output_type="ndarray").T
    alone = np.ones(len(centers), dtype=bool)
    for one, other in sorted(zip(first, second, strict=True)):  # the earlier one stays
        alone[other] &= not alone[one]
    heaps, count = [np.empty((0, 3))], int(share * len(points))
    for center in centers[alone]:
        size = rng.integers(3, 30)
        heaps.append(center + 0.5 * spacing * size ** (1.0 / 3.0) * rng.normal(size=(size, 3)))
    return np.concatenate(heaps)[:count]


SORTS = {"box": in_box, "near": near, "clumps": in_clumps}


def marked(points, extra):
    """Which of some further points are farther than two spacings from the cloud."""
    distance, nearest = cKDTree(points).query(extra)
    return distance > 2.0 * spacings_and_normals(points)[0][nearest]


def measure(points, sort, share, strictness=1.0):
    """Found share of the marked stray points, and taken share of the cloud."""
    extra = SORTS[sort](points, share)
    extra = extra[marked(points, extra)]
    found = core.clean.stray_points(np.concatenate([points, extra]), strictness=strictness)
    return found[len(points) :].mean() if len(extra) else np.nan, found[: len(points)].mean()


def row_of(name, points, sorts):
    """A row of the table, and its figures."""
    began = time.perf_counter()
    alone = core.clean.stray_points(points).mean()
    seconds = time.perf_counter() - began
    figures = [measure(points, sort, share) for sort in sorts for share in SHARES]
    cells = [f"{found:.1%} / {wrong:.2%}" if np.isfinite(found) else "-" for found, wrong in figures]
    row = [name, f"{len(points):,}", f"{alone:.2%}", *cells, f"{seconds:.1f}"]
    print(" | ".join(row), flush=True)
    return row, figures


def table_of(title, clouds, sorts, note):
    """A table of clouds by name, with the means and the worst in its last row."""
    rows, figures = [], []
    for name, points in clouds:
        row, measured = row_of(name, points, sorts)
        rows.append(row)
        figures.append(measured)
    found, wrong = np.moveaxis(np.array(figures), 2, 0)
    for label, of_found, of_wrong in (("mean", np.nanmean, np.mean), ("worst", np.nanmin, np.max)):
        cells = [f"{of_found(found[:, k]):.1%} / {of_wrong(wrong[:, k]):.2%}" for k in range(found.shape[1])]
        rows.append([label, "", "", *cells, ""])
    header = ["cloud", "n", "alone", *(f"{sort} {share:.0%}" for sort in sorts for share in SHARES), "seconds"]
    return Table(title, header, rows, note)


def zoo():
    """Samplings of the shapes, those that the constants were chosen on last."""
    ordered = sorted(shapes().items(), key=lambda item: item[0] in TUNED)
    for name, (vertices, faces, _) in ordered:
        yield f"{name}{' *' if name in TUNED else ''}", random_points(vertices, faces, 10_000)[0]
    for name, (vertices, faces, _) in ordered[:5]:
        yield f"{name}, seen", seen_points(vertices, faces, 10_000)
        yield f"{name}, noise 0.3", noisy_points(vertices, faces, 10_000, 0.3)


def raw():
    """Raw clouds."""
    for path in sorted(Path(os.environ["MESHFREE_RAW"]).glob("*.npz")):
        with np.load(path) as file:
            yield path.stem, file["points"].astype(np.float64)


def strays(sorts=()):
    """The tables of those clouds that there are."""
    sorts, tables = sorts or list(SORTS), []
    if "MESHFREE_ZOO" in os.environ:
        note = "Shapes with * were tuned to."
        tables.append(table_of("Shapes", zoo(), sorts, note))
    if "MESHFREE_RAW" in os.environ:
        tables.append(table_of("Raw clouds", raw(), sorts, ABOUT_RAW))
    return tables


if __name__ == "__main__":
    tables = strays(sys.argv[1:])
    DOCUMENT.write_text(
        "\n".join(["# Stray points", "", ABOUT, *(table.markdown() for table in tables)]), encoding="utf-8"
    )
