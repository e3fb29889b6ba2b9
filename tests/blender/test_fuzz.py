"""Every operator with random settings on odd objects: done, or refused with a sentence and nothing changed.

MESHFREE_CASES in the environment says how many calls are tried, from the seed MESHFREE_FIRST on; a failure names its.
"""

import os
import tempfile

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, everything, sphere_points

CASES = int(os.environ.get("MESHFREE_CASES", "150"))
FIRST = int(os.environ.get("MESHFREE_FIRST", "0"))  # seed
LEFT_OUT = {"escape", "add_preset", "apply_preset"}  # that lives in windows; these are about the user's own presets


def sphere():
    """Few points of a sphere, with groups that tools take."""
    points = sphere_points(200)
    obj = add_object(points)
    for name, members in {"Handle": points[:, 2] > 0.8, "Anchor": points[:, 2] < -0.8}.items():
        add_group(obj, name, members)
        add_group(obj, {"Handle": "Source", "Anchor": "Value"}[name], members)
    obj.select_set(True)
    return obj


def odd_points(make):
    def made():
        obj = add_object(make(sphere_points(200)))
        obj.select_set(True)
        return obj

    return made


def changed(change):
    def made():
        obj = sphere()
        change(obj)
        return obj

    return made


def with_keys(obj):
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Other").value = 0.5


def in_another_scene(obj):
    bpy.context.scene.collection.objects.unlink(obj)
    bpy.data.scenes.new("Another").collection.objects.link(obj)


def parented(obj):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    obj.parent, parent.scale, parent.rotation_euler = parent, (1.0, 2.0, 0.5), (0.3, 0.2, 0.1)


def shared(obj):
    bpy.context.scene.collection.objects.link(obj.copy())


def of_type(make):
    def made():
        obj = bpy.data.objects.new("Other", make())
        bpy.context.scene.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj

    return made


def from_library(override):
    """A sphere of another file: linked, or overridden with its data."""

    def made():
        sphere().name = "Kept"
        folder = tempfile.mkdtemp()
        path = os.path.join(folder, "library.blend")
        bpy.data.libraries.write(path, {bpy.data.objects["Kept"]})
        bpy.data.batch_remove([bpy.data.objects["Kept"], *bpy.data.meshes])
        with bpy.data.libraries.load(path, link=True) as (_, wanted):
            wanted.objects = ["Kept"]
        (obj,) = wanted.objects
        bpy.context.scene.collection.objects.link(obj)
        if override:
            obj = obj.override_create(remap_local_usages=True)
            obj.data.override_create(remap_local_usages=True)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj

    return made


def rigged(obj):
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    obj.modifiers.new("Armature", "ARMATURE").object = rig
    obj.parent = rig


def animated(obj):
    for frame in (1, 5):
        obj.location.x = 0.1 * frame
        obj.keyframe_insert("location", frame=frame)
    with_keys(obj)
    obj.data.shape_keys.key_blocks["Other"].keyframe_insert("value", frame=3)


def bound(obj):
    bpy.ops.meshfree.deform_bind()
    obj.meshfree.deform.handle_items[0].empty.location.z += 0.3
    bpy.context.view_layer.update()


def colored(obj):
    bpy.ops.meshfree.analyze(modes=3)
    bpy.ops.meshfree.colormap()


def edited(obj):
    bpy.ops.object.mode_set(mode="EDIT")


def analyzed(obj):
    bpy.ops.meshfree.analyze(modes=3)


def as_cloud(obj):
    if bpy.app.version >= (4, 5):
        bpy.ops.meshfree.convert()


OBJECTS = {
    "sphere": sphere,
    "analyzed": changed(analyzed),
    "point cloud": changed(as_cloud),
    "with keys": changed(with_keys),
    "subdivided": changed(lambda obj: obj.modifiers.new("Subdivision", "SUBSURF")),
    "repeated": changed(lambda obj: obj.modifiers.new("Array", "ARRAY")),
    "flat": changed(lambda obj: setattr(obj, "scale", (1.0, 1.0, 0.0))),
    "mirrored": changed(lambda obj: setattr(obj, "scale", (-1.0, 2.0, 1.0))),
    "parented": changed(parented),
    "hidden": changed(lambda obj: obj.hide_set(True)),
    "in another scene": changed(in_another_scene),
    "shared": changed(shared),
    "linked": from_library(False),
    "overridden": from_library(True),
    "rigged": changed(rigged),
    "animated": changed(animated),
    "bound": changed(bound),
    "colored": changed(colored),
    "in Edit Mode": changed(edited),
    "no points": odd_points(lambda points: points[:0]),
    "one point": odd_points(lambda points: points[:1]),
    "few points": odd_points(lambda points: points[:7]),
    "a line": odd_points(lambda points: points * (1.0, 0.0, 0.0)),
    "one place": odd_points(lambda points: 0.0 * points),
    "not a number": odd_points(lambda points: np.where(points > 0.95, np.nan, points)),
    "huge": odd_points(lambda points: 1e30 * points),
    "light": of_type(lambda: bpy.data.lights.new("Light", "POINT")),
    "empty": of_type(lambda: None),
    "nothing": lambda: None,
}


def operators():
    return sorted(set(dir(bpy.ops.meshfree)) - LEFT_OUT)


def random_settings(name, rng, folder):
    """Values of some settings of an operator, from within its bounds, at them, and near zero; files go to a folder."""
    settings = {}
    for item in getattr(bpy.ops.meshfree, name).get_rna_type().properties:
        if item.identifier == "rna_type" or item.is_readonly or rng.random() < 0.5:
            continue
        if item.type == "BOOLEAN" and not item.is_array:
            settings[item.identifier] = bool(rng.random() < 0.5)
        elif item.type == "INT" and not item.is_array:
            ends = [item.hard_min, item.hard_max, item.soft_min, item.soft_max, item.default, 0, 1, 3, 7]
            settings[item.identifier] = int(np.clip(rng.choice(ends), item.hard_min, item.hard_max))
        elif item.type == "FLOAT" and not item.is_array:
            ends = [item.hard_min, item.hard_max, item.soft_min, item.soft_max, item.default, 0.0, 1e-9, 0.5, 3.0]
            settings[item.identifier] = float(np.clip(rng.choice(ends), item.hard_min, item.hard_max))
        elif item.type == "ENUM" and item.enum_items:
            keys = [str(key) for key in item.enum_items.keys()]
            settings[item.identifier] = {str(rng.choice(keys))} if item.is_enum_flag else str(rng.choice(keys))
        elif item.subtype in ("FILE_PATH", "DIR_PATH", "FILE_NAME"):
            settings[item.identifier] = str(rng.choice(["", str(folder / "Written"), str(folder / "missing" / "file")]))
        elif item.type == "STRING":
            settings[item.identifier] = str(rng.choice(["", "Handle", "Anchor", "Missing", "lb_area", "\u00e4" * 20]))
    return settings


def scene():
    return {obj.name: everything(obj) for obj in bpy.data.objects if obj.mode != "EDIT"}


def check_results(obj):
    """Assert that all results are there for every point, and numbers where points have a place."""
    if obj.type != "MESH" or obj.mode == "EDIT":
        return
    for layer in obj.data.attributes:
        if layer.name.startswith("lb_") and layer.data_type == "FLOAT":
            values = np.empty(len(layer.data), np.float32)
            layer.data.foreach_get("value", values)
            assert len(values) == len(obj.data.vertices)
            assert np.isfinite(values).all() or layer.name == "lb_distance", layer.name


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", range(FIRST, FIRST + CASES))
def test_any_call_is_done_or_refused(seed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(seed)
    kind, name = str(rng.choice(list(OBJECTS))), str(rng.choice(operators()))
    OBJECTS[kind]()
    settings = random_settings(name, rng, tmp_path)
    bpy.context.view_layer.update()
    before = scene()
    told = f"{name}({settings}) on {kind}"
    reason = ""
    try:
        result = getattr(bpy.ops.meshfree, name)(**settings)
    except RuntimeError as error:
        reason, result = str(error), {"CANCELLED"}
    assert "Traceback" not in reason, told
    assert result in ({"FINISHED"}, {"CANCELLED"}), told
    if result == {"CANCELLED"}:
        assert scene() == before, told
    for obj in bpy.data.objects:
        check_results(obj)
