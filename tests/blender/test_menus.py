"""The menus, which make the search (F3) find all operators."""

from types import SimpleNamespace

import bpy

from tests.blender.clouds import add_object, sphere_points
from tests.blender.conftest import part

# They have the name of a group, a menu of their own, or the place of a click.
NOT_IN_MENUS = {"select_group", "apply_preset", "add_preset", "select_point"}


class Menu:
    """Stands for a menu and its layout, and writes down which operators and menus are drawn."""

    def __init__(self):
        self.layout, self.operators, self.menus = self, set(), []

    def operator(self, name, **_):
        self.operators.add(name)
        return SimpleNamespace()

    def operator_menu_enum(self, name, _):
        return self.operator(name)

    def menu(self, name):
        self.menus.append(name)

    def separator(self):
        pass


def test_menus_hold_every_operator():
    add_object(sphere_points())
    menu = Menu()
    for _, draw in part("ui.menus").entries():
        draw(menu, bpy.context)
    for name in menu.menus:
        getattr(bpy.types, name).draw(menu, bpy.context)
    assert menu.operators == {f"meshfree.{name}" for name in set(dir(bpy.ops.meshfree)) - NOT_IN_MENUS}


def right_click(name):
    """Return what the menu that a right click opens has of ours."""
    menu = Menu()
    draw = next(draw for kind, draw in part("ui.menus").entries() if kind.__name__ == name)
    draw(menu, bpy.context)
    return menu


class TestRightClick:
    """The menus of a right click hold what is done most, and the menu of all."""

    def test_on_a_cloud(self):
        add_object(sphere_points())
        menu = right_click("VIEW3D_MT_object_context_menu")
        most = {"analyze", "stray_points", "segment", "deform_bind"}
        assert menu.operators == {f"meshfree.{name}" for name in most}
        assert menu.menus == ["MESHFREE_MT_object"]

    def test_on_the_points_of_a_cloud(self):
        add_object(sphere_points())
        bpy.ops.object.mode_set(mode="EDIT")
        menu = right_click("VIEW3D_MT_edit_mesh_context_menu")
        bpy.ops.object.mode_set(mode="OBJECT")
        most = {"select_grow", "select_component", "select_front", "group_from_selection"}
        assert menu.operators == {f"meshfree.{name}" for name in most}
        assert menu.menus == ["MESHFREE_MT_points"]

    def test_on_a_mesh_with_faces_there_is_the_menu_alone(self):
        add_object(sphere_points(), faces=[(0, 1, 2)])
        for name, all_tools in (
            ("VIEW3D_MT_object_context_menu", "MESHFREE_MT_object"),
            ("VIEW3D_MT_edit_mesh_context_menu", "MESHFREE_MT_points"),
        ):
            menu = right_click(name)
            assert (menu.operators, menu.menus) == (set(), [all_tools])

    def test_on_other_objects_there_is_nothing(self):
        light = bpy.data.objects.new("Light", bpy.data.lights.new("Light", "SUN"))
        bpy.context.scene.collection.objects.link(light)
        bpy.context.view_layer.objects.active = light
        menu = right_click("VIEW3D_MT_object_context_menu")
        assert (menu.operators, menu.menus) == (set(), [])
