"""Select points and put them into the vertex groups that the tools take, where Blender's own ways need faces."""

from contextlib import contextmanager

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, StringProperty

from ..core import PointCloudError, grow
from .application import operator_reader
from .attributes import SELECTION, point_count, read_attribute, tag_changed, write_attribute
from .groups import group_weights, has_group
from .ready import ReadyOperator
from .stages import Stages


class SelectionOperator(ReadyOperator):
    """An operator on the selected points of the active object, in Edit Mode or Object Mode."""

    works_in = ("OBJECT", "EDIT")

    def execute(self, context):
        obj = context.object
        with object_mode(context, obj):
            try:
                message = self.change(context, obj)
            except PointCloudError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
        self.report({"INFO"}, message)
        return {"FINISHED"}


@contextmanager
def object_mode(context, obj):
    """Leave Edit Mode, where vertices cannot be read as arrays, and come back to it with the same objects."""
    if obj.mode != "EDIT":
        yield
        return
    others = [other for other in context.view_layer.objects if other != obj]
    edited = [other for other in others if other.mode == "EDIT"]
    chosen = [other for other in others if other.select_get()]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        for other in others:  # selected ones come along into Edit Mode
            other.select_set(other in edited)
        bpy.ops.object.mode_set(mode="EDIT")
        for other in others:
            other.select_set(other in chosen)


def selected(obj):
    """Read which points are selected, (n,) bool."""
    chosen = np.ones(point_count(obj.data), dtype=bool)
    if obj.type == "MESH":
        obj.data.vertices.foreach_get("select", chosen)
    elif SELECTION in obj.data.attributes:  # without it Blender takes all points of a point cloud as selected
        chosen = read_attribute(obj.data, SELECTION).astype(bool)
    if not chosen.any():
        raise PointCloudError(f'No points of "{obj.name}" are selected. Select some in Edit Mode.')
    return chosen


def select(context, obj, chosen) -> str:
    """Select these points, (n,) bool, and no others, in the mode that selects vertices; hidden ones never."""
    shown = chosen
    if obj.type == "MESH":
        hidden = np.empty(len(chosen), dtype=bool)
        obj.data.vertices.foreach_get("hide", hidden)
        shown = chosen & ~hidden
        context.tool_settings.mesh_select_mode = (True, False, False)  # in others Edit Mode deselects loose vertices
        obj.data.vertices.foreach_set("select", shown)
    else:
        write_attribute(obj.data, SELECTION, shown, "BOOLEAN")
    tag_changed(obj.data)
    return f"{np.count_nonzero(shown):,} of {len(shown):,} points are selected"


def analyzed(context, obj):
    """Read the points and return them with their operator, which is kept from the last analysis if nothing changed."""
    reading, operator = operator_reader(context, obj)
    with Stages(context.window_manager) as stages:
        return reading, operator(stages)


class MESHFREE_OT_select_grow(SelectionOperator, bpy.types.Operator):
    """Select all points within a distance along the surface from the selected ones"""

    bl_idname = "meshfree.select_grow"
    bl_label = "Grow Selection"

    distance: FloatProperty(
        name="Distance",
        description="How far the selection grows along the surface; 0 for four times the spacing of the points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )

    def change(self, context, obj):
        chosen = selected(obj)
        _, laplacian = analyzed(context, obj)
        distance = self.distance or 4.0 * np.sqrt(np.median(laplacian.areas))
        return select(context, obj, grow(laplacian, chosen, distance))


class MESHFREE_OT_select_component(SelectionOperator, bpy.types.Operator):
    """Select all points of the connected parts that hold selected points"""

    bl_idname = "meshfree.select_component"
    bl_label = "Select Connected Part"

    def change(self, context, obj):
        chosen = selected(obj)
        component = analyzed(context, obj)[1].component
        parts = np.unique(component[chosen & (component >= 0)])  # points left out belong to none
        return select(context, obj, chosen | np.isin(component, parts))


class FrontOnly:
    """The property of selecting operators that leaves out points on the far side."""

    direction: FloatVectorProperty(
        name="Viewing Direction",
        description="Direction in which one looks at the object; zero for that of the viewport",
        default=(0.0, 0.0, 0.0),
        subtype="XYZ",
    )

    def facing(self, context, obj):
        """Tell which points face the viewer by their normals, (n,) bool."""
        reading, laplacian = analyzed(context, obj)
        view = np.array(self.direction, dtype=np.float64)
        space = context.space_data.region_3d if context.area is not None and context.area.type == "VIEW_3D" else None
        if view.any():
            rays = view
        elif space is None:
            raise PointCloudError("There is no 3D viewport to look from. Give a viewing direction.")
        elif space.is_perspective:
            eye = np.array(space.view_matrix.inverted().translation) - np.array(obj.matrix_world.translation)
            rays = reading.points - eye
        else:
            rays = -np.array(space.view_matrix.inverted().col[2][:3])
        return np.einsum("ij,ij->i", laplacian.normals, np.broadcast_to(rays, reading.points.shape)) < 0.0


class MESHFREE_OT_select_front(SelectionOperator, FrontOnly, bpy.types.Operator):
    """Deselect the points whose normals point away from the viewer, which Box Select takes too"""

    bl_idname = "meshfree.select_front"
    bl_label = "Front Only"

    def change(self, context, obj):
        return select(context, obj, selected(obj) & self.facing(context, obj))


class MESHFREE_OT_group_from_selection(SelectionOperator, FrontOnly, bpy.types.Operator):
    """Put the selected points into a vertex group that the tools take, such as Handle or Anchor"""

    bl_idname = "meshfree.group_from_selection"
    bl_label = "Assign to Group"

    role: EnumProperty(
        name="Group",
        description="What the points are for",
        items=[
            ("HANDLE", "Handle", "Points that are moved to deform the rest"),
            ("ANCHOR", "Anchor", "Points that stay where they are"),
            ("FIXED", "Fixed", "The rim that a minimal surface keeps"),
            ("SOURCE", "Source", "Points from which distances are measured"),
            ("VALUE", "Value", "Points with given values of a field, as weights"),
        ],
        default="HANDLE",
    )
    name: StringProperty(name="Name", description="Name of the group; empty for that of its role", maxlen=63)
    action: EnumProperty(
        name="Action",
        description="What happens to points that the group holds already",
        items=[
            ("REPLACE", "Replace", "The group holds the selected points only"),
            ("ADD", "Add", "The selected points come to those that the group holds"),
            ("REMOVE", "Remove", "The selected points leave the group"),
        ],
        default="REPLACE",
    )
    weight: FloatProperty(
        name="Weight", description="Weight of the points in the group", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )
    front_only: BoolProperty(
        name="Front Only", description="Leave out points whose normals point away from the viewer", default=False
    )

    def change(self, context, obj):
        chosen = selected(obj)
        if self.front_only:
            chosen &= self.facing(context, obj)
            if not chosen.any():
                raise PointCloudError(
                    f'All selected points of "{obj.name}" face away from the viewer. Turn off Front Only, or look from'
                    " the other side."
                )
        name = self.name or self.role.title()
        assign(obj, name, chosen, self.action, self.weight)
        verb = {"REPLACE": "are in", "ADD": "were added to", "REMOVE": "were removed from"}[self.action]
        return f'{np.count_nonzero(chosen):,} points {verb} the group "{name}"'


def assign(obj, name: str, chosen, action="REPLACE", weight=1.0):
    """Change a group of points, made if there is none: let it hold some, (n,) bool, add them, or remove them."""
    (_assign_vertices if obj.type == "MESH" else _assign_points)(obj, name, chosen, action, weight)


def _assign_vertices(obj, name, chosen, action, weight):
    if name in obj.data.attributes:
        raise PointCloudError(
            f'"{obj.name}" has an attribute named "{name}", and vertex groups share their names. Choose another'
            " name, or rename the attribute."
        )
    group = obj.vertex_groups.get(name)
    if group is not None and group.lock_weight:
        raise PointCloudError(
            f'The vertex group "{name}" of "{obj.name}" is locked. Unlock it, or choose another name.'
        )
    if group is None and action == "REMOVE":
        raise PointCloudError(f'"{obj.name}" has no vertex group named "{name}" to remove points from. Choose another.')
    if group is None:
        group = obj.vertex_groups.new(name=name)
    if action == "REPLACE":
        group.remove(range(len(chosen)))
    members = np.flatnonzero(chosen).tolist()
    if action == "REMOVE":
        group.remove(members)
    else:
        group.add(members, weight, "REPLACE")
    obj.vertex_groups.active = group


def _assign_points(obj, name, chosen, action, weight):
    """Change the attribute of a point cloud that stands for a group."""
    exists = has_group(obj, name)
    if name in obj.data.attributes and not exists:
        raise PointCloudError(
            f'"{obj.name}" has an attribute named "{name}", which holds neither truth values nor numbers on points.'
            " Choose another name, or rename the attribute."
        )
    if not exists and action == "REMOVE":
        raise PointCloudError(f'"{obj.name}" has no group named "{name}" to remove points from. Choose another.')
    weights = group_weights(obj, name) if exists else np.zeros(len(chosen))
    if action == "REPLACE":
        weights[:] = 0.0
    weights[chosen] = 0.0 if action == "REMOVE" else weight
    weighted = (exists and obj.data.attributes[name].data_type == "FLOAT") or not np.isin(weights, (0.0, 1.0)).all()
    write_attribute(obj.data, name, weights, "FLOAT" if weighted else "BOOLEAN")
    tag_changed(obj.data)


CLASSES = (
    MESHFREE_OT_select_grow,
    MESHFREE_OT_select_component,
    MESHFREE_OT_select_front,
    MESHFREE_OT_group_from_selection,
)
