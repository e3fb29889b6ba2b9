"""Smoothing, fairing and signatures beside their targets; the armadillo takes many minutes."""

import time
from pathlib import Path

import numpy as np
from scipy.special import sph_harm_y

import core

from .accuracy import SPHERE, relative
from .samplings import fibonacci_sphere, open_cylinder, random_sphere, sphere_eigenvalues
from .speed import SCANS, read_ply
from .targets import Goal, judge, percent

COUNT = 8000
LEVEL = 0.03  # of the noise, as a share of the radius
HEIGHT = 0.1
MODES = 100
FALL = Goal("fall of the RMS distance, times", 5.0, "{:.2f}", least=True)


def harmonic(degree, order, points):
    """Return the real spherical harmonic of unit norm that follows the cosine of the longitude, (n,)."""
    around = np.arctan2(points[:, 1], points[:, 0])
    values = sph_harm_y(degree, order, np.arccos(np.clip(points[:, 2], -1.0, 1.0)), around).real
    return values * np.sqrt(2.0) if order else values


def noisy_shape(bumpy, seed=0):
    """Return the Fibonacci sphere, with bumps or not, with Gaussian noise of its radius, and the noise."""
    directions = fibonacci_sphere(COUNT)
    noise = LEVEL * np.random.default_rng(seed).standard_normal(COUNT)
    radius = 1.0 + bumpy * HEIGHT * harmonic(6, 3, directions) + noise
    return radius[:, None] * directions, noise


def exact_area(bumpy):
    """Return the area of r = 1 + c Y by quadrature over the longitude and the cosine of the latitude."""
    z, weights = np.polynomial.legendre.leggauss(200)
    around = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    theta, around = np.meshgrid(np.arccos(z), around, indexing="ij")
    step = 1e-5

    def radius(theta, around):
        return 1.0 + bumpy * HEIGHT * np.sqrt(2.0) * sph_harm_y(6, 3, theta, around).real

    r = radius(theta, around)
    by_theta = (radius(theta + step, around) - radius(theta - step, around)) / (2.0 * step)
    by_around = (radius(theta, around + step) - radius(theta, around - step)) / (2.0 * step) / np.sin(theta)
    return 2.0 * np.pi / 400 * np.sum(weights[:, None] * r * np.sqrt(r**2 + by_theta**2 + by_around**2))


def methods():
    """Yield the names of the ways to smooth, and functions of the operator."""
    yield f"{MODES} modes", lambda laplacian: core.clean.smooth_points(laplacian, MODES)
    yield "fairing", core.clean.fair_points
    yield "band 0 to 110", lambda laplacian: core.clean.smooth_points(laplacian, core.clean.band(0.0, 110.0))
    for keep in (None, "area", "volume"):
        text = f"exponential, {keep or 'nothing'} kept"
        yield (
            text,
            lambda laplacian, keep=keep: core.clean.smooth_points(laplacian, core.clean.exponential(0.004), keep=keep),
        )


def harmonics():
    """Y_3^0 and Y_5^4 from the modes of a sphere."""
    for name, points in (("Fibonacci", fibonacci_sphere(COUNT)), ("random", random_sphere(COUNT))):
        laplacian = core.build_laplacian(points)
        spectrum = laplacian.eigenpairs(36)

        def measure(degree, order, points=points, laplacian=laplacian, spectrum=spectrum):
            values = harmonic(degree, order, points)
            space = spectrum.eigenvectors[:, degree**2 : (degree + 1) ** 2]
            yield relative(space @ (space.T @ (laplacian.areas * values)), values)

        for degree, order in ((3, 0), (5, 4)):
            goals = [Goal("projected on its eigenspace, relative l2", 1e-2)]
            yield from judge(f"Y_{degree}^{order}, sphere, {COUNT:,} {name}", goals, measure(degree, order))


def shape(bumpy):
    """Noise of 3 % on a sphere, with bumps or not."""
    points, noise = noisy_shape(bumpy)
    laplacian = core.build_laplacian(points)
    exact = exact_area(bumpy)

    def measure(method):
        began = time.perf_counter()
        found = method(laplacian)
        seconds = time.perf_counter() - began
        radius = np.linalg.norm(found, axis=1)
        bumps = HEIGHT * harmonic(6, 3, found / radius[:, None])
        yield np.sqrt(np.mean(noise**2) / np.mean((radius - 1.0 - bumpy * bumps) ** 2))
        if bumpy:
            yield (radius - radius.mean()) @ bumps / (bumps @ bumps)
        yield core.build_laplacian(found).areas.sum() / exact - 1.0
        if not bumpy:
            yield np.mean(radius**2) - 1.0
        yield seconds

    for name, method in methods():
        target = not name.startswith("exponential")
        goals = [FALL if target else Goal(FALL.figure, form=FALL.form)]
        if bumpy:
            goals.append(Goal("height of the bumps left", 0.9 if target else None, "{:.3f}", least=True))
        bound = 1.0 if target or "area" in name else None
        goals.append(percent("area by a new operator", bound))
        if not bumpy:
            goals.append(percent("area by the mean squared radius", bound))
        goals.append(Goal("seconds", form="{:.2f}"))
        yield from judge(f"{'bumpy ' if bumpy else ''}sphere, {COUNT:,}, 3 % noise: {name}", goals, measure(method))


def boundary():
    """Noise on a cylinder with two boundaries that stay, away from them and near them."""
    points = open_cylinder()
    noise = LEVEL * 2.0 * np.random.default_rng(0).standard_normal(len(points))
    noise[np.abs(points[:, 2]) > 0.999] = 0.0
    outward = points * [0.5, 0.5, 0.0]

    def measure():
        laplacian = core.build_laplacian(points + noise[:, None] * outward)
        found = core.clean.fair_points(laplacian, dirichlet=True)
        error = np.linalg.norm(found[:, :2], axis=1) - 2.0
        for rows in (~laplacian.near_boundary, laplacian.near_boundary & ~laplacian.boundary):
            yield np.sqrt(np.mean(noise[rows] ** 2) / np.mean(error[rows] ** 2))
        yield np.abs(found - laplacian.points)[laplacian.boundary].max()
        yield np.count_nonzero(laplacian.boundary)

    goals = [
        Goal("fall of the RMS distance far from the boundaries, times", form="{:.2f}"),
        Goal("near them", form="{:.2f}"),
        Goal("largest move of a boundary point", 0.0),
        Goal("points on the boundaries, of 392", form="{:d}"),
    ]
    yield from judge("open cylinder, 196 x 40, 3 % noise: fairing, boundaries stay", goals, measure())


def signatures():
    """Signatures on the sphere, where all points have the same known one."""
    for name, points in (("Fibonacci", fibonacci_sphere(COUNT)), ("random", random_sphere(COUNT))):

        def measure(points=points):
            spectrum = core.build_laplacian(points).eigenpairs(121)
            times = core.spectral.signature_times(spectrum, 20)
            exact = np.exp(-np.outer(times, sphere_eigenvalues(121))).sum(axis=1) / SPHERE
            yield np.abs(core.spectral.heat_kernel_signature(spectrum, times) / exact - 1.0).max()
            yield np.abs(core.spectral.wave_kernel_signature(spectrum, count=20) * SPHERE - 1.0).max()

        goals = [percent("heat, 20 default times, max"), percent("wave, 20 default energies, max")]
        yield from judge(f"signatures, sphere, {COUNT:,} {name}", goals, measure())


def scaling():
    """Cost of a few modes, and of no modes, on a larger cloud."""

    def measure():
        laplacian = core.build_laplacian(random_sphere(40_000))
        for work in (
            lambda: core.clean.smooth_points(laplacian, 10),
            lambda: core.clean.smooth_points(laplacian, 50),
            lambda: core.clean.fair_points(laplacian),
        ):
            began = time.perf_counter()
            work()
            yield time.perf_counter() - began

    goals = [Goal(f"{name}, seconds", form="{:.1f}") for name in ("10 modes", "50 modes", "fairing")]
    yield from judge("sphere, 40,000 random", goals, measure())


def armadillo():
    """The paper's Figure 12: the armadillo from 10, 100 and 1000 modes."""
    path = Path(SCANS) / "armadillo.ply"
    if not (SCANS and path.exists()):
        yield ["armadillo", "reconstruction", f"left out: no {path.name}", "", ""]
        return
    laplacian = core.build_laplacian(read_ply(path))
    points = laplacian.points
    spacing = np.sqrt(laplacian.areas.sum() / len(points))

    def measure(count):
        began = time.perf_counter()
        found = core.clean.smooth_points(laplacian, count)
        seconds = time.perf_counter() - began
        yield np.sqrt(np.mean(np.sum((found - points) ** 2, axis=1))) / spacing
        yield seconds

    for count in (10, 100, 1000):
        goals = [Goal("RMS distance from the scan, spacings", form="{:.2f}"), Goal("seconds", form="{:.0f}")]
        yield from judge(f"armadillo, {count} modes", goals, measure(count))


GROUPS = {
    "harmonics": harmonics,
    "sphere": lambda: shape(False),
    "bumpy": lambda: shape(True),
    "boundary": boundary,
    "signatures": signatures,
    "scaling": scaling,
    "armadillo": armadillo,
}
