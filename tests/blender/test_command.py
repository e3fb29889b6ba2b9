"""The command line, by the function that Blender calls with its arguments."""

import json

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, grid_points, sphere_points
from tests.blender.conftest import part

POINTS = sphere_points()


@pytest.fixture
def run(command, capfd):
    """Run the command line; return the exit code and the JSON lines."""

    def run(*arguments):
        code = command.run([str(argument) for argument in arguments])
        lines = [json.loads(line) for line in capfd.readouterr().out.splitlines() if line.startswith("{")]
        return code, lines

    return run


def write_ply(path):
    obj = add_object(POINTS)
    obj.select_set(True)
    bpy.ops.wm.ply_export(filepath=str(path), forward_axis="Y", up_axis="Z", export_selected_objects=True)


def write_obj(path):
    path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in POINTS))


def write_text(delimiter, header="", decimal=".", extra=0):
    def write(path):
        rows = np.hstack([POINTS, np.zeros((len(POINTS), extra))])
        lines = [delimiter.join(f"{value:.9g}".replace(".", decimal) for value in row) for row in rows]
        path.write_text("\n".join([*header.splitlines(), *lines]))

    return write


def write_blend(path):
    add_object(POINTS)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


FORMATS = {
    "a.ply": write_ply,
    "b.obj": write_obj,
    "c.xyz": write_text(" "),
    "d.csv": write_text(",", header="# made by hand\nx,y,z,w", extra=1),
    "e.csv": write_text(";", header="x;y;z", decimal=","),
    "f.txt": write_text("\t"),
    "h.pts": write_text(" ", header=str(len(POINTS))),
    "i.npy": lambda path: np.save(path, POINTS),
    "g.blend": write_blend,
}


@pytest.mark.any_blender
@pytest.mark.parametrize("name", FORMATS)
def test_every_input_gives_what_core_gives(core, run, tmp_path, name):
    FORMATS[name](tmp_path / name)
    code, lines = run("analyze", tmp_path / name, "--out", tmp_path / "out.npz", "--modes", 4)
    assert code == 0, lines
    laplacian = core.build_laplacian(POINTS)
    spectrum = laplacian.eigenpairs(4)
    (line,) = lines
    assert line["file"] == str(tmp_path / name)
    assert line["points"] == 1000
    assert line["total_area"] == pytest.approx(laplacian.areas.sum(), rel=1e-4)
    assert line["trusted_area"] == line["total_area"]
    assert line["eigenvalues"] == pytest.approx(spectrum.eigenvalues.tolist(), rel=1e-3, abs=1e-9)
    assert (line["component_count"], line["boundary_count"], line["left_out_count"]) == (1, 0, 0)
    assert line["notices"] == []
    assert line["seconds"]["Spectrum"] >= 0.0
    with np.load(tmp_path / "out.npz") as arrays:
        assert_allclose(arrays["points"], POINTS, atol=1e-6)
        assert_allclose(arrays["areas"], laplacian.areas, rtol=0.05)
        assert_allclose(arrays["normals"], laplacian.normals, atol=1e-2)
        assert_allclose(arrays["smoothing_lengths"], laplacian.smoothing_lengths, rtol=1e-4)
        assert arrays["mean_curvature"].shape == (1000,)
        assert arrays["eigenvectors"].shape == (1000, 4)
        assert arrays["eigenvalues"].tolist() == line["eigenvalues"]
        assert_allclose(arrays["gaussian_curvature"], laplacian.gaussian_curvature, rtol=0.01)
        assert not arrays["boundary"].any()
        assert not arrays["component"].any()
        assert not arrays["doubt"].any()
        stiffness = {"format", "shape", "data", "indices", "indptr"}
        numbers = arrays.keys() - {"boundary", "component", "doubt"} - stiffness
        assert {arrays[key].dtype for key in numbers} == {np.dtype(np.float64)}
        assert stiffness < arrays.keys()


def test_blend_output_holds_attributes_eigenvalues_and_colors(run, tmp_path):
    write_obj(tmp_path / "in.obj")
    code, _ = run("analyze", tmp_path / "in.obj", "--out", tmp_path / "new" / "out.blend", "--modes", 3)
    assert code == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new" / "out.blend"))
    obj = bpy.context.view_layer.objects.active
    assert len(obj["lb_eigenvalues"]) == 3
    assert attribute(obj, "lb_eigenvector_003").shape == (1000,)
    assert [item.name for item in obj.modifiers] == ["Mesh-Free Display"]
    assert len(bpy.data.objects) == 1


def test_ply_output_holds_the_points_and_attributes(run, tmp_path):
    write_obj(tmp_path / "in.obj")
    code, _ = run("analyze", tmp_path / "in.obj", "--out", tmp_path / "out.ply", "--modes", 2)
    assert code == 0
    header = (tmp_path / "out.ply").read_bytes().split(b"end_header")[0].decode()
    assert "element vertex 1000" in header
    for name in ("x", "nx", "lb_area", "lb_mean_curvature", "lb_gaussian_curvature", "lb_eigenvector_002"):
        assert f"property float {name}\n" in header
    assert " lb_boundary\n" in header
    assert " lb_component\n" in header


@pytest.mark.any_blender
@pytest.mark.parametrize("suffix", ["ply", "xyz", "csv"])
def test_points_far_from_the_origin_are_written_where_they_were(run, tmp_path, suffix):
    read_points = part("core.files").read_points
    far = np.array([400_000.0, 5_000_000.0, 100.0])
    np.save(tmp_path / "in.npy", POINTS + far)
    for verb in ("analyze", "segment"):
        code, lines = run(verb, tmp_path / "in.npy", "--out-dir", tmp_path / verb, "--format", suffix)
        assert code == 0, lines
        table = read_points(tmp_path / verb / f"in.{suffix}")
        assert_allclose(table.points, POINTS + far, rtol=0, atol=1e-6)
        assert ("lb_area" if verb == "analyze" else "lb_segment") in table.attributes
    code, lines = run("analyze", tmp_path / "segment" / f"in.{suffix}")
    assert lines[0]["total_area"] == pytest.approx(4.0 * np.pi, rel=0.01)


def test_what_of_a_file_is_left_out_is_told(run, tmp_path):
    rows = "".join(f"{x},{y},{z},tree\n" for x, y, z in POINTS)
    (tmp_path / "in.csv").write_text(f"x,y,z,code\n{rows}nan,1,2,tree\n")
    code, (line,) = run("analyze", tmp_path / "in.csv")
    assert (code, line["points"]) == (0, 1000)
    assert line["notices"] == [
        "in.csv: left out code, which holds text.",
        "in.csv: left out 1 points that the sensor missed (NaN).",
    ]


def test_classes_and_withheld_points_of_scans(run, tmp_path):
    import laspy

    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.x, las.y, las.z = np.vstack([POINTS, 2.0 * POINTS]).T
    las.classification = np.repeat([2, 5], len(POINTS))
    las.withheld = np.arange(2 * len(POINTS)) == 0
    las.write(str(tmp_path / "in.las"))
    for options, count in (
        (["--classes", "2"], len(POINTS) - 1),
        (["--classes", "5"], len(POINTS)),
        (["--classes", "2", "--withheld"], len(POINTS)),
    ):
        code, (line,) = run("analyze", tmp_path / "in.las", *options)
        assert (code, line["points"]) == (0, count)
        assert any("points of other classes" in notice for notice in line["notices"])
    las.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr('PROJCS["a",UNIT["foot",0.3048]]'))
    las.write(str(tmp_path / "in.las"))
    feet, meters = (run("analyze", tmp_path / "in.las", *options)[1][0] for options in ([], ["--meters"]))
    assert "coordinates are in feet" in feet["notices"][1]
    assert "converted to meters" in meters["notices"][1]
    assert meters["total_area"] == pytest.approx(0.3048**2 * feet["total_area"], rel=1e-5)
    code, (line,) = run("analyze", tmp_path / "in.las", "--classes", "ground")
    assert "no class of LAS" in line["error"]


@pytest.mark.parametrize("kind", [1, 7])
def test_scans_are_written_as_they_were_read(run, tmp_path, kind):
    import laspy

    from tests.core.las_files import check_same, write_all

    given = write_all(tmp_path / "in.las", kind, full=255)
    assert run("analyze", tmp_path / "in.las", "--out", tmp_path / "out.laz")[0] == 0
    found = laspy.read(tmp_path / "out.laz")
    check_same(found, given, ("NormalX", "NormalY", "NormalZ"))
    assert (found["lb_area"] > 0.0).all()


def test_stiffness_of_the_arrays(core, run, tmp_path):
    from scipy.sparse import load_npz  # bundled with the extension

    np.save(tmp_path / "in.npy", POINTS)
    run("analyze", tmp_path / "in.npy", "--out", tmp_path / "out.npz")
    laplacian = core.build_laplacian(POINTS)
    difference = abs(load_npz(tmp_path / "out.npz") - laplacian.stiffness).max()
    assert difference < 1e-3 * laplacian.stiffness.diagonal().max()


def test_many_inputs_one_failing(run, tmp_path):
    write_obj(tmp_path / "a.obj")
    (tmp_path / "b.csv").write_text("x,y\n1,2\n")
    write_text(" ")(tmp_path / "c.xyz")
    inputs = [tmp_path / name for name in ("a.obj", "b.csv", "missing.ply", "c.xyz")]
    code, lines = run("analyze", *inputs, "--out-dir", tmp_path / "out", "--format", "npz")
    assert code == 1
    assert ["error" in line for line in lines] == [False, True, True, False]
    assert "columns of numbers x y z" in lines[1]["error"]
    assert "no file" in lines[2]["error"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.npz", "c.npz"]


def test_without_output_it_only_prints(run, tmp_path):
    write_obj(tmp_path / "in.obj")
    code, lines = run("analyze", tmp_path / "in.obj")
    assert code == 0
    assert lines[0]["output"] is None
    assert [path.name for path in tmp_path.iterdir()] == ["in.obj"]


@pytest.mark.any_blender
def test_settings(core, run, tmp_path):
    write_text(" ")(tmp_path / "in.xyz")
    given = ("--neighbors", 60, "--bandwidth", "global")
    code, lines = run("analyze", tmp_path / "in.xyz", "--modes", 3, *given)
    assert code == 0
    options = core.LaplacianOptions(neighbors=60, bandwidth="global")
    spectrum = core.build_laplacian(POINTS, options=options).eigenpairs(3)
    assert lines[0]["eigenvalues"][1:] == pytest.approx(spectrum.eigenvalues[1:].tolist(), rel=1e-3)
    few = sphere_points(300)
    np.save(tmp_path / "few.npy", few)
    code, lines = run("analyze", tmp_path / "few.npy", "--modes", 3, "--laplacian", "paper", "--neighbors", 60)
    assert code == 0
    spectrum = core.paper.build_laplacian(few, neighbors=60).eigenpairs(3)
    assert lines[0]["eigenvalues"][1:] == pytest.approx(spectrum.eigenvalues[1:].tolist(), rel=1e-3)


@pytest.mark.any_blender
def test_boundaries_parts_and_points_left_out_are_told(run, tmp_path):
    points, outermost = grid_points()
    np.savetxt(tmp_path / "in.xyz", np.vstack([points, POINTS + (20.0, 0.0, 0.0), [[0.0, 0.0, 50.0]]]))
    code, (line,) = run("analyze", tmp_path / "in.xyz", "--out", tmp_path / "out.npz")
    assert code == 0
    assert (line["component_count"], line["boundary_count"], line["left_out_count"]) == (2, outermost.sum(), 1)
    assert any("left out of the operator: 1" in notice for notice in line["notices"])
    with np.load(tmp_path / "out.npz") as arrays:
        assert (arrays["boundary"][: len(points)] == outermost).all()
        assert arrays["component"][-1] == -1
    code, (line,) = run("analyze", tmp_path / "in.xyz", "--boundary", "off")
    assert (code, line["boundary_count"]) == (0, 0)


def test_boundary_group_of_a_blend_file(run, tmp_path):
    points, outermost = grid_points()
    add_group(add_object(points), "Edge", outermost)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    code, (line,) = run("analyze", tmp_path / "in.blend", "--boundary-group", "Edge", "--boundary", "off")
    assert (code, line["boundary_count"]) == (0, outermost.sum())
    code, (line,) = run("analyze", tmp_path / "in.blend", "--boundary-group", "Boundary")
    assert code == 1
    assert 'no vertex group named "Boundary"' in line["error"]


def test_object_of_a_blend_file(run, tmp_path):
    add_object(POINTS, "One")
    add_object(2.0 * POINTS, "Two")
    bpy.context.view_layer.objects.active = None
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    code, lines = run("analyze", tmp_path / "in.blend")
    assert code == 1
    assert "no active mesh object" in lines[0]["error"]
    assert "--object: One, Two" in lines[0]["error"]
    code, lines = run("analyze", tmp_path / "in.blend", "--object", "Two")
    assert code == 0
    assert lines[0]["total_area"] == pytest.approx(16.0 * np.pi, rel=0.01)
    code, lines = run("analyze", tmp_path / "in.blend", "--object", "Three")
    assert code == 1
    assert 'no mesh object "Three"' in lines[0]["error"]


def test_text_far_from_the_origin_keeps_its_precision(run, tmp_path):
    far = np.array([400_000.0, 5_000_000.0, 100.0])
    np.savetxt(tmp_path / "in.xyz", POINTS + far, fmt="%.17g")
    code, lines = run("analyze", tmp_path / "in.xyz", "--out", tmp_path / "out.npz")
    assert code == 0, lines
    assert lines[0]["total_area"] == pytest.approx(4.0 * np.pi, rel=0.01)
    with np.load(tmp_path / "out.npz") as arrays:
        assert_allclose(arrays["points"], POINTS + far, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("1 2 nan\n" * 200, "all 200 have no valid coordinates"),
        ("1 2 3\n1 2 x\n", "columns of numbers"),
        ("\0\1\2 binary", "columns of numbers"),
    ],
    ids=["NaN", "word", "binary"],
)
def test_bad_text(run, tmp_path, text, error):
    (tmp_path / "in.txt").write_text(text)
    code, lines = run("analyze", tmp_path / "in.txt")
    assert code == 1
    assert error in lines[0]["error"]


def test_columns_of_text_that_are_given(run, tmp_path):
    write_text(" ", extra=1)(tmp_path / "a.xyz")
    code, lines = run("analyze", tmp_path / "a.xyz", "--out", tmp_path / "b.ply", "--columns", "y x z heat")
    assert (code, lines[0]["points"], lines[0]["notices"]) == (0, 1000, [])
    table = part("core.files").read_points(tmp_path / "b.ply")
    assert_allclose(table.points, POINTS[:, [1, 0, 2]], atol=1e-6)
    assert "heat" in table.attributes
    code, lines = run("analyze", tmp_path / "a.xyz", "--columns", "x y z")
    assert code == 1
    assert "3 columns are named, but its first point has 4" in lines[0]["error"]


def test_unreadable_files(run, tmp_path):
    (tmp_path / "bad.ply").write_text("this is no PLY")
    (tmp_path / "bad.blend").write_text("this is no Blender file")
    (tmp_path / "empty.obj").write_text("")
    (tmp_path / "scan.e57").write_text("ASTM-E57")
    (tmp_path / "scan.laz").write_text("")
    inputs = sorted(tmp_path.iterdir())
    code, lines = run("analyze", *inputs)
    assert code == 1
    assert all(line["error"] for line in lines)
    assert len(lines) == 5
    assert "scan.e57 is no E57 file" in lines[-2]["error"]
    assert "scan.laz is no LAS file" in lines[-1]["error"]


def test_input_is_never_overwritten(run, tmp_path):
    write_blend(tmp_path / "in.blend")
    before = (tmp_path / "in.blend").read_bytes()
    code, lines = run("analyze", tmp_path / "in.blend", "--out", tmp_path / "in.blend")
    assert code == 1
    assert "overwrite its input" in lines[0]["error"]
    assert (tmp_path / "in.blend").read_bytes() == before


@pytest.mark.any_blender
@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("analyze",),
        ("paint", "a.ply"),
        ("analyze", "a.ply", "b.ply", "--out", "c.npz"),
        ("analyze", "a.ply", "--out", "c.stl"),
        ("analyze", "a.ply", "--modes", "-1"),
        ("analyze", "a.ply", "--modes", "many"),
        ("analyze", "a.ply", "a.obj", "--out-dir", "out"),
        ("analyze", "a.ply", "--out", "c.npz", "--out-dir", "out"),
        ("analyze", "a.ply", "--areas", "wrong"),
    ],
)
def test_wrong_usage_has_exit_code_2(run, capfd, arguments):
    assert run(*arguments) == (2, [])


def test_help(command, capfd):
    assert command.run(["analyze", "--help"]) == 0
    shown = capfd.readouterr().out
    for text in (
        "--out-dir",
        "--modes",
        "--bandwidth",
        "--boundary-group NAME",
        "--no-sheets",
        "one JSON line per input",
    ):
        assert text in shown


def test_extension_stays_usable_after_a_run(run, tmp_path):
    write_obj(tmp_path / "in.obj")
    run("analyze", tmp_path / "in.obj")
    add_object(POINTS, "After")
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}


class TestVerbs:
    def test_smoothing_moves_the_points(self, run, tmp_path):
        rough = POINTS * (1.0 + np.random.default_rng(1).normal(0.0, 0.03, (len(POINTS), 1)))
        np.savetxt(tmp_path / "a.xyz", rough)
        code, (line,) = run("smooth", tmp_path / "a.xyz", "--out", tmp_path / "a.npz", "--strength", 0.9)
        assert code == 0
        assert line["points"] == 1000
        assert "moved by" in line["done"]
        smooth = np.load(tmp_path / "a.npz")["points"]
        before, after = (np.std(np.linalg.norm(points, axis=1)) for points in (rough, smooth))
        assert after < 0.5 * before

    def test_segmenting_many(self, run, tmp_path):
        for name in "ab":
            np.savetxt(tmp_path / f"{name}.xyz", POINTS * [3.0, 1.0, 1.0])
        out = tmp_path / "out"
        code, lines = run(
            "segment", tmp_path / "a.xyz", tmp_path / "b.xyz", "--parts", 3, "--out-dir", out, "--format", "npz"
        )
        assert code == 0
        assert [line["done"].split(": ")[1] for line in lines] == ["3 parts", "3 parts"]
        labels = [np.load(out / f"{name}.npz")["segment"] for name in "ab"]
        assert set(labels[0]) == {0, 1, 2}
        assert (labels[0] == labels[1]).all()

    def test_settings_count(self, run, tmp_path):
        np.savetxt(tmp_path / "a.xyz", POINTS)
        code, (line,) = run("signature", tmp_path / "a.xyz", "--count", 3, "--modes", 20, "--bandwidth-factor", 0.1)
        assert code == 1
        assert "leaves fewer than 10 points" in line["error"]

    def test_choices_of_an_operator_are_options(self, run):
        assert run("smooth", "x.ply", "--method", "NONSENSE")[0] == 2

    def test_a_blend_file_holds_the_colored_result(self, run, tmp_path):
        np.savetxt(tmp_path / "a.xyz", POINTS)
        assert run("segment", tmp_path / "a.xyz", "--out", tmp_path / "a.blend")[0] == 0
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
        obj = bpy.context.object
        assert "lb_segment" in obj.data.attributes
        assert obj.modifiers

    def test_the_history_of_the_area(self, run, tmp_path):
        points, _ = grid_points()
        np.savetxt(tmp_path / "a.xyz", points + np.sin(points[:, :1]) * [0.0, 0.0, 0.3])
        code, (line,) = run("minimal-surface", tmp_path / "a.xyz", "--steps", 3, "--out", tmp_path / "a.npz")
        assert code == 0
        assert f"in {len(np.load(tmp_path / 'a.npz')['area_history'])} steps" in line["done"]

    def test_angles_are_in_degrees(self, run, tmp_path):
        np.savetxt(tmp_path / "a.xyz", POINTS)
        moved = {}
        for phase in (0, 180):
            assert run("mode-shape", tmp_path / "a.xyz", "--phase", phase, "--out", tmp_path / "a.npz")[0] == 0
            moved[phase] = np.load(tmp_path / "a.npz")["points"] - POINTS
        assert_allclose(moved[0], -moved[180], atol=1e-5)

    @pytest.mark.parametrize(
        "arguments",
        [
            ("smooth", "--strength", "1.5"),
            ("smooth", "--strength", "nan"),
            ("smooth", "--wavelength", "-1"),
            ("segment", "--parts", "0"),
            ("segment", "--parts", "2.5"),
            ("segment", "--parts", "99999999999"),
            ("signature", "--count", "1000"),
            ("analyze", "--neighbors", "2"),
        ],
    )
    def test_numbers_that_blender_would_silently_replace(self, run, arguments, capfd):
        assert run(*arguments, "a.ply") == (2, [])

    def test_errors_read_as_those_of_analyze(self, run, tmp_path):
        np.savetxt(tmp_path / "a.xyz", POINTS)
        code, (line,) = run("smooth", tmp_path / "a.xyz", "--group", "Nowhere")
        assert code == 1
        assert line["error"].startswith('"a" has no vertex group named "Nowhere"')

    def test_linked_duplicates_by_choice(self, run, tmp_path):
        obj = add_object(POINTS)
        bpy.context.scene.collection.objects.link(obj.copy())
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        code, (line,) = run("segment", tmp_path / "a.blend", "--object", "Cloud")
        assert code == 1
        assert "shares its mesh" in line["error"]
        assert run("segment", tmp_path / "a.blend", "--object", "Cloud", "--make-single-user")[0] == 0


@pytest.mark.any_blender
class TestNothingBreaks:
    @pytest.mark.parametrize(
        ("name", "data"),
        [
            (
                "a.ply",
                b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\nend_header\n",
            ),
            ("a.xyz", b"1 2 3\n1_0 2 3\n"),
            ("a.csv", b"1," * 1_000_000),
            ("a.pts", b"1000000000000\n1 2 3\n"),
            ("a.obj", b"v 1 2 \0\n"),
            ("a.npy", b"\x93NUMPY\1\0\x0a\0(((((((((("),
            ("a.npz", b"PK\3\4" + bytes(100)),
            ("a.txt", b""),
            ("a.blend", b"BLENDER-v405" + bytes(100)),
            ("b.blend", b"garbage"),
        ],
    )
    def test_broken_inputs_give_an_error_in_one_line(self, run, tmp_path, name, data):
        (tmp_path / name).write_bytes(data)
        code, (line,) = run("analyze", tmp_path / name, "--out", tmp_path / "out.ply")
        assert code == 1
        assert line.keys() == {"file", "error"}
        assert str(tmp_path / name) in line["error"]
        assert [path.name for path in tmp_path.iterdir()] == [name]

    @pytest.mark.parametrize("suffix", ["ply", "xyz", "csv", "npz", "blend"])
    @pytest.mark.parametrize("verb", ["analyze", "smooth"])
    @pytest.mark.parametrize("fault", [BrokenPipeError("nobody listens"), KeyboardInterrupt()])
    def test_a_fault_leaves_the_output(self, stages, cache, run, tmp_path, monkeypatch, suffix, verb, fault):
        def fail(*_):
            raise fault

        monkeypatch.setattr(stages.Stages, "__call__", fail)
        write_obj(tmp_path / "in.obj")
        output = tmp_path / f"out.{suffix}"
        output.write_text("before")
        arguments = (verb, tmp_path / "in.obj", "--out", output)
        if isinstance(fault, OSError):
            code, (line,) = run(*arguments)
            assert (code, line["error"]) == (1, "nobody listens")
        else:
            with pytest.raises(KeyboardInterrupt):
                run(*arguments)
        assert output.read_text() == "before"
        assert sorted(path.name for path in tmp_path.iterdir()) == ["in.obj", output.name]


def write_frames(folder, lengths=(0.85, 1.0, 1.15)):
    """A slowly growing ellipsoid whose longest axes change places, each frame of its own points, numbered 9, 10, 11."""
    folder.mkdir()
    for number, length in enumerate(lengths):
        points = sphere_points(1000 + 50 * number) * [length, 1.0, 0.6]
        np.save(folder / f"frame_{number + 9}.npy", points[np.random.default_rng(number).permutation(len(points))])
    return folder


def test_a_sequence_keeps_signs_and_order_of_modes(run, tmp_path):
    frames, out = write_frames(tmp_path / "frames"), tmp_path / "out"
    code, lines = run("analyze", "--sequence", frames, "--modes", 4, "--out-dir", out, "--format", "npz")
    assert code == 0, lines
    assert [line["file"] for line in lines] == [str(frames / f"frame_{number}.npy") for number in (9, 10, 11)]
    assert min(min(line["overlaps"]) for line in lines) > 0.9
    along = []
    for line in lines:
        arrays = np.load(line["output"])
        projected = arrays["points"].T @ (arrays["areas"][:, None] * arrays["eigenvectors"])
        along.append(
            [(int(np.argmax(np.abs(mode))), float(np.sign(mode[np.argmax(np.abs(mode))]))) for mode in projected.T]
        )
        assert_allclose(arrays["eigenvalues"], line["eigenvalues"])
    assert along[0][1:3] == along[1][1:3] == along[2][1:3]  # mode 0 is constant
    assert lines[0]["eigenvalues"][1] < lines[0]["eigenvalues"][2]
    assert lines[2]["eigenvalues"][1] > lines[2]["eigenvalues"][2]  # they have crossed


def test_a_broken_frame_is_told_and_the_next_continues_the_one_before_it(run, tmp_path):
    frames = write_frames(tmp_path / "frames", (1.2, 1.2, 1.2))
    (frames / "frame_10.npy").write_bytes(b"nothing")
    code, lines = run("analyze", "--sequence", frames, "--modes", 3)
    assert code == 1
    assert [("error" in line) for line in lines] == [False, True, False]
    assert min(lines[2]["overlaps"]) > 0.9


def test_a_sequence_without_modes_or_frames_is_wrong_usage(run, tmp_path):
    assert run("analyze", "--sequence", write_frames(tmp_path / "frames"))[0] == 2
    (tmp_path / "empty").mkdir()
    assert run("analyze", "--sequence", tmp_path / "empty", "--modes", 3)[0] == 2
