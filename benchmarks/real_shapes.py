"""Real shapes that nobody tuned to: areas and eigenvalues against the meshes that the points were taken from.

    MESHFREE_ZOO=folder python -m benchmarks.real_shapes [sampling ...]

The folder holds NAME.npz with `vertices`, `faces` (total area 1) and `eigenvalues`, the first 21 of the surface. The
table goes to docs/real_shapes.md.
"""

import os
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import core

from .peers.methods import build
from .tables import Table

MODES = 21
DOCUMENT = Path(__file__).parents[1] / "docs" / "real_shapes.md"
ABOUT = """\
Eleven shapes (meshes of area 1, from the data of geometry libraries) in several samplings: the vertices of the mesh,
random points, points seen from four viewpoints with a density that falls with the squared distance, noise along the
normals given in spacings, and outliers in a box around the shape. Each figure is given beside that of the tufted cover
(Sharp and Crane 2020, robust_laplacian) on the same points. Eigenvalues: mean error of the first 20 above the constant
one, against those of the refined mesh. Face is an open surface; the 1,722 vertices of featuretype are those of a
technical drawing, too few for its walls. Boundary: number of points found at a boundary. Zero modes: as many as
components, unless parts are disconnected. Least share: share of the area that the most localized of the first 21 modes
covers, its participation ratio. Doubtful: share of the area with `lb_trust` below one half. The constants were chosen
on rocker-arm, cat, arm, cheburashka, screwdriver and fandisk; the others were run with the same ones. Times are
in docs/scaling.md.

Made by `MESHFREE_ZOO=folder python -m benchmarks.real_shapes`; the shapes are not part of the project.
"""


def shapes():
    """Return vertices, faces and eigenvalues of every shape, by name."""
    folder = os.environ.get("MESHFREE_ZOO")
    if not folder:
        sys.exit("Real shapes are not part of the project: set MESHFREE_ZOO to the folder that holds them")
    found = {}
    for path in sorted(Path(folder).glob("*.npz")):
        with np.load(path) as file:
            found[path.stem] = file["vertices"], file["faces"], file["eigenvalues"]
    return found


def normals_of(vertices, faces):
    """Normals of triangles, as long as twice their areas, (m, 3)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def triangle_areas(vertices, faces):
    """Areas of triangles, (m,)."""
    return 0.5 * np.linalg.norm(normals_of(vertices, faces), axis=1)


def random_points(vertices, faces, count, seed=0, weight=None):
    """Points distributed evenly by chance, or by a weight of each triangle, and the triangle of each."""
    rng = np.random.default_rng(seed)
    share = triangle_areas(vertices, faces) * (1.0 if weight is None else weight)
    rows = rng.choice(len(faces), count, p=share / share.sum())
    u, v = rng.random((2, count))
    flip = u + v > 1.0
    u[flip], v[flip] = 1.0 - u[flip], 1.0 - v[flip]
    a, b, c = (vertices[faces[rows, k]] for k in range(3))
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), rows


def poisson_disc(vertices, faces, count, seed=0):
    """About so many random points, none nearer to another than a share of the mean spacing."""
    points, _ = random_points(vertices, faces, 8 * count, seed)
    reach = 0.75 * np.sqrt(triangle_areas(vertices, faces).sum() / count)
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    first, second = pairs.min(axis=1), pairs.max(axis=1)
    order = np.argsort(second, kind="stable")
    first, second = first[order], second[order]
    start = np.searchsorted(second, np.arange(len(points) + 1))
    kept = np.ones(len(points), dtype=bool)
    for i in range(len(points)):  # each is kept unless an earlier one that is kept lies near
        kept[i] = not kept[first[start[i] : start[i + 1]]].any()
    return points[kept]


def seen_points(vertices, faces, count, seed=0):
    """Points as denser as a scanner is nearer: by 1 / distance^2 from the nearest of four places around."""
    middle = vertices[faces].mean(axis=1)
    center, radius = middle.mean(axis=0), np.linalg.norm(middle - middle.mean(axis=0), axis=1).max()
    places = center + 1.5 * radius * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
    away = np.linalg.norm(middle[:, None] - places, axis=2).min(axis=1)
    return random_points(vertices, faces, count, seed, 1.0 / away**2)[0]


def noisy_points(vertices, faces, count, share, seed=0):
    """Random points with noise of a share of their spacing along the normals."""
    points, rows = random_points(vertices, faces, count, seed)
    normals = normals_of(vertices, faces[rows])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    spacing = np.sqrt(triangle_areas(vertices, faces).sum() / count)
    return points + share * spacing * np.random.default_rng(seed + 1).standard_normal(count)[:, None] * normals


def with_outliers(vertices, faces, count, share, seed=0):
    """Random points, and a share of them more in a box around."""
    points, _ = random_points(vertices, faces, count, seed)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.2 * (high - low)
    extra = np.random.default_rng(seed + 2).uniform(low - margin, high + margin, (int(share * count), 3))
    return np.concatenate([points, extra])


SAMPLINGS = {
    "vertices": lambda v, f: v[np.unique(f)],
    "random 3,000": lambda v, f: random_points(v, f, 3_000)[0],
    "random 10,000": lambda v, f: random_points(v, f, 10_000)[0],
    "random 30,000": lambda v, f: random_points(v, f, 30_000)[0],
    "Poisson disc": lambda v, f: poisson_disc(v, f, 10_000),
    "seen": lambda v, f: seen_points(v, f, 10_000),
    "noise 0.1": lambda v, f: noisy_points(v, f, 10_000, 0.1),
    "noise 0.3": lambda v, f: noisy_points(v, f, 10_000, 0.3),
    "noise 1": lambda v, f: noisy_points(v, f, 10_000, 1.0),
    "outliers 1 %": lambda v, f: with_outliers(v, f, 10_000, 0.01),
    "outliers 5 %": lambda v, f: with_outliers(v, f, 10_000, 0.05),
}


def eigenvalue_error(found, exact):
    """Mean relative error of the eigenvalues above the constant ones, and their mean with its sign."""
    off = found[1:MODES] / exact[1:MODES] - 1.0
    return np.abs(off).mean(), off.mean()


def measure(points, exact):
    """Figures of this project for a cloud of area 1."""
    laplacian = core.build_laplacian(points)
    raw = laplacian.eigenpairs(MODES, raw=True)
    try:
        error, mean = eigenvalue_error(laplacian.corrected(raw).eigenvalues, exact)
    except core.PointCloudError:  # too few modes are resolved
        error, mean = np.nan, np.nan
    return {
        "area": laplacian.areas.sum() - 1.0,
        "eigenvalues": error,
        "signed": mean,
        "boundary": int(laplacian.boundary.sum()),
        "pairs": laplacian.stiffness.nnz / len(points),
        "components": int(laplacian.component.max()) + 1,
        "zero": int(np.sum(raw.eigenvalues < 1e-6 * raw.eigenvalues[-1])),
        "local": 1.0 / (laplacian.areas @ raw.eigenvectors**4).max() / laplacian.areas.sum(),
        "left out": int((laplacian.component < 0).sum()),
        "doubtful": laplacian.areas[laplacian.trust < 0.5].sum() / laplacian.areas.sum(),
    }


def measure_peer(points, exact):
    """Figures of the fair tufted peer."""
    operator = build("tufted", points)
    values = operator.eigenpairs(MODES).eigenvalues
    return {"area": operator.areas.sum() - 1.0, "eigenvalues": eigenvalue_error(values, exact)[0]}


def real_shapes(names=()):
    """Every shape in every sampling that is named, beside the peer."""
    rows = []
    for sampling in names or SAMPLINGS:
        for name, (vertices, faces, exact) in shapes().items():
            points = SAMPLINGS[sampling](vertices, faces)
            ours, peer = measure(points, exact), measure_peer(points, exact)
            rows.append(
                [name, sampling, f"{len(points):,}", f"{ours['area']:+.2%}", f"{peer['area']:+.2%}"]
                + [f"{ours['eigenvalues']:.2%}", f"{peer['eigenvalues']:.2%}", str(ours["boundary"])]
                + [str(ours["components"]), str(ours["zero"]), f"{ours['local']:.1%}"]
                + [str(ours["left out"]), f"{ours['doubtful']:.0%}"]
                + [f"{ours['pairs']:.0f}"]
            )
            print(" | ".join(rows[-1]), flush=True)
    header = ["shape", "points", "n", "area", "peer", "eigenvalues", "peer", "boundary", "components"]
    header += ["zero modes", "least share", "left out"]
    return Table("Real shapes", [*header, "doubtful", "pairs a row"], rows)


if __name__ == "__main__":
    table = real_shapes(sys.argv[1:])
    table.note = ABOUT
    DOCUMENT.write_text(table.markdown().replace("## ", "# ", 1), encoding="utf-8")
