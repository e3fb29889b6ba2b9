"""Selecting points and assigning them to groups, where Blender's tools need faces."""

from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, StringProperty
from bpy_extras import view3d_utils

from ... import core
from ...command.naming import naming
from ...core import PointCloudError
from ...core.linalg import det, pinv
from ...tools.groups import HANDLE, SOURCE
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import (
    DISC,
    SELECTION,
    has_vectors,
    own_positions,
    point_count,
    positions_now,
    read_attribute,
    tag_changed,
    write_attribute,
)
from ..objects.counting import renew_counts
from ..objects.groups import (
    assign,
    check_assignable,
    chosen_members,
    chosen_weights,
    group_weights,
    has_group,
    is_chosen,
    rivals,
)
from ..objects.handlers import notify
from ..objects.reading import obstacle, sharing_objects, spacing
from ..objects.splats import read_splats
from ..registration import Registration, Row
from ..running.application import compute_all, operator_reader
from ..running.job import JobOperator
from ..running.ready import ReadyOperator, reporting
from ..running.stages import Stages

_LOOSE = 2.0  # spacings: radius of points whose surface is not known, among which random ones leave few holes


class SelectionOperator(JobOperator):
    """An operator on the selected points of the active object, and of all others in Edit Mode with it.

    The Laplacian, which takes long, is computed in the background if started in a window; the rest follows when that is
    kept. A subclass has a method `prepare`, which computes for an object and returns a function that changes the object
    and returns a line for the status bar.
    """

    works_in = ("OBJECT", "EDIT")
    surface = True  # whether it needs the Laplacian
    needs_selection = True

    def invoke(self, context, event):
        return self.execute(context) if bpy.app.background or not self.surface else self.begin(context)

    @reporting
    def begin(self, context):
        """Compute the Laplacians in the background."""
        objects = edited_objects(context)
        with object_mode(context, context.object):
            objects = self.with_points(objects)
            plans = [(obj.name, operator_reader(context, obj)[1]) for obj in objects]
            return self.start(context, objects, lambda progress: compute_all(plans, progress))

    def complete(self, context, job):
        obj = job.snapshots[0].find()
        if job.reason or obj is None:
            return super().complete(context, job)
        with context.temp_override(object=obj, active_object=obj), object_mode(context, obj):
            return super().complete(context, job)

    def finish(self, context, objects, results):
        """Change the objects by their present selection: the Laplacians are kept."""
        return self.change(context, objects)

    def execute(self, context):
        return self.change(context, edited_objects(context))

    @reporting
    def change(self, context, objects):
        """Compute for all objects, then change all."""
        with object_mode(context, context.object):
            objects, changes = self.with_points(objects), []
            for obj in objects:
                with naming(obj.name):
                    changes.append(self.prepare(context, obj))
            with all_or_nothing([other for obj in objects for other in (obj, *sharing_objects(obj))]):
                messages = [change() for change in changes]
        for obj, message in zip(objects, messages, strict=True):
            self.report({"INFO"}, f"{obj.name}: {message}")
        return {"FINISHED"}

    def with_points(self, objects):
        """Leave out objects without selected points, if these are needed and others have some."""
        if not self.needs_selection:
            return objects
        return [obj for obj in objects if selection(obj).any()] or objects[:1]


def edited_objects(context):
    """Return the active object, and the others that are in Edit Mode with it."""
    active = context.object
    found = {active.data: active}
    if active.mode == "EDIT":
        for obj in context.view_layer.objects:
            if obj.mode == "EDIT" and not obstacle(obj, ("EDIT",)):
                found.setdefault(obj.data, obj)
    return list(found.values())


@contextmanager
def object_mode(context, obj):
    """Leave Edit Mode, where vertices cannot be read as arrays, or Weight Paint; return with the same objects."""
    mode = obj.mode
    if mode not in ("EDIT", "WEIGHT_PAINT"):
        yield
        return
    others = [other for other in context.view_layer.objects if other != obj]
    edited = [other for other in others if other.mode == "EDIT"]
    chosen = [other for other in others if other.select_get()]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        for other in others:  # selected ones enter Edit Mode too
            other.select_set(other in edited)
        bpy.ops.object.mode_set(mode=mode)
        for other in others:
            other.select_set(other in chosen)


def selection(obj):
    """Read which points are selected, (n,) bool."""
    chosen = np.ones(point_count(obj.data), dtype=bool)
    if obj.type == "MESH":
        obj.data.vertices.foreach_get("select", chosen)
    elif SELECTION in obj.data.attributes:  # without it all points of a point cloud count as selected
        chosen = read_attribute(obj.data, SELECTION).astype(bool)
    return chosen


def selected_now(obj):
    """Read which points are selected in Edit Mode, (n,) bool."""
    if obj.type != "MESH":
        return selection(obj)
    points = bmesh.from_edit_mesh(obj.data).verts
    return np.fromiter((point.select for point in points), bool, count=len(points))


def selected(obj):
    """Read which points are selected, (n,) bool; at least one is."""
    chosen = selection(obj)
    if not chosen.any():
        raise PointCloudError(f'No points of "{obj.name}" are selected. Select some in Edit Mode.')
    return chosen


def selected_ends(obj):
    """Return the two points that are selected, between which a path leads, (2,) int."""
    ends = np.flatnonzero(selected(obj))
    if len(ends) != 2:
        raise PointCloudError(
            f'{len(ends):,} points of "{obj.name}" are selected. Select the two between which the path leads.'
        )
    return ends


def read_sources(obj, group):
    """Read the points of a group or, if the default one is missing, the selected ones, (n,) bool."""
    return chosen_members(obj, group, "Sources") if is_chosen(obj, group, SOURCE) else selected(obj)


def select(context, obj, chosen) -> str:
    """Select these points, (n,) bool, and no others, without hidden ones, in vertex mode."""
    shown = chosen
    if obj.type == "MESH":
        hidden = np.empty(len(chosen), dtype=bool)
        obj.data.vertices.foreach_get("hide", hidden)
        shown = chosen & ~hidden
        context.tool_settings.mesh_select_mode = (True, False, False)  # other modes deselect loose vertices
        obj.data.vertices.foreach_set("select", shown)
        for parts in (obj.data.edges, obj.data.polygons):  # Edit Mode selects their vertices, too
            parts.foreach_set("select", np.zeros(len(parts), dtype=bool))
    else:
        write_attribute(obj.data, SELECTION, shown, "BOOLEAN")
    tag_changed(obj.data)
    return f"{np.count_nonzero(shown):,} of {len(shown):,} points are selected"


def groups_changed(obj):
    """Update the counts of groups in the panel, and their colors in the display."""
    renew_counts(obj)
    notify("groups_changed", obj)


def analyzed(context, obj):
    """Read the points and return them with their Laplacian, kept from the last analysis if nothing changed."""
    reading, operator = operator_reader(context, obj)
    with Stages(context.window_manager, "Points") as stages:
        return reading, operator(stages)


class MESHFREE_OT_select_grow(SelectionOperator, bpy.types.Operator):
    """Select all points within a distance along the surface from the selected ones"""

    bl_idname = "meshfree.select_grow"
    bl_label = "Grow Selection"
    asks = ("distance",)
    at_zero = {"distance": "Automatic"}

    distance: FloatProperty(
        name="Distance",
        description="How far the selection grows along the surface; 0 for four times the spacing of the points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )

    def prepare(self, context, obj):
        chosen = selected(obj)
        _, laplacian = analyzed(context, obj)
        distance = self.distance or 4.0 * np.sqrt(np.median(laplacian.areas))
        grown = core.distance.grow(laplacian, chosen, distance)
        return lambda: select(context, obj, grown)


class MESHFREE_OT_select_component(SelectionOperator, bpy.types.Operator):
    """Select all points of the components that hold selected points"""

    bl_idname = "meshfree.select_component"
    bl_label = "Select Component"

    def prepare(self, context, obj):
        chosen = selected(obj)
        component = analyzed(context, obj)[1].component
        found = np.unique(component[chosen & (component >= 0)])  # -1 for points left out
        return lambda: select(context, obj, chosen | np.isin(component, found))


class OnSurface:
    """The property of operators that leave out points behind the surface, as seen from the view."""

    direction: FloatVectorProperty(
        name="Viewing Direction",
        description="Direction of view; zero for that of the viewport",
        default=(0.0, 0.0, 0.0),
        subtype="XYZ",
    )

    def seen(self, context, obj, chosen):
        """Return which of the chosen points of an object are seen, (n,) bool: not hidden, clipped or behind others."""
        world, data = np.array(obj.matrix_world), obj.data
        points = own_positions(data) @ world[:3, :3].T + world[:3, 3]
        view, eye = self._view(context)
        points[_hidden(obj)] = np.nan
        if eye is not None or not any(self.direction):
            points[_clipped(context.space_data.region_3d, points)] = np.nan
        scale = np.cbrt(abs(det(world[:3, :3])))
        radii, normals = np.full(len(points), _LOOSE), None
        if has_vectors(data, DISC):
            discs = read_attribute(data, DISC)
            reach = np.linalg.norm(discs, axis=1)
            radii = np.where(reach > 0.0, reach * obj.meshfree.point_size, _LOOSE)
            normals = discs @ pinv(world[:3, :3])
        radii *= scale * (obj.meshfree.spacing or spacing(data))
        return core.distance.seen_points(points, radii, view, eye, normals, chosen)

    def _view(self, context):
        """Return the direction of view, and the eye of a perspective one, in the world."""
        if any(self.direction):
            return np.array(self.direction, dtype=np.float64), None
        if context.area is None or context.area.type != "VIEW_3D":
            raise PointCloudError("There is no 3D viewport to look from. Give a viewing direction.")
        region = context.space_data.region_3d
        placed = np.array(region.view_matrix.inverted())
        return -placed[:3, 2], placed[:3, 3] if region.is_perspective else None


def _clipped(region, points):
    """Return which points in the world a view cuts off by its clipping region, (n,) bool."""
    if not region.use_clip_planes:
        return np.zeros(len(points), dtype=bool)
    planes = np.array([list(plane) for plane in region.clip_planes[:4]])
    return (points @ planes[:, :3].T + planes[:, 3] <= 0.0).any(axis=1)


class MESHFREE_OT_select_front(SelectionOperator, OnSurface, bpy.types.Operator):
    """Deselect points behind the surface, which are not seen from the view and which Box Select selects too"""

    bl_idname = "meshfree.select_front"
    bl_label = "Select on Surface"
    surface = False

    def prepare(self, context, obj):
        front = self.seen(context, obj, selected(obj))
        return lambda: select(context, obj, front)


class MESHFREE_OT_group_from_selection(SelectionOperator, OnSurface, bpy.types.Operator):
    """Assign the selected points to a group that the tools use, such as Handle or Anchor"""

    bl_idname = "meshfree.group_from_selection"
    bl_label = "Assign to Group"
    surface = False

    role: EnumProperty(
        name="Group",
        description="What the points are for",
        items=[
            ("HANDLE", "Handle", "Points that are moved to deform the rest"),
            ("ANCHOR", "Anchor", "Points that stay where they are"),
            ("FIXED", "Fixed", "The boundary that a minimal surface keeps"),
            ("SOURCE", "Source", "Points from which distances are measured"),
            ("LOW", "Low", "Points with the low value of a field, at one end"),
            ("HIGH", "High", "Points with the high value of a field, at the other end"),
            ("VALUE", "Value", "Points with given values of a field, as weights"),
            ("BOUNDARY", "Boundary", "Points at which the surface ends; it becomes the Boundary Group of the settings"),
        ],
        default="HANDLE",
    )
    name: StringProperty(name="Name", description="Name of the group; empty for that of its role", maxlen=63)
    action: EnumProperty(
        name="Action",
        description="Whether to replace, add to or remove from the points of the group",
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
        name="On Surface", description="Leave out points behind the surface, as seen from the view", default=False
    )

    @classmethod
    def description(cls, context, properties):
        """Return the tooltip of a button; empty for that of the class."""
        return {
            "ADD": "Add the selected points to the group, which keeps those that it holds",
            "REMOVE": "Remove the selected points from the group",
        }.get(properties.action, "")

    def prepare(self, context, obj):
        chosen = selected(obj)
        if self.front_only:
            chosen = self.seen(context, obj, chosen)
            if not chosen.any():
                raise PointCloudError(
                    f'No selected points of "{obj.name}" are seen from the view. Turn off On Surface, or view them from'
                    " the other side."
                )
        role = self.role.title()
        name = self.name or role
        check_assignable(obj, name, must_exist=self.action == "REMOVE")
        others = rivals(obj, role) if name == role and self.action != "REMOVE" else []
        for other in others:
            check_assignable(obj, other, must_exist=True)
        gone = _replaced(obj, name, chosen) if self.action == "REPLACE" else 0

        def change():
            for other in others:
                assign(obj, other, chosen, "REMOVE", 1.0)
            assign(obj, name, chosen, self.action, self.weight)
            groups_changed(obj)
            if self.role == "BOUNDARY" and self.action != "REMOVE":
                obj.meshfree.boundary_group = name
            done = {"REPLACE": "are in", "ADD": "were added to", "REMOVE": "were removed from"}[self.action]
            left = f", in place of {gone:,} others" if gone else ""
            return f'{np.count_nonzero(chosen):,} points {done} the group "{name}"{left}'

        return change


def _replaced(obj, name, chosen):
    """Count the points of a group that are not chosen, (n,) bool."""
    return np.count_nonzero(np.isfinite(group_weights(obj, name, np.nan)) & ~chosen) if has_group(obj, name) else 0


class MESHFREE_OT_select_point(ReadyOperator, bpy.types.Operator):
    """Select the frontmost point under the mouse"""

    bl_idname = "meshfree.select_point"
    bl_label = "Select Point"
    works_in = ("EDIT",)

    eye: FloatVectorProperty(name="Eye", description="Where the ray begins, in the world", subtype="XYZ")
    direction: FloatVectorProperty(
        name="Viewing Direction", description="Direction of the ray", default=(0.0, 0.0, -1.0), subtype="XYZ"
    )
    extend: BoolProperty(
        name="Extend",
        description="Keep the selection, and deselect the point if it is selected",
        default=False,
        options={"SKIP_SAVE"},
    )

    def invoke(self, context, event):
        """Use the ray under the mouse; pass through where Blender's own selection is better, or without a point."""
        if not _is_opaque_cloud(context):
            return {"PASS_THROUGH"}
        place = event.mouse_region_x, event.mouse_region_y
        self.eye = view3d_utils.region_2d_to_origin_3d(context.region, context.region_data, place)
        self.direction = view3d_utils.region_2d_to_vector_3d(context.region, context.region_data, place)
        found = self.find(context)
        return {"PASS_THROUGH"} if found is None else self.take(context, *found)

    @reporting
    def execute(self, context):
        found = self.find(context)
        if found is None:
            raise PointCloudError("No point is seen along the ray. Aim at the surface.")
        return self.take(context, *found)

    def take(self, context, obj, index):
        """Select a point of an object, or deselect it if it extends the selection and is selected."""
        for other in edited_objects(context):
            known = selection(other)  # up to date, since `find` has read the points
            wanted = known & self.extend
            if other == obj:
                wanted[index] = not wanted[index]
            _put_selection(other, known, wanted)
        return {"FINISHED"}

    def find(self, context):
        """Return the object and the index of the point in front, or None."""
        eye, direction = np.array(self.eye, dtype=np.float64), np.array(self.direction, dtype=np.float64)
        found = []
        for obj in edited_objects(context):
            matrix = np.array(obj.matrix_world)
            points = positions_now(obj) @ matrix[:3, :3].T + matrix[:3, 3]
            points[_hidden(obj)] = np.nan
            known = obj.meshfree.spacing * np.cbrt(abs(det(matrix[:3, :3])))  # where a display measured it
            index = core.distance.front_point(
                points, eye, direction, 2.0 * (known or core.geometry.typical_distance(points))
            )
            if index >= 0:
                found.append(((points[index] - eye) @ direction, obj.name, obj, index))
        return min(found)[2:] if found else None


def _is_opaque_cloud(context):
    """Whether the view shows points of clouds, without X-ray."""
    space = context.space_data
    if space is None or space.type != "VIEW_3D" or context.region_data is None:
        return False
    if sees_through(space.shading):
        return False
    meshes = [bmesh.from_edit_mesh(obj.data) for obj in edited_objects(context) if obj.type == "MESH"]
    return not meshes or (context.tool_settings.mesh_select_mode[0] and not any(len(mesh.edges) for mesh in meshes))


def sees_through(shading) -> bool:
    """Whether a view with some shading has X-ray on."""
    if shading.type == "WIREFRAME":
        return shading.show_xray_wireframe
    return shading.type == "SOLID" and shading.show_xray


def _put_selection(obj, known, wanted):
    """Set the selection of an object in Edit Mode, (n,) bool, where it changes."""
    if obj.type != "MESH":
        write_attribute(obj.data, SELECTION, wanted, "BOOLEAN")
        tag_changed(obj.data)
        return
    edited = bmesh.from_edit_mesh(obj.data)
    edited.verts.ensure_lookup_table()
    for index in np.flatnonzero(known != wanted).tolist():
        edited.verts[index].select_set(bool(wanted[index]))
        if wanted[index]:
            edited.select_history.add(edited.verts[index])
    bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)


def _hidden(obj):
    """Read which points are hidden, (n,) bool, after `positions_now`."""
    hidden = np.zeros(point_count(obj.data), dtype=bool)
    if obj.type == "MESH":
        obj.data.vertices.foreach_get("hide", hidden)
    return hidden


class MESHFREE_OT_select_boundary(SelectionOperator, bpy.types.Operator):
    """Select the boundary points of the surface, as detected or named by the Boundary Group"""

    bl_idname = "meshfree.select_boundary"
    bl_label = "Select Boundary"
    needs_selection = False

    def prepare(self, context, obj):
        boundary = analyzed(context, obj)[1].boundary
        if not boundary.any():
            raise PointCloudError(
                f'"{obj.name}" has no boundary: its surface is closed, or Boundary is off in the settings.'
            )
        return lambda: select(context, obj, boundary)


class MESHFREE_OT_select_floaters(SelectionOperator, bpy.types.Operator):
    """Select Gaussian splats that belong to no surface: nearly transparent, huge or isolated"""

    bl_idname = "meshfree.select_floaters"
    bl_label = "Select Floaters"
    needs_selection = False
    surface = False

    def prepare(self, context, obj):
        chosen = core.splats.floaters(read_splats(obj.data))
        if not chosen.any():
            raise PointCloudError(f'None of the {len(chosen):,} splats of "{obj.name}" is a floater.')
        return lambda: select(context, obj, chosen)


class MESHFREE_OT_select_group(SelectionOperator, bpy.types.Operator):
    """Select the points of a group that the tools use"""

    bl_idname = "meshfree.select_group"
    bl_label = "Select Group"
    needs_selection = False
    surface = False

    name: StringProperty(name="Name", description="Name of the group", default=HANDLE, maxlen=63)

    def prepare(self, context, obj):
        chosen = np.isfinite(chosen_weights(obj, self.name, "Name", least=0, outside=np.nan))
        if not chosen.any():
            raise PointCloudError(f'"{self.name}" of "{obj.name}" holds no points. Assign some to it in Edit Mode.')
        return lambda: select(context, obj, chosen)


TOOLS = (
    Registration(MESHFREE_OT_select_point),
    Registration(
        MESHFREE_OT_select_grow,
        panel=Row("Select", 1, 1),
        menu=Row("Points", 1, 1),
        quick=Row("Points", 1, 1),
    ),
    Registration(
        MESHFREE_OT_select_component,
        panel=Row("Select", 1, 2),
        menu=Row("Points", 1, 2),
        quick=Row("Points", 1, 2),
    ),
    Registration(
        MESHFREE_OT_select_front,
        panel=Row("Select", 1, 3),
        menu=Row("Points", 1, 3),
        quick=Row("Points", 1, 3),
    ),
    Registration(MESHFREE_OT_select_boundary, panel=Row("Select", 1, 4), menu=Row("Points", 1, 4)),
    Registration(MESHFREE_OT_select_floaters, panel=Row("Splats", 1, 2), menu=Row("Points", 1, 6)),
    Registration(MESHFREE_OT_select_group),
    Registration(MESHFREE_OT_group_from_selection),
)
