"""Poisson's equation, harmonic fields and geodesic distances."""

import time
from functools import partial
from pathlib import Path

import numpy as np

import core
from core.distance.geodesics import geodesics_of
from core.distance.transport import transport_of

from .accuracy import relative
from .samplings import (
    fibonacci_sphere,
    random_sphere,
    square_grid,
    strip_points,
    torus_low_discrepancy,
    torus_points,
    torus_potential,
)
from .speed import SCANS, read_ply
from .targets import Goal, judge, percent

try:
    import potpourri3d
except ImportError:  # the peer is shown where it is installed
    potpourri3d = None


def poisson():
    """Torus, the right-hand side of the paper's Figure 8: relative l2 error, and the order in the spacing."""
    for name, options, bound, order in (
        ("default", core.LaplacianOptions(), 1e-3, None),
        ("h = d100 / 2", core.LaplacianOptions(bandwidth="local", bandwidth_factor=0.5), 1e-3, 3.0),
    ):
        errors = []

        def measure(points, options=options, errors=errors):
            laplacian = core.build_laplacian(points, options=options)
            exact = torus_potential(points)
            exact -= laplacian.areas @ exact / laplacian.areas.sum()
            found = core.distance.solve_poisson(laplacian, -points[:, 0] / np.hypot(points[:, 0], points[:, 1]))
            errors.append(relative(found, exact))
            yield errors[-1]
            if len(errors) > 1:
                yield np.log2(errors[-2] / errors[-1])

        for count in (2000, 8000, 32_000):
            goals = [Goal("u", bound if count == 8000 else None)]
            if errors:
                goals.append(Goal(f"order, {count // 4:,} to {count:,}", order, "{:.2f}", least=True))
            case = f"Poisson, torus, {count:,} low-discrepancy, {name}"
            yield from judge(case, goals, measure(torus_low_discrepancy(count)))
    points = torus_points(8000)
    default = core.LaplacianOptions()
    yield from judge("Poisson, torus, 8,000 random", [Goal("u", 1e-3)], measure(points, default, []))


def harmonic():
    """Strip of 3 x 1 with 0 and 1 on end bands: largest distance from linear."""

    def measure(points, make):
        laplacian = make(points)
        x = points[:, 0]
        fixed = (x <= 0.25 + 1e-12) | (x >= 2.75 - 1e-12)
        exact = np.clip((x - 0.25) / 2.5, 0.0, 1.0)
        found = core.distance.harmonic_field(laplacian, fixed, exact[fixed])
        yield np.abs(found - exact).max()
        plain = core.distance.solve_poisson(laplacian, 0.0, fixed, exact[fixed])  # not clipped to the range
        yield max(-plain.min(), plain.max() - 1.0, 0.0)

    clouds = {"91 x 31 grid": strip_points()} | {
        f"2,800 random, seed {seed}": strip_points(2800, seed) for seed in range(3)
    }
    uniform = partial(core.paper.build_laplacian, areas="uniform")
    for areas, make, bound in (("fast", core.build_laplacian, 1e-2), ("uniform", uniform, 3e-2)):
        for name, points in clouds.items():
            goals = [Goal("largest error", bound), Goal("outside [0, 1] before clipping", 1e-8)]
            yield from judge(f"strip, {name}, areas {areas}", goals, measure(points, make))


def geodesic():
    """Spheres and a square: mean error over mean distance, beside the same of potpourri3d."""

    def measure(laplacian, sources, exact):
        def error(found):
            return np.abs(found - exact).mean() / exact.mean()

        yield error(core.distance.geodesic_distance(laplacian, sources))
        if potpourri3d is None:
            yield "not installed"
        else:
            solver = potpourri3d.PointCloudHeatSolver(laplacian.points)
            yield error(solver.compute_distance_multisource([int(source) for source in sources]))

    def great_circles(points, sources):
        return np.arccos(np.clip(points @ points[sources].T, -1.0, 1.0)).min(axis=1)

    def straight(points, sources):
        return np.linalg.norm(points[:, None] - points[None, sources], axis=2).min(axis=1)

    for name, points, exact in (
        ("sphere, 8,000 Fibonacci", fibonacci_sphere(8000), great_circles),
        ("sphere, 8,000 random", random_sphere(8000), great_circles),
        ("square, 90 x 90 with boundary", square_grid(90), straight),
    ):
        laplacian = core.build_laplacian(points)
        for label, sources in (("one source", [0]), ("five", np.random.default_rng(0).integers(0, 8000, 5))):
            goals = [percent("distance", 0.4), percent("potpourri3d")]
            yield from judge(f"{name}, {label}", goals, measure(laplacian, sources, exact(points, sources)))


def along():
    """Sphere: directions carried along great circles, and the logarithmic map, beside the same of potpourri3d."""

    def exact(points, normal, source, direction):
        """Return the carried direction, (n, 3), and the logarithmic map, (n, 2), on the unit sphere."""
        first = direction - (direction @ normal) * normal
        first /= np.linalg.norm(first)
        angle = np.arctan2(points @ np.cross(normal, first), points @ first)
        distance = np.arccos(np.clip(points @ points[source], -1.0, 1.0))
        total = points + points[source]
        carried = first - (points @ first / (1.0 + points @ points[source]))[:, None] * total
        return carried, distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])

    def errors(found, place, truth, near):
        cosine = np.clip(np.einsum("ij,ij->i", found, truth[0])[near], -1.0, 1.0)
        yield np.degrees(np.sqrt(np.mean(np.arccos(cosine) ** 2)))
        yield np.sqrt(np.mean(np.sum((place - truth[1])[near] ** 2, axis=1)))

    def measure(points, source=7, direction=(0.3, -0.5, 0.8)):
        direction = np.array(direction)
        near = points @ points[source] > -0.9
        laplacian = core.build_laplacian(points)
        began = time.process_time()
        found = core.distance.transport(laplacian, [source], direction)
        place = core.distance.logarithmic_map(laplacian, source, direction)
        seconds = time.process_time() - began
        yield from errors(found, place, exact(points, laplacian.normals[source], source, direction), near)
        yield seconds
        if potpourri3d is None:
            yield from ["not installed"] * 3
            return
        began = time.process_time()
        solver = potpourri3d.PointCloudHeatSolver(points)
        first, second, normal = solver.get_tangent_frames()
        given = np.array([first[source] @ direction, second[source] @ direction])
        given /= np.linalg.norm(given)
        numbers, place = solver.transport_tangent_vector(source, given), solver.compute_log_map(source)
        seconds = time.process_time() - began
        found = numbers[:, :1] * first + numbers[:, 1:] * second
        found /= np.linalg.norm(found, axis=1)[:, None]
        truth = (
            exact(points, normal[source], source, direction)[0],
            exact(points, normal[source], source, first[source])[1],
        )
        yield from errors(found, place, truth, near)
        yield seconds

    for name, points in (("Fibonacci", fibonacci_sphere(10_000)), ("random", random_sphere(10_000))):
        goals = [
            Goal(f"{whose}{figure}", bound if not whose else None, form)
            for whose in ("", "potpourri3d, ")
            for figure, bound, form in (
                ("direction, degrees", 0.5, "{:.2f}"),
                ("logarithmic map", 1e-2, "{:.4f}"),
                ("seconds of processors", None, "{:.1f}"),
            )
        ]
        yield from judge(f"along the sphere, 10,000 {name}", goals, measure(points))


def along_cost():
    """Seconds of processors, on top of the operator, for all that goes along the surface; potpourri3d beside it."""

    def spend(work, *arguments, **settings):
        began = time.process_time()
        result = work(*arguments, **settings)
        return time.process_time() - began, result

    def own(laplacian, others, curve):
        points = laplacian.points
        yield spend(transport_of, laplacian)[0]
        yield spend(core.distance.transport, laplacian, [7], [0.3, -0.5, 0.8])[0]
        yield spend(core.distance.logarithmic_map, laplacian, 7)[0]
        yield spend(core.distance.logarithmic_map, laplacian, len(points) // 2)[0]
        laplacian.release()
        yield spend(geodesics_of, laplacian)[0]
        yield spend(core.distance.geodesic_distance, laplacian, [7])[0]
        yield spend(core.distance.nearest_source, laplacian, others)[0]
        yield spend(core.distance.signed_distance, laplacian, curve, closed=True)[0]

    def peer(points):
        seconds, solver = spend(potpourri3d.PointCloudHeatSolver, points)
        yield seconds
        yield spend(solver.transport_tangent_vector, 7, [1.0, 0.0])[0]
        yield spend(solver.compute_log_map, 7)[0]
        yield spend(solver.compute_log_map, len(points) // 2)[0]
        yield spend(solver.compute_distance, 7)[0]
        yield spend(solver.compute_distance, len(points) // 2)[0]

    figures = {
        "set-up": 10.0,
        "a direction": 3.0,
        "first map": 3.0,
        "another map": 3.0,
        "lengths": None,
        "distance": None,
        "nearest of 50": None,
        "from a curve of 60": None,
    }
    names = ("set-up", "first direction", "first map", "another map", "first distance", "another distance")
    angle = 2.0 * np.pi * np.arange(60) / 60
    belt = np.column_stack([np.cos(angle), np.sin(angle), np.full(60, 0.3)])
    for count in (20_000, 100_000):
        points = random_sphere(count)
        curve = np.unique([np.argmax(points @ place) for place in belt])
        curve = curve[np.argsort(np.arctan2(points[curve, 1], points[curve, 0]))]
        goals = [Goal(f"{name}, s", bound, "{:.2f}") for name, bound in figures.items()]
        measured = own(core.build_laplacian(points), np.arange(0, count, count // 50), curve)
        yield from judge(f"along the sphere, {count:,} random", goals, measured)
        if potpourri3d is not None:
            goals = [Goal(f"potpourri3d, {name}, s", form="{:.2f}") for name in names]
            yield from judge(f"along the sphere, {count:,} random", goals, peer(points))


def cost():
    """Seconds on a large scan."""
    path = Path(SCANS) / "bunny.ply"
    if not SCANS or not path.exists():
        yield ["bunny", "seconds", "left out: MESHFREE_SCANS names no folder with bunny.ply", "", ""]
        return
    laplacian = core.build_laplacian(read_ply(path))

    def measure():
        began = time.perf_counter()
        distance = core.distance.geodesic_distance(laplacian, [0])
        yield time.perf_counter() - began
        far = distance.max()
        bands = (distance < 0.1 * far) | (distance > 0.9 * far)
        for fixed in (bands, [0, int(np.argmax(distance))]):
            began = time.perf_counter()
            core.distance.harmonic_field(laplacian, fixed, np.round(distance / far)[fixed])
            yield time.perf_counter() - began
        source = distance - laplacian.areas @ distance / laplacian.areas.sum()
        began = time.perf_counter()
        core.distance.solve_poisson(laplacian, source)
        yield time.perf_counter() - began

    figures = ("distance", "harmonic, bands", "harmonic, two points", "Poisson")
    yield from judge(
        f"bunny, {len(laplacian.points):,}", [Goal(f"{name}, s", form="{:.1f}") for name in figures], measure()
    )


GROUPS = {
    "poisson": poisson,
    "harmonic": harmonic,
    "geodesic": geodesic,
    "along": along,
    "along_cost": along_cost,
    "cost": cost,
}
