"""A verb of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .inputs import files_in

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from pathlib import Path

DONE, FAILED, WRONG_USAGE, ELSEWHERE = 0, 1, 2, 3  # exit codes; the last where another machine may do it
ONE_LINE = "Writes one JSON line per input, with notices, or the error. The exit code is 1 if any input failed."


class Verb:
    """A command for files. A new one is made for each command line, and may keep what its files share.

    A subclass has methods `run`, and `add_options` for its options.
    """

    name = help = description = ""  # on the command line, help in one line, and in full
    operator = ""  # in Blender, which does the same; else that of the verb's name
    inputs = "files"
    outputs: tuple[
        str, ...
    ] = ()  # endings of its output files, the first one by default in folders; empty for no output
    reads: tuple[str, ...] = ()  # options with other input files, which are never overwritten
    prints_all = False  # whether the line has all results, so that no output is missed

    def add_options(self, parser: ArgumentParser) -> None:
        """Add options beside inputs and outputs."""

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        """Refuse incompatible options, by `parser.error`."""

    def expand(self, path: Path, arguments: Namespace) -> list[Path]:
        """Return the files that an input stands for: those with points in a folder, or itself."""
        return files_in(path) if path.is_dir() else [path]

    def beside(self, output: Path, arguments: Namespace) -> list[Path]:
        """Return the paths of further files that are written beside an output."""
        return []

    def written_once(self, arguments: Namespace) -> list[Path]:
        """Return the paths of files that are written for all inputs together."""
        return []

    def owns(self, path: Path, arguments: Namespace) -> bool:
        """Whether a file in a folder of inputs was written by this verb before, and is neither read nor told."""
        return False

    def failure(self, result: dict[str, Any]) -> int:
        """Return the exit code for a result, in which parts of the work may have failed."""
        return DONE

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        """Process one file, write the output unless it is None, and return what to print."""
        raise NotImplementedError
