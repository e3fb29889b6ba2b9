"""Tiles of a survey become one object: evenly thinned out, to a level of detail, or in full inside a box."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.core.copc_files import write_copc

FAR = np.array([446_100.0, 4_000_400.0, 80.0])
STEP = 1e-4  # of single precision at the size of the survey, in metres
SIDE = 30  # metres of a tile, with a point a metre
COUNT = 4 * SIDE * SIDE


def ground():
    """Return points on the ground of a survey, (COUNT, 3), with millimetres, a tile after another."""
    x, y = np.meshgrid(np.arange(SIDE) + 0.25, np.arange(SIDE) + 0.5)
    tile = np.column_stack([x.ravel(), y.ravel(), np.round(2.0 * np.sin(0.2 * x.ravel()), 3)])
    places = [(0, 0, 0), (SIDE, 0, 0), (0, SIDE, 0), (SIDE, SIDE, 0)]
    return FAR + np.concatenate([tile + place for place in places])


def write_las(path, points, first=0):
    """By the laspy that the extension brings, with a result as `tiles` writes it."""
    import laspy

    header = laspy.LasHeader(point_format=7, version="1.4")
    header.offsets, header.scales = FAR, np.full(3, 0.001)
    header.add_extra_dim(laspy.ExtraBytesParams("lb_mean_curvature", np.float32))
    header.add_extra_dim(laspy.ExtraBytesParams("row", np.uint32))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.row = first + np.arange(len(points))
    las.classification = 2 + las.row % 3
    las.lb_mean_curvature = np.linspace(-1.0, 1.0, len(points))
    las.write(str(path))


@pytest.fixture
def survey(tmp_path):
    """Write four tiles, and return their paths."""
    points, paths = ground(), [tmp_path / f"survey_{x}_{y}.laz" for y in (0, 1) for x in (0, 1)]
    for number, (path, tile) in enumerate(zip(paths, np.split(points, 4), strict=True)):
        write_las(path, tile, number * SIDE * SIDE)
    return paths


def run_import(paths, **options):
    names = [{"name": path.name} for path in paths]
    given = {"directory": str(paths[0].parent), "files": names} if len(paths) > 1 else {"filepath": str(paths[0])}
    assert bpy.ops.meshfree.import_tiles(**given, **options) == {"FINISHED"}
    return bpy.context.object


def notices(obj):
    return [notice.text for notice in obj.meshfree.notices]


def points_of(obj):
    """Return the points of an object in the coordinates of the file."""
    return local_points(obj).astype(np.float64) + np.array(obj.get("lb_offset", (0.0, 0.0, 0.0)))


@pytest.mark.parametrize("kind", ["MESH", "POINTCLOUD"][: 1 + (bpy.app.version >= (4, 5))])
def test_all_tiles_are_one_object(survey, kind):
    obj = run_import(survey, density="ALL", kind=kind)
    assert (obj.name, obj.type, len(bpy.data.objects)) == ("survey", kind, 1)
    assert obj.select_get()
    points = ground()
    assert_array_equal(attribute(obj, "row"), np.arange(COUNT))
    assert_allclose(points_of(obj), points, rtol=0.0, atol=STEP)
    assert_array_equal(attribute(obj, "classification"), 2 + np.arange(COUNT) % 3)
    assert f"survey: {COUNT:,} of {COUNT:,} points of 4 files are imported" in notices(obj)


def test_a_number_of_points_is_spread_evenly_over_the_tiles(survey):
    obj = run_import(survey, count=200)
    rows = attribute(obj, "row")
    assert 180 <= len(rows) <= 200
    assert_allclose(points_of(obj), ground()[rows], rtol=0.0, atol=STEP)
    shares = np.bincount(rows // SIDE**2, minlength=4) / len(rows)
    assert_allclose(shares, 0.25, atol=0.04)
    assert f"{len(rows)} of {COUNT:,} points of 4 files are imported" in " ".join(notices(obj))


@pytest.mark.parametrize("suffix", [".laz", ".ply"])
def test_in_full_inside_the_cube_of_an_empty_that_is_turned(tmp_path, survey, suffix):
    """Chosen in the overview: the empty lies in the shifted coordinates of that."""
    files = part("core.files")
    if suffix == ".ply":
        for number, path in enumerate(survey):
            table = files.read_points(path)
            survey[number] = path.with_suffix(".ply")
            files.write_points(survey[number], table)
    overview = run_import(survey, count=100)
    offset = np.array(overview["lb_offset"])
    empty = bpy.data.objects.new("Here", None)
    bpy.context.collection.objects.link(empty)
    empty.empty_display_size = 2.0
    turn = Euler((0.0, 0.0, 0.6)).to_matrix().to_4x4()
    place = FAR + (28.0, 31.0, 0.0)
    empty.matrix_world = Matrix.Translation(place - offset) @ turn @ Matrix.Diagonal((3.0, 1.5, 5.0, 1.0))
    obj = run_import(survey, density="ALL", box="Here")
    local = (ground() - place) @ np.array(turn)[:3, :3]
    inside = (np.abs(local) <= (6.0, 3.0, 10.0)).all(axis=1)
    assert 50 < np.count_nonzero(inside) < 100
    assert_array_equal(np.sort(attribute(obj, "row")), np.flatnonzero(inside))
    assert obj["lb_offset"].to_list() == overview["lb_offset"].to_list()
    assert f"{np.count_nonzero(inside)} of {COUNT:,} points" in " ".join(notices(obj))


def test_inside_the_bounding_box_of_a_mesh(survey):
    points = ground()
    low, high = FAR + (10.0, 10.0, -5.0), FAR + (15.0, 50.0, 5.0)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    box = add_object(corners - FAR)
    box["lb_offset"] = FAR.tolist()
    obj = run_import(survey, density="ALL", box=box.name)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    assert_array_equal(np.sort(attribute(obj, "row")), np.flatnonzero(inside))


def test_levels_of_detail(tmp_path):
    points = ground()
    levels = write_copc(tmp_path / "a.copc.laz", points)
    obj = run_import([tmp_path / "a.copc.laz"], density="LEVEL", level=1)
    assert obj.name == "a"
    assert_array_equal(np.sort(attribute(obj, "intensity")), np.flatnonzero(levels <= 1))
    write_las(tmp_path / "b.laz", points)
    with pytest.raises(RuntimeError, match="has no levels of detail, which only COPC files have"):
        run_import([tmp_path / "b.laz"], density="LEVEL", level=1)


def test_classes_and_columns_are_a_choice(survey):
    obj = run_import(survey, density="ALL", classes="3", attributes=False)
    assert_allclose(points_of(obj), ground()[1::3], rtol=0.0, atol=STEP)
    assert "row" not in obj.data.attributes


@pytest.mark.parametrize(
    ("color", "shown"),
    [("", "lb_mean_curvature"), ("classification", "classification"), ("mean_curvature", "lb_mean_curvature")],
)
def test_points_show_an_attribute(survey, color, shown):
    obj = run_import(survey, count=100, color=color)
    assert part("ui.display").shown_attribute(obj) == shown


def test_an_attribute_that_no_file_has_is_told(survey):
    obj = run_import(survey, count=100, color="roughness")
    assert any('the files have no "roughness"' in text for text in notices(obj))


def test_the_names_of_columns_are_suggested(survey):
    tiles = part("operators.files.tiles").MESHFREE_OT_import_tiles
    survey[1].write_bytes(b"no scan")
    for path, known in ((survey[0], True), (survey[1], False), (survey[0].parent, False)):
        chosen = type("Chosen", (), {"chosen": lambda self, path=path: [path]})()
        names = tiles.column_names(chosen)
        assert {"classification", "lb_mean_curvature"} <= {*names} if known else names == []


def test_colors_of_the_scan_come_first(tmp_path):
    files = part("core.files")
    paths = [tmp_path / f"{number}.ply" for number in (1, 2)]
    for path, points in zip(paths, np.split(ground(), 2), strict=True):
        colors = np.tile(np.float32([1.0, 0.0, 0.2, 1.0]), (len(points), 1))
        files.write_points(path, files.PointTable(points, {"classification": np.ones(len(points), int)}, colors))
    obj = run_import(paths, count=50)
    assert obj.name == "Tiles"
    assert part("ui.display").shown_attribute(obj) == "Color"


BAD = {
    "box": ({"box": "None"}, 'There is no object "None" for the box'),
    "flat box": ({"box": "Flat"}, '"Flat" is flat, so nothing is inside its box'),
    "far box": ({"box": "Far"}, "None of the 3,600 points is inside the box"),
    "classes": ({"classes": "ground"}, "is no class of LAS"),
    "no points": ({"classes": "99"}, "has no points"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_done_is_told_and_nothing_is_added(survey, what):
    options, text = BAD[what]
    add_object(sphere_points(50) * (1.0, 1.0, 0.0), "Flat")
    add_object(sphere_points(50), "Far")
    with pytest.raises(RuntimeError, match=text):
        run_import(survey, density="ALL", **options)
    assert sorted(obj.name for obj in bpy.data.objects) == ["Far", "Flat"]
    assert len(bpy.data.meshes) == 2


def test_a_broken_tile_stops_all(survey):
    survey[2].write_bytes(survey[2].read_bytes()[:2000])
    with pytest.raises(RuntimeError, match=f"{survey[2].name} .*Copy it again"):
        run_import(survey)
    assert len(bpy.data.objects) == 0


def test_too_many_points_for_the_memory_are_refused(survey, monkeypatch):
    monkeypatch.setattr(part("operators.files.tiles"), "available_memory", lambda: 130_000)
    with pytest.raises(RuntimeError, match="More than 1,800 points need more memory than is free. Import a number"):
        run_import(survey, density="ALL")
    assert run_import(survey, count=100)


def test_one_undo_takes_it_back(survey):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.meshfree.import_tiles(
        "EXEC_DEFAULT", True, directory=str(survey[0].parent), files=[{"name": path.name} for path in survey]
    )
    assert len(bpy.data.objects) == 1
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == 0


def test_an_import_again_reads_no_file(survey, monkeypatch):
    run_import(survey, count=100)
    monkeypatch.setattr(part("operators.files.tiles"), "chunks", None)
    assert run_import(survey, count=100, color="classification")
