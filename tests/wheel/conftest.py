"""The wheel, built, and installed where nothing else is but what it asks for."""

import os
import shutil
import subprocess
import sys
import sysconfig
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEEDS = ("numpy", "scipy", "threadpoolctl")
FILES = ("laspy", "lazrs")


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """Path of the wheel."""
    folder = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    [path] = folder.iterdir()
    return path


@pytest.fixture(scope="session")
def place(wheel, tmp_path_factory):
    """Folder of an environment with the wheel and its group `files`."""
    return environment(tmp_path_factory.mktemp("whole"), f"{wheel}[files]", *NEEDS, *FILES)


@pytest.fixture(scope="session")
def bare(wheel, tmp_path_factory):
    """The same without the group."""
    return environment(tmp_path_factory.mktemp("bare"), wheel, *NEEDS)


def environment(folder, wheel, *names):
    """Make an environment of these packages of the present one, and install the wheel, which may ask for no other."""
    call(sys.executable, "-m", "venv", "--without-pip", folder)
    for name in names:
        copy(name, site(folder))
    python = program(folder, "python")
    call(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-index", wheel)
    return folder


def copy(name, target):
    """Link the files of a package of the present environment in another one."""
    found = distribution(name)
    tops = {path.parts[0] for path in found.files if path.parts[0] not in ("..", "__pycache__")}
    for top in tops:
        source = Path(found.locate_file(top))
        if os.name == "nt":  # where links need a right
            shutil.copytree(source, target / top)
        else:
            (target / top).symlink_to(source)


def site(folder):
    """Folder of the packages of an environment."""
    return Path(sysconfig.get_path("purelib", "venv", {"base": str(folder), "platbase": str(folder)}))


def program(folder, name):
    """Path of a program of an environment."""
    return folder / ("Scripts" if os.name == "nt" else "bin") / name


def call(*command, **options):
    """Run a program, and return what it prints; away from the tree unless told where, and without its packages."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment |= options.pop("env", {})
    done = subprocess.run(list(map(str, command)), env=environment, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout
