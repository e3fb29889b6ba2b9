"""The side of normals in tiles: outside, up, or as seen from a place, whatever the cut."""

from functools import cache

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from benchmarks.surveys import agreed_on, survey

COUNT = 600
SPHERE = fibonacci_sphere(COUNT)


@cache
def sheet():
    """Return points of a wavy sheet, about as high as it is wide, (n, 3)."""
    x, y = np.random.default_rng(0).uniform(-1.0, 1.0, (2, COUNT))
    return np.column_stack([x, y, 0.3 * np.cos(2.0 * x)])


def sides(folder, points, count, **choice):
    return agreed_on(survey(folder, points, count, 20.0, until="areas", **choice)).side


SPHERES = {
    "up": ({}, 1.0),
    "from without": ({"viewpoint": [3.0, 0.0, 0.5]}, 1.0),
    "from within": ({"viewpoint": [0.2, 0.1, 0.5]}, -1.0),
    "by scanners within": ({"columns": {"scanner": 0.5 * SPHERE[::-1]}}, -1.0),
    "by scanners without": ({"columns": {"scanner": 2.0 * SPHERE}}, 1.0),
}


@pytest.mark.parametrize("case", SPHERES)
def test_of_a_closed_body_is_what_is_seen_of_it(case, tmp_path):
    choice, sign = SPHERES[case]
    found = sides(tmp_path / "store", SPHERE, 2, orient="viewpoint" if choice else "up", **choice)
    assert np.all(sign * np.einsum("ij,ij->i", found, SPHERE) > 0.9)


@pytest.mark.parametrize("count", [1, 3])
def test_of_a_sheet_is_that_of_the_place(count, tmp_path):
    for place, sign in (([0.0, 0.0, 5.0], 1.0), ([0.5, 0.2, -0.7], -1.0)):
        found = sides(tmp_path / str(sign), sheet(), count, orient="viewpoint", viewpoint=place)
        assert np.all(sign * found[:, 2] > 0.0)
    turned = sheet() * [1.0, 1.0, -1.0]
    assert np.all(sides(tmp_path / "up", turned, count, orient="up")[:, 2] > 0.0)


def test_of_bodies_is_decided_one_by_one(tmp_path):
    """A small sphere in the shadow of a large one has its own outer side."""
    points = np.concatenate([SPHERE, 0.4 * SPHERE[::2] + [0.0, 0.0, -3.0]])
    found = sides(tmp_path / "store", points, 2, orient="up")
    center = np.where(np.arange(len(points)) < COUNT, 0.0, -3.0)
    outward = points - center[:, None] * [0.0, 0.0, 1.0]
    assert np.all(np.einsum("ij,ij->i", found, outward) > 0.0)


def stored(folder, pieces, **choice):
    return core.tiles.cut_to_store(lambda: pieces, folder / "store", 350, halo=20.0, **choice)


def test_by_scanners_is_told_by_the_files(tmp_path):
    halves = [(SPHERE[rows], {"scanner": 0.1 * SPHERE[rows]}) for rows in (slice(250), slice(250, None))]
    store = stored(tmp_path, halves, orient="viewpoint")
    core.tiles.run_steps(store)
    for number in store.alive:
        inward = -np.einsum("ij,ij->i", store.read("measure", number, "normals"), store.own(number))
        assert np.all(inward > 0.9)
        np.testing.assert_allclose(store.read("measure", number, "mean_curvature"), -1.0, atol=0.02)


def test_without_a_scanner_is_told_before_anything_is_cut(tmp_path):
    halves = [(SPHERE[:400], {"scanner": SPHERE[:400]}), (SPHERE[400:], {})]
    with pytest.raises(core.InvalidPointsError, match="not all points tell where their scanner was.*Give a viewpoint"):
        stored(tmp_path, halves, orient="viewpoint")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("choice", "text"),
    [
        ({"orient": "sideways"}, "unknown"),
        ({"viewpoint": [0.0, 0.0, 1.0]}, "does not go with"),
        ({"orient": "viewpoint"}, "No viewpoint"),
        ({"orient": "viewpoint", "viewpoint": [0.0, np.nan, 1.0]}, "not finite"),
        ({"orient": "viewpoint", "viewpoint": np.zeros((COUNT, 3))}, "one position"),
    ],
)
def test_that_cannot_be_is_refused(choice, text, tmp_path):
    with pytest.raises(core.InvalidPointsError, match=text):
        stored(tmp_path, [(SPHERE, {})], **choice)
