"""Make the private environments under .venv/, one per dependency group of pyproject.toml."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pythons

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / ".venv"


def ensure(name, group, python):
    """Make an environment, unless it is there with the same requirements and the same version of Python.

    Parameters
    ----------
    name : str
        Folder under .venv/.
    group : str
        Dependency group of pyproject.toml.
    python : str
        The Python to make it with.

    Returns
    -------
    pathlib.Path
        The environment's Python.
    """
    folder = FOLDER / name
    executable = folder.joinpath(*(("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")))
    requirements = read_group(group)
    version = run([python, "-c", "import sys; print(sys.version)"], capture_output=True, text=True).stdout
    state = hashlib.sha256("\n".join([version, *requirements]).encode()).hexdigest()
    stamp = folder / "complete"  # written last: an interrupted installation starts anew
    if executable.exists() and stamp.exists() and stamp.read_text() == state:
        return executable
    size = "about 1 GB, half a minute" if group.startswith("blender") else "some seconds"
    print(f"Making .venv/{name} ({size})", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    run([python, "-m", "venv", folder])
    run([executable, "-m", "pip", "install", "--quiet", "--no-input", "--disable-pip-version-check", *requirements])
    stamp.write_text(state)
    return executable


def ensure_blender(version, python):
    """Make the environment with a version of Blender and return its Python."""
    return ensure(f"blender-{version}", f"blender-{version}", python)


def newest_blender():
    """Make the environment with the newest Blender for the Python to prefer and return its Python."""
    version, python = next(iter(pythons.find().items()))
    return ensure_blender(pythons.BLENDERS[version][0], python)


def read_group(name):
    """Requirements of a dependency group, with the groups it includes."""
    import tomllib  # new in Python 3.11

    groups = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]

    def expand(entries):
        for entry in entries:
            if isinstance(entry, dict):
                yield from expand(groups[entry["include-group"]])
            else:
                yield entry

    return list(expand(groups[name]))


# Of glibc, which would give the pages of each array back, and ask for them anew: a twelfth of the time of the tests.
_ALLOCATOR = {"MALLOC_MMAP_THRESHOLD_": str(32 << 20), "MALLOC_TRIM_THRESHOLD_": str(1 << 30)}


def isolated(**variables):
    """Environment variables that keep the user's own Python packages and Blender settings out; none unsets one."""
    left_out = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "BLENDER_USER_RESOURCES", "BLENDER_USER_EXTENSIONS")
    kept = {name: value for name, value in os.environ.items() if name not in left_out}
    # More threads gain nothing on matrices this small, and wait for each other at length where other programs run.
    chosen = {"OPENBLAS_NUM_THREADS": "1", **_ALLOCATOR, **kept, "PYTHONNOUSERSITE": "1", **variables}
    return {name: value for name, value in chosen.items() if value is not None}


def run(command, **options):
    """Run a program in the root of the tree, isolated, and stop with one sentence if it fails."""
    command = [str(part) for part in command]
    try:
        return subprocess.run(command, cwd=ROOT, env=isolated(), stdin=subprocess.DEVNULL, check=True, **options)
    except subprocess.TimeoutExpired as error:
        sys.exit(f"Stopped after {error.timeout:.0f} s: {_short(command)}")
    except subprocess.CalledProcessError as error:
        if options.get("capture_output"):
            print(error.stdout, error.stderr, file=sys.stderr)
        sys.exit(f"Failed (exit code {error.returncode}): {_short(command)}")


def _short(command):
    """Write a command as someone would type it in the root of the tree."""
    words = [os.path.relpath(part, ROOT) if os.path.isabs(str(part)) else str(part) for part in command]
    return " ".join(words)


def main():
    """Make an environment and run a program in it: environments.py NAME [ARGUMENT ...]."""
    name, *arguments = sys.argv[1:]
    python = ensure(name, name, next(iter(pythons.find().values())))
    run([python, *arguments])


if __name__ == "__main__":
    pythons.use_supported()
    main()
