"""Point clouds for the tests of Blender, and a record of everything that an object holds."""

import bpy
import numpy as np

_KEYS = {"FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT": ("value", 1, np.float32)}


def sphere_points(count=1000, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def add_object(points, name="Cloud", faces=()):
    """Add an active object with these vertices."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points).tolist(), [], list(faces))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def local_points(obj):
    """Vertices as Blender keeps them, single precision, as float64."""
    return attribute(obj, "position").astype(np.float64)


def attribute(obj, name):
    layer = obj.data.attributes[name]
    key, components, dtype = _KEYS[layer.data_type]
    values = np.empty(components * len(layer.data), dtype)
    layer.data.foreach_get(key, values)
    return values.reshape(-1, components) if components > 1 else values


def result_names(obj):
    return sorted(layer.name for layer in obj.data.attributes if layer.name.startswith("lb_"))


def everything(obj):
    """All data of an object and its mesh, and how many data-blocks there are, to compare before and after."""
    data = obj.data
    record = {
        "blocks": {name: len(getattr(bpy.data, name)) for name in ("objects", "meshes", "materials", "node_groups")},
        "object": (obj.name, obj.mode, data and data.name, [list(row) for row in obj.matrix_world]),
        "properties": {key: list(obj[key]) for key in list(obj.keys()) if key.startswith("lb_")},
        "modifiers": [(item.name, item.show_viewport, item.show_render) for item in obj.modifiers],
        "groups": [group.name for group in obj.vertex_groups],
        "settings": _values(obj.meshfree),
    }
    if obj.type == "MESH":
        record["attributes"] = {layer.name: (layer.domain, layer.data_type, _bytes(layer)) for layer in data.attributes}
        record["counts"] = (len(data.vertices), len(data.edges), len(data.polygons))
        record["keys"] = [
            (block.name, block.value, block.mute, [tuple(point.co) for point in block.data])
            for block in (data.shape_keys.key_blocks if data.shape_keys else ())
        ]
    return record


def _bytes(layer):
    if layer.data_type not in _KEYS:
        return None
    key, components, dtype = _KEYS[layer.data_type]
    values = np.empty(components * len(layer.data), dtype)
    layer.data.foreach_get(key, values)
    return values.tobytes()


def _values(group):
    names = [item.identifier for item in group.bl_rna.properties if item.type in {"INT", "FLOAT", "ENUM", "STRING"}]
    return {name: repr(getattr(group, name)) for name in names if name != "metric"} | {"metric": list(group.metric)}
