"""Samplings that operators fail on, and clouds as scanners give them: areas, what is found, and what is told.

    MESHFREE_RAW=folder python -m benchmarks.awkward

The folder holds NAME.npz with `points`, and `faces` where the area of a mesh is known. Without it only the samplings
are measured. The tables and the pictures of real shapes go to docs/awkward.md and docs/pictures/results/.
"""

import os
import time
from pathlib import Path

import numpy as np

import core

from .ablation import globe, jump
from .real_shapes import triangle_areas
from .samplings import random_sphere
from .tables import Table

DOCUMENT = Path(__file__).parents[1] / "docs" / "awkward.md"
ABOUT = """\
Area: error against the exact one. Told: whether a notice, or `lb_trust` on more than a fiftieth of the area, reports
the problem. Doubtful: share of the area with `lb_trust` below one half. Made by `python -m benchmarks.awkward`.
"""
ABOUT_RAW = """\
Clouds from the data of CGAL, MeshLab, VTK, PCL and others, which are not part of the project. Where they come with a
mesh, the area is compared with that of its triangles; parts of Human, brain and man are nested shells, and their meshes
have folds. The boundaries of horse and man are gaps in their points, 7 to 15 spacings wide, such as the soles of the
hooves, which their meshes close by large triangles.
"""
SPHERE = 4.0 * np.pi


def _sphere_with(noise=0.0, count=4000):
    rng = np.random.default_rng(1)
    return random_sphere(count) * (1.0 + noise * np.sqrt(SPHERE / count) * rng.standard_normal((count, 1)))


def _box_outliers(share, count=8000):
    low = np.full(3, -1.4)
    extra = np.random.default_rng(2).uniform(low, -low, (int(share * count), 3))
    return np.concatenate([random_sphere(count), extra])


def _near_outliers(share, count=8000):
    rng = np.random.default_rng(3)
    extra = random_sphere(int(share * count), 4)
    return np.concatenate([random_sphere(count), extra * (1.0 + rng.uniform(-0.1, 0.1, (len(extra), 1)))])


def _grid(ratio, jitter=0.0, across=30):
    x, y = np.meshgrid(np.arange(across + 1.0), np.arange(across * ratio + 1.0) / ratio, indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3)
    inside = (points[:, :2] % across != 0.0) * jitter * np.array([1.0, 1.0 / ratio])
    points[:, :2] += inside * np.random.default_rng(0).uniform(-0.5, 0.5, (len(points), 2))
    return points


def _torus_grid(ring, tube, minor=0.4):
    u, v = np.meshgrid(np.arange(ring) * 2.0 * np.pi / ring, np.arange(tube) * 2.0 * np.pi / tube)
    radius = 1.0 + minor * np.cos(v)
    return np.stack([radius * np.cos(u), radius * np.sin(u), minor * np.sin(v)], axis=2).reshape(-1, 3)


def box(sides, count):
    """Return random points on a box from the origin to its sides."""
    sides = np.asarray(sides)
    rng = np.random.default_rng(0)
    face = np.repeat([sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]], 2)
    chosen = rng.choice(6, count, p=face / face.sum())
    points = rng.random((count, 3)) * sides
    points[np.arange(count), chosen // 2] = (chosen % 2) * sides[chosen // 2]
    return points


def _rings(rings=32, sides=900):
    """A street as a turning lidar sees it from 1.7 above: rings, each far from the next."""
    radius = 1.7 / np.tan(np.radians(np.linspace(25.0, 5.0, rings)))
    angle = np.arange(sides) * 2.0 * np.pi / sides
    flat = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([flat.reshape(-1, 2), np.zeros((rings * sides, 1))], axis=1)


def samplings():
    """Yield a label, points, and their exact area."""
    for share in (0.01, 0.05, 0.1, 0.2):
        yield f"sphere, {share:.0%} outliers in a box around", _box_outliers(share), SPHERE
        yield f"sphere, {share:.0%} outliers within 0.1", _near_outliers(share), SPHERE
    for noise in (0.1, 0.3, 0.6, 1.0, 1.5, 3.0):
        yield f"sphere, noise of {noise} spacings", _sphere_with(noise), SPHERE
    for ratio in (9, 30, 100, 300):
        yield f"sphere, density jump {ratio} : 1", jump(ratio, 6000), SPHERE
    yield "plane, grid 1 : 5 jittered", _grid(5, 0.6), 900.0
    yield "plane, grid 1 : 12", _grid(12), 900.0
    yield "plane, grid 1 : 20 jittered", _grid(20, 0.6), 900.0
    for ring, tube in ((170, 30), (250, 20), (60, 24), (30, 170)):
        spacing = sorted((2.0 * np.pi / ring, 0.8 * np.pi / tube))
        label = f"torus, grid {ring} x {tube} (1 : {spacing[1] / spacing[0]:.1f})"
        yield label, _torus_grid(ring, tube), 1.6 * np.pi**2
    yield "sphere, latitude and longitude 60 x 120", globe(60, 120), SPHERE
    for count in (600, 2000, 6000):
        yield f"cube, {count:,} random", box([1.0, 1.0, 1.0], count), 6.0
    yield "bar 1 x 0.03 x 0.03, 6,000 random", box([1.0, 0.03, 0.03], 6000), 0.1218
    sheet = random_sphere(4000)
    gap = 1.0 + 0.5 * np.sqrt(SPHERE / 4000)
    yield "two spheres half a spacing apart", np.concatenate([sheet, gap * sheet]), SPHERE * (1.0 + gap**2)
    inner, outer = 1.7 / np.tan(np.radians([25.0, 5.0]))
    yield "rings of a lidar", _rings(), np.pi * (outer**2 - inner**2)


def measure(label, points, area=None):
    """A row of figures of one cloud."""
    began = time.perf_counter()
    try:
        laplacian = core.build_laplacian(points)
    except core.PointCloudError as error:
        return [label, f"{len(points):,}", "refused", "yes", "", "", "", "", str(error).split(". ")[0]]
    seconds = time.perf_counter() - began
    areas = laplacian.areas
    doubtful = areas[laplacian.trust < 0.5].sum() / areas.sum()
    told = [notice for notice in laplacian.notices if not notice.startswith("Points that lie exactly")]
    return [
        label,
        f"{len(points):,}",
        "" if area is None else f"{areas.sum() / area - 1.0:+.2%}",
        "yes" if told or doubtful > 0.02 else "no",
        f"{doubtful:.0%}",
        str(laplacian.component.max() + 1),
        str(np.count_nonzero(laplacian.component < 0)),
        str(np.count_nonzero(laplacian.boundary)),
        f"{seconds:.1f}",
    ]


def awkward():
    """All samplings."""
    return Table("Awkward samplings", HEADER, [_print(measure(*case)) for case in samplings()], ABOUT)


def raw():
    """All clouds of the folder."""
    rows = []
    for path in sorted(Path(os.environ["MESHFREE_RAW"]).glob("*.npz")):
        with np.load(path) as file:
            points = np.asarray(file["points"], dtype=np.float64)
            area = triangle_areas(points, file["faces"]).sum() if "faces" in file else None
        if len(points) <= LARGEST:
            rows.append(_print(measure(path.stem, points, area)))
    return Table("Raw clouds", HEADER, rows, ABOUT_RAW)


HEADER = ["points", "n", "area", "told", "doubtful", "components", "left out", "boundary", "build s"]
LARGEST = 120_000  # points of a raw cloud that is measured


def _print(row):
    print(" | ".join(row), flush=True)
    return row


if __name__ == "__main__":
    tables = [awkward(), *([raw()] if os.environ.get("MESHFREE_RAW") else [])]
    DOCUMENT.write_text("\n\n".join(table.markdown() for table in tables).replace("## ", "# ", 1), encoding="utf-8")
