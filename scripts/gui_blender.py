"""Prepare a Blender with a window, for tests and pictures that need real keys and a real mouse.

A small Debian system with Blender, a virtual screen and a tool that sends keys is made under .venv/blender-gui once,
and entered by chroot. This takes some minutes, 1.7 GB, Debian's package tools and the rights of root. Whoever has a
Blender with a window already names it by MESHFREE_GUI_BLENDER=/path/to/blender; then xdotool, ImageMagick and, without
a DISPLAY, Xvfb are taken from the machine too.
"""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pythons
from environments import FOLDER

SUITE = "trixie"  # the suite of Debian whose Blender, 4.3, takes the wheels of our zip (Python 3.13)
PACKAGES = (
    "blender",
    "python3-numpy",
    "xvfb",
    "xauth",
    "xdotool",
    "imagemagick",
    "libgl1-mesa-dri",
    "libegl1",
    "libglx-mesa0",
)
SYSTEM = FOLDER / "blender-gui"
LIMIT = 900  # seconds for making the system
_TOOLS = ("xdotool", "import", "Xvfb")
# What nobody reads there, and no waiting for the disk: the system is made anew if making it was interrupted.
_DPKG = ("force-unsafe-io", "path-exclude=/usr/share/doc/*", "path-exclude=/usr/share/man/*")


class LeftOutError(Exception):
    """Why this machine has no Blender with a window, in one sentence."""


@dataclass(frozen=True)
class Place:
    """Where a Blender with a window runs.

    Attributes
    ----------
    blender : str
        The program, as it is called there.
    root : pathlib.Path
        The folder that programs there see as the root of all files.
    """

    blender: str
    root: Path

    @property
    def cache(self):
        """Folder for what programs there compile, as they see it."""
        return Path("/var/cache/shaders" if self.root == SYSTEM else SYSTEM.with_name("shaders"))

    def command(self, words, **variables):
        """Write a command that is run there, with these environment variables and few others."""
        variables = {"PATH": "/usr/local/bin:/usr/bin:/bin", "LANG": "C.UTF-8", **variables}
        settings = [f"{name}={value}" for name, value in variables.items()]
        enter = [] if self.root == Path("/") else ["chroot", str(self.root)]
        return [*enter, "env", "-i", *settings, *map(str, words)]

    def inside(self, path):
        """Path of a file as programs there see it."""
        return Path("/") / Path(path).relative_to(self.root)

    def make_folder(self):
        """Make a temporary folder that programs there see too."""
        return Path(tempfile.mkdtemp(prefix="meshfree-", dir=self.root / "tmp"))


def find():
    """Return the place that is there already; raise `LeftOutError` if there is none."""
    own = os.environ.get("MESHFREE_GUI_BLENDER")
    if own:
        return _own(own)
    stamp = SYSTEM / "complete"
    if not stamp.exists() or stamp.read_text() != _state():
        raise LeftOutError("the Blender with a window is not prepared: make test-gui does it")
    return Place("/usr/bin/blender", SYSTEM)


def ensure():
    """Return the place, made if it is not there; raise `LeftOutError` if this machine cannot make it."""
    try:
        return find()
    except LeftOutError:
        if os.environ.get("MESHFREE_GUI_BLENDER"):
            raise
    _check_machine()
    print(f"Making .venv/{SYSTEM.name} (some minutes, 1.7 GB)", flush=True)
    shutil.rmtree(SYSTEM, ignore_errors=True)
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="meshfree-") as folder:
        _bootstrap(Path(folder))
    (SYSTEM / "complete").write_text(_state())
    return find()


def _state():
    return hashlib.sha256(" ".join((SUITE, *PACKAGES)).encode()).hexdigest()


def _own(blender):
    """Check a Blender of the user's own, and the tools beside it."""
    missing = [name for name in (blender, *_TOOLS[: 2 if os.environ.get("DISPLAY") else 3]) if not shutil.which(name)]
    if missing:
        raise LeftOutError(f"MESHFREE_GUI_BLENDER is set, but {', '.join(missing)} cannot be run")
    return Place(shutil.which(blender), Path("/"))


def _check_machine():
    """Say what keeps this machine from making the system, before anything is fetched."""
    if not sys.platform.startswith("linux"):
        raise LeftOutError("the Blender with a window is made on Linux only: name yours by MESHFREE_GUI_BLENDER=...")
    if os.geteuid() != 0:
        raise LeftOutError("the Blender with a window is made by root only: name yours by MESHFREE_GUI_BLENDER=...")
    missing = [name for name in ("apt-get", "apt-config", "dpkg", "chroot", "perl") if not shutil.which(name)]
    if missing:
        raise LeftOutError(f"the Blender with a window is made by Debian's tools, and {', '.join(missing)} is missing")


def _bootstrap(folder):
    """Make the system from the Debian archive that this machine takes its own packages from."""
    mmdebstrap = shutil.which("mmdebstrap") or _fetch_mmdebstrap(folder)
    command = [mmdebstrap, "--mode=root", "--variant=apt", f"--include={','.join(PACKAGES)}"]
    command += [f"--aptopt={line}" for line in _network_options()]
    command += [f"--dpkgopt={option}" for option in _DPKG]
    command += [SUITE, SYSTEM, *[f"deb {archive} {SUITE} main" for archive in _archives()]]
    tools = str(Path(mmdebstrap).parent)  # its other programs are called by name
    _run(command, LIMIT, env={**os.environ, "PATH": os.pathsep.join([tools, *os.get_exec_path()])})


def _fetch_mmdebstrap(folder):
    """Fetch the tool that makes Debian systems into a folder, without installing it on this machine."""
    try:
        _run(["apt-get", "download", "mmdebstrap"], 120, cwd=folder)
    except LeftOutError:  # the lists of packages may be missing
        _run(["apt-get", "update"], 300)
        _run(["apt-get", "download", "mmdebstrap"], 120, cwd=folder)
    [package] = folder.glob("mmdebstrap_*.deb")
    _run(["dpkg", "-x", package, folder], 60)
    return folder / "usr" / "bin" / "mmdebstrap"


def _network_options():
    """Read how this machine reaches its archive: proxies, certificates, clocks that are off."""
    kinds = ("http", "https", "Retries", "Check-Valid-Until", "Check-Date")
    lines = _run(["apt-config", "dump"], 60).splitlines()
    return [line for line in lines if line.startswith(tuple(f"Acquire::{kind}" for kind in kinds)) and '""' not in line]


def _archives():
    """Read which Debian archives this machine uses; none lets mmdebstrap take its own."""
    lines = _run(["apt-get", "indextargets", "--format", "$(ORIGIN) $(RELEASE) $(REPO_URI)"], 60).splitlines()
    found = [line.split() for line in lines if line.startswith("Debian ")]
    return sorted({words[2] for words in found if len(words) == 3 and "-" not in words[1]})[:1]


def _run(command, seconds, **options):
    """Run a program of Debian's and return what it prints; failing is a reason to leave the window out."""
    name = Path(command[0]).name
    with subprocess.Popen(
        [str(word) for word in command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        **options,
    ) as process:
        try:
            output, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGTERM)  # with what it has started; it takes its mounts away then
            process.wait()
            raise LeftOutError(f"the Blender with a window was not made, since {name} took over {seconds} s") from None
    if process.returncode:
        lines = output.strip().splitlines() or ["no word"]
        reason = next((line for line in lines if line.startswith("E:")), lines[-1])
        raise LeftOutError(f"the Blender with a window was not made, since {name} failed with: {reason}")
    return output


def main():
    """Prepare it."""
    try:
        print(f"{ensure().blender} in .venv/{SYSTEM.name} is ready")
    except LeftOutError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    pythons.use_supported()
    main()
