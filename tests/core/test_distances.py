from dataclasses import replace

import numpy as np
import pytest

from benchmarks.samplings import fibonacci_sphere, open_cylinder
from core.geometry.arcs import arc_length
from core.geometry.cloud import read_cloud
from core.geometry.edges import Sides
from core.options import LaplacianOptions


def on_sphere(first, second):
    return np.arccos(np.clip(np.einsum("ij,ij->i", first, second), -1.0, 1.0))


def on_cylinder(first, second):
    return np.hypot(on_sphere(*(across(ends) for ends in (first, second))), second[:, 2] - first[:, 2])


def across(points):
    """Unit vectors from the z axis."""
    return points * [1.0, 1.0, 0.0] / np.linalg.norm(points[:, :2], axis=1)[:, None]


@pytest.mark.parametrize(
    ("points", "normals", "exact"),
    [(fibonacci_sphere(300), lambda x: x, on_sphere), (0.5 * open_cylinder()[::3], across, on_cylinder)],
    ids=["sphere", "cylinder"],
)
@pytest.mark.parametrize("sign", ["alike", "at random"])
def test_arcs_are_exact_to_sixth_order(points, normals, exact, sign):
    cloud = read_cloud(points, LaplacianOptions(boundary="off", bandwidth_factor=3.0))
    pairs = replace(cloud.pairs, points=points[cloud.scaled.first])
    i, j = pairs.first, pairs.second
    pairs = replace(pairs, distance=np.linalg.norm(pairs.points[j] - pairs.points[i], axis=1))
    sides = np.where(np.random.default_rng(0).random(len(pairs.points)) < 0.5, -1.0, 1.0) if sign != "alike" else 1.0
    signed = (normals(pairs.points).T * sides).T
    cloud = replace(
        cloud,
        pairs=pairs,
        sides=Sides(signed, cloud.shape_operator, np.zeros(len(pairs.points)), signed),
        squared_slope=np.zeros(len(pairs.points)),
    )
    length = exact(pairs.points[i], pairs.points[j])
    known = length < 0.5  # where normals turn more there may be an edge between them
    assert np.count_nonzero(known & (length > 0.3)) > 100
    # The next term of the series for the square of an arc is s^8 / 560.
    assert np.all(np.abs(arc_length(cloud) - length)[known] < 1e-3 * length[known] ** 7 + 1e-14)
