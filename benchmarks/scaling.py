"""Time and memory of every stage against the number of points, compared with two peers.

    python -m benchmarks.scaling [points ...]

Tables and plots go to docs/scaling.md; without numbers, for 10,000, 100,000 and 1,000,000 random points of a sphere.
The machine should have nothing else to do.
"""

import json
import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

import matplotlib
import numpy as np
import potpourri3d
from scipy.spatial import cKDTree

import core
from core.cores import cores
from core.distance.geodesics import geodesics_of
from core.geometry import cloud
from core.operator import laplacian, stiffness

from .peers.methods import METHODS
from .samplings import random_sphere, sphere_eigenvalues
from .tables import Table

matplotlib.use("Agg")
from matplotlib import pyplot

DOCUMENT = Path(__file__).parents[1] / "docs" / "scaling.md"
PICTURE = "pictures/results/scaling.png"
COUNTS = 10_000, 100_000, 1_000_000
MODES = 50
TOLERANCE = 1e-4  # of their residuals: eigenvalues are right to nine digits then
LARGEST = 100_000  # beyond, the peers and the applications are left out
STAGES = {  # the rest of the build is its surface: outliers, components, quadrics, sheets, noise, cells
    "pairs": [(cloud, "find_pairs"), (cloud, "separate_sheets"), (laplacian, "arc_length")],
    "normals": [(cloud, "orient_by_winding")],
    "areas": [(laplacian, "solve_areas")],
    "weights": [(stiffness, "balance_weights")],
    "matrix": [(laplacian, "assemble_stiffness")],
}


class Watch:
    """Times of named pieces of work, and the most memory that was in use meanwhile."""

    def __init__(self):
        self.seconds, self.gigabytes = {}, {}
        self._open = ["start"]
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self):
        while True:
            used = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e9
            name = self._open[-1]
            self.gigabytes[name] = max(self.gigabytes.get(name, 0.0), used)
            time.sleep(0.01)

    def run(self, name, function, *args, **settings):
        """Call a function; what is watched within does not count."""
        self._open.append(name)
        began, inner = time.perf_counter(), sum(self.seconds.values())
        try:
            return function(*args, **settings)
        finally:
            inner = sum(self.seconds.values()) - inner
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - began - inner
            self._open.pop()

    def watch(self, name, module, function):
        """Have every call of a function of a module watched."""
        inner = getattr(module, function)
        setattr(module, function, lambda *args, **settings: self.run(name, inner, *args, **settings))


def run_operator(count):
    """Build the operator, and compute its modes."""
    watch, points = Watch(), random_sphere(count)
    for name, functions in STAGES.items():
        for module, function in functions:
            watch.watch(name, module, function)
    built = watch.run("surface", core.build_laplacian, points)
    operator = sum(watch.seconds.values())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    spectrum = watch.run(f"{MODES} modes", built.eigenpairs, MODES, tolerance=TOLERANCE)
    return watch, {
        "operator": operator,
        "operator gigabytes": peak,
        "queries": time_queries(points, built.stiffness.nnz // count),
        "pairs a row": built.stiffness.nnz / count,
        "matrix gigabytes": (built.stiffness.data.nbytes + built.stiffness.indices.nbytes) / 1e9,
        "error": error_of(spectrum.eigenvalues),
    }


def run_applications(count):
    """Run what the operator is for."""
    watch, points = Watch(), random_sphere(count)
    built = core.build_laplacian(points)
    low, high = points[:, 2] < -0.95, points[:, 2] > 0.95
    watch.run("smoothing", core.clean.smooth_points, built, core.clean.exponential(0.1))
    fixed = np.flatnonzero(low | high)
    watch.run("harmonic field", core.distance.harmonic_field, built, fixed, high[fixed].astype(float))
    watch.run("geodesics, set-up", geodesics_of, built)
    watch.run("geodesics, a source", core.distance.geodesic_distance, built, [0])
    watch.run("segmentation", core.spectral.segment, built, 6)
    watch.run("binding by a coarse cloud", core.deform.coarse_deformer, built, high, low)
    watch.run("binding", core.deform.Deformer, built, high, low)
    belt = np.abs(points[:, 2]) < 0.5
    ends = np.abs(points[belt, 2]) > 0.47
    watch.run("minimal surface", core.deform.minimal_surface, points[belt], ends)
    return watch, {}


def time_queries(points, neighbors):
    """Measure the searches that no operator can do without: of the nearest points, and of those within the kernel."""
    began = time.perf_counter()
    points = points[cKDTree(points).indices]  # neighbors near in memory
    tree = cKDTree(points)
    for count in (41, neighbors + 1):
        for rows in np.array_split(points, len(points) * count // (1 << 22) + 1):
            tree.query(rows, count, workers=cores())
    return time.perf_counter() - began


def run_peer(count):
    """Build the tufted Laplacian, and compute its modes by shift and invert."""
    watch = Watch()
    built = watch.run("operator", METHODS["tufted"].function, random_sphere(count))
    values = watch.run("modes", built.eigenvalues, MODES)
    return watch, {"error": error_of(values)}


def run_heat(count):
    """Measure distances by the heat method on the points."""
    watch, points = Watch(), random_sphere(count)
    solver = watch.run("geodesics, set-up", potpourri3d.PointCloudHeatSolver, points)
    solver.compute_distance(1)  # the first call makes factors
    watch.run("geodesics, a source", solver.compute_distance, 0)
    return watch, {}


OWN = "operator", "applications"
RUNS = {"operator": run_operator, "applications": run_applications, "peer": run_peer, "heat": run_heat}


def measure(run, count, most=None):
    """Run in a process of its own, so that peak memory is its own too, on so many cores or on all."""
    command = [sys.executable, "-m", "benchmarks.scaling", run, str(count)]
    known = os.environ | ({"MESHFREE_CORES": str(most), "OPENBLAS_NUM_THREADS": str(most)} if most else {})
    result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=known).stdout)
    print(run, count, result, flush=True)
    return result


def error_of(eigenvalues):
    """Return the mean relative error of the eigenvalues of the unit sphere, without the first."""
    exact = sphere_eigenvalues(MODES)[1:]
    return float(np.mean(np.abs(eigenvalues[1:] / exact - 1.0)))


def growth(values, counts):
    """Return the exponent of n between the last two counts."""
    if len(values) < 2 or min(values[-2:]) <= 0.0:
        return ""
    return f"n^{np.log(values[-1] / values[-2]) / np.log(counts[-1] / counts[-2]):.2f}"


def main(counts):
    """Measure, and write tables and the plot."""
    few = [count for count in counts if count <= LARGEST]
    measured = {run: counts if run == "operator" else few for run in RUNS}
    results = {run: [measure(run, count) for count in measured[run]] for run in RUNS}
    tables = [_stages(run.capitalize(), results[run], measured[run]) for run in OWN]
    tables += [_whole(results["operator"], counts), _cores(few[-1]), _against_peer(results, few)]
    tables.append(_geodesics(results, few))
    _plot(results, measured)
    tables[0].plots.append(PICTURE)
    text = "\n".join(table.markdown() for table in tables)
    DOCUMENT.write_text(f"# Time and memory\n\n{__doc__.splitlines()[0]}\n\n{text}", encoding="utf-8")


def _stages(title, results, counts):
    header = ["stage"] + [f"{count:,}: {unit}" for count in counts for unit in ("s", "GB")] + ["growth"]
    rows = []
    for name in results[-1]["seconds"]:
        seconds = [result["seconds"][name] for result in results]
        pairs = zip(seconds, (result["gigabytes"].get(name, 0.0) for result in results), strict=True)
        rows.append([name, *(f"{value:.2f}" for pair in pairs for value in pair), growth(seconds, counts)])
    return Table(title, header, rows, f"Seconds, and peak memory of the process, on {cores()} cores.")


def _whole(results, counts):
    header = ["points", "operator, s", "tree queries, s", f"{MODES} modes, s", "peak GB", "matrix GB", "pairs a row"]
    rows = [
        [f"{count:,}", f"{result['operator']:.1f}", f"{result['queries']:.1f}"]
        + [f"{result['seconds'][f'{MODES} modes']:.1f}", f"{result['operator gigabytes']:.2f}"]
        + [f"{result['matrix gigabytes']:.2f}", f"{result['pairs a row']:.0f}", f"{100.0 * result['error']:.2g} %"]
        for count, result in zip(counts, results, strict=True)
    ]
    header.append("eigenvalues off by")
    return Table("As a whole", header, rows)


def _cores(count):
    some = [1 << power for power in range(cores().bit_length())]
    results = [measure("operator", count, most)["seconds"] for most in some]
    modes = f"{MODES} modes"
    for seconds in results:
        seconds["operator"] = sum(seconds.values()) - seconds[modes]
    rows = []
    for name in [*(name for name in results[0] if name not in ("operator", modes)), "operator", modes]:
        rows.append([name, *(f"{seconds[name]:.2f}" for seconds in results)])
        rows[-1] += [f"{results[0][name] / seconds[name]:.2f}" for seconds in results[1:]]
    header = ["stage", *(f"on {most}: s" for most in some), *(f"{most} over 1: times faster" for most in some[1:])]
    note = (
        f"{count:,} points on some of the cores. Python's lock is held by what scipy finds in graphs: the minimum"
        " spanning tree along which signs of normals are passed on, paths along sheets, components. One core alone"
        " builds trees of points, and sorts."
    )
    return Table("Cores", header, rows, note)


def _against_peer(results, counts):
    rows = []
    for count, ours, peer in zip(counts, results["operator"], results["peer"], strict=False):
        own, other = (sum(result["seconds"].values()) for result in (ours, peer))
        rows.append([f"{count:,}", f"{own:.1f}", f"{other:.1f}", f"{own / other:.2f}"])
        rows[-1] += [f"{100.0 * result['error']:.2g} %" for result in (ours, peer)]
    header = ["points", "this project, s", "tufted, s", "times", "eigenvalues off by", "tufted"]
    note = f"Operator and {MODES} modes, against the tufted Laplacian on the triangles of potpourri3d."
    return Table("Against a peer", header, rows, note)


def _geodesics(results, counts):
    names = "geodesics, set-up", "geodesics, a source"
    rows = [
        [f"{count:,}", *(f"{run['seconds'][name]:.2f}" for name in names for run in runs)]
        for count, *runs in zip(counts, results["applications"], results["heat"], strict=False)
    ]
    header = ["points", "set-up, s", "heat method", "each source, s", "heat method"]
    note = "Distances from one point, after those from another, against the heat method of potpourri3d on points."
    return Table("Geodesics", header, rows, note)


def _plot(results, measured):
    figure, panels = pyplot.subplots(1, 2, figsize=(12, 4), dpi=80, layout="constrained")
    for axes, run in zip(panels, OWN, strict=True):
        for name in results[run][-1]["seconds"]:
            axes.loglog(
                measured[run], [result["seconds"][name] for result in results[run]], "o-", label=name, markersize=4
            )
        axes.set(title=run.capitalize(), xlabel="points", ylabel="seconds")
        axes.grid(which="both", alpha=0.2)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)  # beside the lines
    figure.savefig(DOCUMENT.parent / PICTURE, bbox_inches="tight")
    pyplot.close(figure)


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in RUNS:
        watched, figures = RUNS[sys.argv[1]](int(sys.argv[2]))
        print(json.dumps({"seconds": watched.seconds, "gigabytes": watched.gigabytes, **figures}))
    else:
        main([int(count) for count in sys.argv[1:]] or list(COUNTS))
