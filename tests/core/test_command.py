"""The command line without Blender: verbs on clouds of files, by the function that the program calls."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import core
from benchmarks.samplings import fibonacci_sphere, square_grid
from command import verbs
from command.colors import linear
from command.line import run as run_command
from core.files import PointTable, read_points, write_points
from tools.mesh_surface import close_gaps
from tools.quantities import rows_of

FAR = np.array([400_000.0, 5_000_000.0, 100.0])
SPHERE = fibonacci_sphere(800)


def write(path, points, **columns):
    """Write points with columns, exactly."""
    write_points(path, PointTable(points, columns))
    return path


class TestAnalyze:
    def test_it_gives_what_core_gives_to_the_bit(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE)
        code, [line] = run("analyze", source, "--modes", 4, "--out", tmp_path / "a.npz")
        assert code == 0
        laplacian = core.build_laplacian(SPHERE)
        spectrum = laplacian.eigenpairs(4)
        assert (line["points"], line["total_area"]) == (800, float(laplacian.areas.sum()))
        assert line["eigenvalues"] == spectrum.eigenvalues.tolist()
        assert (line["component_count"], line["boundary_count"], line["left_out_count"]) == (1, 0, 0)
        found = np.load(tmp_path / "a.npz")
        assert_array_equal(found["points"], SPHERE)
        for name in ("areas", "normals", "trust", "smoothing_lengths", "gaussian_curvature"):
            assert_array_equal(found[name], getattr(laplacian, name))
        assert_array_equal(found["eigenvectors"], spectrum.eigenvectors)
        assert_array_equal(found["mean_curvature"], core.measure.mean_curvature(laplacian))

    def test_a_file_of_points_keeps_its_columns_and_its_place(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE + FAR, heat=SPHERE[:, 0], normal=-SPHERE)
        assert run("analyze", source, "--modes", 3, "--write-limit", 2, "--out", tmp_path / "b.ply")[0] == 0
        table = read_points(tmp_path / "b.ply")
        assert_array_equal(table.points, SPHERE + FAR)
        assert_array_equal(table.attributes["heat"], SPHERE[:, 0])
        assert_allclose(table.attributes["normal"], SPHERE, atol=0.01)
        assert table.attributes["lb_area"].sum() == pytest.approx(4.0 * np.pi, rel=1e-3)
        assert {"lb_eigenvector_002", "lb_boundary", "lb_doubt"} < table.attributes.keys()
        assert not {"lb_eigenvector_003", "lb_normal"} & table.attributes.keys()

    def test_settings_and_a_boundary_by_a_column(self, run, tmp_path):
        points = square_grid(20)
        edge = ((points == 0.0) | (points == 1.0))[:, :2].any(axis=1)
        source = write(tmp_path / "a.ply", points, edge=edge.astype(np.int32))
        code, [line] = run("analyze", source, "--boundary", "off", "--boundary-group", "edge")
        assert (code, line["boundary_count"]) == (0, np.count_nonzero(edge))
        code, [line] = run("analyze", source, "--boundary-group", "rim")
        assert (code, "Its columns are edge" in line["error"]) == (1, True)
        code, [line] = run("analyze", source, "--laplacian", "paper", "--neighbors", 60)
        paper = core.paper.build_laplacian(points, neighbors=60)
        assert line["total_area"] == pytest.approx(paper.areas.sum(), rel=1e-9)

    def test_normals_keep_the_side_that_a_file_names(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE, lb_orientation=-SPHERE)
        assert run("analyze", source, "--out", tmp_path / "a.npz")[0] == 0
        found = np.load(tmp_path / "a.npz")
        assert (np.einsum("ij,ij->i", found["normals"], SPHERE) < 0.0).all()
        assert (found["mean_curvature"] < 0.0).all()

    def test_modes_of_frames_continue(self, run, tmp_path):
        for number, length in enumerate((0.85, 1.0, 1.15)):
            write(tmp_path / f"frame_{number}.ply", SPHERE * [length, 1.0, 0.6])
        code, lines = run("analyze", "--sequence", tmp_path, "--modes", 4)
        assert (code, len(lines)) == (0, 3)
        assert min(min(line["overlaps"]) for line in lines) > 0.9
        assert lines[2]["eigenvalues"][1] > lines[2]["eigenvalues"][2]  # they have crossed
        assert run("analyze", "--sequence", tmp_path)[0] == 2


class TestCleaning:
    def test_stray_points_are_marked_or_deleted(self, run, tmp_path):
        points = np.vstack([SPHERE, [[0.0, 0.0, 3.0], [3.0, 0.0, 0.0]]])
        source = write(tmp_path / "a.ply", points, row=np.arange(802))
        code, [line] = run("stray-points", source, "--out", tmp_path / "b.ply")
        assert (code, line["points"]) == (0, 802)
        assert line["done"].startswith("a: 2 of 802 points are stray")
        assert_array_equal(read_points(tmp_path / "b.ply").attributes["lb_stray"], np.arange(802) >= 800)
        code, [line] = run("stray-points", source, "--action", "delete", "--out", tmp_path / "c.ply")
        assert (code, line["points"]) == (0, 800)
        assert_array_equal(read_points(tmp_path / "c.ply").attributes["row"], np.arange(800))

    def test_thinned_points_keep_distance_and_columns(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE, row=np.arange(800))
        code, [line] = run("thin-out", source, "--spacing", 0.3, "--out", tmp_path / "b.ply")
        table = read_points(tmp_path / "b.ply")
        apart = np.linalg.norm(table.points[:, None] - table.points, axis=2) + 9.0 * np.eye(len(table.points))
        assert (code, line["points"]) == (0, len(table.points))
        assert 0.3 <= apart.min() < 0.4
        assert_array_equal(table.points, SPHERE[table.attributes["row"].astype(int)])
        code, [line] = run("thin-out", source, "--by", "number", "--count", 99)
        assert line["points"] <= 99


class TestMeasure:
    def test_components_segments_and_means(self, run, tmp_path):
        small = fibonacci_sphere(400)
        both = np.vstack([small, small + [5.0, 0.0, 0.0]])
        columns = {"lb_segment": np.repeat([0, 1, 0, 1], 200), "height": both[:, 0]}
        source = write(tmp_path / "a.ply", both, **columns)
        code, [line] = run("measure", source, "--source", "height", "--out", tmp_path / "a.csv")
        assert code == 0
        rows = {row["name"]: row for row in line["parts"]}
        assert rows.keys() == {"Component 0", "Component 1", "Segment 0", "Segment 1"}
        for name, mean in (("Component 0", 0.0), ("Component 1", 5.0)):
            assert rows[name]["area"] == pytest.approx(4.0 * np.pi, abs=rows[name]["area_uncertainty"])
            assert rows[name]["volume"] == pytest.approx(4.0 * np.pi / 3.0, rel=5e-3)
            assert rows[name]["mean"] == pytest.approx(mean, abs=0.01)
        assert (tmp_path / "a.csv").read_text().startswith("name,points,area,")
        assert all(row["volume"] is None for row in run("measure", source, "--no-volume")[1][0]["parts"])

    @pytest.mark.parametrize(
        ("column", "values", "text"),
        [("lb_segment", np.full(800, -1), "names no parts"), ("height", SPHERE, "3 numbers at each point")],
    )
    def test_columns_that_cannot_be_used(self, run, tmp_path, column, values, text):
        source = write(tmp_path / "a.ply", SPHERE, **{column: values})
        code, [line] = run("measure", source, *(["--source", column] if column == "height" else []))
        assert (code, text in line["error"], str(source) in line["error"]) == (1, True, True)

    def test_volumes_over_a_plane_and_over_another_cloud(self, run, tmp_path):
        places = np.random.default_rng(1).uniform(-1.6, 1.6, (2, 1500, 2))
        heap, ground = (np.column_stack([xy, 0.0 * xy[:, 0]]) for xy in places)
        heap[:, 2] = np.maximum(0.5 * (1.0 - np.hypot(*heap[:, :2].T)), 0.0)
        far = FAR + [7.0, 0.0, 0.0]
        source, plan = write(tmp_path / "a.ply", heap + FAR), write(tmp_path / "plan.ply", ground * 1.1 + FAR)
        plane = f"--plane={','.join(map(repr, np.asarray(FAR, dtype=float).tolist()))}"
        for base in ([plane], ["--reference", plan]):
            code, [line] = run("measure", source, *base, "--no-volume", "--out", tmp_path / "b.csv")
            assert code == 0, line
            [row] = line["parts"]
            assert row["above"] == pytest.approx(np.pi / 6.0, rel=0.03)
            assert row["difference"] == row["above"] - row["below"]
            assert 0.0 < row["difference_uncertainty"] < 0.05 * row["above"]
            assert row["below"] < 0.01
            head, values = (tmp_path / "b.csv").read_text().splitlines()[:2]
            assert dict(zip(head.split(","), values.split(","), strict=True))["above"] == repr(row["above"])
        code, [line] = run("measure", source, plane, "--normal=0,0,-1", "--no-volume")
        assert (code, line["parts"][0]["below"]) == (0, pytest.approx(np.pi / 6.0, rel=0.03))
        assert "above" not in run("measure", source, "--no-volume")[1][0]["parts"][0]
        away = write(tmp_path / "away.ply", ground + far)
        code, [line] = run("measure", source, "--reference", away, "--no-volume")
        assert (code, "has the other surface above or below it" in line["error"]) == (1, True)
        assert run("measure", source, "--normal=0,0,1")[0] == 2
        both = write(tmp_path / "both.ply", np.concatenate([heap, heap[::2] + [9.0, 0.0, 0.0]]) + FAR)
        code, [line] = run("measure", both, "--reference", plan, "--no-volume")
        assert [part["above"] is None for part in line["parts"]] == [False, True]
        assert any(notice.startswith("Component 1: None of the ") for notice in line["notices"])

    def test_a_missing_piece_of_a_heap_is_told(self, run, tmp_path):
        xy = np.random.default_rng(1).uniform(-1.6, 1.6, (2500, 2))
        heap = np.column_stack([xy, np.maximum(0.5 * (1.0 - np.hypot(*xy.T)), 0.0)])
        source = write(tmp_path / "a.ply", heap[~(xy > 0.0).all(axis=1)])
        code, [line] = run("measure", source, "--plane=0,0,0", "--no-volume")
        assert code == 0, line
        assert any(notice.startswith("Component 0: The surface ends within") for notice in line["notices"])


class TestAlign:
    def test_points_normals_and_scanner_move_to_the_reference(self, run, tmp_path):
        body = SPHERE * [1.0, 0.8, 0.6] * (1.2 - 0.3 * np.exp(-((SPHERE - [1, 1, 0]) ** 2).sum(axis=1)))[:, None]
        turn, _ = np.linalg.qr([[0.995, -0.0998, 0.01], [0.0998, 0.995, 0.0], [0.0, 0.02, 1.0]])
        turn *= np.sign(np.diag(turn))
        scanner, shift = np.tile([0.0, 0.0, 9.0], (800, 1)), np.array([0.05, 0.0, -0.05])
        there = {"normal": SPHERE @ turn, "scanner": (scanner - shift) @ turn + FAR}
        source = write(tmp_path / "a.ply", (body - shift) @ turn + FAR, **there)
        plan = write(tmp_path / "plan.ply", body + FAR)
        code, [line] = run("align", source, "--reference", plan, "--out", tmp_path / "b.ply")
        assert code == 0, line
        assert line["converged"]
        table = read_points(tmp_path / "b.ply")
        assert_allclose(table.points - FAR, body, atol=1e-3)
        assert_allclose(table.attributes["normal"], SPHERE, atol=1e-3)
        assert_allclose(table.attributes["scanner"] - FAR, scanner, atol=1e-2)
        matrix = np.array(line["matrix"])
        assert_allclose(read_points(source).points @ matrix[:3, :3].T + matrix[:3, 3], table.points, atol=1e-6)
        assert run("align", source, "--reference", plan, "--out", plan)[0] == 1


class TestResults:
    @pytest.mark.parametrize(
        ("verb", "expected"),
        [
            ("principal-curvatures", core.measure.principal_curvatures),
            ("surface-variation", core.measure.surface_variation),
            ("roughness", core.clean.roughness),
        ],
    )
    def test_they_are_what_core_gives_to_the_bit(self, run, tmp_path, verb, expected):
        points = SPHERE * [1.0, 0.8, 0.6]
        source = write(tmp_path / "a.ply", points, row=np.arange(800))
        code, [line] = run(verb, source, "--out", tmp_path / "a.npz")
        assert (code, line["points"], line["done"].startswith("a: ")) == (0, 800, True)
        found, exact = np.load(tmp_path / "a.npz"), expected(core.build_laplacian(points))
        rows = rows_of(verb.replace("-", "_"))
        assert set(found.files) == {"points", *(row.attribute.removeprefix("lb_") for row in rows)}
        for row in rows:
            values = row.of(exact) if row.source else exact
            assert_array_equal(found[row.attribute.removeprefix("lb_")], values)
        assert run(verb, source, "--out", tmp_path / "b.ply")[0] == 0
        assert {"row", *(row.attribute for row in rows)} == set(read_points(tmp_path / "b.ply").attributes)

    def test_wavelengths_beyond_the_cloud_are_refused(self, run, tmp_path):
        code, [line] = run("roughness", write(tmp_path / "a.ply", SPHERE), "--wavelength", 99)
        assert (code, 'longer than "a" is large' in line["error"]) == (1, True)


class TestCompare:
    def test_distances_have_the_sign_of_the_side(self, run, tmp_path):
        plan = write(tmp_path / "plan.ply", SPHERE + FAR)
        sources = [write(tmp_path / f"{size}.ply", size * fibonacci_sphere(700) + FAR) for size in (0.95, 1.05)]
        code, lines = run("compare", *sources, "--reference", plan, "--out-dir", tmp_path / "out")
        assert code == 0, lines
        for line, exact in zip(lines, (-0.05, 0.05), strict=True):
            assert line["compared_count"] == 700
            assert line["mean_distance"] == pytest.approx(0.05, abs=1e-3)
            found = read_points(Path(line["output"])).attributes
            assert_allclose(found["lb_deviation"], exact, atol=2e-3)
            assert found["lb_compared"].all()

    def test_what_is_far_is_told_and_what_is_moved_is_written_there(self, run, tmp_path):
        plan = write(tmp_path / "plan.ply", SPHERE * [1.0, 0.8, 0.6])
        source = write(tmp_path / "a.ply", (SPHERE * [1.0, 0.8, 0.6])[::2] + [0.1, 0.0, 0.05])
        code, [line] = run("compare", source, "--reference", plan, "--align-first", "--out", tmp_path / "b.ply")
        assert (code, line["greatest_distance"] < 0.01) == (0, True)
        moved = read_points(tmp_path / "b.ply").points
        assert_allclose(((moved / [1.0, 0.8, 0.6]) ** 2).sum(axis=1), 1.0, atol=0.02)
        code, [line] = run("compare", source, "--reference", plan, "--greatest", 0.05)
        assert (code, line["compared_count"] < 400) == (0, True)
        assert any("they are not compared" in notice for notice in line["notices"])

    def test_birds_over_the_ground_take_no_part(self, run, tmp_path):
        rng = np.random.default_rng(7)
        ground, later = (np.pad(rng.uniform(-5.0, 5.0, (1200, 2)), ((0, 0), (0, 1))) for _ in range(2))
        birds = np.column_stack([rng.uniform(-4.0, 4.0, (20, 2)), rng.uniform(2.0, 6.0, 20)])
        plan = write(tmp_path / "plan.ply", ground + FAR)
        source = write(tmp_path / "a.ply", np.concatenate([later - [0.0, 0.0, 0.05], birds]) + FAR)
        code, [line] = run("compare", source, "--reference", plan, "--out", tmp_path / "b.ply")
        assert (code, line["greatest_distance"] < 0.06) == (0, True)
        found = read_points(tmp_path / "b.ply").attributes
        assert not found["lb_compared"][1200:].any()
        known = found["lb_compared"].astype(bool)
        assert_allclose(found["lb_deviation"][known], -0.05, atol=2e-3)
        assert any(notice.startswith("20 of 1,220 points are outliers") for notice in line["notices"])
        code, [line] = run("compare", source, "--reference", plan, "--distance", "nearest", "--out", tmp_path / "b.ply")
        assert (code, line["compared_count"]) == (0, 1220)
        found = read_points(tmp_path / "b.ply").attributes["lb_deviation"]
        assert_allclose(found[1200:], birds[:, 2], rtol=0.02)
        assert found.min() >= 0.0

    def test_notices_of_both_analyses_are_told(self, run, tmp_path):
        rough = SPHERE * (1.0 + 0.01 * np.random.default_rng(2).normal(size=(800, 1)))
        plan, source = (write(tmp_path / f"{name}.ply", rough) for name in ("plan", "a"))
        _, [line] = run("compare", source, "--reference", plan)
        told = [notice for notice in line["notices"] if "Noise of" in notice]
        assert [notice.startswith("plan.ply: ") for notice in told] == [False, True]

    def test_a_sign_in_doubt_is_told_until_a_side_is_chosen(self, run, tmp_path):
        rng = np.random.default_rng(3)
        walls = [np.column_stack([np.full(500, x), *rng.uniform(-1.0, 1.0, (2, 500))]) for x in (0.0, 0.1)]
        plan, source = (write(tmp_path / f"{name}.ply", wall) for name, wall in zip(("plan", "a"), walls, strict=True))

        def compared(source, plan, *more):
            code, [line] = run("compare", source, "--reference", plan, "--out", tmp_path / "b.ply", *more)
            assert code == 0, line
            found = read_points(tmp_path / "b.ply").attributes
            return found["lb_deviation"][found["lb_compared"] > 0], [
                n for n in line["notices"] if "sign is in doubt" in n
            ]

        assert len(compared(source, plan)[1]) == 1
        assert compared(source, plan, "--distance", "nearest")[1] == []
        sided = []
        for number, file in enumerate((source, plan)):
            sided.append(tmp_path / f"sided_{number}.ply")
            assert run("orient", file, "--viewpoint", "5,0,0", "--out", sided[-1])[0] == 0
        for pair in (sided[0], plan), (source, sided[1]), tuple(sided):
            distance, told = compared(*pair)
            assert told == []
            assert_allclose(distance, 0.1, atol=1e-3)

    def test_the_side_of_a_body_counts_where_a_part_has_none(self, run, tmp_path):
        """A scan of one wall of a room that is known as a whole."""
        sides = np.insert(square_grid(18)[:, :2] - 0.5, 0, 0.5, axis=1)
        turns = [np.eye(3), np.diag([-1.0, 1.0, -1.0]), *(np.roll(np.eye(3), k, axis=1) for k in (1, 2))]
        turns += [np.diag([-1.0, -1.0, -1.0]) @ turn for turn in turns[2:]]
        plan = write(
            tmp_path / "plan.ply", np.unique(np.concatenate([sides @ turn for turn in turns]).round(9), axis=0)
        )
        wall = np.random.default_rng(8).uniform(-0.3, 0.3, (500, 3))
        for x in 0.52, 0.47:
            wall[:, 0] = x
            code, [line] = run(
                "compare", write(tmp_path / "a.ply", wall), "--reference", plan, "--out", tmp_path / "b.ply"
            )
            assert code == 0, line
            assert not any("sign" in notice for notice in line["notices"])
            assert_allclose(read_points(tmp_path / "b.ply").attributes["lb_deviation"], x - 0.5, atol=2e-3)


class TestMesh:
    def test_a_closed_surface_with_columns_and_colors(self, run, tmp_path):
        height = 0.5 + 0.5 * SPHERE[:, 2]
        colors = np.column_stack([height, height, height, np.ones(800)]).astype(np.float32)
        table = PointTable(SPHERE + FAR, {"height": height, "side": (SPHERE[:, 0] > 0.0).astype(np.int32)}, colors)
        write_points(tmp_path / "a.ply", table)
        code, [line] = run("mesh", tmp_path / "a.ply", "--out", tmp_path / "b.ply")
        assert (code, line["open_edges"]) == (0, 0)
        mesh = read_points(tmp_path / "b.ply")
        points = mesh.points - FAR
        assert len(points) == line["vertices"]
        assert_allclose(np.linalg.norm(points, axis=1), 1.0, atol=5e-3)
        assert_allclose(mesh.attributes["height"], 0.5 + 0.5 * points[:, 2], atol=0.01)
        assert_allclose(mesh.colors[:, 0], 0.5 + 0.5 * points[:, 2], atol=0.02)
        assert set(mesh.attributes["side"]) == {0, 1}

    def test_colors_are_averaged_as_light(self, run, tmp_path):
        """Of black and white points, as in Blender; in sRGB their mean would be a darker gray."""
        given = np.ones((800, 4), np.float32)
        given[:, :3] = (np.random.default_rng(3).random(800) < 0.5)[:, None]
        write_points(tmp_path / "a.ply", PointTable(SPHERE, colors=given))
        code, _ = run("mesh", tmp_path / "a.ply", "--out", tmp_path / "b.ply")
        mesh = read_points(tmp_path / "b.ply")
        carrying = core.surface.values_on_mesh(core.build_laplacian(SPHERE), mesh.points)
        exact = np.clip(carrying.interpolate(given.astype(float))[-len(mesh.points) :], 0.0, 1.0)
        assert code == 0
        assert ((exact > 0.3) & (exact < 0.7)).any()
        assert_allclose(linear(mesh.colors), exact, atol=0.01)

    @pytest.mark.parametrize(("removed", "closed"), [([44], 2), ([44, 45, 46], 6), ([11, 88], 4), ([44, 55], 0)])
    def test_small_holes_of_a_mesh_are_closed(self, removed, closed):
        """Of a torus of quads, whose Euler characteristic stays zero; where two holes touch at a vertex, both stay."""
        row, column = np.divmod(np.arange(100), 10)
        corner = lambda down, right: 10 * ((row + down) % 10) + (column + right) % 10  # noqa: E731
        whole = np.stack([corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)], axis=1)
        faces = np.delete(whole, removed, axis=0)
        triangles, left = close_gaps(faces)
        assert (len(triangles), left) == (closed, 0 if closed else 8)
        sides = [np.stack([part, np.roll(part, -1, axis=1)], axis=2).reshape(-1, 2) for part in (faces, triangles)]
        edges = [tuple(edge) for edge in np.concatenate(sides).tolist()]
        assert len(set(edges)) == len(edges)  # so all faces are oriented alike
        if closed:
            assert {(end, begin) for begin, end in edges} == set(edges)
            assert 100 - len(edges) // 2 + len(faces) + len(triangles) == 0
        assert len(close_gaps(faces, most=3)[0]) == 0


class TestFiles:
    def test_points_go_from_kind_to_kind(self, run, tmp_path):
        source = write(tmp_path / "a.ply", SPHERE, heat=SPHERE[:, 1], row=np.arange(800))
        before = "a.ply"
        for name in ("a.csv", "b.xyz", "c.ply", "d.npz"):
            code, [line] = run("convert", tmp_path / before, "--out", tmp_path / name)
            assert (code, line["points"], line["output"]) == (0, 800, str(tmp_path / name))
            before = name if name != "b.xyz" else before  # which has no names
        assert_array_equal(np.load(tmp_path / "d.npz")["row"], np.arange(800))
        assert_allclose(np.load(tmp_path / "d.npz")["points"], read_points(source).points, rtol=0.0, atol=1e-15)
        colors = np.linspace(0.0, 1.0, 3200, dtype=np.float32).reshape(800, 4)
        write_points(tmp_path / "e.ply", PointTable(SPHERE, colors=colors))
        assert run("convert", tmp_path / "e.ply", "--out", tmp_path / "e.npz")[0] == 0
        assert_allclose(np.load(tmp_path / "e.npz")["colors"], colors, atol=0.5 / 255.0)
        assert run("convert", source)[1][0]["error"].startswith("Nothing would be written")

    def test_a_summary(self, run, tmp_path):
        code, [line] = run("info", write(tmp_path / "a.ply", SPHERE + FAR, heat=SPHERE[:, 1]))
        assert (code, line["points"], line["columns"], line["colors"]) == (0, 800, ["heat"], False)
        assert_allclose(line["low"], (SPHERE + FAR).min(axis=0), rtol=1e-15)
        assert_allclose(line["high"], (SPHERE + FAR).max(axis=0), rtol=1e-15)
        assert line["spacing"] == pytest.approx(np.sqrt(4.0 * np.pi / 800), rel=0.1)

    def test_splats_stay_splats(self, run, tmp_path):
        count = len(SPHERE)
        splats = core.splats.Splats(
            positions=SPHERE,
            scales=np.full((count, 3), 0.05),
            rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            opacities=np.where(np.arange(count) < 5, 0.001, 0.9),
            colors=np.zeros((count, 3)),
            harmonics=np.zeros((count, 0, 3)),
        )
        core.splats.write_splats(tmp_path / "a.ply", splats)
        code, [line] = run("analyze", tmp_path / "a.ply", "--out", tmp_path / "b.ply")
        assert (code, line["left_out_count"]) == (0, 5)
        assert any("Floaters left out" in notice for notice in line["notices"])
        assert run("analyze", tmp_path / "a.ply", "--no-leave-out-floaters")[1][0]["left_out_count"] == 0
        found = core.splats.read_splats(tmp_path / "b.ply")
        assert found.file.columns["lb_area"].sum() == pytest.approx(4.0 * np.pi, rel=0.01)
        assert {"lb_normal_x", "lb_normal_y", "lb_normal_z"} < found.file.columns.keys()
        code, [line] = run(
            "thin-out", tmp_path / "b.ply", "--by", "number", "--count", 200, "--out", tmp_path / "c.ply"
        )
        assert (code, len(core.splats.read_splats(tmp_path / "c.ply"))) == (0, line["points"])
        assert "positions only" in run("convert", tmp_path / "a.ply", "--out", tmp_path / "a.npz")[1][0]["notices"][-1]
        code, [line] = run("analyze", tmp_path / "a.ply", "--out", tmp_path / "c.csv")
        assert (code, "Splats cannot be written" in line["error"]) == (1, True)


def test_broken_files_give_an_error_and_the_others_go_on(run, tmp_path):
    (tmp_path / "a.ply").write_bytes(b"nothing")
    write(tmp_path / "b.ply", SPHERE)
    code, lines = run("info", tmp_path / "a.ply", tmp_path / "b.ply", tmp_path / "c.ply")
    assert code == 1
    assert [line.keys() >= {"error"} for line in lines] == [True, False, True]
    assert str(tmp_path / "a.ply") in lines[0]["error"]


@pytest.mark.parametrize("verb", [verb.name for verb in verbs.make_verbs()])
def test_every_verb_explains_itself(run, verb, capsys):
    assert run_command([verb, "--help"], verbs.make_verbs(), "meshfree") == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: meshfree {verb} ")
    assert "JSON line" in " ".join(shown.split())
    assert "<" not in shown  # of Python's own words for its objects
    assert run(verb, "--nonsense") == (2, [])


def test_files_of_blender_are_for_blender(run, tmp_path, capsys):
    (tmp_path / "a.blend").write_bytes(b"BLENDER")
    code, [line] = run("analyze", tmp_path / "a.blend")
    assert (code, "blender --command meshfree" in line["error"]) == (1, True)
    assert run("analyze", write(tmp_path / "a.ply", SPHERE), "--out", tmp_path / "b.blend") == (2, [])
    assert run_command(["analyze", "a.ply", "--out", "b.blend"], verbs.make_verbs(), "meshfree") == 2
    assert "blender --command meshfree" in capsys.readouterr().err


def test_the_command_line_starts_without_scipy():
    code = "import sys; from command import line, verbs; verbs.make_verbs(); print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert done.stdout == "False\n", done.stderr
