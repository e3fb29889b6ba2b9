"""The verbs of the command line that need Blender: weights of bones, which objects alone hold."""

from pathlib import Path

import bpy

from ...command.cloud_verb import SurfaceVerb
from ...command.reference_verbs import WithReference
from ...core import PointCloudError
from ..objects.attributes import point_count
from ..objects.place import place_of
from ..rigging.automatic import AutoWeights
from ..rigging.bones import followed_armature
from ..rigging.smoothing import SmoothWeights
from ..rigging.transfer_weights import TransferWeights
from ..running.application import compute_all
from . import blend
from .arguments import as_setting
from .objects import group_of

_LEFT_OUT = {"rna_type", "show", "reverse", "preview"}  # settings that files have no use for


class WeightVerb(SurfaceVerb):
    """A verb that runs a tool of Blender on an object, whose options are the settings of its operator."""

    outputs = (blend.ENDING,)

    def __init__(self, name, operator, tool):
        self.name, self.operator, self._tool = name, operator, tool
        rna = getattr(bpy.ops.meshfree, operator).get_rna_type()
        self.help = rna.description[0].lower() + rna.description[1:]
        self._items = [item for item in rna.properties if item.type != "POINTER"]
        self.settings = tuple(
            as_setting(item) for item in self._items if item.identifier not in _LEFT_OUT and not item.is_hidden
        )

    def read(self, path, arguments, option="object"):
        given = super().read(path, arguments, option)
        return given if given.owner is not None else blend.own(path.stem, given, arguments)

    def tool_of(self, obj, arguments):
        """Return the tool with the settings of the command line; groups are those of an object."""
        tool = self._tool()
        values = {item.identifier: item.default for item in self._items}
        values |= {name: value for name, value in vars(arguments).items() if name in values and value is not None}
        vars(tool).update(values | {"group": group_of(obj, values["group"])} if "group" in values else values)
        return tool

    def work(self, task):
        obj = task.given.owner.obj
        tool = self.tool_of(obj, task.arguments)
        self.prepare(tool, obj, task)
        results = compute_all(tool.plan_all(bpy.context, [obj]), task.progress)
        ((*notices, line),) = tool.write_all(bpy.context, [obj], results)
        if task.output is not None:
            task.given.owner.write(task.given, {}, {})
        return {"points": point_count(obj.data), "done": line, **self.figures(results[0])}, notices

    def prepare(self, tool, obj, task):
        """Give the tool what its settings do not include."""

    def figures(self, result) -> dict:
        """Return numbers to print beside the summary."""
        return {}


class WeightsFrom(WithReference, WeightVerb):
    """The verb `transfer-weights`."""

    use = "rigged object whose weights are taken"

    def __init__(self):
        super().__init__("transfer-weights", "transfer_weights", _WeightsFromFile)
        self.help = "weights of bones from the surface of the object of another file"

    def target(self, path, given):
        obj, self._told = given.owner.obj, given.notices
        source = self.tool_of(obj, self._own).source(bpy.context, obj, place_of(obj))
        return source._replace(name=str(path))

    def prepare(self, tool, obj, task):
        tool.given = self._target

    def work(self, task):
        figures, notices = super().work(task)
        return figures, [*self._told, *notices]

    def figures(self, result):
        return result.match.figures


class _WeightsFromFile(TransferWeights):
    """The tool with a source that is not in the scene, in the coordinates of the files."""

    given = None

    def sources(self, context, obj):
        return [self.given]

    @staticmethod
    def place(obj):
        return place_of(obj)


class Rig(WeightVerb):
    """The verb `rig`: Automatic Weights, with the armature of another file."""

    reads = ("armature",)

    def __init__(self):
        super().__init__("rig", "auto_weights", _AutoWeightsInFile)
        self.help = "weights of bones for points, meshes and splats, by an armature"

    def add_options(self, parser):
        parser.add_argument(
            "--armature",
            type=Path,
            default="",
            metavar="FILE",
            help=".blend file with the armature, in the coordinates that Blender shows the points in; else that of the"
            " input, a .blend file itself",
        )
        parser.add_argument(
            "--armature-object", default="", metavar="NAME", help="the armature's object, where the file has several"
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        others = [path for path in arguments.inputs if path.suffix.lower() != blend.ENDING]
        if others and arguments.armature == Path():
            parser.error(f"{others[0]} holds no armature: give --armature FILE")

    def prepare(self, tool, obj, task):
        path, name = task.arguments.armature, task.arguments.armature_object
        if path != Path():
            tool.armature = _append(path, name)
        else:
            followed = None if name else followed_armature(obj)
            there = sorted(each.name for each in bpy.context.scene.objects if _is_armature(each))
            tool.armature = followed or bpy.data.objects[_choose(task.path, there, name)]

    def figures(self, result):
        return {"bones": len(result.names), "bones_followed": int((result.weights > 0.0).any(axis=0).sum())}


class _AutoWeightsInFile(AutoWeights):
    """The same tool, with an armature that is not selected."""

    armature = None

    def armature_of(self, context):
        return self.armature


def make_verbs() -> list:
    """Return new verbs of all kinds."""
    return [Rig(), WeightVerb("smooth-weights", "smooth_weights", SmoothWeights), WeightsFrom()]


def _is_armature(obj):
    return obj.type == "ARMATURE"


def _choose(path, names, name):
    """Return the name of an armature of a file, among these."""
    chosen = [each for each in names if each == name or not name]
    if not names:
        raise PointCloudError(f"{path} has no armature. Give a .blend file with one.")
    if len(chosen) != 1:
        what = f'armature "{name}"' if name else "single armature"
        raise PointCloudError(f"{path} has no {what}. Name one with --armature-object: {', '.join(names)}.")
    return chosen[0]


def _append(path, name):
    """Append the armature of a file, with its parents, to the scene.

    First all objects are linked, which tells their types, and then only one is appended.
    """
    if path.suffix.lower() != ".blend" or not path.is_file():
        raise PointCloudError(f"{path} is no .blend file, or it is not there. Check its name and folder.")
    known = set(bpy.data.libraries)
    with bpy.data.libraries.load(str(path), link=True) as (found, wanted):
        wanted.objects = found.objects
    names = sorted(obj.name for obj in wanted.objects if obj is not None and _is_armature(obj))
    chosen = _choose(path, names, name)
    bpy.data.batch_remove(set(bpy.data.libraries) - known)
    with bpy.data.libraries.load(str(path)) as (_, wanted):
        wanted.objects = [chosen]
    [armature] = wanted.objects
    obj = armature
    while obj is not None:
        bpy.context.scene.collection.objects.link(obj)
        obj = obj.parent
    bpy.context.view_layer.update()
    return armature
