"""Run the tests: core without Blender, the installed extension in Blender's module, and in a window with real keys."""

import argparse
import itertools
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

import gui_blender
import package
import pythons
from environments import ROOT, ensure, ensure_blender, isolated

RESULTS = ROOT / "build" / "tests"
LIMIT = 1800  # seconds for one run of pytest


def run_pytest(name, python, folder, *options):
    """Run the tests of a folder in an environment and count the outcomes."""
    print(f"\n{name}: {folder}", flush=True)
    RESULTS.mkdir(parents=True, exist_ok=True)
    report = RESULTS / f"{name}.xml"
    report.unlink(missing_ok=True)
    command = [str(python), "-m", "pytest", folder, f"--junitxml={report}", *options]
    began = time.monotonic()
    try:
        # Blender may crash or hang at exit, after pytest's closing line: that is a failure too.
        code = subprocess.run(command, cwd=ROOT, env=isolated(), stdin=subprocess.DEVNULL, timeout=LIMIT).returncode
    except subprocess.TimeoutExpired:
        print(f"{name}: stopped after {LIMIT} s")
        code = -1
    suite = ElementTree.parse(report).find("testsuite").attrib if report.exists() else {}
    counts = {word: int(suite.get(key, 0)) for word, key in (("failed", "failures"), ("skipped", "skipped"))}
    counts["errors"] = int(suite.get("errors", 0))
    counts["passed"] = int(suite.get("tests", 0)) - sum(counts.values())
    if code != 0 and not counts["failed"] and not counts["errors"]:
        print(f"{name}: exit code {code}")
        counts["errors"] = 1
    return {**counts, "seconds": time.monotonic() - began}


def run_gui(required):
    """Run the tests in a window; where this machine cannot have it, say so, and stop if it is required."""
    try:
        gui_blender.ensure()
    except gui_blender.LeftOutError as error:
        if required:
            sys.exit(f"No test ran: {error}")
        print(f"\nLeft out: tests in a window, for {error}")
        return {}
    version, python = next(iter(pythons.find().items()))
    python = ensure(f"core-{version}", "test", python)
    results = {"gui": run_pytest("gui", python, "tests/gui", "--cache-clear")}
    if results["gui"]["failed"] + results["gui"]["errors"]:
        # A window on a busy machine may lose a key or draw too late; what fails for a reason fails again.
        print("\nSome tests in the window failed: these once more")
        results["gui"] = run_pytest("gui", python, "tests/gui", "--last-failed")
    return results


def report(results):
    """Print a line per run and their sum in pytest's words."""
    print()
    for name, counts in results.items():
        print(f"{name:12} {_words(counts)}")
    total = {key: sum(counts[key] for counts in results.values()) for key in next(iter(results.values()))}
    print(f"{f' {_words(total)} ':=^80}")
    return total["failed"] + total["errors"]


def _words(counts):
    words = [f"{counts[word]} {word}" for word in ("failed", "passed", "skipped", "errors") if counts[word]]
    return f"{', '.join(words)} in {counts['seconds']:.2f}s"


def run_modules(everything):
    """Run the tests of core and in Blender's module: for the Python to prefer, or for all that can run here."""
    results = {}
    found = pythons.find() if everything else dict(itertools.islice(pythons.find().items(), 1))
    for version, python in found.items():
        name = f"core-{version}"
        results[name] = run_pytest(name, ensure(name, "test", python), "tests/core")
        for blender in pythons.BLENDERS[version][: None if everything else 1]:
            name = f"blender-{blender}"
            results[name] = run_pytest(name, ensure_blender(blender, python), "tests/blender")
    for version in pythons.BLENDERS.keys() - pythons.find().keys():
        print(f"\nLeft out: Blender {' and '.join(pythons.BLENDERS[version])}, no Python {version} is found")
    return results


def main():
    """Run the tests for the Python to prefer and the newest Blender it has, all that can run here, or the window's."""
    parser = argparse.ArgumentParser(description=__doc__)
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--all", action="store_true", help="every supported Python and Blender that can run here")
    choice.add_argument("--gui", action="store_true", help="only those in a window")
    options = parser.parse_args()
    package.build([package.this_platform()])
    results = {} if options.gui else run_modules(options.all)
    if options.gui or options.all:
        results.update(run_gui(required=options.gui))
    sys.exit(bool(report(results)))


if __name__ == "__main__":
    pythons.use_supported()
    main()
