"""Verbs of the command line that transfer from the object of one file to those of others."""

from typing import NamedTuple

import bpy

from ..objects.colors import own_colors
from ..objects.place import place_of
from ..rigging.transfer import Source
from ..rigging.transfer_attributes import TransferAttributes
from ..rigging.transfer_weights import TransferWeights
from . import objects as files
from . import opening
from .tool_verbs import WithReference
from .verbs import LEFT_OUT


class _Reference(NamedTuple):
    source: Source
    notices: list


class _TransferFrom(WithReference):
    """A tool that takes values from an object of another file, read once."""

    left_out = LEFT_OUT | {"reverse", "preview"}

    def _read(self, arguments):
        obj, notices = self.open(arguments.reference, "reference_object", arguments)
        tool = self.tool_of(obj, arguments)
        return _Reference(tool.source(bpy.context, obj, place_of(obj))._replace(name=str(arguments.reference)), notices)

    def prepare(self, tool, obj, path, arguments):
        tool.given = self._reference.source

    def figures(self, tool, result):
        return result.match.figures


class WeightsFrom(_TransferFrom):
    """The verb `transfer-weights`."""

    outputs = (".blend",)
    use = "rigged object whose weights are taken"

    def __init__(self):
        super().__init__("transfer_weights", _WeightsInFile)
        self.help = "weights of bones from the surface of the object of another file"

    def save(self, tool, obj, output):
        opening.save(output, obj, {})
        return []


class AttributesFrom(_TransferFrom):
    """The verb `transfer-attributes`."""

    use = "object whose attributes are taken"

    def __init__(self):
        super().__init__("transfer_attributes", _AttributesInFile)
        self.help = "colors, numbers, vectors and labels from the surface of the object of another file"

    def save(self, tool, obj, output):
        arrays, table = files.attribute_arrays(obj), files.point_table(bpy.context, obj)
        arrays |= {name: table.attributes[name] for name in tool.taken if name in table.attributes}
        if table.colors is not None and own_colors(obj.data) in tool.taken:
            arrays["colors"] = table.colors
        return opening.save(output, obj, arrays, tool.shown)


class _FromFile:
    """A tool with a source that is not in the scene, in the coordinates of the files."""

    given = None

    def sources(self, context, obj):
        return [self.given]

    @staticmethod
    def place(obj):
        return place_of(obj)


class _WeightsInFile(_FromFile, TransferWeights):
    pass


class _AttributesInFile(_FromFile, TransferAttributes):
    taken = ()  # names of attributes

    def write(self, context, obj, result):
        self.taken = tuple(result.values)
        return super().write(context, obj, result)
