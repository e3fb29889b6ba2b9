"""Pictures hold an object, and not the stray points far from it."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from benchmarks.samplings import random_sphere
from core.geometry import without_far


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_a_few_points_far_away_are_left_out(scale):
    points = scale * random_sphere(2600)
    far = scale * 40.0 * random_sphere(25, seed=1)
    assert_array_equal(without_far(np.concatenate([points, far])), points)


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_of_an_object_nothing_is_left_out(shape):
    points = random_sphere(500) * shape
    assert_array_equal(without_far(points), points)
    assert_array_equal(without_far(points[:1]), points[:1])


def test_a_pole_on_the_ground_and_a_second_object_stay():
    rng = np.random.default_rng(0)
    ground = rng.uniform(-1.0, 1.0, (5000, 3)) * (1.0, 1.0, 0.0)
    pole = rng.uniform(0.0, 1.5, (50, 3)) * (0.0, 0.0, 1.0)
    other = random_sphere(500) + (9.0, 0.0, 0.0)
    points = np.concatenate([ground, pole, other])
    assert_array_equal(without_far(points), points)
