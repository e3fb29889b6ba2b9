"""Whether a worker thread is enough: ``python -m benchmarks.responsiveness [points ...]``.

While a computation runs in a thread, another thread that wants Python's lock every few milliseconds measures how long
it is kept waiting: so long would Blender's window stand still. The time between two reports of progress is how long a
thread goes on computing, unseen, after Esc has ended the operator.
"""

import sys
import time
from threading import Thread

import numpy as np

import core

from .samplings import random_sphere
from .tables import Table

SIZES = (20_000, 100_000)
_NAP = 0.002  # seconds between two looks at the clock


class Gaps:
    """The longest time between two calls, and the stage in which it was."""

    def __init__(self):
        self.longest, self.during, self.stage = 0.0, "", "Start"
        self._last = time.perf_counter()

    def __call__(self, stage, _fraction=0.0, most=np.inf):
        """Note that a stage goes on or begins; a gap counts for `most` seconds at most."""
        now = time.perf_counter()
        gap = min(now - self._last, most)
        if gap > self.longest:
            self.longest, self.during = gap, self.stage
        self._last, self.stage = now, stage


def watch(compute):
    """Run a function of a progress callback in a thread; return its seconds, and the gaps of both kinds.

    What other programs take from this thread does not count: a wait is no longer than what the worker computed then.
    """
    reports, held = Gaps(), Gaps()
    worker = Thread(target=compute, args=(reports,), daemon=True)
    began = time.perf_counter()
    worker.start()
    clock, spent = time.pthread_getcpuclockid(worker.ident), 0.0
    while worker.is_alive():
        try:
            now = time.clock_gettime(clock)
        except OSError:  # it ended meanwhile
            break
        held(reports.stage, most=now - spent)
        spent = now
        time.sleep(_NAP)
    reports("End")
    return time.perf_counter() - began, held, reports


def works(points):
    """Name and function of every computation; those after the first share its operator."""
    kept = []

    def analysis(progress):
        laplacian = core.build_laplacian(points, progress=progress)
        progress("Curvature", 1.0)
        core.measure.mean_curvature(laplacian)
        kept.append(laplacian)

    x = points[:, 0]
    ends = (x > np.quantile(x, 0.98)) | (x < np.quantile(x, 0.02))
    yield "analysis", analysis
    yield "50 modes", lambda progress: kept[0].eigenpairs(50, progress=progress)
    yield "remove noise", lambda progress: core.clean.fair_points(kept[0], progress=progress)
    yield (
        "bind",
        lambda progress: core.deform.Deformer(
            kept[0], np.flatnonzero(ends & (x > 0.0)), np.flatnonzero(ends & (x < 0.0)), progress=progress
        ),
    )
    yield (
        "harmonic field",
        lambda progress: core.distance.harmonic_field(kept[0], ends, np.sign(x[ends]), progress=progress),
    )
    yield "geodesic distance", lambda progress: core.distance.geodesic_distance(kept[0], ends, progress=progress)
    yield "6 parts", lambda progress: core.spectral.segment(kept[0], 6, progress=progress)


def responsiveness(sizes=SIZES):
    """Seconds for which each computation keeps the window waiting, and between its reports of progress."""
    rows = []
    for count in sizes:
        for name, compute in works(random_sphere(count)):
            seconds, held, reports = watch(compute)
            rows.append(
                [f"{name}, {count:,} points", f"{seconds:.1f}", f"{held.longest:.2f}", held.during]
                + [f"{reports.longest:.1f}", reports.during]
            )
            print(" | ".join(rows[-1]), flush=True)
    return Table(
        "Responsiveness",
        ["computation", "seconds", "window waits at most", "in", "no report for at most", "in"],
        rows,
        "Random points on a sphere; every computation runs in a thread while another one requests"
        " Python's global interpreter lock. Seconds.",
    )


if __name__ == "__main__":
    print(responsiveness([int(size) for size in sys.argv[1:]] or SIZES).markdown())
