"""Verbs of the command line for armatures."""

from pathlib import Path

import bpy

from ...core import PointCloudError
from ..rigging.automatic import AutoWeights
from ..rigging.bones import followed_armature
from . import opening
from .verbs import Apply


class Rig(Apply):
    """The verb `rig`: Automatic Weights, with the armature of another file."""

    outputs = (".blend",)
    reads = ("armature",)

    def __init__(self):
        super().__init__("auto_weights", _AutoWeightsInFile)
        self.name = "rig"
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
        others = [path for path in arguments.inputs if path.suffix.lower() != ".blend"]
        if others and arguments.armature == Path():
            parser.error(f"{others[0]} holds no armature: give --armature FILE")

    def prepare(self, tool, obj, path, arguments):
        name = arguments.armature_object
        if arguments.armature != Path():
            tool.armature = _append(arguments.armature, name)
        else:
            own = None if name else followed_armature(obj)
            there = sorted(each.name for each in bpy.context.scene.objects if _is_armature(each))
            tool.armature = own or bpy.data.objects[_choose(path, there, name)]

    def save(self, tool, obj, output):
        opening.save(output, obj, {})
        return []

    def figures(self, tool, result):
        return {"bones": len(result.names), "bones_followed": int((result.weights > 0.0).any(axis=0).sum())}


class _AutoWeightsInFile(AutoWeights):
    """The same tool, with an armature that is not selected."""

    armature = None

    def armature_of(self, context):
        return self.armature


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
