"""Make or describe a file with all that version 0.1.0 of the extension stores, to prove that later versions read it.

    python version_0_1_0.py make ZIP FILE.blend PRESET.py        in the environment blender-4.2, with the zip of 0.1.0
    python version_0_1_0.py describe ZIP FILE.blend OUT.json     in any environment with Blender, with the zip of 0.1.0
    python version_0_1_0.py describe - FILE.blend OUT.json       the same without the extension
    python version_0_1_0.py compare ONE.json OTHER.json

`BLENDER_USER_RESOURCES` is set to a folder that is thrown away.
"""

import hashlib
import importlib
import json
import math
import os
import shutil
import sys
import tempfile
import zlib
from pathlib import Path

MODULE = "bl_ext.user_default.meshfree_laplacian"
TOLERANCE = 1e-5  # relative, of numbers that Blender evaluates

# Every setting that one chooses, at another value than its default.
OPEN = {
    "bandwidth": "LOCAL",
    "neighbors": 24,
    "bandwidth_factor": 1.25,
    "normals": "WPCA",
    "areas": "CONSTRAINED",
    "regularization": 0.002,
    "rims": "OFF",
    "sheets": False,
    "projection": "QUADRIC",
    "curvature_correction": False,
    "symbol_correction": False,
    "rim_group": "Rim",
    "use_modifiers": True,
    "make_single_user": True,
    "modes": 4,
    "color_map": "MAGMA",
    "reverse": True,
    "range_mode": "LOCKED",
    "coverage": 90.0,
    "range_low": 0.25,
    "range_high": 0.75,
    "outside": "GRAY",
    "iso_lines": 7,
    "component": "LENGTH",
    "point_size": 0.9,
    "show_groups": True,
    "legend": False,
    "histogram": True,
    "plot_eigenvalues": True,
    "compare_weyl": False,
}
OPEN_DEFORM = {
    "handles": "Grip",
    "anchors": "Hold",
    "add_empties": False,
    "rotation_aware": False,
    "soft": True,
    "weight": 5.0,
    "steps": 12,
}


def start(archive):
    """Start Blender with a user folder of its own, with the extension of a zip if one is given."""
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="meshfree-old-")
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    if archive != "-":
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        assert MODULE in bpy.context.preferences.addons, "the extension is not enabled"
        bpy.ops.wm.read_homefile(use_empty=True)
    return bpy


def leave():
    """End without Blender's own end, which may crash."""
    sys.stdout.flush()
    sys.stderr.flush()
    shutil.rmtree(os.environ["BLENDER_USER_RESOURCES"], ignore_errors=True)
    os._exit(0)


# ---------------------------------------------------------------- make


def make(archive, blend, preset):
    """Make the file, and an example of a user's preset."""
    bpy = start(archive)
    import numpy as np

    ops, scene = bpy.ops.meshfree, bpy.context.scene

    def add_object(name, points, location=(0.0, 0.0, 0.0)):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(np.asarray(points).tolist(), [], [])
        obj = bpy.data.objects.new(name, mesh)
        obj.location = location
        scene.collection.objects.link(obj)
        activate(obj)
        return obj

    def activate(obj):
        for other in scene.objects:
            other.select_set(other == obj)
        bpy.context.view_layer.objects.active = obj
        bpy.context.view_layer.update()

    def add_group(obj, name, members, weight=1.0):
        obj.vertex_groups.new(name=name).add(np.flatnonzero(members).tolist(), weight, "REPLACE")

    def done(result):
        assert result == {"FINISHED"}, result

    def give(settings, values):
        for name, value in values.items():
            setattr(settings, name, value)

    def grid(columns, rows, step, jitter=0.0):
        column, row = (index.ravel() for index in np.meshgrid(np.arange(columns), np.arange(rows)))
        shift = np.random.default_rng(1).uniform(-jitter, jitter, (len(column), 2))
        outermost = (column == 0) | (column == columns - 1) | (row == 0) | (row == rows - 1)
        return step * (column + shift[:, 0]), step * (row + shift[:, 1]), outermost

    def add_open():
        """Half a cylinder and a small part, open, with a few stray points."""
        u, v, outermost = grid(32, 20, 0.1, jitter=0.2)
        cylinder = np.stack([np.cos(u), np.sin(u), v], axis=1)
        x, y, part_outermost = grid(10, 9, 0.1, jitter=0.2)
        part = np.stack([x + 3.0, y, 0.1 * np.sin(2.0 * x)], axis=1)
        stray = np.random.default_rng(2).normal(scale=0.05, size=(6, 3)) + (-5.0, 0.0, 0.0)
        obj = add_object("Open", np.concatenate([cylinder, part, stray]))
        obj.location, obj.rotation_euler, obj.scale = (1.0, -2.0, 0.5), (0.3, 0.0, 0.7), (1.0, 1.0, 1.5)
        add_group(obj, "Rim", np.concatenate([outermost, part_outermost, np.zeros(6, bool)]))
        height = np.concatenate([v, 9.0 + y, np.full(6, -9.0)])
        add_group(obj, "Grip", (height > 1.75) & (height < 9.0))
        add_group(obj, "Hold", (height < 0.15) & (height > -1.0), 0.5)
        give(obj.meshfree, OPEN)
        give(obj.meshfree.deform, OPEN_DEFORM)
        activate(obj)
        done(ops.analyze(modes=OPEN["modes"]))
        done(ops.colormap(attribute="lb_mean_curvature"))
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.location, camera.rotation_euler = (1.0, -12.0, 2.0), (math.pi / 2.0, 0.0, 0.0)
        scene.collection.objects.link(camera)
        scene.camera = camera
        done(ops.legend())

    def add_default():
        """A sphere with the groups that the tools look for, and the results of all of these."""
        count = 600
        index = np.arange(count) + 0.5
        height, angle = 1.0 - 2.0 * index / count, math.pi * (1.0 + 5.0**0.5) * index
        radius = np.sqrt(1.0 - height**2)
        points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
        obj = add_object("Default", points, (4.0, 0.0, 0.0))
        add_group(obj, "Source", height > 0.97)
        add_group(obj, "Fixed", height < -0.97)
        obj.vertex_groups.new(name="Value")
        obj.vertex_groups["Value"].add(np.flatnonzero(height > 0.9).tolist(), 1.0, "REPLACE")
        obj.vertex_groups["Value"].add(np.flatnonzero(height < -0.9).tolist(), 0.25, "REPLACE")
        obj.vertex_groups["Value"].add(np.flatnonzero(np.abs(points[:, 0]) > 0.98).tolist(), 0.0, "REPLACE")
        add_group(obj, "Handle", points[:, 1] > 0.95)
        add_group(obj, "Anchor", points[:, 1] < -0.95)
        add_group(obj, "Rim", (height > 0.2) & (height < 0.25))  # not chosen, for its color alone
        activate(obj)
        done(ops.analyze())
        done(ops.harmonic_field())
        done(ops.segment(parts=3, vertex_groups=True))
        done(ops.signature(kind="HEAT", count=2, modes=20))
        done(ops.signature(kind="WAVE", count=2, modes=20))
        done(ops.geodesic_distance())  # which is shown
        obj.meshfree.show_groups = True

    def add_strip(name, columns, rows, location):
        """A flat strip along x."""
        x, y, outermost = grid(columns, rows, 0.1)
        obj = add_object(name, np.stack([x, y, 0.0 * x], axis=1), location)
        return obj, x, outermost

    def add_bound():
        obj, x, _ = add_strip("Bound", 50, 10, (0.0, 4.0, 0.0))
        obj.rotation_euler, obj.scale = (0.0, 0.0, 0.3), (1.0, 1.0, 2.0)
        add_group(obj, "Anchor", x < 0.25)
        add_group(obj, "Handle", x > 4.65)
        activate(obj)
        done(ops.deform_bind())
        empty = obj.meshfree.deform.handle_items[0].empty
        empty.location.z += 0.75
        empty.location.x -= 0.5
        empty.rotation_euler.y = -0.4
        bpy.context.view_layer.update()
        done(ops.deform_update())

    def add_bound_softly():
        """By groups of other names, one moved by an empty and one in Edit Mode, with a group for the rim."""
        obj, x, outermost = add_strip("Bound Softly", 36, 8, (0.0, 6.0, 0.0))
        add_group(obj, "Rim", outermost)
        add_group(obj, "Hold", x < 0.25)
        add_group(obj, "Grip", x > 3.25, 0.5)
        settings = obj.meshfree
        give(settings, {"rims": "OFF", "rim_group": "Rim", "projection": "OFF", "symbol_correction": False})
        give(settings.deform, {"handles": "Grip", "anchors": "Hold", "soft": True, "weight": 20.0, "steps": 40})
        activate(obj)
        done(ops.deform_bind())
        add_group(obj, "Grip.001", np.abs(x - 1.8) < 0.15)
        settings.deform.add_empties = False
        done(ops.deform_bind())  # the second time, and without an empty for the new group
        settings.deform.handle_items["Grip"].empty.location.z += 0.5
        rows = np.flatnonzero(np.abs(x - 1.8) < 0.15)
        for row in rows.tolist():
            obj.data.vertices[row].co.z += 0.4
        obj.data.update()
        bpy.context.view_layer.update()
        done(ops.deform_update())
        done(ops.colormap(attribute="lb_displacement"))

    def add_baked():
        obj, x, _ = add_strip("Baked", 36, 8, (0.0, 8.0, 0.0))
        add_group(obj, "Anchor", x < 0.25)
        add_group(obj, "Handle", x > 3.25)
        activate(obj)
        done(ops.deform_bind())
        empty = obj.meshfree.deform.handle_items[0].empty
        for frame, height in enumerate((0.3, 0.6, 1.0), start=1):
            empty.location.z = height
            empty.keyframe_insert("location", frame=frame)
        scene.frame_set(1)
        done(ops.deform_bake(first=1, last=3))
        modifiers = importlib.import_module(f"{MODULE}.operators.modifiers")
        modifiers.set_input(obj.modifiers["Mesh-Free Deform"], "Strength", 0.75)

    def add_rims_off():
        u, v, outermost = grid(24, 22, 0.12, jitter=0.1)
        points = np.stack([u, v, 0.2 * np.cos(2.0 * u)], axis=1)
        obj = add_object("Rims off", points, (-5.0, 0.0, 0.0))
        add_group(obj, "Rim", outermost)  # not chosen
        obj.meshfree.rims = "OFF"
        obj.meshfree.projection = "OFF"

    def add_film():
        """Shape keys, and an analysis of what they show."""
        x, y, outermost = grid(18, 17, 0.1, jitter=0.1)
        points = np.stack([x, y, 0.2 * np.sin(3.0 * x) * np.cos(2.0 * y)], axis=1)
        obj = add_object("Film", points, (-5.0, 4.0, 0.0))
        add_group(obj, "Fixed", outermost)
        activate(obj)
        done(ops.minimal_surface(steps=3))
        done(ops.smooth(keep_rim=False, strength=0.5))
        done(ops.mode_shape(mode=3))
        done(ops.analyze())
        done(ops.colormap(attribute="lb_boundary"))

    def add_imported():
        """Points far from the origin, whose shift the object keeps."""
        x, y, _ = grid(8, 8, 0.5)
        table = np.stack([x + 4_000_000.0, y + 500_000.0, 0.1 * x * y, np.arange(len(x))], axis=1)
        path = Path(os.environ["BLENDER_USER_RESOURCES"]) / "Imported.csv"
        np.savetxt(path, table, fmt="%.2f", delimiter=",", header="x,y,z,intensity", comments="")
        done(ops.import_points(filepath=str(path)))
        bpy.data.objects["Imported"].location = (-5.0, 8.0, 0.0)

    for add in (add_open, add_default, add_bound, add_bound_softly, add_baked, add_rims_off, add_film, add_imported):
        add()
    activate(bpy.data.objects["Open"])
    done(ops.add_preset(name="Old Scans"))
    [made] = Path(os.environ["BLENDER_USER_RESOURCES"]).rglob("Old_Scans.py")
    print("preset", made.relative_to(os.environ["BLENDER_USER_RESOURCES"]))
    shutil.copyfile(made, preset)
    scene.frame_start, scene.frame_end = 1, 3
    scene.frame_set(1)
    Path(blend).unlink(missing_ok=True)  # of which Blender would keep a copy
    done(bpy.ops.wm.save_as_mainfile(filepath=str(Path(blend).resolve()), compress=True))
    leave()


# ---------------------------------------------------------------- describe


def describe(archive, blend, out):
    """Open the file and write all that it holds of the extension as JSON."""
    bpy = start(archive)
    bpy.ops.wm.open_mainfile(filepath=str(Path(blend).resolve()))
    scene = bpy.context.scene
    frames = {}
    objects = {obj.name: _object(bpy, obj) for obj in sorted(bpy.data.objects, key=lambda obj: obj.name)}
    for frame in (2, 3):
        scene.frame_set(frame)
        frames[str(frame)] = _evaluated(bpy, bpy.data.objects["Baked"])
    scene.frame_set(1)
    lifted = None
    if archive != "-":  # it still follows
        bpy.data.objects["Bound Handle"].location.z += 0.2
        bpy.context.view_layer.update()
        lifted = _evaluated(bpy, bpy.data.objects["Bound"])
    found = {
        "blender": bpy.app.version_string,
        "saved_by": ".".join(map(str, bpy.data.version)),
        "extension": archive != "-",
        "sha256": hashlib.sha256(Path(blend).read_bytes()).hexdigest(),
        "size": Path(blend).stat().st_size,
        "scene": {"frames": [scene.frame_start, scene.frame_end, scene.frame_current], "camera": scene.camera.name},
        "objects": objects,
        "baked_frames": frames,
        "bound_lifted_by_0.2": lifted,
        "packed": sorted(item.name for item in (*bpy.data.fonts, *bpy.data.images) if item.packed_file),
        "legends": {item.name: _legend(item) for item in bpy.data.collections if "meshfree_legend_of" in item},
        "materials": {item.name: _material(item) for item in bpy.data.materials},
        "node_groups": {item.name: _node_group(item) for item in bpy.data.node_groups},
    }
    Path(out).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    leave()


def _object(bpy, obj):
    record = {
        "type": obj.type,
        "matrix_world": [list(row) for row in obj.matrix_world],
        "parent": obj.parent and obj.parent.name,
        "custom_properties": _custom(obj),
    }
    if obj.type == "MESH":
        data = obj.data
        record |= {
            "data": data.name,
            "data_custom_properties": _custom(data),
            "points": len(data.vertices),
            "attributes": {item.name: _attribute(item) for item in data.attributes if item.domain == "POINT"},
            "vertex_groups": {group.name: _group(obj, group) for group in obj.vertex_groups},
            "shape_keys": {
                key.name: {"value": key.value, **_checksums([value for item in key.data for value in item.co])}
                for key in (data.shape_keys.key_blocks if data.shape_keys else ())
            },
        }
        record["evaluated"] = _evaluated(bpy, obj)
    record["modifiers"] = [_modifier(item) for item in obj.modifiers]
    record["materials"] = [slot.material and slot.material.name for slot in obj.material_slots]
    record["animation"] = _animation(obj)
    stored = _stored(obj)
    if stored:
        record["stored_settings"] = stored
    if obj.type == "MESH" and hasattr(obj, "meshfree"):
        record["settings"] = _settings(obj.meshfree)
        record["total_area"] = obj.meshfree.total_area
        record["state"] = _state(obj)
    return record


def _state(obj):
    """What version 0.1.0 says of results and bindings."""
    display, result, binding, nodes, reading = (
        importlib.import_module(f"{MODULE}.{name}")
        for name in ("ui.display", *(f"operators.{part}" for part in ("result", "binding", "deform_nodes", "reading")))
    )
    bound = binding.is_bound(obj)
    shown = display.shown_attribute(obj)
    return {
        "is_analyzed": result.is_analyzed(obj),
        "is_stale": result.is_stale(obj) if result.is_analyzed(obj) else None,
        "fingerprint_now": reading.fingerprint(obj),
        "is_bound": bound,
        "is_baked": nodes.is_baked(obj),
        "stale_reason": str(binding.stale_reason(obj)) if bound else None,
        "shown_attribute": shown,
        "shown_range": list(display.shown_range(obj) or ()) if shown else None,
        "shown_label": display.label(shown) if shown else None,
    }


def _settings(group):
    """All values of a group of settings by their names, inner groups and collections included."""
    values = {}
    for item in group.bl_rna.properties:
        name, value = item.identifier, getattr(group, item.identifier)
        if name == "rna_type":
            continue
        if item.type == "COLLECTION":
            values[name] = [_settings(part) for part in value]
        elif item.type == "POINTER":
            values[name] = _settings(value) if type(value).__name__.startswith("MESHFREE") else value and value.name
        elif getattr(item, "is_array", False):
            values[name] = list(value)
        else:
            values[name] = value
    return values


def _stored(obj):
    """The settings as the file holds them: those alone that were ever set, enumerations as numbers."""
    if hasattr(obj, "bl_system_properties_get"):  # Blender 5.0 on
        kept = obj.bl_system_properties_get()
        kept = kept and kept.get("meshfree")
    else:
        kept = obj.get("meshfree")
    return _plain(kept) if kept is not None else None


def _custom(owner):
    return {name: _plain(owner[name]) for name in sorted(owner.keys()) if name not in ("meshfree", "cycles")}


def _plain(value):
    if hasattr(value, "to_dict"):
        return {name: _plain(value[name]) for name in value.keys()}
    if hasattr(value, "to_list"):
        return value.to_list()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (int, float, str, bool)) or value is None:
        return value
    return getattr(value, "name", repr(value))


def _attribute(item):
    key, size = {"FLOAT_VECTOR": ("vector", 3), "FLOAT_COLOR": ("color", 4)}.get(item.data_type, ("value", 1))
    values = [0.0 if "FLOAT" in item.data_type else False] * (size * len(item.data))
    if item.data_type == "INT":
        values = [0] * len(item.data)
    item.data.foreach_get(key, values)
    return {"data_type": item.data_type, "domain": item.domain, **_checksums(values)}


def _checksums(values):
    """Length, sum, sum of squares, first three numbers, and checksum of their exact values."""
    return {
        "count": len(values),
        "sum": math.fsum(values),
        "squares": math.fsum(value * value for value in values),
        "first": list(values[:3]),
        "crc32": f"{zlib.crc32(repr(list(values)).encode()):08x}",
    }


def _group(obj, group):
    weights = [item.weight for vertex in obj.data.vertices for item in vertex.groups if item.group == group.index]
    members = [vertex.index for vertex in obj.data.vertices if group.index in {item.group for item in vertex.groups}]
    return {"points": len(members), "first": members[:3], "weights": math.fsum(weights)}


def _modifier(modifier):
    record = {"name": modifier.name, "type": modifier.type, "show_viewport": modifier.show_viewport}
    group = modifier.node_group if modifier.type == "NODES" else None
    if group is not None:
        record["node_group"] = group.name
        record["pinned"] = modifier.use_pin_to_last
        record["inputs"] = {
            socket.name: _input(modifier, socket.identifier)
            for socket in group.interface.items_tree
            if socket.item_type == "SOCKET" and socket.in_out == "INPUT" and socket.socket_type != "NodeSocketGeometry"
        }
    return record


def _input(modifier, identifier):
    if hasattr(modifier, "properties"):  # Blender 5.2 on
        return _plain(getattr(modifier.properties.inputs, identifier).value)
    return _plain(modifier.get(identifier))


def _evaluated(bpy, obj):
    """Checksums of where modifiers and shape keys put the vertices, apart from the display, which makes points."""
    displays = [item for item in obj.modifiers if item.name.startswith("Mesh-Free Display") and item.show_viewport]
    for item in displays:
        item.show_viewport = False
    bpy.context.view_layer.update()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    values = [0.0] * (3 * len(evaluated.data.vertices))
    evaluated.data.vertices.foreach_get("co", values)
    for item in displays:
        item.show_viewport = True
    bpy.context.view_layer.update()
    return _checksums(values) | {"lowest": min(values[2::3], default=0.0), "highest": max(values[2::3], default=0.0)}


def _animation(obj):
    action = obj.animation_data and obj.animation_data.action
    if not action:
        return None
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    return [
        {"path": curve.data_path, "index": curve.array_index, "keys": [list(key.co) for key in curve.keyframe_points]}
        for curve in curves
    ]


def _legend(collection):
    parts = {item.get("meshfree_legend_part", ""): item for item in collection.objects}
    texts = {name: item.data.body if item.type == "FONT" else "" for name, item in sorted(parts.items())}
    return {"custom_properties": _custom(collection), "parts": texts}


def _material(material):
    nodes = material.node_tree.nodes if material.node_tree else ()
    record = {
        "custom_properties": _custom(material),
        "users": material.users,
        "attributes": sorted(node.attribute_name for node in nodes if node.type == "ATTRIBUTE"),
        "nodes": sorted(node.name for node in nodes),
    }
    bounds = material.node_tree.nodes.get("Range") if material.node_tree else None
    if bounds is not None:
        record["range"] = [bounds.inputs[name].default_value for name in ("From Min", "From Max")]
    return record


def _node_group(group):
    return {
        "type": group.bl_idname,
        "custom_properties": _custom(group),
        "sockets": [
            [item.in_out, item.name, item.identifier, item.socket_type]
            for item in group.interface.items_tree
            if item.item_type == "SOCKET"
        ],
        "nodes": len(group.nodes),
    }


# ---------------------------------------------------------------- compare


def compare(one, other):
    """Print where two descriptions differ; numbers may differ a little."""
    one, other = (json.loads(Path(path).read_text(encoding="utf-8")) for path in (one, other))
    differences = [*_differences(one, other)]
    for place, before, after in differences:
        print(f"{place}: {json.dumps(before)[:150]} -> {json.dumps(after)[:150]}")
    print(len(differences), "differences")


def _differences(one, other, place=""):
    if isinstance(one, dict) and isinstance(other, dict):
        for name in sorted(one.keys() | other.keys()):
            if name not in one or name not in other:
                yield f"{place}/{name}", one.get(name, "<none>"), other.get(name, "<none>")
            else:
                yield from _differences(one[name], other[name], f"{place}/{name}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for index, (before, after) in enumerate(zip(one, other, strict=True)):
            yield from _differences(before, after, f"{place}/{index}")
    elif isinstance(one, float) and isinstance(other, float):
        if not math.isclose(one, other, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
            yield place, one, other
    elif one != other:
        yield place, one, other


if __name__ == "__main__":
    {"make": make, "describe": describe, "compare": compare}[sys.argv[1]](*sys.argv[2:])
