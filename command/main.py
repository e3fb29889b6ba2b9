"""The program `meshfree`, which needs no Blender."""

import sys

from .stages import silence, tell_aside

STOPPED, UNHEARD = 130, 141  # exit codes beside those of verbs


def main() -> int:
    """Run the program with the arguments of this process, and return the exit code.

    Stopped by Ctrl-C it says so, and the code is 130; it is 141 where nobody reads what it prints any more.
    """
    try:
        from . import line, verbs  # here, as that takes most of a second, in which Ctrl-C may come, too

        code = line.run(sys.argv[1:], verbs.make_verbs(), "meshfree")
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        tell_aside("Stopped")
        return STOPPED
    except BrokenPipeError:
        silence(sys.stdout)
        return UNHEARD
