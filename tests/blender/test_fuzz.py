"""Every operator with random settings on odd objects: done, or refused with a sentence and nothing changed.

MESHFREE_CASES in the environment says how many calls are tried, from the seed MESHFREE_FIRST on; a failure names its.
Seeds go through all pairs of an operator and an object in turn, with other settings each time: as many seeds as there
are pairs try all.
"""

import itertools
import os
import tempfile

import bpy
import numpy as np
import pytest

from tests.blender.armatures import add_armature, choose
from tests.blender.clouds import add_group, add_object, everything, grid_points, sphere_points
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats
from tests.blender.test_follow import add_arm, pose
from tests.blender.test_follow import bound as bound_to

CASES = int(os.environ.get("MESHFREE_CASES", "150"))
FIRST = int(os.environ.get("MESHFREE_FIRST", "0"))  # seed
LEFT_OUT = {"add_preset", "apply_preset"}  # these are about the user's own presets


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


def beside_others():
    """Two spheres with groups, and an attribute, the last one active."""
    first = sphere()
    first.data.attributes.new("Own", "FLOAT", "POINT")
    second = sphere()
    second.location = 0.05, 0.0, 0.0
    first.select_set(True)
    return second


def film():
    points, boundary = grid_points(14, 12)
    obj = add_object(points)
    add_group(obj, "Fixed", boundary)
    add_group(obj, "Boundary", boundary)
    obj.select_set(True)
    return obj


def faced():
    """A grid with faces, as most meshes have."""
    points = grid_points(14, 12)[0]
    corners = (row * 14 + column for row in range(11) for column in range(13))
    obj = add_object(points, faces=[(first, first + 1, first + 15, first + 14) for first in corners])
    obj.select_set(True)
    return obj


def with_keys(obj):
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Other").value = 0.5


def with_absolute_keys(obj):
    with_keys(obj)
    obj.data.shape_keys.use_relative = False


def with_names_of_results(obj):
    obj.data.attributes.new("lb_area", "FLOAT_COLOR", "POINT")
    add_group(obj, "lb_segment", [0, 1])
    obj["lb_eigenvalues"] = "taken"


def with_locked_groups(obj):
    for group in obj.vertex_groups:
        group.lock_weight = True


def with_material(obj):
    obj.data.materials.append(bpy.data.materials.new("Own"))
    obj.modifiers.new("Nodes", "NODES")  # of no group


def in_excluded_collection(obj):
    collection = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True


def only_selected(obj):
    bpy.context.view_layer.objects.active = None


def driven(obj):
    driver = obj.driver_add("location", 0).driver
    driver.type, driver.expression = "SCRIPTED", "frame / 10"


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


def from_library(*overridden):
    """A sphere of another file: linked, or with overrides of the object, its data, or both."""

    def made():
        sphere().name = "Kept"
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "library.blend")
            bpy.data.libraries.write(path, {bpy.data.objects["Kept"]})
            bpy.data.batch_remove([bpy.data.objects["Kept"], *bpy.data.meshes])
            with bpy.data.libraries.load(path, link=True) as (_, wanted):
                wanted.objects = ["Kept"]
        (obj,) = wanted.objects
        bpy.context.scene.collection.objects.link(obj)
        if "object" in overridden:
            obj = obj.override_create(remap_local_usages=True)
        if "local object" in overridden:
            obj = obj.make_local(clear_asset_data=True)
        if "data" in overridden:
            obj.data.override_create(remap_local_usages=True)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj

    return made


def instance():
    sphere()
    collection = bpy.data.collections.new("Shown")
    obj = of_type(lambda: None)()
    obj.instance_type, obj.instance_collection = "COLLECTION", collection
    return obj


def rigged(obj):
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    obj.modifiers.new("Armature", "ARMATURE").object = rig
    obj.parent = rig


def with_armature(make, active=True):
    """An object, and an armature within it, which is the active one or only selected."""

    def made():
        obj = make()
        armature = add_armature({"lower": ((0, 0, -0.8), (0, 0, 0)), "upper": ((0, 0, 0), (0, 0, 0.8))})
        choose(armature, obj)
        if not active:
            bpy.context.view_layer.objects.active = obj
        return bpy.context.view_layer.objects.active

    return made


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


def edited_with_another(obj):
    other = add_object(sphere_points(100), "Other")
    other.select_set(True)
    edited(obj)


def bound_and_edited(obj):
    bound(obj)
    edited(obj)


def baked(obj):
    bound(obj)
    bpy.ops.meshfree.deform_bake(first=1, last=2)


def segmented(obj):
    bpy.ops.meshfree.segment(parts=3)


def analyzed(obj):
    bpy.ops.meshfree.analyze(modes=3)


def as_cloud(obj):
    if bpy.app.version >= (4, 5):
        bpy.ops.meshfree.convert()


def of_splats(*names):
    """Selected objects of splats, the last one active."""

    def made():
        objects = [add_splats(bar_splats(part("core"), degree=1), name) for name in names]
        for obj in objects:
            obj.select_set(True)
        objects[0].rotation_euler.x = 0.4
        return objects[-1]

    return made


def following():
    """Splats that follow an armature in a pose."""
    armature = add_arm(5.0, 5.0)
    obj = add_splats(bar_splats(part("core"), degree=1))
    bound_to(obj, armature, np.tile([0.25, 0.75], (len(obj.data.attributes["position"].data), 1)))
    pose(armature, "Bone.1")
    return obj


def weights_without_bones():
    """Splats that followed an armature, which is deleted."""
    obj = following()
    bpy.data.objects.remove(bpy.data.objects["Arm"])
    return obj


OBJECTS = {
    "sphere": sphere,
    "beside others": beside_others,
    "film": film,
    "with faces": faced,
    "analyzed": changed(analyzed),
    "segmented": changed(segmented),
    "point cloud": changed(as_cloud),
    "with keys": changed(with_keys),
    "with absolute keys": changed(with_absolute_keys),
    "with names of results": changed(with_names_of_results),
    "with locked groups": changed(with_locked_groups),
    "with material": changed(with_material),
    "subdivided": changed(lambda obj: obj.modifiers.new("Subdivision", "SUBSURF")),
    "repeated": changed(lambda obj: obj.modifiers.new("Array", "ARRAY")),
    "flat": changed(lambda obj: setattr(obj, "scale", (1.0, 1.0, 0.0))),
    "scaled to nothing": changed(lambda obj: setattr(obj, "scale", (0.0, 0.0, 0.0))),
    "scaled to hardly anything": changed(lambda obj: setattr(obj, "scale", (1e-20, 1e-20, 1e-20))),
    "mirrored": changed(lambda obj: setattr(obj, "scale", (-1.0, 2.0, 1.0))),
    "parented": changed(parented),
    "hidden": changed(lambda obj: obj.hide_set(True)),
    "hidden in viewports": changed(lambda obj: setattr(obj, "hide_viewport", True)),
    "in another scene": changed(in_another_scene),
    "in an excluded collection": changed(in_excluded_collection),
    "not active": changed(only_selected),
    "shared": changed(shared),
    "linked": from_library(),
    "linked data": from_library("local object"),
    "overridden object": from_library("object"),
    "overridden": from_library("object", "data"),
    "rigged": changed(rigged),
    "in an armature": with_armature(sphere),
    "around an armature": with_armature(changed(with_keys), active=False),
    "splats in an armature": with_armature(of_splats("Splats")),
    "few points in an armature": with_armature(odd_points(lambda points: points[:7])),
    "following bones": following,
    "weights without bones": weights_without_bones,
    "animated": changed(animated),
    "driven": changed(driven),
    "bound": changed(bound),
    "baked": changed(baked),
    "colored": changed(colored),
    "in Edit Mode": changed(edited),
    "edited with another": changed(edited_with_another),
    "bound in Edit Mode": changed(bound_and_edited),
    "in Weight Paint": changed(lambda obj: bpy.ops.object.mode_set(mode="WEIGHT_PAINT")),
    "no points": odd_points(lambda points: points[:0]),
    "one point": odd_points(lambda points: points[:1]),
    "few points": odd_points(lambda points: points[:7]),
    "a line": odd_points(lambda points: points * (1.0, 0.0, 0.0)),
    "one place": odd_points(lambda points: 0.0 * points),
    "not a number": odd_points(lambda points: np.where(points > 0.95, np.nan, points)),
    "infinite": odd_points(lambda points: np.where(points > 0.95, np.inf, points)),
    "huge": odd_points(lambda points: 1e30 * points),
    "tiny": odd_points(lambda points: 1e-20 * points),
    "splats": of_splats("Splats"),
    "splats beside others": of_splats("Splats", "Others"),
    "light": of_type(lambda: bpy.data.lights.new("Light", "POINT")),
    "armature": of_type(lambda: bpy.data.armatures.new("Armature")),
    "curve": of_type(lambda: bpy.data.curves.new("Curve", "CURVE")),
    "empty": of_type(lambda: None),
    "instance": instance,
    "nothing": lambda: None,
}


def operators():
    return sorted(set(dir(bpy.ops.meshfree)) - LEFT_OUT)


def pairs():
    """All pairs of an object and an operator, in an order of their own."""
    found = list(itertools.product(OBJECTS, operators()))
    return [found[index] for index in np.random.default_rng(0).permutation(len(found))]


def random_settings(properties, rng, folder):
    """Values of some properties, from within their bounds, at them, and near zero; files are those of a folder."""
    settings = {}
    for item in properties:
        if item.identifier == "rna_type" or item.is_readonly or rng.random() < 0.5:
            continue
        if item.type in ("INT", "FLOAT"):
            count = item.array_length if item.is_array else 1
            values = [_random_number(item, rng) for _ in range(count)]
            settings[item.identifier] = values if item.is_array else values[0]
        elif item.type == "BOOLEAN" and not item.is_array:
            settings[item.identifier] = bool(rng.random() < 0.5)
        elif item.type == "ENUM" and item.enum_items:
            keys = [str(key) for key in item.enum_items.keys()]
            settings[item.identifier] = {str(rng.choice(keys))} if item.is_enum_flag else str(rng.choice(keys))
        elif item.subtype in ("FILE_PATH", "DIR_PATH", "FILE_NAME"):
            names = ("Written", "missing/file", "points.xyz", "few.xyz", "broken.ply")
            settings[item.identifier] = str(rng.choice([*(str(folder / name) for name in names), ""]))
        elif item.type == "STRING":
            names = ["", "Handle", "Anchor", "Missing", "lb_area", "lb_eigenvector_001", "\u00e4" * 20]
            settings[item.identifier] = str(rng.choice(names))
    return settings


def _random_number(item, rng):
    ends = [item.hard_min, item.hard_max, item.soft_min, item.soft_max, 0, 1, 3, 7]
    if item.type == "INT":
        return int(np.clip(rng.choice(ends), item.hard_min, item.hard_max))
    return float(np.clip(rng.choice([*ends, 1e-9, 0.5, np.nan]), item.hard_min, item.hard_max))


def files(folder):
    """Files to import, good and bad."""
    np.savetxt(folder / "points.xyz", sphere_points(50))
    np.savetxt(folder / "few.xyz", sphere_points(2))
    (folder / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex 9\nend_header\n1 2")


def scene():
    """All that the objects hold; those in other modes are read in Object Mode, and put back into theirs."""
    active = bpy.context.view_layer.objects.active
    mode = active.mode if active else "OBJECT"
    modes = {obj.name: obj.mode for obj in bpy.data.objects}
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    held = {obj.name: everything(obj) for obj in bpy.data.objects}
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode=mode)
    return active and active.name, modes, held


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
def test_any_call_is_done_or_refused(seed, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    rng, tried = np.random.default_rng(seed), pairs()
    kind, name = tried[seed % len(tried)]
    files(tmp_path)
    obj = OBJECTS[kind]()
    own = {}
    if obj is not None and obj.is_editable and rng.random() < 0.3:
        own = {key: value for key, value in random_settings(_choices(), rng, tmp_path).items() if rng.random() < 0.3}
        for key, value in own.items():
            setattr(obj.meshfree, key, value)
    settings = random_settings(getattr(bpy.ops.meshfree, name).get_rna_type().properties, rng, tmp_path)
    bpy.context.view_layer.update()
    before = scene()
    told = f"{name}({settings}) on {kind} {own}"
    reason = ""
    try:
        result = getattr(bpy.ops.meshfree, name)(**settings)
    except RuntimeError as error:
        reason, result = str(error), {"CANCELLED"}
    assert "Traceback" not in reason + capfd.readouterr().err, told
    assert result in ({"FINISHED"}, {"CANCELLED"}), told
    if result == {"CANCELLED"}:
        assert scene() == before, told
    for obj in bpy.data.objects:
        check_results(obj)


def _choices():
    """The settings of an object that people see, all but those of its deformation."""
    properties = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
    names = [item.identifier for item in properties]
    return [properties[name] for name in names[1 : names.index("spacing")] if properties[name].type != "COLLECTION"]
