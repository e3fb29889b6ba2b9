"""Weights taken from another sample of a surface: ``MESHFREE_ZOO=folder python -m benchmarks.transfer [group ...]``."""

import sys
import time
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

import core

from .real_shapes import random_points, shapes
from .rigging import bones
from .samplings import fibonacci_sphere, random_sphere
from .tables import print_rows
from .targets import HEADER, Goal, judge

POINTS = 12_000
KNOWN = 0.3  # share of the points
PATCHES = 60  # that hold all known points
ROTATION = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]


def in_triangles(values, faces, vertices, points, rows):
    """Values at points of triangles, linear between those at the corners."""
    corners = vertices[faces[rows]].astype(float)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    share = np.einsum("ijk,ik->ij", np.linalg.pinv(edges), points - corners[:, 0])
    share = np.column_stack([1.0 - share.sum(axis=1), share])
    return np.einsum("ik,ikb->ib", share, values[faces[rows]])


def only(match, chosen):
    """A match of which only some points, (n,) bool, are known."""
    known = match.known & chosen
    rows = sparse.diags_array(known.astype(float)) @ match.weights
    return replace(match, known=known, weights=rows.tocsr(), nearest=np.where(known, match.nearest, -1))


def cat():
    """Weights of the cat's vertices on random points of its faces."""
    vertices, faces, _ = shapes()["cat"]
    source = core.build_laplacian(vertices)
    weights = core.rig.bone_weights(source, *bones())
    points, rows = random_points(vertices, faces, POINTS)
    truth = in_triangles(weights, faces, vertices, points, rows)
    target = core.build_laplacian(points)
    match = core.rig.match_surface(target, source)
    rng = np.random.default_rng(1)
    distance = cKDTree(points[rng.choice(POINTS, PATCHES, replace=False)]).query(points)[0]
    cases = {
        "all": (np.ones(POINTS, dtype=bool), 0.01, 0.1),
        f"a random {KNOWN:.0%} known": (rng.random(POINTS) < KNOWN, 0.01, 0.1),
        f"{KNOWN:.0%} known, in {PATCHES} patches": (distance < np.quantile(distance, KNOWN), None, None),
    }
    for name, (chosen, mean, worst) in cases.items():

        def measure(chosen=chosen):
            began = time.process_time()
            error = np.abs(core.rig.transfer_values(target, only(match, chosen), weights) - truth)
            yield error.mean()
            yield error.max()
            yield np.count_nonzero(error.max(axis=1) > 0.1)
            yield time.process_time() - began

        goals = [
            Goal("mean difference", mean, "{:.5f}"),
            Goal("worst difference", worst, "{:.3f}"),
            Goal("points off by more than 0.1", None, "{}"),
            Goal("seconds of CPU time", None, "{:.1f}"),
        ]
        yield from judge(f"cat, {weights.shape[1]} bones, {name}", goals, measure())


def socks():
    """Two shells in one object, one around the other or side by side, each with a weight of its own."""
    for sampling in (fibonacci_sphere, random_sphere):
        ball = sampling(2000)
        spacing = np.sqrt(4.0 * np.pi / 2000)
        for gap in (2.0, 1.5, 1.3, 0.5, 0.0):
            kinds = {"beside": (1.0, 2.0 + gap * spacing)}
            if gap > 1.0:
                kinds["around"] = (1.0 + gap * spacing, 0.0)
            for kind, (size, shift) in kinds.items():

                def pair(ball, size=size, shift=shift):
                    return np.concatenate([ball, size * ball @ ROTATION + [shift, 0.0, 0.0]])

                def measure(pair=pair, ball=ball, kind=kind, shift=shift, spacing=spacing):
                    source, target = (core.build_laplacian(pair(points)) for points in (ball, ball @ ROTATION.T))
                    first = np.arange(len(target.points)) < len(ball)
                    found = core.rig.transfer_values(
                        target, core.rig.match_surface(target, source), first.astype(float)
                    )
                    middle = target.points - [0.5 * shift, 0.0, 0.0]
                    away = (kind == "around") | (np.linalg.norm(middle, axis=1) > 2.0 * spacing)
                    yield np.abs(found - first)[away].max()

                goals = [Goal("wrong shell, beyond two spacings from a contact", 1e-3)]
                yield from judge(f"shells, {sampling.__name__}, {kind}, {gap} spacings apart", goals, measure())


GROUPS = {"cat": cat, "socks": socks}

if __name__ == "__main__":
    print_rows(HEADER, GROUPS, sys.argv[1:])
