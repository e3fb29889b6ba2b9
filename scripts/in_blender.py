"""Build the extension and run a script of this folder in Blender's module: in_blender.py SCRIPT [ARGUMENT ...]."""

import subprocess
import sys
import tempfile

import package
import pythons
from environments import ROOT, isolated, newest_blender

LIMIT = 1800  # seconds


def main():
    """Run the script with a user folder of its own, so that the user's Blender stays as it is."""
    script, *arguments = sys.argv[1:]
    package.build([package.this_platform()])
    command = [str(newest_blender()), str(ROOT / "scripts" / script), *arguments]
    with tempfile.TemporaryDirectory(prefix="meshfree-", ignore_cleanup_errors=True) as folder:
        variables = isolated(BLENDER_USER_RESOURCES=folder)
        try:
            code = subprocess.run(command, cwd=ROOT, env=variables, stdin=subprocess.DEVNULL, timeout=LIMIT).returncode
        except subprocess.TimeoutExpired:
            sys.exit(f"{script} stopped after {LIMIT} s")
    sys.exit(code)


if __name__ == "__main__":
    pythons.use_supported()
    main()
