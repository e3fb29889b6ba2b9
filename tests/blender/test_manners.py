"""Switched off, the extension leaves nothing behind; files that it made are good without it, and keep its settings."""

import gc
import json
import subprocess
import sys
import threading
import weakref

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, attribute, sphere_points
from tests.blender.conftest import part

OWNERS = ("Object", "Scene", "Mesh", "PointCloud", "WindowManager", "WorkSpace", "Screen", "Material", "Collection")
IN_MENUS = (
    "TOPBAR_MT_file_import",
    "VIEW3D_MT_object",
    "VIEW3D_MT_edit_mesh",
    "VIEW3D_MT_object_context_menu",
    "VIEW3D_MT_edit_mesh_context_menu",
)


def registered():
    """Everything that an extension may add to Blender and that Blender lists, by name."""
    handlers = [
        f"{name}: {function.__module__}.{function.__name__}"
        for name in dir(bpy.app.handlers)
        if isinstance(functions := getattr(bpy.app.handlers, name), list)
        for function in functions
    ]
    entries = {}
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        drawn = getattr(getattr(kind, "draw", None), "_draw_funcs", [])
        if len(drawn) > 1:
            entries[name] = [f"{function.__module__}.{function.__name__}" for function in drawn]
    keymaps = bpy.context.window_manager.keyconfigs
    return {
        "types": [name for name in dir(bpy.types) if "meshfree" in name.lower()],
        "operators": dir(bpy.ops.meshfree),
        "handlers": sorted(handlers),
        "entries of menus": entries,
        "keys": [
            f"{keymap.name}: {item.idname}"
            for configuration in keymaps
            for keymap in configuration.keymaps
            for item in keymap.keymap_items
            if "meshfree" in item.idname
        ],
        **{f"properties of {name}": sorted(getattr(bpy.types, name).bl_rna.properties.keys()) for name in OWNERS},
    }


@pytest.fixture
def callbacks(monkeypatch):
    """What is hung into drawing and into timers while the test runs, and not taken out again."""
    kept = {"draw": {}, "timers": []}
    for space in ("SpaceView3D", "SpaceNodeEditor", "SpaceImageEditor", "SpaceProperties"):
        kind = getattr(bpy.types, space)
        add, remove = kind.draw_handler_add, kind.draw_handler_remove

        def adding(function, *arguments, add=add):
            handle = add(function, *arguments)
            kept["draw"][handle] = function.__name__
            return handle

        def removing(handle, *arguments, remove=remove):
            del kept["draw"][handle]
            remove(handle, *arguments)

        monkeypatch.setattr(kind, "draw_handler_add", adding)
        monkeypatch.setattr(kind, "draw_handler_remove", removing)
    register = bpy.app.timers.register

    def registering(function, *arguments, **options):
        kept["timers"].append(function)
        register(function, *arguments, **options)

    monkeypatch.setattr(bpy.app.timers, "register", registering)
    return kept


def test_enable_disable_enable(extension, callbacks):
    name = extension.__name__
    before = registered()
    assert "MESHFREE_OT_analyze" in before["types"]
    assert len([item for item in before["handlers"] if name in item]) >= 7
    for menu in IN_MENUS:
        assert len([item for item in before["entries of menus"][menu] if name in item]) == 1, menu
    threads = threading.active_count()
    try:
        bpy.ops.preferences.addon_disable(module=name)
        off = registered()
        assert off["types"] == off["operators"] == off["keys"] == []
        assert name not in repr(off)
        assert not [item for owner in OWNERS for item in off[f"properties of {owner}"] if "meshfree" in item]
        bpy.ops.preferences.addon_enable(module=name)
        assert registered() == before
        obj = add_object(sphere_points())
        bpy.ops.meshfree.analyze(modes=2)
        bpy.ops.meshfree.smooth()
        options = part("operators.objects.options").laplacian_options(obj.meshfree)
        points = part("operators.objects.reading").read_points(bpy.context, obj).points
        kept = weakref.ref(part("operators.running.cache").build(points, options, None, lambda *_: None).laplacian)
        assert kept() is not None
        bpy.ops.meshfree.deform_bind(at_once=True)
        bpy.ops.preferences.addon_disable(module=name)
        gc.collect()
        assert kept() is None
        assert registered() == off
        assert callbacks["draw"] == {}
        assert [function for function in callbacks["timers"] if bpy.app.timers.is_registered(function)] == []
        assert threading.active_count() <= threads
    finally:
        bpy.ops.preferences.addon_enable(module=name)
    assert registered() == before


def test_the_callbacks_are_really_watched(callbacks):
    def draw():
        pass

    handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")
    bpy.app.timers.register(draw, first_interval=100.0)
    assert list(callbacks["draw"].values()) == ["draw"]
    assert bpy.app.timers.is_registered(callbacks["timers"][0])
    bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    bpy.app.timers.unregister(draw)
    assert callbacks["draw"] == {}


WITHOUT = """
import json, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
obj = bpy.context.view_layer.objects.active
evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
geometry = evaluated.evaluated_geometry() if hasattr(evaluated, "evaluated_geometry") else None
print("RESULT", json.dumps({
    "known": hasattr(bpy.types.Object, "meshfree"),
    "attributes": [layer.name for layer in obj.data.attributes if layer.name.startswith("lb_")],
    "eigenvalues": list(obj["lb_eigenvalues"]),
    "modifiers": [(item.name, item.node_group.name) for item in obj.modifiers],
    "materials": [item.name for item in bpy.data.materials],
    "points": len(geometry.pointcloud.points) if geometry and geometry.pointcloud else None,
}))
if len(sys.argv) > 2:
    obj.location.x = 5.0
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])
"""


def run_without(tmp_path, *arguments):
    """Open a file in a Blender of its own, which has no extensions; return what it tells."""
    (tmp_path / "without.py").write_text(WITHOUT)
    (tmp_path / "user").mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "without.py"), *map(str, arguments)],
        env={"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    problems = [line for line in (done.stdout + done.stderr).splitlines() if "rror" in line or "meshfree" in line]
    ends = ("RESULT", "Error: Not freed memory")  # the second is what Blender's module says at every exit
    return json.loads(line.removeprefix("RESULT ")), [line for line in problems if not line.startswith(ends)]


def make_file(path):
    obj = add_object(sphere_points())
    obj.meshfree.neighbors = 60
    obj.meshfree.color_map = "VIRIDIS"
    obj.meshfree.boundary = "OFF"
    bpy.ops.meshfree.spectrum(count=3)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return obj


def settings(obj):
    """All settings and results of an object, by name."""
    values = {}
    for item in obj.meshfree.bl_rna.properties:
        if item.identifier not in {"rna_type", "name"} and item.type not in {"COLLECTION", "POINTER"}:
            value = getattr(obj.meshfree, item.identifier)
            values[item.identifier] = list(value) if getattr(item, "is_array", False) else value
    return values


def test_a_file_opens_without_the_extension(tmp_path):
    obj = make_file(tmp_path / "a.blend")
    names = [layer.name for layer in obj.data.attributes if layer.name.startswith("lb_")]
    eigenvalues = list(obj["lb_eigenvalues"])
    told, problems = run_without(tmp_path, tmp_path / "a.blend")
    assert not told["known"]
    assert told["attributes"] == names
    assert told["eigenvalues"] == eigenvalues
    assert len(told["modifiers"]) == 1
    assert told["materials"]
    assert told["points"] in (None, 1000)  # None where this Blender cannot tell
    assert problems == []


@pytest.mark.parametrize("between", [False, True], ids=["at once", "saved without it in between"])
def test_a_file_opens_with_its_settings(tmp_path, between):
    obj = make_file(tmp_path / "a.blend")
    before, values = settings(obj), attribute(obj, "lb_eigenvector_002")
    stages = [(stage.name, stage.seconds) for stage in obj.meshfree.stages]
    path = tmp_path / "a.blend"
    if between:
        path = tmp_path / "b.blend"
        run_without(tmp_path, tmp_path / "a.blend", path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj = bpy.context.view_layer.objects.active
    assert settings(obj) == before
    assert obj.meshfree.neighbors == 60
    assert [(stage.name, stage.seconds) for stage in obj.meshfree.stages] == stages
    assert np.array_equal(attribute(obj, "lb_eigenvector_002"), values)
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}
