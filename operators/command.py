"""The command line: `blender --command meshfree analyze FILE ...`, from files to files without a window."""

import argparse
import json
from pathlib import Path

import bpy

from ..core import PointCloudError
from . import files, options
from .analyze import WRITE_LIMIT, analyze_object
from .reading import obstacle
from .result import analysis_names, check_writable, write_result

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
            result = {"error": str(error).strip()}
        print(json.dumps({"file": str(path), **result}), flush=True)
    return 1 if failed else 0


def _parse(argv):
    parser = argparse.ArgumentParser(prog="blender --command meshfree")
    analyze = parser.add_subparsers(dest="command", required=True).add_parser(
        "analyze",
        help="areas, normals, curvature, rims and vibration modes of point clouds",
        description="Analyze point clouds. Writes one JSON line per input: points, total area, connected parts, points"
        " at a rim, points left out, eigenvalues, seconds per stage, notices; or the error. The exit code is 1 if any"
        " input failed.",
    )
    analyze.add_argument(
        "inputs",
        nargs="+",
        type=Path,
        metavar="IN",
        help=f"point clouds: {', '.join(files.INPUTS)}. Text has columns x y z and may have a header",
    )
    target = analyze.add_mutually_exclusive_group()
    target.add_argument("--out", type=Path, metavar="FILE", help=f"output of one input: {', '.join(files.OUTPUTS)}")
    target.add_argument("--out-dir", type=Path, metavar="DIR", help="folder for the outputs of all inputs")
    analyze.add_argument(
        "--format", choices=[suffix[1:] for suffix in files.OUTPUTS], default="blend", help="outputs in the folder"
    )
    analyze.add_argument("--modes", type=int, default=0, metavar="N", help="how many vibration modes to compute")
    analyze.add_argument(
        "--write-limit", type=int, default=WRITE_LIMIT, metavar="N", help="modes written as attributes at most"
    )
    analyze.add_argument("--object", default="", metavar="NAME", help="object of a .blend file; else the active one")
    settings = bpy.types.Object.bl_rna.properties["meshfree"].fixed_type.properties
    for name in options.ALL_NAMES:
        _add_setting(analyze, settings[name])

    arguments = parser.parse_args(argv)
    if arguments.modes < 0 or arguments.write_limit < 1:
        analyze.error("--modes takes a number of at least 0, --write-limit one of at least 1")
    if arguments.out is not None and len(arguments.inputs) > 1:
        analyze.error("--out takes one input; use --out-dir for many")
    if arguments.out is not None and arguments.out.suffix.lower() not in files.OUTPUTS:
        analyze.error(f"--out must end in {', '.join(files.OUTPUTS)}")
    outputs = [_output_path(path, arguments) for path in arguments.inputs]
    if arguments.out_dir is not None and len(set(outputs)) < len(outputs):
        analyze.error("some inputs have the same name and would overwrite each other in --out-dir")
    return arguments


def _add_setting(parser, setting):
    """Add an option for a setting of the panel, with its description as help."""
    kind = {"help": setting.description.replace("%", "%%"), "default": None}
    if setting.type == "ENUM":
        kind.update(type=str.upper, choices=setting.enum_items.keys())
    elif setting.type == "BOOLEAN":
        kind.update(action=argparse.BooleanOptionalAction)
    elif setting.type == "STRING":
        kind.update(metavar="NAME")
    else:
        kind.update(type=int if setting.type == "INT" else float, metavar=setting.type)
    parser.add_argument(f"--{setting.identifier.replace('_', '-')}", **kind)


def _output_path(path, arguments):
    if arguments.out_dir is not None:
        return arguments.out_dir / f"{path.stem}.{arguments.format}"
    return arguments.out


def _process(path, arguments) -> dict:
    """Analyze one file, write its output, and return what to print."""
    output = _output_path(path, arguments)
    if output is not None and output.resolve() == path.resolve():
        raise PointCloudError(f"The output {output} would overwrite its input. Choose another name.")
    obj = files.load(path, arguments.object)
    reason = obstacle(obj)
    if reason:
        raise PointCloudError(reason)
    for name in options.ALL_NAMES:
        value = getattr(arguments, name)
        if value is not None:
            setattr(obj.meshfree, name, value)
    check_writable(obj, analysis_names(min(arguments.modes, arguments.write_limit)), obj.meshfree.make_single_user)
    analysis = analyze_object(bpy.context, obj, arguments.modes)
    write_result(obj, analysis, arguments.write_limit)
    if output is not None:
        files.save(output, obj, analysis)
    return {
        "points": len(analysis.laplacian.areas),
        "total_area": analysis.total_area,
        **analysis.counts,
        "eigenvalues": [] if analysis.spectrum is None else analysis.spectrum.eigenvalues.tolist(),
        "seconds": {name: round(seconds, 3) for name, seconds in analysis.seconds.items()},
        "notices": analysis.notices,
        "output": None if output is None else str(output),
    }
