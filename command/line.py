"""The command line: from files to files, by verbs."""

from __future__ import annotations

import argparse
import contextlib
import errno
import json
import re
import sys
import traceback
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NoReturn

from . import core
from .inputs import add_files, check_outputs, find_inputs, output_path, outputs_of, read_files
from .records import Records, add_report, check_report
from .stages import silence, tell_aside
from .verb import DONE, ELSEWHERE, FAILED, WRONG_USAGE
from .verbs import Frames

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .verb import Verb

_SCARCE = {errno.ENOMEM, errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # of errors that another machine may not have
_NOT_WRITTEN = "No file is written: neither --out nor --out-dir is given."
_PACKAGE = "meshfree-laplacian"
_EXPECTED = (core.PointCloudError, OSError, RuntimeError, MemoryError)  # Blender raises RuntimeError


def run(argv: list[str], verbs: Sequence[Verb], program: str) -> int:
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
        without a report, or that cannot be written; 2 for wrong usage, such as outputs that cannot be written; 3 if
        memory or disk were not enough, so that another machine may do it.
    """
    try:
        verb, arguments = _parse(argv, verbs, program)
    except SystemExit as stop:  # from argparse after --help and wrong usage
        return int(stop.code or DONE)
    with contextlib.ExitStack() as stack:
        try:
            check_outputs(verb, arguments)
            notices = _others_at_work(arguments, stack)
            records = Records(verb, arguments)
            with core.files.writing(arguments.report):
                records.plan()
        except core.PointCloudError as error:
            tell_aside(f"{program} {verb.name}: {error}")
            return ELSEWHERE if _is_scarcity(error) else WRONG_USAGE
        if arguments.out is None and arguments.out_dir is None and isinstance(verb, Frames):
            tell_aside(f"{program} {verb.name}: {_NOT_WRITTEN}")
        code = DONE
        for place, path in enumerate(arguments.inputs):
            told = [*notices, *([] if place else arguments.left_out)]
            code = max(code, _do(verb, path, arguments, records, told))
        return code


def _others_at_work(arguments: argparse.Namespace, stack: contextlib.ExitStack) -> list[str]:
    """Hold the share of the folder for outputs, if there is one, on a stack; return notices if another run does."""
    if arguments.out_dir is None:
        return []
    number, count = arguments.part
    if not arguments.out_dir.exists():
        stack.callback(_delete_empty, arguments.out_dir)
    alone = stack.enter_context(core.files.holding_folder(arguments.out_dir, f".share-{number}-of-{count}.lock"))
    return [] if alone else [f"Another run is at work on the same share of {arguments.out_dir}."]


def _delete_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _do(verb: Verb, path: Path, arguments: argparse.Namespace, records: Records, notices: list[str]) -> int:
    """Process an input, tell and record how that went, and return the exit code for it."""
    if records.holds(path):
        return _tell({"file": str(path), "skipped": True, **({"notices": notices} if notices else {})})
    began, read = perf_counter(), records.read_stamps(path)
    try:
        result = _process(verb, path, arguments)
        code = verb.failure(result)
    except Exception as error:  # of any sort, so that the other files are done, and this one is in the report
        result, code = {"error": _text(error)}, ELSEWHERE if _is_scarcity(error) else FAILED
        if not isinstance(error, _EXPECTED):
            traceback.print_exc()
    if notices:
        result["notices"] = [*notices, *result.get("notices", ())]
    if code == FAILED and arguments.report is not None:
        code = DONE
    line = {"file": str(path), **result}
    code = max(code, _tell(line))
    try:
        records.keep(path, line, perf_counter() - began, read)
    except OSError as error:
        tell_aside(f"{arguments.report} cannot be written: {error.strerror or error}")
        code = max(code, ELSEWHERE if _is_scarcity(error) else FAILED)
    return code


def _tell(line: dict[str, Any]) -> int:
    """Print a line of JSON, and return the exit code for that: the disk that it goes to may be full."""
    try:
        print(json.dumps(line), flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        silence(sys.stdout)
        tell_aside(f"Standard output cannot be written: {error.strerror or error}")
        return ELSEWHERE if _is_scarcity(error) else FAILED
    return DONE


def _text(error: Exception) -> str:
    """Return the text of an error, without the prefix of those that Blender reports; and its kind, if it has a bug."""
    text = str(error).strip().removeprefix("Error: ")
    return text if isinstance(error, _EXPECTED) and text else f"{type(error).__name__}: {text}".removesuffix(": ")


def _is_scarcity(error: BaseException | None) -> bool:
    """Whether an error, or its cause, is a want of memory or disk."""
    while error is not None:
        if isinstance(error, (core.NotEnoughMemoryError, MemoryError)) or getattr(error, "errno", None) in _SCARCE:
            return True
        error = error.__cause__
    return False


class _Parser(argparse.ArgumentParser):
    """A parser that tells of wrong usage in one line; that of a verb gets its options where it is chosen."""

    verb: Verb | None = None

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # which that of all verbs calls
        if self.verb is not None:
            add_files(self, self.verb)
            add_report(self)
            self.verb.add_options(self)
            self.set_defaults(command=(self.verb, self))
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        text = " ".join(message.split())
        self.exit(WRONG_USAGE, f"{self.prog}: {text}{'' if text.endswith('.') else '.'} See {self.prog} --help.\n")


def _parse(argv: list[str], verbs: Sequence[Verb], program: str) -> tuple[Verb, argparse.Namespace]:
    """Return the requested verb and its arguments."""
    parser = _Parser(prog=program)
    parser.add_argument("--version", action="version", version=f"meshfree {_version()}")
    commands = parser.add_subparsers(metavar="VERB", required=True)
    groups = {}  # of verbs of two words, by the first
    for verb in verbs:
        first, _, second = verb.name.rpartition(" ")
        if first and first not in groups:
            group = commands.add_parser(first, help=f"verbs of their own: {program} {first} --help")
            groups[first] = group.add_subparsers(metavar="VERB", required=True)
        known = (groups[first] if first else commands).add_parser(second, help=verb.help, description=verb.description)
        known.verb = verb
    arguments = parser.parse_args([*" ".join(argv[:1]).split(), *argv[1:]])  # two words may come as one
    verb, chosen = arguments.command
    check_report(chosen, arguments)
    find_inputs(chosen, verb, arguments)
    verb.check(chosen, arguments)
    return verb, arguments


def _version() -> str:
    """Return the version of the extension, or of the wheel that this is installed from."""
    manifest = Path(__file__).parents[1] / "blender_manifest.toml"
    if manifest.exists():
        [found] = re.findall(r'^version = "(.+)"', manifest.read_text(encoding="utf-8"), re.MULTILINE)
        return str(found)
    try:
        return version(_PACKAGE)
    except PackageNotFoundError:
        return "of unknown number"


def _process(verb: Verb, path: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """Process one file, write its output, and return what to print."""
    output, written = output_path(path, arguments), outputs_of(verb, path, arguments)
    for read in read_files(verb, path, arguments):
        for one in written:
            if one.resolve() == read.resolve():
                raise core.PointCloudError(f"The output {one} would overwrite its input. Choose another name.")
    result = verb.run(path, arguments, output)
    if output is None and verb.outputs and not verb.prints_all:
        result["notices"] = [*result.get("notices", ()), _NOT_WRITTEN]
    return {**result, "output": None if output is None else str(output)}
