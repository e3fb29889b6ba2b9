"""Weights of bones beside Blender's own: ``MESHFREE_ZOO=folder python -m benchmarks.rigging [group ...]``.

The shape is the cat of `real_shapes`; Blender's weights need a Python with bpy, see `deformation`.
"""

import sys
import time

import numpy as np
from scipy.spatial import cKDTree

import core
from core.operator.graph import near_graph

from .deformation import BLENDER, run_in_blender
from .real_shapes import noisy_points, random_points, shapes, with_outliers
from .samplings import fibonacci_sphere, random_sphere
from .tables import print_rows
from .targets import HEADER, Goal, judge, percent

CHAINS = {  # joints within the cat
    "spine": [
        (-0.04, -0.19, -0.15),
        (-0.03, -0.07, -0.05),
        (0.0, 0.05, 0.08),
        (0.03, 0.17, 0.14),
        (0.08, 0.29, 0.18),
        (0.18, 0.316, 0.19),
    ],
    "tail": [
        (-0.055, -0.145, -0.27),
        (-0.09, -0.11, -0.425),
        (-0.102, 0.0, -0.4),
        (-0.08, 0.1, -0.355),
        (-0.03, 0.19, -0.45),
    ],
    "left leg": [(-0.1, -0.27, -0.15), (-0.11, -0.36, -0.207), (-0.12, -0.45, -0.195), (-0.127, -0.515, -0.157)],
    "right leg": [(0.02, -0.26, -0.18), (0.028, -0.315, -0.255), (0.033, -0.4, -0.255), (0.05, -0.458, -0.262)],
    "left arm": [(-0.035, 0.17, 0.25), (-0.047, 0.2, 0.335), (-0.042, 0.25, 0.42), (-0.022, 0.28, 0.51)],
    "right arm": [(0.09, 0.03, 0.18), (0.15, 0.035, 0.245), (0.215, 0.077, 0.348)],
}
NEAR = 6  # nearest points along the surface, which count as neighbours
WRONG = 1e-3  # weight of a bone that a point must not follow
POINTS = 10_000
SAMPLINGS = {
    "vertices": lambda v, f: v,
    "10,000 random": lambda v, f: random_points(v, f, POINTS)[0],
    "1 % outliers": lambda v, f: with_outliers(v, f, POINTS, 0.01),
    "noise of .3": lambda v, f: noisy_points(v, f, POINTS, 0.3),
}


def bones():
    """Heads and tails of the bones, (b, 3)."""
    chains = [np.array(chain) for chain in CHAINS.values()]
    return np.concatenate([chain[:-1] for chain in chains]), np.concatenate([chain[1:] for chain in chains])


def jump(laplacian, weights):
    """Largest difference of a weight between neighbours."""
    graph = near_graph(laplacian, NEAR)
    first, second = graph.lengths.nonzero()
    return np.abs(weights[graph.first[first]] - weights[graph.first[second]]).max()


def cat():
    """Weights of the cat's points, beside those of Blender, and in other samplings."""
    vertices, faces, _ = shapes()["cat"]
    ends = bones()
    known = {}
    for name, sample in SAMPLINGS.items():
        laplacian = core.build_laplacian(sample(vertices, faces))

        def measure(name=name, laplacian=laplacian):
            weights = core.rig.bone_weights(laplacian, *ends)
            known[name] = laplacian, weights
            yield max(-weights.min(), 0.0)
            yield np.abs(weights.sum(axis=1) - 1.0).max()
            yield jump(laplacian, weights)
            kept = np.flatnonzero(laplacian.component >= 0)
            every = np.concatenate([laplacian.surface_points[kept], vertices])
            carried = core.clean.Prolongation(every, np.arange(len(kept)), laplacian.normals[kept])
            yield np.abs(carried.interpolate(weights[kept])[len(kept) :] - known["vertices"][1]).mean()

        goals = [
            Goal("least weight below zero", 0.0),
            Goal("sum off 1", 1e-12),
            Goal(f"largest jump between {NEAR} nearest", 0.35, "{:.3f}"),
        ]
        if name != "vertices":
            goals.append(Goal("mean difference to the vertices' weights", 0.02, "{:.4f}"))
        yield from judge(f"cat, {len(ends[0])} bones, {name}", goals, measure())

    def beside():
        if not BLENDER.exists():
            yield from ["left out: no Python with bpy"] * 3
        theirs = run_in_blender("weights", vertices=vertices, faces=faces, heads=ends[0], tails=ends[1])
        laplacian, ours = known["vertices"]
        yield np.abs(ours - theirs).mean()
        yield np.mean(ours.argmax(axis=1) == theirs.argmax(axis=1))
        yield jump(laplacian, theirs)

    goals = [
        Goal("mean difference", 0.03, "{:.4f}"),
        Goal("same strongest bone", 0.92, "{:.1%}", least=True),
        Goal("largest jump of Blender's", None, "{:.3f}"),
    ]
    yield from judge("cat, vertices, beside Blender's own weights of the mesh", goals, beside())


def slab(sphere, half):
    """Points of a sphere moved to a box of half edges with rounded edges, (n, 3)."""
    return sphere / np.sum(np.abs(sphere / half) ** 6, axis=1)[:, None] ** (1.0 / 6.0)


def pressed():
    """A flat hand on a hip, at a gap in spacings: weights of the other body's bone."""
    for sampling in (fibonacci_sphere, random_sphere):
        hip = slab(sampling(4000), [1.0, 1.0, 0.6])
        spacing = np.sqrt(core.build_laplacian(hip).areas.mean())
        for gap in (2.0, 1.0, 0.7):

            def measure(sampling=sampling, hip=hip, spacing=spacing, gap=gap):
                height = 0.75 + gap * spacing
                hand = slab(sampling(1333), [0.5, 0.5, 0.15]) + [0.0, 0.0, height]
                laplacian = core.build_laplacian(np.concatenate([hip, hand]))
                heads, tails = [[-0.8, 0, 0], [-0.4, 0, height]], [[0.8, 0, 0], [0.4, 0, height]]
                weights = core.rig.bone_weights(laplacian, heads, tails)
                wrong = np.concatenate([weights[: len(hip), 1], weights[len(hip) :, 0]])
                away = np.concatenate([cKDTree(hand).query(hip)[0], cKDTree(hip).query(hand)[0]])
                yield wrong[away > (gap + 2.0) * spacing].max()
                yield np.mean(wrong > WRONG)

            name = f"hand on hip, {sampling.__name__}, {gap} spacings apart"
            goals = [Goal("wrong bone beyond the contact", WRONG), percent("of all points above 1e-3")]
            yield from judge(name, goals, measure())


def elbow():
    """A bar bent by a right angle with dual quaternions."""
    around = 40
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    rings = np.stack(
        np.broadcast_arrays(np.linspace(-2.0, 2.0, 81)[:, None], 0.3 * np.cos(angle), 0.3 * np.sin(angle)), axis=2
    )
    points = rings.reshape(-1, 3)
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    pose = [np.eye(3, 4), np.column_stack([turn, np.zeros(3)])]

    def volume(moved):
        """Volume of the tube with its ends, by the divergence theorem on its triangles."""
        a, b = (ring.reshape(-1, 3) for ring in (moved[:-1], moved[1:]))
        c, d = (np.roll(ring, -1, axis=1).reshape(-1, 3) for ring in (moved[:-1], moved[1:]))
        sides = [(a, b, c), (b, d, c)]
        for ring, order in ((moved[0], -1), (moved[-1], 1)):
            fan = [np.broadcast_to(ring.mean(axis=0), ring.shape), ring, np.roll(ring, -1, axis=0)]
            sides.append((fan[0], *fan[1:][::-order]))
        return abs(sum(np.einsum("ij,ij->", p, np.cross(q, r)) for p, q, r in sides)) / 6.0

    def measure():
        weights = core.rig.bone_weights(
            core.build_laplacian(points), [[-1.9, 0, 0], [0, 0, 0]], [[0, 0, 0], [1.9, 0, 0]]
        )
        for dual in (True, False):
            moved = core.rig.skin(points, weights, pose, dual_quaternions=dual).reshape(rings.shape)
            yield volume(moved) / volume(rings) - 1.0

    goals = [percent("volume, dual quaternions", 5.0), percent("volume, linear")]
    yield from judge("elbow bent by 90 degrees", goals, measure())


def cost():
    """Seconds of all cores together: what other programs take of them does not count."""
    vertices, faces, _ = shapes()["cat"]
    laplacian = core.build_laplacian(random_points(vertices, faces, 100_000)[0])
    heads, tails = bones()
    thirds = np.linspace(0.0, 1.0, 4)[:, None, None]
    joints = heads + thirds * (tails - heads)

    def measure():
        began = time.process_time()
        weights = core.rig.bone_weights(
            laplacian, joints[:-1].reshape(-1, 3), joints[1:].reshape(-1, 3), influences=4, least=0.01
        )
        yield time.process_time() - began
        began = time.process_time()
        core.rig.smooth_weights(laplacian, weights, 4.0 * np.sqrt(np.median(laplacian.areas)))
        yield time.process_time() - began

    goals = [Goal("seconds of CPU time", 8.0, "{:.1f}"), Goal("smoothed, seconds of CPU time", None, "{:.1f}")]
    yield from judge("100,000 points, 60 bones", goals, measure())


GROUPS = {"cat": cat, "pressed": pressed, "elbow": elbow, "cost": cost}

if __name__ == "__main__":
    print_rows(HEADER, GROUPS, sys.argv[1:])
