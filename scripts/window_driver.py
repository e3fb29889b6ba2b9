"""Run inside Blender by scripts/window.py: carry out Python that comes through a pipe, on Blender's main thread.

Requests and answers are lines of JSON. The code of a request runs in one namespace for the whole session, with `bpy`,
`np` and the functions below; the value of its last line is the answer.
"""

import ast
import json
import os
import sys
import time
import traceback

import bpy
import numpy as np

TICK = 0.002  # seconds; waiting Blender looks every five milliseconds
_requests, _answers = (int(word) for word in os.environ["MESHFREE_PIPES"].split())
_buffer = b""
_options = {}  # of panels, by their names, as they were registered first


def main_window():
    """Return the window; in a timer the context has none."""
    return bpy.context.window_manager.windows[0]


def areas():
    """Places of all areas and their regions on the screen: x and y of the upper left corner, width, height."""
    window = main_window()

    def place(thing):
        return [thing.x, window.height - thing.y - thing.height, thing.width, thing.height]

    return [
        {
            "type": area.type,
            "place": place(area),
            "regions": {region.type: place(region) for region in area.regions if region.width > 1},
        }
        for area in window.screen.areas
    ]


def view3d():
    """Return the 3D view's area, its main region and its sidebar."""
    area = next(area for area in main_window().screen.areas if area.type == "VIEW_3D")
    regions = {region.type: region for region in area.regions}
    return area, regions["WINDOW"], regions["UI"]


def on_screen(point):
    """Place of a point of the world on the screen."""
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    area, region, _ = view3d()
    x, y = location_3d_to_region_2d(region, area.spaces.active.region_3d, point)
    return [region.x + x, main_window().height - 1 - region.y - y]


def button_under_mouse(region_type="UI"):
    """Python of the operator button that the mouse is on, or the path of the property, or an empty text."""
    area = next(area for area in main_window().screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == region_type)
    with bpy.context.temp_override(window=main_window(), area=area, region=region):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            if copy.poll():
                copy()
                return bpy.context.window_manager.clipboard
    return ""


def open_panels(names):
    """Register the extension's panels again, so that these are open in the next file and no others.

    Panels within others are as they always are, or open if they are among these.
    """
    root = next(name for name in bpy.context.preferences.addons.keys() if name.endswith(".meshfree_laplacian"))
    classes = [cls for module in sys.modules[root]._modules() for cls in getattr(module, "CLASSES", ())]
    panels = [cls for cls in classes if issubclass(cls, bpy.types.Panel)]
    names = names | {getattr(cls, "bl_parent_id", "") for cls in panels if cls.__name__ in names}
    nested = {cls.__name__ for cls in panels if getattr(cls, "bl_parent_id", "")}
    for cls in reversed(panels):
        bpy.utils.unregister_class(cls)
    for cls in panels:
        parent = getattr(cls, "bl_parent_id", "")
        if parent:
            options = _options.setdefault(cls.__name__, set(getattr(cls, "bl_options", ())))
            closed = options if parent in nested else {"DEFAULT_CLOSED"}
            cls.bl_options = options - {"DEFAULT_CLOSED"} | (set() if cls.__name__ in names else closed)
        bpy.utils.register_class(cls)


def attribute(obj, name):
    """Values of an attribute of the points, as the object has it now."""
    data = obj.data
    layer = data.attributes[name]
    key, size, dtype = {
        "FLOAT_VECTOR": ("vector", 3, np.float32),
        "FLOAT": ("value", 1, np.float32),
        "BOOLEAN": ("value", 1, np.bool_),
        "INT": ("value", 1, np.int32),
    }[layer.data_type]
    values = np.empty(size * len(layer.data), dtype)
    layer.data.foreach_get(key, values)
    return values.reshape(-1, size) if size > 1 else values


_namespace = {
    function.__name__: function
    for function in (main_window, areas, view3d, on_screen, button_under_mouse, open_panels, attribute)
}
_namespace.update({"bpy": bpy, "np": np, "time": time})


def _carry_out(code):
    """Run code and return the value of its last line, if that is an expression."""
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "<request>", "exec"), _namespace)
    return last and eval(compile(ast.Expression(last.value), "<request>", "eval"), _namespace)


def _plain(value):
    """Convert what JSON does not support to lists and texts."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bpy.types.bpy_struct):
        return repr(value)
    return list(value)


def _answer(code):
    try:
        return json.dumps({"value": _carry_out(code)}, default=_plain)
    except Exception:  # reported to the caller
        return json.dumps({"error": traceback.format_exc()})


def _tick():
    global _buffer
    try:
        received = os.read(_requests, 1 << 20)
    except BlockingIOError:
        return TICK
    if not received:
        os._exit(0)  # nobody is there any more
    *lines, _buffer = (_buffer + received).split(b"\n")
    for line in lines:
        os.write(_answers, _answer(json.loads(line)).encode() + b"\n")
    return TICK


os.set_blocking(_requests, False)
bpy.app.timers.register(_tick, persistent=True)
