"""The README's first command with a scan of the user's own, as `make demo SCAN=file.ply` runs it."""

import os
import subprocess
import sys

import numpy as np
import pytest

import package

from .clouds import sphere_points


@pytest.mark.usefixtures("installed")
def test_the_demonstration_analyzes_and_renders_a_scan(tmp_path):
    np.savetxt(tmp_path / "scan.xyz", sphere_points(600))
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, str(package.ROOT / "scripts" / "demo.py"), str(tmp_path / "scan.xyz"), "--up", "Z"],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")},
        cwd=package.ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert "points       600" in done.stdout, done.stdout + done.stderr
    assert "written      build/demo/demo.png" in done.stdout, done.stdout + done.stderr
