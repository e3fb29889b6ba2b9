"""Convert meshes to point clouds and back, with all data of this extension."""

import re
from contextlib import contextmanager

import bpy
from bpy.props import EnumProperty

from ...core import PointCloudError
from ...tools.groups import ROLES
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import SELECTION, point_count, remove_attributes, write_attribute
from ..objects.counting import renew_counts
from ..objects.evaluated import POINTCLOUDS_SINCE, shown_as_own, shown_points
from ..objects.groups import add_group, group_weights, handle_names, has_group
from ..objects.modifiers import inputs_of, is_display, put_inputs, set_input
from ..objects.place import activate
from ..objects.result import check_writable
from ..registration import Registration
from ..running.application import chosen_objects
from ..running.ready import ReadyOperator, reporting
from .select import selection

_SEGMENT = re.compile(r"Segment \d+")


class MESHFREE_OT_convert(ReadyOperator, bpy.types.Operator):
    """Convert a mesh to a point cloud or back, and keep groups, results and colors; modifiers are applied"""

    bl_idname = "meshfree.convert"
    bl_label = "Convert Points"
    since = POINTCLOUDS_SINCE

    target: EnumProperty(
        name="To",
        description="What the objects become",
        items=[
            ("POINTCLOUD", "Point Cloud", "An object of points alone, whose groups are attributes"),
            ("MESH", "Mesh", "A mesh of vertices alone, whose groups are vertex groups"),
        ],
        default="POINTCLOUD",
    )

    @classmethod
    def lack(cls, context, obj):
        return "Meshes become point clouds from Blender 4.5 on" if bpy.app.version < cls.since else ""

    @reporting
    def execute(self, context):
        objects = chosen_objects(context, lambda obj: obj.meshfree.make_single_user)[0]
        objects = [obj for obj in objects if obj.type != self.target]
        if not objects:
            kind = "point cloud" if self.target == "POINTCLOUD" else "mesh"
            raise PointCloudError(f'"{context.object.name}" is a {kind} already.')
        for obj in objects:
            check_convertible(obj)
        for line in convert(context, objects, self.target):
            self.report({"INFO"}, line)
        return {"FINISHED"}


def convert(context, objects, target) -> list:
    """Convert objects for which `check_convertible` holds, all or none, and return a line for each."""
    shown = context.view_layer.objects
    active, chosen = shown.active and shown.active.name, [obj.name for obj in context.selected_objects]
    kept = {obj: obj.copy() for obj in objects}
    try:
        with all_or_nothing([]):
            lines, left = _convert_all(context, kept, target)
        bpy.data.batch_remove([*kept.values(), *left])
    finally:
        for obj in shown:
            obj.select_set(obj.name in chosen)
        shown.active = shown[active] if active else None
    return lines


def _convert_all(context, kept, target):
    """Convert objects, and return lines, and data that become unused; if it fails, replace them by the copies."""
    names, left, lines = [obj.name for obj in kept], {obj.data for obj in kept}, []
    try:
        for obj in kept:
            if obj.meshfree.make_single_user and obj.data.users > 2:  # one of them is the copy
                obj.data = obj.data.copy()
            left.add(obj.data)
            made = _convert(context, obj, target)
            lines.append(f"{obj.name}: {point_count(obj.data):,} points are a {obj.type.lower()} now{made}")
        used = {obj.data for obj in bpy.data.objects if obj not in kept.values()}
        return lines, [data for data in left if data not in used and not data.use_fake_user]
    except BaseException:
        for obj, copy in kept.items():
            obj.user_remap(copy)
        bpy.data.batch_remove(kept)
        for copy, name in zip(kept.values(), names, strict=True):
            copy.name = name
        raise


def check_convertible(obj):
    """Refuse an object that would lose data."""
    check_writable(obj, (), obj.meshfree.make_single_user)
    if obj.meshfree.deform.is_bound:
        raise PointCloudError(f'"{obj.name}" is bound, which would be lost. Apply or unbind it first.')
    if not obj.visible_get():
        raise PointCloudError(f'"{obj.name}" is hidden, and Blender converts what is seen. Show it first.')


def _convert(context, obj, target):
    """Convert an object by Blender's operator, which converts selected ones, and keep what that loses.

    Return a text on which points these are, if nodes generated them.
    """
    groups = {name: group_weights(obj, name) for name in _group_names(obj)}
    chosen, count = selection(obj), point_count(obj.data)
    display = _take_display(obj)  # which Blender would apply
    activate(context, obj)
    with _points_of_nodes(context, obj) as made:
        bpy.ops.object.convert(target=target)
    if not point_count(obj.data):
        raise PointCloudError(f'The modifiers of "{obj.name}" show no points. Remove or change them, and convert then.')
    data, same = obj.data, point_count(obj.data) == count
    if same and target == "POINTCLOUD":
        write_attribute(data, SELECTION, chosen, "BOOLEAN")
    elif same:
        data.vertices.foreach_set("select", chosen)
        remove_attributes(data, SELECTION, *groups)
        for name, weights in groups.items():
            add_group(obj, name, weights)
    _put_display(obj, display)
    renew_counts(obj)
    return made


@contextmanager
def _points_of_nodes(context, obj):
    """Convert points generated by nodes to the object's own type, for Blender's operator; yield which there are.

    Instances are used only where there is nothing else: beside points they are the shapes shown at these.
    """
    context.view_layer.update()
    shown = shown_points(context, obj)
    own = shown._replace(instances=0)
    left = f"; {shown.instances:,} points of instances are left out" if sum(own) and shown.instances else ""
    other = shown.points if obj.type == "MESH" else shown.vertices
    if not other and (sum(own) or not shown.instances):
        yield left
        return
    with shown_as_own(obj, with_instances=not sum(own)):
        yield f": {own if sum(own) else shown}{left}"


def _group_names(obj):
    """Return the names of the groups of tools and of segments."""
    settings = obj.meshfree
    names = set(ROLES)
    names |= {*handle_names(obj), settings.deform.anchors, settings.boundary_group}
    kept = obj.vertex_groups if obj.type == "MESH" else obj.data.attributes
    names |= {group.name for group in kept if _SEGMENT.fullmatch(group.name)}
    return [name for name in names if name and has_group(obj, name)]


def _take_display(obj):
    """Remove the display modifier of an object, and return its state."""
    modifier = next((item for item in obj.modifiers if is_display(item)), None)
    if modifier is None:
        return None
    kept = modifier.name, modifier.node_group, inputs_of(modifier)
    set_input(modifier, "Material", None)  # Blender 5.2 would go on counting it as used
    obj.modifiers.remove(modifier)
    return kept


def _put_display(obj, display):
    if display is None:
        return
    name, group, inputs = display
    modifier = obj.modifiers.new(name, "NODES")
    modifier.node_group = group
    modifier.use_pin_to_last = True
    put_inputs(modifier, inputs)


TOOLS = (Registration(MESHFREE_OT_convert),)
