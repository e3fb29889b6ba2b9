"""Seconds per stage and memory, and the fast areas against the paper's Algorithm 1."""

import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import core
from core.geometry.cloud import read_cloud
from core.operator.areas import KernelMatrix, fast_areas
from core.paper.areas import constrained_areas, regularized_areas
from core.paper.operator import symmetrized_operator

from .accuracy import relative
from .paper.descent import algorithm_1
from .samplings import random_sphere, sphere_eigenvalues, uneven_sphere
from .tables import Table

SCANS = os.environ.get("MESHFREE_SCANS", "")
ALGORITHM_1_SECONDS = float(os.environ.get("MESHFREE_ALGORITHM_1_SECONDS", "400"))


class Stages:
    """Progress callback that keeps the seconds of each stage."""

    def __init__(self):
        self.seconds = {}
        self._open = None

    def __call__(self, stage, _fraction):
        """Begin a stage."""
        self.close()
        self._open = stage, time.perf_counter()

    def close(self):
        """End the running stage."""
        if self._open:
            stage, began = self._open
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - began
            self._open = None


def measure(source, modes):
    """Analyze a cloud in a process of its own, so that peak memory is its own too."""
    command = [sys.executable, "-m", "benchmarks.speed", source, str(modes)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def run_one(source, modes):
    """What `measure` runs: print seconds per stage and the peak memory as JSON."""
    points = random_sphere(int(source)) if source.isdigit() else read_ply(Path(source))
    stages = Stages()
    laplacian = core.build_laplacian(points, progress=stages)
    stages("Curvature", 0.9)
    core.measure.mean_curvature(laplacian)
    if modes:
        laplacian.eigenpairs(modes, progress=stages)
    stages.close()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(json.dumps({"points": len(points), "seconds": stages.seconds, "gigabytes": peak}))


def read_ply(path):
    """Read the positions of a binary little-endian PLY file with vertices only."""
    kinds = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
    head, body = path.read_bytes().split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    if "format binary_little_endian 1.0" not in lines:
        raise ValueError(f"{path.name} is not a binary little-endian PLY file")
    count = int(next(line for line in lines if line.startswith("element vertex")).split()[-1])
    fields = [(line.split()[2], kinds[line.split()[1]]) for line in lines if line.startswith("property")]
    vertices = np.frombuffer(body, dtype=fields, count=count)
    return np.column_stack([vertices[axis] for axis in "xyz"])


def stages_and_memory():
    """Seconds per stage for growing random spheres, with the exponent of the growth, and for the scans."""
    results = {f"random sphere, {n:,}": measure(str(n), 0) for n in (20_000, 63_000, 200_000)}
    small, large = results["random sphere, 20,000"], results["random sphere, 200,000"]
    for name in ("bunny", "armadillo"):
        path = Path(SCANS) / f"{name}.ply"
        if SCANS and path.exists():
            results[f"{name}, 30 modes"] = measure(str(path), 30)
    stages = ["Neighbors", "Normals", "Areas", "Operator", "Curvature", "Spectrum"]
    rows = []
    for name, result in results.items():
        seconds = result["seconds"]
        rows.append(
            [name, *(f"{seconds[stage]:.2f}" if stage in seconds else "" for stage in stages)]
            + [f"{sum(seconds.values()):.1f}", f"{result['gigabytes']:.2f}"]
        )
    growth = [
        f"n^{np.log10(large['seconds'][stage] / small['seconds'][stage]):.2f}" if stage in large["seconds"] else ""
        for stage in stages
    ]
    total = np.log10(sum(large["seconds"].values()) / sum(small["seconds"].values()))
    rows.append(["growth from 20,000 to 200,000", *growth, f"n^{total:.2f}", ""])
    return Table("Seconds per stage", ["cloud", *stages, "all", "peak GB"], rows, "Each in a process of its own.")


def areas_against_algorithm_1():
    """One run: effect on L x and on the eigenvalues, and the time, of every way to the areas."""
    points = uneven_sphere(12_000)
    default = core.build_laplacian(points)
    default = replace(default, kernel_widths=default.smoothing_lengths)
    cloud = read_cloud(points, core.LaplacianOptions())
    scaled, pairs = cloud.scaled, cloud.pairs
    target = np.ones(len(points))
    x = points[:, 0]
    rows = []

    def judge(name, areas, seconds, steps):
        stiffness = symmetrized_operator(cloud, areas).matrix
        total = scaled.share(areas, 0.0) * scaled.scale**2
        laplacian = replace(default, areas=total, stiffness=stiffness)
        values = laplacian.eigenpairs(36).eigenvalues[1:] / sphere_eigenvalues(36)[1:] - 1.0
        total = laplacian.areas.sum() / (4.0 * np.pi) - 1.0
        misfit = matrix @ areas - target
        rows.append(
            [name, f"{seconds:.2f}", steps, f"{misfit @ misfit + 1e-3 * areas @ areas:.2e}", f"{total:+.1e}"]
            + [f"{relative(laplacian.apply(x), -2.0 * x):.1e}"]
            + [f"{relative(laplacian.apply(x**2), 2.0 - 6.0 * x**2):.1e}"]
            + [f"{np.abs(values).mean():.1e}", f"{np.abs(values).max():.1e}"]
        )

    began = time.perf_counter()
    matrix = KernelMatrix(pairs, pairs.distance, cloud.boundary)
    assembly = time.perf_counter() - began
    density = 1.0 / (matrix @ target)
    judge("density, 1 / (A 1)", density, assembly, "1 product")

    began = time.perf_counter()
    fast = fast_areas(matrix, target, density)
    fast_seconds = time.perf_counter() - began
    judge("fast (default)", fast, fast_seconds, "153 products")

    began = time.perf_counter()
    start = regularized_areas(matrix, target, 1e-3)
    start_seconds = time.perf_counter() - began
    began = time.perf_counter()
    constrained = constrained_areas(matrix, target, 1e-3)
    judge("eq. (8), own solver", constrained.areas, time.perf_counter() - began, f"{constrained.products} products")

    # Algorithm 1 is run in portions so that it can be stopped by the clock; each portion goes on where the last ended.
    steps, seconds, areas, end = 0, start_seconds, start.areas, ""
    while not end:
        began = time.perf_counter()
        result = algorithm_1(matrix, target, areas, steps=500)
        seconds += time.perf_counter() - began
        steps, areas = steps + result.steps, result.areas
        if result.converged or result.stalled:
            end = "converged" if result.converged else "stalled"
        elif seconds > ALGORITHM_1_SECONDS:
            end = f"stopped by the clock at {result.residual:.1e}, to reach 1e-3"
    judge(f"Algorithm 1, {end}", areas, seconds, f"{steps:,} steps")
    rows.append([f"Algorithm 1 / fast: {seconds / fast_seconds:,.0f} times the seconds", *[""] * 8])
    return Table(
        "Area elements: default solver against Algorithm 1",
        ["areas", "seconds", "work", "F of eq. (8)", "total", "L x", "L x^2", "35 eigenvalues, mean", "max"],
        rows,
        "12,000 random points on the unit sphere, density 9:1 between its halves; the same matrix A (local h) for all.",
    )


if __name__ == "__main__":
    run_one(sys.argv[1], int(sys.argv[2]))
