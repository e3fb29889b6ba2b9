"""The command line: `blender --command meshfree VERB FILE ...`, from files to files without a window."""

import argparse
import json
import math
from pathlib import Path

import bpy

from ...core import PointCloudError
from ...core.files import numbered_files
from ..objects import options
from ..objects.attributes import point_count
from ..objects.reading import obstacle, sharing_objects
from ..objects.result import analysis_names, check_writable, write_result
from ..running.application import compute_all
from ..running.stages import Stages
from ..tools.analyze import WRITE_LIMIT, plan_analysis
from ..tools.curvature import Curvatures, Roughness
from ..tools.minimal import MinimalSurface
from ..tools.segment import Segment, Signature
from ..tools.sequence import continue_modes
from ..tools.smooth import ModeShape, Smooth
from . import bending
from . import objects as files

# Tools that need nothing picked, beside the analysis, by the names of their operators.
VERBS = {
    "principal_curvatures": Curvatures,
    "roughness": Roughness,
    "smooth": Smooth,
    "mode_shape": ModeShape,
    "segment": Segment,
    "signature": Signature,
    "minimal_surface": MinimalSurface,
}
# Others, which take no object: what they do and how they are called there.
PLAIN = {
    "splat_info": (bending.splat_info, "what files of Gaussian splats hold"),
    "deform": (bending.deform, "move points or Gaussian splats by handles that a JSON file names"),
}
_SETTINGS = (*options.ALL_NAMES, "make_single_user")  # of the object
_handles = []


def attach():
    """Add the command to Blender."""
    _handles.append(bpy.utils.register_cli_command("meshfree", run))


def detach():
    """Take the command away again."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())


def run(argv) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : list of str
        What follows ``--command meshfree``.

    Returns
    -------
    int
        Exit code: 0 if all files succeeded, 1 if any failed, 2 for wrong usage.
    """
    try:
        arguments = _parse(argv)
    except SystemExit as stop:  # how argparse ends after --help and wrong usage; Blender itself shall end in order
        return stop.code or 0
    failed = False
    for path in arguments.inputs:
        try:
            result = _process(path, arguments)
        except (PointCloudError, OSError, RuntimeError) as error:  # Blender's importers raise RuntimeError
            failed = True
            result = {"error": str(error).strip().removeprefix("Error: ")}  # as operators raise what they report
        print(json.dumps({"file": str(path), **result}), flush=True)
    return 1 if failed else 0


def _parse(argv):
    parser = argparse.ArgumentParser(prog="blender --command meshfree")
    commands = parser.add_subparsers(dest="command", required=True)
    analyze = commands.add_parser(
        "analyze",
        help="areas, normals, curvature, boundaries and vibration modes of point clouds",
        description="Analyze point clouds. Writes one JSON line per input: points, total area, components, points"
        " at a boundary, points left out, eigenvalues, seconds per stage, notices; or the error. The exit code is 1 if"
        " any input failed.",
    )
    analyze.add_argument("--modes", type=int, default=0, metavar="N", help="how many vibration modes to compute")
    analyze.add_argument(
        "--write-limit", type=int, default=WRITE_LIMIT, metavar="N", help="modes written as attributes at most"
    )
    analyze.add_argument(
        "--sequence",
        action="store_true",
        help="the inputs are frames in their order, or folders of numbered ones: each mode continues one of the frame"
        " before, with its sign, so that eigenvalues need not ascend; overlaps of the two are written, too",
    )
    _add_files(analyze)
    parsers = {"analyze": analyze}
    for verb in VERBS:
        operator = _kind(verb)
        parsers[verb] = commands.add_parser(
            verb.replace("_", "-"),
            help=operator.description.lower(),
            description=f"{operator.description}. Writes one JSON line per input: points, what was done, seconds per"
            " stage, notices; or the error. The exit code is 1 if any input failed.",
        )
        for setting in _choices(verb):
            _add_setting(parsers[verb], setting)
        _add_files(parsers[verb])

    for verb, (_, text) in PLAIN.items():
        parsers[verb] = commands.add_parser(
            verb.replace("_", "-"),
            help=text,
            description=f"{text.capitalize()}. Writes one JSON line per input. The exit code is 1 if any input failed.",
        )
        parsers[verb].add_argument("inputs", nargs="+", type=Path, metavar="IN", help="files of points or splats")
        if verb == "deform":
            parsers[verb].add_argument(
                "--handles",
                type=Path,
                required=True,
                metavar="JSON",
                help='{"handles": [{"center": [x, y, z], "radius": r, "shift": [x, y, z]}], "anchors": [...]}: points'
                ' in balls or by "indices", moved by "shift", "matrix" (4 x 4) or "positions"',
            )
            target = parsers[verb].add_mutually_exclusive_group()
            target.add_argument("--out", type=Path, metavar="FILE", help="output of one input")
            target.add_argument("--out-dir", type=Path, metavar="DIR", help="folder for the outputs of all inputs")
            parsers[verb].add_argument("--format", choices=("ply", "xyz", "csv"), default="ply", help="in the folder")
        else:
            parsers[verb].set_defaults(out=None, out_dir=None)

    arguments = parser.parse_args(argv)
    arguments.command = arguments.command.replace("-", "_")
    chosen = parsers[arguments.command]
    if arguments.command == "analyze" and (arguments.modes < 0 or arguments.write_limit < 1):
        chosen.error("--modes takes a number of at least 0, --write-limit one of at least 1")
    if arguments.out is not None and arguments.out.suffix.lower() not in files.OUTPUTS:
        chosen.error(f"--out must end in {', '.join(files.OUTPUTS)}")
    arguments.earlier = None  # points and modes of the frame before
    if arguments.command == "analyze" and arguments.sequence:
        if not arguments.modes:
            chosen.error("--sequence matches modes: give --modes, too")
        try:
            arguments.inputs = [file for path in arguments.inputs for file in _frames(path)]
        except PointCloudError as error:
            chosen.error(str(error))
    if arguments.out is not None and len(arguments.inputs) > 1:
        chosen.error("--out takes one input; use --out-dir for many")
    outputs = [_output_path(path, arguments) for path in arguments.inputs]
    if arguments.out_dir is not None and len(set(outputs)) < len(outputs):
        chosen.error("some inputs have the same name and would overwrite each other in --out-dir")
    return arguments


def _frames(path):
    return numbered_files(path) if path.is_dir() else [path]


def _kind(verb):
    return getattr(bpy.ops.meshfree, verb).get_rna_type()


def _choices(verb):
    """Properties of an operator that make sense on the command line; points are moved in place there."""
    left_out = {"rna_type", "show", "display", "target", "animate", "period"}
    return [item for item in _kind(verb).properties if item.identifier not in left_out]


def _add_files(parser):
    """Add what all verbs take: inputs, outputs, and the settings of the object."""
    parser.add_argument(
        "inputs",
        nargs="+",
        type=Path,
        metavar="IN",
        help=f"point clouds: {', '.join(files.INPUTS)}. Text has columns x y z and may have a header",
    )
    target = parser.add_mutually_exclusive_group()
    target.add_argument("--out", type=Path, metavar="FILE", help=f"output of one input: {', '.join(files.OUTPUTS)}")
    target.add_argument("--out-dir", type=Path, metavar="DIR", help="folder for the outputs of all inputs")
    parser.add_argument(
        "--format", choices=[suffix[1:] for suffix in files.OUTPUTS], default="blend", help="outputs in the folder"
    )
    parser.add_argument("--object", default="", metavar="NAME", help="object of a .blend file; else the active one")
    settings = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
    for name in _SETTINGS:
        _add_setting(parser, settings[name])


def _add_setting(parser, setting):
    """Add an option for a setting of the panel, with its description as help."""
    kind = {"help": setting.description.replace("%", "%%"), "default": None}
    if setting.type == "ENUM":
        kind.update(type=str.upper, choices=setting.enum_items.keys())
    elif setting.type == "BOOLEAN":
        kind.update(action=argparse.BooleanOptionalAction)
    elif setting.type == "STRING":
        kind.update(metavar="NAME")
    elif setting.subtype == "ANGLE":
        kind.update(type=_number(setting, lambda text: math.radians(float(text))), metavar="DEGREES")
    else:
        kind.update(type=_number(setting, int if setting.type == "INT" else float), metavar=setting.type)
    parser.add_argument(f"--{setting.identifier.replace('_', '-')}", **kind)


def _number(setting, convert):
    """Return what turns a text into a number for a setting, and refuses those that Blender would silently replace."""

    def number(text):
        value = convert(text)
        if not setting.hard_min <= value <= setting.hard_max:
            raise argparse.ArgumentTypeError(f"{text} is not from {setting.hard_min:g} to {setting.hard_max:g}")
        return value

    return number


def _output_path(path, arguments):
    if arguments.out_dir is not None:
        return arguments.out_dir / f"{path.stem}.{arguments.format}"
    return arguments.out


def _process(path, arguments) -> dict:
    """Work on one file, write its output, and return what to print."""
    output = _output_path(path, arguments)
    if output is not None and output.resolve() == path.resolve():
        raise PointCloudError(f"The output {output} would overwrite its input. Choose another name.")
    if arguments.command in PLAIN:
        result = PLAIN[arguments.command][0](path, arguments, output)
        return {**result, "output": None if output is None else str(output)}
    obj, notices = files.load(path, arguments.object)
    reason = obstacle(obj)
    if reason:
        raise PointCloudError(reason)
    for name in _SETTINGS:
        value = getattr(arguments, name)
        if value is not None:
            setattr(obj.meshfree, name, value)
    result = _analyze(obj, arguments, output) if arguments.command == "analyze" else _apply(obj, arguments, output)
    result["notices"] = notices + result["notices"]
    return {**result, "output": None if output is None else str(output)}


def _analyze(obj, arguments, output):
    check_writable(obj, analysis_names(min(arguments.modes, arguments.write_limit)), obj.meshfree.make_single_user)
    with Stages(bpy.context.window_manager, _kind("analyze").name) as stages:
        analysis = plan_analysis(bpy.context, obj, arguments.modes, arguments.write_limit)(stages)
    matched = {}
    if arguments.sequence:
        analysis, overlaps, arguments.earlier = continue_modes(analysis, files.file_points(obj), arguments.earlier)
        matched["overlaps"] = overlaps.tolist()
    if sharing_objects(obj):  # by choice, or it would not be writable
        obj.data = obj.data.copy()
    write_result(obj, analysis, arguments.write_limit)
    if output is not None:
        files.save(output, obj, _arrays(obj, analysis))
    return {
        "points": len(analysis.measures.areas),
        "total_area": analysis.total_area,
        **analysis.counts,
        "eigenvalues": [] if analysis.spectrum is None else analysis.spectrum.eigenvalues.tolist(),
        **matched,
        "seconds": {name: round(seconds, 3) for name, seconds in analysis.seconds.items()},
        "notices": analysis.notices,
    }


def _arrays(obj, analysis):
    """Arrays of an analysis by name; of one of a subset those that were carried to all points, without an operator."""
    if analysis.subset_count:
        return files.attribute_arrays(obj)
    return files.analysis_arrays(
        files.place_of(obj), analysis.laplacian, analysis.measures.mean_curvature, analysis.spectrum
    )


def _apply(obj, arguments, output):
    """Run the tool of a verb on the object."""
    kind, tool = _kind(arguments.command), VERBS[arguments.command]()
    values = {item.identifier: item.default for item in kind.properties if item.type != "POINTER"}
    values |= {name: value for name, value in vars(arguments).items() if name in values and value is not None}
    vars(tool).update(values, target="IN_PLACE")
    plans = tool.plan_all(bpy.context, [obj])
    with Stages(bpy.context.window_manager, kind.name) as stages:
        results = compute_all(plans, stages)
    ((*notices, line),) = tool.write_all(bpy.context, [obj], results)
    if output is not None:
        files.save(output, obj, files.attribute_arrays(obj))
    return {
        "points": point_count(obj.data),
        "done": line,
        "seconds": {name: round(seconds, 3) for name, seconds in stages.seconds.items()},
        "notices": notices,
    }
