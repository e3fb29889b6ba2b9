"""Share of normals on the right side, by method, on shapes whose normals are known and on raw clouds.

    MESHFREE_ZOO=folder python -m benchmarks.orientation zoo
    MESHFREE_SCANS=folder MESHFREE_RAW=folder python -m benchmarks.orientation scans raw

The first folder holds NAME.npz with `vertices` and `faces`, the second NAME.ply of points alone, the third NAME.npz
with `points`, and `faces` where there are any. The tables of the named families are renewed in docs/orientation.md.
Open3D is measured where it is installed (docs/orientation.md names the version), in a process of its own, for `LIMIT`
seconds at most.
"""

import multiprocessing
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import core
from benchmarks.real_shapes import normals_of, random_points, shapes, triangle_areas
from benchmarks.samplings import fibonacci_sphere
from benchmarks.tables import Table
from core.errors import PointCloudError
from core.files import read_points

DOCUMENT = Path(__file__).parents[1] / "docs" / "orientation.md"
COUNT = 4_000  # points of a sampling
LIMIT = 60.0  # seconds for Open3D
NEAR = 30  # neighbors that Open3D is told to take
STEEP = 0.3  # cosine to the true normal below which an estimated one has no side to be on
SOLID = ("cg_kitten", "cg_oni", "ml_brain")  # bodies to be seen from around; faces of ml_brain have no one side
METHODS = ("outside", "winding", "Open3D", "Open3D, own")


@dataclass(frozen=True)
class Case:
    """A cloud and what is known of its sides.

    Attributes
    ----------
    name, cloud : str
        The shape, and how its points were taken.
    points : ndarray, (n, 3)
    truth : ndarray, (n, 3)
        True normals or directions to the outer side; zero where nothing is known.
    closed : bool
        The outer side is to be found; otherwise each connected part may have either.
    viewpoint : ndarray, (3,) or (n, 3), or None
        Where the points were seen from.
    """

    name: str
    cloud: str
    points: np.ndarray
    truth: np.ndarray
    closed: bool = True
    viewpoint: np.ndarray | None = None


def vertex_normals(vertices, faces):
    """Return the unit normals of a mesh at its vertices, weighted by area; zero where there are none."""
    face = normals_of(vertices, faces)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], face)
    return total / np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None]


def seen_from(points, place, spacing):
    """Tell which points are not hidden from a place, (n,) bool.

    Of each bundle of rays, three by three pixels of two spacings, those within two spacings of the nearest are seen.
    """
    offset = points - place
    distance = np.linalg.norm(offset, axis=1)
    axes = np.linalg.svd(np.mean(offset, axis=0)[None])[2]  # the first looks to the middle of the cloud
    along = np.abs(offset @ axes[0])
    pixel = np.floor(offset @ axes[1:].T / along[:, None] * np.median(along) / (2.0 * spacing)).astype(int)
    pixel -= pixel.min(axis=0) - 1
    nearest = np.full(pixel.max(axis=0) + 2, np.inf)
    np.minimum.at(nearest, tuple(pixel.T), distance)
    around = np.stack([np.roll(nearest, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)]).min(axis=0)
    return distance <= around[tuple(pixel.T)] + 2.0 * spacing


def spacing_of(points):
    """Return the median distance between neighbors, by the sixth nearest."""
    return np.median(cKDTree(points).query(points, k=7)[0][:, 6]) * np.sqrt(np.pi / 7.0)


def sighted(points):
    """Return directions to where points are seen from, of 40 places far around, (n, 3); zero where that is unclear."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    reach, spacing = np.linalg.norm(points - middle, axis=1).max(), spacing_of(points)
    total, count = np.zeros_like(points), np.zeros(len(points))
    for place in middle + 4.0 * reach * fibonacci_sphere(40):
        seen = seen_from(points, place, spacing)
        total[seen] += (place - points[seen]) / np.linalg.norm(place - points[seen], axis=1)[:, None]
        count += seen
    clear = (count >= 3) & (np.linalg.norm(total, axis=1) > 0.5 * count)
    return np.where(clear[:, None], total / np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None], 0.0)


def samplings(name, vertices, faces):
    """Yield the cases made of a shape; all but face are closed."""
    rng = np.random.default_rng(0)
    closed = name != "face"
    unit = normals_of(vertices, faces)
    unit /= np.maximum(np.linalg.norm(unit, axis=1), 1e-300)[:, None]
    used = np.unique(faces)
    yield Case(name, "vertices", vertices[used], vertex_normals(vertices, faces)[used], closed)
    points, rows = random_points(vertices, faces, COUNT)
    spacing = np.sqrt(triangle_areas(vertices, faces).sum() / COUNT)
    truth, noise = unit[rows], spacing * rng.standard_normal(points.shape)
    yield Case(name, "random", points, truth, closed)
    for level in (0.25, 0.5):
        yield Case(name, f"noise {level}", points + level * noise, truth, closed)
    height = (points - points.mean(axis=0)) @ [0.5, 0.7, 0.5]
    below = height < np.quantile(height, 0.7)
    yield Case(name, "cut open", (points + 0.25 * noise)[below], truth[below], False)
    away = np.linalg.norm(points - points[np.argmax(height)], axis=1)
    rest = away > np.quantile(away, 0.1)
    yield Case(name, "hole", (points + 0.25 * noise)[rest], truth[rest], closed)
    dense, rows = random_points(vertices, faces, 4 * COUNT, seed=1)
    place = points.mean(axis=0) + 2.0 * np.ptp(points, axis=0).max() * np.array([0.6, 0.48, 0.64])
    facing = np.einsum("ij,ij->i", unit[rows], place - dense) > 0.1 * np.linalg.norm(place - dense, axis=1)
    seen = seen_from(dense, place, 0.5 * spacing) & facing
    shaken = dense + 0.125 * spacing * rng.standard_normal(dense.shape)
    yield Case(name, "one side", shaken[seen], unit[rows[seen]], False, place)


def zoo():
    """Yield the cases of all shapes."""
    for name, (vertices, faces, _) in shapes().items():
        yield from samplings(name, vertices, faces)


def scans():
    """Yield the vertices of scanned models whose faces are not at hand."""
    for path in sorted(Path(os.environ["MESHFREE_SCANS"]).glob("*.ply")):
        points = np.unique(read_points(path).points, axis=0)
        yield Case(path.stem, "scan", points, sighted(points))


def raw():
    """Yield the raw clouds: by their faces, by how they were scanned, or by sight from around."""
    for path in sorted(Path(os.environ["MESHFREE_RAW"]).glob("*.npz")):
        with np.load(path) as kept:
            points, faces = kept["points"].astype(float), kept.get("faces")
        name = path.stem
        up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        if faces is not None and name not in SOLID:
            truth = vertex_normals(points, faces)
            outwards = np.einsum("ij,ij->", points[faces].mean(axis=1) - points.mean(axis=0), normals_of(points, faces))
            yield Case(name, "its faces", points, np.sign(outwards) * truth)  # those of vtk_horse look inwards
        elif name.startswith("lidr_"):  # an aircraft saw the terrain
            yield Case(name, "from above", points, up, False, points + 1e3 * up)
        elif name.startswith("pcl_"):  # a camera stood at the origin
            yield Case(name, "its camera", points, -points, False, np.zeros(3))
        elif name in SOLID:
            yield Case(name, "by sight", points, sighted(points))
        else:
            yield Case(name, "unknown", points, np.zeros_like(points), False)


FAMILIES = {"zoo": zoo, "scans": scans, "raw": raw}


def in_open3d(points, normals):
    """Orient normals by Open3D's consistent tangent planes, by default those of its own; None without Open3D."""
    try:
        import open3d
    except ImportError:
        return None
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    if normals is None:
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEAR))
    else:
        cloud.normals = open3d.utility.Vector3dVector(normals)
    cloud.orient_normals_consistent_tangent_plane(NEAR)
    return np.array(cloud.normals)


class Apart:
    """Runs Open3D in a process of its own, that is ended where it takes too long."""

    def __init__(self):
        self.pool = multiprocessing.get_context("spawn").Pool(1)

    def __call__(self, points, normals):
        """Return normals, or a word on why there are none."""
        began = self.pool.apply_async(in_open3d, (points, normals))
        try:
            found = began.get(LIMIT)
        except multiprocessing.TimeoutError:
            self.close()
            self.__init__()
            return f"> {LIMIT:.0f} s"
        except RuntimeError as error:
            return f"error: {str(error).splitlines()[0][:60]}"
        return "not installed" if found is None else found

    def close(self):
        """End the process."""
        self.pool.terminate()
        self.pool.join()


def parts_of(points):
    """Number the connected parts of a cloud by its 12 nearest neighbors, (n,); and return those pairs."""
    count = len(points)
    near = cKDTree(points).query(points, k=13)[1][:, 1:]
    pairs = np.repeat(np.arange(count), 12), near.ravel()
    return connected_components(sparse.csr_array((np.ones(len(pairs[0])), pairs), shape=(count, count)))[1], pairs


def judge(side, case, judged, part, either):
    """Return the share of judged normals on the true side; with `either`, each part is taken as it fits better."""
    along = np.einsum("ij,ij->i", side, case.truth)[judged]
    if not either:
        return np.mean(along > 0.0)
    right, wrong = (np.bincount(part[judged], which) for which in (along > 0.0, along < 0.0))
    return np.maximum(right, wrong).sum() / len(along)


def torn(side, pairs):
    """Return the share of pairs of neighbors whose normals disagree."""
    first, second = pairs
    return np.mean(np.einsum("ij,ij->i", side[first], side[second]) < 0.0)


def measure(case, apart):
    """Return by name what each method makes of a case: a share, or a word."""
    estimated = core.estimate_normals(case.points)
    sides = {"outside": estimated}
    began = time.process_time()
    sides["winding"] = core.orient_normals(case.points, estimated)
    result = {"seconds": time.process_time() - began}
    sides["Open3D"], sides["Open3D, own"] = apart(case.points, estimated), apart(case.points, None)
    if case.viewpoint is not None:
        sides["viewpoint"] = core.orient_normals(case.points, estimated, method="viewpoint", viewpoint=case.viewpoint)
    part, pairs = parts_of(case.points)
    taken = (estimated != [0.0, 0.0, 1.0]).any(axis=1)  # points left out as stray have the z axis
    judged = taken & (np.abs(np.einsum("ij,ij->i", estimated, case.truth)) > STEEP)
    result["judged"] = np.mean(judged)
    for name, side in sides.items():
        if isinstance(side, str):
            result[name] = side
        elif judged.any():
            either = name.startswith("Open3D") or (not case.closed and name != "viewpoint")
            result[name] = judge(side, case, judged, part, either)
        else:
            result[name] = torn(side, pairs)
    for name in ("outside", "Open3D"):
        other = sides[name]
        result["as", name] = other if isinstance(other, str) else alike(sides["winding"], other, part)
    return result


def alike(one, other, part):
    """Return the share of points where two choices agree, each part taken as it fits better."""
    along = np.einsum("ij,ij->i", one, other)
    yes, no = (np.bincount(part, which) for which in (along > 0.0, along < 0.0))
    return np.maximum(yes, no).sum() / len(along)


def written(value, digits=1):
    """Write a share, or the word that stands for it."""
    return value if isinstance(value, str) else f"{value:.{digits}%}"


def summary(found):
    """Return the table of means and worst cases of the zoo, by sampling and half of the shapes."""
    names = sorted({case.name for case, _ in found})
    rows = []
    for cloud in dict.fromkeys(case.cloud for case, _ in found):
        for half, chosen in (("first", names[::2]), ("second", names[1::2])):
            results = [result for case, result in found if case.cloud == cloud and case.name in chosen]
            row = [cloud, half]
            for method in (*METHODS, "viewpoint"):
                shares = [result[method] for result in results if not isinstance(result.get(method, ""), str)]
                row.append(f"{np.mean(shares):.1%}, {min(shares):.1%}" if shares else "")
            rows.append(row)
    note = "Mean and worst share of points on the true side, of each half of the eleven shapes: every other by name."
    return Table("Eleven shapes, in short", ["points", "half", *METHODS, "viewpoint"], rows, note)


def known(title, found):
    """Return the table of cases whose true sides are known."""
    rows = []
    for case, result in found:
        shares = [written(result.get(method, "")) for method in (*METHODS, "viewpoint")]
        count = f"{len(case.points):,}"
        rows.append([case.name, case.cloud, count, written(result["judged"], 0), *shares, f"{result['seconds']:.1f}"])
    return Table(title, ["shape", "points", "n", "judged", *METHODS, "viewpoint", "CPU s"], rows)


def unknown(found):
    """Return the table of clouds whose true sides are not known."""
    rows = []
    for case, result in found:
        shares = [written(result[method], 2) for method in METHODS]
        agree = [written(result["as", name]) for name in ("outside", "Open3D")]
        rows.append([case.name, f"{len(case.points):,}", *shares, *agree, f"{result['seconds']:.1f}"])
    note = (
        "Without ground truth: *torn* is the share of pairs of neighbors, twelve of each point, whose normals differ by"
        " more than a right angle, as they also do at edges and leaves; and the share of points where winding agrees"
        " with outside and with Open3D, each connected component with its better sign."
    )
    columns = ["cloud", "n", *(f"{method}: torn" for method in METHODS), "winding as outside", "as Open3D", "CPU s"]
    return Table("Raw clouds of unknown sides", columns, rows, note)


def tables_of(family, found):
    """Return the tables of a family."""
    if family == "zoo":
        return [summary(found), known("Eleven shapes", found)]
    if family == "scans":
        return [known("Scanned models, judged by sight", found)]
    sure, unsure = ([(case, result) for case, result in found if case.truth.any() == yes] for yes in (True, False))
    return [known("Raw clouds", sure), unknown(unsure)]


def main(families):
    """Renew the tables of families in the document."""
    apart, new = Apart(), []
    for family in families:
        found = []
        for case in FAMILIES[family]():
            try:
                found.append((case, measure(case, apart)))
            except PointCloudError as error:
                print(f"{case.name}, {case.cloud}: {error}")
                continue
            print(case.name, case.cloud, *(f"{k}: {written(v)}" for k, v in found[-1][1].items()), sep="; ", flush=True)
        new += tables_of(family, found)
    apart.close()
    about, *parts = DOCUMENT.read_text().split("\n## ")
    kept = {part.partition("\n")[0]: f"## {part.strip()}\n" for part in parts}
    kept.update({table.title: table.markdown() for table in new})
    DOCUMENT.write_text("\n".join([about.strip() + "\n", *kept.values()]))


if __name__ == "__main__":
    main(sys.argv[1:] or FAMILIES)
