"""Tiles against the whole cloud: ``python -m benchmarks.tiles [points [tiles [halo]]]``.

Differences are the largest in the whole cloud, relative to the largest value, of areas and lengths to their own.

``python -m benchmarks.tiles store [points [tile_points [halo [degree [folder]]]]]`` walks over tiles on disk in this
process, and prints CPU seconds a point beside those of a cloud of 200,000, the most memory, and the bytes on disk; a
folder that exists is gone on with.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy import sparse

import core

from .samplings import torus_points

TARGET = {"random": 1e-6, "noisy": 1e-5}
WHOLE = 200_000  # points of the cloud that CPU seconds are held against
NOISE = 0.2  # of the spacing
VALUES = ("normals", "quadric_mean_curvature", "smoothing_lengths", "areas", "boundary")


def compare(name, points, count, halo):
    """Print the largest differences between tiles and the whole, both by the record of the survey."""
    began = time.process_time()
    tiles = core.tiles.cut(points, count, halo)
    agreed = core.tiles.survey(points, tiles)
    surveyed = time.process_time()
    parts = [core.tiles.measure_tile(points, tile, agreed) for tile in tiles]
    measured = time.process_time()
    whole = core.build_laplacian(points, agreed=agreed)
    curvature = core.mean_curvature(whole)
    ended = time.process_time()
    order = np.argsort(np.concatenate([part.rows for part in parts]))

    def joined(quantity):
        return np.concatenate([getattr(part, quantity) for part in parts])[order]

    on = whole.component >= 0
    found = {
        quantity: np.abs(joined(quantity)[on].astype(float) - getattr(whole, quantity)[on]).max()
        / np.abs(getattr(whole, quantity)[on].astype(float)).max(initial=1e-300)
        for quantity in VALUES
    }
    found["areas"] = np.abs(joined("areas") / whole.areas - 1.0)[on].max()
    found["mean_curvature"] = np.abs(joined("mean_curvature") - curvature)[on].max() / np.abs(curvature[on]).max()
    rows = sparse.vstack([part.stiffness for part in parts]).tocsr()[order]
    found["rows of the matrix"] = abs(rows - whole.stiffness).max() / abs(whole.stiffness).max()
    share = sum(len(tile.rows) for tile in tiles) / len(points)
    print(f"{name}: {len(points):,} points in {len(tiles)} tiles, with halos {share:.2f} times as many")
    for quantity, value in found.items():
        print(f"  {quantity}: {value:.0e} (target {TARGET[name]:.0e})")
    print(f"  total area: {abs(joined('areas').sum() / whole.areas.sum() - 1.0):.0e} (target 1e-09)")
    print(f"  other components: {np.count_nonzero(joined('component') != whole.component)} points (target 0)")
    own = core.build_laplacian(points).agreed
    print(
        f"  other signs than of the whole's own record: {np.count_nonzero((agreed.side * own.side).sum(axis=1) < 0.0)}"
    )
    print(
        f"  CPU seconds: survey {surveyed - began:.0f}, tiles {measured - surveyed:.0f}, whole {ended - measured:.0f}",
        flush=True,
    )


def main(count=400_000, tiles=8, halo=core.tiles.HALO):
    """Compare on a torus, without noise and with it."""
    points = torus_points(int(count))
    compare("random", points, int(tiles), float(halo))
    spacing = np.sqrt(core.estimate_areas(points[:: max(1, len(points) // 2000)]).sum() / len(points))
    noise = NOISE * spacing * np.random.default_rng(1).normal(size=points.shape)
    compare("noisy", points + noise, int(tiles), float(halo))


def store(count=1_000_000, most=250_000, halo=core.tiles.HALO, degree=core.tiles.DEGREE, folder=""):
    """Measure what tiles on disk cost."""
    count, most = int(count), int(most)
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(folder or temporary) / "store"
        began = time.process_time()
        if not place.exists():
            parts = np.array_split(torus_points(count), -(-count // 1_000_000))
            began = time.process_time()
            core.tiles.cut_to_store(
                lambda: ((part, {}) for part in parts), place, most, halo=float(halo), degree=int(degree)
            )
            del parts
        cut = time.process_time() - began
        tiles = core.tiles.Store(place)
        disk, last, spent = 0, "", {}

        def progress(step, fraction):
            nonlocal disk, last, began
            now = time.process_time()
            spent[last], began = spent.get(last, 0.0) + now - began, now
            last = step
            disk = max(disk, sum(path.stat().st_size for path in place.rglob("*.*")))

        began = time.process_time()
        core.tiles.run_steps(tiles, progress=progress)
        spent[last] = spent.get(last, 0.0) + time.process_time() - began
        within = sum(len(tiles.own(number)) for number in tiles.alive)
        around = sum(len(tiles.part(number).points) for number in tiles.alive)
        final = sum(path.stat().st_size for path in place.rglob("*.*"))
    seconds = cut + sum(spent.values())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{count:,} points in {tiles.count} tiles, with halos {around / within:.2f} times as many")
    print("  CPU seconds:", ", ".join(f"{name} {value:.1f}" for name, value in {"cut": cut, **spent}.items() if name))
    print(f"  most memory {memory:.2f} GB, on disk {disk / count:.0f} bytes a point, at the end {final / count:.0f}")
    points = torus_points(WHOLE)
    began = time.process_time()
    core.mean_curvature(core.build_laplacian(points))
    whole = time.process_time() - began
    print(
        f"  CPU microseconds a point: tiles {1e6 * seconds / count:.0f}, whole of {WHOLE:,} {1e6 * whole / WHOLE:.0f},"
        f" ratio {seconds / count * WHOLE / whole:.2f} (target 1.6)"
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["store"]:
        store(*sys.argv[2:])
    else:
        main(*sys.argv[1:])
