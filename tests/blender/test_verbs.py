"""Verbs of the command line for meshes, comparison, sides of normals, and what starts at sources."""

import json

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_group, add_object, attribute, grid_points, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.test_command import run  # noqa: F401

FAR = np.array([400_000.0, 5_000_000.0, 100.0])
POINTS = sphere_points(1500)


@pytest.fixture
def read():
    """Read a file of points."""
    return part("core.files").read_points


def write(path, points, **columns):
    """Write points with columns as text."""
    names = ",".join(["x", "y", "z", *columns])
    rows = np.column_stack([points, *columns.values()])
    np.savetxt(path, rows, "%.15g", ",", header=names, comments="")
    return path


def outwards(points, normals):
    return np.einsum("ij,ij->i", points, normals) > 0.0


class TestMesh:
    @pytest.mark.parametrize(("suffix", "importer"), [("ply", "ply_import"), ("obj", "obj_import"), ("stl", "")])
    def test_blender_reads_the_mesh(self, run, tmp_path, suffix, importer):  # noqa: F811
        code, [line] = run("mesh", write(tmp_path / "a.csv", POINTS), "--out", tmp_path / f"a.{suffix}")
        assert code == 0, line
        assert (line["points"], line["open_edges"]) == (1500, 0)
        bpy.ops.wm.read_homefile(use_empty=True)
        axes = {"forward_axis": "Y", "up_axis": "Z", "filepath": str(tmp_path / f"a.{suffix}")}
        getattr(bpy.ops.wm, importer or "stl_import")(**axes)
        [obj] = bpy.context.selected_objects
        mesh = obj.data
        assert len(mesh.vertices) == line["vertices"]
        assert (
            len(mesh.polygons) == line["faces"] if suffix != "stl" else all(len(f.vertices) == 3 for f in mesh.polygons)
        )
        assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 2
        assert_allclose(np.linalg.norm(local_points(obj), axis=1), 1.0, atol=2e-3)
        assert all(face.normal.dot(face.center) > 0.0 for face in mesh.polygons)

    def test_vertices_hold_columns_and_colors(self, run, read, tmp_path):  # noqa: F811
        height = 0.5 + 0.5 * POINTS[:, 2]
        write(
            tmp_path / "a.csv", POINTS, r=height, g=1.0 - height, b=0.0 * height, height=height, side=POINTS[:, 0] > 0
        )
        code, [line] = run("mesh", tmp_path / "a.csv", "--out", tmp_path / "a.ply")
        assert code == 0, line
        table = read(tmp_path / "a.ply")
        assert_allclose(table.attributes["height"], 0.5 + 0.5 * table.points[:, 2], atol=0.01)
        assert_allclose(table.colors[:, 0], 0.5 + 0.5 * table.points[:, 2], atol=0.02)
        assert_allclose(table.colors[:, :2].sum(axis=1), 1.0, atol=0.02)
        assert (table.attributes["side"][table.points[:, 0] > 0.2] > 0.5).all()

    @pytest.mark.parametrize("suffix", ["ply", "obj"])
    def test_large_coordinates_keep_their_digits(self, run, read, tmp_path, suffix):  # noqa: F811
        code, [line] = run("mesh", write(tmp_path / "a.csv", POINTS + FAR), "--out", tmp_path / f"a.{suffix}")
        assert code == 0, line
        points = read(tmp_path / f"a.{suffix}").points - FAR
        assert_allclose(np.linalg.norm(points, axis=1), 1.0, atol=2e-3)

    def test_large_coordinates_are_no_stl(self, run, tmp_path):  # noqa: F811
        code, [line] = run("mesh", write(tmp_path / "a.csv", POINTS + FAR), "--out", tmp_path / "a.stl")
        assert code == 1
        assert "STL keeps single precision" in line["error"]
        assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]

    def test_openings(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "a.csv", POINTS[POINTS[:, 2] > 0.0])
        _, [kept] = run("mesh", tmp_path / "a.csv")
        _, [closed] = run("mesh", tmp_path / "a.csv", "--no-keep-open")
        assert kept["open_edges"] > 30
        assert closed["open_edges"] == 0
        assert closed["faces"] > kept["faces"]

    @pytest.mark.any_blender
    def test_detail(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "a.csv", POINTS)
        coarse, fine = (run("mesh", tmp_path / "a.csv", "--detail", detail)[1][0] for detail in (1, 2))
        assert fine["faces"] == pytest.approx(4 * coarse["faces"], rel=0.05)

    def test_a_blend_file_shows_the_mesh_and_hides_the_points(self, run, tmp_path):  # noqa: F811
        code, _ = run("mesh", write(tmp_path / "a.csv", POINTS), "--out", tmp_path / "new" / "a.blend")
        assert code == 0
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new" / "a.blend"))
        assert (bpy.context.object.name, len(bpy.context.object.data.polygons) > 1000) == ("a Surface", True)
        assert bpy.data.objects["a"].hide_get()

    def test_a_moved_and_mirrored_object(self, run, tmp_path):  # noqa: F811
        obj = add_object(POINTS)
        obj.scale, obj.location, obj.rotation_euler = (-1.0, 1.0, 1.0), (5.0, 0.0, 1.0), (0.3, 0.2, 0.1)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        assert run("mesh", tmp_path / "a.blend", "--out", tmp_path / "a.stl")[0] == 0
        data = (tmp_path / "a.stl").read_bytes()[84:]
        rows = np.frombuffer(data, [("normal", "<f4", 3), ("places", "<f4", (3, 3)), ("unused", "<u2")])
        middles = rows["places"].mean(axis=1) - [5.0, 0.0, 1.0]
        assert_allclose(np.linalg.norm(middles, axis=1), 1.0, atol=0.01)
        assert outwards(middles, rows["normal"]).all()


@pytest.mark.any_blender
class TestCompare:
    def test_clouds_in_a_national_grid_that_are_shifted_by_different_amounts(self, run, read, tmp_path):  # noqa: F811
        origin = part("core.files").choose_origin
        plan = np.vstack([sphere_points(2000, seed=1), sphere_points(2000, seed=2) + (40.0, 0.0, 0.0)]) + FAR
        scan = 1.1 * POINTS + FAR
        assert (origin(plan) != origin(scan)).any()
        write(tmp_path / "plan.csv", plan)
        code, [line] = run(
            "compare",
            write(tmp_path / "a.csv", scan),
            "--reference",
            tmp_path / "plan.csv",
            "--out",
            tmp_path / "a.ply",
        )
        assert code == 0, line
        assert line["compared_count"] == 1500
        for name in ("mean_distance", "distance_95", "greatest_distance"):
            assert line[name] == pytest.approx(0.1, abs=3e-3)
        table = read(tmp_path / "a.ply")
        assert_allclose(table.points, scan, rtol=0, atol=1e-6)
        assert_allclose(table.attributes["lb_deviation"], 0.1, atol=3e-3)
        assert (table.attributes["lb_compared"] == 1).all()

    def test_the_reference_is_analyzed_once_for_all(self, extension, core, cache, run, tmp_path, monkeypatch):  # noqa: F811
        build, built = core.build_laplacian, []

        def counted(points, **settings):
            built.append(len(points))
            return build(points, **settings)

        monkeypatch.setattr(core, "build_laplacian", counted)
        write(tmp_path / "plan.csv", sphere_points(1400))
        inputs = [write(tmp_path / f"{name}.csv", sphere_points(count)) for name, count in (("a", 1100), ("b", 1200))]
        code, lines = run("compare", *inputs, "--reference", tmp_path / "plan.csv", "--out-dir", tmp_path / "out")
        assert code == 0, lines
        assert sorted(built) == [1100, 1200, 1400]
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.blend", "b.blend"]
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "a.blend"))
        assert [obj.name for obj in bpy.data.objects] == ["a"]
        assert extension.ui.display.shown_attribute(bpy.context.object) == "lb_deviation"

    def test_objects_of_one_blend_file(self, run, tmp_path):  # noqa: F811
        add_object(POINTS, "Plan").location = (0.0, 0.0, 3.0)
        add_object(1.05 * POINTS, "Scan").location = (0.0, 0.0, 3.0)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        names = "--object", "Scan", "--reference", tmp_path / "a.blend", "--reference-object", "Plan"
        code, [line] = run("compare", tmp_path / "a.blend", *names)
        assert code == 0, line
        assert line["mean_distance"] == pytest.approx(0.05, abs=2e-3)
        code, [line] = run("compare", tmp_path / "a.blend", *names[:-1], "Nobody")
        assert code == 1
        assert "with --reference-object: Plan, Scan" in line["error"]

    def test_what_is_far_away_is_not_compared(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "plan.csv", POINTS)
        both = np.vstack([sphere_points(1100), sphere_points(1000, seed=1) + (9.0, 0.0, 0.0)])
        given = write(tmp_path / "a.csv", both), "--reference", tmp_path / "plan.csv"
        code, [line] = run("compare", *given, "--greatest", 0.5)
        assert code == 0, line
        assert line["compared_count"] == 1100
        assert any("1,000 of 2,100 points lie beside" in notice for notice in line["notices"])
        code, [line] = run("compare", write(tmp_path / "b.csv", both + (0.0, 90.0, 0.0)), *given[1:], "--greatest", 0.5)
        assert code == 1
        assert "No point of" in line["error"]

    @pytest.mark.parametrize("text", [None, "", "no points"])
    def test_a_bad_reference_is_told_for_each_input(self, run, tmp_path, text):  # noqa: F811
        inputs = [write(tmp_path / f"{name}.csv", POINTS) for name in "ab"]
        if text is not None:
            (tmp_path / "plan.csv").write_text(text)
        code, lines = run("compare", *inputs, "--reference", tmp_path / "plan.csv")
        assert code == 1
        assert len(lines) == 2
        assert all(line["error"].count(str(tmp_path / "plan.csv")) == 1 for line in lines)

    def test_too_few_points_in_the_reference(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "plan.csv", POINTS[:2])
        code, [line] = run("compare", write(tmp_path / "a.csv", POINTS), "--reference", tmp_path / "plan.csv")
        assert code == 1
        assert "plan.csv" in line["error"]

    def test_the_reference_is_never_overwritten(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "a.csv", POINTS)
        plan = write(tmp_path / "plan.csv", POINTS)
        before = plan.read_bytes()
        code, [line] = run("compare", tmp_path / "a.csv", "--reference", plan, "--out", plan)
        assert code == 1
        assert "overwrite its input" in line["error"]
        assert plan.read_bytes() == before


def body(count, seed=0):
    """Points of an ellipsoid with a dent, which no motion maps onto itself."""
    points = sphere_points(count, seed)
    return (
        points * [1.0, 0.8, 0.6] * (1.0 - 0.2 * np.exp(-6.0 * ((points - [0.6, 0.6, 0.5]) ** 2).sum(axis=1)))[:, None]
    )


@pytest.mark.any_blender
class TestAlign:
    def test_files_in_a_national_grid_leave_in_the_coordinates_of_the_reference(self, run, read, tmp_path):  # noqa: F811
        turn = np.array([[0.995, -0.0998, 0.0], [0.0998, 0.995, 0.0], [0.0, 0.0, 1.0]])
        turn, _ = np.linalg.qr(turn)
        turn *= np.sign(np.diag(turn))
        wanted = body(1500)
        write(tmp_path / "plan.csv", body(1400, seed=1) + FAR)
        inputs = write(tmp_path / "a.csv", (wanted - [0.1, 0.0, -0.05]) @ turn + FAR)
        code, [line] = run("align", inputs, "--reference", tmp_path / "plan.csv", "--out", tmp_path / "a.ply")
        assert code == 0, line
        assert line["converged"]
        assert line["overlap"] > 0.95
        table = read(tmp_path / "a.ply")
        assert_allclose(table.points, wanted + FAR, rtol=0, atol=5e-3)
        assert np.median(table.attributes["lb_residual"]) == pytest.approx(line["median_residual"], abs=1e-3)
        assert_allclose(np.array(line["matrix"])[:3, :3], turn, atol=5e-3)

    def test_another_shape_is_an_error(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "plan.csv", grid_points()[0])
        code, [line] = run("align", write(tmp_path / "a.csv", 0.3 * body(800)), "--reference", tmp_path / "plan.csv")
        assert code == 1
        assert "could not be aligned with" in line["error"]

    def test_it_comes_before_a_comparison(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "plan.csv", body(1400, seed=1))
        given = write(tmp_path / "a.csv", body(1500) + [0.08, 0.0, -0.05]), "--reference", tmp_path / "plan.csv"
        figures = {}
        for first in ((), ("--align-first",)):
            code, [line] = run("compare", *given, *first)
            assert code == 0, line
            figures[first] = line["mean_distance"]
        assert figures[()] > 0.02
        assert figures["--align-first",] < 0.003


@pytest.mark.any_blender
class TestOrient:
    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("height", [5.0, -5.0])
    def test_to_a_place_in_the_file(self, run, read, tmp_path, height, flip):  # noqa: F811
        points, _ = grid_points()
        place = ",".join(map(str, points.mean(axis=0) + FAR + [0.0, 0.0, height]))
        flipped = ["--flip"] if flip else []
        code, [line] = run(
            "orient",
            write(tmp_path / "a.csv", points + FAR),
            "--viewpoint",
            place,
            *flipped,
            "--out",
            tmp_path / "a.ply",
        )
        assert code == 0, line
        table = read(tmp_path / "a.ply")
        assert_allclose(table.points, points + FAR, rtol=0, atol=1e-6)
        assert_allclose(
            table.attributes["normal"], np.tile([0, 0, np.sign(height) * (-1) ** flip], (len(points), 1)), atol=0.02
        )

    def test_a_place_below_zero(self, run, tmp_path):  # noqa: F811
        write(tmp_path / "a.csv", grid_points()[0])
        assert run("orient", tmp_path / "a.csv", "--viewpoint=-1,-2,-3e1", "--out", tmp_path / "a.npz")[0] == 0
        assert (np.load(tmp_path / "a.npz")["normal"][:, 2] < 0.0).all()

    def test_an_analysis_of_the_output_keeps_the_side(self, run, read, tmp_path):  # noqa: F811
        write(tmp_path / "a.csv", POINTS)
        assert run("orient", tmp_path / "a.csv", "--flip", "--out", tmp_path / "b.ply")[0] == 0
        assert not outwards(POINTS, read(tmp_path / "b.ply").attributes["normal"]).any()
        assert run("analyze", tmp_path / "b.ply", "--out", tmp_path / "c.npz")[0] == 0
        arrays = np.load(tmp_path / "c.npz")
        assert not outwards(POINTS, arrays["normals"]).any()
        assert (arrays["mean_curvature"] < 0.0).all()
        assert run("orient", tmp_path / "b.ply", "--method", "keep", "--flip", "--out", tmp_path / "d.npz")[0] == 0
        assert outwards(POINTS, np.load(tmp_path / "d.npz")["normal"]).all()

    def test_by_the_normals_of_the_file(self, run, tmp_path):  # noqa: F811
        nx, ny, nz = -POINTS.T
        write(tmp_path / "a.csv", POINTS, nx=nx, ny=ny, nz=nz)
        given = "--source", "normal", "--holds", "directions"
        assert run("orient", tmp_path / "a.csv", *given, "--out", tmp_path / "a.npz")[0] == 0
        assert not outwards(POINTS, np.load(tmp_path / "a.npz")["normal"]).any()
        code, [line] = run("orient", write(tmp_path / "b.csv", POINTS), *given)
        assert code == 1
        assert "no attribute normal" in line["error"]

    def test_by_the_place_of_the_scanner_for_each_point(self, run, tmp_path):  # noqa: F811
        points, _ = grid_points()
        left = points[:, 0] < points[:, 0].mean()
        seen_x, seen_y, seen_z = (points + FAR + np.where(left, 5.0, -5.0)[:, None] * [0.0, 0.0, 1.0]).T
        apart = points + np.where(left, -3.0, 3.0)[:, None] * [1.0, 0.0, 0.0]  # two sheets, seen from two sides
        write(tmp_path / "a.csv", apart + FAR, seen_x=seen_x, seen_y=seen_y, seen_z=seen_z)
        code, [line] = run("orient", tmp_path / "a.csv", "--source", "seen", "--out", tmp_path / "a.npz")
        assert code == 0, line
        assert_array_equal(np.load(tmp_path / "a.npz")["normal"][:, 2] > 0.0, left)

    def test_to_an_object_of_a_blend_file(self, run, tmp_path):  # noqa: F811
        obj = add_object(grid_points()[0])
        lamp = bpy.data.objects.new("Scanner", None)
        lamp.location = (1.0, 1.0, -4.0)
        bpy.context.scene.collection.objects.link(lamp)
        bpy.context.view_layer.objects.active = obj
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        assert run("orient", tmp_path / "a.blend", "--viewpoint", "Scanner", "--out", tmp_path / "b.npz")[0] == 0
        assert (np.load(tmp_path / "b.npz")["normal"][:, 2] < 0.0).all()
        code, [line] = run("orient", tmp_path / "a.blend", "--viewpoint", "Nobody")
        assert code == 1
        assert 'no object "Nobody"' in line["error"]


@pytest.mark.any_blender
class TestSources:
    def test_distance_from_places_in_a_national_grid(self, run, read, tmp_path):  # noqa: F811
        points = np.vstack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], sphere_points(3000)])
        write(tmp_path / "a.csv", points + FAR)
        at = [f"--at={','.join(map(str, place + FAR))}" for place in 1.01 * points[:2]]
        code, [line] = run("geodesic-distance", tmp_path / "a.csv", *at, "--out", tmp_path / "a.ply")
        assert code == 0, line
        exact = np.arccos(np.clip(points[:, [2, 0]].max(axis=1), -1.0, 1.0))
        assert_allclose(read(tmp_path / "a.ply").attributes["lb_distance"], exact, atol=0.02)

    def test_cells_around_the_points_of_a_column(self, run, tmp_path):  # noqa: F811
        seed = np.zeros(len(POINTS), dtype=int)
        seed[[POINTS[:, 0].argmax(), POINTS[:, 0].argmin()]] = 1
        write(tmp_path / "a.csv", POINTS, seed=seed)
        code, [line] = run("nearest-source", tmp_path / "a.csv", "--group", "seed", "--out", tmp_path / "a.npz")
        assert code == 0, line
        cells = np.load(tmp_path / "a.npz")["cell"]
        assert len(np.unique(cells)) == 2
        clear = np.abs(POINTS[:, 0]) > 0.1
        assert len({*zip(cells[clear].tolist(), (POINTS[clear, 0] > 0.0).tolist(), strict=True)}) == 2

    def test_distance_from_a_curve_of_a_file(self, run, tmp_path):  # noqa: F811
        """Of the equator walked eastwards the north is on the left; a closed one has no ends."""
        longitude = 2.0 * np.pi * np.arange(200) / 200.0
        equator = np.stack([np.cos(longitude), np.sin(longitude), 0.0 * longitude], axis=1)
        points = np.vstack([equator, sphere_points(3000)])
        curve = write(tmp_path / "curve.csv", equator + FAR)
        given = "--curve", curve, "--closed"
        code, [line] = run(
            "signed-distance", write(tmp_path / "a.csv", points + FAR), *given, "--out", tmp_path / "a.npz"
        )
        assert code == 0, line
        assert_allclose(np.load(tmp_path / "a.npz")["signed_distance"], np.arcsin(points[:, 2]), atol=0.03)
        code, [line] = run("signed-distance", tmp_path / "a.csv", *given, "--out", curve)
        assert (code, "overwrite its input" in line["error"]) == (1, True)
        code, [line] = run("signed-distance", tmp_path / "a.csv", "--curve", tmp_path / "none.csv")
        assert (code, "There is no file" in line["error"]) == (1, True)
        code, [line] = run("signed-distance", tmp_path / "a.csv", "--curve", "Seam")
        assert (code, 'no curve "Seam"' in line["error"]) == (1, True)

    def test_a_map_around_a_place(self, run, tmp_path):  # noqa: F811
        """On a plane it is the plane, turned in some way."""
        points, _ = grid_points()
        middle = points[np.linalg.norm(points - [2.0, 1.5, 0.0], axis=1).argmin()]
        given = f"--at={','.join(map(str, middle))}", "--radius", 4
        code, [line] = run("unwrap", write(tmp_path / "a.csv", points), *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        away = 8.0 * np.linalg.norm(np.load(tmp_path / "a.npz")["uv"] - 0.5, axis=1)
        assert_allclose(away, np.linalg.norm(points - middle, axis=1), atol=0.02)

    def test_a_direction_carried_over_a_plane(self, run, tmp_path):  # noqa: F811
        points, _ = grid_points()
        given = "--at=0,0,0", "--direction=-1,1,5"
        write(tmp_path / "a.csv", points)
        code, [line] = run("extend-direction", tmp_path / "a.csv", *given, "--out", tmp_path / "a.npz")
        assert code == 0, line
        expected = np.tile(np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0), (len(points), 1))
        assert_allclose(np.load(tmp_path / "a.npz")["direction"], expected, atol=0.01)

    def test_a_field_between_the_points_of_two_columns(self, run, tmp_path):  # noqa: F811
        points, _ = grid_points()
        low, high = points[:, 0] < 0.3, points[:, 0] > 3.6
        write(tmp_path / "a.csv", points, low=low, high=high)
        groups = "--values", "groups", "--low-group", "low", "--high-group", "high"
        code, [line] = run("harmonic-field", tmp_path / "a.csv", *groups, "--high", 5, "--out", tmp_path / "a.npz")
        assert code == 0, line
        field = np.load(tmp_path / "a.npz")["field"]
        assert_allclose(field[low], 0.0, atol=1e-6)
        assert_allclose(field[high], 5.0, atol=1e-5)
        assert np.corrcoef(field, points[:, 0])[0, 1] > 0.99

    def test_weights_of_a_column(self, run, tmp_path):  # noqa: F811
        """A third of the way is taken where the weight is 1/3, exactly; whole numbers but 0 count fully."""
        rough = POINTS * (1.0 + np.random.default_rng(1).normal(0.0, 0.03, (len(POINTS), 1)))
        weight = np.where(POINTS[:, 2] > 0.0, 1.0 / 3.0, 0.0)
        write(tmp_path / "a.csv", rough, weight=weight)
        moved = {}
        for name, chosen in (("all", ()), ("some", ("--group", "weight"))):
            code, [line] = run("smooth", tmp_path / "a.csv", *chosen, "--out", tmp_path / "a.npz")
            assert code == 0, line
            moved[name] = np.load(tmp_path / "a.npz")["points"] - rough
        assert_allclose(moved["some"], weight[:, None] * moved["all"], atol=1e-6)

    @pytest.mark.parametrize(
        ("values", "text"),
        [(2.5 * POINTS[:, 0], "not from 0 to 1"), (0.0 * POINTS[:, 0], "at least 1")],
        ids=["numbers", "zeros"],
    )
    def test_columns_that_are_no_groups(self, run, tmp_path, values, text):  # noqa: F811
        write(tmp_path / "a.csv", POINTS, seed=values)
        code, [line] = run("geodesic-distance", tmp_path / "a.csv", "--group", "seed")
        assert code == 1
        assert text in line["error"]

    def test_a_place_leaves_groups_of_a_blend_file(self, run, tmp_path):  # noqa: F811
        obj = add_object(POINTS)
        add_group(obj, "Source", POINTS[:, 2] > 0.9)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        farthest = {}
        for name, given in (("group", ()), ("place", ("--at=0,0,-1",))):
            code, [line] = run("geodesic-distance", tmp_path / "a.blend", *given, "--out", tmp_path / f"{name}.blend")
            assert code == 0, line
            bpy.ops.wm.open_mainfile(filepath=str(tmp_path / f"{name}.blend"))
            farthest[name] = POINTS[attribute(bpy.context.object, "lb_distance").argmax(), 2]
            assert "Source" in bpy.context.object.vertex_groups
            members = [any(item.group == 0 for item in vertex.groups) for vertex in bpy.context.object.data.vertices]
            assert_array_equal(members, POINTS[:, 2] > 0.9)
        assert farthest["group"] < -0.9
        assert farthest["place"] > 0.9

    def test_a_column_of_the_boundary(self, run, tmp_path):  # noqa: F811
        points, outermost = grid_points()
        write(tmp_path / "a.csv", points, edge=outermost)
        code, [line] = run("analyze", tmp_path / "a.csv", "--boundary-group", "edge", "--boundary", "off")
        assert (code, line["boundary_count"]) == (0, outermost.sum())


VERBS = {
    "align": ("--reference", "plan.csv"),
    "mesh": (),
    "smooth": (),
    "orient": (),
    "segment": ("--parts", 2),
    "compare": ("--reference", "plan.csv"),
    "geodesic-distance": ("--at=0,0,1",),
    "roughness": (),
}


@pytest.mark.any_blender
@pytest.mark.parametrize("verb", VERBS)
def test_a_folder_of_numbered_files(run, tmp_path, monkeypatch, verb):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "plan.csv", POINTS)
    (tmp_path / "frames").mkdir()
    for number in (9, 10):
        write(tmp_path / "frames" / f"f_{number}.csv", sphere_points(1000 + number))
    (tmp_path / "frames" / "notes.md").write_text("no frame")
    code, lines = run(verb, "frames", *VERBS[verb], "--out-dir", "out", "--format", "ply")
    assert code == 0, lines
    assert [line["points"] for line in lines] == [1009, 1010]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["f_10.ply", "f_9.ply"]


@pytest.mark.parametrize("verb", VERBS)
def test_files_that_cannot_be_read(run, tmp_path, monkeypatch, verb):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "plan.csv", POINTS)
    (tmp_path / "empty.xyz").write_text("")
    (tmp_path / "frames.ply").write_text("no PLY")
    code, lines = run(verb, "empty.xyz", "frames.ply", "missing.xyz", *VERBS[verb], "--out-dir", "out")
    assert code == 1
    assert [line.keys() for line in lines] == 3 * [{"file", "error"}]
    assert not (tmp_path / "out").exists()


@pytest.mark.any_blender
@pytest.mark.parametrize(
    "arguments",
    [
        ("mesh", "a.csv", "--out", "a.csv"),
        ("mesh", "a.csv", "--out", "a.npz"),
        ("mesh", "a.csv", "--detail", "0"),
        ("mesh", "a.csv", "b/a.csv", "--out-dir", "out"),
        ("mesh", "a.csv", "--out-dir", "out", "--format", "npz"),
        ("segment", "a.csv", "--out", "a.stl"),
        ("deform", "a.csv", "--handles", "a.json", "--out", "a.npz"),
        ("align", "a.csv"),
        ("align", "a.csv", "--reference", "b.csv", "--overlap", "0"),
        ("compare", "a.csv"),
        ("orient", "a.csv", "--viewpoint", "0,0,1", "--method", "winding"),
        ("orient", "a.csv", "--source", "normal", "--method", "viewpoint"),
        ("geodesic-distance", "a.csv"),
        ("geodesic-distance", "a.csv", "--at", "1,2"),
        ("geodesic-distance", "a.csv", "--at", "1,2,nan"),
        ("nearest-source", "a.csv", "--at", "1,2,3", "--group", "seed"),
        ("extend-direction", "a.csv", "--at", "1,2,3", "--direction", "up"),
        ("smooth", "."),
        ("splat-info", "a.ply", "--out", "b.ply"),
    ],
)
def test_wrong_usage(run, tmp_path, monkeypatch, arguments):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == (2, [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.any_blender
@pytest.mark.parametrize(
    "verb", ["mesh", "align", "compare", "orient", "geodesic-distance", "harmonic-field", "deform"]
)
def test_help(command, capfd, verb):
    assert command.run([verb, "--help"]) == 0
    shown = capfd.readouterr().out
    assert "JSON line per input" in " ".join(shown.split())
    assert "--at-once" not in shown


@pytest.mark.any_blender
def test_verbs_without_blender_have_the_settings_of_those_in_it(command):
    """By name, default, bounds, choices, unit and description: there may be more in Blender, which has objects."""
    as_setting, in_blender = part("operators.files.arguments").as_setting, {v.name: v for v in command.make_verbs()}
    compared = []
    for verb in part("command.verbs").make_verbs():
        assert verb.name in in_blender
        own = getattr(verb, "settings", ())
        known = {item.identifier: item for item in in_blender[verb.name].operator.properties} if own else {}
        for setting in own:
            if verb.name == "analyze":  # whose settings Blender's verb takes as they are
                continue
            theirs, what = as_setting(known[setting.name]), (verb.name, setting.name)
            exact = isinstance(setting.default, (bool, str))
            assert theirs.default == (setting.default if exact else pytest.approx(setting.default, rel=1e-6)), what
            assert theirs.form == setting.form, what
            for bound, end in ((setting.least, theirs.least), (setting.most, theirs.most)):
                assert bound is None or bound == pytest.approx(end, rel=1e-6), what
            if what != ("stray-points", "action"):  # in Blender they can be selected and hidden, too
                assert theirs.choices == setting.choices, what
            if what not in {("stray-points", "action"), ("simulate", "frames")}:  # files have no scene
                assert theirs.description == setting.description, what
            compared.append(what)
    assert len(compared) > 50


ENDS = "--from=0,0,1", "--to=1,0,0"
SAME = {
    "analyze": ("--modes", 3),
    "principal-curvatures": (),
    "roughness": (),
    "surface-variation": (),
    "stray-points": (),
    "orient": ("--viewpoint", "0,0,0"),
    "smooth": ("--method", "heat", "--group", "weight"),
    "mode-shape": ("--mode", 2, "--phase", 60),
    "minimal-surface": ("--steps", 1, "--group", "low"),
    "segment": ("--parts", 2),
    "signature": ("--count", 2, "--modes", 12),
    "geodesic-distance": ("--at", "0,0,1"),
    "nearest-source": ("--group", "low"),
    "signed-distance": ("--curve", "curve.csv"),
    "unwrap": ("--at", "0,0,1", "--angle", 30),
    "extend-direction": ("--at", "1,0,0"),
    "simulate": ("--at", "0,0,1", "--frames", 5),
    "harmonic-field": ("--low-group", "low", "--high-group", "weight"),
    "transfer-attributes": ("--reference", "plan.csv"),
    "compare": ("--reference", "plan.csv"),
    "section": ("--plane", "0,0,0.2", "--normal", "0,1,1"),
    "profile": ENDS,
    "measure": ("--plane", "0,0,0.1"),
}
OVER_POINTS = "measure", ("--reference", "plan.csv", "--normal", "0,1,0")


@pytest.mark.any_blender
@pytest.mark.parametrize(("verb", "options"), [*SAME.items(), OVER_POINTS])
def test_a_verb_gives_the_same_in_blender_and_without_it(run, tmp_path, monkeypatch, capfd, verb, options):  # noqa: F811
    """On points that single precision holds: the record, names and numbers; where signs are free, up to these."""
    monkeypatch.chdir(tmp_path)
    points = (sphere_points(600) * [1.0, 0.9, 0.7]).astype(np.float32).astype(np.float64)
    low, weight = (points[:, 2] < -0.5).astype(int), np.where(points[:, 2] > 0.5, 0.25, 0.0)
    write(tmp_path / "a.csv", points, low=low, weight=weight)
    turn = np.linspace(0.0, 4.0, 30)  # three quarters of the equator
    curve = np.stack([np.cos(turn), 0.9 * np.sin(turn), 0.0 * turn], axis=1)
    write(tmp_path / "curve.csv", curve)
    red, green, blue = 0.5 + 0.4 * points.T
    write(tmp_path / "plan.csv", points, r=red, g=green, b=blue, heat=points[:, 0], part=low)
    ending = {"section": "csv", "profile": "csv", "measure": "csv"}.get(verb, "npz")
    given = [verb, "a.csv", *map(str, options), "--out"]
    code, [inside] = run(*given, f"in.{ending}")
    assert code == 0, inside
    outside_verbs = part("command.verbs").make_verbs()
    assert part("command.main").run([*given, f"out.{ending}"], outside_verbs, "meshfree") == 0
    [outside] = [json.loads(line) for line in capfd.readouterr().out.splitlines() if line.startswith("{")]
    assert inside.keys() == outside.keys()
    figures = {name for name, value in outside.items() if isinstance(value, (int, float))}
    assert {name: inside[name] for name in figures} == pytest.approx(
        {name: outside[name] for name in figures}, rel=1e-3, abs=1e-6
    )
    if ending == "csv":
        tables = [np.genfromtxt(f"{name}.csv", delimiter=",", skip_header=1) for name in ("in", "out")]
        heads = {(tmp_path / f"{name}.csv").read_text().partition("\n")[0] for name in ("in", "out")}
        assert len(heads) == 1
        assert_allclose(*tables, rtol=1e-3, atol=1e-4)
        return
    found, exact = np.load("in.npz"), np.load("out.npz")
    assert set(found.files) == set(exact.files)
    for name in set(found.files) - {"format"}:
        steps = 0.01 if name == "colors" else 2e-4  # those of colors are bytes in Blender
        assert_allclose(found[name], exact[name], rtol=1e-3, atol=steps, err_msg=name)


def test_meshes_of_points_far_away_stand_where_these_are_exported(run, tmp_path):  # noqa: F811
    """In the interface, too: the object of the mesh keeps the shift of the import."""
    bpy.ops.meshfree.import_points(filepath=str(write(tmp_path / "a.csv", POINTS + FAR)))
    obj = bpy.context.object
    assert bpy.ops.meshfree.mesh_surface() == {"FINISHED"}
    assert_array_equal(bpy.context.object["lb_offset"], obj["lb_offset"])
    assert attribute(bpy.context.object, "position").shape[0] > 1000
