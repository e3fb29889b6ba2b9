import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere

WIDE = core.LaplacianOptions(bandwidth_factor=3.4)  # so many neighbours that sums are integrals to a percent


def cap(angle):
    """Surface variation of the cap of a unit sphere within an angle: heights are spread evenly (Archimedes)."""
    cosine = np.cos(angle)
    across = (1.0 - cosine) ** 2 / 12.0
    return across / (across + 1.0 - (1.0 + cosine + cosine**2) / 3.0)


@pytest.mark.parametrize("points", [fibonacci_sphere(2500), random_sphere(4000)], ids=["even", "random"])
def test_on_the_sphere_it_is_that_of_a_cap_as_wide_as_the_support(points):
    laplacian = core.build_laplacian(points, options=WIDE)
    expected = cap(3.0 * laplacian.smoothing_lengths)
    np.testing.assert_allclose(core.measure.surface_variation(laplacian), expected, rtol=0.2)
    assert np.median(core.measure.surface_variation(laplacian) / expected) == pytest.approx(1.0, abs=0.02)


def test_it_vanishes_on_planes_and_on_their_edge_is_that_of_two_half_discs():
    """Of discs of radius 1, each bent by a right angle: variances 1/4, 1/8 and 1/8 - m^2/2, with m = 4 / (3 pi)."""
    u, v = (np.indices((60, 60)).reshape(2, -1) + 0.5) / 60.0
    points = np.concatenate([np.column_stack([u, v, 0.0 * u]), np.column_stack([u, 0.0 * u, v])])
    found = core.measure.surface_variation(core.build_laplacian(points, options=WIDE))
    inside, height = np.abs(points[:, 0] - 0.5) < 0.25, points[:, 1:].max(axis=1)
    assert found[inside & (height > 0.5) & (height < 0.7)].max() < 1e-12
    across = 0.125 - 0.5 * (4.0 / (3.0 * np.pi)) ** 2
    edge = inside & (height < 0.01)
    assert np.median(found[edge]) == pytest.approx(across / (across + 0.375), rel=0.05)
