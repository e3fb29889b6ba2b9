"""What all tests share: the folder of real scans, which is not part of the project."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def scans():
    """Folder with real scans as vertices-only PLY files, named by the environment variable MESHFREE_SCANS."""
    folder = os.environ.get("MESHFREE_SCANS")
    if not folder:
        pytest.skip("needs real scans: set MESHFREE_SCANS to their folder")
    if not Path(folder).is_dir():
        pytest.fail(f"MESHFREE_SCANS names {folder}, which is no folder")
    return Path(folder)
