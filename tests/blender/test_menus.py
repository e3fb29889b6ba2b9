"""The menus, which make the search (F3) find all operators."""

import importlib

import bpy
import pytest

NOT_IN_MENUS = {  # of the panel, where they have the name of a group or a preset
    "meshfree.select_group",
    "meshfree.add_preset",
    "meshfree.apply_preset",
}


class Layout:
    """Writes down which operators a menu draws."""

    def __init__(self):
        self.operators = []

    def operator(self, name, text=""):
        self.operators.append(name)

    def operator_menu_enum(self, name, _):
        self.operators.append(name)

    def separator(self):
        pass


class Menu:
    def __init__(self):
        self.layout = Layout()


def test_menus_hold_every_operator(extension):
    menus = importlib.import_module(f"{extension.__name__}.ui.menus")
    menu = Menu()
    for cls in (menus.MESHFREE_MT_object, menus.MESHFREE_MT_points):
        cls.draw(menu, bpy.context)
    menus._draw_import(menu, bpy.context)
    menus._draw_export(menu, bpy.context)
    operators = {f"meshfree.{name}" for name in dir(bpy.ops.meshfree)}
    assert sorted(menu.layout.operators) == sorted(operators - NOT_IN_MENUS)


@pytest.mark.parametrize("name", ["VIEW3D_MT_object", "VIEW3D_MT_edit_mesh"])
def test_nothing_is_left_behind(extension, name):
    def ours():
        return [draw for draw in getattr(bpy.types, name)._dyn_ui_initialize() if "meshfree" in draw.__module__]

    module = extension.__name__
    assert len(ours()) == 1
    bpy.ops.preferences.addon_disable(module=module)
    assert ours() == []
    bpy.ops.preferences.addon_enable(module=module)
    assert len(ours()) == 1
