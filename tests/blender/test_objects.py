"""What artists do with objects: copies, joins, conversions, other files; and colors of groups."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, everything, grid_points, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.test_deform import lift
from tests.blender.test_display import display_points
from tests.blender.test_panel import draw

POINT_CLOUDS = pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
ROLES = ("Handle", "Anchor", "Fixed", "Source", "Low", "High", "Value", "Boundary")


@pytest.fixture
def cloud():
    obj = add_object(sphere_points(600) * (1.0, 1.3, 1.7))
    choose(obj)
    return obj


@pytest.fixture
def bound():
    """Add a strip that is bound, with its handle lifted by 1."""
    points, _ = grid_points(columns=40, rows=8, jitter=0.0)
    obj = add_object(points)
    add_group(obj, "Anchor", points[:, 0] < 0.25)
    add_group(obj, "Handle", points[:, 0] > 3.65)
    choose(obj)
    bpy.ops.meshfree.deform_bind()
    lift(empty_of(obj), 1.0)
    return obj


def choose(*objects):
    """Select these objects and no others; the first is active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    bpy.context.view_layer.objects.active = objects[0]


def empty_of(obj):
    return obj.meshfree.deform.handle_items[0].empty


def displacement(obj):
    return attribute(obj, "lb_displacement")


def duplicate(*objects, linked=False):
    choose(*objects)
    bpy.ops.object.duplicate(linked=linked)
    bpy.context.view_layer.update()
    return bpy.context.object


class TestCopiesOfBoundObjects:
    """A copy stays as it is, with handles of its own on demand, and never moves what belongs to its original."""

    def test_a_copy_keeps_its_shape_wherever_it_is_moved(self, bound):
        before = displacement(bound)
        copy = duplicate(bound)
        copy.location.y += 3.0
        lift(empty_of(bound), 0.5)
        assert_allclose(displacement(copy), before, atol=1e-6)
        assert displacement(bound)[:, 2].max() == pytest.approx(1.5, abs=5e-3)
        reason = part("operators.deform.binding").stale_reason
        assert reason(bound) == ""
        assert 'has no handles of its own, "Cloud" has them' in reason(copy)
        assert any(text.startswith("Copy. It has no handles") for text in draw())

    def test_bound_again_it_follows_a_copy_of_the_handle(self, bound):
        before = displacement(bound)
        copy = duplicate(bound)
        copy.location.y += 3.0
        bpy.context.view_layer.update()
        assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
        assert empty_of(copy).parent == copy
        assert empty_of(bound).parent == bound
        assert_allclose(displacement(copy), before, atol=1e-4)
        lift(empty_of(copy), 0.5)
        assert displacement(copy)[:, 2].max() == pytest.approx(1.5, abs=5e-3)
        assert_allclose(displacement(bound), before, atol=1e-4)

    def test_a_copy_together_with_its_handle_works_on_its_own(self, bound):
        before = displacement(bound)
        copy = duplicate(bound, empty_of(bound))
        lift(empty_of(copy), 0.5)
        assert displacement(copy)[:, 2].max() == pytest.approx(1.5, abs=5e-3)
        assert_allclose(displacement(bound), before)
        assert [part("operators.deform.binding").stale_reason(obj) for obj in (bound, copy)] == ["", ""]

    @pytest.mark.parametrize("name", ["reset", "unbind"])
    def test_nothing_is_taken_from_the_original(self, bound, name):
        before, place = displacement(bound), empty_of(bound).matrix_world.copy()
        copy = duplicate(bound)
        getattr(bpy.ops.meshfree, f"deform_{name}")()
        assert empty_of(bound).matrix_world == place
        assert_allclose(displacement(bound), before)
        if name == "reset":
            assert not displacement(copy).any()
        else:
            assert "lb_displacement" not in copy.data.attributes
        lift(empty_of(bound), 0.5)
        assert displacement(bound)[:, 2].max() == pytest.approx(1.5, abs=5e-3)

    def test_the_last_of_the_copies_removes_the_handle(self, bound):
        copy = duplicate(bound)
        choose(bound)
        bpy.ops.meshfree.deform_unbind()
        assert [obj.name for obj in bpy.data.objects if obj.type == "EMPTY"] == ["Cloud Handle"]
        choose(copy)
        bpy.ops.meshfree.deform_unbind()
        assert not [obj for obj in bpy.data.objects if obj.type == "EMPTY"]

    def test_a_linked_copy_shows_what_the_original_shows(self, bound):
        copy = duplicate(bound, linked=True)
        lift(empty_of(bound), 0.5)
        assert displacement(copy)[:, 2].max() == pytest.approx(1.5, abs=5e-3)
        reason = part("operators.deform.binding").stale_reason
        assert reason(bound) == ""
        assert 'shares its mesh with "Cloud", whose handles move both' in reason(copy)

    def test_the_handle_leads_to_the_original(self, bound):
        copy = duplicate(bound)
        copy.name = "A"  # before the other in the scene's order, or not
        assert part("operators.deform.handles").handled_object(empty_of(bound), bpy.context.scene) == bound

    def test_appended_to_another_file_it_follows(self, bound, tmp_path):
        path = str(tmp_path / "bound.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.append(filepath=f"{path}/Object/Cloud", directory=f"{path}/Object/", filename="Cloud")
        appended = bpy.data.objects["Cloud"]
        assert part("operators.deform.binding").stale_reason(appended) == ""
        lift(empty_of(appended), 0.5)
        assert displacement(appended)[:, 2].max() == pytest.approx(1.5, abs=5e-3)

    def test_linked_from_another_file_it_is_shown_and_refused(self, bound, tmp_path):
        path = str(tmp_path / "bound.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.link(filepath=f"{path}/Object/Cloud", directory=f"{path}/Object/", filename="Cloud")
        choose(bpy.data.objects["Cloud"])
        with pytest.raises(RuntimeError, match="linked from a library"):
            bpy.ops.meshfree.deform_bind()
        evaluated = bpy.context.object.evaluated_get(bpy.context.evaluated_depsgraph_get())
        heights = np.array([vertex.co.z for vertex in evaluated.data.vertices])
        assert heights.max() == pytest.approx(1.0, abs=5e-3)


class TestGroupColors:
    """Points of groups have colors, over what is on show or on plain points."""

    @pytest.fixture
    def grouped(self, cloud):
        for number, role in enumerate(ROLES):
            add_group(cloud, role, np.arange(75 * number, 75 * number + 50))
        return cloud

    def colors(self, obj):
        """Colours of the groups in the material, by name."""
        nodes = part("ui.display").find_material(obj).node_tree.nodes
        found = {}
        for node in nodes:
            if node.type == "ATTRIBUTE" and node.name.startswith("Group "):
                inside = node.outputs["Fac"].links[0].to_node
                mixed = inside.outputs[0].links[0].to_node
                found[node.attribute_name] = tuple(mixed.inputs["Color2"].default_value)
        return found

    def test_without_an_analysis(self, grouped):
        grouped.meshfree.show_groups = True
        ((count, names, radii, _),) = display_points(grouped)
        assert count == 600
        assert names >= set(ROLES)  # which the material reads
        assert radii.max() == pytest.approx(1.1 * grouped.meshfree.spacing)
        colors = self.colors(grouped)
        assert set(colors) == set(ROLES)
        assert len(set(colors.values())) == 8
        assert part("ui.display").shown_attribute(grouped) == ""
        grouped.meshfree.show_groups = False
        assert not grouped.modifiers
        assert not bpy.data.materials

    def test_on_a_surface_without_an_analysis(self, grouped):
        bpy.ops.meshfree.show_surface()
        grouped.meshfree.show_groups = True
        assert set(self.colors(grouped)) == set(ROLES)
        grouped.meshfree.show_groups = False
        assert len(grouped.modifiers) == 1  # which shows the surface
        assert part("ui.display").find_material(grouped) is None
        assert not bpy.data.materials

    def test_without_points(self, capfd):
        obj = add_object([])
        obj.meshfree.show_groups = True
        assert len(obj.modifiers) == 1
        obj.meshfree.point_size = 2.0
        obj.meshfree.show_groups = False
        assert not obj.modifiers
        assert "Traceback" not in capfd.readouterr().err  # Blender goes on when a setting's own function fails

    def test_over_what_is_on_show(self, grouped):
        bpy.ops.meshfree.analyze()
        grouped.meshfree.show_groups = True
        for name in ("lb_area", "lb_normal", "lb_boundary"):
            bpy.ops.meshfree.colormap(attribute=name)
            assert part("ui.display").shown_attribute(grouped) == name
            assert set(self.colors(grouped)) == set(ROLES)
        grouped.meshfree.outside = "HIDE"
        assert set(self.colors(grouped)) == set(ROLES)
        grouped.meshfree.show_groups = False
        assert part("ui.display").shown_attribute(grouped) == "lb_boundary"
        assert self.colors(grouped) == {}

    def test_plain_points_become_colored_by_an_analysis(self, grouped):
        grouped.meshfree.show_groups = True
        bpy.ops.meshfree.analyze()
        assert part("ui.display").shown_attribute(grouped) == "lb_mean_curvature"
        assert len(grouped.modifiers) == 1
        assert set(self.colors(grouped)) == set(ROLES)

    def test_the_picture(self, grouped, tmp_path):
        scene = bpy.context.scene
        top, bottom = (sign * local_points(grouped)[:, 2] > 0.9 for sign in (1, -1))
        grouped.vertex_groups.clear()
        add_group(grouped, "Handle", top)
        add_group(grouped, "Anchor", bottom)
        grouped.meshfree.show_groups = True
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(camera)
        camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
        camera.location, camera.rotation_euler = (0.0, -10.0, 0.0), (np.pi / 2, 0.0, 0.0)
        scene.camera = camera
        scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
        scene.render.resolution_x = scene.render.resolution_y = 48
        scene.render.resolution_percentage = 100
        scene.render.film_transparent = True
        scene.view_settings.view_transform = "Standard"
        scene.render.filepath = str(tmp_path / "groups.png")
        bpy.ops.render.render(write_still=True)
        pixels = np.array(bpy.data.images.load(scene.render.filepath).pixels).reshape(48, 48, 4)

        def middle(rows):
            shown = pixels[rows][pixels[rows][:, :, 3] == 1.0][:, :3]
            return np.median(shown, axis=0)

        red, green, blue = middle(slice(38, 42))
        assert red > 3.0 * max(green, blue)
        red, green, blue = middle(slice(6, 10))
        assert blue > green > red
        assert np.ptp(middle(slice(22, 26))) < 0.02

    def test_more_handles_and_other_names(self, grouped):
        for name in ("Handle.001", "Edge", "Stay"):
            add_group(grouped, name, np.arange(5))
        grouped.meshfree.boundary_group, grouped.meshfree.deform.anchors = "Edge", "Stay"
        grouped.meshfree.show_groups = True
        colors = self.colors(grouped)
        assert colors["Handle.001"] == colors["Handle"]
        assert colors["Edge"] == colors["Boundary"]
        assert colors["Stay"] == colors["Anchor"]

    def test_a_handle_that_is_added_gets_its_color(self, grouped):
        grouped.meshfree.show_groups = True
        grouped.data.vertices.foreach_set("select", np.arange(600) > 590)
        bpy.ops.meshfree.handle_add()
        assert "Handle.001" in self.colors(grouped)

    def test_in_edit_mode(self, grouped):
        bpy.ops.object.mode_set(mode="EDIT")
        grouped.meshfree.show_groups = True
        assert grouped.meshfree.spacing > 0.05
        bpy.ops.object.mode_set(mode="OBJECT")
        ((count, *_),) = display_points(grouped)
        assert count == 600

    def test_points_follow_a_deformation(self, bound):
        bound.meshfree.show_groups = True
        graph = bpy.context.evaluated_depsgraph_get()
        (points,) = [item.object.data for item in graph.object_instances if item.object.type == "POINTCLOUD"]
        places = np.array([point.co[:] for point in points.points])
        weights = np.array([value.value for value in points.attributes["Handle"].data])
        assert_allclose(places[weights > 0.0, 2], 1.0, atol=1e-4)

    def test_a_material_of_the_user_is_left_alone(self, grouped, modifiers):
        bpy.ops.meshfree.analyze()
        own = bpy.data.materials.new("Own")
        modifiers.set_input(part("ui.display").find_display(grouped), "Material", own)
        grouped.meshfree.show_groups = True
        assert modifiers.get_input(part("ui.display").find_display(grouped), "Material") == own

    @pytest.mark.parametrize("shown", [False, True])
    def test_the_panel(self, grouped, shown):
        grouped.meshfree.show_groups = shown
        texts = draw()
        assert "Assign to Handles" in texts
        assert texts.count("50") == 8


class TestSeveral:
    """Several selected objects of all kinds in one go."""

    def test_all_that_share_a_mesh_show_it(self, display, cloud):
        copy = duplicate(cloud, linked=True)
        copy.location.x += 5.0
        choose(cloud, copy)
        bpy.ops.meshfree.analyze()
        assert [display.shown_attribute(obj) for obj in (cloud, copy)] == ["lb_mean_curvature"] * 2
        assert copy.meshfree.total_area == cloud.meshfree.total_area

    @POINT_CLOUDS
    def test_mixed_types(self, cloud):
        other = add_object(sphere_points(500), "Other")
        other.modifiers.new("Array", "ARRAY")
        points = add_object(sphere_points(400), "Points")
        choose(points)
        bpy.ops.meshfree.convert(target="POINTCLOUD")
        bpy.ops.mesh.primitive_uv_sphere_add(segments=40, ring_count=24)
        faces = bpy.context.object
        empty = bpy.data.objects.new("Empty", None)
        bpy.context.scene.collection.objects.link(empty)
        choose(cloud, other, points, faces, empty)
        for name in ("analyze", "smooth", "signature"):
            settings = {"modes": 12, "count": 2} if name == "signature" else {}
            assert getattr(bpy.ops.meshfree, name)(**settings) == {"FINISHED"}
        for obj in (cloud, other, points, faces):
            assert "lb_heat_signature_002" in obj.data.attributes
            assert obj.meshfree.total_area > 0.0


class TestObstacles:
    """What cannot be worked on says why."""

    def test_an_instance_of_a_collection(self, cloud):
        collection = bpy.data.collections.new("Shells")
        collection.objects.link(cloud)
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        bpy.context.scene.collection.objects.link(empty)
        choose(empty)
        with pytest.raises(RuntimeError, match='"Instance" shows the collection "Shells". Select an object of that'):
            bpy.ops.meshfree.analyze()

    def test_an_empty(self):
        choose_empty = bpy.data.objects.new("Nothing", None)
        bpy.context.scene.collection.objects.link(choose_empty)
        choose(choose_empty)
        with pytest.raises(RuntimeError, match='"Nothing" is an Empty, not a Mesh. Select a mesh'):
            bpy.ops.meshfree.analyze()

    @POINT_CLOUDS
    @pytest.mark.parametrize("shape", ["DOTS", "DISCS"])
    def test_points_lost_by_blenders_own_conversion(self, cloud, shape):
        cloud.meshfree.point_shape = shape
        bpy.ops.meshfree.analyze()
        bpy.ops.object.convert(target="POINTCLOUD")
        with pytest.raises(RuntimeError, match="Undo, and instead of Object > Convert"):
            bpy.ops.meshfree.analyze()


class TestOrdinaryEdits:
    """Blender's own edits leave results that are right, or say that they are stale."""

    @pytest.mark.parametrize("scale", [(2, 2, 2), (1, 2, 3), (-1, 1, 1)])
    def test_apply_scale(self, cloud, scale):
        cloud.scale = scale
        bpy.ops.meshfree.analyze()
        area, normals = cloud.meshfree.total_area, attribute(cloud, "lb_normal")
        outward = np.einsum("ij,ij->i", normals, local_points(cloud))
        bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
        assert part("operators.objects.result").is_stale(cloud)
        bpy.ops.meshfree.analyze()
        assert cloud.meshfree.total_area == pytest.approx(area, rel=1e-4)
        again = np.einsum("ij,ij->i", attribute(cloud, "lb_normal"), local_points(cloud))
        assert (outward > 0.0).all() == (again > 0.0).all()

    def test_join(self, cloud):
        bpy.ops.meshfree.analyze(modes=3)
        other = add_object(sphere_points(500) + (5.0, 0.0, 0.0), "Other")
        choose(other)
        bpy.ops.meshfree.analyze(modes=5)
        choose(cloud, other)
        bpy.ops.object.join()
        assert part("operators.objects.result").is_stale(cloud)
        bpy.ops.meshfree.analyze()
        assert cloud.meshfree.component_count == 2
        assert "lb_eigenvalues" not in cloud
        assert not [name for name in cloud.data.attributes.keys() if "eigenvector" in name]
        cloud.meshfree.point_shape = "DOTS"
        ((count, *_),) = display_points(cloud)
        assert count == 1100

    def test_separate(self, cloud):
        bpy.ops.meshfree.analyze(modes=3)
        cloud.data.vertices.foreach_set("select", local_points(cloud)[:, 2] > 0.0)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.separate(type="SELECTED")
        bpy.ops.object.mode_set(mode="OBJECT")
        separated = bpy.data.objects["Cloud.001"]
        assert part("operators.objects.result").is_stale(cloud)
        assert part("operators.objects.result").is_stale(separated)
        for obj in (cloud, separated):
            choose(obj)
            assert bpy.ops.meshfree.analyze() == {"FINISHED"}
        assert cloud.meshfree.total_area + separated.meshfree.total_area < 25.0

    def test_a_copied_display_modifier_shows_its_own_object(self, display, cloud):
        bpy.ops.meshfree.analyze()
        other = add_object(sphere_points(500), "Other")
        choose(cloud, other)
        bpy.ops.object.make_links_data(type="MODIFIERS")
        choose(other)
        bpy.ops.meshfree.analyze()
        assert display.find_material(other) != display.find_material(cloud)
        assert len(other.modifiers) == 1

    def test_hidden_and_instanced_ones(self, cloud):
        bpy.ops.meshfree.analyze()
        area = cloud.meshfree.total_area
        cloud.hide_set(True)
        bpy.context.view_layer.objects.active = cloud
        bpy.ops.meshfree.smooth()
        bpy.ops.meshfree.analyze()
        assert cloud.meshfree.total_area == pytest.approx(area, rel=0.05)


def test_counts_of_large_groups_come_by_and_by(counting, cloud, monkeypatch):
    add_group(cloud, "Handle", np.arange(30))
    registered = []

    class App:
        background = False
        timers = type(
            "Timers",
            (),
            {
                "register": staticmethod(lambda function, **options: registered.append(function)),
                "is_registered": staticmethod(lambda function: function in registered),
                "unregister": staticmethod(registered.remove),
            },
        )

    class Blender:
        app, data, context, types = App, bpy.data, bpy.context, bpy.types

    monkeypatch.setattr(counting, "bpy", Blender)
    monkeypatch.setattr(counting, "_AT_ONCE", 100)
    monkeypatch.setattr(counting, "_CHUNK", 70)
    monkeypatch.setattr(counting, "_STEP", 0.0001)
    cloud.meshfree.boundary_group = "Handle"
    assert counting.members(cloud, "Handle", glance=True) is None
    assert not part("operators.objects.reading").fingerprint(cloud, glance=True)
    exact = counting.members(cloud, "Handle")
    counting.renew_counts(cloud)
    add_group(cloud, "Anchor", np.arange(7))
    assert counting.members(cloud, "Anchor", glance=True) is None
    steps = 0
    while registered[-1]() is not None:
        steps += 1
        assert steps < 200
    assert counting.members(cloud, "Handle", glance=True) == exact
    assert counting.members(cloud, "Anchor", glance=True).count == 7


@POINT_CLOUDS
class TestConverting:
    """Mesh to point cloud and back, with all that belongs to it."""

    @pytest.fixture
    def ready(self, cloud):
        add_group(cloud, "Handle", np.arange(50))
        add_group(cloud, "Anchor", np.arange(50, 80), weight=0.5)
        cloud.data.vertices.foreach_set("select", np.arange(600) < 20)
        bpy.ops.meshfree.analyze(modes=3)
        bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
        return cloud

    def test_there_and_back(self, ready):
        display, result = part("ui.display"), part("operators.objects.result")
        ready.meshfree.point_shape = "DOTS"
        material, values = display.find_material(ready), attribute(ready, "lb_eigenvector_002")
        eigenvalues, points = list(ready["lb_eigenvalues"]), local_points(ready)
        for target in ("POINTCLOUD", "MESH"):
            assert bpy.ops.meshfree.convert(target=target) == {"FINISHED"}
            obj = bpy.context.object
            assert obj.type == target
            assert (local_points(obj) == points).all()
            assert (attribute(obj, "lb_eigenvector_002") == values).all()
            assert list(obj["lb_eigenvalues"]) == eigenvalues
            assert not result.is_stale(obj)
            assert display.shown_attribute(obj) == "lb_eigenvector_002"
            assert display.find_material(obj) == material
            assert material.users == 1
            ((count, *_),) = display_points(obj)
            assert count == 600
            weights = part("operators.objects.groups").group_weights
            assert_allclose(weights(obj, "Handle"), np.arange(600) < 50)
            assert_allclose(weights(obj, "Anchor"), 0.5 * ((np.arange(600) >= 50) & (np.arange(600) < 80)))
            assert (part("operators.tools.select").selection(obj) == (np.arange(600) < 20)).all()

    def test_what_is_refused(self, bound):
        before = everything(bound)
        with pytest.raises(RuntimeError, match="is bound, which would be lost"):
            bpy.ops.meshfree.convert(target="POINTCLOUD")
        with pytest.raises(RuntimeError, match='"Cloud" is a mesh already'):
            bpy.ops.meshfree.convert(target="MESH")
        assert everything(bound) == before

    def test_several_at_once(self, ready):
        other = add_object(sphere_points(300), "Other")
        third = add_object(sphere_points(100), "Bystander")
        choose(ready, other)
        bpy.ops.meshfree.convert(target="POINTCLOUD")
        assert [obj.type for obj in (ready, other, third)] == ["POINTCLOUD", "POINTCLOUD", "MESH"]
        assert bpy.context.object == ready
        assert set(bpy.context.selected_objects) == {ready, other}

    def test_one_undo_step(self, ready):
        before = everything(ready)
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.meshfree.convert("EXEC_DEFAULT", True, target="POINTCLOUD")
        bpy.ops.ed.undo()
        assert everything(bpy.data.objects["Cloud"]) == before
