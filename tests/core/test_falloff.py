"""Weights that fall off with the distance, as Blender's proportional editing does."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere

SHAPES = ["smooth", "sphere", "root", "inverse_square", "sharp", "linear", "constant"]


@pytest.mark.parametrize("shape", SHAPES)
def test_from_one_at_the_source_to_nothing_at_the_radius(shape):
    weights = core.distance.falloff(np.linspace(0.0, 2.0, 101), 1.0, shape)
    assert weights[0] == 1.0
    assert (np.diff(weights) <= 0.0).all()
    assert (weights[50:] == 0.0).all()
    assert core.distance.falloff([0.0, np.inf], 0.5, shape).tolist() == [1.0, 0.0]
    assert core.distance.falloff([0.3], 1.0, shape) == core.distance.falloff([0.6], 2.0, shape)


@pytest.mark.parametrize(
    ("shape", "half"),
    [("smooth", 0.5), ("sphere", 0.75**0.5), ("root", 0.5**0.5), ("inverse_square", 0.75), ("sharp", 0.25)],
)
def test_half_way(shape, half):
    assert core.distance.falloff([0.5], 1.0, shape) == pytest.approx([half])


def test_on_a_sphere_it_is_that_of_the_angle():
    points = fibonacci_sphere(1500)
    distance = core.distance.geodesic_distance(core.build_laplacian(points), [0])
    angle = np.arccos(np.clip(points @ points[0], -1.0, 1.0))
    assert core.distance.falloff(distance, 2.0, "linear") == pytest.approx(np.maximum(1.0 - angle / 2.0, 0.0), abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([-1.0], 1.0), "1 of 1 distances are negative"),
        (([np.nan], 1.0), "no numbers"),
        (([1.0], 0.0), "radius"),
        (([1.0], 1.0, "steep"), "no falloff 'steep'. Choose from smooth"),
        (([[1.0]], 1.0), "Distances have the shape"),
    ],
)
def test_bad_input_is_refused(arguments, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.distance.falloff(*arguments)
