"""Tiles against the whole cloud: ``python -m benchmarks.tiles [points [tiles [halo]]]``.

Differences are the largest in the whole cloud, relative to the largest value, of areas and lengths to their own.
"""

import sys
import time

import numpy as np
from scipy import sparse

import core

from .samplings import torus_points

TARGET = {"random": 1e-6, "noisy": 1e-5}
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


if __name__ == "__main__":
    main(*sys.argv[1:])
