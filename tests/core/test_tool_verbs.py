"""Verbs of tools without Blender: along the surface, moving points, sections and profiles, sides, parts and fields."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_grid
from command import colors, verbs
from command.cloud_verb import CloudVerb
from command.line import run as run_command
from core.files import PointTable, read_points, write_points
from tests.core.test_command import FAR, write
from tools import motions

SPHERE = fibonacci_sphere(800)
SQUARE = square_grid(20)


def at(place, option="at"):
    """An option for a position."""
    return f"--{option}={','.join(map(repr, np.asarray(place, dtype=float).tolist()))}"


class TestAlong:
    def test_distances_from_positions_in_a_national_grid(self, run, tmp_path):
        points = np.vstack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], SPHERE])
        source = write(tmp_path / "a.ply", points + FAR)
        sources = [at(1.01 * place + FAR) for place in points[:2]]
        code, [line] = run("geodesic-distance", source, *sources, "--out", tmp_path / "b.ply")
        assert code == 0, line
        assert line["done"].startswith("a: distances up to 2.")
        exact = np.arccos(np.clip(points[:, [2, 0]].max(axis=1), -1.0, 1.0))
        assert_allclose(read_points(tmp_path / "b.ply").attributes["lb_distance"], exact, atol=0.03)

    def test_a_column_names_the_sources_and_what_they_do_not_reach_is_told(self, run, tmp_path):
        both = np.vstack([SPHERE[::2], SPHERE[::2] + [9.0, 0.0, 0.0]])
        seed = np.zeros(len(both), dtype=np.int32)
        seed[[SPHERE[::2, 0].argmax(), SPHERE[::2, 0].argmin()]] = 1
        source = write(tmp_path / "a.ply", both, seed=seed)
        for verb, name in (("geodesic-distance", "distance"), ("nearest-source", "cell")):
            code, [line] = run(verb, source, "--group", "seed", "--out", tmp_path / "a.npz")
            assert code == 0, line
            assert any(notice.startswith("400 points are reached by no source.") for notice in line["notices"])
            found = np.load(tmp_path / "a.npz")[name]
            assert (found[400:] == -1).all()
            assert (found[:400] >= 0).all()
        clear = np.abs(both[:400, 0]) > 0.1
        assert len({*zip(found[:400][clear].tolist(), (both[:400, 0] > 0.0)[clear].tolist(), strict=True)}) == 2

    def test_signed_distance_of_the_equator_is_the_latitude(self, run, tmp_path):
        longitude = 2.0 * np.pi * np.arange(120) / 120.0
        equator = np.stack([np.cos(longitude), np.sin(longitude), 0.0 * longitude], axis=1)
        points = np.vstack([equator, SPHERE])
        source, curve = write(tmp_path / "a.ply", points + FAR), write(tmp_path / "curve.ply", equator + FAR)
        given = "--curve", curve, "--closed"
        code, [line] = run("signed-distance", source, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        assert_allclose(np.load(tmp_path / "a.npz")["signed_distance"], np.arcsin(points[:, 2]), atol=0.05)
        code, [line] = run("signed-distance", source, *given, "--out", curve)
        assert (code, "overwrite its input" in line["error"]) == (1, True)
        code, [line] = run("signed-distance", source, "--curve", tmp_path / "none.ply")
        assert (code, "There is no file" in line["error"]) == (1, True)

    def test_a_map_of_a_plane_is_the_plane(self, run, tmp_path):
        middle = SQUARE[np.linalg.norm(SQUARE - [0.5, 0.5, 0.0], axis=1).argmin()]
        source = write(tmp_path / "a.ply", SQUARE)
        maps = []
        for angle in (0, 90):
            given = at(middle), "--radius", 2, "--angle", angle
            code, [line] = run("unwrap", source, *given, "--out", tmp_path / "a.npz")
            assert code == 0, line
            maps.append(4.0 * (np.load(tmp_path / "a.npz")["uv"] - 0.5))
        assert_allclose(np.linalg.norm(maps[0], axis=1), np.linalg.norm(SQUARE - middle, axis=1), atol=0.02)
        assert_allclose(maps[1], np.stack([-maps[0][:, 1], maps[0][:, 0]], axis=1), atol=1e-12)

    def test_a_direction_stays_on_a_plane(self, run, tmp_path):
        given = at([0.0, 0.0, 0.0]), "--direction=-1,1,5"
        source = write(tmp_path / "a.ply", SQUARE)
        code, [line] = run("extend-direction", source, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        expected = np.tile(np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0), (len(SQUARE), 1))
        assert_allclose(np.load(tmp_path / "a.npz")["direction"], expected, atol=1e-6)

    @pytest.mark.parametrize(
        ("column", "values", "text"),
        [
            ("other", SPHERE[:, 0], 'has no column "seed"'),
            ("seed", SPHERE, "holds vectors"),
            ("seed", 2.5 * SPHERE[:, 0], "not from 0 to 1"),
            ("seed", 0.0 * SPHERE[:, 0], "at least 1"),
            ("seed", np.ones(800), "All points of"),
        ],
    )
    def test_columns_that_are_no_sources(self, run, tmp_path, column, values, text):
        source = write(tmp_path / "a.ply", SPHERE, **{column: values})
        code, [line] = run("geodesic-distance", source, "--group", "seed")
        assert (code, text in line["error"]) == (1, True), line


class TestSimulate:
    POLE = at([0.0, 0.0, 1.0])

    def test_a_front_has_travelled_the_distance(self, run, tmp_path):
        points = np.vstack([[0.0, 0.0, 1.0], SPHERE])
        source, given = write(tmp_path / "a.ply", points), ("--kind", "front", "--distance", 1, "--width", 0.5)
        code, [line] = run("simulate", source, self.POLE, *given, "--frames", 4, "--out", tmp_path / "a.npz")
        assert (code, "the front travels 1, values 0 to 1" in line["done"]) == (0, True), line
        exact = np.clip(1.0 + 2.0 * (1.0 - np.arccos(points[:, 2])), 0.0, 1.0)
        assert_allclose(np.load(tmp_path / "a.npz")["motion"], exact, atol=0.1)

    def test_heat_becomes_even(self, run, tmp_path):
        given = "--distance", 30, "--width", 0.7, "--frames", 9
        source = write(tmp_path / "a.ply", SPHERE)
        code, [line] = run("simulate", source, self.POLE, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        found = np.load(tmp_path / "a.npz")["motion"]
        away = np.linspace(0.0, np.pi, 2001)
        mean = 0.5 * np.pi * np.mean(np.exp(-((away / 0.7) ** 2)) * np.sin(away))  # of the pulse, over the sphere
        assert_allclose(found, mean, rtol=0.02)

    def test_a_wave_returns_upside_down_to_where_it_began(self, run, tmp_path):
        """Once around a sphere: its frequencies are the roots of l (l + 1), nearly l + 1/2."""
        given = "--kind", "wave", "--distance", 2.0 * np.pi, "--width", 0.8, "--frames", 60
        source = write(tmp_path / "a.ply", SPHERE)
        code, [line] = run("simulate", source, self.POLE, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        found = np.load(tmp_path / "a.npz")["motion"]
        assert SPHERE[np.abs(found).argmax(), 2] > 0.9
        assert found.min() < -0.3

    def test_a_reaction_that_dies_is_told(self, run, tmp_path, monkeypatch):
        monkeypatch.setattr(motions, "_PATTERN_TIME", 500.0)
        source = write(tmp_path / "a.ply", SPHERE[::2])
        code, [line] = run("simulate", source, self.POLE, "--kind", "reaction", "--distance", 0.02, "--frames", 3)
        assert code == 0, line
        assert any("The reaction has died out" in notice for notice in line["notices"])


class TestFields:
    def test_between_two_sides_of_a_square_it_is_linear(self, run, tmp_path):
        x = SQUARE[:, 0]
        source = write(tmp_path / "a.ply", SQUARE, left=(x == 0.0).astype(int), High=(x == 1.0).astype(int))
        given = "--low-group", "left", "--high", 5
        code, [line] = run("harmonic-field", source, *given, "--out", tmp_path / "a.npz")
        assert (code, line["done"]) == (0, "a: a field from 0 to 5")
        assert_allclose(np.load(tmp_path / "a.npz")["field"], 5.0 * x, atol=0.02)

    def test_weights_are_values_and_a_source_is_poissons(self, run, tmp_path):
        """Of a sphere, z is an eigenfunction with the eigenvalue 2."""
        end = np.abs(SPHERE[:, 2]) > 0.9
        weight = np.where(end, 0.5 + 0.5 * SPHERE[:, 2], 0.0)
        source = write(tmp_path / "a.ply", SPHERE, load=2.0 * SPHERE[:, 2], weight=weight)
        given = "--group", "weight", "--low", -1, "--source", "load"
        code, [line] = run("harmonic-field", source, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        assert_allclose(np.load(tmp_path / "a.npz")["field"], SPHERE[:, 2], atol=0.04)
        code, [line] = run("harmonic-field", source, "--source", "load", "--group", "", "--out", tmp_path / "a.npz")
        assert code == 0, line
        assert_allclose(np.load(tmp_path / "a.npz")["field"], SPHERE[:, 2], atol=0.02)

    @pytest.mark.parametrize(
        ("names", "given", "text"),
        [
            ((), (), "no points with given values. Name columns of the file by --low-group"),
            (("Low",), (), 'Only the column "Low"'),
            (("Low", "High"), ("--high-group", "Low"), 'both in "Low" and in "Low"'),
            (("Low",), ("--values", "groups"), 'has no column "High"'),
        ],
    )
    def test_values_that_are_missing(self, run, tmp_path, names, given, text):
        columns = {name: (SQUARE[:, 0] == number).astype(int) for number, name in enumerate(names)}
        code, [line] = run("harmonic-field", write(tmp_path / "a.ply", SQUARE, **columns), *given)
        assert (code, text in line["error"]) == (1, True), line


class TestParts:
    def test_they_are_what_core_gives(self, run, tmp_path):
        points = SPHERE * [2.0, 0.8, 0.6]
        source, laplacian = write(tmp_path / "a.ply", points), core.build_laplacian(points)
        code, [line] = run("segment", source, "--parts", 3, "--out", tmp_path / "a.npz")
        assert (code, line["done"]) == (0, "a: 3 parts")
        assert_array_equal(np.load(tmp_path / "a.npz")["segment"], core.spectral.segment(laplacian, 3))
        code, [line] = run("segment", source, "--method", "nodal", "--out", tmp_path / "a.npz")
        assert (code, line["done"]) == (0, "a: 2 parts")
        parts = np.load(tmp_path / "a.npz")["segment"]
        clear = np.abs(points[:, 0]) > 0.2
        assert len({*zip(parts[clear].tolist(), (points[clear, 0] > 0.0).tolist(), strict=True)}) == 2

    def test_signatures_have_a_column_for_each_scale(self, run, tmp_path):
        source, laplacian = write(tmp_path / "a.ply", SPHERE), core.build_laplacian(SPHERE)
        for kind, signature in (
            ("heat", core.spectral.heat_kernel_signature),
            ("wave", core.spectral.wave_kernel_signature),
        ):
            given = "--kind", kind, "--count", 3, "--modes", 20
            code, [line] = run("signature", source, *given, "--out", tmp_path / "a.npz")
            assert (code, line["done"]) == (0, "a: signatures at 3 scales")
            found, exact = np.load(tmp_path / "a.npz"), signature(laplacian.eigenpairs(20), count=3)
            assert_array_equal(np.stack([found[f"{kind}_signature_{n:03d}"] for n in (1, 2, 3)], axis=1), exact)


class TestOrient:
    @pytest.mark.parametrize("flip", [False, True])
    def test_to_a_place_in_the_file(self, run, tmp_path, flip):
        source, place = write(tmp_path / "a.ply", SQUARE + FAR), at(FAR + [0.5, 0.5, -3.0], "viewpoint")
        code, [line] = run("orient", source, place, *(["--flip"] if flip else []), "--out", tmp_path / "b.ply")
        assert (code, line["done"]) == (0, "a: normals oriented")
        table = read_points(tmp_path / "b.ply")
        assert_array_equal(table.attributes["normal"][:, 2] > 0.0, np.full(len(SQUARE), flip))
        assert_allclose(table.attributes["lb_orientation"], table.attributes["normal"], atol=1e-6)
        code, [line] = run("orient", tmp_path / "b.ply", "--method", "keep", "--flip", "--out", tmp_path / "a.npz")
        assert code == 0, line
        found = np.load(tmp_path / "a.npz")
        assert_array_equal(found["normal"][:, 2] < 0.0, np.full(len(SQUARE), flip))
        assert_array_equal(found["orientation"], found["normal"])

    def test_curvature_has_the_sign_of_the_side(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE, inwards=-SPHERE)
        for method, sign in ((("--method", "winding"), 1.0), (("--source", "inwards", "--holds", "directions"), -1.0)):
            code, [line] = run("orient", source, *method, "--out", tmp_path / "a.npz")
            assert code == 0, line
            assert_allclose(np.load(tmp_path / "a.npz")["mean_curvature"], sign, atol=0.02)

    def test_by_the_place_of_the_scanner_at_each_point(self, run, tmp_path):
        left = SQUARE[:, 0] < 0.45
        apart = SQUARE + np.where(left, -2.0, 2.0)[:, None] * [1.0, 0.0, 0.0] + FAR  # two sheets, seen from two sides
        seen = apart + np.where(left, 5.0, -5.0)[:, None] * [0.0, 0.0, 1.0]
        code, [line] = run(
            "orient", write(tmp_path / "a.ply", apart, scanner=seen), "--source", "scanner", "--out", tmp_path / "a.npz"
        )
        assert code == 0, line
        assert_array_equal(np.load(tmp_path / "a.npz")["normal"][:, 2] > 0.0, left)
        up = np.where(left, 1.0, -1.0)[:, None] * [0.0, 0.0, 1.0]
        some = np.random.default_rng(0).random(len(SQUARE)) < 0.1
        for holds, vectors in (("positions", seen), ("directions", up)):
            source = write(tmp_path / "a.ply", apart, given=np.where(some[:, None], vectors, np.nan))
            options = "--source", "given", "--holds", holds, "--out", tmp_path / "a.npz"
            code, [line] = run("orient", source, *options)
            assert code == 0, line
            assert_array_equal(np.load(tmp_path / "a.npz")["normal"][:, 2] > 0.0, left)
            told = f'{np.count_nonzero(~some)} of {len(some)} points have no "given" (NaN).'
            assert any(notice.startswith(told) for notice in line["notices"])
        code, [line] = run("orient", write(tmp_path / "b.ply", SQUARE, none=np.nan * SQUARE), "--source", "none")
        assert (code, "is NaN at all 400 points" in line["error"]) == (1, True)
        code, [line] = run("orient", write(tmp_path / "b.ply", SQUARE, flat=SQUARE[:, 0]), "--source", "flat")
        assert (code, "holds no vectors" in line["error"]) == (1, True)


class TestMoving:
    def test_weights_of_a_column_and_digits_of_points_that_stay(self, run, tmp_path):
        """A third of the way is taken where the weight is 1/3, exactly."""
        rough = SPHERE * (1.0 + np.random.default_rng(1).normal(0.0, 0.03, (len(SPHERE), 1))) + FAR
        weight = np.where(SPHERE[:, 2] > 0.0, 1.0 / 3.0, 0.0)
        source, moved = write(tmp_path / "a.ply", rough, weight=weight), {}
        for name, chosen in (("all", ()), ("some", ("--group", "weight"))):
            code, [line] = run("smooth", source, *chosen, "--out", tmp_path / "b.ply")
            assert (code, line["done"].startswith("a: 800 points moved by 0.0")) == (0, True), line
            table = read_points(tmp_path / "b.ply")
            moved[name] = table.points - rough
            assert_array_equal(table.attributes["weight"], weight)
        assert_allclose(moved["some"], weight[:, None] * moved["all"], atol=2e-9)
        assert_array_equal(moved["some"][weight == 0.0], 0.0)

    @pytest.mark.parametrize("method", ["noise", "heat", "modes", "detail"])
    def test_methods_do_what_core_does(self, run, tmp_path, method):
        points = SPHERE * [1.0, 0.8, 0.6]
        given = "--method", method, "--wavelength", 0.8, "--modes", 20, "--gain", 0.5, "--keep", "volume"
        source = write(tmp_path / "a.ply", points)
        code, [line] = run("smooth", source, *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        found = np.load(tmp_path / "a.npz")["points"]
        laplacian, squared, low = core.build_laplacian(points), (0.8 / (2.0 * np.pi)) ** 2, (2.0 * np.pi / 0.8) ** 2
        full = {
            "noise": lambda: core.clean.fair_points(laplacian, squared),
            "heat": lambda: core.clean.smooth_points(laplacian, core.clean.exponential(np.log(2.0) * squared)),
            "modes": lambda: core.clean.smooth_points(laplacian, 20),
            "detail": lambda: core.clean.smooth_points(laplacian, core.clean.boost(0.5, low, 64.0 * low)),
        }[method]()
        assert_allclose(found, core.clean.PointBlend(laplacian, keep="volume")(full), atol=1e-9)
        code, [line] = run("smooth", source, "--wavelength", 9)
        assert (code, 'longer than "a" is large' in line["error"]) == (1, True)

    def test_a_size_is_not_kept_beside_a_boundary(self, run, tmp_path):
        code, [line] = run("smooth", write(tmp_path / "a.ply", SQUARE), "--keep", "area")
        assert (code, "There is a boundary" in line["error"]) == (1, True)

    def test_modes_move_along_normals_and_back(self, run, tmp_path):
        source, moved = write(tmp_path / "a.ply", SPHERE), []
        for phase in (0, 180):
            given = "--mode", 5, "--amplitude", 0.2, "--phase", phase
            code, [line] = run("mode-shape", source, *given, "--out", tmp_path / "a.npz")
            assert (code, line["done"]) == (0, "a: moved by mode 5, at most by 0.2")
            moved.append(np.load(tmp_path / "a.npz")["points"] - SPHERE)
        assert_allclose(moved[1], -moved[0], atol=1e-12)
        assert np.abs(np.cross(moved[0], SPHERE)).max() < 0.02

    def test_a_bumpy_square_becomes_flat_within_its_boundary(self, run, tmp_path):
        bump = 0.2 * np.prod(np.sin(np.pi * SQUARE[:, :2]), axis=1)[:, None] * [0.0, 0.0, 1.0]
        source = write(tmp_path / "a.ply", SQUARE + bump)
        code, [line] = run("minimal-surface", source, "--steps", 8, "--out", tmp_path / "a.npz")
        assert (code, line["done"].startswith("a: area from 1.")) == (0, True), line
        found = np.load(tmp_path / "a.npz")
        assert np.abs(found["points"][:, 2]).max() < 0.01
        edge = ((SQUARE == 0.0) | (SQUARE == 1.0))[:, :2].any(axis=1)
        assert_array_equal(found["points"][edge], (SQUARE + bump)[edge])
        assert_allclose(found["area_history"][-1], 1.0, atol=5e-3)
        assert 1 < len(found["area_history"]) <= 8
        assert run("minimal-surface", source, "--steps", 1, "--out", tmp_path / "a.npz")[0] == 0
        assert len(np.load(tmp_path / "a.npz")["area_history"]) == 1

    def test_a_column_says_what_stays(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE[::2], Fixed=(SPHERE[::2, 2] > -0.5).astype(int))
        code, [line] = run("minimal-surface", source, "--steps", 2, "--out", tmp_path / "b.ply")
        assert code == 0, line
        stays = SPHERE[::2, 2] > -0.5
        after = read_points(tmp_path / "b.ply").points
        assert_array_equal(after[stays], SPHERE[::2][stays])
        assert (after[~stays] != SPHERE[::2][~stays]).any()
        code, [line] = run("minimal-surface", write(tmp_path / "c.ply", SPHERE))
        assert (code, "has no boundary" in line["error"], '"Fixed"' in line["error"]) == (1, True, True)

    @pytest.mark.parametrize("verb", ["smooth", "mode-shape", "minimal-surface"])
    def test_splats_are_bent_with_their_points(self, run, tmp_path, verb):
        cap = SPHERE[SPHERE[:, 2] > 0.2]
        count = len(cap)
        splats = core.splats.Splats(
            positions=cap,
            scales=np.full((count, 3), [0.05, 0.05, 0.01]),
            rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            opacities=np.full(count, 0.9),
            colors=np.zeros((count, 3)),
            harmonics=np.zeros((count, 0, 3)),
        )
        core.splats.write_splats(tmp_path / "a.ply", splats)
        given = {"minimal-surface": ("--steps", 1)}.get(verb, ())
        code, [line] = run(verb, tmp_path / "a.ply", *given, "--out", tmp_path / "b.ply")
        assert (code, line["points"]) == (0, count), line
        found = core.splats.read_splats(tmp_path / "b.ply")
        assert np.abs(found.positions - cap).max() > 1e-6
        if verb != "smooth":  # which hardly moves points of a smooth surface
            assert np.abs(found.scales - splats.scales).max() > 1e-4


class TestTables:
    def test_a_section_leaves_in_the_coordinates_of_the_file(self, run, tmp_path):
        source, out = write(tmp_path / "a.ply", SPHERE + FAR), tmp_path / "out.csv"
        given = at(FAR + [0.0, 0.5, 0.0], "plane"), "--normal", "0,2,0", "--curves"
        code, [line] = run("section", source, *given, "--out", out)
        assert (code, line["curves"], line["open_curves"]) == (0, 1, 0), line
        assert line["length"] == pytest.approx(np.pi * np.sqrt(3.0), rel=5e-3)
        assert line["enclosed_area"] == pytest.approx(0.75 * np.pi, rel=5e-3)
        assert out.read_text().startswith("curve,length,enclosed_area,closed,hole\n1,")
        rows = np.loadtxt(tmp_path / "out_curves.csv", delimiter=",", skiprows=1)
        assert_allclose(rows[:, 3], FAR[1] + 0.5, rtol=0.0, atol=1e-6)
        assert_allclose(np.linalg.norm(rows[:, 2:] - FAR, axis=1), 1.0, atol=3e-3)
        assert run("section", source, "--curves")[0] == 2

    def test_a_hole_and_an_open_curve_have_rows_of_their_own(self, run, tmp_path):
        open_one = SPHERE[SPHERE[:, 1] > 0.0] + [4.0, 0.0, 0.0]
        source = write(tmp_path / "a.ply", np.concatenate([SPHERE, 0.6 * SPHERE, open_one]))
        code, [line] = run("section", source, "--plane", "0,0,0", "--out", tmp_path / "a.json")
        assert code == 0, line
        kinds = {(row["closed"], row["hole"]): row for row in json.loads((tmp_path / "a.json").read_text())}
        assert kinds[1, 0]["length"] == pytest.approx(2.0 * np.pi, rel=5e-3)
        assert kinds[1, 1]["enclosed_area"] == pytest.approx(0.36 * np.pi, rel=1e-2)
        assert (kinds[0, 0]["enclosed_area"], kinds[0, 0]["length"]) == (0.0, pytest.approx(np.pi, rel=0.05))

    def test_without_a_plane_it_cuts_the_middle_and_says_so(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE)
        code, [line] = run("section", source, "--out", tmp_path / "a.json")
        assert (code, any("no --plane is given" in notice for notice in line["notices"])) == (0, True)
        [row] = json.loads((tmp_path / "a.json").read_text())
        assert row["length"] == pytest.approx(2.0 * np.pi, rel=5e-3)
        code, [line] = run("section", source, "--plane", "0,0,7")
        assert (code, 'beside the surface of "a"' in line["error"]) == (1, True)

    def test_a_profile_of_heights_and_of_a_column(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE + FAR, wide=SPHERE[:, 0], row=np.arange(800))
        ends = at(FAR + [0.0, 0.0, 1.0], "from"), at(FAR + [1.0, 0.0, 0.0], "to")
        code, [line] = run("profile", source, *ends, "--out", tmp_path / "out.csv", "--svg")
        assert code == 0, line
        assert line["length"] == pytest.approx(0.5 * np.pi, abs=0.1)
        assert max(line["distances_of_ends"]) < 0.1
        rows = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
        assert_allclose(np.linalg.norm(rows[:, 1:4] - FAR, axis=1), 1.0, atol=5e-3)
        assert_allclose(rows[[0, -1], 1:4], line["ends"], rtol=0.0, atol=1e-4)
        assert_allclose(rows[:, 4], rows[:, 3], rtol=0.0, atol=1e-6)
        assert ">Height<" in (tmp_path / "out.svg").read_text()
        code, [line] = run("profile", source, *ends, "--source", "wide", "--out", tmp_path / "out.csv")
        rows = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
        assert_allclose(rows[:, 6], rows[:, 1] - FAR[0], atol=0.03)
        code, [line] = run("profile", source, *ends, "--source", "row")
        assert (code, "not one number at each point that changes" in line["error"]) == (1, True)
        code, [line] = run("profile", source, ends[0], ends[0].replace("from", "to"))
        assert (code, "same point" in line["error"]) == (1, True)


class TestTransferAttributes:
    def test_numbers_are_averaged_labels_are_not_and_digits_stay(self, run, tmp_path):
        points, again = np.vstack([SPHERE[::2], SPHERE[1::2] + [40.0, 0.0, 0.0]]), random_sphere(500, 4)
        shifts = [core.files.choose_origin(cloud + FAR) for cloud in (points, again)]
        assert (shifts[0] != shifts[1]).any()  # so that both are read with origins of their own
        time = 4e8 + points[:, 2]  # more digits than single precision has
        gray = 0.5 + 0.5 * points[:, 2:]
        tint = np.hstack([gray, gray, gray, np.ones((800, 1))]).astype(np.float32)
        table = PointTable(points + FAR, {"time": time, "part": (points[:, 0] > 0.0).astype(np.int32)}, tint)
        write_points(tmp_path / "given.ply", table)
        source = write(tmp_path / "a.ply", again + FAR, row=np.arange(500))
        code, [line] = run(
            "transfer-attributes", source, "--reference", tmp_path / "given.ply", "--out", tmp_path / "b.ply"
        )
        assert (code, line["taken_count"]) == (0, 500), line
        assert f"a: 100.0% of the points take 3 attributes from {tmp_path / 'given.ply'}" in line["done"]
        found = read_points(tmp_path / "b.ply")
        assert_allclose(found.attributes["time"] - 4e8, again[:, 2], atol=0.02)
        clear = np.abs(again[:, 0]) > 0.1
        assert_array_equal(found.attributes["part"][clear], (again[:, 0] > 0.0)[clear])
        assert_allclose(found.colors[:, 0], 0.5 + 0.5 * again[:, 2], atol=0.03)
        assert_array_equal(found.attributes["row"], np.arange(500))
        assert (found.attributes["lb_transfer"] == 1).all()

    def test_by_name_and_far_away(self, run, tmp_path):
        given = write(tmp_path / "given.ply", SPHERE, heat=SPHERE[:, 2], lb_cell=np.arange(800))
        source = write(tmp_path / "a.ply", SPHERE[::2])
        named = "--attributes", "names", "--pattern", "lb_*", "--out", tmp_path / "a.npz"
        code, [line] = run("transfer-attributes", source, "--reference", given, *named)
        assert code == 0, line
        found = np.load(tmp_path / "a.npz")
        assert set(found.files) == {"points", "cell", "transfer"}
        assert_array_equal(found["cell"], np.arange(800)[::2])
        code, [line] = run("transfer-attributes", source, "--reference", given, "--attributes", "color")
        assert (code, "has no colors" in line["error"]) == (1, True)
        away = write(tmp_path / "away.ply", SPHERE + [9.0, 0.0, 0.0])
        code, [line] = run("transfer-attributes", away, "--reference", given)
        assert (code, 'No point of "away" lies within' in line["error"]) == (1, True)

    @pytest.mark.parametrize("verb", ["transfer-attributes", "compare"])
    def test_errors_of_the_reference_name_it(self, run, tmp_path, verb):
        plan = write(tmp_path / "plan.ply", SPHERE[:2], heat=SPHERE[:2, 0])
        inputs = [write(tmp_path / f"{name}.ply", SPHERE) for name in "ab"]
        code, lines = run(verb, *inputs, "--reference", plan)
        assert (code, [line["error"].count(str(plan)) for line in lines]) == (1, [1, 1])

    def test_colors_go_to_linear_ones_and_back(self):
        given = np.column_stack([np.linspace(0.0, 1.0, 64)[:, None] * [1.0, 0.5, 0.1], np.full(64, 0.3)])
        assert_allclose(colors.srgb(colors.linear(given)), given, atol=1e-7)
        assert_allclose(colors.linear(np.array([[0.5, 0.02, 1.0, 0.7]])), [[0.214041, 0.00154799, 1.0, 0.7]], rtol=1e-5)


@pytest.mark.parametrize(
    "arguments",
    [
        ("orient", "a.csv", "--viewpoint", "0,0,1", "--method", "winding"),
        ("orient", "a.csv", "--source", "normal", "--method", "viewpoint"),
        ("orient", "a.csv", "--method", "viewpoint"),
        ("orient", "a.csv", "--method", "attribute"),
        ("orient", "a.csv", "--viewpoint", "Camera"),
        ("geodesic-distance", "a.csv"),
        ("geodesic-distance", "a.csv", "--at", "1,2"),
        ("nearest-source", "a.csv", "--at", "1,2,3", "--group", "seed"),
        ("extend-direction", "a.csv", "--at", "1,2,3", "--direction", "up"),
        ("unwrap", "a.csv", "--at", "1,2,3", "--radius", "nan"),
        ("signed-distance", "a.csv"),
        ("simulate", "a.csv", "--at", "1,2,3", "--kind", "rain"),
        ("smooth", "a.csv", "--strength", "2"),
        ("mode-shape", "a.csv", "--mode", "0"),
        ("minimal-surface", "a.csv", "--steps", "0"),
        ("section", "a.csv", "--out", "a.ply"),
        ("profile", "a.csv", "--from", "0,0,1"),
        ("profile", "a.csv", "--from", "0,0,1", "--to", "1,0,0", "--svg"),
    ],
    ids=" ".join,
)
def test_wrong_usage(run, arguments):
    assert run(*arguments) == (2, [])


NEEDED = {
    "align": ("--reference", "plan.ply"),
    "compare": ("--reference", "plan.ply"),
    "transfer-attributes": ("--reference", "plan.ply"),
    "signed-distance": ("--curve", "plan.ply"),
    "profile": ("--from", "0,0,1", "--to", "1,0,0"),
    **dict.fromkeys(
        ("geodesic-distance", "nearest-source", "unwrap", "extend-direction", "simulate"), ("--at", "0,0,1")
    ),
}
CLOUD_VERBS = [verb for verb in verbs.make_verbs() if isinstance(verb, CloudVerb)]


@pytest.mark.parametrize("verb", CLOUD_VERBS, ids=lambda verb: verb.name)
def test_exit_codes_are_those_of_a_farm(run, tmp_path, monkeypatch, verb):
    """A broken file is told, in a report without a failure; a want of memory goes elsewhere; what is done stays so."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "plan.ply", SPHERE[::2])
    (tmp_path / "a.ply").write_bytes(b"nothing")
    given = verb.name, "a.ply", *NEEDED.get(verb.name, ())
    code, [line] = run(*given)
    assert (code, "a.ply" in line["error"]) == (1, True)
    assert run(*given, "--report", "r.jsonl")[0] == 0

    def scarce(*_, **__):
        raise core.NotEnoughMemoryError("Too little memory.")

    monkeypatch.setattr(core.files, "read_points", scarce)
    monkeypatch.setattr(core.splats, "read_file", scarce)
    assert run(*given, "--report", "r.jsonl")[0] == 3


@pytest.mark.parametrize("verb", CLOUD_VERBS, ids=lambda verb: verb.name)
def test_help_names_units_and_defaults(verb, capsys):
    assert run_command([verb.name, "--help"], [verb], "meshfree") == 0
    shown = " ".join(capsys.readouterr().out.split())
    if verb.settings:
        assert "(default " in shown
    for setting in verb.settings:
        option = f"--{setting.name.replace('_', '-')}"
        assert option in shown
        assert not setting.form or f"{option} {setting.form}" in shown
