"""The command line: from files to files, by verbs."""

import argparse
import json
import sys
from pathlib import Path

from . import core
from .verbs import make_verbs


def main() -> int:
    """Run the program `meshfree`, which needs no Blender."""
    return run(sys.argv[1:], make_verbs(), "meshfree")


def run(argv, verbs, program) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : list of str
        What follows the name of the program.
    verbs : list of Verb
    program : str
        How it is called, for the help.

    Returns
    -------
    int
        Exit code: 0 if all files succeeded, 1 if any failed, 2 for wrong usage.
    """
    try:
        verb, arguments = _parse(argv, verbs, program)
    except SystemExit as stop:  # from argparse after --help and wrong usage
        return stop.code or 0
    failed = False
    for path in arguments.inputs:
        try:
            result = _process(verb, path, arguments)
        except (core.PointCloudError, OSError, RuntimeError) as error:  # Blender's importers raise RuntimeError
            failed = True
            result = {"error": str(error).strip().removeprefix("Error: ")}  # the prefix of reported errors
        print(json.dumps({"file": str(path), **result}), flush=True)
    return 1 if failed else 0


def _parse(argv, verbs, program):
    """Return the requested verb and its arguments."""
    parser = argparse.ArgumentParser(prog=program)
    commands = parser.add_subparsers(dest="command", required=True)
    parsers = {}
    for verb in verbs:
        parsers[verb.name] = commands.add_parser(verb.name, help=verb.help, description=verb.description)
        _add_files(parsers[verb.name], verb)
        verb.add_options(parsers[verb.name])
    arguments = parser.parse_args(argv)
    chosen = parsers[arguments.command]
    verb = next(verb for verb in verbs if verb.name == arguments.command)
    if arguments.out is not None and arguments.out.suffix.lower() not in verb.outputs:
        chosen.error(f"--out must end in {', '.join(verb.outputs)}")
    verb.check(chosen, arguments)
    try:
        arguments.inputs = [file for path in arguments.inputs for file in _frames(path)]
    except core.PointCloudError as error:
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
    return core.files.numbered_files(path) if path.is_dir() else [path]


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
                raise core.PointCloudError(f"The output {written} would overwrite its input. Choose another name.")
    return {**verb.run(path, arguments, output), "output": None if output is None else str(output)}
