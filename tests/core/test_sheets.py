"""Close sheets: told apart by their normals, so that no pair joins them through the gap."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import core
from benchmarks.awkward import box
from benchmarks.samplings import (
    closed_plate,
    grid_points,
    noisy_sphere,
    parallel_sheets,
    random_sphere,
    sausage,
    sausage_bend,
    torus_points,
)
from core.geometry import sheets
from core.geometry.cloud import read_cloud
from core.geometry.nearest import find_nearest
from core.geometry.pairs import Pairs, find_pairs
from core.geometry.sheets import fit_sheets, same_sheet, separate_sheets, step_lengths, ways_along
from core.kernel import SUPPORT
from core.options import LaplacianOptions


def pair(first, second, normal, other):
    """Arguments of `same_sheet` for two points and their normals, at unit spacing."""
    chord = np.subtract(second, first)
    return chord @ normal, chord @ other, np.dot(normal, other), np.linalg.norm(chord), 1.0


class TestSameSheet:
    UP, DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])

    @pytest.mark.parametrize("side", [1.0, -1.0])
    @pytest.mark.parametrize(("x", "expected"), [(0.0, False), (0.5, False), (1.0, False), (3.0, False)])
    def test_one_above_the_other(self, side, x, expected):
        assert same_sheet(*pair([0, 0, 0], [x, 0, 1.5], self.UP, side * self.UP)) == expected

    @pytest.mark.parametrize("side", [1.0, -1.0])
    def test_next_to_each_other(self, side):
        assert same_sheet(*pair([0, 0, 0], [3.0, 0, 0.0], self.UP, side * self.UP))
        assert same_sheet(*pair([0, 0, 0], [3.0, 0, 0.3], self.UP, side * self.UP))

    @pytest.mark.parametrize("angle", [0.1, 0.4, 0.75])
    @pytest.mark.parametrize("side", [1.0, -1.0])
    def test_along_a_circle(self, angle, side):
        # The chord of an arc is orthogonal to the mean of the normals at its ends.
        normal, other = ([np.sin(a), 0.0, np.cos(a)] for a in (-angle, angle))
        first, second = 10.0 * np.array(normal), 10.0 * np.array(other)
        assert same_sheet(*pair(first, second, np.array(normal), side * np.array(other)))

    def test_arrays(self):
        left = np.array([0.0, 1.5, 0.0])
        np.testing.assert_array_equal(
            same_sheet(left, left, np.array([1.0, 1.0, -1.0]), np.full(3, 2.0), np.ones(3)), [True, False, True]
        )


class TestFitSheets:
    @pytest.fixture(scope="class")
    @classmethod
    def parallel(cls):
        points, sheet, _ = parallel_sheets(30)
        nearest = find_nearest(points)
        surface, kept = fit_sheets(nearest)[:2]
        return nearest, surface, kept, sheet

    def test_no_neighbor_across_is_kept_and_all_others_are(self, parallel):
        nearest, _, kept, sheet = parallel
        across = sheet[nearest.index] != sheet[:, None]
        assert np.any(nearest.weight[across] > 0.0)
        assert not np.any(kept.weight[across] > 0.0)
        np.testing.assert_array_equal(kept.weight[~across], nearest.weight[~across])

    def test_its_normals_and_curvatures_are_those_of_planes(self, parallel):
        surface = parallel[1]
        np.testing.assert_allclose(np.abs(surface.normals[:, 2]), 1.0, atol=1e-9)
        np.testing.assert_allclose(surface.gaussian_curvature, 0.0, atol=1e-9)
        np.testing.assert_allclose(surface.height, 0.0, atol=1e-9)

    def test_random_sheets(self):
        # Random points leave gaps as wide as that between the sheets, so a few neighbours are told wrong.
        rng = np.random.default_rng(0)
        sheet = np.repeat([0, 1], 900)
        points = np.column_stack([30.0 * rng.random((1800, 2)), 1.5 * sheet])
        nearest = find_nearest(points)
        surface, kept = fit_sheets(nearest)[:2]
        across = (sheet[nearest.index] != sheet[:, None]) & (nearest.weight > 0.0)
        assert np.count_nonzero(kept.weight[across]) < 0.05 * np.count_nonzero(across)
        assert np.mean(np.abs(surface.normals[:, 2]) > 0.99) > 0.95

    @pytest.mark.parametrize("share", [0.0, 0.02, 1.0])
    def test_where_some_points_moved_it_is_the_same_as_anew(self, share):
        points = np.concatenate([noisy_sphere(750, 0.3), noisy_sphere(750, 0.3) * 1.04])
        rng = np.random.default_rng(1)
        moved = points + 0.01 * rng.normal(size=points.shape) * (rng.random((len(points), 1)) < share)
        anew = fit_sheets(find_nearest(moved))
        again = fit_sheets(find_nearest(moved), fit_sheets(find_nearest(points)))
        assert np.any(anew.nearest.weight != find_nearest(moved).weight)
        np.testing.assert_array_equal(again.nearest.weight, anew.nearest.weight)
        for name in ("normals", "height", "misfit"):
            for which in ("quadrics", "mixed"):
                found, wanted = (getattr(getattr(sheets, which), name) for sheets in (again, anew))
                np.testing.assert_allclose(found, wanted, atol=1e-12, err_msg=name)

    @pytest.mark.parametrize("points", [random_sphere(1000), torus_points(1000)], ids=["sphere", "torus"])
    def test_a_single_sheet_keeps_all(self, points):
        nearest = find_nearest(points)
        assert np.array_equal(fit_sheets(nearest)[1].weight, nearest.weight)


class TestPairs:
    @pytest.fixture(scope="class")
    @classmethod
    def plate(cls):
        points, face, inset, _ = closed_plate(30)
        return points, face, inset

    @pytest.fixture(scope="class")
    @classmethod
    def capsule(cls):
        return sausage(bent=True)

    @staticmethod
    def through_the_plate(plate, options):
        points, face, inset = plate
        cloud = read_cloud(points, options)
        face, inset, pairs = face[cloud.scaled.first], inset[cloud.scaled.first], cloud.pairs
        faces = face[pairs.first] * face[pairs.second] == 0
        opposite = faces & (face[pairs.first] + face[pairs.second] == 1)
        around = inset[pairs.first] + inset[pairs.second] + 2.0
        # Steps of a way cut the corners of the grid, so that it is up to a quarter shorter.
        return np.count_nonzero(opposite & (around > 2.0 * pairs.distance * cloud.scaled.scale))

    @staticmethod
    def across_the_arms(capsule, options):
        points, along = capsule
        cloud = read_cloud(points, options)
        along, pairs = along[cloud.scaled.first], cloud.pairs
        bend = sausage_bend(len(points))
        arm = 0.5 * (6.0 - np.pi * bend)
        low = np.minimum(along[pairs.first], along[pairs.second])
        high = np.maximum(along[pairs.first], along[pairs.second])
        # The way around the bend is shortest on its inside.
        around = (arm - low) + np.pi * (bend - 0.25) + (high - arm - np.pi * bend)
        reach = 3.0 * pairs.mean(pairs.lengths) * cloud.scaled.scale
        return np.count_nonzero((low < arm) & (high > arm + np.pi * bend) & (around > 1.5 * reach))

    def test_none_through_a_closed_plate(self, plate):
        assert self.through_the_plate(plate, LaplacianOptions()) == 0

    @pytest.mark.parametrize("thickness", [1.5, 2.0, 3.0])
    def test_none_around_a_plate_beyond_the_kernel(self, thickness):
        points = box([30.0, 30.0, thickness], int(1800 + 120 * thickness))
        cloud = read_cloud(points, LaplacianOptions())
        pairs, ends = cloud.pairs, cloud.scaled.first[np.stack([cloud.pairs.first, cloud.pairs.second])]
        inset = np.stack([points[:, :2], 30.0 - points[:, :2]])
        inner = (inset.min(axis=(0, 2)) > 1.0)[ends].all(axis=0)
        inner &= np.abs(points[ends[0], 2] - points[ends[1], 2]) == thickness
        along = np.abs(points[ends[0]] - points[ends[1]])[:, 1::-1]
        around = np.hypot(inset[:, ends].sum(axis=1) + thickness, along).min(axis=(0, 2))
        # A path of chords cuts right angles, by a factor of the root of two at most.
        assert not np.any(inner & (around > np.sqrt(2.0) * SUPPORT * pairs.mean(pairs.lengths) * cloud.scaled.scale))

    def test_hardly_any_from_arm_to_arm_of_a_bent_capsule(self, capsule):
        assert self.across_the_arms(capsule, LaplacianOptions()) <= 2  # at its ends, where the spacing is half the gap

    def test_there_would_be_many_without_the_option(self, plate, capsule):
        options = LaplacianOptions(sheets=False)
        for count in (self.through_the_plate(plate, options), self.across_the_arms(capsule, options)):
            assert count > 1000

    @pytest.mark.parametrize("points", [random_sphere(750), torus_points(2000)], ids=["sphere", "torus"])
    def test_none_is_left_out_where_no_sheets_are_close(self, points):
        apart = read_cloud(points, LaplacianOptions())
        assert len(apart.pairs.first) == len(read_cloud(points, LaplacianOptions(sheets=False)).pairs.first)

    def test_at_the_rim_those_in_doubt_are_left_out_where_nearer_ones_are(self, monkeypatch):
        points = np.random.default_rng(0).uniform(size=(1500, 3))  # which lie on no surface

        def found():
            pairs = read_cloud(points, LaplacianOptions()).pairs
            inside = 1.3 * pairs.distance < SUPPORT * pairs.mean(pairs.lengths)
            return set(zip(pairs.first.tolist(), pairs.second.tolist(), inside.tolist(), strict=True))

        some = found()
        monkeypatch.setattr(sheets, "WIDER", 1.0)  # no pair is at the rim
        more = found() - some
        assert len(more) > 0.1 * len(some)
        assert not any(inside for _, _, inside in more)


class TestOrientation:
    def test_outward_on_a_closed_plate(self):
        points, face, inset, _ = closed_plate(30)
        normals = core.estimate_normals(points)
        outward = np.where(face == 1, 1.0, -1.0) * normals[:, 2]
        assert np.all(outward[(face >= 0) & (inset > 0.0)] > 0.0)
        np.testing.assert_allclose(outward[(face >= 0) & (inset > 3.0)], 1.0, atol=1e-6)
        center = normals[face < 0] * (points[face < 0] - [15.0, 15.0, 1.0])
        assert np.all(center.sum(axis=1) > 0.0)

    @pytest.mark.parametrize("radius", [0.25, 0.1, 0.05])
    def test_outward_on_a_thin_capsule(self, radius):
        points, along = sausage(2100, radius=radius)
        axis = np.column_stack([np.clip(along, 0.0, 6.0), 0.0 * along, 0.0 * along])
        normals = core.estimate_normals(points)
        assert np.einsum("ij,ij->i", normals, points - axis).min() > 0.9 * radius

    def test_outward_on_a_bent_capsule(self):
        points, along = sausage(bent=True)
        bend = sausage_bend(len(points))
        arm = 0.5 * (6.0 - np.pi * bend)
        turn = np.clip((along - arm) / bend, 0.0, np.pi)
        inside = np.clip(along, 0.0, 6.0)
        straight = np.minimum(inside - arm, 0.0) - np.maximum(inside - arm - np.pi * bend, 0.0)
        axis = np.column_stack([straight + bend * np.sin(turn), bend * np.cos(turn), 0.0 * along])
        normals = core.estimate_normals(points)
        assert np.einsum("ij,ij->i", normals, points - axis).min() > 0.7 * 0.25


class TestLabels:
    def test_the_sheets_of_components_are_parts_of_their_own(self):
        points, sheet, _ = parallel_sheets(20)
        points = np.concatenate([points, points + [100.0, 0.0, 0.0], grid_points(range(30), range(30), [50.0])])
        laplacian = core.build_laplacian(points)
        np.testing.assert_array_equal(np.bincount(laplacian.component), [900, 400, 400, 400, 400])
        expected = np.concatenate([sheet, 2 + sheet, np.full(900, 4)])
        assert len(set(zip(laplacian.component.tolist(), expected.tolist(), strict=True))) == 5
        sizes = np.bincount(laplacian.component, laplacian.areas)
        np.testing.assert_allclose(sizes, [29.0**2, 19.0**2, 19.0**2, 19.0**2, 19.0**2], rtol=0.05)

    @pytest.mark.parametrize(
        "points",
        [closed_plate(30)[0], sausage(bent=True)[0], random_sphere(1000), torus_points(1000, minor=0.2)],
        ids=["plate", "capsule", "sphere", "torus"],
    )
    def test_what_hangs_together_is_one(self, points):
        laplacian = core.build_laplacian(points)
        assert np.all(laplacian.component == 0)
        assert connected_components(laplacian.stiffness, directed=False)[0] == 1


class TestWhereSheetsMeet:
    @pytest.mark.parametrize("polar", [0.5, 1.0])
    def test_points_that_crowd_along_lines_hang_together(self, polar):
        # Meridians and parallels: the forty nearest neighbours of a point at a pole all lie on its own parallel.
        angle = np.pi * (np.arange(60) + polar) / (59 + 2 * polar)
        around = np.exp(2j * np.pi * np.arange(120) / 120)
        ring = np.sin(angle)[:, None] * around
        points = np.stack([ring.real, ring.imag, np.repeat(np.cos(angle)[:, None], 120, axis=1)], axis=2).reshape(-1, 3)
        laplacian = core.build_laplacian(points)
        assert np.all(laplacian.component == 0)
        assert connected_components(laplacian.stiffness, directed=False)[0] == 1
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=5e-3)


class TestWays:
    @pytest.fixture(scope="class")
    @classmethod
    def rolled(cls):
        """A hairpin of two flat arms that meet in half a turn, its normals, and where along it the points lie."""
        bend = 1.2
        half = np.pi * bend
        way = np.concatenate([np.arange(-20.0, 0.0), np.linspace(0.0, half, 5), half + np.arange(1, 21)])
        turn = np.clip(way / bend, 0.0, np.pi)
        straight = np.minimum(way, 0.0) - np.maximum(way - half, 0.0)
        x, z = straight + bend * np.sin(turn), -bend * np.cos(turn)
        points = np.concatenate([np.column_stack([x, np.full(len(x), y), z]) for y in np.arange(30.0)])
        normal = np.column_stack([np.sin(turn), np.zeros(len(x)), -np.cos(turn)])
        return find_nearest(points), np.tile(normal, (30, 1)), np.tile(way, 30)

    def test_they_lead_around_a_gap_and_not_across(self, rolled):
        nearest, normals, way = rolled
        first, second = np.triu_indices(len(way), 1)
        chord = np.linalg.norm(nearest.points[first] - nearest.points[second], axis=1)
        near = chord < 6.0
        first, second = first[near], second[near]
        length = ways_along(step_lengths(nearest, normals), nearest.tree, first, second, np.full(len(first), 30.0))
        exact = np.hypot(way[first] - way[second], nearest.points[first, 1] - nearest.points[second, 1])
        seen = exact < 25.0
        assert np.all(length[seen] > 0.85 * exact[seen])
        assert np.all(length[seen] < 1.4 * exact[seen])

    def test_they_go_by_the_normals_of_sides(self, rolled):
        """Where those of quadrics are a mean over the gap, only pairs both of whose ends have such a one cross it."""
        nearest, normals, way = rolled
        there = np.abs(np.abs(way - way.mean()) - 12.0) < 1.0
        mean = np.where(there[:, None], np.eye(3)[0], normals)
        pairs = Pairs(nearest.points, np.full(len(way), 1.6), *find_pairs(nearest.tree, np.full(len(way), 1.6)))

        def crossing(sides):
            kept = separate_sheets(pairs, nearest, mean, sides)
            across = np.abs(way[kept.first] - way[kept.second]) > 15.0
            return np.count_nonzero(across & ~(there[kept.first] & there[kept.second]))

        assert crossing(normals) == 0
        assert crossing(mean) > 20

    def test_points_that_would_lose_nearly_all_pairs_keep_them(self, rolled, monkeypatch):
        nearest, normals, way = rolled
        alone, lengths = 0, np.full(len(way), 1.6)
        pairs = Pairs(nearest.points, lengths, *find_pairs(nearest.tree, lengths))
        own = (pairs.first == alone) | (pairs.second == alone)

        def measured(steps, tree, first, second, longest):
            length = ways_along(steps, tree, first, second, longest)
            return np.where((first == alone) | (second == alone), np.inf, length)

        monkeypatch.setattr(sheets, "ways_along", measured)
        monkeypatch.setattr(sheets, "_plainly_on_one_sheet", lambda pairs, *_: np.zeros(len(pairs.first), dtype=bool))
        kept = separate_sheets(pairs, nearest, normals, normals)
        assert np.count_nonzero((kept.first == alone) | (kept.second == alone)) == np.count_nonzero(own) > 12
        assert len(kept.first) < len(pairs.first)

    def test_longer_ones_than_asked_for_are_infinite(self, rolled):
        nearest, normals, _ = rolled
        first, second = np.array([0, 0]), np.array([3, 44])
        length = ways_along(step_lengths(nearest, normals), nearest.tree, first, second, np.full(2, 5.0))
        np.testing.assert_array_equal(np.isfinite(length), [True, False])

    def test_what_normals_join_to_nothing_is_joined_to_what_is_nearest(self):
        points = np.concatenate([grid_points(range(10), range(10), [0.0]), [[4.5, 4.5, 2.0], [4.5, 4.5, 3.0]]])
        steps = step_lengths(find_nearest(points), np.tile([0.0, 0.0, 1.0], (102, 1)))
        assert connected_components(steps, directed=False)[0] == 1
        assert steps[[101]].indices.tolist() == [100]
        assert steps[[100]].nnz == 2
        assert abs(steps - steps.T).max() == 0.0
