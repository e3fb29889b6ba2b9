"""How often clouds are aligned, beside Open3D, if that is installed.

    MESHFREE_ZOO=folder python -m benchmarks.alignment [cases [overlap]]

Two samples of one shape that share no point, each cut by a plane, with noise and outliers; one is turned by 10 degrees
and moved by a tenth of its size. The table of all 200 cases goes to docs/alignment.md.
"""

import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import core

from .real_shapes import normals_of, random_points, shapes, triangle_areas
from .tables import Table

CHOSEN_ON = ("rocker-arm", "cat", "arm", "cheburashka", "screwdriver", "fandisk")
COUNT = 14_000  # points of a whole shape, of which each cloud has 10,000
NOISE, OUTLIERS, OVERLAP = 0.3, 0.05, 0.6
TURN, SHIFT = np.radians(10.0), 0.1
DEGREES, SPACINGS = 0.2, 0.2  # errors within which a cloud is aligned
DOCUMENT = Path(__file__).parents[1] / "docs" / "alignment.md"
ABOUT = """\
Pairs of clouds of 10,000 points each, sampled at random and apart from each other from the shapes of [real
shapes](real_shapes.md), with noise of 0.3 spacings along the normals and 5 % of outliers in a box around. Each is cut
by a plane so that it has 60 % of its points in common with the other. One is turned by 10 degrees about a random axis
through its center, and moved by a tenth of the shape's bounding diagonal. Aligned: within 0.2 degrees, and 0.2 spacings
(root mean square of the displacements of all its points). Off: how many, by more than a spacing. Told: how many of
these were called not converged, and of the others, how many converged. Open3D's point-to-plane ICP has its Tukey
kernel, normals through 30 neighbors, outliers removed by its statistical filter, and correspondences within 0.2, 0.1
and 0.05 of the diagonal, and at last within 3 spacings, from voxels to all points. The constants were chosen on
rocker-arm, cat, arm, cheburashka, screwdriver and fandisk. Seconds of processor time, all cores together.

Made by `MESHFREE_ZOO=folder python -m benchmarks.alignment`, after `pip install open3d==0.20.0`, which needs libusb;
the shapes are not part of the project.
"""


class Case(NamedTuple):
    """A cloud that is off, the one that it belongs on, the matrix that brings it there, and the spacing."""

    points: np.ndarray
    target: np.ndarray
    matrix: np.ndarray
    spacing: float


def random_direction(rng):
    """A unit vector of any direction."""
    direction = rng.standard_normal(3)
    return direction / np.linalg.norm(direction)


def turned(axis, angle):
    """Rotation about a unit vector, (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def part(vertices, faces, direction, span, seed, count=COUNT):
    """Points between two heights along a direction, with noise, and outliers in a box around them."""
    rng = np.random.default_rng(seed)
    points, rows = random_points(vertices, faces, count, seed)
    normals = normals_of(vertices, faces[rows])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = points + NOISE * spacing_of(vertices, faces, count) * rng.standard_normal(count)[:, None] * normals
    height = points @ direction
    points = points[(height >= span[0]) & (height <= span[1])]
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.2 * (high - low)
    return np.concatenate([points, rng.uniform(low - margin, high + margin, (int(OUTLIERS * len(points)), 3))])


def spacing_of(vertices, faces, count=COUNT):
    """Side of the square that a point has for itself."""
    return np.sqrt(triangle_areas(vertices, faces).sum() / count)


def case(vertices, faces, seed, *, overlap=OVERLAP, turn=TURN, shift=SHIFT, count=COUNT, scale=1.0):
    """Make a pair of clouds that share a part."""
    rng = np.random.default_rng([seed, 1])
    direction = random_direction(rng)
    heights = random_points(vertices, faces, 20_000, seed + 7)[0] @ direction
    low, high = np.quantile(heights, [1.0 - 1.0 / (2.0 - overlap), 1.0 / (2.0 - overlap)])
    target = part(vertices, faces, direction, (low, np.inf), 2 * seed + 100_000, count)
    placed = part(vertices, faces, direction, (-np.inf, high), 2 * seed + 100_001, count)
    center, size = placed.mean(axis=0), np.linalg.norm(np.ptp(vertices, axis=0))
    back = np.eye(4)
    linear, moved = turned(random_direction(rng), turn), shift * size * random_direction(rng)
    back[:3, :3] = linear.T / scale
    back[:3, 3] = center - back[:3, :3] @ (center + moved)
    return Case(scale * (placed - center) @ linear.T + center + moved, target, back, spacing_of(vertices, faces, count))


def errors(found, case):
    """Angle between two rotations in degrees, and root mean square displacement in spacings."""
    rotations = [matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3])) for matrix in (found, case.matrix)]
    angle = 2.0 * np.arcsin(min(1.0, np.linalg.norm(rotations[0] - rotations[1]) / np.sqrt(8.0)))
    apart = case.points @ (found - case.matrix)[:3, :3].T + (found - case.matrix)[:3, 3]
    return np.degrees(angle), np.sqrt(np.mean(np.sum(apart**2, axis=1))) / case.spacing


def aligned(found, case):
    """Whether a matrix is within the target."""
    degrees, spacings = errors(found, case)
    return degrees <= DEGREES and spacings <= SPACINGS


def open3d():
    """Return Open3D, or None where it is not installed."""
    try:
        import open3d as module
    except ImportError:
        return None
    return module


def align_with_open3d(o3d, case):
    """Point-to-plane ICP with Tukey's kernel, from coarse to fine."""

    def cloud(points, voxel):
        made = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        made = made.voxel_down_sample(voxel) if voxel else made
        made = made.remove_statistical_outlier(20, 2.0)[0]
        made.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
        return made

    icp, spacing = o3d.pipelines.registration, case.spacing
    size = np.linalg.norm(np.ptp(case.target, axis=0))
    matrix = np.eye(4)
    for reach, voxel in ((0.2 * size, 4.0 * spacing), (0.1 * size, 2.0 * spacing), (0.05 * size, 0), (3 * spacing, 0)):
        kernel = icp.TransformationEstimationPointToPlane(icp.TukeyLoss(max(0.5 * reach, spacing)))
        rounds = icp.ICPConvergenceCriteria(1e-9, 1e-9, 100)
        clouds = cloud(case.points, voxel), cloud(case.target, voxel)
        matrix = icp.registration_icp(*clouds, reach, matrix, kernel, rounds).transformation
    return np.asarray(matrix)


def measure(vertices, faces, seeds, report=lambda text: None, share=1.0):
    """Return errors, what was told and seconds of each case, and the errors of Open3D."""
    peer, rows = open3d(), []
    for seed in seeds:
        made = case(vertices, faces, seed)
        began = time.process_time()
        found = core.measure.align(made.points, made.target, overlap=share)
        seconds = time.process_time() - began
        theirs = errors(align_with_open3d(peer, made), made) if peer else (np.nan, np.nan)
        rows.append([*errors(found.matrix, made), found.converged, seconds, *theirs])
        report(" ".join(f"{value:.3f}" for value in rows[-1]))
    return np.array(rows, dtype=float)


def row_of(name, rows):
    """A row of the table."""
    right, theirs = ((rows[:, k] <= DEGREES) & (rows[:, k + 1] <= SPACINGS) for k in (0, 4))
    wrong, far, told = rows[:, 1] > 1.0, rows[:, 5] > 1.0, rows[:, 2] == 1.0
    near = rows[~wrong]
    return [
        name,
        str(len(rows)),
        f"{right.mean():.0%}",
        str(np.count_nonzero(wrong)),
        *(
            ["not installed"] * 2
            if np.isnan(rows[:, 4]).all()
            else [f"{theirs.mean():.0%}", str(np.count_nonzero(far))]
        ),
        f"{np.median(near[:, 0]):.3f}",
        f"{np.median(near[:, 1]):.3f}",
        f"{np.count_nonzero(wrong & ~told)} of {np.count_nonzero(wrong)}",
        f"{np.count_nonzero(~wrong & told)} of {np.count_nonzero(~wrong)}",
        f"{np.median(rows[:, 3]):.1f}",
    ]


def alignment(count=200, share=1.0):
    """Measure so many cases over all shapes; return the table."""
    found, every = shapes(), {}
    for number, (name, (vertices, faces, _)) in enumerate(found.items()):
        seeds = range(number, count, len(found))
        every[name] = measure(vertices, faces, seeds, lambda text, name=name: print(name, text, flush=True), share)
    rows = [row_of(name, values) for name, values in every.items()]
    chosen = np.concatenate([every[name] for name in CHOSEN_ON])
    others = np.concatenate([values for name, values in every.items() if name not in CHOSEN_ON])
    rows += [row_of("all that constants were chosen on", chosen), row_of("all others", others)]
    rows.append(row_of("all", np.concatenate([chosen, others])))
    header = ["shape", "cases", "aligned", "off", "Open3D: aligned", "off", "degrees, median", "spacings, median"]
    return Table("Alignment", [*header, "failures told", "successes told", "seconds, median"], rows)


if __name__ == "__main__":
    table = alignment(*(kind(text) for kind, text in zip((int, float), sys.argv[1:], strict=False)))
    table.note = ABOUT
    print(table.markdown())
    if len(sys.argv) < 2:
        DOCUMENT.write_text(table.markdown().replace("## ", "# ", 1), encoding="utf-8")
