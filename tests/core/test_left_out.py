"""Points that the caller leaves out of the operator."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import core
from core.geometry import cloud
from core.operator import narrow_laplacian


def some_points():
    """Points of a patch with a boundary, floaters among them in no order, and points at one place."""
    side = np.linspace(0.0, 1.0, 30)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    rng = np.random.default_rng(3)
    points = np.column_stack([x, y, 0.1 * np.sin(5.0 * x)]) + 0.005 * rng.standard_normal((900, 3))
    air = rng.uniform(-1.0, 2.0, (100, 3))
    points = np.concatenate([points, air, points[:5]])
    out = np.zeros(1005, dtype=bool)
    out[900:1000] = True
    order = rng.permutation(1005)
    return points[order], out[order]


@pytest.mark.parametrize("doubled", [False, True])
def test_the_operator_with_points_left_out_is_that_of_the_others_to_the_bit(doubled):
    points, out = some_points()
    if not doubled:
        first = np.unique(points, axis=0, return_index=True)[1]
        points, out = points[np.sort(first)], out[np.sort(first)]
    options = core.LaplacianOptions(neighbors=40)
    part = core.build_laplacian(points, options=options, left_out=out)
    alone = core.build_laplacian(points[~out], options=options)
    names = ["areas", "normals", "shape_operator", "boundary", "boundary_distance", "component", "trust"]
    names += ["smoothing_lengths", "cell_radius", "disc_radii", "surface_points", "kernel_widths"]
    names += ["quadric_mean_curvature"]
    for name in names:
        assert_array_equal(getattr(part, name)[~out], getattr(alone, name), err_msg=name)
    inner = part.stiffness[~out][:, ~out]
    assert (inner != alone.stiffness).nnz == 0
    assert (part.component[out] == -1).all()
    assert (part.trust[out] == 0.0).all()
    assert abs(part.stiffness[out]).sum() == 0.0
    assert part.notices == alone.notices
    assert part.points is points or (part.points == points).all()


def test_points_left_out_by_number_with_normals_and_boundary_given():
    points, out = some_points()
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    edge = np.min([points[:, :2], 1.0 - points[:, :2]], axis=(0, 2)) < 0.02
    options = core.LaplacianOptions(neighbors=40)
    by_number = core.build_laplacian(points, normals, options, boundary=edge, left_out=np.flatnonzero(out))
    alone = core.build_laplacian(points[~out], normals[~out], options, boundary=edge[~out])
    assert_array_equal(by_number.areas[~out], alone.areas)
    assert_array_equal(by_number.boundary[~out], alone.boundary)
    assert (by_number.stiffness[~out][:, ~out] != alone.stiffness).nnz == 0


def test_uses_of_the_operator_know_points_left_out():
    points, out = some_points()
    options = core.LaplacianOptions(neighbors=40)
    part = core.build_laplacian(points, options=options, left_out=out)
    alone = core.build_laplacian(points[~out], options=options)
    np.testing.assert_allclose(part.eigenpairs(6).eigenvalues, alone.eigenpairs(6).eigenvalues, rtol=1e-6, atol=1e-6)
    source = np.flatnonzero(~out)[:1]
    distance = core.distance.geodesic_distance(part, source)[~out]
    np.testing.assert_allclose(distance, core.distance.geodesic_distance(alone, [0]), rtol=1e-6, atol=1e-9)
    narrow = narrow_laplacian(part)
    assert (narrow.component[out] == -1).all()


def test_a_narrow_operator_takes_what_was_decided_for_its_points(monkeypatch):
    points, out = some_points()
    wide = core.build_laplacian(points, left_out=out)
    usual = narrow_laplacian(replace(wide, agreed=core.Agreed()))

    def decided(*_):
        raise AssertionError("decided again")

    for name in ("label_components", "label_sheets", "orient_by_winding"):
        monkeypatch.setattr(cloud, name, decided)
    narrow = narrow_laplacian(wide)
    assert_array_equal(narrow.component, usual.component)
    np.testing.assert_allclose(narrow.normals, wide.normals, atol=1e-12)
    np.testing.assert_allclose(narrow.areas, usual.areas, rtol=1e-9)
    assert abs(narrow.stiffness - usual.stiffness).max() < 1e-9 * abs(usual.stiffness).max()


def test_all_points_left_out_and_wrong_sets_are_refused():
    points, _ = some_points()
    with pytest.raises(core.TooFewPointsError, match="left out"):
        core.build_laplacian(points, left_out=np.ones(len(points), dtype=bool))
    with pytest.raises(core.InvalidPointsError):
        core.build_laplacian(points, left_out=[len(points)])
    with pytest.raises(core.InvalidPointsError):
        core.build_laplacian(points, left_out=np.ones(3, dtype=bool))
