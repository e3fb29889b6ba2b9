"""Gaussian splats: times, what a bend keeps, and a picture of it: ``python -m benchmarks.splats [FILE.ply]``.

Draws docs/pictures/splats_bar.png by the renderer of the tests. A file of splats is read, written, and read again; with
colors of degree 3 from a field of ours its splats are turned by a handle.
"""

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from matplotlib.image import imsave
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import bar, bent_end, fibonacci_sphere
from core.splats import floating_rows
from core.splats.ellipsoids import quaternions_of
from core.splats.harmonics import harmonics
from tests.splat_renderer import render

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "splats_bar.png"
LENGTH, CELLS = 4.0, 24
FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # to the right, upwards, to the viewer
LARGE = 2_000_000
FOLLOWED = 20_000, 100_000


def splats_on(laplacian, degree=3, seed=3):
    """Return flat splats in the tangent planes of a cloud, that cover it, with colors of a degree."""
    points, normals = laplacian.points, laplacian.normals
    tangent = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    frames = np.stack([tangent, np.cross(normals, tangent), normals], axis=2)
    rng = np.random.default_rng(seed)
    sizes = np.column_stack([rng.uniform(0.5, 0.8, (len(points), 2)), np.full(len(points), 0.05)])
    waves = np.sin(points @ rng.standard_normal((3, 3)) * 4.0)
    rest = np.repeat(0.25 * rng.standard_normal((1, (degree + 1) ** 2 - 1, 3)), len(points), axis=0)
    scales, rotations = np.sqrt(laplacian.areas)[:, None] * sizes, quaternions_of(np.moveaxis(frames, 0, 2))
    return core.splats.Splats(points, scales, rotations, rng.uniform(0.7, 1.0, len(points)), 1.6 * waves, rest)


def bent_bar():
    """Return the splats of a bar, straight and bent by a right angle."""
    points = bar(CELLS, 4 * CELLS)[0]
    laplacian = core.build_laplacian(points)
    reach = 2.5 * LENGTH / (4 * CELLS)
    deformer = core.deform.Deformer(laplacian, points[:, 0] > LENGTH - reach, points[:, 0] < reach)
    moved = deformer.solve(bent_end(points[deformer.handles], 0.5 * np.pi))
    splats = splats_on(laplacian)
    return splats, splats.deformed(moved, deformer.gradients(moved))


def draw(before, after):
    """Draw the bar, straight and bent."""
    camera = FRONT @ Rotation.from_euler("zx", [25.0, 20.0], degrees=True).as_matrix()
    shown = (before, [2.0, 0.0, 0.0]), (after, [1.3, 0.0, 1.2])
    pictures = [render(splats, camera, middle, 4.8, (300, 360)) for splats, middle in shown]
    imsave(PICTURE, np.clip(np.hstack(pictures), 0.0, 1.0))


def timed(name, function, times=3):
    """Print the least time that a function takes, and return what it does."""
    took = []
    for _ in range(times):
        began = perf_counter()
        result = function()
        took.append(perf_counter() - began)
    print(f"{name:60} {1e3 * min(took):8.0f} ms", flush=True)
    return result


def follow(count):
    """Time what a drag of splats on a sphere computes."""
    points = fibonacci_sphere(count)
    laplacian = core.build_laplacian(points)
    splats = splats_on(laplacian)
    quick = replace(splats, harmonics=splats.harmonics[:, :0])
    z = points[:, 2]
    deformer = core.deform.coarse_deformer(laplacian, z > 0.8, z < -0.8)
    goal = points[deformer.handles] + [0.1, 0.0, 0.5]
    moved = timed(f"{count:,} splats: points", lambda: deformer.solve(goal, steps=1))
    gradients = timed(f"{count:,} splats: gradients", lambda: deformer.gradients(moved))
    timed(f"{count:,} splats: sizes and rotations", lambda: quick.deformed(moved, gradients))
    timed(f"{count:,} splats: with harmonics of degree 3", lambda: splats.deformed(moved, gradients))


def with_field(splats, degree=3):
    """Return splats with colors that depend on the direction of view, smoothly from place to place."""
    rng, count = np.random.default_rng(5), (degree + 1) ** 2 - 1
    places = (splats.positions - splats.positions.mean(axis=0)) / splats.positions.std()
    waves = np.sin(places @ rng.standard_normal((3, 3 * count)) + rng.uniform(0.0, 6.0, 3 * count))
    return replace(splats, harmonics=0.2 * waves.reshape(-1, count, 3).astype(np.float32), file=None)


def turn_rigidly(splats):
    """Print what is left of exactness where handles of trained splats are turned, and how long a drag of them takes."""
    points = splats.positions.astype(np.float64)
    laplacian = timed(
        "operator, floaters left out", lambda: core.build_laplacian(points, left_out=floating_rows(splats)), 1
    )
    along = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0] @ points.T
    deformer = timed("binding", lambda: core.deform.coarse_deformer(laplacian, along > np.quantile(along, 0.95)), 1)
    turn, shift = Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix(), np.array([1.0, 2.0, 3.0])
    goal = points[deformer.handles] @ turn.T + shift
    moved = timed("points of a quick result", lambda: deformer.solve(goal, steps=1))
    gradients = timed("gradients", lambda: deformer.gradients(moved))
    quick = replace(splats, harmonics=splats.harmonics[:, :0])
    timed("sizes and rotations", lambda: quick.deformed(moved, gradients))
    found = timed("with harmonics", lambda: splats.deformed(moved, gradients))
    components = laplacian.component[deformer.handles]
    held = np.flatnonzero(np.isin(laplacian.component, components[components >= 0]))
    print(f"{len(held):,} of {len(splats):,} splats are of a surface with a handle; of these at most off:")
    wanted = turn @ splats.covariances @ turn.T
    size = np.abs(wanted).max(axis=(1, 2))
    ways = np.random.default_rng(2).standard_normal((200, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    count, off = splats.harmonics.shape[1], 0.0
    for part in np.array_split(held, 20):
        now = np.einsum("dk,nkc->ndc", harmonics(ways, count), found.harmonics[part])
        before = np.einsum("dk,nkc->ndc", harmonics(ways @ turn, count), splats.harmonics[part])
        off = max(off, np.abs(now - before).max())
    print(f"places {np.abs(moved - points @ turn.T - shift)[held].max():.1e}")
    print(f"covariances {(np.abs(found.covariances - wanted).max(axis=(1, 2)) / size)[held].max():.1e} of their size")
    print(f"colors in 200 directions {off:.1e}")


def compare_normals(count=8000):
    """Print what shortest axes, off by an angle, are worth as normals of the operator on the unit sphere."""
    rng = np.random.default_rng(0)
    sphere = rng.standard_normal((count, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    spacing, exact = np.sqrt(4.0 * np.pi / count), np.repeat([2.0, 6.0, 12.0], [3, 5, 7])
    for noise in 0.0, 0.1, 0.3:
        points = sphere * (1.0 + noise * spacing * rng.standard_normal((count, 1)))
        for angle in None, 2.0, 10.0, 25.0:
            off = 0.0 if angle is None else np.tan(np.radians(angle)) * np.sqrt(0.5)
            axes = None if angle is None else sphere + off * rng.standard_normal((count, 3))
            laplacian = core.build_laplacian(points, axes)
            area = abs(laplacian.areas.sum() / (4.0 * np.pi) - 1.0)
            modes = np.abs(laplacian.eigenpairs(16).eigenvalues[1:] / exact - 1.0).mean()
            name = "own normals" if angle is None else f"axes off by {angle:.0f} degrees"
            print(f"noise of {noise} spacings, {name:24} area {area:.1e}, 15 eigenvalues {modes:.1e} off", flush=True)


def main():
    """Measure and draw."""
    compare_normals()
    before, after = bent_bar()
    for name, volume in (
        ("ellipses", lambda each: np.sort(each.scales, axis=1)[:, 1:].prod(axis=1).sum()),
        ("ellipsoids", lambda each: each.scales.prod(axis=1).sum()),
    ):
        print(f"volume of {name} after a bend by 90 degrees: {100 * (volume(after) / volume(before) - 1):+.2f} %")
    draw(before, after)
    for count in FOLLOWED:
        follow(count)
    points = np.random.default_rng(0).standard_normal((LARGE, 3))
    ones = np.ones(LARGE)
    many = core.splats.Splats(
        points, np.exp(points), np.tile([1.0, 0, 0, 0], (LARGE, 1)), 0.5 * ones, points, np.zeros((LARGE, 15, 3))
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "many.ply"
        timed(f"{LARGE:,} splats of degree 3: write", lambda: core.splats.write_splats(path, many), 1)
        timed(f"{LARGE:,} splats of degree 3: read", lambda: core.splats.read_splats(path), 1)
        for name in sys.argv[1:]:
            splats = timed(f"{Path(name).name}: read", lambda name=name: core.splats.read_splats(name))
            timed(f"{Path(name).name}: write", lambda splats=splats: core.splats.write_splats(path, splats))
            print(f"{Path(name).name}: bit for bit the same: {path.read_bytes() == Path(name).read_bytes()}")
            colored = with_field(splats)
            core.splats.write_splats(path, colored)
            again = core.splats.read_splats(path)
            same = all((getattr(again, each) == getattr(colored, each)).all() for each in ("positions", "harmonics"))
            print(f"with a field of degree 3: places and harmonics come back the same: {same}")
            turn_rigidly(colored)


if __name__ == "__main__":
    main()
