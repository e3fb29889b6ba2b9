"""Meshes of real shapes against the meshes that their points were taken from.

    MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.meshes [shape ...]

The folders are those of `benchmarks.real_shapes` and `benchmarks.awkward`. With pymeshlab at hand its screened Poisson
surface stands beside. The table goes to docs/meshing.md.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import core
from core.cores import cores

from .real_shapes import random_points, shapes, triangle_areas
from .tables import Table, print_rows

DOCUMENT = Path(__file__).parents[1] / "docs" / "meshing.md"
TUNED = ("cheburashka", "featuretype", "arm", "cat", "screwdriver", "rocker-arm", "brain", "scannet")
SCANS = ("ml_brain", "icp_bunny_part1", "scannet")
COUNT = 10_000  # random points
SAMPLES = 200_000  # of a surface that distances are measured to
SLIVER = 10.0  # degrees
ABOUT = """\
[Surface from Points](operators/mesh_surface.md) on eleven shapes with known meshes, from their vertices and from 10,000
random points on them, and on raw clouds of scanners, compared with the screened Poisson reconstruction of pymeshlab
2025.7 with the same normals, and with cells no larger than our voxels. Values of the true mesh are in brackets: a mesh
is watertight if it has no open edges where the true mesh has none. Distances are in spacings of the points, the square
root of the median area: the mean, the 95th percentile, and the maximum; from the vertices to the true surface, and from
even samples of the true surface to the mesh. For scans without a mesh, marked *, the distances are those from the
points. Slivers: share of triangles with an angle below 10 degrees, quads divided along their better diagonal. The time
excludes that of the operator; the machine ran other jobs, too.

The rules were developed on cheburashka, featuretype, arm, cat, screwdriver, rocker-arm, brain and scannet; the others,
marked *, were only run. The 1,722 vertices of featuretype lie along the edges of a machine part, with no points between
them, and give hardly any mesh. The mesh of brain has folds and 14 pieces: shells closer to each other than the points
are lost, fewer of them by Poisson.

Made by `MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.meshes`; the shapes are not part of the project.
"""


def as_triangles(vertices, faces):
    """Return quads as triangles, (2 q, 3), each divided along the diagonal that leaves the larger smallest angle."""
    ways = [np.concatenate([faces[:, a], faces[:, b]]) for a, b in (([0, 1, 2], [0, 2, 3]), ([1, 2, 3], [1, 3, 0]))]
    least = [smallest_angles(vertices, way).reshape(2, -1).min(axis=0) for way in ways]
    return np.where(np.tile(least[0] >= least[1], 2)[:, None], *ways)


def smallest_angles(vertices, faces):
    """Return the smallest angle of each triangle in degrees."""
    corners = vertices[faces]
    to, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(to, back), axis=2)
    return np.degrees(np.arctan2(sine, np.einsum("ikc,ikc->ik", to, back))).min(axis=1)


def topology(faces):
    """Return numbers: edges of one face, of more than two, components, and Euler's of (m, k) polygons."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    used = np.unique(faces)
    graph = sparse.coo_array((np.ones(len(edges)), edges.T), shape=(used[-1] + 1,) * 2)
    label = connected_components(graph, directed=False)[1]
    pieces = len(np.unique(label[used]))
    return np.count_nonzero(count == 1), np.count_nonzero(count > 2), pieces, len(used) - len(edges) + len(faces)


def distances(points, vertices, faces):
    """Return the distance of points from the triangles of a surface, (n,), exact but for rare far ones."""
    samples, of = random_points(vertices, faces, SAMPLES)
    samples = np.concatenate([samples, vertices[faces].mean(axis=1)])
    of = np.concatenate([of, np.arange(len(faces))])
    near = of[cKDTree(samples).query(points, k=12, workers=cores())[1]]
    return np.min([_to_triangle(points, vertices[faces[column]]) for column in near.T], axis=0)


def _to_triangle(points, corners):
    """Return the distance of each point from a triangle of its own, (n,)."""
    best = np.full(len(points), np.inf)
    for side in range(3):
        begin, along = corners[:, side], corners[:, (side + 1) % 3] - corners[:, side]
        share = np.einsum("ij,ij->i", points - begin, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        best = np.minimum(best, np.linalg.norm(points - begin - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1))
    one, other, offset = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    normal = np.cross(one, other)
    area = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-300)
    v = np.einsum("ij,ij->i", np.cross(one, offset), normal) / area
    u = np.einsum("ij,ij->i", np.cross(offset, other), normal) / area
    above = np.abs(np.einsum("ij,ij->i", offset, normal)) / np.sqrt(area)
    return np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0), np.minimum(best, above), best)


def ours(laplacian):
    """Return a mesh of the points of an operator as vertices and quads."""
    mesh = core.surface.mesh_surface(laplacian)
    return mesh.vertices, mesh.faces


def poisson(laplacian):
    """Return pymeshlab's screened Poisson surface with the normals of an operator, cells as large as our voxels."""
    try:
        import pymeshlab
    except ImportError:
        return None
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(laplacian.points, v_normals_matrix=laplacian.normals))
    side = 1.1 * np.ptp(laplacian.points, axis=0).max()
    depth = int(np.ceil(np.log2(side / np.sqrt(np.median(laplacian.areas)))))
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=True)
    made = meshes.current_mesh()
    return made.vertex_matrix(), made.face_matrix()


METHODS = {"this project": ours, "screened Poisson": poisson}


def clouds(names=()):
    """Yield the name of a shape, that of the sampling, points, vertices and faces of the true mesh, if there is one."""
    for name, (vertices, faces, _) in shapes().items():
        if not names or name in names:
            yield name, "vertices", vertices[np.unique(faces)], vertices, faces
            yield name, "random", random_points(vertices, faces, COUNT)[0], vertices, faces
    folder = os.environ.get("MESHFREE_RAW")
    for name in SCANS if folder else ():
        label = name.partition("_")[2] or name
        if not names or label in names:
            with np.load(Path(folder) / f"{name}.npz") as file:
                points, faces = file["points"].astype(float), file.get("faces")
            yield label, "scan", points, points, faces


def measure(method, laplacian, vertices, faces):
    """Return a row of figures of the mesh of a method; none if it is not at hand."""
    began = time.process_time()
    try:
        made = METHODS[method](laplacian)
    except core.PointCloudError:
        return ["refused", *[""] * 9]
    seconds = time.process_time() - began
    if made is None:
        return None
    spacing = np.sqrt(np.median(laplacian.areas[laplacian.component >= 0]))
    places, polygons = made
    triangles = as_triangles(places, polygons) if polygons.shape[1] == 4 else polygons
    boundary, crossed, pieces, euler = (str(number) for number in topology(polygons))
    row = [f"{len(polygons):,}", boundary, crossed, pieces, euler]
    if faces is None:
        away = cKDTree(laplacian.points).query(places)[0] / spacing
        back = distances(laplacian.points, places, triangles) / spacing
        row += ["", f"{away.mean():.3f}, {np.percentile(away, 95):.3f} *"]
    else:
        lone, _, parts, number = topology(faces)
        row[1:5] = [f"{found} ({true})" for found, true in zip(row[1:5], (lone, _, parts, number), strict=True)]
        area = triangle_areas(vertices, faces).sum()
        away = distances(places, vertices, faces) / spacing
        back = distances(random_points(vertices, faces, 2 * COUNT, 1)[0], places, triangles) / spacing
        row += [f"{triangle_areas(places, triangles).sum() / area - 1.0:+.2%}"]
        row += [f"{away.mean():.3f}, {np.percentile(away, 95):.3f}, {away.max():.2f}"]
    row += [f"{back.mean():.3f}, {np.percentile(back, 95):.3f}, {back.max():.2f}"]
    row += [f"{np.mean(smallest_angles(places, triangles) < SLIVER):.2%}"]
    return [*row, f"{seconds:.1f}"]


HEADER = ["shape", "points", "n", "method", "faces", "open edges", "edges of > 2 faces", "components", "Euler"]
HEADER += ["area", "vertices to surface", "surface to mesh", "slivers", "CPU s"]


def rows(names=()):
    """Yield the rows of all clouds."""
    for name, sampling, points, vertices, faces in clouds(names):
        laplacian = core.build_laplacian(points)
        for method in METHODS:
            figures = measure(method, laplacian, vertices, faces)
            if figures:
                yield [name + "*" * (name not in TUNED), sampling, f"{len(points):,}", method, *figures]


if __name__ == "__main__":
    found = []
    print_rows(HEADER, {"all": lambda: (found.append(row) or row for row in rows(sys.argv[1:]))}, ())
    if not sys.argv[1:]:
        DOCUMENT.write_text(Table("Meshing", HEADER, found, ABOUT).markdown().replace("## ", "# ", 1), encoding="utf-8")
