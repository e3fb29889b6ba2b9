"""Deleting points with all that they hold."""

import bmesh
import bpy

from ...core import PointCloudError
from ...tools.quantities import EIGENVALUES
from .attributes import SELECTION, tag_changed, write_attribute
from .place import link_beside


def check_deletable(obj):
    """Refuse an object whose points cannot be deleted, before anything is computed."""
    if obj.meshfree.deform.is_bound:
        raise PointCloudError(f'"{obj.name}" is bound. Apply or unbind it first.')
    if obj.type != "MESH" and not obj.visible_get():
        raise PointCloudError(f'"{obj.name}" is hidden. Show it, so that its points can be deleted.')


def keep_points(context, obj, kept):
    """Delete the points of an object but those to keep, (n,) bool, with their data."""
    if obj.type != "MESH":
        _keep_in_cloud(context, obj, kept)
    else:
        shape = bmesh.new()
        shape.from_mesh(obj.data)
        dropped = [vertex for vertex, keep in zip(shape.verts, kept, strict=True) if not keep]
        bmesh.ops.delete(shape, geom=dropped, context="VERTS")
        shape.to_mesh(obj.data)
        shape.free()
        tag_changed(obj.data)
    context.view_layer.update()  # the display follows


def split_off(context, obj, name, members):
    """Return a new object with some points of another one, (n,) bool, which keeps them, too."""
    part = obj.copy()
    part.name = name
    part.data = obj.data.copy()
    part.data.name = part.name
    part.pop(EIGENVALUES, None)  # those of the whole
    link_beside(part, obj)
    keep_points(context, part, members)
    return part


def _keep_in_cloud(context, obj, kept):
    """Delete points of a point cloud by Blender's operator, which deletes selected ones in Edit Mode."""
    active, chosen = context.view_layer.objects.active, context.selected_objects
    for other in chosen:
        other.select_set(False)
    context.view_layer.objects.active = obj
    write_attribute(obj.data, SELECTION, ~kept, "BOOLEAN")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.pointcloud.delete()
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.data.attributes.remove(obj.data.attributes[SELECTION])
    context.view_layer.objects.active = active
    for other in chosen:
        other.select_set(True)
