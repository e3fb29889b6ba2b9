"""Colors that points have of their own: shown at import, everywhere, and again after results; and the own material."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from tests.blender.clouds import CORNERS, FACES, add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats
from tests.blender.test_panel import draw

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
POINT_CLOUDS = pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")


@pytest.fixture
def shown():
    return part("ui.display").shown_attribute


def evenly(count):
    """Points of a unit sphere, evenly spread, (n, 3)."""
    turns = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * turns / count, np.pi * (1.0 + 5.0**0.5) * turns
    flat = np.sqrt(1.0 - height**2)
    return np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])


def save(path, points, color=RED):
    """Write points of one color to a text file."""
    rows = np.hstack([points, np.broadcast_to(255.0 * np.array(color), points.shape)])
    np.savetxt(path, rows, fmt=["%.6f"] * 3 + ["%d"] * 3, header="x y z red green blue")
    return str(path)


@pytest.fixture
def imported(tmp_path):
    """Return a function that imports red points of a sphere, by options of the importer."""

    def run(count=800, **options):
        bpy.ops.meshfree.import_points(filepath=save(tmp_path / "red.xyz", evenly(count)), **options)
        return bpy.context.object

    return run


def painted(points, color, name="Col", kind="FLOAT_COLOR"):
    """Add an object with a color attribute, as somebody else may have made it."""
    obj = add_object(points)
    layer = obj.data.color_attributes.new(name, kind, "POINT")
    layer.data.foreach_set("color", np.tile([*color, 1.0], len(points)).astype(np.float32))
    return obj


def add_material(obj, color):
    """Give an object a material of the user's own in its first slot, which shines in a color."""
    material = bpy.data.materials.new("Mine")
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    light, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    light.inputs["Color"].default_value = (*color, 1.0)
    material.node_tree.links.new(light.outputs[0], output.inputs["Surface"])
    obj.data.materials.append(material)
    bpy.context.view_layer.update()
    return material


def seen(folder):
    """Render what is in the middle of the scene, in white light, and return the mean color in the picture's middle."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.view_settings.view_transform = "Standard"
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        scene.camera.location, scene.camera.rotation_euler = (0.0, -4.0, 0.0), (np.pi / 2, 0.0, 0.0)
        scene.world = bpy.data.worlds.new("World")
        if scene.world.node_tree is None:
            scene.world.use_nodes = True
        next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND").inputs[0].default_value = (
            1,
        ) * 4
    scene.render.filepath = str(folder / "seen.png")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(picture.pixels).reshape(32, 32, 4)
    bpy.data.images.remove(picture)
    return pixels[14:18, 14:18, :3].mean(axis=(0, 1))


def looks(color, folder):
    """Whether a render shows a color."""
    found = seen(folder)
    return np.abs(found - color).max() < 0.2 or (found[np.argmax(color)] > 0.5 and np.sort(found)[1] < 0.2)


class TestImport:
    """A scan with colors has them at first sight."""

    def test_discs(self, imported, tmp_path, shown):
        obj = imported()
        assert "lb_disc" in obj.data.attributes
        assert shown(obj) == "Color"
        assert looks(RED, tmp_path)

    def test_dots_above_the_limit(self, imported, tmp_path, monkeypatch):
        monkeypatch.setattr(part("operators.files.importing"), "_QUICK", 799)
        obj = imported()
        assert "lb_disc" not in obj.data.attributes
        assert obj.meshfree.spacing == pytest.approx(np.sqrt(4.0 * np.pi / 800), rel=0.1)
        assert looks(RED, tmp_path)

    def test_dots_where_no_surface_is_asked_for(self, imported, tmp_path):
        assert "lb_disc" not in imported(surface=False).data.attributes
        assert looks(RED, tmp_path)

    @POINT_CLOUDS
    @pytest.mark.parametrize("surface", [True, False])
    def test_point_cloud_objects(self, imported, tmp_path, surface):
        assert imported(kind="POINTCLOUD", surface=surface).type == "POINTCLOUD"
        assert looks(RED, tmp_path)

    def test_points_without_colors_have_no_material(self, tmp_path):
        np.savetxt(tmp_path / "plain.xyz", evenly(800))
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / "plain.xyz"))
        assert part("ui.display").find_material(bpy.context.object) is None
        assert not bpy.data.materials

    def test_colors_that_are_left_out(self, imported, shown):
        obj = imported(attributes=False)
        assert shown(obj) == ""

    def test_frames_of_a_sequence_share_a_material(self, tmp_path, shown):
        for number, color in enumerate((RED, GREEN, BLUE), 1):
            save(tmp_path / f"wave_{number}.xyz", evenly(800), color)
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / "wave_1.xyz"), sequence=True)
        for number, color in enumerate((RED, GREEN, BLUE), 1):
            bpy.context.scene.frame_set(number)
            assert looks(color, tmp_path)
        frames = [obj for obj in bpy.data.objects if obj.name.startswith("wave_")]
        assert [shown(obj) for obj in frames] == ["Color"] * 3
        assert len(bpy.data.materials) == 1

    def test_scenes_that_the_command_line_writes(self, tmp_path, shown):
        save(tmp_path / "red.xyz", evenly(800))
        words = "convert", tmp_path / "red.xyz", "--out", tmp_path / "red.blend"
        assert part("operators.files.command").run([*map(str, words)]) == 0
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "red.blend"))
        assert shown(bpy.data.objects["red"]) == "Color"

    def test_one_undo_takes_all_of_it_back(self, imported):
        bpy.ops.ed.undo_push()
        imported()
        bpy.ops.ed.undo_push()
        bpy.ops.ed.undo()
        assert not bpy.data.objects


class TestColor:
    """The first choice under Display."""

    def test_it_comes_first_and_brings_the_colors_back(self, imported, tmp_path, shown):
        obj = imported()
        bpy.ops.meshfree.analyze()
        assert shown(obj) == "lb_mean_curvature"
        texts = draw()
        assert texts.index("Color") < texts.index("Area")
        bpy.ops.meshfree.colormap(attribute="Color")
        assert shown(obj) == "Color"
        assert looks(RED, tmp_path)

    @pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
    def test_any_name_and_type(self, tmp_path, kind, shown):
        obj = painted(evenly(800), GREEN, "Paint", kind)
        assert "Color" in draw()
        bpy.ops.meshfree.show_surface()
        assert shown(obj) == "Paint"
        assert looks(GREEN, tmp_path)

    def test_of_several_the_active_one(self):
        obj = painted(evenly(100), GREEN)
        obj.data.color_attributes.new("Second", "BYTE_COLOR", "POINT")
        for name in ("Col", "Second"):
            obj.data.color_attributes.active_color_name = name
            assert part("operators.objects.colors").own_colors(obj.data) == name

    def test_colors_of_corners_are_none_of_points(self):
        obj = add_object(evenly(100), faces=[(0, 1, 2)])
        obj.data.color_attributes.new("Col", "BYTE_COLOR", "CORNER")
        assert part("operators.objects.colors").own_colors(obj.data) == ""
        assert "Color" not in draw()

    def test_the_list_in_edit_mode(self, imported):
        imported()
        bpy.ops.object.mode_set(mode="EDIT")
        assert "Color" in draw()
        bpy.context.object.meshfree.point_size *= 1.1
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_points_that_are_deleted_leave_the_others_as_they_were(self, imported, tmp_path):
        obj = imported()
        obj.data.vertices.foreach_set("select", attribute(obj, "position")[:, 1] > 0.0)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.delete(type="VERT")
        bpy.ops.object.mode_set(mode="OBJECT")
        assert 300 < len(obj.data.vertices) < 500
        assert looks(RED, tmp_path)

    def test_groups_are_colored_over_them(self, imported, tmp_path):
        obj = imported()
        obj.vertex_groups.new(name="Anchor").add(range(800), 1.0, "REPLACE")
        obj.meshfree.show_groups = True
        assert not looks(RED, tmp_path)
        obj.meshfree.show_groups = False
        assert looks(RED, tmp_path)

    def test_no_legend(self, imported):
        obj, scene = imported(), bpy.context.scene
        assert part("ui.overlay").pictures(obj, scene) == []
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        with pytest.raises(RuntimeError, match="its own colors, which are not values"):
            bpy.ops.meshfree.legend()
        bpy.ops.meshfree.analyze()
        bpy.ops.meshfree.legend()
        legend = part("ui.legend").find_legend(scene, obj)
        bpy.ops.meshfree.colormap(attribute="Color")
        assert legend.hide_render
        bpy.ops.meshfree.colormap(attribute="lb_area")
        assert not legend.hide_render

    def test_values_of_colors_are_no_range(self, imported):
        imported()
        with pytest.raises(RuntimeError, match="shows no numbers as colors"):
            bpy.ops.meshfree.select_by_range()

    @POINT_CLOUDS
    def test_conversion_keeps_them(self, imported, tmp_path, shown):
        obj = imported()
        for target in ("POINTCLOUD", "MESH"):
            bpy.ops.meshfree.convert(target=target)
            assert shown(obj) == "Color"
            assert looks(RED, tmp_path)


class TestSolid:
    """Discs know the active color attribute, which Solid shows with the color type Attribute."""

    def evaluated(self, obj):
        return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data

    def test_of_the_discs_of_a_mesh(self, imported):
        obj = imported()
        obj.data.color_attributes.new("Another", "FLOAT_COLOR", "POINT")
        for name in ("Color", "Another"):
            obj.data.color_attributes.active_color_name = name
            obj.data.update()
            mesh = self.evaluated(obj)
            assert mesh.color_attributes.active_color_name == name
            assert (len(mesh.vertices), len(mesh.polygons)) == (CORNERS * 800, FACES * 800)

    @POINT_CLOUDS
    def test_point_clouds_have_whole_discs_all_the_same(self, imported):
        obj = imported(kind="POINTCLOUD")
        graph = bpy.context.evaluated_depsgraph_get()
        counts = [
            (len(item.object.data.vertices), len(item.object.data.polygons))
            for item in graph.object_instances
            if item.object.type == "MESH" and item.parent == obj.evaluated_get(graph)
        ]
        assert counts == [(CORNERS * 800, FACES * 800)]


class TestMesh:
    """Surface from Points shows what the points do."""

    def run(self, obj):
        bpy.ops.meshfree.mesh_surface()
        obj.hide_render = True
        return bpy.context.object

    def test_the_colors(self, imported, tmp_path, shown):
        made = self.run(imported())
        assert len(made.data.polygons) > 100
        assert (shown(made), made.data.color_attributes.active_color_name) == ("Color", "Color")
        assert looks(RED, tmp_path)

    def test_of_points_that_show_nothing(self, tmp_path, shown):
        made = self.run(painted(evenly(800), GREEN))
        assert (shown(made), made.data.color_attributes.active_color_name) == ("Col", "Col")
        assert looks(GREEN, tmp_path)

    def test_a_result_on_show_stays_on_show_and_the_colors_are_there(self, imported, tmp_path, shown):
        obj = imported()
        bpy.ops.meshfree.analyze()
        made = self.run(obj)
        assert shown(made) == "lb_mean_curvature"
        bpy.ops.meshfree.colormap(attribute="Color")
        assert looks(RED, tmp_path)

    def test_of_splats(self, core, shown):
        splats = bar_splats(core, degree=0)
        green = np.tile((np.array(GREEN) - 0.5) * 2.0 * np.sqrt(np.pi), (len(splats), 1))
        add_splats(replace(splats, colors=green))
        made = self.run(bpy.context.object)
        assert shown(made) == "Color"
        assert [layer.name for layer in made.data.color_attributes] == ["Color"]
        colors = np.array([value.color[:3] for value in made.data.color_attributes["Color"].data])
        assert colors == pytest.approx(np.tile(GREEN, (len(colors), 1)), abs=1e-3)

    def test_the_own_material(self, imported, tmp_path, shown):
        obj = imported()
        material = add_material(obj, BLUE)
        bpy.ops.meshfree.own_material()
        made = self.run(obj)
        assert made.material_slots[0].material == material
        assert looks(BLUE, tmp_path)


class TestOwnMaterial:
    """A material in the first slot is the user's choice."""

    def test_show_as_surface_keeps_it(self, tmp_path):
        add_material(painted(evenly(800), GREEN), BLUE)
        bpy.ops.meshfree.show_surface()
        assert looks(BLUE, tmp_path)

    def test_a_result_is_shown_in_its_colors_which_is_told_and_it_comes_back(self, tmp_path, shown, capfd):
        obj = add_object(evenly(800))
        material = add_material(obj, BLUE)
        bpy.ops.meshfree.analyze()
        assert shown(obj) == "lb_mean_curvature"
        told = 'Cloud: the display replaces the material "Mine"'
        assert told in capfd.readouterr().out
        bpy.ops.meshfree.analyze()
        assert told not in capfd.readouterr().out
        assert not looks(BLUE, tmp_path)
        assert "Own Material" in draw()
        bpy.ops.meshfree.own_material()
        assert shown(obj) == ""
        assert looks(BLUE, tmp_path)
        assert obj.material_slots[0].material == material
        assert list(bpy.data.materials) == [material]
        bpy.ops.meshfree.colormap(attribute="lb_area")
        assert shown(obj) == "lb_area"

    def test_colors_stay_until_it_is_asked_for(self, imported, tmp_path):
        obj = imported()
        add_material(obj, BLUE)
        assert looks(RED, tmp_path)
        bpy.ops.meshfree.own_material()
        assert looks(BLUE, tmp_path)
        bpy.ops.meshfree.colormap(attribute="Color")
        assert looks(RED, tmp_path)

    def test_of_an_object_that_shows_nothing_else_it_needs_no_asking(self, tmp_path):
        obj = add_object(evenly(800))
        bpy.ops.meshfree.show_surface()
        add_material(obj, BLUE)
        assert looks(BLUE, tmp_path)

    def test_another_one_in_the_slot_is_followed(self, tmp_path):
        obj = add_object(evenly(800))
        add_material(obj, BLUE)
        bpy.ops.meshfree.show_surface()
        obj.data.materials.clear()
        add_material(obj, GREEN)
        assert looks(GREEN, tmp_path)
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = add_material(add_object(sphere_points(9)), RED)
        bpy.data.objects.remove(bpy.context.object)
        bpy.context.view_layer.objects.active = obj
        bpy.context.view_layer.update()
        assert looks(RED, tmp_path)

    def test_one_chosen_on_the_modifier_is_left_alone(self, modifiers, tmp_path):
        obj = add_object(evenly(800))
        add_material(obj, BLUE)
        bpy.ops.meshfree.show_surface()
        chosen = add_material(add_object(sphere_points(9), "Other"), GREEN)
        bpy.data.objects.remove(bpy.data.objects["Other"])
        modifiers.set_input(part("ui.display").find_display(obj), "Material", chosen)
        obj.location.z = 0.01
        bpy.context.view_layer.update()
        assert modifiers.get_input(part("ui.display").find_display(obj), "Material") == chosen

    def test_dots_and_faces_have_it_too(self, tmp_path):
        obj = add_object(evenly(800), faces=[(0, 1, 2)])
        add_material(obj, BLUE)
        obj.meshfree.point_shape = "DOTS"
        bpy.ops.meshfree.analyze()
        bpy.ops.meshfree.own_material()
        assert looks(BLUE, tmp_path)

    @POINT_CLOUDS
    def test_conversion_keeps_it(self, tmp_path):
        obj = add_object(evenly(800))
        obj.select_set(True)
        add_material(obj, BLUE)
        bpy.ops.meshfree.show_surface()
        bpy.ops.meshfree.convert()
        assert looks(BLUE, tmp_path)

    def test_without_one_there_is_no_entry_and_the_button_says_why(self, imported):
        imported()
        assert "Own Material" not in draw()
        with pytest.raises(RuntimeError, match="has no material in its first slot"):
            bpy.ops.meshfree.own_material()
