"""Blender's operators of the tools that `tools/` declares."""

import bpy
import numpy as np
from bpy.props import StringProperty

from ... import core
from ...command.naming import naming
from ...tools.groups import check_vectors
from ...tools.listed import listed_tools
from ...tools.settings import by_name
from ...tools.tool import MovingTool, PointTool
from ..objects.attributes import read_attribute, tag_changed
from ..objects.curves import read_curve
from ..objects.deleting import check_deletable, keep_points
from ..objects.groups import chosen_weights, group_kind, has_group
from ..objects.options import default_options
from ..objects.place import place_of
from ..objects.positions import check_movable, target_property, write_positions
from ..objects.properties import properties_of, values_of
from ..objects.reading import local_values
from ..objects.result import length_text, write_numbers, write_values
from ..objects.splats import has_splats
from ..registration import Registration
from ..running import cache
from ..running.application import ApplicationOperator, ShownOperator, Tool, operator_reader
from ..running.discs import disc_finder
from .select import SelectionOperator, read_sources, selected_ends

_CURVE = StringProperty(
    name="Curve",
    description="Curve object on the surface; each of its points is replaced by the nearest one of the cloud",
)


class ObjectCloud:
    """The points of an object as a tool reads them; see `tools.tool.Cloud`."""

    in_blender = True

    def __init__(self, context, obj, operator, reading, build):
        self.obj, self._context, self._operator, self._build, self._reading = obj, context, operator, build, reading
        self.name, self.where, self.kind = obj.name, f'"{obj.name}"', group_kind(obj)
        self.points, self.out = reading.points, cache.floating(reading.splats)
        self.place, self.orientation = place_of(obj), reading.orientation
        self.heights_from = np.array(obj.matrix_world.translation)
        self.repeats = operator.is_repeated(context)
        self.boundary, self.options = reading.boundary, default_options(obj.meshfree)

    def named(self, setting):
        """Return the label of a setting."""
        return by_name(self._operator.tool.settings)[setting].title

    def has_group(self, name):
        """Whether the object has a group of some name."""
        return has_group(self.obj, name)

    def has_numbers(self, name):
        """Whether the object has an attribute of some name."""
        return name in self.obj.data.attributes

    def weights(self, setting, name, least=1, outside=0.0):
        """Return the weights of the group that a setting names, (n,)."""
        return chosen_weights(self.obj, name, self.named(setting), least, outside)

    def numbers(self, setting, name):
        """Return the values of the attribute that a setting names."""
        return read_attribute(self.obj.data, name)

    def vectors(self, setting, name, places):
        """Return the vectors of the attribute that a setting names, (n, 3), from local space, as are places."""
        vectors = check_vectors(read_attribute(self.obj.data, name), name, self.where)
        return self._reading.placed(vectors.astype(np.float64))

    def viewpoint(self):
        """Return where the object that the operator names, or the scene's camera, is, (3,)."""
        scene, name = self._context.scene, self._operator.viewpoint
        found = scene.objects.get(name) if name else scene.camera
        if found is None:
            missing = f'The scene has no object "{name}"' if name else "The scene has no camera"
            raise core.PointCloudError(f"{missing} to orient normals to. Choose an object as Viewpoint.")
        return np.array(found.matrix_world.translation - self.obj.matrix_world.translation, dtype=np.float64)

    def sources(self, name):
        """Return the points of a group or, if the default one is missing, the selected ones, (n,) bool."""
        return read_sources(self.obj, name)

    def curve(self):
        """Return the points of the curve that the operator names, (k, 3), as points are read, and if it is closed."""
        places, closed = read_curve(self._context, self._operator.curve)
        return places - self.heights_from, closed

    def ends(self):
        """Return the two selected points, (2,) int, which lie where they are wanted."""
        return selected_ends(self.obj), np.zeros(2)

    def laplacian(self, progress):
        """Return the operator."""
        with naming(self.name):
            return self._build(progress)

    def reference(self):
        """Return the cloud of the object that the operator names, and the offset of its points."""
        other = self._operator.reference_of(self._context)
        with naming(other.name):
            cloud = ObjectCloud(self._context, other, self._operator, *operator_reader(self._context, other))
        # Points are read without the location of their objects.
        return cloud, self.heights_from - cloud.heights_from


class Declared(Tool):
    """The work of a declared tool on objects, by settings that are its attributes."""

    tool = None

    @property
    def last(self):
        """Names of settings that the tool does not declare."""
        return ("show",) if self.tool.shows else ()

    @property
    def asks(self):
        """Names of the settings in the dialog."""
        curve = ("curve",) if "curve" in self.tool.reads else ()
        asked = *curve, *self.tool.asks(self), *[setting.name for setting in self.tool.showing]
        return (*asked, *self.last) if asked else ()

    @property
    def adjustable(self):
        """Names of the settings in Adjust Last Operation."""
        return *self.tool.adjustable(self), *[setting.name for setting in self.tool.showing], *self.last

    @property
    def writes(self):
        """Names of the attributes."""
        return self.tool.writes(self)

    @property
    def shown(self):
        """Name of the attribute to show."""
        return self.tool.shown(self)

    def own(self):
        """Return the values of the settings as attributes."""
        return values_of(self, self.tool.settings)

    def inputs(self, cloud, own):
        """Return what the tool takes beside the points."""
        return self.tool.inputs(cloud, own)

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        tool, own = self.tool, self.own()
        inputs = self.inputs(ObjectCloud(context, obj, self, reading, operator), own)

        def compute(progress):
            laplacian = operator(progress)
            work = lambda: tool.compute(laplacian, inputs, own, progress)  # noqa: E731
            return laplacian.kept.result(tool.name, work, tool.key(own), inputs), laplacian, own, reading

        return compute

    def write(self, context, obj, result):
        found, subject, own, *_ = result
        outcome = self.tool.finish(found, subject, own, length_text)
        self.store(context, obj, outcome, result)
        write_numbers(obj, outcome.numbers)
        return [f"{obj.name}: {text}" for text in (*outcome.notices, outcome.line)]

    def store(self, context, obj, outcome, result):
        """Write what is at the points."""
        reading = result[3]
        local = {name: local_values(reading, name, values) for name, values in outcome.values.items()}
        write_values(obj.data, local)
        tag_changed(obj.data)


class Pointwise(Declared):
    """The work of a declared tool that needs the points of objects alone."""

    def plan(self, context, obj):
        if self.tool.deletes:
            check_deletable(obj)
        (reading, operator), tool, own = operator_reader(context, obj), self.tool, self.own()
        inputs = self.inputs(ObjectCloud(context, obj, self, reading, operator), own)
        return lambda progress: (tool.compute(reading.points, inputs, own, progress), reading.points, own, reading)

    def store(self, context, obj, outcome, result):
        super().store(context, obj, outcome, result)
        if outcome.kept is not None and not outcome.kept.all():
            keep_points(context, obj, outcome.kept)


class Moving(Declared):
    """The work of a declared tool that moves the points of objects."""

    last = ("target",)

    target: target_property()

    @property
    def goal(self):
        """Where the result is written."""
        return self.target

    def plan(self, context, obj):
        check_movable(obj, self.goal)
        planned, carried, tool = super().plan(context, obj), self.carries(obj), self.tool
        find_discs = disc_finder(obj)

        def compute(progress):
            found, laplacian, own, reading = planned(progress)
            points = tool.moved(found, laplacian, own)
            gradients = core.deform.deformation_gradients(laplacian, points) if carried else None
            shape = tool.shape(found)
            discs = None if shape is None else find_discs(reading, shape, points)
            return found, laplacian, own, reading, gradients, discs

        return compute

    def carries(self, obj):
        """Whether something turns with the points, such as splats."""
        return has_splats(obj.data)

    def store(self, context, obj, outcome, result):
        found, _, _, reading, gradients, discs = result
        if outcome.points is not None:
            title = self.tool.title(found)
            self.put(context, write_positions(obj, reading, outcome.points, self.goal, title, gradients, discs))

    def put(self, context, key):
        """Finish with the shape key that holds the result, if there is one."""


def operator_of(tool, *mixins):
    """Return the class of Blender's operator of a tool, not yet registered.

    `mixins` come before its own bases, and their properties and texts in place of those of the same settings.
    """
    properties = properties_of((*tool.settings, *tool.showing))
    if "curve" in tool.reads:
        properties["curve"] = _CURVE
    work = Moving if isinstance(tool, MovingTool) else Pointwise if isinstance(tool, PointTool) else Declared
    applied = ShownOperator if tool.shows else ApplicationOperator
    bases = work, SelectionOperator if tool.menu is not None and tool.menu.home == "Points" else applied
    at_zero = {setting.name: setting.at_zero for setting in tool.settings if setting.at_zero}
    for mixin in mixins:
        properties |= mixin.__annotations__
        at_zero |= getattr(mixin, "at_zero", {})
    declared = type(
        f"MESHFREE_OT_{tool.name}",
        (*mixins, *bases, bpy.types.Operator),
        {
            "__doc__": tool.help,
            "__module__": __name__,
            "__annotations__": properties,
            "bl_idname": f"meshfree.{tool.name}",
            "bl_label": tool.label,
            "at_zero": at_zero,
            "keeps_line": tool.keeps_line,
            "tool": tool,
        },
    )
    return declared


def registration_of(tool, *mixins):
    """Return the registration of a tool with its rows."""
    return Registration(operator_of(tool, *mixins), panel=tool.panel, menu=tool.menu, quick=tool.quick)


TOOLS = tuple(registration_of(tool) for tool in listed_tools() if not tool.extended)
