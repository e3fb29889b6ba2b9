"""Tiles against the whole cloud: ``python -m benchmarks.tiles torus [points [tiles [halo]]]``, and ``zoo`` for
the shapes in the folder MESHFREE_ZOO; both on random points and with noise, and by another cut besides.

Differences are the largest in the whole cloud, relative to the largest value, of areas and lengths to their own.

``python -m benchmarks.tiles store [points [tile_points [halo [folder]]]]`` walks over tiles on disk in this
process, and prints CPU seconds a point beside those of a cloud of 200,000, the most memory, and the bytes on disk; a
folder that exists is gone on with. ``run [points [workers [memory [tile_points [folder]]]]]`` does the same by `tiles
run` with several workers, and tells the most memory of each.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

import core

from .real_shapes import noisy_points, random_points, shapes
from .samplings import torus_points
from .surveys import agreed_on, in_order, survey

ROOT = Path(__file__).parents[1]
PROGRAM = "import sys; from command.main import main; sys.exit(main())"
WHOLE = 200_000  # points of the cloud that CPU seconds are held against
NOISE = 0.2  # of the spacing
FIRST = ("normals", "quadric_mean_curvature", "smoothing_lengths")
SOLVED = ("areas", "mean_curvature")
LABELS = ("boundary", "component", "sides")


def in_tiles(points, count, halo):
    """Measure a cloud in tiles; return its quantities in the order of the points, and the record."""
    with tempfile.TemporaryDirectory() as folder:
        store = survey(Path(folder) / "store", points, count, halo)
        agreed = agreed_on(store)
        core.tiles.run_steps(store)
        found = {name: in_order(store, name) for name in (*FIRST, *SOLVED, *LABELS[:-1])}
        share = sum(len(store.part(number).points) for number in store.alive) / len(points)
    found["sides"] = np.sign(np.einsum("ij,ij->i", found["normals"], agreed.side))
    return found, agreed, share


def as_a_whole(points, agreed):
    """Measure a cloud as a whole by a record."""
    whole = core.build_laplacian(points, agreed=agreed)
    found = {name: getattr(whole, name) for name in (*FIRST, "areas", "boundary", "component")}
    found["mean_curvature"] = core.measure.mean_curvature(whole)
    found["sides"] = np.sign(np.einsum("ij,ij->i", whole.normals, agreed.side))
    return found


def differences(found, wanted):
    """Return the largest differences, by quantity, and how many labels differ."""
    on = wanted["component"] >= 0
    result = {}
    for name in (*FIRST, "mean_curvature"):
        result[name] = np.abs(found[name] - wanted[name])[on].max() / np.abs(wanted[name])[on].max()
    result["areas"] = np.abs(found["areas"] / wanted["areas"] - 1.0)[on].max()
    result["total area"] = abs(found["areas"].sum() / wanted["areas"].sum() - 1.0)
    result["labels"] = sum(np.count_nonzero(found[name] != wanted[name]) for name in LABELS)
    return result


def compare(name, points, count, halo):
    """Print the largest differences between tiles, the whole by the same record, and another cut."""
    began = time.process_time()
    found, agreed, share = in_tiles(points, count, halo)
    ended = time.process_time()
    wanted = as_a_whole(points, agreed)
    whole = time.process_time() - ended
    own = core.build_laplacian(points).agreed
    flipped = np.count_nonzero((agreed.side * own.side).sum(axis=1) < 0.0)
    other, _, _ = in_tiles(points, count + 1, halo)
    print(
        f"{name}: {len(points):,} points in {count} tiles, {share:.2f} times as many with halos; sides other than of"
        f" the whole's own record: {flipped}; CPU seconds {ended - began:.0f}, as a whole {whole:.0f}"
    )
    for title, against in (("whole", wanted), ("other cut", other)):
        values = differences(found, against)
        print(f"  {title}:", ", ".join(f"{quantity} {value:.0e}" for quantity, value in values.items()), flush=True)


def torus(count=400_000, tiles=8, halo=core.tiles.HALO):
    """Compare on a torus, without noise and with it."""
    points = torus_points(int(count))
    compare("torus", points, int(tiles), float(halo))
    spacing = np.sqrt(core.estimate_areas(points[:: max(1, len(points) // 2000)]).sum() / len(points))
    noise = NOISE * spacing * np.random.default_rng(1).normal(size=points.shape)
    compare("torus, noisy", points + noise, int(tiles), float(halo))


def zoo(count=100_000, tiles=4, halo=core.tiles.HALO):
    """Compare on real shapes, without noise and with it."""
    for name, (vertices, faces, _) in shapes().items():
        compare(name, random_points(vertices, faces, int(count))[0], int(tiles), float(halo))
        noisy = noisy_points(vertices, faces, int(count), NOISE)
        compare(f"{name}, noisy", noisy, int(tiles), float(halo))


def store(count=1_000_000, most=250_000, halo=core.tiles.HALO, folder=""):
    """Measure what tiles on disk cost."""
    count, most, alone = int(count), int(most), whole_seconds()
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(folder or temporary) / "store"
        began = time.process_time()
        if not place.exists():
            parts = np.array_split(torus_points(count), -(-count // 1_000_000))
            began = time.process_time()
            core.tiles.cut_to_store(lambda: ((part, {}) for part in parts), place, most, halo=float(halo))
            del parts
        cut = time.process_time() - began
        tiles = core.tiles.Store(place)
        disk = 0

        def progress(stage, fraction):
            nonlocal disk
            disk = max(disk, sum(path.stat().st_size for path in place.rglob("*.*")))

        began = time.process_time()
        core.tiles.run_steps(tiles, progress=progress)
        spent = time.process_time() - began
        steps = {step.name: sum(map(float, tiles.told(step.name, "seconds"))) for step in core.tiles.steps_of(tiles)}
        within = sum(len(tiles.own(number)) for number in tiles.alive)
        around = sum(len(tiles.part(number).points) for number in tiles.alive)
        final = sum(path.stat().st_size for path in place.rglob("*.*"))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{count:,} points in {tiles.count} tiles, with halos {around / within:.2f} times as many")
    print("  CPU seconds:", ", ".join(f"{name} {value:.1f}" for name, value in {"cut": cut, **steps}.items()))
    print(f"  most memory {memory:.2f} GB, on disk {disk / count:.0f} bytes a point, at the end {final / count:.0f}")
    beside_whole(count, cut + spent, alone)


def run(count=5_000_000, workers=2, memory="2GB", most=0, folder=""):
    """Measure what `tiles run` costs with several workers."""
    count, most, alone = int(count), int(most), whole_seconds()
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(folder or temporary)
        source, out = place / "points.npy", place / "out"
        if not source.exists():
            np.save(source, torus_points(count))
        words = ["tiles", "run", source, "--out-dir", out, "--workers", workers, "--memory", memory, "--format", "npy"]
        words += ["--tile-points", most] if most else []
        known = {**os.environ, "PYTHONPATH": str(ROOT)}
        began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        running = subprocess.Popen([sys.executable, "-c", PROGRAM, *map(str, words)], env=known, stdout=subprocess.PIPE)
        used = {}
        while running.poll() is None:
            for pid, size in memory_used(running.pid).items():
                used[pid] = max(used.get(pid, 0), size)
            time.sleep(0.5)
        took, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        told = json.loads(running.stdout.read().splitlines()[-1])
        tiles = core.tiles.Store(out / "store")
        around = sum(len(tiles.part(number).points) for number in tiles.alive)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"{count:,} points in {told['tiles']} tiles, {told['failed_tiles']} failed, with halos"
        f" {around / told['points']:.2f} times as many, {workers} workers of {memory}: {took:.0f} s"
    )
    print(f"  CPU seconds {seconds:.0f}, of these in tiles {told['cpu_seconds']:.0f}; area {told['total_area']:.9g}")
    print("  most memory of the program, and of each worker:", [f"{size / 2**30:.2f} GB" for size in used.values()])
    beside_whole(count, seconds, alone)


def memory_used(pid):
    """Return the resident memory of a process and of the workers that it has started, in bytes."""
    found = {}
    try:
        process = psutil.Process(pid)
        for one in [process, *process.children(recursive=True)]:
            if one.pid == pid or "spawn_main" in " ".join(one.cmdline()):
                found[one.pid] = one.memory_info().rss
    except psutil.NoSuchProcess:
        pass  # it has ended meanwhile
    return found


def whole_seconds():
    """Return the CPU seconds that a point takes in a cloud of 200,000 as a whole."""
    points = torus_points(WHOLE)
    began = time.process_time()
    core.measure.mean_curvature(core.build_laplacian(points))
    return (time.process_time() - began) / WHOLE


def beside_whole(count, seconds, alone):
    """Print CPU time a point, and that of a whole cloud, before the run and after it."""
    each, after = seconds / count, whole_seconds()
    print(
        f"  CPU microseconds a point: tiles {1e6 * each:.0f}, whole of {WHOLE:,} {1e6 * alone:.0f} before and"
        f" {1e6 * after:.0f} after, ratio {2.0 * each / (alone + after):.2f} (target 1.6)",
        flush=True,
    )


if __name__ == "__main__":
    {"run": run, "store": store, "torus": torus, "zoo": zoo}[sys.argv[1]](*sys.argv[2:])
