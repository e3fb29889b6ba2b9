"""Point clouds for the tests of Blender, and a record of everything that an object holds."""

from collections import Counter

import bpy
import numpy as np

CORNERS, FACES = 8, 12  # of a disc that the display draws: two cones with a common rim
_KEYS = {
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT": ("value", 1, np.float32),
    "BOOLEAN": ("value", 1, np.bool_),
    "INT": ("value", 1, np.int32),
}


def sphere_points(count=1000, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def grid_points(columns=40, rows=30, step=0.1, jitter=0.2):
    """Points of a flat rectangle, off their grid at random by a share of its step, and which are outermost."""
    column, row = (index.ravel() for index in np.meshgrid(np.arange(columns), np.arange(rows)))
    shift = np.random.default_rng(0).uniform(-jitter, jitter, (len(column), 2))
    points = step * np.stack([column + shift[:, 0], row + shift[:, 1], 0.0 * column], axis=1)
    return points, (column == 0) | (column == columns - 1) | (row == 0) | (row == rows - 1)


def add_object(points, name="Cloud", faces=()):
    """Add an active object with these vertices."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points).tolist(), [], list(faces))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def add_group(obj, name, members, weight=1.0):
    """Add a vertex group with some vertices, given as indices or as a mask."""
    members = np.asarray(members)
    group = obj.vertex_groups.new(name=name)
    group.add((np.flatnonzero(members) if members.dtype == bool else members).tolist(), weight, "REPLACE")
    return group


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


_OF_WINDOWS = {"SCREEN", "WINDOWMANAGER", "WORKSPACE"}  # which a second window adds


def everything(obj):
    """All data of an object and its mesh, and how many data-blocks there are, to compare before and after."""
    data = obj.data
    record = {
        "blocks": dict(
            Counter(type(block).__name__ for block in bpy.data.user_map() if block.id_type not in _OF_WINDOWS)
        ),
        "object": (obj.name, obj.mode, data and data.name, [list(row) for row in obj.matrix_world]),
        "seen": (obj.select_get(), obj.hide_get(), obj.hide_viewport, obj.hide_render, obj.active_shape_key_index),
        "parent": (obj.parent and obj.parent.name, obj.parent_type, obj.parent_bone, repr(obj.matrix_parent_inverse)),
        "properties": _own(obj),
        "modifiers": [
            (item.name, item.type, item.show_viewport, item.show_render, sorted(_inputs(item).items()))
            for item in obj.modifiers
        ],
        "shown": [_material(block) for item in obj.modifiers for block in _materials(item)],
        "materials": [slot.name for slot in obj.material_slots],
        "animation": _animation(obj),
        "scene": [
            (scene.name, scene.frame_current, scene.frame_subframe, scene.render.use_lock_interface)
            for scene in bpy.data.scenes
        ],
        "groups": [(group.name, group.lock_weight) for group in obj.vertex_groups],
        "settings": _values(obj.meshfree),
    }
    if obj.type in ("MESH", "POINTCLOUD"):
        record["data properties"] = _own(data)
        record["attributes"] = {layer.name: (layer.domain, layer.data_type, _bytes(layer)) for layer in data.attributes}
    if obj.type == "MESH":
        record["animated keys"] = _animation(data.shape_keys)
        record["members"] = [[(item.group, item.weight) for item in vertex.groups] for vertex in data.vertices]
        record["counts"] = (len(data.vertices), len(data.edges), len(data.polygons))
        record["keys"] = [
            (block.name, block.value, block.mute, repr([tuple(point.co) for point in block.data]))
            for block in (data.shape_keys.key_blocks if data.shape_keys else ())
        ]
    return record


def differences(found, expected):
    """What differs between two records of all objects by their names, each as `everything` gives it."""
    if found.keys() != expected.keys():
        return [(sorted(expected), sorted(found))]
    return [
        (name, key, expected[name].get(key), found[name].get(key))
        for name in found
        for key in {*found[name], *expected[name]}
        if found[name].get(key) != expected[name].get(key)
    ]


def _own(block):
    """Custom properties of a data-block, those of this extension's classes apart."""
    return {key: _plain(block[key]) for key in list(block.keys()) if key not in block.bl_rna.properties}


def _plain(value):
    """A value, or as text what lives in Blender's memory."""
    for way in ("to_list", "to_dict"):
        if hasattr(value, way):
            return repr(getattr(value, way)())
    return repr(value)


def _materials(modifier):
    return [bpy.data.materials[name] for name in _inputs(modifier).values() if name in bpy.data.materials]


def _material(material):
    """What the nodes of a material show."""
    nodes = material.node_tree.nodes
    return material.name, [
        (
            node.name,
            [repr(_listed(socket.default_value)) for socket in node.inputs if hasattr(socket, "default_value")],
            getattr(node, "attribute_name", ""),
            [(each.position, tuple(each.color)) for each in node.color_ramp.elements]
            if hasattr(node, "color_ramp")
            else [],
        )
        for node in nodes
    ]


def _listed(value):
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _inputs(modifier):
    """Values of the inputs of a modifier by nodes, as text."""
    if modifier.type != "NODES" or modifier.node_group is None:
        return {}
    items = [item for item in modifier.node_group.interface.items_tree if item.in_out == "INPUT"]
    if hasattr(modifier, "properties"):  # Blender 5.2 on
        found = {
            item.name: getattr(getattr(modifier.properties.inputs, item.identifier), "value", None) for item in items
        }
    else:
        found = {item.name: modifier.get(item.identifier) for item in items}
    return {name: value.name if isinstance(value, bpy.types.ID) else str(value) for name, value in found.items()}


def _animation(block):
    """Keyframes of a data-block."""
    action = block and block.animation_data and block.animation_data.action
    if not action:
        return None
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    return action.name, [(curve.data_path, [tuple(key.co) for key in curve.keyframe_points]) for curve in curves]


def _bytes(layer):
    if layer.data_type not in _KEYS:
        return None
    key, components, dtype = _KEYS[layer.data_type]
    values = np.empty(components * len(layer.data), dtype)
    layer.data.foreach_get(key, values)
    return values.tobytes()


def _values(group):
    """All settings, as text, but for those that differ from run to run: stages, and names that occur once."""
    values = {}
    for item in group.bl_rna.properties:
        value = getattr(group, item.identifier)
        if item.identifier in ("rna_type", "stages", "binding_id"):
            continue
        if item.type == "COLLECTION":
            values[item.identifier] = [_values(member) for member in value]
        elif isinstance(value, bpy.types.PropertyGroup):
            values[item.identifier] = _values(value)
        elif isinstance(value, bpy.types.ID):
            values[item.identifier] = value.name
        else:
            values[item.identifier] = repr(_listed(value))
    return values
