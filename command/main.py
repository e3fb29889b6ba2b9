"""The command line: from files to files, by verbs."""

import argparse
import errno
import json
import sys
from time import perf_counter

from . import core
from .inputs import add_files, find_inputs, output_path, outputs_of, read_files
from .records import Records, add_report, check_report
from .verbs import make_verbs

DONE, FAILED, WRONG_USAGE, ELSEWHERE, STOPPED = 0, 1, 2, 3, 130  # exit codes
_SCARCE = {errno.ENOMEM, errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # of errors that another machine may not have


def main() -> int:
    """Run the program `meshfree`, which needs no Blender; stopped by Ctrl-C it says so, and the exit code is 130."""
    try:
        return run(sys.argv[1:], make_verbs(), "meshfree")
    except KeyboardInterrupt:
        print("Stopped", file=sys.stderr)
        return STOPPED


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
        Exit code: 0 if all files succeeded, or their errors are in the report that was asked for; 1 if any failed
        without a report, or that cannot be written; 2 for wrong usage; 3 if memory or disk were not enough, so that
        another machine may do it.
    """
    try:
        verb, arguments = _parse(argv, verbs, program)
    except SystemExit as stop:  # from argparse after --help and wrong usage
        return stop.code or DONE
    records, code = Records(verb, arguments), DONE
    for path in arguments.inputs:
        if records.holds(path):
            print(json.dumps({"file": str(path), "skipped": True}), flush=True)
            continue
        began, read = perf_counter(), records.read_stamps(path)
        try:
            result = _process(verb, path, arguments)
        except (core.PointCloudError, OSError, RuntimeError, MemoryError) as error:  # Blender raises RuntimeError
            result = {"error": _text(error)}
            told = DONE if arguments.report is not None else FAILED
            code = max(code, ELSEWHERE if _is_scarcity(error) else told)
        line = {"file": str(path), **result}
        print(json.dumps(line), flush=True)
        try:
            records.keep(path, line, perf_counter() - began, read)
        except OSError as error:
            print(f"{arguments.report} cannot be written: {error.strerror or error}", file=sys.stderr, flush=True)
            code = max(code, ELSEWHERE if _is_scarcity(error) else FAILED)
    return code


def _text(error):
    """Return the text of an error, without the prefix of those that Blender reports."""
    return str(error).strip().removeprefix("Error: ") or type(error).__name__


def _is_scarcity(error) -> bool:
    """Whether an error, or its cause, is a want of memory or disk."""
    while error is not None:
        if isinstance(error, (core.NotEnoughMemoryError, MemoryError)) or getattr(error, "errno", None) in _SCARCE:
            return True
        error = error.__cause__
    return False


def _parse(argv, verbs, program):
    """Return the requested verb and its arguments."""
    parser = argparse.ArgumentParser(prog=program)
    commands = parser.add_subparsers(dest="command", required=True)
    parsers = {}
    for verb in verbs:
        parsers[verb.name] = commands.add_parser(verb.name, help=verb.help, description=verb.description)
        add_files(parsers[verb.name], verb)
        add_report(parsers[verb.name])
        verb.add_options(parsers[verb.name])
    if " ".join(argv[:2]) in parsers:  # a verb of two words
        argv = [" ".join(argv[:2]), *argv[2:]]
    arguments = parser.parse_args(argv)
    chosen = parsers[arguments.command]
    verb = next(verb for verb in verbs if verb.name == arguments.command)
    check_report(chosen, arguments)
    find_inputs(chosen, verb, arguments)
    verb.check(chosen, arguments)
    return verb, arguments


def _process(verb, path, arguments) -> dict:
    """Process one file, write its output, and return what to print."""
    output, written = output_path(path, arguments), outputs_of(verb, path, arguments)
    for read in read_files(verb, path, arguments):
        for one in written:
            if one.resolve() == read.resolve():
                raise core.PointCloudError(f"The output {one} would overwrite its input. Choose another name.")
    return {**verb.run(path, arguments, output), "output": None if output is None else str(output)}
