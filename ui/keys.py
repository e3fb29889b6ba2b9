"""Keymap items, which the user's preferences list; Blender's own items come first."""

import bpy

_added = []  # keymaps of Blender, and our items in them


def attach():
    """Add the keymap items, unless there is no window."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    # Not in a modal handler: it would catch Esc before operators that started earlier, such as the drag of a handle.
    _add(config.keymaps.new("Window"), "meshfree.stop", "ESC", "PRESS")
    for mode in ("Mesh", "Point Cloud"):  # the Edit Mode of each
        keymap = config.keymaps.new(mode)
        _add(keymap, "meshfree.select_point", "LEFTMOUSE", "CLICK")
        _add(keymap, "meshfree.select_point", "LEFTMOUSE", "CLICK", shift=True).properties.extend = True


def _add(keymap, *how, **modifiers):
    item = keymap.keymap_items.new(*how, **modifiers)
    _added.append((keymap, item))
    return item


def detach():
    """Remove the keymap items."""
    while _added:
        keymap, item = _added.pop()
        keymap.keymap_items.remove(item)
