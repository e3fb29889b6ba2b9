"""Verbs of tools that need more than settings: positions, other files, or other outputs."""

from pathlib import Path

import bpy
import numpy as np

from ... import core
from ...command import alignment, comparison
from ...command.groups import add_at, check_sources
from ...command.naming import naming
from ...command.orienting import imply_method
from ...command.settings import as_place
from ...command.source_verbs import add_curve
from ...core.files import MESHES, READABLE, read_points, write_mesh
from ..objects.attributes import point_count
from ..objects.groups import assign
from ..objects.options import laplacian_options
from ..objects.place import offset_of, place_of
from ..objects.reading import read_points as seen_points
from ..running.application import build_operator
from ..tools.align import Align
from ..tools.along import SignedDistance
from ..tools.compare import Compare
from ..tools.mesh import MeshSurface
from ..tools.orient import OrientNormals
from ..tools.simulate import Simulate
from . import objects as files
from . import opening
from .verbs import LEFT_OUT, Apply

_PLACES = "--at"  # group of the points nearest to given positions


class FromSources(Apply):
    """A tool with source points: those of a group, or those nearest to given positions."""

    def add_options(self, parser):
        add_at(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        # Other files have no default group and no selection.
        check_sources(parser, arguments, within=all(path.suffix.lower() == ".blend" for path in arguments.inputs))

    def prepare(self, tool, obj, path, arguments):
        if arguments.at:
            nearest = core.geometry.nearest_rows(files.file_points(obj), arguments.at)
            tool.group = _PLACES
            assign(obj, tool.group, np.isin(np.arange(point_count(obj.data)), nearest), "REPLACE", 1.0)


class Frames(FromSources):
    """The verb `simulate`, whose output holds the last frame."""

    left_out = LEFT_OUT | {"height", "toucher", "keep", "modes", "budget", "folder"}

    def __init__(self):
        super().__init__("simulate", _SimulateInFile)


class _SimulateInFile(Simulate):
    """The tool for a file, beside which no frames are kept."""

    def write(self, context, obj, result):
        *_, line = super().write(context, obj, result)
        settings = obj.meshfree
        context.scene.frame_set(settings.motion_first + result.frames - 1)
        settings.motion_file = ""
        result.motion.path.unlink()
        return [*self.about(obj, result), line]


class AlongCurve(Apply):
    """The verb `signed-distance`, with a curve of a file."""

    left_out = LEFT_OUT | {"curve"}
    reads = ("curve",)

    def __init__(self):
        super().__init__("signed_distance", _SignedDistanceInFile)

    def add_options(self, parser):
        add_curve(parser, "; or the name of a curve object of a .blend file")
        super().add_options(parser)

    def prepare(self, tool, obj, path, arguments):
        tool.curve, tool.closed = arguments.curve, arguments.closed
        curve = Path(arguments.curve)
        if curve.suffix.lower() in READABLE:
            tool.places = read_points(curve).points


class _SignedDistanceInFile(SignedDistance):
    """The same tool, with a curve in the coordinates of the file."""

    places = None  # (k, 3), if it is no object
    closed = False

    def read_curve(self, context, obj):
        if self.places is None:
            return super().read_curve(context, obj)
        return self.places - place_of(obj), self.closed


class Mesh(Apply):
    """The verb `mesh`, whose outputs are files of meshes."""

    outputs = (".blend", *MESHES)

    def __init__(self):
        super().__init__("mesh_surface", MeshSurface)
        self.name = "mesh"

    def save(self, tool, obj, output):
        made = bpy.data.objects[tool.made[0][1]]
        if output.suffix.lower() == ".blend":
            tool.conclude(bpy.context, [obj])
            opening.save_scene(output)
            return []
        table = files.point_table(bpy.context, made)
        return write_mesh(output, table, files.faces_of(made), double=not table.single)

    def figures(self, tool, result):
        ((_, name, opened),) = tool.made
        mesh = bpy.data.objects[name].data
        return {"vertices": len(mesh.vertices), "faces": len(mesh.polygons), "open_edges": opened}


class WithReference(Apply):
    """A tool on all inputs with one other file, in the coordinates of their files."""

    reads = ("reference",)
    use = ""  # what the reference is for, for the help
    required = True  # whether there must be one

    def __init__(self, operator, tool):
        super().__init__(operator, tool)
        self._reference = None

    def add_options(self, parser):
        parser.add_argument(
            "--reference", type=Path, required=self.required, metavar="FILE", help=f"{self.use}, of the kinds of inputs"
        )
        parser.add_argument(
            "--reference-object",
            default="",
            metavar="NAME",
            help="its object, if it is a .blend file; else the active one",
        )
        super().add_options(parser)

    def run(self, path, arguments, output):
        if arguments.reference is None:
            return super().run(path, arguments, output)
        if self._reference is None:  # before the input, which replaces it in Blender
            self._reference = self._read(arguments)
        result = super().run(path, arguments, output)
        return {**result, "notices": self._reference.notices + result["notices"]}

    def _read(self, arguments):
        obj, notices = self.open(arguments.reference, "reference_object", arguments)
        name = str(arguments.reference)
        with naming(name):
            return _Reference(
                name, place_of(obj), seen_points(bpy.context, obj), laplacian_options(obj.meshfree), notices
            )

    def prepare(self, tool, obj, path, arguments):
        tool.reference = self._reference


class CompareWith(WithReference):
    """The verb `compare`."""

    use = "point cloud from whose surface distances are measured"

    def __init__(self):
        super().__init__("compare", _CompareWithFile)
        self.help = "distance of points from the surface of those of another file, along normals or the nearest one"

    def figures(self, tool, result):
        return comparison.figures(result.compared.found)


class AlignWith(WithReference):
    """The verb `align`, whose outputs are in the coordinates of the reference."""

    left_out = LEFT_OUT | {"from_selected"}
    use = "point cloud that the points are moved onto"

    def __init__(self):
        super().__init__("align_points", _AlignWithFile)
        self.name = "align"
        self.help = "move points onto the surface of those of another file, from nearby"

    def figures(self, tool, result):
        found, *_ = result
        return alignment.figures(found, tool.reference.place)


class _Reference:
    """A cloud that others are held against: its operator is built once, for the first of them."""

    def __init__(self, name, place, reading, options, notices):
        self.name, self.place, self.reading, self.notices = name, place, reading, notices
        self._options, self._laplacian = options, None

    def operator(self, progress):
        if self._laplacian is None:
            self._laplacian = build_operator(self.reading, self._options, progress).laplacian
        return self._laplacian


class _MovedLast:
    """A tool that moves its object when all else is written."""

    def write_all(self, context, objects, results):
        texts = super().write_all(context, objects, results)
        self._move()
        return texts


class _CompareWithFile(_MovedLast, Compare):
    """The same tool, with a cloud that is not in the scene."""

    reference = None

    def other(self, context, obj):
        reference = self.reference
        return reference.name, reference.reading, reference.operator, place_of(obj) - reference.place, None


class _AlignWithFile(_MovedLast, Align):
    """The same tool, with a cloud that is not in the scene."""

    reference = None

    def other(self, context, obj):
        return self.reference.name, self.reference.reading.points, place_of(obj) - self.reference.place, None


class Orient(Apply):
    """The verb `orient`, with viewpoints in the coordinates of the file."""

    left_out = LEFT_OUT | {"viewpoint"}

    def __init__(self):
        super().__init__("orient_normals", _OrientInFile)
        self.name = "orient"

    def add_options(self, parser):
        parser.add_argument(
            "--viewpoint",
            metavar="X,Y,Z",
            help="position in the coordinates of the file from which the points were seen, as --viewpoint=X,Y,Z where X"
            " is below zero; or the name of an object of a .blend file. Sets the method VIEWPOINT",
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        imply_method(parser, arguments)

    def prepare(self, tool, obj, path, arguments):
        tool.viewpoint = arguments.viewpoint or ""
        tool.place = as_place(tool.viewpoint)
        tool.shift = offset_of(obj) if path.suffix.lower() != ".blend" else 0.0


class _OrientInFile(OrientNormals):
    """The same tool, with positions in the coordinates of the file, without the import offset."""

    place = None  # viewpoint, (3,), unless it is an object

    def viewpoints(self, context, obj, reading):
        if self.method == "VIEWPOINT" and self.place is not None:
            return self.place - place_of(obj), []
        return super().viewpoints(context, obj, reading)
