"""Records of what was done to each file: reports of lines of JSON, and what need not be done again."""

from __future__ import annotations

import json
import os
import stat
import time
from collections import defaultdict
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from .inputs import outputs_of, read_files

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Sequence

    from .verb import Verb

SUFFIX = ".jsonl"
_NEEDED = {"path", "verb", "settings", "stamps", "elapsed", "ended"}  # in a record
_PLANS = ".plan"  # ending of the file beside a report that tells what is to be in it
_PLANNED = {"planned", "verb", "settings", "share", "of", "files", "began"}  # in a line of that
_NOT_SETTINGS = (
    *("command", "files_from", "inputs", "left_out", "total"),
    *("out", "out_dir", "part", "report", "skip_done"),
)
_UNREACHED = "It was to be processed, and was not reached: the program was stopped before, or is still at work."


def add_report(parser: ArgumentParser) -> None:
    """Add the options for reports."""
    parser.add_argument(
        "--report",
        type=Path,
        metavar="FILE",
        help=f"append a line of JSON for each input to a file, ending in {SUFFIX}, with settings and seconds; errors in"
        " it do not change the exit code",
    )
    parser.add_argument(
        "--skip-done",
        action="store_true",
        help="leave out inputs that a report in the folder of --report says are done with these settings, if neither"
        " they nor their outputs have changed since",
    )


def check_report(parser: ArgumentParser, arguments: Namespace) -> None:
    """Refuse options that miss each other, by `parser.error`."""
    if arguments.report is not None and arguments.report.suffix != SUFFIX:
        parser.error(f"--report must end in {SUFFIX}")
    if arguments.skip_done and arguments.report is None:
        parser.error("--skip-done reads reports: give --report, too")


class Records:
    """The records of a command line."""

    def __init__(self, verb: Verb, arguments: Namespace) -> None:
        self._verb, self._arguments = verb, arguments
        given = {name: value for name, value in vars(arguments).items() if name not in _NOT_SETTINGS}
        self._settings = json.loads(json.dumps(given, default=_plain))
        self._done = defaultdict(list)
        if arguments.skip_done and arguments.report.parent.is_dir():
            for record in read_reports(arguments.report.parent)[0]:
                if "error" not in record and (record["verb"], record.get("settings")) == (verb.name, self._settings):
                    self._done[record["path"]].append(record["stamps"])

    def holds(self, path: Path) -> bool:
        """Whether an input is done, with the same settings, and nothing has changed since."""
        return {**self.read_stamps(path), **self._written_stamps(path)} in self._done[_name(path)]

    def plan(self) -> None:
        """Tell beside the report, if there is one, which inputs are to be processed, so that none is lost unseen."""
        arguments = self._arguments
        if arguments.report is None:
            return
        number, count = arguments.part
        plan = {
            "planned": [_name(path) for path in arguments.inputs],
            "verb": self._verb.name,
            "settings": self._settings,
            "share": number,
            "of": count,
            "files": arguments.total,
            "began": round(time.time(), 3),
        }
        _append(arguments.report.with_suffix(_PLANS), plan)

    def keep(self, path: Path, line: dict[str, Any], seconds: float, read: dict[str, list[int] | None]) -> None:
        """Append the record of an input to the report, if there is one, with what is printed of it.

        `read` is the result of `read_stamps` before it was read.
        """
        if self._arguments.report is None:
            return
        record = {
            "path": _name(path),
            "verb": self._verb.name,
            "settings": self._settings,
            "stamps": {**read, **self._written_stamps(path)},
            "elapsed": round(seconds, 3),
            "ended": round(time.time(), 3),
            **line,
        }
        _append(self._arguments.report, record)

    def read_stamps(self, path: Path) -> dict[str, list[int] | None]:
        """Return size and time of all files that are read for an input, by their paths; None for what is no file."""
        return {_name(file): stamp(file) for file in read_files(self._verb, path, self._arguments)}

    def _written_stamps(self, path: Path) -> dict[str, list[int] | None]:
        return {_name(file): stamp(file) for file in outputs_of(self._verb, path, self._arguments)}


def _name(path: str | Path) -> str:
    return str(Path(path).resolve())


def stamp(path: Path) -> list[int] | None:
    """Return size and time of a file, in nanoseconds; None for what is no file."""
    try:
        known = os.stat(path)
    except OSError:
        return None
    if not stat.S_ISREG(known.st_mode):
        return None
    return [known.st_size, known.st_mtime_ns]


def _plain(value: Any) -> Any:
    """Return settings that are paths or arrays as JSON knows them."""
    return value.tolist() if isinstance(value, np.ndarray) else str(value)


def _append(path: Path, record: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a+b") as file:
        if file.tell() and not _ends_line(file):  # a writer was killed in its last line
            file.write(b"\n")
        file.write(json.dumps(record).encode() + b"\n")  # at once: a killed writer leaves whole lines before it


def _ends_line(file: IO[bytes]) -> bool:
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


def read_reports(folder: Path) -> tuple[list[dict[str, Any]], int]:
    """Read all records in the reports of a folder, in the order in which they ended.

    Return also how many lines are no records: of writers that were killed.
    """
    lines = list(_lines(folder, SUFFIX))
    found = [line for line in lines if line.keys() >= _NEEDED]
    return sorted(found, key=lambda record: record["ended"]), len(lines) - len(found)


def read_plans(folder: Path) -> list[dict[str, Any]]:
    """Read which inputs were to be processed, beside the reports of a folder, in the order in which that began."""
    found = [line for line in _lines(folder, _PLANS) if line.keys() >= _PLANNED]
    return sorted(found, key=lambda plan: plan["began"])


def _lines(folder: Path, ending: str) -> Iterator[dict[str, Any]]:
    """Yield the lines of all files of a folder as dictionaries, empty where they hold something else."""
    for report in sorted(folder.glob(f"*{ending}")):
        for line in report.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                record = json.loads(line)
            except ValueError:
                record = None
            yield record if isinstance(record, dict) else {}


def last_records(records: Sequence[dict[str, Any]], plans: Sequence[dict[str, Any]] = ()) -> list[dict[str, Any]]:
    """Return the last record of each verb on each file by their paths, or that it was planned and not reached.

    Records are in the order in which they ended, plans in that in which they began.
    """
    last = {(record["path"], record["verb"]): record for record in records}
    planned = {(path, plan["verb"]): plan for plan in plans for path in plan["planned"]}
    for (path, verb), plan in planned.items():
        known = last.get((path, verb))
        if known is None or (known["settings"] != plan["settings"] and known["ended"] < plan["began"]):
            last[path, verb] = {"path": path, "verb": verb, "elapsed": 0.0, "unreached": True, "error": _UNREACHED}
    return [last[key] for key in sorted(last)]


def shares_not_begun(plans: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Return the numbers of files in the shares without a plan, beside those of the last plan of each verb."""
    last = {plan["verb"]: plan for plan in plans}
    found = {}
    for verb, plan in last.items():
        job = [plan[name] for name in ("settings", "of", "files")]
        begun = {
            other["share"]
            for other in plans
            if other["verb"] == verb and [other[name] for name in ("settings", "of", "files")] == job
        }
        for share in sorted({*range(1, plan["of"] + 1)} - begun):
            found[f"{verb}, share {share} of {plan['of']}"] = len(range(share - 1, plan["files"], plan["of"]))
    return {name: count for name, count in found.items() if count}
