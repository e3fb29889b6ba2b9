"""Find the Pythons that Blender exists for as a module (bpy).

Runs on any Python from 3.8 on, so that a wrong version gets a clear word instead of a traceback.
"""

import functools
import glob
import os
import subprocess
import sys

BLENDERS = {"3.11": ("4.5", "4.2"), "3.13": ("5.2",)}
"""Versions of Blender by the version of Python their module needs, the newest first."""

_ASK = "import ensurepip, sys, venv; print('%d.%d' % sys.version_info[:2], sys.executable)"


@functools.lru_cache
def find():
    """Find the usable Pythons of this machine.

    A name on the path may be a shim that fails, so a Python counts as found once it ran.

    Returns
    -------
    dict
        Executable by version. The Python to prefer comes first: the one that the environment variable PYTHON names,
        else the oldest.
    """
    found = {}
    for version in BLENDERS:
        for executable in _candidates(version):
            answered, path = _ask(executable)
            if answered == version:
                found[version] = path
                break
    wanted = os.environ.get("PYTHON")
    if not wanted:
        if not found:
            sys.exit(f"No Python {_versions()} with venv and pip is found: install one, or name it by make PYTHON=...")
        return found
    version, path = _ask(wanted)
    if version not in BLENDERS:
        what = f"is Python {version}" if version else "does not run as a Python with venv and pip"
        sys.exit(f"{wanted} {what}, but Blender's module (bpy) needs Python {_versions()}: make PYTHON=python3.11 ...")
    return {version: path, **{other: found[other] for other in found if other != version}}


def use_supported():
    """Run this program again in the Python to prefer, unless it runs there already."""
    executable = next(iter(find().values()))
    if os.path.samefile(executable, sys.executable):
        return
    if os.name == "nt":  # where exec returns to the shell at once
        sys.exit(subprocess.call([executable, *sys.argv]))
    os.execv(executable, [executable, *sys.argv])  # in its place, so that Ctrl-C finds one program to end


def _versions():
    return " or ".join(BLENDERS)


def _candidates(version):
    """Yield paths that may be a Python of a version."""
    names = (f"python{version}", "python3", "python", f"python{version}.exe", "python.exe")
    for folder in os.get_exec_path():
        for name in names:
            path = os.path.join(folder, name)
            if os.path.isfile(path):
                yield path
    for folder in ("~/.pyenv/versions", "~/.local/share/uv/python"):
        yield from sorted(glob.glob(os.path.join(os.path.expanduser(folder), f"*{version}.*", "bin", "python3")))


def _ask(executable):
    """Ask a Python for its version and path; ("", "") if it does not run."""
    try:
        answer = subprocess.run(
            [executable, "-c", _ASK],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=20,
            check=True,
        )
        version, path = answer.stdout.strip().split(" ", 1)
    except (OSError, ValueError, subprocess.SubprocessError):
        return "", ""
    return version, path
