"""Share of normals on the right side, by method, on shapes whose normals are known.

    python -m benchmarks.orientation FOLDER

The folder holds */NAME.npz with `vertices` or `points`, and `faces`. At most 10,000 vertices of each are taken, with
noise, and cut open by a plane that leaves 70 %. Each method orients the same estimated normals; Open3D, where it is
installed, those and those that it estimates itself, judged up to one sign for all, as it knows no outside. 'viewpoint'
is told a place far out along the true normal of each point: what its patches permit. The constants were chosen on the
shapes named in `TUNED`; a * marks the others.
"""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

import core
from core.errors import PointCloudError

TUNED = ("3holes", "cat", "face", "featuretype", "screwdriver")
LEVELS = (0.0, 0.5, 1.0)  # of noise, in spacings
MOST = 10_000  # points of a cloud


def load(path):
    """Return vertices and faces of a mesh; no faces where there are none."""
    with np.load(path) as kept:
        return kept["vertices" if "vertices" in kept else "points"].astype(float), kept.get("faces")


def vertex_normals(vertices, faces):
    """Return the unit normals of a mesh at its vertices, weighted by area, and which vertices have one."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], face)
    length = np.linalg.norm(total, axis=1)
    return total / np.maximum(length, 1e-300)[:, None], length > 0.0


def clouds(vertices, faces, rng):
    """Yield the name, points and true normals of each cloud made of a mesh."""
    truth, has = vertex_normals(vertices, faces)
    few = np.flatnonzero(has)
    if len(few) > MOST:
        few = np.sort(rng.choice(few, MOST, replace=False))
    points, truth = vertices[few], truth[few]
    a, b, c = vertices[faces].transpose(1, 0, 2)
    spacing = np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0 / len(points))
    middle, axis = points.mean(axis=0), np.array([0.5, 0.7, 0.5])
    open_ = (points - middle) @ axis < np.quantile((points - middle) @ axis, 0.7)
    for level in LEVELS:
        moved = points + level * spacing * rng.standard_normal(points.shape) / np.sqrt(3.0)
        yield f"noise {level:g}", moved, truth
        yield f"noise {level:g}, cut open", moved[open_], truth[open_]


def open3d_normals(points, normals=None):
    """Orient normals by Open3D's consistent tangent planes, by default those of its own; None without Open3D."""
    try:
        import open3d
    except ImportError:
        return None
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    if normals is None:
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(30))
    else:
        cloud.normals = open3d.utility.Vector3dVector(normals)
    cloud.orient_normals_consistent_tangent_plane(30)
    return np.asarray(cloud.normals)


def share(side, truth, judged, either):
    """Write the share of normals on the true side; of `either`, whichever of both sides is more often so."""
    if side is None:
        return ""
    right = np.mean(np.einsum("ij,ij->i", side, truth)[judged] > 0.0)
    return f"{max(right, 1.0 - right) if either else right:.1%}"


def main(folder):
    """Print a table of all shapes."""
    print("| shape | cloud | points | outside | winding | Open3D | Open3D, own normals | viewpoint | s |")
    print("| --- | --- | --: | --: | --: | --: | --: | --: | --: |")
    for path in sorted(folder.glob("*/*.npz")):
        vertices, faces = load(path)
        if faces is None:  # no faces, no truth
            continue
        for cloud, points, truth in clouds(vertices, faces, np.random.default_rng(0)):
            try:
                estimated = core.estimate_normals(points)
            except PointCloudError as error:
                print(f"| {path.stem} | {cloud} | {len(points)} | {error} |")
                continue
            judged = np.abs(np.einsum("ij,ij->i", estimated, truth)) > 0.3  # others have no side to be on
            sides = {"outside": estimated}
            began = perf_counter()
            sides["winding"] = core.orient_normals(points, estimated)
            seconds = perf_counter() - began
            sides["Open3D"] = open3d_normals(points, estimated)
            sides["Open3D, own"] = open3d_normals(points)
            far = points + 10.0 * np.ptp(points) * truth
            sides["viewpoint"] = core.orient_normals(points, estimated, method="viewpoint", viewpoint=far)
            shares = [share(side, truth, judged, name.startswith("Open3D")) for name, side in sides.items()]
            mark = "" if path.stem in TUNED else "*"
            print(f"| {path.stem}{mark} | {cloud} | {len(points)} | {' | '.join(shares)} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
