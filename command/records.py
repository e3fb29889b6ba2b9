"""Records of what was done to each file: reports of lines of JSON, and what need not be done again."""

import json
import os
import stat
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

from .inputs import outputs_of, read_files

SUFFIX = ".jsonl"
_NEEDED = {"path", "verb", "settings", "stamps", "elapsed", "ended"}  # in a record
_NOT_SETTINGS = ("command", "files_from", "inputs", "out", "out_dir", "part", "report", "skip_done")


def add_report(parser):
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


def check_report(parser, arguments):
    """Refuse options that miss each other, by `parser.error`."""
    if arguments.report is not None and arguments.report.suffix != SUFFIX:
        parser.error(f"--report must end in {SUFFIX}")
    if arguments.skip_done and arguments.report is None:
        parser.error("--skip-done reads reports: give --report, too")


class Records:
    """The records of a command line.

    Parameters
    ----------
    verb : Verb
    arguments : argparse.Namespace
    """

    def __init__(self, verb, arguments):
        self._verb, self._arguments = verb, arguments
        given = {name: value for name, value in vars(arguments).items() if name not in _NOT_SETTINGS}
        self._settings = json.loads(json.dumps(given, default=_plain))
        self._done = defaultdict(list)
        if arguments.skip_done and arguments.report.parent.is_dir():
            for record in read_reports(arguments.report.parent)[0]:
                if "error" not in record and (record["verb"], record.get("settings")) == (verb.name, self._settings):
                    self._done[record["path"]].append(record["stamps"])

    def holds(self, path) -> bool:
        """Whether an input is done, with the same settings, and nothing has changed since."""
        return {**self.read_stamps(path), **self._written_stamps(path)} in self._done[_name(path)]

    def keep(self, path, line, seconds, read):
        """Append the record of an input to the report, if there is one.

        Parameters
        ----------
        path : pathlib.Path
        line : dict
            What is printed of it.
        seconds : float
        read : dict
            The result of `read_stamps` before it was read.
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
        self._arguments.report.parent.mkdir(parents=True, exist_ok=True)
        with open(self._arguments.report, "a+b") as file:
            if file.tell() and not _ends_line(file):  # a writer was killed in its last line
                file.write(b"\n")
            file.write(json.dumps(record).encode() + b"\n")  # at once: a killed writer leaves whole lines before it

    def read_stamps(self, path) -> dict:
        """Return size and time of all files that are read for an input, by their paths; None for what is no file."""
        return {_name(file): _stamp(file) for file in read_files(self._verb, path, self._arguments)}

    def _written_stamps(self, path):
        return {_name(file): _stamp(file) for file in outputs_of(self._verb, path, self._arguments)}


def _name(path):
    return str(Path(path).resolve())


def _stamp(path):
    try:
        known = os.stat(path)
    except OSError:
        return None
    if not stat.S_ISREG(known.st_mode):
        return None
    return [known.st_size, known.st_mtime_ns]


def _plain(value):
    """Return settings that are paths or arrays as JSON knows them."""
    return value.tolist() if isinstance(value, np.ndarray) else str(value)


def _ends_line(file):
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


def read_reports(folder):
    """Read all reports of a folder.

    Parameters
    ----------
    folder : pathlib.Path

    Returns
    -------
    list of dict
        All records in the order in which they ended.
    int
        How many lines are no records: of writers that were killed.
    """
    found, broken = [], 0
    for report in sorted(folder.glob(f"*{SUFFIX}")):
        for line in report.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                record = json.loads(line)
            except ValueError:
                record = None
            if isinstance(record, dict) and record.keys() >= _NEEDED:
                found.append(record)
            else:
                broken += 1
    return sorted(found, key=lambda record: record["ended"]), broken


def last_records(records) -> list:
    """Return the last record of each verb on each file, of records in the order in which they ended, by their paths."""
    last = {(record["path"], record["verb"]): record for record in records}
    return [last[key] for key in sorted(last)]
