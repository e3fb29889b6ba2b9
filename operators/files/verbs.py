"""Verbs of the command line that work on an object: the analysis, and tools that need no window."""

from pathlib import Path

import bpy
import numpy as np
from scipy.spatial import cKDTree

from ...core import PointCloudError
from ...core.files import MESHES, write_mesh
from ..objects import options
from ..objects.attributes import MEAN_CURVATURE, point_count
from ..objects.groups import assign
from ..objects.place import offset_of, place_of
from ..objects.reading import obstacle, sharing_objects
from ..objects.result import analysis_names, check_writable, write_result
from ..running.application import compute_all, naming, operator_reader
from ..running.stages import Stages
from ..tools.analyze import WRITE_LIMIT, plan_analysis
from ..tools.compare import Compare, distances
from ..tools.mesh import MeshSurface
from ..tools.orient import OrientNormals
from ..tools.sequence import continue_modes
from . import objects as files
from .arguments import add_setting, as_place, place

ONE_LINE = "Writes one JSON line per input, with notices, or the error. The exit code is 1 if any input failed."
_SETTINGS = (*options.ALL_NAMES, "make_single_user")  # of the object
_LEFT_OUT = {"rna_type", "show", "display", "target", "animate", "period"}  # of an operator: points are moved in place


class Verb:
    """What is done with each file. There is a new one for each command, which may keep what its files share.

    A subclass says what by `run`, and which options that takes by `add_options`.
    """

    name = help = description = ""  # as the user writes it, what it is in a line, and in more
    inputs = "files"
    outputs = ()  # endings of the files that it can write, for folders the first one unless told; none to write nothing
    reads = ()  # names of the options that give other files, which are not to be overwritten

    def add_options(self, parser):
        """Add what it takes beside inputs and outputs."""

    def check(self, parser, arguments):
        """Refuse options that do not go together, by `parser.error`."""

    def run(self, path, arguments, output) -> dict:
        """Work on one file, write the output unless it is None, and return what to print."""
        raise NotImplementedError


class _ObjectVerb(Verb):
    """A verb that opens a file as an object with the settings of the panel. A subclass works on it, by `work`."""

    inputs = f"point clouds: {', '.join(files.INPUTS)}. Text has columns x y z and may have a header"
    outputs = files.OUTPUTS

    def __init__(self, operator):
        self.name = operator.replace("_", "-")
        self.operator = getattr(bpy.ops.meshfree, operator).get_rna_type()
        self.help = self.operator.description.lower()
        self.description = (
            f"{self.operator.description}. Writes one JSON line per input: points, what was done, seconds per stage,"
            " notices; or the error. The exit code is 1 if any input failed."
        )

    def add_options(self, parser):
        parser.add_argument("--object", default="", metavar="NAME", help="object of a .blend file; else the active one")
        settings = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
        for name in _SETTINGS:
            add_setting(parser, settings[name])

    def run(self, path, arguments, output):
        obj, notices = self.open(path, "object", arguments)
        result = self.work(obj, path, arguments, output)
        return {**result, "notices": notices + result["notices"]}

    def open(self, path, option, arguments):
        """Open a file in place of all that is loaded; return the object that an option names, set up, and notices."""
        obj, notices = files.load(path, getattr(arguments, option), f"--{option.replace('_', '-')}")
        reason = obstacle(obj)
        if reason:
            raise PointCloudError(reason)
        for setting in _SETTINGS:
            value = getattr(arguments, setting)
            if value is not None:
                setattr(obj.meshfree, setting, files.group_of(obj, value) if _names_group(setting) else value)
        return obj, notices

    def work(self, obj, path, arguments, output) -> dict:
        """Work on the object, write the output, and return what to print, with notices."""
        raise NotImplementedError


def _names_group(setting):
    """Whether a setting of some name holds the name of a group of points."""
    return setting == "group" or setting.endswith("_group")


class Analyze(_ObjectVerb):
    """The verb `analyze`, for single files or for the frames of a sequence."""

    def __init__(self):
        super().__init__("analyze")
        self.help = "areas, normals, curvature, boundaries and vibration modes of point clouds"
        self.description = (
            "Analyze point clouds. Writes one JSON line per input: points, total area, components, points at a"
            " boundary, points left out, eigenvalues, seconds per stage, notices; or the error. The exit code is 1 if"
            " any input failed."
        )
        self._earlier = None  # points and modes of the frame before

    def add_options(self, parser):
        parser.add_argument("--modes", type=int, default=0, metavar="N", help="how many vibration modes to compute")
        parser.add_argument(
            "--write-limit", type=int, default=WRITE_LIMIT, metavar="N", help="modes written as attributes at most"
        )
        parser.add_argument(
            "--sequence",
            action="store_true",
            help="the inputs are frames in their order: each mode continues one of the frame before, with its sign, so"
            " that eigenvalues need not ascend; overlaps of the two are written, too",
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        if arguments.modes < 0 or arguments.write_limit < 1:
            parser.error("--modes takes a number of at least 0, --write-limit one of at least 1")
        if arguments.sequence and not arguments.modes:
            parser.error("--sequence matches modes: give --modes, too")

    def work(self, obj, path, arguments, output):
        check_writable(obj, analysis_names(min(arguments.modes, arguments.write_limit)), obj.meshfree.make_single_user)
        with Stages(bpy.context.window_manager, self.operator.name) as stages:
            analysis = plan_analysis(bpy.context, obj, arguments.modes, arguments.write_limit)(stages)
        matched = {}
        if arguments.sequence:
            analysis, overlaps, self._earlier = continue_modes(analysis, files.file_points(obj), self._earlier)
            matched["overlaps"] = overlaps.tolist()
        if sharing_objects(obj):  # by choice, or it would not be writable
            obj.data = obj.data.copy()
        write_result(obj, analysis, arguments.write_limit)
        if output is not None:
            files.save(output, obj, _arrays(obj, analysis), MEAN_CURVATURE)
        return {
            "points": len(analysis.measures.areas),
            "total_area": analysis.total_area,
            **analysis.counts,
            "eigenvalues": [] if analysis.spectrum is None else analysis.spectrum.eigenvalues.tolist(),
            **matched,
            "seconds": _rounded(analysis.seconds),
            "notices": analysis.notices,
        }


def _arrays(obj, analysis):
    """Arrays of an analysis by name; of one of a subset those that were carried to all points, without an operator."""
    if analysis.subset_count:
        return files.attribute_arrays(obj)
    return files.analysis_arrays(place_of(obj), analysis.laplacian, analysis.measures.mean_curvature, analysis.spectrum)


def _rounded(seconds):
    return {name: round(spent, 3) for name, spent in seconds.items()}


class Apply(_ObjectVerb):
    """The verb of a tool, by the name of its operator, whose settings are its options."""

    left_out = _LEFT_OUT

    def __init__(self, operator, tool):
        super().__init__(operator)
        self._tool = tool
        self._choices = [
            item for item in self.operator.properties if item.identifier not in self.left_out and not item.is_hidden
        ]

    def add_options(self, parser):
        for setting in self._choices:
            add_setting(parser, setting)
        super().add_options(parser)

    def work(self, obj, path, arguments, output):
        tool = self._tool()
        values = {item.identifier: _default(item) for item in self.operator.properties if item.type != "POINTER"}
        values |= {name: value for name, value in vars(arguments).items() if name in values and value is not None}
        values |= {name: files.group_of(obj, value) for name, value in values.items() if _names_group(name)}
        vars(tool).update(values, target="IN_PLACE")
        self.prepare(tool, obj, path, arguments)
        plans = tool.plan_all(bpy.context, [obj])
        with Stages(bpy.context.window_manager, self.operator.name) as stages:
            results = compute_all(plans, stages)
        ((*notices, line),) = tool.write_all(bpy.context, [obj], results)
        figures = self.figures(tool, results[0])
        if output is not None:
            self.save(tool, obj, output)
        return {
            "points": point_count(obj.data),
            "done": line,
            **figures,
            "seconds": _rounded(stages.seconds),
            "notices": notices,
        }

    def prepare(self, tool, obj, path, arguments):
        """Give the tool what its settings do not hold."""

    def save(self, tool, obj, output):
        """Write the output."""
        files.save(output, obj, files.attribute_arrays(obj), tool.shown)

    def figures(self, tool, result) -> dict:
        """Return numbers to print, beside the line about what was done."""
        return {}


def _default(setting):
    return setting.default_array if getattr(setting, "is_array", False) else setting.default


class FromSources(Apply):
    """A tool that starts at some points: those of a group, or those nearest to places."""

    def add_options(self, parser):
        parser.add_argument(
            "--at",
            type=place,
            action="append",
            metavar="X,Y,Z",
            help="place in the coordinates of the file: the nearest point is a source. Give it once for each source, as"
            " --at=X,Y,Z where X is below zero",
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        if arguments.at and arguments.group:
            parser.error("--at and --group both say which points are the sources: give one of them")
        if (
            not arguments.at
            and not arguments.group
            and any(path.suffix.lower() != ".blend" for path in arguments.inputs)
        ):
            parser.error("nothing says which points are the sources: give --at X,Y,Z, or --group with a column's name")

    def prepare(self, tool, obj, path, arguments):
        if arguments.at:
            nearest = cKDTree(files.file_points(obj)).query(arguments.at)[1]
            tool.group = "Places"
            assign(obj, tool.group, np.isin(np.arange(point_count(obj.data)), nearest), "REPLACE", 1.0)


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
            files.save_scene(output)
        else:
            table = files.point_table(bpy.context, made)
            write_mesh(output, table, files.faces_of(made), double=not table.single)

    def figures(self, tool, result):
        ((_, name, opened),) = tool.made
        mesh = bpy.data.objects[name].data
        return {"vertices": len(mesh.vertices), "faces": len(mesh.polygons), "open_edges": opened}


class CompareWith(Apply):
    """The verb `compare`: all inputs with one other file."""

    reads = ("reference",)

    def __init__(self):
        super().__init__("compare", _CompareWithFile)
        self.help = "how far points are from the surface of those of another file"
        self._reference = None

    def add_options(self, parser):
        parser.add_argument(
            "--reference",
            type=Path,
            required=True,
            metavar="FILE",
            help="point cloud whose surface distances are measured from, of the kinds of inputs",
        )
        parser.add_argument(
            "--reference-object",
            default="",
            metavar="NAME",
            help="its object, if it is a .blend file; else the active one",
        )
        super().add_options(parser)

    def run(self, path, arguments, output):
        if self._reference is None:  # before the input, which takes its place in Blender
            self._reference = self._read(arguments)
        result = super().run(path, arguments, output)
        return {**result, "notices": self._reference.notices + result["notices"]}

    def _read(self, arguments):
        obj, notices = self.open(arguments.reference, "reference_object", arguments)
        with naming(str(arguments.reference)):
            _, build = operator_reader(bpy.context, obj)
        return _Reference(str(arguments.reference), place_of(obj), build, notices)

    def prepare(self, tool, obj, path, arguments):
        tool.reference = self._reference

    def figures(self, tool, result):
        found, _ = result
        mean, within, most = distances(found)
        return {
            "compared_count": int(np.count_nonzero(found.known)),
            "mean_distance": mean,
            "distance_95": within,
            "greatest_distance": most,
        }


class _Reference:
    """A cloud that others are compared with: its operator is built once, when the first of them asks for it."""

    def __init__(self, name, place, build, notices):
        self.name, self.place, self.notices = name, place, notices
        self._build, self._laplacian = build, None

    def operator(self, progress):
        if self._laplacian is None:
            self._laplacian = self._build(progress)
        return self._laplacian


class _CompareWithFile(Compare):
    """The same tool, with a cloud that is no object of the scene, both in the coordinates of their files."""

    reference = None

    def other(self, context, obj):
        return self.reference.name, self.reference.operator, place_of(obj) - self.reference.place


class Orient(Apply):
    """The verb `orient`, with viewpoints in the coordinates of the file."""

    left_out = _LEFT_OUT | {"viewpoint"}

    def __init__(self):
        super().__init__("orient_normals", _OrientInFile)
        self.name = "orient"

    def add_options(self, parser):
        parser.add_argument(
            "--viewpoint",
            metavar="X,Y,Z",
            help="place in the coordinates of the file that the points were seen from, as --viewpoint=X,Y,Z where X is"
            " below zero; or the name of an object of a .blend file. Sets the method VIEWPOINT",
        )
        super().add_options(parser)

    def check(self, parser, arguments):
        implied = {"VIEWPOINT": arguments.viewpoint, "ATTRIBUTE": arguments.source}
        for method, value in implied.items():
            if value and arguments.method is None:
                arguments.method = method
            elif value and arguments.method != method:
                option = "--viewpoint" if method == "VIEWPOINT" else "--source"
                parser.error(f"{option} goes with the method {method}, not {arguments.method}")

    def prepare(self, tool, obj, path, arguments):
        tool.viewpoint = arguments.viewpoint or ""
        tool.place = as_place(tool.viewpoint)
        tool.shift = offset_of(obj) if path.suffix.lower() != ".blend" else 0.0


class _OrientInFile(OrientNormals):
    """The same tool, with places in the coordinates of the file, before the shift of large ones."""

    place = None  # that the points were seen from, (3,), if it is no object
    shift = 0.0  # of places that are columns of the file

    def seen_from(self, context, obj, reading):
        if self.method == "VIEWPOINT" and self.place is not None:
            return self.place - place_of(obj)
        found = super().seen_from(context, obj, reading)
        return found - self.shift if self.method == "ATTRIBUTE" and self.holds == "POSITIONS" else found
