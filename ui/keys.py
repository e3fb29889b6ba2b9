"""Keys, as the user's preferences list them: what Blender does with a key comes before, where it does something."""

import bpy

_added = []  # keymaps of Blender, and our items in them


def attach():
    """Add the keys, unless there is no window that could hear them."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    # No handler of a tool would do: it would hear Esc before what began earlier, such as the drag of a handle.
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
    """Take the keys away again."""
    while _added:
        keymap, item = _added.pop()
        keymap.keymap_items.remove(item)
