"""Run the tests: core without Blender, the wheel, the extension in Blender's module, and in a window with real keys.

As many suites run side by side as there are cores, of the machine, a container or by MESHFREE_CORES, while this
program makes the environments of the next ones; each but the window's in four parts, of every fourth file, so that no
core waits long for the last. With --all each part of core's computes by other kernels of OpenBLAS, on one core and
thread or two, for no result may hang on how these round. What pytest prints goes to a file per suite in build/tests/,
and from there to the screen where a test fails.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor, as_completed

import gui_blender
import package
import pythons
from environments import ROOT, ensure, ensure_blender, isolated, run

sys.path.insert(0, str(ROOT))
from core.cores import cores

RESULTS = ROOT / "build" / "tests"
MEASURED = "core-3.13"  # environment whose coverage is measured, at almost no cost
LIMIT = 2700  # seconds for one run of pytest
KERNELS = ("Haswell", "SkylakeX", "SapphireRapids", "Zen", "Nehalem")  # of OpenBLAS, by its names of processors
_PRODUCT = "import numpy, scipy.linalg; a = numpy.ones((300, 300)); scipy.linalg.eigh(a @ a)"
_PARTS = 4  # of the tests of a folder
_SHOWN = 40  # lines of a run that ended without a word of pytest about what failed


class Suites:
    """Runs of pytest side by side."""

    def __init__(self):
        self._pool = ThreadPoolExecutor(cores())
        self._runs = []
        self._processes = set()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        """Wait for all; after an error or Ctrl-C end those that run, and start no other."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        if kind is not None:
            for process in list(self._processes):
                _end(process)
        self._pool.shutdown()

    def start(self, name, python, *tests, **variables):
        """Run some tests in an environment as soon as a processor is free; see `isolated`."""
        self._runs.append(self._pool.submit(self._run, name, python, tests, variables))

    def start_folder(self, name, python, folder, *options, variables=({},)):
        """Run the tests of a folder in parts, by their files, with these options of pytest; variables take turns.

        Each computes on one core unless they say otherwise: on clouds this small threads wait longer than they work.
        """
        files = sorted(path.relative_to(ROOT) for path in (ROOT / folder).glob("test_*.py"))
        for number in range(_PARTS):
            chosen = {"MESHFREE_CORES": "1", **variables[number % len(variables)]}
            self.start(f"{name}-{number + 1}", python, *options, *files[number::_PARTS], **chosen)

    def results(self):
        """Wait for all; return their outcomes by name."""
        return dict(run.result() for run in as_completed(self._runs))

    def _run(self, name, python, tests, variables):
        report, log = RESULTS / f"{name}.xml", RESULTS / f"{name}.txt"
        report.unlink(missing_ok=True)
        measuring = ["coverage", "run", "-m"] if name.startswith(MEASURED) else []
        command = [str(python), "-m", *measuring, "pytest", *map(str, tests)]
        command += ["-p", "no:cacheprovider", f"--junitxml={report}"]
        chosen = "".join(f" {key}={value}" for key, value in variables.items())
        print(f"{name:13} runs, see {log.relative_to(ROOT)}{chosen}", flush=True)
        began = time.monotonic()
        with log.open("wb") as output:
            # In a session of its own, so that Ctrl-C reaches it once: by `_end`.
            options = {
                "cwd": ROOT,
                "env": isolated(**variables),
                "stdin": subprocess.DEVNULL,
                "start_new_session": True,
            }
            process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, **options)
        self._processes.add(process)
        try:
            # Blender may crash or hang at exit, after pytest's closing line: that is a failure too.
            process.wait(LIMIT)
            ending = f"exit code {process.returncode}"
        except subprocess.TimeoutExpired:
            _end(process)
            ending = f"stopped after {LIMIT} s"
        self._processes.remove(process)
        counts = _count(report)
        sound = process.returncode == 0 and ending.startswith("exit")
        if not sound and not counts["failed"] and not counts["errors"]:
            counts["errors"] = 1
        words = f"{name:13} {_words(counts, time.monotonic() - began)}"
        text = "" if sound else _failures(log.read_text(encoding="utf-8", errors="replace"))
        print(text + words + ("" if sound else f", {ending}"), flush=True)
        return name, counts


def _end(process):
    """End a run that was started here: pytest says where it is and closes its window, or is killed with all it has."""
    if os.name == "nt":
        process.kill()
        return
    try:
        process.send_signal(signal.SIGINT)
        process.wait(20)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _count(report):
    """Count the outcomes in a report of pytest's."""
    suite = ElementTree.parse(report).find("testsuite").attrib if report.exists() else {}
    counts = {word: int(suite.get(key, 0)) for word, key in (("failed", "failures"), ("skipped", "skipped"))}
    counts["errors"] = int(suite.get("errors", 0))
    counts["passed"] = int(suite.get("tests", 0)) - sum(counts.values())
    return counts


def _failures(text):
    """What pytest printed from the first failure on, or its last lines."""
    found = re.search(r"^=+ (ERRORS|FAILURES) =+$", text, re.MULTILINE)
    return text[found.start() :] if found else "".join(text.splitlines(keepends=True)[-_SHOWN:])


def _words(counts, seconds):
    words = [f"{counts[word]} {word}" for word in ("failed", "passed", "skipped", "errors") if counts[word]]
    return f"{', '.join(words)} in {seconds:.2f}s"


def kernels(python):
    """Return the kernels that this processor can run, by what the OpenBLAS of numpy or of scipy says in an environment.

    What OpenBLAS does not have it replaces in a word, and what the processor does not have ends the program.
    """
    found = []
    for name in KERNELS:
        options = {"env": isolated(OPENBLAS_CORETYPE=name, OPENBLAS_VERBOSE="2"), "stdin": subprocess.DEVNULL}
        told = subprocess.run([python, "-c", _PRODUCT], capture_output=True, text=True, check=False, **options)
        if told.returncode == 0 and f"Core: {name}" in (told.stdout + told.stderr).splitlines():
            found.append(name)
    return found


def take_turns(known, first):
    """Return variables for each part of an environment, the first of whose parts has this number among all parts."""
    turns = []
    for number in range(first, first + _PARTS):
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MESHFREE_CORES"), "12"[(number + number // _PARTS) % 2])
        turns.append({"OPENBLAS_CORETYPE": known[number % len(known)], **threads} if known else threads)
    return turns


def tell_coverage(python):
    """Print how much of core the tests have run."""
    command = [python, "-m", "coverage"]
    run([*command, "combine", "--quiet"])
    share = run([*command, "report", "--format=total"], capture_output=True, text=True).stdout.strip()
    print(f"{share} % of the lines of core are run by its tests")


def start_gui(suites, required):
    """Start the tests in a window; where this machine cannot have it, say so, and stop if it is required."""
    try:
        gui_blender.ensure()
    except gui_blender.LeftOutError as error:
        if required:
            sys.exit(f"No test ran: {error}")
        print(f"Left out: tests in a window, for {error}")
        return
    version, python = next(iter(pythons.find().items()))
    suites.start("gui", ensure(f"core-{version}", "test", python), "tests/gui")


def main():
    """Run the tests for the Python to prefer and the newest Blender it has, all that can run here, or the window's."""
    parser = argparse.ArgumentParser(description=__doc__)
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--all", action="store_true", help="every supported Python and Blender that can run here")
    choice.add_argument("--gui", action="store_true", help="only those in a window")
    options = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    for left in RESULTS.glob("coverage*"):  # by runs that were stopped
        left.unlink()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # what stops a run from outside ends its suites too
    began = time.monotonic()
    found = [] if options.gui else list(pythons.find().items())[: None if options.all else 1]
    with Suites() as suites:
        of_core = {f"core-{version}": ensure(f"core-{version}", "test", python) for version, python in found}
        for number, (name, python) in enumerate(of_core.items()):
            turns = take_turns(kernels(python), number * _PARTS) if options.all else ({},)
            suites.start_folder(name, python, "tests/core", variables=turns)
        for version, python in found:
            suites.start(f"wheel-{version}", ensure(f"wheel-{version}", "wheel", python), "tests/wheel")
        package.build([package.this_platform()])
        if options.gui or options.all:  # the longest: not the last
            start_gui(suites, required=options.gui)
        narrowed = ()  # all tests run in the first Blender
        for version, python in found:
            for blender in pythons.BLENDERS[version][: None if options.all else 1]:
                environment = ensure_blender(blender, python)
                turns = ({}, {"MESHFREE_CORES": "2"}) if options.all else ({},)
                suites.start_folder(f"blender-{blender}", environment, "tests/blender", *narrowed, variables=turns)
                narrowed = "-m", "not any_blender"
        results = suites.results()
    if any(name.startswith(MEASURED) for name in results):
        tell_coverage(ensure(MEASURED, "test", pythons.find()[MEASURED.removeprefix("core-")]))
    for version in () if options.gui else pythons.BLENDERS.keys() - pythons.find().keys():
        print(f"Left out: Blender {' and '.join(pythons.BLENDERS[version])}, no Python {version} is found")
    total = {
        word: sum(counts[word] for counts in results.values()) for word in ("failed", "passed", "skipped", "errors")
    }
    print(f"{f' {_words(total, time.monotonic() - began)} ':=^80}")
    sys.exit(bool(total["failed"] + total["errors"]))


if __name__ == "__main__":
    pythons.use_supported()
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("Stopped, and all that ran is ended")
