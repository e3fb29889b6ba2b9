"""The same answer from the same points: to the last bit on any number of cores, and to eight digits anywhere."""

import numpy as np
import pytest

import core
from benchmarks.samplings import torus_points


def open_torus():
    """A torus with some noise, cut open, so that all stages have something to do."""
    points = torus_points(3000, seed=5) + np.random.default_rng(5).normal(0.0, 0.003, (3000, 3))
    return points[points[:, 0] > -0.4]


def everything(points):
    """What the operator tells and does, by name."""
    laplacian = core.build_laplacian(points)
    spectrum = laplacian.eigenpairs(20)
    top, bottom = points[:, 2] > 0.3, points[:, 2] < -0.3
    moved = points[top] + [0.0, 0.0, 0.3]
    return {
        "areas": laplacian.areas,
        "normals": laplacian.normals,
        "stiffness": laplacian.stiffness.data,
        "boundary": laplacian.boundary,
        "curvature": core.measure.mean_curvature(laplacian),
        "eigenvalues": spectrum.eigenvalues,
        "modes": spectrum.eigenvectors,
        "smooth": core.clean.smooth_points(laplacian, core.clean.exponential(0.01)),
        "segments": core.spectral.segment(laplacian, 4),
        "harmonic": core.distance.harmonic_field(laplacian, [0, 1], [0.0, 1.0]),
        "distance": core.distance.geodesic_distance(laplacian, [0]),
        "deformed": core.deform.Deformer(laplacian, top, bottom).solve(moved),
        "coarse": core.deform.coarse_deformer(laplacian, top, bottom).solve(moved),
    }


@pytest.fixture(scope="module")
def known():
    return everything(open_torus())


@pytest.mark.parametrize("cores", [1, 3])
def test_any_number_of_cores_gives_the_same_bits(known, monkeypatch, cores):
    monkeypatch.setenv("MESHFREE_CORES", str(cores))
    for name, values in everything(open_torus()).items():
        assert values.tobytes() == known[name].tobytes(), name


def size(values):
    """Root mean square, with other weights for each entry."""
    values = np.ravel(values).astype(np.float64)
    return np.sqrt(np.mean(values**2 * (1.0 + np.cos(np.arange(len(values))))))


# Of these results, as numpy 1.26 and 2.3 gave them: other versions and machines may differ from the ninth digit on.
SIZES = {
    "areas": 0.006232609240489741,
    "normals": 0.5756699197022943,
    "stiffness": 0.26694203393155175,
    "boundary": 0.21264186193262663,
    "curvature": 1.333244183391901,
    "eigenvalues": 13.879072421370536,
    "modes": 0.31644729417573925,
    "smooth": 0.6470980731461432,
    "segments": 1.829570862236807,
    "harmonic": 0.5857111274423944,
    "distance": 1.7876781167912872,
    "deformed": 0.68151773260236,
    "coarse": 0.68151773260236,
}


@pytest.mark.parametrize("name", SIZES)
def test_any_version_gives_the_same_digits(known, name):
    assert size(known[name]) == pytest.approx(SIZES[name], rel=1e-8)
