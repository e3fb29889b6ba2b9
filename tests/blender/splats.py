"""Gaussian splats for the tests: a bar of flat ones with a colour field of degree 3."""

import bpy
import numpy as np

_KEYS = {"FLOAT_VECTOR": "vector", "QUATERNION": "value", "FLOAT_COLOR": "color", "FLOAT4": "vector"}


def bar_splats(core, degree=3):
    """Splats on a round bar along z: thin ones that lie in its side, as trained ones do."""
    around, along, step = 24, 40, np.pi / 12
    angle, height = np.meshgrid(step * np.arange(around), step * np.arange(along))
    angle = angle + 0.5 * step * (np.arange(along) % 2)[:, None]
    normals = np.column_stack([np.cos(angle).ravel(), np.sin(angle).ravel(), np.zeros(angle.size)])
    points = normals + height.reshape(-1, 1) * [0.0, 0.0, 1.0]
    spacing = np.full(len(points), step)
    tangent = np.cross(normals, [0.0, 0.0, 1.0])
    frames = np.stack([tangent, np.cross(normals, tangent), normals], axis=2)
    rotations = core.splats.ellipsoids.quaternions_of(np.moveaxis(frames, 0, 2))
    rng = np.random.default_rng(7)
    count = len(points)
    return core.splats.Splats(
        positions=points.astype(np.float32),
        scales=(spacing[:, None] * [0.9, 0.7, 0.1]).astype(np.float32),
        rotations=rotations.astype(np.float32),
        opacities=rng.uniform(0.3, 1.0, count).astype(np.float32),
        colors=rng.standard_normal((count, 3)).astype(np.float32),
        harmonics=0.2 * rng.standard_normal((count, (degree + 1) ** 2 - 1, 3)).astype(np.float32),
    )


def add_splats(splats, name="Splats", as_mesh=False):
    """Add an active, selected object of splats: a point cloud where Blender makes one of a mesh, and that is wanted."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(splats))
    mesh.attributes["position"].data.foreach_set("vector", splats.positions.ravel())
    base = np.column_stack([splats.colors, splats.opacities])
    add_attribute(mesh, "scale", "FLOAT_VECTOR", splats.scales)
    add_attribute(mesh, "rotation", "QUATERNION", splats.rotations)
    add_attribute(mesh, "radiance:base", "FLOAT_COLOR", base)
    for number in range(splats.harmonics.shape[1]):
        add_attribute(mesh, f"radiance:sh_{number}", "FLOAT_VECTOR", splats.harmonics[:, number])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    if bpy.app.version >= (4, 5) and not as_mesh:
        assert bpy.ops.object.convert(target="POINTCLOUD") == {"FINISHED"}
        obj = bpy.context.object
    return obj


def add_attribute(data, name, kind, values):
    layer = data.attributes.new(name, kind, "POINT")
    layer.data.foreach_set(_KEYS[kind], np.ascontiguousarray(values, np.float32).ravel())


def read(data, name):
    """Read an attribute of data, or of an evaluated object's data."""
    layer = data.attributes[name]
    width = 3 if layer.data_type == "FLOAT_VECTOR" else 4
    values = np.empty(width * len(layer.data), np.float32)
    layer.data.foreach_get(_KEYS[layer.data_type], values)
    return values.reshape(-1, width)


def shown(obj):
    """Data of an object after its modifiers."""
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def splats_of(core, data):
    """The splats that data hold."""
    base = read(data, "radiance:base")
    names = [f"radiance:sh_{number}" for number in range(24)]
    harmonics = [read(data, name) for name in names if name in data.attributes]
    harmonics = np.stack(harmonics, axis=1) if harmonics else np.empty((len(base), 0, 3), np.float32)
    rest = read(data, "position"), read(data, "scale"), read(data, "rotation"), base[:, 3], base[:, :3]
    return core.splats.Splats(*rest, harmonics)
