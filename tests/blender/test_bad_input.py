"""Objects that cannot be analyzed: a clear error that says what to do, and nothing changed."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused


def changed(points, index, value):
    points = points.copy()
    points[index] = value
    return points


def far_away(points):
    return points * 1e-4 + 1e3


def scattered(points):
    """A hundred components of ten points each, far from each other."""
    return points + 1000.0 * np.repeat(points[:100], 10, axis=0)


CLOUDS = {
    "NaN": (lambda points: changed(points, 3, np.nan), "1 of 1000 points.*Delete"),
    "infinite": (lambda points: changed(points, slice(3, 5), np.inf), "2 of 1000 points.*Delete"),
    "too few": (lambda points: points[:6], "there are 6\\."),
    "collinear": (lambda points: points * (1, 0, 0), "1000 points.*line"),
    "all at one place": (lambda points: 0 * points, "there are 1 among 1000"),
    "far from the origin": (far_away, "from the origin.*Shift"),
    "lone points only": (scattered, "of 1000 points are in components of too few points.*delete"),
}


@pytest.mark.parametrize("operator", ["analyze", "spectrum"])
@pytest.mark.parametrize(("cloud", "text"), CLOUDS.values(), ids=CLOUDS.keys())
def test_points_without_an_answer(operator, cloud, text):
    obj = add_object(cloud(sphere_points()))
    obj["lb_eigenvalues"] = [0.5]
    with refused(obj, f"(?s)Error: .*{text}"):
        getattr(bpy.ops.meshfree, operator)()


def assert_refused(obj, text):
    before = everything(obj)
    for operator in (bpy.ops.meshfree.analyze, bpy.ops.meshfree.spectrum, bpy.ops.meshfree.colormap):
        with pytest.raises(RuntimeError, match=text):
            operator()
    assert everything(obj) == before


def test_no_active_object():
    with pytest.raises(RuntimeError, match=r"No active object. Select a mesh"):
        bpy.ops.meshfree.analyze()


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("LIGHT", "a Light, not a Mesh. Select a mesh"),
        ("EMPTY", "an Empty, not a Mesh. Select a mesh"),
        ("FONT", "a Text, not a Mesh. Convert it"),
    ],
)
def test_object_of_another_type(kind, text):
    data = {
        "LIGHT": lambda: bpy.data.lights.new("Other", "POINT"),
        "EMPTY": lambda: None,
        "FONT": lambda: bpy.data.curves.new("Other", "FONT"),
    }[kind]()
    obj = bpy.data.objects.new("Other", data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    with pytest.raises(RuntimeError, match=f'"Other" is {text}'):
        bpy.ops.meshfree.analyze()


def test_edit_mode():
    obj = add_object(sphere_points())
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        assert_refused(obj, "not in Object Mode. Switch to Object Mode")
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_no_vertices():
    assert_refused(add_object(np.empty((0, 3))), "has no vertices. Add points")


def test_object_linked_from_a_library(tmp_path):
    obj = add_object(sphere_points(), "Linked")
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {obj})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, target):
        target.objects = ["Linked"]
    obj = target.objects[0]
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    assert_refused(obj, "linked from a library. Use Object > Relations > Make Local")


def test_mesh_linked_from_a_library(tmp_path):
    obj = add_object(sphere_points(), "Linked")
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {obj.data})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, target):
        target.meshes = ["Linked"]
    obj = bpy.data.objects.new("Local", target.meshes[0])
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    assert_refused(obj, "linked from a library")


def test_mesh_with_a_fake_user_is_not_shared():
    add_object(sphere_points()).data.use_fake_user = True
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            lambda obj: bpy.context.scene.collection.objects.link(obj.copy()),
            r'its mesh with "Cloud.001"\. Turn on Make',
        ),
        (lambda obj: obj.vertex_groups.new(name="lb_area"), "vertex groups named lb_area.*Rename"),
        (lambda obj: obj.vertex_groups.new(name="lb_boundary"), "vertex groups named lb_boundary.*Rename"),
        (
            lambda obj: obj.vertex_groups.new(name="lb_eigenvector_002"),
            "vertex groups named lb_eigenvector_002.*Rename",
        ),
        (lambda obj: setattr(obj, "scale", (1.0, 0.0, 1.0)), "scaled to nothing along an axis.*scale above zero"),
        (lambda obj: setattr(obj.meshfree, "bandwidth_factor", 0.1), "leaves fewer than 10 points.*Raise it"),
        (lambda obj: setattr(obj.data.vertices[0].co, "x", np.nan), "not finite"),
    ],
)
def test_what_cannot_be_analyzed_again(change, text):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    change(obj)
    bpy.context.view_layer.update()
    with refused(obj, text):
        bpy.ops.meshfree.analyze(modes=3)


def test_vertex_group_with_the_name_of_a_mode_that_is_not_written_does_no_harm():
    obj = add_object(sphere_points())
    obj.vertex_groups.new(name="lb_eigenvector_002")
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}


@pytest.mark.parametrize("operator", ["analyze", "spectrum"])
@pytest.mark.parametrize(
    ("members", "weight", "text"),
    [
        (None, 1.0, r'"Cloud" has no vertex group named "Boundary"\. Choose another Boundary Group, or clear it'),
        ([], 1.0, r'"Boundary" gives 0 of 1000 points a weight above zero.*Assign.*or clear Boundary Group'),
        ([3, 4], 1.0, "gives 2 of 1000 points"),
        (range(100), 0.0, "gives 0 of 1000 points"),
    ],
    ids=["missing", "empty", "two points", "no weight"],
)
def test_boundary_group_that_names_no_boundary(operator, members, weight, text):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze(modes=3)
    obj.meshfree.boundary_group = "Boundary"
    if members is not None:
        add_group(obj, "Boundary", members, weight)
    with refused(obj, f"(?s)Error: .*{text}"):
        getattr(bpy.ops.meshfree, operator)()


def test_colors_of_a_missing_or_unfit_attribute():
    obj = add_object(sphere_points())
    obj.data.attributes.new("edges", "FLOAT", "EDGE")
    before = everything(obj)
    for name, text in (("nothing", "no attribute nothing"), ("edges", "on the domain EDGE"), ("", "lb_mean_curvature")):
        with pytest.raises(RuntimeError, match=text):
            bpy.ops.meshfree.colormap(attribute=name)
    assert everything(obj) == before


def test_a_shape_beyond_single_precision_is_refused():
    obj = add_object(sphere_points(200))
    obj.scale = (0.5, 0.5, 0.5)
    bpy.context.view_layer.update()
    with refused(obj, "position has numbers up to"):
        bpy.ops.meshfree.mode_shape(amplitude=3.4e38)


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (1e25, r"lb_area has numbers up to \d.*e\+49.* beyond the 3e38"),
        (1e20, r"lb_area has numbers up to .*e\+3\d, beyond .* Scale the object down"),
        (1e19, r"lb_area, summed up, has numbers up to .*e\+39, beyond .* Scale the object down"),
        (1e-19, r"lb_area has numbers up to .*e-39 only, below .* Scale the object up"),
    ],
)
def test_sizes_beyond_single_precision_are_refused_with_the_way_out(size, text):
    obj = add_object(size * sphere_points(300))
    with refused(obj, text):
        bpy.ops.meshfree.analyze()


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("lb_gaussian_curvature", 1e39, "Scale the object up"),
        ("lb_eigenvector_002", -1e39, "Scale the object up"),
        ("lb_distance", 1e39, "Scale the object down"),
        ("lb_field", 1e39, "Use smaller values"),
        ("lb_field", np.inf, "values that are infinite or no numbers, 1 of 3"),
        ("lb_normal", np.nan, "no numbers, 1 of 3"),
    ],
)
def test_no_attribute_gets_what_it_cannot_hold(core, name, value, text):
    module = part("operators.objects.attributes")
    with pytest.raises(core.PointCloudError, match=text):
        module.check_size(name, np.array([0.0, 1.0, value]))
    module.check_size(name, np.array([0.0, 1.0, 1e38]))


def test_coverage_that_is_no_number():
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(range_mode="DATA")
    ends = obj.meshfree.range_low, obj.meshfree.range_high
    assert bpy.ops.meshfree.colormap(coverage=np.nan, range_mode="PERCENTILE") == {"FINISHED"}
    assert (obj.meshfree.range_low, obj.meshfree.range_high) == ends


def test_an_export_takes_the_name_of_a_file():
    add_object(sphere_points(200))
    with pytest.raises(RuntimeError, match="No file is named"):
        bpy.ops.meshfree.export_operator(filepath="")


@pytest.mark.parametrize("name", ["operator", "operator.npz", "operator.txt"])
def test_an_export_writes_the_file_that_is_named_and_no_other(tmp_path, name):
    add_object(sphere_points(200))
    assert bpy.ops.meshfree.export_operator(filepath=str(tmp_path / name)) == {"FINISHED"}
    assert [path.name for path in tmp_path.iterdir()] == [name]
    with np.load(tmp_path / name) as arrays:
        assert len(arrays["areas"]) == 200
