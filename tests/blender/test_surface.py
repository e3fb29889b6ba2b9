"""Points as discs: where they lie, how large they are, and what the display makes of them."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from mathutils.bvhtree import BVHTree
from numpy.testing import assert_allclose

from tests.blender.clouds import CORNERS, add_group, add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.test_display import rendered
from tests.blender.test_seeing import add_camera


@pytest.fixture
def obj():
    return add_object(sphere_points(600))


def drawn(obj):
    """Corners of all that the display draws, as many rows as there are points."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = obj.evaluated_get(graph).to_mesh()
    corners = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", corners.reshape(-1))
    return corners.reshape(len(obj.data.vertices), -1, 3).astype(np.float64)


def test_each_point_is_a_disc_about_its_tangent_plane(obj):
    assert bpy.ops.meshfree.show_surface() == {"FINISHED"}
    offset = drawn(obj) - local_points(obj)[:, None]
    assert offset.shape[1] == CORNERS  # middle, six corners a little below, and the middle of the cone below
    normals = attribute(obj, "lb_disc") / np.linalg.norm(attribute(obj, "lb_disc"), axis=1)[:, None]
    assert np.abs(np.einsum("ij,ij->i", normals, local_points(obj))).min() > 0.98
    height = np.einsum("ijk,ik->ij", offset, normals)
    size = np.linalg.norm(offset - height[:, :, None] * normals[:, None], axis=2)
    assert_allclose(np.sort(size, axis=1)[:, 2:], size.max(axis=1)[:, None] * np.ones(6), rtol=1e-3)
    assert_allclose(np.sort(size, axis=1)[:, :2], 0.0, atol=1e-5)
    depth = 0.25 * np.cos(np.pi / 6.0) * size.max(axis=1)
    assert_allclose(np.sort(height, axis=1), depth[:, None] * [-2.0, *6 * [-1.0], 0.0], atol=1e-5)


def sizes(obj):
    """Distances of the corners of all discs from the lines along their normals."""
    offset = drawn(obj) - local_points(obj)[:, None]
    normals = attribute(obj, "lb_disc") / np.linalg.norm(attribute(obj, "lb_disc"), axis=1)[:, None]
    return np.linalg.norm(np.cross(offset, normals[:, None]), axis=2).max(axis=1)


def test_discs_are_those_of_core_at_the_default_size(obj, core):
    bpy.ops.meshfree.show_surface()
    radii = core.surface.surface_discs(local_points(obj)).radii
    assert_allclose(sizes(obj), 1.1 * radii / np.cos(np.pi / 6.0), rtol=1e-3)


def test_discs_keep_the_scale_of_the_object_out(obj, core):
    obj.scale = 2.0, 2.0, 2.0
    bpy.context.view_layer.update()
    bpy.ops.meshfree.show_surface()
    assert_allclose(
        sizes(obj), 1.1 * core.surface.surface_discs(local_points(obj)).radii / np.cos(np.pi / 6.0), rtol=1e-3
    )


def test_point_shape_and_point_size_answer_at_once(obj):
    bpy.ops.meshfree.show_surface()
    before = drawn(obj)
    obj.meshfree.point_size *= 2.0
    points = local_points(obj)[:, None]
    assert_allclose(drawn(obj) - points, 2.0 * (before - points), atol=1e-5)
    obj.meshfree.point_shape = "DOTS"
    graph = bpy.context.evaluated_depsgraph_get()
    assert len(obj.evaluated_get(graph).to_mesh().vertices) == 0
    bpy.ops.meshfree.show_surface()
    assert obj.meshfree.point_shape == "DISCS"
    assert drawn(obj).shape[1] == CORNERS


def test_results_color_the_discs(obj, extension):
    bpy.ops.meshfree.show_surface()
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert extension.ui.display.shown_attribute(obj) == "lb_area"
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    assert len(mesh.vertices) == CORNERS * 600
    values = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes["lb_area"].data.foreach_get("value", values)
    assert_allclose(values.reshape(600, CORNERS), np.repeat(attribute(obj, "lb_area")[:, None], CORNERS, axis=1))


def test_a_point_that_was_added_since_is_still_seen(obj):
    bpy.ops.meshfree.show_surface()
    obj.data.vertices.add(1)
    obj.data.vertices[600].co = 3.0, 0.0, 0.0
    obj.data.update()
    assert np.linalg.norm(drawn(obj)[600] - [3.0, 0.0, 0.0], axis=1).max() > 0.01


def disc_sizes_of_core(obj, core):
    return 1.1 * core.surface.surface_discs(local_points(obj)).radii / np.cos(np.pi / 6.0)


def thin(obj):
    bpy.ops.meshfree.thin_out()


def delete_strays(obj):
    bpy.ops.meshfree.stray_points(action="DELETE")


def separate_strays(obj):
    bpy.ops.meshfree.stray_points(action="SEPARATE")


def edit(*work):
    """Do something to all points in Edit Mode, by operators of Blender."""

    def done(obj):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        for each in work:
            each()
        bpy.ops.object.mode_set(mode="OBJECT")

    return done


def join(obj):
    other = add_object(sphere_points(900, seed=4) * 0.5 + (3.0, 0.0, 0.0), "Other")
    bpy.context.view_layer.objects.active = obj
    other.select_set(True)
    bpy.ops.object.join()


def join_and_split(obj):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_random(ratio=0.7)
    bpy.ops.mesh.separate(type="SELECTED")
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize(
    "change",
    [
        thin,
        delete_strays,
        separate_strays,
        edit(lambda: bpy.ops.mesh.remove_doubles(threshold=0.1)),
        edit(lambda: bpy.ops.mesh.select_random(ratio=0.6), lambda: bpy.ops.mesh.delete(type="VERT")),
        edit(lambda: bpy.ops.transform.resize(value=(2.0, 2.0, 0.5))),
        join,
        join_and_split,
    ],
)
def test_discs_follow_points_that_come_go_or_move(core, change):
    obj = add_object(np.concatenate([sphere_points(1500), [[0.0, 0.0, 1.6], [0.0, 1.7, 0.0]]]))
    obj.select_set(True)
    bpy.ops.meshfree.show_surface()
    points = local_points(obj)
    change(obj)
    bpy.context.view_layer.update()
    assert points.shape != local_points(obj).shape or not np.allclose(points, local_points(obj))
    for each in bpy.data.objects:
        if "lb_disc" in each.data.attributes:
            assert_allclose(sizes(each), disc_sizes_of_core(each, core), rtol=2e-3)


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")
def test_discs_of_point_clouds_follow_too(obj, core):
    bpy.ops.meshfree.show_surface()
    bpy.ops.meshfree.convert()
    bpy.ops.meshfree.thin_out()
    found = core.surface.surface_discs(local_points(obj))
    radii = np.linalg.norm(attribute(obj, "lb_disc"), axis=1)
    assert_allclose(radii * core.geometry.typical_distance(local_points(obj)), found.radii, rtol=1e-3)


def test_discs_keep_their_sides_when_points_go(obj):
    bpy.ops.meshfree.show_surface()
    part("operators.objects.carried").write_discs(obj, -attribute(obj, "lb_disc"))
    bpy.ops.meshfree.thin_out()
    assert (np.einsum("ij,ij->i", attribute(obj, "lb_disc"), local_points(obj)) < 0.0).all()


def test_points_that_are_no_surface_any_more_become_dots(obj):
    bpy.ops.meshfree.show_surface()
    bpy.ops.meshfree.thin_out(by="NUMBER", count=3)
    assert "lb_disc" not in obj.data.attributes
    assert len(obj.data.vertices) == 3


def test_dots_grow_when_points_go(obj):
    bpy.ops.meshfree.colormap(attribute="position")
    modifiers = part("operators.objects.modifiers")
    [display] = obj.modifiers
    before = modifiers.get_input(display, "Radius")
    bpy.ops.meshfree.thin_out()
    assert 1.5 * before < modifiers.get_input(display, "Radius") < 3.0 * before
    modifiers.set_input(display, "Radius", 0.5)
    bpy.ops.meshfree.thin_out()
    assert modifiers.get_input(display, "Radius") == 0.5


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")
def test_point_clouds_are_drawn_as_discs_too(obj):
    bpy.ops.meshfree.convert()
    assert bpy.ops.meshfree.show_surface() == {"FINISHED"}
    assert len(attribute(obj, "lb_disc")) == 600


@pytest.mark.parametrize("count", [600, 3000])
def test_a_closed_cloud_shows_no_hole_from_any_side(count):
    obj = add_object(sphere_points(count))
    bpy.ops.meshfree.show_surface()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    discs = BVHTree.FromPolygons([vertex.co for vertex in mesh.vertices], [face.vertices for face in mesh.polygons])
    rng = np.random.default_rng(0)
    for _ in range(20):
        frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        radius, angle = 0.95 * np.sqrt(rng.random(400)), 2.0 * np.pi * rng.random(400)
        starts = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(400, 3.0)], axis=1) @ frame.T
        for start in starts:
            place, _, _, _ = discs.ray_cast(start, -frame[:, 2])
            assert place is not None
            assert np.array(place) @ frame[:, 2] > 0.0  # not one of the far side


def test_an_analysis_finds_discs_too(obj):
    bpy.ops.meshfree.analyze()
    assert drawn(obj).shape[1] == CORNERS
    bpy.ops.meshfree.show_surface()
    normals = attribute(obj, "lb_disc")
    bpy.ops.meshfree.analyze()
    cosine = np.einsum("ij,ij->i", normals, attribute(obj, "lb_disc")) / np.linalg.norm(normals, axis=1)
    assert_allclose(cosine, np.linalg.norm(normals, axis=1), rtol=0.05)


class TestDeformed:
    """Discs of points that a deformation moves."""

    TURN = Euler((0.4, -0.3, 0.8)).to_matrix()

    def bound(self, obj, anchors=False):
        for name, sign in (("Handle", 1.0), ("Anchor", -1.0))[: 1 + anchors]:
            add_group(obj, name, sign * local_points(obj)[:, 2] > 0.8)
        assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
        return next(child for child in obj.children if child.type == "EMPTY")

    def turned(self, obj):
        """Bind without anchors, and turn all."""
        empty = self.bound(obj)
        empty.matrix_world = Matrix.Translation((1.0, 2.0, 3.0)) @ self.TURN.to_4x4() @ empty.matrix_world
        assert bpy.ops.meshfree.deform_update() == {"FINISHED"}

    def check(self, rest, moved):
        """Compare places and spreads of the corners of discs, which tell nothing of their turn about their normals."""
        turn = np.array(self.TURN)
        one, other = rest.mean(axis=1), moved.mean(axis=1)
        assert_allclose(other, one @ turn.T + [1.0, 2.0, 3.0], atol=1e-5)
        spreads = [np.einsum("nka,nkb->nab", each, each) for each in (rest - one[:, None], moved - other[:, None])]
        assert_allclose(spreads[1], turn @ spreads[0] @ turn.T, atol=1e-5)

    @pytest.mark.parametrize("first", ["analyze", "deform_bind"])
    def test_they_turn_with_the_points(self, obj, first):
        if first == "analyze":
            bpy.ops.meshfree.analyze()
            rest = drawn(obj)
            self.turned(obj)
        else:  # discs that come later go along, too
            self.turned(obj)
            bpy.ops.meshfree.analyze()
            bpy.ops.meshfree.deform_reset()
            rest = drawn(obj)
            self.bound_again(obj)
        self.check(rest, drawn(obj))

    def bound_again(self, obj):
        empty = next(child for child in obj.children if child.type == "EMPTY")
        empty.matrix_world = Matrix.Translation((1.0, 2.0, 3.0)) @ self.TURN.to_4x4() @ empty.matrix_world
        bpy.context.view_layer.update()

    def test_those_found_while_points_are_moved_turn_at_once(self, obj):
        self.turned(obj)
        bpy.ops.meshfree.show_surface()
        found = drawn(obj)
        bpy.ops.meshfree.deform_reset()
        self.check(drawn(obj), found)

    def test_they_stretch_with_the_surface(self, obj, core):
        bpy.ops.meshfree.analyze()
        empty = self.bound(obj, anchors=True)
        empty.location.z += 1.0
        bpy.ops.meshfree.deform_update()
        points = local_points(obj).astype(float)
        laplacian = core.build_laplacian(points)
        moved = points + attribute(obj, "lb_displacement")
        normals, radii = attribute(obj, "lb_disc").astype(float), np.linalg.norm(attribute(obj, "lb_disc"), axis=1)
        gradients = core.deform.deformation_gradients(laplacian, moved)
        wanted = core.surface.Discs(normals / radii[:, None], radii).deformed(gradients)
        found = attribute(obj, "lb_moved_disc")
        sizes = np.linalg.norm(found, axis=1)
        assert np.median(np.einsum("ij,ij->i", found / sizes[:, None], wanted.normals)) > 0.999
        assert_allclose(np.median(sizes / wanted.radii), 1.0, atol=0.02)
        assert sizes.max() > 1.2 * radii.max()
        assert bpy.ops.meshfree.deform_apply() == {"FINISHED"}
        assert_allclose(attribute(obj, "lb_disc"), found, rtol=1e-5)
        assert "lb_moved_disc" not in obj.data.attributes

    def test_dots_leave_them_alone(self, obj):
        bpy.ops.meshfree.analyze()
        obj.meshfree.point_shape = "DOTS"
        self.turned(obj)
        assert "lb_moved_disc" not in obj.data.attributes
        obj.meshfree.point_shape = "DISCS"
        bpy.context.view_layer.update()
        assert "lb_moved_disc" in obj.data.attributes

    @pytest.mark.parametrize("way", ["deform_reset", "deform_unbind"])
    def test_they_go_back_to_rest(self, obj, way):
        bpy.ops.meshfree.analyze()
        rest = drawn(obj)
        self.turned(obj)
        assert getattr(bpy.ops.meshfree, way)() == {"FINISHED"}
        assert_allclose(drawn(obj), rest, atol=1e-6)
        assert "lb_moved_disc" not in obj.data.attributes

    def test_a_bake_shows_those_of_each_frame(self, obj):
        bpy.ops.meshfree.analyze()
        empty = self.bound(obj)
        for frame, angle in ((1, 0.0), (3, 1.0)):
            empty.rotation_euler = (angle, 0.0, 0.0)
            empty.keyframe_insert("rotation_euler", frame=frame)
        seen = []
        for frame in (1, 2, 3):
            bpy.context.scene.frame_set(frame)
            seen.append(drawn(obj))
        assert bpy.ops.meshfree.deform_bake(first=1, last=3) == {"FINISHED"}
        for frame in (3, 2, 1):
            bpy.context.scene.frame_set(frame)
            assert_allclose(drawn(obj), seen[frame - 1], atol=1e-5)
        assert np.abs(seen[2] - seen[0]).max() > 0.1

    @pytest.mark.parametrize("target", ["IN_PLACE", "SHAPE_KEY"])
    def test_smoothed_points_take_theirs_along(self, core, target):
        points = sphere_points(600)
        noise = 0.1 * 0.14 * np.random.default_rng(2).standard_normal(points.shape)
        obj = add_object(points + noise)
        bpy.ops.meshfree.show_surface()

        def off():
            discs = attribute(obj, "lb_disc")
            return np.linalg.norm(np.cross(discs, points), axis=1) / np.linalg.norm(discs, axis=1)

        before = off().mean()
        assert bpy.ops.meshfree.smooth(method="NOISE", target=target) == {"FINISHED"}
        assert off().mean() < 0.8 * before


def brightness(path, below):
    """Render a flat square from above or below; return how bright its middle is."""
    camera = bpy.context.scene.camera or add_camera()
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.5
    camera.location.z, camera.rotation_euler.x = (-5.0, np.pi) if below else (5.0, 0.0)
    return rendered(path).mean()


def test_the_back_side_is_dimmed_on_demand(tmp_path):
    side = np.linspace(-1.0, 1.0, 25)
    obj = add_object(np.stack([*map(np.ravel, np.meshgrid(side, side)), np.zeros(625)], axis=1))
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_area")
    below = attribute(obj, "lb_normal")[0, 2] > 0.0
    before = brightness(tmp_path / "before.png", below), brightness(tmp_path / "front.png", not below)
    obj.meshfree.dim_back = True
    after = brightness(tmp_path / "after.png", below), brightness(tmp_path / "still.png", not below)
    assert after[0] < 0.7 * before[0]
    assert after[1] > 0.85 * before[1]  # some of the light comes from discs in the same plane, from behind


class TestImport:
    @staticmethod
    def run(path, points, **options):
        np.save(path / "scan.npy", points)
        assert bpy.ops.meshfree.import_points(filepath=str(path / "scan.npy"), **options) == {"FINISHED"}
        return bpy.context.object

    @pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (446_123.456, 4_000_456.789, 78.9)])
    @pytest.mark.parametrize("up", ["Z", "Y"])
    def test_a_scan_looks_like_a_surface_at_first_sight(self, tmp_path, up, place):
        obj = self.run(tmp_path, sphere_points(600) * (1.0, 2.0, 3.0) + place, up=up)
        assert drawn(obj).shape == (600, CORNERS, 3)
        found = attribute(obj, "lb_disc")
        bpy.ops.meshfree.show_surface()
        expected = attribute(obj, "lb_disc")
        size = np.linalg.norm(expected, axis=1)
        assert_allclose(np.linalg.norm(found, axis=1), size, rtol=1e-3)
        assert_allclose(np.abs(np.einsum("ij,ij->i", found, expected)), size**2, rtol=1e-3)

    @pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")
    def test_point_cloud_objects_keep_their_points(self, tmp_path, extension):
        obj = self.run(tmp_path, sphere_points(600), kind="POINTCLOUD")
        assert (obj.type, len(obj.data.points), len(attribute(obj, "lb_disc"))) == ("POINTCLOUD", 600, 600)
        assert extension.ui.display.find_display(obj) is not None

    def test_it_can_be_turned_off(self, tmp_path, extension):
        obj = self.run(tmp_path, sphere_points(600), surface=False)
        assert "lb_disc" not in obj.data.attributes
        assert extension.ui.display.find_display(obj) is None

    def test_of_very_many_points_dots_are_shown_and_a_notice_tells(self, tmp_path, extension, monkeypatch, capfd):
        monkeypatch.setattr(extension.operators.files.importing, "_QUICK", 599)
        obj = self.run(tmp_path, sphere_points(600))
        assert extension.ui.display.find_display(obj) is not None  # for renders, which show no loose points
        assert "lb_disc" not in obj.data.attributes
        assert "scan is shown as dots. Discs of 600 points take a while" in capfd.readouterr().out
        obj = self.run(tmp_path, sphere_points(599))
        assert "lb_disc" in obj.data.attributes

    @pytest.mark.parametrize(
        "points",
        [
            np.zeros((1, 3)),
            np.eye(4)[:, :3],
            np.ones((50, 3)),
            np.linspace(0.0, 1.0, 50)[:, None] * [1.0, 2.0, 3.0],
            np.array([[1e30, 0.0, 0.0], *np.random.default_rng(0).random((50, 3))]),
        ],
        ids=["one", "four", "all at one place", "a line", "one very far"],
    )
    def test_points_that_are_no_surface_are_imported_all_the_same(self, tmp_path, points, capfd):
        obj = self.run(tmp_path, points)
        assert len(obj.data.vertices) == len(points)
        notice = "is shown as dots" in capfd.readouterr().out
        assert notice == ("lb_disc" not in obj.data.attributes)
        assert len(obj.modifiers) == 1

    def test_four_points_are_dots(self, tmp_path, capfd):
        assert "lb_disc" not in self.run(tmp_path, np.eye(4)[:, :3]).data.attributes
        assert "scan is shown as dots" in capfd.readouterr().out

    def test_discs_of_the_file_are_kept(self, tmp_path):
        obj = add_object(sphere_points(600))
        bpy.ops.meshfree.show_surface()
        turned = -attribute(obj, "lb_disc")
        names = "x y z lb_disc_x lb_disc_y lb_disc_z"  # as files of version 0.2 have them
        np.savetxt(tmp_path / "again.xyz", np.hstack([local_points(obj), turned]), header=names)
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / "again.xyz"))
        assert bpy.context.object.name == "again"
        assert_allclose(attribute(bpy.context.object, "lb_disc"), turned, atol=1e-6)
