"""What deformation must reach.

The comparison with Blender needs a Python with bpy: the environment .venv/blender-4.5, or what MESHFREE_BLENDER names.
"""

import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

import core

from .samplings import bar, bent_end, random_sphere
from .speed import SCANS, read_ply
from .targets import Goal, judge, percent

ROOT = Path(__file__).parents[1]
BLENDER = Path(os.environ.get("MESHFREE_BLENDER", ROOT / ".venv" / "blender-4.5" / "bin" / "python"))
LENGTH = 4.0


def bar_ends(points, rows=3):
    """Return the first and the last rows of the bar, caps included, as indices."""
    reach = (rows - 0.5) * LENGTH / 60
    return np.flatnonzero(points[:, 0] < reach), np.flatnonzero(points[:, 0] > LENGTH - reach)


def section_areas(points, section):
    """Areas of the bar's cross-sections, (rows + 1,): half the sums of cross products around them."""
    around = points[section] - points[section].mean(axis=1, keepdims=True)
    return 0.5 * np.linalg.norm(np.cross(around, np.roll(around, -1, axis=1)).sum(axis=1), axis=1)


def turns(points, section):
    """Angles between successive pieces of the bar's centre line, between the rows that are free."""
    pieces = np.diff(points[section[3:-3]].mean(axis=1), axis=0)
    pieces /= np.linalg.norm(pieces, axis=1, keepdims=True)
    return np.arccos(np.clip(np.einsum("ij,ij->i", pieces[1:], pieces[:-1]), -1.0, 1.0))


def moves(laplacian):
    """Rigid moves of all that is constrained: the surface must follow."""
    points = laplacian.points
    first, last = bar_ends(points)
    both = np.concatenate([first, last])
    quarter = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])

    for case, settings in (
        ("linear", {"rotation_aware": False}),
        ("rotation-aware", {}),
        ("linear, soft", {"rotation_aware": False, "weights": 1.0}),
        ("rotation-aware, soft", {"weights": 1.0}),
    ):
        deformer = core.deform.Deformer(laplacian, both, **settings)

        def measure(deformer=deformer):
            maps = [lambda x: x, lambda x: x + (1.0, -2.0, 3.0)]
            if deformer.rotation_aware:
                maps.append(lambda x: x @ quarter.T)
            for rigid in maps:
                result = deformer.solve(rigid(points[deformer.handles]))
                yield np.abs(result - rigid(points)).max() / LENGTH

        goals = [Goal("not moved", 1e-8), Goal("moved along", 1e-6)]
        if deformer.rotation_aware:
            goals.append(Goal("turned by 90 degrees", 1e-3))
        yield from judge(f"bar, both ends, {case}", goals, measure())


def bend(laplacian, quads, section):
    """Bend the bar by a right angle, and compare with Blender's Laplacian Deform modifier on its mesh."""
    points = laplacian.points
    first, last = bar_ends(points)
    target = bent_end(points[last], 0.5 * np.pi)

    for neighbors in (30, 45, None):
        chosen = {} if neighbors is None else {"neighbors": neighbors}
        deformer = core.deform.Deformer(laplacian, last, first, **chosen)

        def measure(deformer=deformer):
            result, steps, _ = deformer.deform(target)
            yield steps
            yield np.abs(section_areas(result, section) - 1.0).max()
            angles = turns(result, section)
            yield angles.max() / angles.mean()
            for iterations in (1, 30):
                other = in_blender(points, quads, np.concatenate([first, last]), points[first], target, iterations)
                yield other if isinstance(other, str) else rms(result - other) / LENGTH

        goals = [
            Goal("steps", form="{:d}"),
            percent("cross-section area, worst", 10.0),
            Goal("largest turn of the centre line over the mean one", form="{:.2f}"),
            percent("RMS difference to Blender, 1 iteration", 3.0),
            percent("RMS difference to Blender, 30 iterations", 3.0),
        ]
        yield from judge(f"bar bent by 90 degrees, {neighbors or 'default'} neighbors", goals, measure())
    straight = core.deform.Deformer(laplacian, last, first, rotation_aware=False).solve(target)
    goals = [percent("cross-section area, worst")]
    areas = section_areas(straight, section)
    yield from judge("bar bent by 90 degrees, linear", goals, iter([np.abs(areas - 1.0).max()]))


def rms(difference):
    """Root of the mean squared length of the rows."""
    return np.sqrt(np.mean(np.sum(difference**2, axis=1)))


def in_blender(points, quads, held, anchored, target, iterations):
    """Result of Blender's modifier, or why there is none."""
    if not BLENDER.exists():
        return "left out: no Python with bpy"
    target = np.concatenate([anchored, target])
    return run_in_blender("bar", points=points, quads=quads, held=held, target=target, iterations=iterations)


def run_in_blender(name, **given):
    """Let a script of this folder compute something from arrays in Blender."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.npz"
        np.savez(path, **given)
        script = Path(__file__).with_name(f"{name}_in_blender.py")
        subprocess.run([BLENDER, script, path], check=True, capture_output=True, timeout=600)
        return np.load(path.with_suffix(".npy"))


def cost():
    """Seconds to bind and to solve, the least of several, and the longest time without a report."""
    for count, neighbors in ((20_000, 30), (20_000, None), (100_000, None)):
        laplacian = core.build_laplacian(random_sphere(count))
        z = laplacian.points[:, 2]
        chosen = {} if neighbors is None else {"neighbors": neighbors}
        sets = laplacian, z > 0.95, z < -0.95
        times, runs = (3, 25) if count < 50_000 else (1, 5)

        def measure(sets=sets, chosen=chosen, times=times, runs=runs):
            for kind in (core.deform.coarse_deformer, core.deform.Deformer):
                gaps, seconds = zip(*(reported(kind, *sets, **chosen) for _ in range(times)), strict=True)
                yield min(seconds)
                yield min(gaps)
            linear = core.deform.Deformer(*sets, rotation_aware=False, **chosen)
            target = linear.points[linear.handles] + (0.0, 0.0, 0.5)
            yield least(runs, lambda: linear.solve(target))
            aware, coarse = core.deform.Deformer(*sets, **chosen), core.deform.coarse_deformer(*sets, **chosen)
            result = aware.solve(target)
            yield least(runs, lambda: aware.solve(target, steps=1))
            yield least(runs, lambda: aware.solve(target, steps=1, start=result))
            yield least(runs, lambda: coarse.solve(target, steps=1, start=result))
            moved = np.linalg.norm(result - aware.points, axis=1).max()
            yield np.linalg.norm(coarse.solve(target) - result, axis=1).max() / moved

        live = 0.025 if count < 50_000 else 0.1
        known = count < 50_000
        goals = [
            Goal("bind to follow, seconds", 6.0, "{:.2f}"),
            Goal("longest time without a report then", 0.5, "{:.2f}"),
            Goal("bind exactly, seconds", 5.0 if known else None, "{:.2f}"),
            Goal("longest time without a report then", 0.5, "{:.2f}"),
            Goal("linear solve, seconds", 0.06 if known else None, "{:.3f}"),
            Goal("linear solve and one rotation-aware step, seconds", 0.15 if known else None, "{:.3f}"),
            Goal("one rotation-aware step from the last result, seconds", 0.15 if known else None, "{:.3f}"),
            Goal("update while a handle is dragged, seconds", live, "{:.3f}"),
            percent("settled, greatest difference to the exact result over the greatest displacement", 2.0),
        ]
        yield from judge(f"sphere, {count:,} random, {neighbors or 'default'} neighbors", goals, measure())


def reported(kind, *given, **settings):
    """Make something that reports its progress; return the longest time without a report, and all of the time."""
    seen = [time.perf_counter()]
    kind(*given, progress=lambda stage, fraction: seen.append(time.perf_counter()), **settings)
    seen.append(time.perf_counter())
    return np.diff(seen).max(), seen[-1] - seen[0]


def following():
    """Seconds of an update in Blender, from the move of an empty to the evaluated object, the least of several."""
    archives = list((ROOT / "dist").glob("*.zip"))
    for count, most in ((20_000, 0.06), (100_000, 0.1)):
        case = f"sphere, {count:,} random, in Blender"
        if not BLENDER.exists() or not archives:
            yield [case, "update", "left out: no Python with bpy, or no zip of the extension (make build)", "", ""]
            continue
        points = random_sphere(count)
        z = points[:, 2]

        def measure(points=points, z=z):
            archive = str(max(archives, key=lambda path: path.stat().st_mtime))
            found = run_in_blender("follow", points=points, handles=z > 0.95, anchors=z < -0.95, archive=archive)
            *quick, first, settled = found
            yield min(quick)
            yield first
            yield settled

        goals = [
            Goal("update while a handle is dragged, seconds", most, "{:.3f}"),
            Goal("update settled for the first time, seconds", None, "{:.3f}"),
            Goal("update settled, as for each frame of a render, seconds", None, "{:.3f}"),
        ]
        yield from judge(case, goals, measure())


def least(times, work):
    """Least seconds of some runs."""
    seconds = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - began)
    return min(seconds)


def scans():
    """Figure 13: Max Planck's nose pulled outward, the camel's cheek pushed inward."""
    for name, choose in (("max-planck", pulled_nose), ("camelhead", pushed_cheek)):
        path = Path(SCANS) / f"{name}.ply"
        if not SCANS or not path.exists():
            yield [f"scan, {name}", "deformation", "left out: MESHFREE_SCANS names no folder with it", "", ""]
            continue
        points = read_ply(path).astype(np.float64)
        handles, anchors, move = choose(points)
        deformer = core.deform.Deformer(core.build_laplacian(points), handles, anchors)

        def measure(deformer=deformer, move=move):
            result, steps, _ = deformer.deform(deformer.points[deformer.handles] + move)
            displacement = np.linalg.norm(result - deformer.points, axis=1) / np.linalg.norm(move)
            yield steps
            yield displacement.max()
            yield np.mean(displacement > 0.01)

        goals = [
            Goal("steps", form="{:d}"),
            Goal("largest displacement over the handle's", form="{:.3f}"),
            percent("points moved by more than a hundredth of it"),
        ]
        yield from judge(f"scan, {name}", goals, measure())


def pulled_nose(points):
    """Handles, anchors and move for Max Planck: the tip of his nose, his collar, and 50 units forward."""
    tip = points[np.argmax(points[:, 2])]
    near = np.linalg.norm(points - tip, axis=1) < 20.0
    return near, points[:, 1] < -130.0, np.array([0.0, 0.0, 50.0])


def pushed_cheek(points):
    """Handles, anchors and move for the camel's head: a patch at its side, all that is far, and 0.06 inward."""
    side = np.flatnonzero(np.abs(points[:, 2]) < 0.05)
    away = np.linalg.norm(points - points[side[np.argmax(points[side, 0])]], axis=1)
    return away < 0.03, away > 0.3, np.array([-0.06, 0.0, 0.0])


def on_bar():
    """Both on the bar."""
    points, quads, section = bar()
    laplacian = core.build_laplacian(points)
    yield from moves(laplacian)
    yield from bend(laplacian, quads, section)


GROUPS = {"bar": on_bar, "scans": scans, "cost": cost}
