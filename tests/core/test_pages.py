"""What the pages tell to type without Blender works: code, make, modules. And nothing is left to no test."""

import importlib.util
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks.samplings import fibonacci_sphere
from command import verbs
from command.line import run
from core.files import PointTable, write_points
from tests.core.copc_files import write_copc
from tests.pages import NOT_RUN, ROOT, snippets, typed

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
RUN = {"core", "make", "bpy", "blender", "json", "meshfree", "wheel", "yaml"}  # here, in Blender, and by tests/wheel


def by_name(kind):
    return pytest.mark.parametrize("snippet", snippets(kind), ids=lambda snippet: snippet.id)


def test_every_snippet_is_run_or_listed_and_every_listed_one_is_on_a_page():
    assert {one.text for one in typed() if one.kind not in RUN} <= set(NOT_RUN)
    assert set(NOT_RUN) <= {one.text for one in typed()}


@by_name("core")
def test_code(snippet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points = fibonacci_sphere(800)
    if "survey.copc.laz" in snippet.text:
        write_copc(Path("survey.copc.laz"), points)
    exec(compile(snippet.text, snippet.id, "exec"), {"points": points, "values": points[:, 2], "np": np})


def test_scipy_finds_the_modes_of_the_operator(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    [recipe] = [one for one in snippets("core") if "eigsh(" in one.text]
    found = {"points": np.vstack([fibonacci_sphere(800), [[5.0, 0.0, 0.0]]])}
    exec(compile(recipe.text, recipe.id, "exec"), found)
    assert not found["known"][-1]
    raw = found["laplacian"].eigenpairs(10, raw=True)
    np.testing.assert_allclose(found["eigenvalues"], raw.eigenvalues, rtol=1e-8, atol=1e-8)
    mass = found["eigenvectors"].T @ found["M"] @ found["eigenvectors"]
    np.testing.assert_allclose(mass, np.eye(10), atol=1e-8)


def test_pages_call_core_by_the_name_that_it_has_in_the_wheel():
    named = r"^(from|import) core\b"
    assert [one.id for one in typed() if re.search(named, one.text, re.MULTILINE)] == []


def test_no_page_installs_a_name_that_is_not_published():
    """But from the address of a wheel."""
    told = [one.text for one in typed() if "pip" in one.text and re.search(r"meshfree[-_]laplacian", one.text)]
    assert told
    assert [text for text in told if not re.search(r"meshfree-laplacian(\[\w+\])? @ https://\S+\.whl\"", text)] == []


@by_name("meshfree")
def test_program(snippet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points = fibonacci_sphere(400)
    for folder in ("scans", "thin/reports"):
        Path(folder).mkdir(parents=True)
    for name in ("scan.ply", "scans/a.ply", "scans/b.ply"):
        write_points(Path(name), PointTable(points))
    if " report " in snippet.text:
        run(["info", "scan.ply", "--report", "thin/reports/1.jsonl"], verbs.make_verbs(), "meshfree")
    if re.search(r" tiles (survey|agree|measure|modes|report) | report out$", snippet.text):
        run(["tiles", "run", "scans", "--out-dir", "out", "--tile-points", "450"], verbs.make_verbs(), "meshfree")
    assert run(shlex.split(snippet.text)[1:], verbs.make_verbs(), "meshfree") == 0


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@by_name("make")
def test_make_knows_what_to_do(snippet):
    for name in re.findall(r"\b([A-Z]+)=", snippet.text):
        assert f"$({name})" in MAKEFILE, f"the Makefile reads no {name}"
    done = subprocess.run(
        ["make", "--dry-run", "-C", ROOT, *shlex.split(snippet.text)[1:]], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("text", [text for text in NOT_RUN if "python -m" in text])
def test_modules_and_the_variables_that_they_read_are_there(text):
    found = importlib.util.find_spec(re.search(r"-m (\S+)", text)[1])
    assert found, text
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "benchmarks").rglob("*.py")]
    for name in re.findall(r"(\w+)=", text):
        assert any(f'"{name}"' in source for source in sources), name


def test_snippets_are_found_in_every_form():
    found = {(one.page.name, one.text.splitlines()[0], one.kind) for one in typed()}
    assert ("README.md", "make test", "make") in found
    assert ("README.md", "bpy.ops.meshfree.analyze(modes=30)", "bpy") in found
    assert ("install.md", "blender --command meshfree --help", "blender") in found
    assert ("legend.md", "import bpy", "bpy") in found
    assert ("ablation.md", "MESHFREE_ZOO=folder python -m benchmarks.ablation", "python") in found
