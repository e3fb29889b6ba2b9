"""The clouds and meshes that the evaluation of the paper rests on, and how its tables are written and read."""

import numpy as np
import pytest

from benchmarks.paper.clouds import SPHERES, ellipsoid, ellipsoid_area, sphere, torus_triangles
from benchmarks.samplings import torus_area, torus_low_discrepancy, torus_points
from benchmarks.tables import Table, goal, rows_of


def area_of(points, triangles):
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


@pytest.mark.parametrize("make", [torus_low_discrepancy, torus_points])
def test_triangles_of_a_torus_close_it(make):
    points = make(3000)
    triangles = torus_triangles(points)
    assert len(triangles) == 2 * len(points)  # Euler's characteristic is zero
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert area_of(points, triangles) == pytest.approx(torus_area(), rel=1e-2)


def test_area_of_an_ellipsoid():
    points, triangles = sphere("Fibonacci", 20_000)
    axes = 1.5, 1.0, 0.6
    assert area_of(ellipsoid(points, axes), triangles) == pytest.approx(ellipsoid_area(axes), rel=3e-4)
    assert ellipsoid_area((1.0 + 1e-6, 1.0, 1.0 - 1e-6)) == pytest.approx(4.0 * np.pi, rel=1e-5)


@pytest.mark.parametrize("sampling", [name for name in SPHERES if name != "density varying"])
def test_samplings_of_the_sphere(sampling):
    points, triangles = sphere(sampling, 2000)
    assert len(points) == pytest.approx(2000, rel=0.05)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, atol=1e-12)
    assert len(np.unique(triangles)) == len(points)


def test_tables_are_read_as_they_were_written():
    rows = [goal("a quantity", "<= 1", "0.5", True), goal("another", "> 1", "0.3", False)]
    text = Table("Title", ["quantity", "target", "measured", "met"], rows, "A note.", plots=["a.png"]).markdown()
    assert rows_of(text) == [["a quantity", "<= 1", "0.5", "yes"], ["another", "> 1", "0.3", "no"]]
    assert "![Title](a.png)" in text
    assert rows_of("") == []
