"""The command line: `blender --command meshfree VERB FILE ...`, from files to files without a window."""

import argparse
import json
from pathlib import Path

import bpy

from ...core import PointCloudError
from ...core.files import numbered_files
from .. import registration
from ..objects.groups import SOURCE
from .bending import Deform, SplatInfo
from .measure_verbs import MeasureFile, ProfileBetween, Section
from .rigging import Rig
from .tool_verbs import AlignWith, AlongCurve, CompareWith, Frames, FromSources, Mesh, Orient
from .transfer_verbs import AttributesFrom, WeightsFrom
from .verbs import Analyze, Apply

_OWN = {
    "align_points": AlignWith,
    "auto_weights": Rig,
    "signed_distance": AlongCurve,
    "measure_parts": MeasureFile,
    "mesh_surface": Mesh,
    "compare": CompareWith,
    "orient_normals": Orient,
    "simulate": Frames,
    "cross_section": Section,
    "profile": ProfileBetween,
    "transfer_attributes": AttributesFrom,
    "transfer_weights": WeightsFrom,
}
_handles = []


def attach():
    """Add the command to Blender."""
    _handles.append(bpy.utils.register_cli_command("meshfree", run))


def detach():
    """Remove the command from Blender."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())


def make_verbs():
    """Return all verbs: the analysis, tools in the order of the menu, and those without an object."""
    groups = [group for home in ("Object", "Points") for group in registration.groups("menu", home)]
    tools = [tool for group in groups for tool in group if tool.verb]
    return [Analyze(), *map(_verb, tools), SplatInfo(), Deform()]


def _verb(tool):
    """Return the verb of a tool: one of its own if it needs more than settings, or the common one."""
    if tool.name in _OWN:
        return _OWN[tool.name]()
    group = getattr(bpy.ops.meshfree, tool.name).get_rna_type().properties.get("group")
    starts = group is not None and group.default == SOURCE
    return (FromSources if starts else Apply)(tool.name, tool.verb)


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
        verb, arguments = _parse(argv)
    except SystemExit as stop:  # from argparse after --help and wrong usage
        return stop.code or 0
    failed = False
    for path in arguments.inputs:
        try:
            result = _process(verb, path, arguments)
        except (PointCloudError, OSError, RuntimeError) as error:  # Blender's importers raise RuntimeError
            failed = True
            result = {"error": str(error).strip().removeprefix("Error: ")}  # the prefix of reported errors
        print(json.dumps({"file": str(path), **result}), flush=True)
    return 1 if failed else 0


def _parse(argv):
    """Return the requested verb and its arguments."""
    parser = argparse.ArgumentParser(prog="blender --command meshfree")
    commands = parser.add_subparsers(dest="command", required=True)
    verbs, parsers = {}, {}
    for verb in make_verbs():
        verbs[verb.name] = verb
        parsers[verb.name] = commands.add_parser(verb.name, help=verb.help, description=verb.description)
        _add_files(parsers[verb.name], verb)
        verb.add_options(parsers[verb.name])
    arguments = parser.parse_args(argv)
    verb, chosen = verbs[arguments.command], parsers[arguments.command]
    if arguments.out is not None and arguments.out.suffix.lower() not in verb.outputs:
        chosen.error(f"--out must end in {', '.join(verb.outputs)}")
    verb.check(chosen, arguments)
    try:
        arguments.inputs = [file for path in arguments.inputs for file in _frames(path)]
    except PointCloudError as error:
        chosen.error(str(error))
    if arguments.out is not None and len(arguments.inputs) > 1:
        chosen.error("--out takes one input; use --out-dir for many")
    outputs = [path for one in arguments.inputs for path in _outputs(verb, one, arguments)]
    if arguments.out_dir is not None and len(set(outputs)) < len(outputs):
        chosen.error("some inputs have the same name and would overwrite each other in --out-dir")
    return verb, arguments


def _add_files(parser, verb):
    """Add the inputs and outputs of a verb."""
    parser.add_argument(
        "inputs", nargs="+", type=Path, metavar="IN", help=f"{verb.inputs}; or folders of numbered ones"
    )
    parser.set_defaults(out=None, out_dir=None)
    if verb.outputs:
        target = parser.add_mutually_exclusive_group()
        target.add_argument("--out", type=Path, metavar="FILE", help=f"output of one input: {', '.join(verb.outputs)}")
        target.add_argument("--out-dir", type=Path, metavar="DIR", help="folder for the outputs of all inputs")
        endings = [suffix[1:] for suffix in verb.outputs]
        parser.add_argument("--format", choices=endings, default=endings[0], help="outputs in the folder")


def _frames(path):
    """Return the numbered files of a folder, or the file itself."""
    return numbered_files(path) if path.is_dir() else [path]


def _output_path(path, arguments):
    if arguments.out_dir is not None:
        return arguments.out_dir / f"{path.stem}.{arguments.format}"
    return arguments.out


def _outputs(verb, path, arguments):
    """Return the paths of all files that are written for an input."""
    output = _output_path(path, arguments)
    return [] if output is None else [output, *verb.beside(output, arguments)]


def _process(verb, path, arguments) -> dict:
    """Process one file, write its output, and return what to print."""
    output = _output_path(path, arguments)
    for read in (path, *(Path(getattr(arguments, name)) for name in verb.reads)):
        for written in _outputs(verb, path, arguments):
            if written.resolve() == read.resolve():
                raise PointCloudError(f"The output {written} would overwrite its input. Choose another name.")
    return {**verb.run(path, arguments, output), "output": None if output is None else str(output)}
