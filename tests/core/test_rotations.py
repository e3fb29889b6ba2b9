"""Rotations nearest to matrices that leave some turn free: those of neighborhoods that are lines, or single points."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from core.algebra.rotations import rotations_in_groups


def test_what_a_line_leaves_free_is_the_turn_of_its_group():
    rng = np.random.default_rng(1)
    turns = Rotation.from_rotvec(rng.standard_normal((3, 3))).as_matrix()
    group = rng.integers(3, size=600)
    group[:3] = 0, 1, 2
    steps = rng.standard_normal((600, 4, 3))
    steps[300:, 1:] = steps[300:, :1] * rng.standard_normal((300, 3, 1))  # lines
    steps[-1] = 0.0  # a single point
    matrices = np.einsum("nab,nkb,nkc->acn", turns[group], steps, steps)
    assert_allclose(rotations_in_groups(matrices, group), np.moveaxis(turns[group], 0, 2), atol=1e-6)


def test_neighborhoods_that_are_no_lines_keep_their_own_turns():
    rng = np.random.default_rng(2)
    turns = Rotation.from_rotvec(rng.standard_normal((500, 3))).as_matrix()
    steps = rng.standard_normal((500, 6, 3)) * [1.0, 0.5, 0.0]  # flat
    matrices = np.einsum("nab,nkb,nkc->acn", turns, steps, steps)
    found = rotations_in_groups(matrices, np.zeros(500, dtype=int))
    assert_allclose(found, np.moveaxis(turns, 0, 2), atol=1e-5)
