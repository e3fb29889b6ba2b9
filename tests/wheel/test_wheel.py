"""The wheel in an environment of its own: what is in it, its example, files, types, and the code of the README."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest

from tests.wheel.conftest import ROOT, call, program, site

NAME = "meshfree_laplacian"


def python(folder, code, cwd, *arguments):
    """What some code prints in an environment."""
    return call(program(folder, "python"), "-c", code, *arguments, cwd=cwd)


def test_it_holds_the_packages_in_the_tree_and_nothing_else(wheel):
    def sources(folder, ending):
        found = (path.relative_to(ROOT / folder) for path in (ROOT / folder).rglob(ending))
        return {path.as_posix() for path in found if "__pycache__" not in path.parts}

    wanted = {f"{NAME}/{path}" for ending in ("*.py", "*.pyi", "py.typed") for path in sources("core", ending)}
    above = [f"{folder}/{path}" for folder in ("command", "tools") for path in sources(folder, "*.py")]
    wanted |= {f"{NAME}/{path}" for path in (*above, "__main__.py")}
    with zipfile.ZipFile(wheel) as packed:
        assert {name for name in packed.namelist() if ".dist-info/" not in name} == wanted


def test_it_has_the_version_of_the_extension(wheel):
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert wheel.name == f"{NAME}-{manifest['version']}-py3-none-any.whl"


def test_it_says_its_version(bare, tmp_path):
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    code = f"import sys, {NAME} as mf; print(mf.__version__, 'scipy' in sys.modules)"
    assert python(bare, code, tmp_path).split() == [manifest["version"], "False"]


def test_it_is_a_program_of_any_python_that_has_it(bare, tmp_path):
    printed = call(program(bare, "python"), "-m", NAME, "--help", cwd=tmp_path)
    assert printed == call(program(bare, "meshfree"), "--help", cwd=tmp_path)
    assert printed.startswith("usage: meshfree ")


def test_it_asks_for_numpy_and_scipy_only(bare, tmp_path):
    """But for files that need more, it says what is missing."""
    code = (
        f"from pathlib import Path; import {NAME} as mf; print(mf.build_laplacian(mf.example_sphere()).areas.sum())\n"
        "Path('a.las').write_bytes(b'LASF')\n"
        "try: mf.files.read_points('a.las')\n"
        "except mf.PointCloudError as error: print(error)"
    )
    area, error, *_ = python(bare, code, tmp_path).splitlines()
    assert float(area) == pytest.approx(12.566, rel=1e-3)
    assert "laspy" in error


def test_it_reads_and_writes_files(place, tmp_path):
    code = f"""
import laspy, numpy as np
from pathlib import Path
import {NAME} as mf
points = mf.example_sphere()
header = laspy.LasHeader(point_format=6, version="1.4")
header.scales = [1e-7] * 3
las = laspy.LasData(header)
las.xyz = points
las.write("a.laz")
table = mf.files.read_points(Path("a.laz"))
mf.files.write_points(Path("b.ply"), table)
print(np.abs(mf.files.read_points(Path("b.ply")).points - points).max() < 1e-6)
"""
    assert python(place, code, tmp_path) == "True\n"


def test_its_program_goes_from_files_to_files(place, tmp_path):
    """As core, called in Python, does."""
    shutil.copy(ROOT / "docs" / "coral.ply", tmp_path)
    call(program(place, "meshfree"), "thin-out", "coral.ply", "--spacing", 0.12, "--out", "thin.ply", cwd=tmp_path)
    printed = call(program(place, "meshfree"), "analyze", "thin.ply", "--out", "a.npz", cwd=tmp_path)
    line = json.loads(printed)
    code = (
        f"from pathlib import Path; import {NAME} as mf; points = mf.files.read_points(Path('thin.ply')).points\n"
        "print(mf.build_laplacian(points).areas.sum())"
    )
    assert line["total_area"] == float(python(place, code, tmp_path))
    assert (tmp_path / "a.npz").stat().st_size > 1e5
    assert "usage: meshfree" in call(program(place, "meshfree"), "--help", cwd=tmp_path)


def test_every_verb_runs_on_the_example(place, tmp_path):
    shutil.copy(ROOT / "docs" / "coral.ply", tmp_path)
    lines = call(program(place, "python"), ROOT / "tests" / "wheel" / "every_verb.py", cwd=tmp_path).splitlines()
    assert len(lines) >= 30
    assert [line for line in lines if not line.endswith(" 0 done")] == []


USER = """
import numpy as np

import meshfree_laplacian as mf

laplacian = mf.build_laplacian(np.zeros((5, 3)), options=mf.LaplacianOptions(neighbors=6))
count: int = len(laplacian.eigenpairs(3).eigenvalues)
version: str = mf.__version__
store: mf.tiles.Store = mf.tiles.Store("store")
mf.LaplacianOptions(neighbours=6)
areas: str = laplacian.areas
"""
WRONG = {10: "call-arg", 11: "assignment"}  # lines of it, and what mypy calls their mistakes


def test_type_checkers_know_its_calls(place, tmp_path):
    (tmp_path / "user.py").write_text(USER)
    checked = [sys.executable, "-m", "mypy", "--strict", "--python-executable", program(place, "python"), "user.py"]
    done = subprocess.run(list(map(str, checked)), cwd=tmp_path, capture_output=True, text=True)
    found = re.findall(r"^user\.py:(\d+): error: .*\[([\w-]+)\]$", done.stdout, re.MULTILINE)
    assert {int(line): kind for line, kind in found} == WRONG, done.stdout + done.stderr


def test_the_readme_leads_from_a_cloud_to_a_picture(place, tmp_path):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    [code] = [one for one in re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL) if NAME in one]
    assert len(code.strip().splitlines()) <= 20
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "coral.ply").symlink_to(ROOT / "docs" / "coral.ply")
    printed = call(sys.executable, "-c", code, cwd=tmp_path, env={"PYTHONPATH": str(site(place)), "MPLBACKEND": "agg"})
    assert printed.startswith("area ")
    assert (tmp_path / "coral.png").read_bytes().startswith(b"\x89PNG")
