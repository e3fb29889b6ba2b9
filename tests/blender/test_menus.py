"""The menus, which make the search (F3) find all operators."""

import importlib

import bpy
import pytest

# They have the name of a group, a menu of their own, or hear Esc.
NOT_IN_MENUS = {"select_group", "apply_preset", "add_preset", "escape"}


class Menu:
    """Stands for a menu and its layout, and writes down which operators and menus are drawn."""

    def __init__(self):
        self.layout, self.operators, self.menus = self, set(), []

    def operator(self, name, **_):
        self.operators.add(name)

    def operator_menu_enum(self, name, _):
        self.operators.add(name)

    def menu(self, name):
        self.menus.append(name)

    def separator(self):
        pass


def test_menus_hold_every_operator(extension):
    menus = importlib.import_module(f"{extension.__name__}.ui.menus")
    menu = Menu()
    for _, draw in menus.entries():
        draw(menu, bpy.context)
    for name in menu.menus:
        getattr(bpy.types, name).draw(menu, bpy.context)
    assert menu.operators == {f"meshfree.{name}" for name in set(dir(bpy.ops.meshfree)) - NOT_IN_MENUS}


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
