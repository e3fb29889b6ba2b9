"""Whether a change of the code left every result what it was: save the results on some scans, compare two such files.

python -m benchmarks.reproduce save RESULTS.npz SCAN.ply ...
python -m benchmarks.reproduce compare BEFORE.npz AFTER.npz
"""

import sys
from pathlib import Path

import numpy as np

import core
from core.files import read_points

TOLERANCE = 1e-10
_PAPER = 12_000  # points up to which the paper's own setting is tried, too
_MODES = 20


def results(points):
    """All that the public calls give for a cloud, by name; stiffness by its products with three functions."""
    size = np.ptp(points, axis=0).max()
    functions = np.column_stack([np.sin(7.0 * points[:, 0] / size), points[:, 1] / size, np.cos(points[:, 2] / size)])
    laplacian = core.build_laplacian(points)
    spectrum = laplacian.eigenpairs(_MODES, raw=True)
    low, high = np.argmin(points[:, 2]), np.argmax(points[:, 2])
    yield "normals", laplacian.normals
    yield "areas", laplacian.areas
    yield "lengths", laplacian.smoothing_lengths
    yield "boundary", laplacian.boundary
    yield "component", laplacian.component
    yield "stiffness", laplacian.stiffness @ functions
    yield "apply", laplacian.apply(functions)
    yield "mean curvature", core.measure.mean_curvature(laplacian)
    yield "gaussian curvature", laplacian.gaussian_curvature
    yield "eigenvalues", laplacian.corrected(spectrum).eigenvalues
    yield "notices", np.array(laplacian.notices)
    yield "estimated areas", core.estimate_areas(points)
    yield "estimated normals", core.estimate_normals(points)
    yield "geodesic", core.distance.geodesic_distance(laplacian, [low])
    yield "harmonic", core.distance.harmonic_field(laplacian, [low, high], [0.0, 1.0])
    yield "Poisson", core.distance.solve_poisson(laplacian, functions[:, 0], [high], [0.0])
    yield "filter", core.clean.spectral_filter(functions, spectrum, laplacian.areas, 10)
    yield "smooth", core.clean.smooth_points(laplacian, 12, spectrum)
    yield "fair", core.clean.fair_points(laplacian, keep="area")
    yield "mode shape", core.clean.displace_by_mode(laplacian, points[:, 0])
    yield "heat signature", core.spectral.heat_kernel_signature(spectrum, count=5)
    yield "wave signature", core.spectral.wave_kernel_signature(spectrum, count=5)
    yield "domains", core.spectral.nodal_domains(laplacian, points[:, 0] - points[:, 0].mean())
    yield "segments", core.spectral.segment(laplacian, laplacian.component.max() + 4)
    yield "grown", core.distance.grow(laplacian, [low], 0.1 * size)
    order = np.argsort(points[:, 2])
    deformer = core.deform.Deformer(laplacian, order[-len(points) // 50 :], order[: len(points) // 20])
    yield "deformed", deformer.solve(points[deformer.handles] + [0.1 * size, 0.0, 0.0])
    if len(points) <= _PAPER:
        paper = core.paper.build_laplacian(points)
        yield "paper's areas", paper.areas
        yield "paper's stiffness", paper.stiffness @ functions


def minimal():
    """The paper's catenoid, from a cylinder."""
    angle, height = np.meshgrid(np.arange(60) * (2.0 * np.pi / 60), np.linspace(-1.0, 1.0, 21))
    points = np.column_stack([2.0 * np.cos(angle.ravel()), 2.0 * np.sin(angle.ravel()), height.ravel()])
    return core.deform.minimal_surface(points, np.abs(points[:, 2]) == 1.0).points


def save(target, *paths):
    """Write the results for some scans, each under its file's name."""
    found = {"cylinder: minimal surface": minimal()}
    for path in map(Path, paths):
        for name, values in results(read_points(path).points):
            found[f"{path.stem}: {name}"] = values
            print(path.stem, name, flush=True)
    np.savez_compressed(target, **found)


def difference(before, after):
    """Largest difference of two arrays as a share of the largest entry; infinite where shapes or kinds differ."""
    if before.shape != after.shape:
        return np.inf
    if np.array_equal(before, after):
        return 0.0
    finite = np.isfinite(before) if before.dtype.kind == "f" else np.zeros(0)
    if not finite.any() or not np.array_equal(finite, np.isfinite(after)):
        return np.inf
    return np.abs(before[finite] - after[finite]).max() / max(np.abs(before[finite]).max(), 1e-300)


def compare(first, second):
    """Print how far two files of results are apart, the worst first; return whether all is within the tolerance."""
    with np.load(first) as before, np.load(second) as after:
        names = sorted({*before.files, *after.files})
        missing = [name for name in names if name not in before.files or name not in after.files]
        apart = {name: difference(before[name], after[name]) for name in names if name not in missing}
    for name in missing:
        print(f"{name:40} in one file only")
    for name, share in sorted(apart.items(), key=lambda item: -item[1]):
        print(f"{name:40} {share:.1e}{'' if share <= TOLERANCE else '  differs'}")
    return not missing and max(apart.values()) <= TOLERANCE


if __name__ == "__main__":
    if sys.argv[1] == "save":
        save(*sys.argv[2:])
    else:
        sys.exit(not compare(*sys.argv[2:]))
