"""The scripts for render farms, run for real with the installed program on eight clouds, one of them broken."""

import csv
import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.wheel.conftest import ROOT, call, program

FARM = ROOT / "farm"
OPTIONS = ["--by", "number", "--count", "50", "--format", "xyz"]
SLURM = shutil.which("sinfo") is not None and subprocess.run(["sinfo"], capture_output=True).returncode == 0
pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")


@pytest.fixture
def folder(tmp_path):
    """A folder whose name has a space, with eight clouds in `in`, one of them broken."""
    folder = tmp_path / "a job"
    (folder / "in").mkdir(parents=True)
    for number in range(8):
        np.save(folder / "in" / f"tile {number}.npy", np.random.default_rng(number).random((200, 3)) * [9.0, 9.0, 0.1])
    (folder / "in" / "tile 3.npy").write_bytes(b"nothing")
    return folder


@pytest.fixture
def by_hand(place, folder):
    """What the program writes without a farm, the bytes of each file by its name."""
    given = [program(place, "meshfree"), "thin-out", folder / "in", "--out-dir", folder / "hand", *OPTIONS]
    done = subprocess.run(list(map(str, given)), capture_output=True, text=True)
    assert done.returncode == 1
    return written(folder / "hand")


def written(out):
    """The bytes of all results in a folder, by their names."""
    return {path.name: path.read_bytes() for path in out.glob("*.xyz")}


def check(folder, by_hand):
    """All is done, as by hand, and the report holds the error."""
    assert len(by_hand) == 7
    assert written(folder / "out") == by_hand
    assert not [path for path in (folder / "out").iterdir() if ".part" in path.name]
    with open(folder / "out" / "report.csv", newline="") as file:
        *rows, total = csv.DictReader(file)
    assert [row["path"].rpartition("/")[2] for row in rows if row["error"]] == ["tile 3.npy"]
    count = sum(len(data.splitlines()) - 1 for data in by_hand.values())
    assert (len(rows), total["path"], total["points"]) == (8, "8 files, 1 failed", str(count))


def openjd(folder, command, parts=2):
    """Run the job of Open Job Description."""
    values = {
        "InputDir": folder / "in",
        "OutputDir": folder / "out",
        "Verb": "thin-out",
        "Options": shlex.join(OPTIONS),
        "Parts": parts,
        "Program": shlex.join(map(str, command)),
    }
    given = [word for name, value in values.items() for word in ("-p", f"{name}={value}")]
    return subprocess.run(
        [sys.executable, "-m", "openjd", "run", str(FARM / "openjd" / "template.yaml"), *given],
        capture_output=True,
        text=True,
        cwd=folder,
    )


KILLED_ONCE = """#!{python}
import os, signal, subprocess, sys, time
from pathlib import Path
program, mark = {program!r}, Path({mark!r})
if not mark.exists():
    mark.touch()
    worker = subprocess.Popen([program, *sys.argv[1:]])
    report = Path(sys.argv[sys.argv.index("--report") + 1])
    while not (report.exists() and report.read_bytes().count(b"\\n")):
        time.sleep(0.001)
    worker.send_signal(signal.SIGKILL)
    sys.exit(128 - worker.wait())
os.execv(program, [program, *sys.argv[1:]])
"""


class TestOpenJobDescription:
    def test_the_template_is_valid(self):
        pytest.importorskip("openjd.cli")
        done = call(sys.executable, "-m", "openjd", "check", FARM / "openjd" / "template.yaml", cwd=ROOT)
        assert "passes validation" in done

    def test_a_worker_is_killed_and_the_job_resumed(self, place, folder, by_hand):
        pytest.importorskip("openjd.cli")
        once = folder / "killed once"
        given = {"python": sys.executable, "program": str(program(place, "meshfree")), "mark": str(folder / "mark")}
        once.write_text(KILLED_ONCE.format(**given))
        once.chmod(0o755)
        first = openjd(folder, [once])
        assert first.returncode != 0
        [report] = (folder / "out" / "reports").glob("*.jsonl")
        kept = [json.loads(line) for line in report.read_text().splitlines()]
        before = {record["output"]: Path(record["output"]).stat().st_mtime_ns for record in kept if "output" in record}
        assert before
        second = openjd(folder, [once])
        assert second.returncode == 0, second.stdout + second.stderr
        assert {path: Path(path).stat().st_mtime_ns for path in before} == before
        check(folder, by_hand)


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node, in which a double of Flamenco's manager runs")
class TestFlamenco:
    @staticmethod
    def compiled(**settings):
        script, double = FARM / "flamenco" / "meshfree_files.js", ROOT / "tests" / "farm" / "flamenco_manager.js"
        return subprocess.run(["node", double, script, json.dumps(settings)], capture_output=True, text=True)

    def test_its_tasks_do_the_job(self, place, folder, by_hand):
        given = {"input_dir": str(folder / "in"), "output_dir": str(folder / "out"), "parts": 3, "verb": "thin-out"}
        made = self.compiled(**given, options=shlex.join(OPTIONS), program=shlex.quote(str(program(place, "meshfree"))))
        assert made.returncode == 0, made.stderr
        job = json.loads(made.stdout)
        *shares, report = job["tasks"]
        assert [task["name"] for task in shares] == ["part-1", "part-2", "part-3"]
        assert report["dependencies"] == ["part-1", "part-2", "part-3"]
        for task in job["tasks"]:
            for command in task["commands"]:
                call(command["parameters"]["exe"], *command["parameters"]["args"])
        check(folder, by_hand)

    def test_every_setting_is_described(self):
        made = json.loads(self.compiled(input_dir="/in", output_dir="/out").stdout)
        assert len(made["tasks"]) == 11
        assert all(setting["description"] for setting in made["settings"])

    def test_words_with_spaces_stay_together(self):
        given = {"input_dir": "/a b/in", "output_dir": "/a b/out", "parts": 1}
        made = self.compiled(**given, options="--columns 'x y z'", program='"/my apps/blender" --command meshfree')
        [[share], _] = [task["commands"] for task in json.loads(made.stdout)["tasks"]]
        assert share["parameters"]["exe"] == "/my apps/blender"
        assert share["parameters"]["args"][:4] == ["--command", "meshfree", "analyze", "/a b/in"]
        assert share["parameters"]["args"][-2:] == ["--columns", "x y z"]

    @pytest.mark.parametrize(("name", "value"), [("program", " "), ("parts", 0)])
    def test_settings_that_make_no_job_are_told(self, name, value):
        made = self.compiled(input_dir="/in", output_dir="/out", **{name: value})
        assert made.returncode != 0
        assert f"The setting {name} is" in made.stderr


class TestSlurm:
    SCRIPT = FARM / "slurm" / "meshfree.sh"

    def run(self, *arguments, **variables):
        own = ("SLURM", "MESHFREE")  # but for where Slurm's settings are
        environment = {
            name: os.environ[name] for name in os.environ if name == "SLURM_CONF" or not name.startswith(own)
        }
        given = ["bash", str(self.SCRIPT), *map(str, arguments)]
        return subprocess.run(given, capture_output=True, text=True, env={**environment, **variables})

    def test_its_tasks_do_the_job(self, place, folder, by_hand):
        """As Slurm starts them, with its variables."""
        for number in (1, 2):
            variables = {"SLURM_ARRAY_TASK_ID": str(number), "SLURM_CPUS_PER_TASK": "1", "SLURM_JOB_ID": "7"}
            variables["MESHFREE"] = str(program(place, "meshfree"))
            done = self.run(2, "thin-out", folder / "in", folder / "out", *OPTIONS, **variables)
            assert done.returncode == 0, done.stderr
        call(program(place, "meshfree"), "report", folder / "out" / "reports", "--out", folder / "out" / "report.csv")
        check(folder, by_hand)

    @pytest.mark.parametrize(("code", "count", "again"), [(3, "0", True), (3, "3", False), (2, "0", False)])
    def test_a_want_of_memory_goes_to_another_node(self, folder, code, count, again):
        for name, text in {"meshfree": f"exit {code}", "scontrol": f'echo "$@" > "{folder}/called"'}.items():
            (folder / name).write_text(f"#!/bin/bash\n{text}\n")
            (folder / name).chmod(0o755)
        variables = {"SLURM_ARRAY_TASK_ID": "1", "SLURM_JOB_ID": "7", "SLURM_RESTART_COUNT": count}
        path = f"{folder}{os.pathsep}{os.environ['PATH']}"
        done = self.run(2, "analyze", "in", "out", **variables, PATH=path)
        assert done.returncode == code
        assert (folder / "called").exists() == again
        assert not again or (folder / "called").read_text() == "requeue 7\n"

    def test_wrong_usage(self):
        done = self.run("4", "analyze")
        assert done.returncode == 2
        assert "PARTS VERB INPUT_DIR OUTPUT_DIR" in done.stderr

    def test_what_it_submits(self, folder):
        """To a double of `sbatch` that keeps its arguments."""
        kept = folder / "kept"
        (folder / "sbatch").write_text(f'#!/bin/bash\nprintf "%s\\n" "$@" END >> "{kept}"\necho "42;cluster"\n')
        (folder / "sbatch").chmod(0o755)
        path = f"{folder}{os.pathsep}{os.environ['PATH']}"
        given = 4, "analyze", folder / "in", folder / "out", "--columns", "x y z"
        assert self.run(*given, PATH=path, MESHFREE="blender --command meshfree").returncode == 0
        array, report, _ = kept.read_text().split("END\n")
        assert array.splitlines()[:2] == ["--parsable", "--array=1-4"]
        assert array.splitlines()[-7:] == [str(self.SCRIPT), *map(str, given)]
        assert "--dependency=afterany:42\n" in report
        [line] = [one.removeprefix("--wrap=") for one in report.splitlines() if one.startswith("--wrap=")]
        out = folder / "out"
        wanted = ["report", f"{out}/reports", "--out", f"{out}/report.csv"]
        assert shlex.split(line) == ["blender", "--command", "meshfree", *wanted]

    @pytest.mark.skipif(not SLURM, reason="needs Slurm: sinfo finds no node")
    def test_it_submits_itself(self, place, folder, by_hand):
        given = 2, "thin-out", folder / "in", folder / "out", *OPTIONS
        done = self.run(*given, MESHFREE=str(program(place, "meshfree")))
        assert done.returncode == 0, done.stderr
        until = time.monotonic() + 120.0
        while not (folder / "out" / "report.csv").exists() and time.monotonic() < until:
            time.sleep(0.5)
        check(folder, by_hand)
