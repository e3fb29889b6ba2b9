"""The command line in Blender, by the function that Blender calls with its arguments: what .blend files hold."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_group, add_object, attribute, grid_points, local_points, sphere_points
from tests.blender.conftest import new_file, part
from tests.blender.splats import bar_splats
from tests.blender.test_pointcloud import add_pointcloud

POINTS = sphere_points()
FAR = np.array([400_000.0, 5_000_000.0, 100.0])
BODY = sphere_points(600) * [1.0, 0.9, 0.7]


@pytest.fixture
def run(command, capfd):
    """Run the command line; return the exit code and the JSON lines."""

    def run(*arguments):
        code = command.run([str(argument) for argument in arguments])
        lines = [json.loads(line) for line in capfd.readouterr().out.splitlines() if line.startswith("{")]
        return code, lines

    return run


def write(path, points, **columns):
    """Write points with columns as text."""
    names = ",".join(["x", "y", "z", *columns])
    rows = np.column_stack([points, *columns.values()])
    np.savetxt(path, rows, "%.15g", ",", header=names, comments="")
    return path


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(path).resolve()))
    return path


def opened(path):
    """Open a file, and return its active object."""
    bpy.ops.wm.open_mainfile(filepath=str(Path(path).resolve()))
    return bpy.context.object


def linear(obj):
    return np.array(obj.matrix_world, dtype=np.float64)[:3, :3]


def world_points(obj):
    return local_points(obj) @ linear(obj).T + np.array(obj.matrix_world.translation)


def world_values(obj, name):
    """An attribute; vectors along the axes of the world: normals as covectors, others as steps."""
    values = attribute(obj, name).astype(np.float64)
    if values.shape[1:] != (3,):
        return values
    turned = values @ (np.linalg.inv(linear(obj)) if name in ("lb_normal", "lb_orientation") else linear(obj).T)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def placed(points, name="Body", scale=(1.0, 1.3, 0.8)):
    """Add an object, turned, scaled and moved, whose points lie at these places."""
    matrix = Matrix.LocRotScale((3.0, -2.0, 1.0), Matrix.Rotation(0.7, 3, (1.0, 2.0, 3.0)), scale)
    local = (points - np.array(matrix.translation)) @ np.linalg.inv(np.array(matrix)[:3, :3]).T
    obj = add_object(local, name)
    obj.matrix_world = matrix
    return obj


ENDS = "--from=0,0,1", "--to=1,0,0"
PLAN = "--reference", "plan.csv"
VERBS = {
    "analyze": ("--modes", 3),
    "principal-curvatures": (),
    "roughness": (),
    "surface-variation": (),
    "stray-points": (),
    "thin-out": ("--spacing", 0.3),
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
    "transfer-attributes": PLAN,
    "compare": PLAN,
    "align": PLAN,
    "convert": (),
    "info": (),
    "mesh": (),
    "section": ("--plane", "0,0,0.2", "--normal", "0,1,1"),
    "profile": ENDS,
    "measure": ("--plane", "0,0,0.1"),
}
TABLES = "section", "profile", "measure"
NOTHING_NEW = {"smooth", "mode-shape", "minimal-surface", "thin-out", "convert"}  # but where points are


@pytest.fixture
def body(request, tmp_path, monkeypatch):
    """The same points as a file and as an object with groups, a curve, and another cloud."""
    monkeypatch.chdir(tmp_path)
    low, weight = (BODY[:, 2] < -0.5).astype(int), np.where(BODY[:, 2] > 0.5, 0.25, 0.0)
    write("a.csv", BODY, low=low, weight=weight)
    turn = np.linspace(0.0, 4.0, 30)  # three quarters of the equator
    write("curve.csv", np.stack([np.cos(turn), 0.9 * np.sin(turn), 0.0 * turn], axis=1))
    red, green, blue = 0.5 + 0.4 * BODY.T
    write("plan.csv", BODY, r=red, g=green, b=blue, heat=BODY[:, 0], part=low)
    even = "align" in request.node.name  # what is scaled unevenly cannot be turned
    obj = placed(BODY, scale=(0.8, 0.8, 0.8) if even else (1.0, 1.3, 0.8))
    add_group(obj, "low", low.astype(bool))
    add_group(obj, "weight", weight > 0.0, 0.25)
    save("a.blend")
    new_file()
    return tmp_path


@pytest.mark.any_blender
@pytest.mark.parametrize(("verb", "options"), VERBS.items(), ids=VERBS)
def test_a_verb_gives_of_an_object_what_it_gives_of_a_file(run, body, verb, options):
    """Line, names and numbers, in a .blend file as in arrays and tables."""
    given = [verb, "{}", *map(str, options)]
    ending = {"mesh": "ply", "info": "", **dict.fromkeys(TABLES, "csv")}.get(verb, "npz")
    output = ["--out", f"out.{ending}"] if ending else []
    code, [outside] = run(*(word.replace("{}", "a.csv") for word in given), *output)
    assert code == 0, outside
    into = "in.csv" if verb in TABLES else "in.blend"
    code, [inside] = run(*(word.replace("{}", "a.blend") for word in given), *(["--out", into] if ending else []))
    assert code == 0, inside
    assert inside.keys() == outside.keys()
    figures = {name for name, value in outside.items() if isinstance(value, (int, float))}
    near = pytest.approx({name: outside[name] for name in figures}, rel=2e-3, abs=1e-5)
    assert {name: inside[name] for name in figures} == near
    if verb in TABLES:
        tables = [np.genfromtxt(f"{name}.csv", delimiter=",", skip_header=1) for name in ("in", "out")]
        assert_allclose(*tables, rtol=2e-3, atol=1e-4)
        return
    if verb == "info":
        return
    obj = opened("in.blend")
    if verb == "mesh":
        table = part("core.files").read_points(body / "out.ply")
        assert_allclose(world_points(obj), table.points, atol=1e-5)
        return
    exact = np.load("out.npz")
    assert_allclose(world_points(obj), exact["points"], atol=1e-5)
    named = {f"lb_{name}": name for name in exact.files}
    compared = [layer.name for layer in obj.data.attributes if layer.name in named]
    for name in compared:
        near = 5e-3 if verb == "signed-distance" else 5e-4  # where two corners of the curve are as near as each other
        assert_allclose(world_values(obj, name), exact[named[name]], rtol=1e-3, atol=near, err_msg=name)
    others = {"points", "low", "weight", "area_history", "heat", "part", "colors"}
    assert verb in NOTHING_NEW or len(compared) == (6 if verb == "analyze" else len(set(exact.files) - others))
    if verb == "analyze":
        assert_allclose(obj["lb_eigenvalues"].to_list(), outside["eigenvalues"], rtol=1e-3, atol=1e-6)
        assert attribute(obj, "lb_eigenvector_003").shape == (600,)
    if verb == "transfer-attributes":
        assert_allclose(attribute(obj, "heat"), exact["heat"], atol=1e-4)
        assert_allclose(attribute(obj, "part"), exact["part"], atol=1e-4)
        assert_allclose(_colors(obj), exact["colors"][:, :3], atol=0.01)  # in bytes
    if verb == "minimal-surface":
        assert_allclose(obj["lb_area_history"].to_list(), exact["area_history"], rtol=1e-5)


def _colors(obj):
    layer = obj.data.color_attributes["Color"]
    values = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color_srgb", values.reshape(-1))
    return values[:, :3]


@pytest.mark.any_blender
class TestReading:
    def test_one_of_many_objects(self, run, tmp_path):
        add_object(POINTS, "One")
        add_object(2.0 * POINTS, "Two")
        bpy.context.view_layer.objects.active = None
        save(tmp_path / "in.blend")
        code, [line] = run("analyze", tmp_path / "in.blend")
        assert code == 1
        assert "no active mesh object" in line["error"]
        assert "--object: One, Two" in line["error"]
        code, [line] = run("analyze", tmp_path / "in.blend", "--object", "Two")
        assert (code, line["total_area"]) == (0, pytest.approx(16.0 * np.pi, rel=0.01))
        code, [line] = run("analyze", tmp_path / "in.blend", "--object", "Three")
        assert (code, 'no mesh object "Three"' in line["error"]) == (1, True)

    def test_the_settings_of_an_object_hold_where_the_command_line_gives_none(self, run, tmp_path):
        points, outermost = grid_points()
        obj = add_object(points)
        add_group(obj, "Edge", outermost)
        obj.meshfree.boundary, obj.meshfree.bandwidth, obj.meshfree.neighbors = "OFF", "GLOBAL", 25
        save(tmp_path / "in.blend")
        _, [stored] = run("analyze", tmp_path / "in.blend", "--out", tmp_path / "in.npz")
        assert stored["boundary_count"] == 0
        np.save(tmp_path / "in.npy", points)
        given = "--boundary", "off", "--bandwidth", "global", "--neighbors", 25
        run("analyze", tmp_path / "in.npy", *given, "--out", tmp_path / "out.npz")
        same = [np.load(tmp_path / f"{name}.npz")["smoothing_lengths"] for name in ("in", "out")]
        assert_allclose(*same, rtol=1e-5)
        code, [line] = run("analyze", tmp_path / "in.blend", "--boundary", "auto", "--boundary-group", "Edge")
        assert (code, line["boundary_count"]) == (0, outermost.sum())
        code, [line] = run("analyze", tmp_path / "in.blend", "--boundary-group", "Rim")
        assert (code, 'no column "Rim"' in line["error"], "Its columns and groups are Edge" in line["error"]) == (
            1,
            True,
            True,
        )

    def test_modifiers_by_choice(self, run, tmp_path):
        obj = add_object(POINTS)
        cast = obj.modifiers.new("Cast", "CAST")
        cast.factor, cast.size, cast.use_radius_as_size = 1.0, 2.0, False
        save(tmp_path / "in.blend")
        areas = [
            run("analyze", tmp_path / "in.blend", *more)[1][0]["total_area"] for more in ((), ("--use-modifiers",))
        ]
        assert areas == pytest.approx([4.0 * np.pi, 16.0 * np.pi], rel=0.01)
        code, [line] = run("smooth", tmp_path / "in.blend", "--use-modifiers", "--out", tmp_path / "out.blend")
        assert (code, "read after its modifiers" in line["error"]) == (1, True)

    def test_values_of_a_group_may_be_zero(self, run, tmp_path):
        """Which outside of it they are not."""
        obj, end = add_object(POINTS), np.abs(POINTS[:, 2]) > 0.9
        add_group(obj, "Value", end & (POINTS[:, 2] < 0.0), 0.0)
        obj.vertex_groups["Value"].add(np.flatnonzero(end & (POINTS[:, 2] > 0.0)).tolist(), 0.5, "REPLACE")
        save(tmp_path / "in.blend")
        code, [line] = run("harmonic-field", tmp_path / "in.blend", "--out", tmp_path / "out.npz")
        assert (code, line["done"]) == (0, "in: a field from 0 to 0.5")
        field = np.load(tmp_path / "out.npz")["field"]
        assert_allclose(field[np.abs(POINTS[:, 2]) < 0.05], 0.25, atol=0.03)

    def test_sources_of_a_group_or_at_a_place(self, run, tmp_path):
        add_group(add_object(POINTS), "Source", POINTS[:, 2] > 0.9)
        save(tmp_path / "a.blend")
        for given, sign in ((), -1), (("--at=0,0,-1",), 1):
            code, [line] = run("geodesic-distance", tmp_path / "a.blend", *given, "--out", tmp_path / "b.blend")
            assert code == 0, line
            obj = opened(tmp_path / "b.blend")
            assert sign * POINTS[attribute(obj, "lb_distance").argmax(), 2] > 0.9
            assert [group.name for group in obj.vertex_groups] == ["Source"]

    def test_sides_that_were_chosen(self, run, tmp_path):
        save_oriented = placed(BODY)
        sides = -BODY @ linear(save_oriented)  # covectors
        layer = save_oriented.data.attributes.new("lb_orientation", "FLOAT_VECTOR", "POINT")
        layer.data.foreach_set("vector", np.float32(sides).reshape(-1))
        save(tmp_path / "a.blend")
        assert run("analyze", tmp_path / "a.blend", "--out", tmp_path / "a.npz")[0] == 0
        assert (np.einsum("ij,ij->i", np.load(tmp_path / "a.npz")["normals"], BODY) < 0.0).all()

    def test_objects_that_options_name(self, run, tmp_path):
        add_object(1.05 * POINTS, "Scan").location.z = 3.0
        turn = np.linspace(0.0, 2.0 * np.pi, 100)[:-1]
        curve = bpy.data.curves.new("Seam", "CURVE")
        curve.dimensions = "3D"
        spline = curve.splines.new("POLY")
        spline.points.add(len(turn) - 1)
        around = 1.05 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn, turn], axis=1)
        spline.points.foreach_set("co", np.float32(around).reshape(-1))
        spline.use_cyclic_u = True
        for name, data in (("Seam", curve), ("Scanner", None)):
            other = bpy.data.objects.new(name, data)
            other.location.z = 3.0
            bpy.context.scene.collection.objects.link(other)
        add_object(POINTS, "Plan").location.z = 3.0
        file = save(tmp_path / "a.blend")
        scan = "--object", "Scan", "--out", tmp_path / "a.npz"
        code, [line] = run("signed-distance", file, "--curve", "Seam", *scan)
        assert code == 0, line
        latitude = 1.05 * np.arcsin(POINTS[:, 2])
        assert_allclose(np.load(tmp_path / "a.npz")["signed_distance"], latitude, atol=0.2)
        assert run("orient", file, "--viewpoint", "Scanner", *scan)[0] == 0
        assert (np.einsum("ij,ij->i", np.load(tmp_path / "a.npz")["normal"], POINTS) < 0.0).all()
        code, [line] = run("section", file, "--plane", "Scanner", "--object", "Scan")
        assert (code, line["length"]) == (0, pytest.approx(2.1 * np.pi, rel=0.01))
        code, [line] = run("compare", file, "--reference", file, "--reference-object", "Plan", *scan)
        assert (code, line["mean_distance"]) == (0, pytest.approx(0.05, abs=2e-3))
        for verb, given, text in (
            ("signed-distance", ("--curve", "Nobody"), 'no curve "Nobody"'),
            ("orient", ("--viewpoint", "Nobody"), 'no object "Nobody"'),
            ("section", ("--plane", "Nobody"), 'no object "Nobody"'),
            ("compare", ("--reference", file, "--reference-object", "Nobody"), "with --reference-object: Scan, Plan"),
        ):
            code, [line] = run(verb, file, *given)
            assert (code, text in line["error"]) == (1, True), line
        code, [line] = run("orient", write(tmp_path / "b.csv", POINTS), "--viewpoint", "Scanner")
        assert (code, "no objects that could be named" in line["error"]) == (1, True)
        assert run("section", file, "--plane", "Scanner", "--normal", "1,0,0")[0] == 2

    def test_a_moved_and_mirrored_object(self, run, tmp_path):
        obj = add_object(POINTS)
        obj.scale, obj.location, obj.rotation_euler = (-1.0, 1.0, 1.0), (5.0, 0.0, 1.0), (0.3, 0.2, 0.1)
        save(tmp_path / "a.blend")
        assert run("mesh", tmp_path / "a.blend", "--out", tmp_path / "a.stl")[0] == 0
        data = (tmp_path / "a.stl").read_bytes()[84:]
        rows = np.frombuffer(data, [("normal", "<f4", 3), ("places", "<f4", (3, 3)), ("unused", "<u2")])
        middles = rows["places"].mean(axis=1) - [5.0, 0.0, 1.0]
        assert_allclose(np.linalg.norm(middles, axis=1), 1.0, atol=0.02)
        assert (np.einsum("ij,ij->i", middles, rows["normal"]) > 0.0).all()

    @pytest.mark.parametrize("data", [b"BLENDER-v405" + bytes(100), b"garbage", None])
    def test_broken_files(self, run, tmp_path, data):
        if data is not None:
            (tmp_path / "a.blend").write_bytes(data)
        code, [line] = run("analyze", tmp_path / "a.blend", "--out", tmp_path / "out.blend")
        assert (code, str(tmp_path / "a.blend") in line["error"]) == (1, True)
        assert not (tmp_path / "out.blend").exists()

    def test_folders_hold_them_too(self, run, tmp_path):
        write(tmp_path / "b.csv", POINTS)
        add_object(POINTS)
        save(tmp_path / "a.blend")
        code, lines = run("info", tmp_path)
        assert code == 0
        assert [line["file"] for line in lines] == [str(tmp_path / name) for name in ("a.blend", "b.csv")]


@pytest.mark.any_blender
class TestWriting:
    def test_an_analysis_is_known_to_the_panel_and_shown(self, extension, result, run, tmp_path):
        np.save(tmp_path / "in.npy", POINTS + FAR)
        code, [line] = run(
            "analyze", tmp_path / "in.npy", "--modes", 3, "--neighbors", 30, "--out", tmp_path / "new" / "out.blend"
        )
        assert code == 0, line
        obj = opened(tmp_path / "new" / "out.blend")
        assert len(bpy.data.objects) == 1
        assert (obj.meshfree.neighbors, result.is_stale(obj)) == (30, False)
        assert obj.meshfree.total_area == pytest.approx(line["total_area"], rel=1e-6)
        assert "Curvature" in obj.meshfree.stages
        assert [item.name for item in obj.modifiers] == ["Mesh-Free Display"]
        assert extension.ui.display.shown_attribute(obj) == "lb_mean_curvature"
        assert_allclose(local_points(obj) + np.array(obj["lb_offset"]), POINTS + FAR, atol=1e-6)
        code, [line] = run("roughness", tmp_path / "new" / "out.blend", "--out", tmp_path / "again.ply")
        assert code == 0, line
        table = part("core.files").read_points(tmp_path / "again.ply")
        assert_allclose(table.points, POINTS + FAR, rtol=0, atol=1e-6)
        assert {"lb_roughness", "lb_area", "lb_eigenvector_003"} < table.attributes.keys()

    def test_notices_stay_in_the_file(self, run, tmp_path):
        write(tmp_path / "a.csv", np.vstack([POINTS, [[50.0, 0.0, 0.0]]]))
        for verb, tool in (("analyze", "Analyze Points"), ("section", "Cross Section")):
            code, [line] = run(verb, tmp_path / "a.csv", "--out", tmp_path / f"{verb}.blend")
            assert code == 0, line
            kept = opened(tmp_path / f"{verb}.blend").meshfree.notices
            assert [(each.tool, each.text) for each in kept] == [(tool, text) for text in line["notices"]]

    def test_earlier_results_beyond_the_number_go(self, run, tmp_path):
        np.save(tmp_path / "a.npy", POINTS)
        for source, count in (("a.npy", 3), ("b1.blend", 2)):
            given = "--count", count, "--modes", 12, "--out", tmp_path / f"b{4 - count if count > 2 else 2}.blend"
            assert run("signature", tmp_path / source, *given)[0] == 0
        names = opened(tmp_path / "b2.blend").data.attributes.keys()
        assert [name for name in names if name.startswith("lb_heat")] == [
            "lb_heat_signature_001",
            "lb_heat_signature_002",
        ]

    def test_points_that_are_deleted_take_all_they_hold(self, run, tmp_path):
        obj = add_object(np.vstack([POINTS, [[0.0, 0.0, 5.0]]]))
        add_group(obj, "Some", [5, 1000])
        save(tmp_path / "a.blend")
        code, [line] = run("stray-points", tmp_path / "a.blend", "--action", "delete", "--out", tmp_path / "b.blend")
        assert (code, line["points"]) == (0, 1000)
        obj = opened(tmp_path / "b.blend")
        assert_allclose(local_points(obj), POINTS, atol=1e-6)
        assert [vertex.index for vertex in obj.data.vertices if vertex.groups] == [5]

    def test_an_aligned_object_moves_as_a_whole(self, run, tmp_path):
        write(tmp_path / "plan.csv", BODY)
        obj = placed(BODY @ np.array(Matrix.Rotation(0.1, 3, "Z")) + [0.05, 0.0, 0.0], scale=(2.0, 2.0, 2.0))
        before = local_points(obj)
        save(tmp_path / "a.blend")
        code, [line] = run(
            "align", tmp_path / "a.blend", "--reference", tmp_path / "plan.csv", "--out", tmp_path / "b.blend"
        )
        assert code == 0, line
        obj = opened(tmp_path / "b.blend")
        assert_array_equal(local_points(obj), before)
        assert_allclose(world_points(obj), BODY, atol=5e-3)

    def test_linked_duplicates_by_choice(self, run, tmp_path):
        obj = add_object(POINTS)
        bpy.context.scene.collection.objects.link(obj.copy())
        save(tmp_path / "a.blend")
        given = "segment", tmp_path / "a.blend", "--object", "Cloud", "--out", tmp_path / "b.blend"
        code, [line] = run(*given)
        assert (code, "shares its mesh" in line["error"]) == (1, True)
        assert run(*given, "--make-single-user")[0] == 0
        opened(tmp_path / "b.blend")
        assert [("lb_segment" in obj.data.attributes) for obj in bpy.data.objects] == [True, False]

    def test_splats_bend_with_the_surface(self, core, run, tmp_path):
        bar = bar_splats(core)
        core.splats.write_splats(tmp_path / "a.ply", bar)
        given = "mode-shape", tmp_path / "a.ply", "--amplitude", 0.2
        assert run(*given, "--out", tmp_path / "b.ply")[0] == 0
        assert run("convert", tmp_path / "a.ply", "--out", tmp_path / "a.blend")[0] == 0
        code, [line] = run("mode-shape", tmp_path / "a.blend", "--amplitude", 0.2, "--out", tmp_path / "b.blend")
        assert code == 0, line
        assert run("convert", tmp_path / "b.blend", "--out", tmp_path / "c.ply")[0] == 0
        wanted, found = (core.splats.read_splats(tmp_path / f"{name}.ply") for name in "bc")
        assert np.abs(found.positions - bar.positions).max() > 0.1
        assert_allclose(found.positions, wanted.positions, atol=1e-4)
        assert_allclose(found.covariances, wanted.covariances, atol=1e-5)

    def test_a_mesh_hides_the_points(self, run, tmp_path):
        red, green, blue = 0.5 + 0.4 * POINTS.T
        write(tmp_path / "a.csv", POINTS + FAR, r=red, g=green, b=blue, height=POINTS[:, 2])
        assert run("convert", tmp_path / "a.csv", "--out", tmp_path / "a.blend")[0] == 0
        add_group(opened(tmp_path / "a.blend"), "Top", POINTS[:, 2] > 0.5)
        save(tmp_path / "b.blend")
        code, [line] = run("mesh", tmp_path / "b.blend", "--out", tmp_path / "c.blend")
        assert code == 0, line
        obj = opened(tmp_path / "c.blend")
        assert (obj.name, len(obj.data.polygons)) == ("a Surface", line["faces"])
        assert_array_equal(obj["lb_offset"], bpy.data.objects["a"]["lb_offset"])
        assert bpy.data.objects["a"].hide_get()
        assert_allclose(attribute(obj, "height"), local_points(obj)[:, 2], atol=0.02)
        assert_allclose(_colors(obj), 0.5 + 0.4 * local_points(obj), atol=0.02)
        top = [any(item.weight > 0.5 for item in vertex.groups) for vertex in obj.data.vertices]
        assert np.mean(np.array(top) == (local_points(obj)[:, 2] > 0.5)) > 0.95
        assert all(face.normal.dot(face.center) > 0.0 for face in obj.data.polygons)

    def test_curves_of_sections_and_profiles(self, run, tmp_path):
        placed(BODY)
        save(tmp_path / "a.blend")
        code, [line] = run("section", tmp_path / "a.blend", "--plane", "0,0,0.2", "--out", tmp_path / "b.blend")
        assert code == 0, line
        opened(tmp_path / "b.blend")
        made = bpy.data.objects["Body Section"]
        corners = np.array([tuple(made.matrix_world @ point.co.to_3d()) for point in made.data.splines[0].points])
        assert_allclose(corners[:, 2], 0.2, atol=1e-5)
        assert np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).sum() == pytest.approx(
            line["length"], rel=1e-4
        )
        assert run("profile", tmp_path / "a.blend", *ENDS, "--out", tmp_path / "b.csv")[0] == 0
        assert run("profile", tmp_path / "a.blend", *ENDS, "--out", tmp_path / "c.blend")[0] == 0
        assert opened(tmp_path / "c.blend").meshfree.profile.as_string() == (tmp_path / "b.csv").read_text()

    def test_the_input_is_never_overwritten(self, run, tmp_path):
        add_object(POINTS)
        before = save(tmp_path / "in.blend").read_bytes()
        code, [line] = run("analyze", tmp_path / "in.blend", "--out", tmp_path / "in.blend")
        assert (code, "overwrite its input" in line["error"]) == (1, True)
        assert (tmp_path / "in.blend").read_bytes() == before

    @pytest.mark.parametrize("fault", [BrokenPipeError("nobody listens"), KeyboardInterrupt()])
    def test_a_fault_leaves_the_output(self, run, tmp_path, monkeypatch, fault):
        def fail(*_):
            raise fault

        monkeypatch.setattr(part("command.stages").ToldStages, "__call__", fail)
        write(tmp_path / "in.csv", POINTS)
        (tmp_path / "out.blend").write_text("before")
        given = "smooth", tmp_path / "in.csv", "--out", tmp_path / "out.blend"
        if isinstance(fault, OSError):
            code, [line] = run(*given)
            assert (code, line["error"]) == (1, "nobody listens")
        else:
            with pytest.raises(KeyboardInterrupt):
                run(*given)
        assert (tmp_path / "out.blend").read_text() == "before"

    def test_outputs_in_a_folder_are_files_of_blender_unless_another_kind_is_asked_for(self, run, tmp_path):
        inputs = [write(tmp_path / f"{name}.csv", POINTS[: 900 + 50 * name]) for name in (1, 2)]
        assert run("roughness", *inputs, "--out-dir", tmp_path / "out")[0] == 0
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["1.blend", "2.blend"]


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_objects_of_point_clouds(run, tmp_path):
    """Their groups are attributes."""
    add_pointcloud(POINTS)
    file, out = save(tmp_path / "a.blend"), tmp_path / "b.blend"
    code, [line] = run("geodesic-distance", file, "--out", out)
    assert code == 0, line
    assert opened(out).type == "POINTCLOUD"
    assert (attribute(bpy.context.object, "lb_distance")[attribute(bpy.context.object, "Source")] == 0.0).all()
    code, [line] = run("thin-out", file, "--by", "number", "--count", 500, "--out", out)
    assert (code, line["points"]) == (0, 500), line
    assert len(opened(out).data.points) == 500


@pytest.mark.parametrize(("suffix", "importer"), [("ply", "ply_import"), ("obj", "obj_import"), ("stl", "stl_import")])
def test_blender_reads_meshes_that_are_written(run, tmp_path, suffix, importer):
    code, [line] = run("mesh", write(tmp_path / "a.csv", POINTS), "--out", tmp_path / f"a.{suffix}")
    assert (code, line["open_edges"]) == (0, 0), line
    new_file()
    getattr(bpy.ops.wm, importer)(forward_axis="Y", up_axis="Z", filepath=str(tmp_path / f"a.{suffix}"))
    [obj] = bpy.context.selected_objects
    mesh = obj.data
    assert len(mesh.vertices) == line["vertices"]
    assert len(mesh.polygons) == line["faces"] if suffix != "stl" else all(len(f.vertices) == 3 for f in mesh.polygons)
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 2
    assert all(face.normal.dot(face.center) > 0.0 for face in mesh.polygons)


def test_openings_are_kept_or_closed(run, tmp_path):
    write(tmp_path / "a.csv", POINTS[POINTS[:, 2] > 0.0])
    found = [run("mesh", tmp_path / "a.csv", *given)[1][0] for given in ((), ("--no-keep-open",))]
    assert (found[0]["open_edges"] > 30, found[1]["open_edges"]) == (True, 0)
    for ending in ("ply", "blend"):
        code, [line] = run("mesh", tmp_path / "a.csv", "--no-keep-open", "--out", tmp_path / f"b.{ending}")
        assert (code, line["faces"]) == (0, found[1]["faces"])
    obj = opened(tmp_path / "b.blend")
    assert len(obj.data.polygons) == line["faces"] > found[0]["faces"]
    assert len(obj.data.vertices) - len(obj.data.edges) + len(obj.data.polygons) == 2


def test_scans_are_written_as_they_were_read(run, tmp_path):
    """By the packages that the extension brings."""
    import laspy

    from tests.core.las_files import check_same, write_all

    given = write_all(tmp_path / "in.las", 7, full=255)
    assert run("analyze", tmp_path / "in.las", "--out", tmp_path / "out.laz")[0] == 0
    found = laspy.read(tmp_path / "out.laz")
    check_same(found, given, ("NormalX", "NormalY", "NormalZ"))
    assert (found["lb_area"] > 0.0).all()


@pytest.mark.parametrize(
    "arguments",
    [
        ("paint", "a.ply"),
        ("mesh", "a.csv", "--out", "a.npz"),
        ("measure", "a.csv", "--out", "a.blend"),
        ("transfer-weights", "a.csv", "--reference", "b.blend", "--out", "a.ply"),
        ("geodesic-distance", "a.csv"),
        ("geodesic-distance", "a.blend", "--at", "0,0,1", "--group", "Source"),
    ],
    ids=" ".join,
)
def test_wrong_usage(run, arguments):
    assert run(*arguments) == (2, [])


@pytest.mark.any_blender
@pytest.mark.parametrize("verb", ["analyze", "section", "rig", "smooth-weights", "transfer-weights"])
def test_help(command, capfd, verb):
    assert command.run([verb, "--help"]) == 0
    shown = capfd.readouterr().out
    assert "JSON line per input" in " ".join(shown.split())
    assert all(option in shown for option in ("--object NAME", "--use-modifiers", "--bandwidth", "--no-sheets"))
    assert "--at-once" not in shown


def test_the_extension_stays_usable_after_a_run(run, tmp_path):
    run("analyze", write(tmp_path / "a.csv", POINTS), "--out", tmp_path / "a.blend")
    new_file()
    add_object(POINTS, "After")
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}


def test_meshes_of_points_far_away_stand_where_these_are_exported(tmp_path):
    """In the interface: the object of the mesh keeps the shift of the import."""
    bpy.ops.meshfree.import_points(filepath=str(write(tmp_path / "a.csv", POINTS + FAR)))
    obj = bpy.context.object
    assert bpy.ops.meshfree.mesh_surface() == {"FINISHED"}
    assert_array_equal(bpy.context.object["lb_offset"], obj["lb_offset"])
    assert attribute(bpy.context.object, "position").shape[0] > 1000
