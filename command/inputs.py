"""Which files a command line reads and writes."""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from . import core
from .clouds import hint
from .naming import natural
from .stages import tell_aside

if TYPE_CHECKING:
    from collections.abc import Sequence

_READ = (*core.files.READABLE, *core.files.SPLATS)


class FileVerb(Protocol):
    """What a verb tells of its files, as `verb.Verb` has it."""

    @property
    def inputs(self) -> str:
        """What is read."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Endings of its output files."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Options with other input files."""

    def expand(self, path: Path, arguments: argparse.Namespace) -> list[Path]: ...

    def beside(self, output: Path, arguments: argparse.Namespace) -> list[Path]: ...

    def written_once(self, arguments: argparse.Namespace) -> list[Path]: ...

    def owns(self, path: Path, arguments: argparse.Namespace) -> bool: ...


def add_files(parser: argparse.ArgumentParser, verb: FileVerb) -> None:
    """Add the options for the inputs and outputs of a verb."""
    parser.add_argument(
        "inputs", nargs="*", type=Path, metavar="IN", help=f"{verb.inputs}; or folders of such, in the order of numbers"
    )
    parser.add_argument(
        "--files-from", metavar="LIST", help="file with the names of further inputs, one a line; - for standard input"
    )
    parser.add_argument(
        "--part",
        type=parse_share,
        default=(1, 1),
        metavar="K/N",
        help="process the K-th of N equal shares of the inputs only: every N-th file from the K-th on",
    )
    parser.set_defaults(out=None, out_dir=None)
    if verb.outputs:
        target = parser.add_mutually_exclusive_group()
        target.add_argument("--out", type=Path, metavar="FILE", help=f"output of one input: {', '.join(verb.outputs)}")
        target.add_argument("--out-dir", type=Path, metavar="DIR", help="folder for the outputs of all inputs")
        endings = [suffix[1:] for suffix in verb.outputs]
        parser.add_argument("--format", choices=endings, default=endings[0], help="outputs in the folder")


def add_choices(parser: argparse.ArgumentParser) -> None:
    """Add the options for what is read of files."""
    add_las_choices(parser)
    parser.add_argument(
        "--columns",
        default="",
        metavar="NAMES",
        help='names of the columns of text files, such as "x y z - r g b"; else those found',
    )


def add_las_choices(parser: argparse.ArgumentParser) -> None:
    """Add the options for what is read of LAS files."""
    parser.add_argument(
        "--classes", default="", metavar="NUMBERS", help='classes of LAS files to read, such as "2 5"; else all'
    )
    parser.add_argument("--withheld", action="store_true", help="read points of LAS files, too, that are withheld")
    parser.add_argument(
        "--meters", action="store_true", help="convert coordinates of LAS files that are in feet or the like to meters"
    )


def las_choices(arguments: argparse.Namespace) -> core.files.LasChoices:
    """Return which points of LAS files these options ask for, and in which unit."""
    return core.files.LasChoices(core.files.parse_classes(arguments.classes), arguments.withheld, arguments.meters)


def parse_share(text: str) -> tuple[int, int]:
    """Parse K/N, the K-th of N equal shares, for an option."""
    match = re.fullmatch(r"(\d+)/(\d+)", text, re.ASCII)
    number, count = map(int, match.groups()) if match else (0, 0)
    if not 1 <= number <= count:
        raise argparse.ArgumentTypeError(f"{text!r} is not K/N, such as 1/4, with K from 1 to N")
    return number, count


def find_inputs(parser: argparse.ArgumentParser, verb: FileVerb, arguments: argparse.Namespace) -> None:
    """Set the inputs to the files of this share, and refuse those that cannot be processed, by `parser.error`.

    What folders have besides is told by the notices `left_out`, and `total` is the number of files of all shares.
    """
    if arguments.out is not None and arguments.out.suffix.lower() not in verb.outputs:
        parser.error(f"--out must end in {', '.join(verb.outputs)}.{hint(arguments.out)}")
    files, arguments.left_out = [], []
    try:
        given = [*arguments.inputs, *_listed(arguments.files_from)]
        if not given:
            parser.error("nothing says what to read: name files, or a list of them by --files-from")
        for path in given:
            found = verb.expand(path, arguments)
            files += found
            if found != [path]:
                arguments.left_out += _others(path, found, verb, arguments)
    except core.PointCloudError as error:
        parser.error(str(error))
    if arguments.out is not None and len(files) > 1:
        parser.error("--out takes one input; use --out-dir for many")
    written = [path for one in files for path in outputs_of(verb, one, arguments)]
    if arguments.out_dir is not None and len(set(written)) < len(written):
        parser.error("some inputs have the same name and would overwrite each other in --out-dir")
    number, count = arguments.part
    arguments.inputs, arguments.total = files[number - 1 :: count], len(files)


def _others(folder: Path, taken: list[Path], verb: FileVerb, arguments: argparse.Namespace) -> list[str]:
    """Return notices of the files in a folder that are no inputs, and print them."""
    names = {path.name for path in taken}
    paths = (path for path in folder.iterdir() if path.name not in names and path.name[0] != ".")
    others = [path.name for path in paths if path.is_file() and not verb.owns(path, arguments)]
    if not others:
        return []
    shown = ", ".join(sorted(others, key=natural)[:_SHOWN]) + (", ..." if len(others) > _SHOWN else "")
    notice = f"Left out {len(others)} of the files in {folder}: {shown}."
    tell_aside(notice)
    return [notice]


def check_outputs(verb: FileVerb, arguments: argparse.Namespace) -> None:
    """Refuse to begin, by `PointCloudError`, where an output cannot be written, or a package for it is missing."""
    written = [path for one in arguments.inputs for path in outputs_of(verb, one, arguments)]
    written += verb.written_once(arguments)
    folders = {path.parent: path for path in written}
    for path in written:
        if path.is_dir():
            raise core.PointCloudError(f"{path} is a folder. Choose another name.")
    if any(path.suffix.lower() in core.files.SCANS for path in written):
        core.files.import_las()
    for folder, path in folders.items():
        with core.files.writing(path):
            tempfile.TemporaryFile(dir=next(home for home in (folder, *folder.parents) if home.exists())).close()


def check_beside(parser: argparse.ArgumentParser, arguments: argparse.Namespace, option: str) -> None:
    """Refuse an option for a further file beside the output, if there is none, by `parser.error`."""
    if getattr(arguments, option) and arguments.out is None and arguments.out_dir is None:
        parser.error(f"--{option} writes a file beside the output: give --out or --out-dir, too")


def _listed(source: str | None) -> list[Path]:
    """Return the paths in a list; none without one."""
    if source is None:
        return []
    try:
        text = sys.stdin.read() if source == "-" else Path(source).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise core.PointCloudError(f"The list {source} cannot be read: {error}. Check its name.") from error
    return [Path(line.strip()) for line in text.splitlines() if line.strip()]


def files_in(folder: Path, endings: Sequence[str] = _READ) -> list[Path]:
    """Return all files with points in a folder, of these endings, ordered by numbers."""
    try:
        paths = [path for path in folder.iterdir() if path.suffix.lower() in endings and path.is_file()]
    except OSError as error:
        raise core.PointCloudError(
            f"The folder {folder} cannot be read: {error.strerror or error}. Check it."
        ) from error
    if not paths:
        raise core.PointCloudError(f"{folder} has no files with points. Name one with files of {', '.join(endings)}.")
    return sorted(paths, key=lambda path: natural(path.name))


_SHOWN = 5  # names of what is left out


def output_path(path: Path, arguments: argparse.Namespace) -> Path | None:
    """Return the path of the main output of an input, or None."""
    if arguments.out_dir is not None:
        return arguments.out_dir / f"{path.stem}.{arguments.format}"
    return arguments.out


def outputs_of(verb: FileVerb, path: Path, arguments: argparse.Namespace) -> list[Path]:
    """Return the paths of all files that are written for an input."""
    output = output_path(path, arguments)
    return [] if output is None else [output, *verb.beside(output, arguments)]


def read_files(verb: FileVerb, path: Path, arguments: argparse.Namespace) -> list[Path]:
    """Return the paths of all files that are read for an input."""
    others = (getattr(arguments, name) for name in verb.reads)
    return [path, *map(Path, filter(None, others))]
