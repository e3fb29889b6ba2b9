"""How many cores are used: those that a scheduler, a container or the user gives, wherever core works side by side."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import core
from core.cores import VARIABLE, cores

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def unset(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system has no affinity")
def test_those_of_the_affinity():
    narrow = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})"
    code = f"{narrow}; from core.cores import cores; print(cores())"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "1\n"


def test_those_of_the_machine_where_there_is_no_affinity(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    assert cores() == 1
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert cores() == 1


def test_those_of_the_variable(monkeypatch):
    monkeypatch.setenv(VARIABLE, "7")
    assert cores() == 7


@pytest.mark.parametrize("text", ["two", "0", "-1", "1.5"])
def test_a_variable_that_is_no_number_is_told(monkeypatch, text):
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(core.PointCloudError, match=f"{VARIABLE} is '{text}'. Let it be a whole number"):
        core.build_laplacian(core.example_sphere())


def test_nothing_counts_for_itself():
    wrong = re.compile(r"cpu_count|workers=-1|ThreadPoolExecutor\(\)")
    folders = "core", "command", "operators", "ui", "benchmarks", "scripts"
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    assert [path.name for path in files if wrong.search(path.read_text(encoding="utf-8"))] == ["cores.py"]
