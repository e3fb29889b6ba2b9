"""How soon the extension answers: handles and second runs in Blender's module, and keys in a window."""

import subprocess
import sys

from .deformation import BLENDER, ROOT, following
from .tables import Table
from .targets import HEADER


def dragged_handle():
    """Points that follow a handle."""
    return Table("A dragged handle", HEADER, list(following()))


def second_runs():
    """Operators run again with other settings of what is only shown, which must compute nothing again."""
    archives = sorted((ROOT / "dist").glob("*.zip"), key=lambda path: path.stat().st_mtime)
    if not BLENDER.exists() or not archives:
        return Table("Second runs", ["left out"], [["no Python with bpy, or no zip of the extension (make build)"]])
    header, *rows = _rows([BLENDER, ROOT / "benchmarks" / "second_run_in_blender.py", archives[-1]])
    return Table("Second runs", header, rows, "The target for the second run is 0.2 s.")


def window():
    """Keys in a real window, from the press to the text in the status bar."""
    header, *rows = _rows(
        [sys.executable, ROOT / "scripts" / "play.py", "--no-build", ROOT / "benchmarks" / "window.py"]
    )
    note = (
        "The targets are 0.2 s from the key to the first text, and 0.5 s from Esc to the end, after Esc at any moment."
    )
    return Table("A key in the window", header, rows, f"{note} Drawing is without a graphics card here.")


def _rows(command):
    """Run a program and return the cells of the table that it prints, without the line below the header."""
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT)
    lines = [line for line in done.stdout.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in (lines[0], *lines[2:])]
