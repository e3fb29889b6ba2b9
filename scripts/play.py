"""Play with a real Blender window: play.py [SCRIPT]; without a script at a Python prompt, where `gui` is the window.

scripts/window.py documents `gui`. The extension is built and installed anew; --no-build takes the zip that is
in dist/. Pictures go to build/gui/.
"""

import argparse
import code
import runpy
import sys

import gui_blender
import package
import pythons
from window import Window


def main():
    """Open the window and run the script, or ask."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("script", nargs="?")
    parser.add_argument("arguments", nargs="*", help="what the script finds in sys.argv")
    parser.add_argument("--no-build", action="store_true", help="take the zip that is there")
    options = parser.parse_args()
    try:
        place = gui_blender.ensure()
    except gui_blender.LeftOutError as error:
        sys.exit(str(error))
    if not options.no_build:
        package.build([package.this_platform()])
    with Window(place, package.archive(package.this_platform())) as gui:
        if options.script:
            sys.argv = [options.script, *options.arguments]
            runpy.run_path(options.script, init_globals={"gui": gui}, run_name="__main__")
        else:
            code.interact(banner="gui is the window, see scripts/window.py; Ctrl+D ends", local={"gui": gui})


if __name__ == "__main__":
    pythons.use_supported()
    main()
