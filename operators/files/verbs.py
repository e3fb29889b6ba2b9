"""Verbs of the command line: base classes, the analysis, and tools that need only settings."""

from functools import partial

import bpy

from ...command import analysis, verbs
from ...command.clouds import read_file
from ...command.inputs import add_choices, las_choices
from ...command.settings import add_setting, chosen
from ...command.verb import Verb
from ...core import PointCloudError
from ..objects import options
from ..objects.attributes import point_count
from ..objects.notices import renew
from ..objects.place import place_of
from ..objects.reading import obstacle, sharing_objects
from ..objects.result import analysis_names, check_writable, write_result
from ..running.application import compute_all
from ..running.stages import Stages
from ..tools.analyze import plan_analysis
from ..tools.sequence import continue_modes
from . import objects as files
from . import opening
from .arguments import as_setting

_SETTINGS = (*options.ALL_NAMES, "make_single_user")  # of the object
LEFT_OUT = {
    "rna_type",
    "show",
    "hide_reference",
    "display",
    "target",
    "animate",
    "period",
}  # of an operator: points are moved in place


class ObjectVerb(Verb):
    """A verb that opens a file as an object with the settings of the panel, processed by `work` of a subclass."""

    inputs = f"point clouds: {', '.join(files.INPUTS)}. Text has columns x y z and may have a header"
    outputs = files.OUTPUTS

    def __init__(self, operator):
        self.name = operator.replace("_", "-")
        self.operator = getattr(bpy.ops.meshfree, operator).get_rna_type()
        self.help = self.operator.description[0].lower() + self.operator.description[1:]
        self.description = (
            f"{self.operator.description}. Writes one JSON line per input: points, summary, seconds per stage,"
            " notices; or the error. The exit code is 1 if any input failed."
        )

    def add_options(self, parser):
        parser.add_argument("--object", default="", metavar="NAME", help="object of a .blend file; else the active one")
        add_choices(parser)
        settings = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
        for name in _SETTINGS:
            add_setting(parser, as_setting(settings[name]))

    def run(self, path, arguments, output):
        obj, notices = self.open(path, "object", arguments)
        result = self.work(obj, path, arguments, output)
        return {**result, "notices": notices + result["notices"]}

    def open(self, path, option, arguments):
        """Open a file in place of the loaded one; return the object named by an option, with settings, and notices."""
        columns = arguments.columns if option == "object" else ""
        read = partial(read_file, columns=columns, las=las_choices(arguments))
        obj, notices = opening.load(path, getattr(arguments, option), f"--{option.replace('_', '-')}", read)
        reason = obstacle(obj)
        if reason:
            raise PointCloudError(reason)
        for setting in _SETTINGS:
            value = getattr(arguments, setting)
            if value is not None:
                setattr(obj.meshfree, setting, files.group_of(obj, value) if _names_group(setting) else value)
        if notices:
            renew(obj, "Import Points", notices)
        return obj, notices

    def work(self, obj, path, arguments, output) -> dict:
        """Process the object, write the output, and return what to print, with notices."""
        raise NotImplementedError


def _names_group(setting):
    """Whether a setting of some name holds the name of a group of points."""
    return setting == "group" or setting.endswith("_group")


class Analyze(verbs.Frames, ObjectVerb):
    """The verb `analyze`, for single files or for the frames of a sequence."""

    def __init__(self):
        super().__init__("analyze")
        self.help = "areas, normals, curvature, boundaries and vibration modes of point clouds"
        self.description = (
            "Analyze point clouds. Writes one JSON line per input: points, total area, trusted area, components, points"
            " at a boundary, points left out, eigenvalues, seconds per stage, notices; or the error. The exit code is 1"
            " if any input failed."
        )
        self._earlier = None  # modes and points of the frame before

    def add_options(self, parser):
        for setting in verbs.Analyze.settings:
            add_setting(parser, setting)
        self.add_sequence(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        vars(arguments).update(chosen(verbs.Analyze.settings, arguments))
        self.check_sequence(parser, arguments, arguments.modes)

    def work(self, obj, path, arguments, output):
        check_writable(obj, analysis_names(min(arguments.modes, arguments.write_limit)), obj.meshfree.make_single_user)
        with Stages(bpy.context.window_manager, self.operator.name) as stages:
            found = plan_analysis(bpy.context, obj, arguments.modes, arguments.write_limit)(stages)
        matched = {}
        if arguments.sequence:
            found, overlaps, self._earlier = continue_modes(found, files.file_points(obj), self._earlier)
            matched["overlaps"] = overlaps.tolist()
        if sharing_objects(obj):  # make_single_user is on, as checked
            obj.data = obj.data.copy()
        write_result(obj, found, arguments.write_limit)
        renew(obj, self.operator.name, found.notices)
        written = [] if output is None else opening.save(output, obj, _arrays(obj, found))
        return {
            **analysis.figures(found.measures, found.spectrum),
            **matched,
            "seconds": stages.rounded,
            "notices": [*found.notices, *written],
        }


def _arrays(obj, found):
    """Return the arrays of an analysis by name; of a subset those transferred to all points, without an operator."""
    if found.subset_count:
        return files.attribute_arrays(obj)
    return analysis.arrays(place_of(obj), found.built, found.spectrum)


class Apply(ObjectVerb):
    """The verb of a tool, whose options are the settings of its operator."""

    left_out = LEFT_OUT

    def __init__(self, operator, tool):
        super().__init__(operator)
        self._tool = tool
        self._choices = [
            item for item in self.operator.properties if item.identifier not in self.left_out and not item.is_hidden
        ]

    def add_options(self, parser):
        for setting in self._choices:
            add_setting(parser, as_setting(setting))
        super().add_options(parser)

    def tool_of(self, obj, arguments):
        """Return the tool with the settings of the command line; groups are those of an object."""
        tool = self._tool()
        values = {item.identifier: _default(item) for item in self.operator.properties if item.type != "POINTER"}
        values |= {name: value for name, value in vars(arguments).items() if name in values and value is not None}
        values |= {name: files.group_of(obj, value) for name, value in values.items() if _names_group(name)}
        vars(tool).update(values, target="IN_PLACE")
        return tool

    def work(self, obj, path, arguments, output):
        tool = self.tool_of(obj, arguments)
        self.prepare(tool, obj, path, arguments)
        plans = tool.plan_all(bpy.context, [obj])
        with Stages(bpy.context.window_manager, self.operator.name) as stages:
            results = compute_all(plans, stages)
        ((*notices, line),) = tool.write_all(bpy.context, [obj], results)
        renew(obj, self.operator.name, notices)
        figures = self.figures(tool, results[0])
        written = [] if output is None else self.save(tool, obj, output)
        return {
            "points": point_count(obj.data),
            "done": line,
            **figures,
            "seconds": stages.rounded,
            "notices": [*notices, *written],
        }

    def prepare(self, tool, obj, path, arguments):
        """Set what the settings of the tool do not include."""

    def save(self, tool, obj, output) -> list:
        """Write the output, and return notices of what is written in another form."""
        return opening.save(output, obj, files.attribute_arrays(obj), tool.shown)

    def figures(self, tool, result) -> dict:
        """Return numbers to print beside the summary."""
        return {}


def _default(setting):
    return setting.default_array if getattr(setting, "is_array", False) else setting.default
