"""Reconstruct a mesh from the points, with their attributes on its vertices."""

import bmesh
import bpy
import numpy as np
from bpy.props import BoolProperty

from ...command.colors import COLOR, average
from ...core.linalg import det
from ...tools import mesh_surface
from ...tools.quantities import quantity
from ..objects.attributes import DISC, STORABLE, point_count, read_attribute, write_attribute
from ..objects.color_choices import COLOR_CHOICES
from ..objects.colors import COLORS, own_colors, splat_colors
from ..objects.groups import add_group
from ..objects.handlers import notify
from ..objects.place import activate, copy_place, hide, link_beside
from ..objects.splats import has_splats
from ..running.measures import carry
from .declared import registration_of

_LEFT = DISC, "position"  # attributes that are not valid on a mesh
_STEPS = 255  # of weights


class MeshObject:
    """What Blender adds to the tool: an object of the mesh."""

    last = ("keep_open",)
    made = ()  # names of objects and of their meshes

    keep_open: BoolProperty(
        name="Keep Open",
        description="End the mesh where the points end; otherwise all openings are closed, such as for printing",
        default=True,
    )

    def plan(self, context, obj):
        planned, kept = super().plan(context, obj), _Kept(obj)

        def compute(progress):
            _, laplacian, own, reading = planned(progress)
            mesh, carrying = mesh_surface.carried_mesh(laplacian, own.detail, progress)
            faces = mesh.faces if det(reading.matrix) > 0.0 else mesh.faces[:, ::-1]
            carried = kept.carried(carrying, len(mesh.vertices))
            return reading.local(mesh.vertices), faces, carried, mesh.notices

        return compute

    def write(self, context, obj, result):
        vertices, faces, carried, notices = result
        made = bpy.data.objects.new(f"{obj.name} Surface", _mesh(f"{obj.name} Surface", vertices, faces))
        link_beside(made, obj)
        made.matrix_world = obj.matrix_world
        copy_place(made, obj)
        opened = close_holes(made.data, mesh_surface.GAP if self.keep_open else 0)
        carried.write(made)
        for name in COLOR_CHOICES:
            setattr(made.meshfree, name, getattr(obj.meshfree, name))
        self.made = (*self.made, (obj.name, made.name))
        line = mesh_surface.line(len(made.data.polygons), opened)
        return [*notices, f"{made.name}: {line}. The points are hidden"]

    def conclude(self, context, objects):
        """Show the meshes like their points, and hide these."""
        made = {name: bpy.data.objects[other] for name, other in self.made}
        self.made = ()
        for obj in objects:
            notify("mesh_made", obj, made[obj.name])
        activate(context, *(made[obj.name] for obj in objects))
        for obj in objects:
            hide(obj)


class _Kept:
    """The data of an object's points: attributes, colors, and weights in vertex groups."""

    def __init__(self, obj):
        self._types, self._values, self._active = {}, {}, own_colors(obj.data)
        splats = has_splats(obj.data)  # whose colors are harmonics
        for attribute in obj.data.attributes:
            name = attribute.name
            if attribute.domain != "POINT" or name in _LEFT or name.startswith("."):
                continue
            if attribute.data_type in STORABLE:
                self._values[name] = read_attribute(obj.data, name)
            elif attribute.data_type in COLORS and not splats:
                self._values[name] = np.empty((point_count(obj.data), 4), np.float32)
                attribute.data.foreach_get("color", self._values[name].reshape(-1))
            else:
                continue
            self._types[name] = attribute.data_type
        if splats:
            self._types[COLOR], self._values[COLOR], self._active = "FLOAT_COLOR", splat_colors(obj.data), COLOR
        self._groups = _weights(obj)

    def carried(self, carrying, count):
        """Return the data on the vertices of a mesh, the last `count` points of a `Prolongation`."""
        result = object.__new__(_Kept)
        result._types, result._active = self._types, self._active
        result._values = {name: self._carry(carrying, name, values)[-count:] for name, values in self._values.items()}
        result._groups = {
            name: np.clip(carrying.interpolate(weights)[-count:], 0.0, 1.0) for name, weights in self._groups.items()
        }
        return result

    def _carry(self, carrying, name, values):
        kind = quantity(name).carried if values.dtype.kind == "f" else "label"
        if kind == "share":  # areas stay those of the points: the area of a mesh is that of its faces
            kind = "smooth"
        if self._types[name] in COLORS:
            return average(values, carrying.interpolate)
        return carry(carrying, kind, values)

    def write(self, obj):
        """Write the data to the vertices of a mesh."""
        for name, values in self._values.items():
            if self._types[name] in COLORS:
                layer = obj.data.attributes.new(name, self._types[name], "POINT")
                layer.data.foreach_set("color", np.ascontiguousarray(values, np.float32).reshape(-1))
            else:
                write_attribute(obj.data, name, values, self._types[name])
        if self._active:
            obj.data.color_attributes.active_color_name = self._active
        for name, weights in self._groups.items():
            add_group(obj, name, np.round(_STEPS * weights) / _STEPS)


def _weights(obj):
    """Read the weights in all vertex groups of an object, by name, (n,) each; 0 for points outside."""
    if obj.type != "MESH" or not obj.vertex_groups:
        return {}
    weights = np.zeros((len(obj.vertex_groups), point_count(obj.data)), np.float32)
    for vertex in obj.data.vertices:
        for item in vertex.groups:
            weights[item.group, vertex.index] = item.weight
    return {group.name: weights[group.index] for group in obj.vertex_groups}


def _mesh(name, vertices, faces):
    """Return a mesh, shaded smooth, of vertices (m, 3) and quads (q, 4)."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).reshape(-1))
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).reshape(-1))
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def close_holes(mesh, most):
    """Close the holes of a mesh with at most so many edges, 0 for all; return the number of open edges left."""
    shape = bmesh.new()
    shape.from_mesh(mesh)
    edges = [edge for edge in shape.edges if edge.is_boundary]
    if edges:
        filled = bmesh.ops.holes_fill(shape, edges=edges, sides=most)["faces"]
        bmesh.ops.triangulate(shape, faces=[face for face in filled if len(face.verts) > 4])
    for face in shape.faces:
        face.smooth = True
    opened = sum(edge.is_boundary for edge in shape.edges)
    shape.to_mesh(mesh)
    shape.free()
    return opened


TOOLS = (registration_of(mesh_surface.TOOL, MeshObject),)
