"""The command line in Blender: `blender --command meshfree VERB FILE ...`, from files to files without a window."""

import bpy

from ...command import clouds, line, verbs
from . import blend, weight_verbs

_handles = []


def attach():
    """Add the command to Blender, and its own files to those of the command."""
    clouds.register(blend.ENDING, blend.KIND)
    _handles.append(bpy.utils.register_cli_command("meshfree", run))


def detach():
    """Remove the command from Blender."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
        clouds.unregister(blend.ENDING)


def make_verbs():
    """Return all verbs: those that need no Blender, and those of weights."""
    return [*verbs.make_verbs(), *weight_verbs.make_verbs()]


def run(argv) -> int:
    """Run the command line with what follows ``--command meshfree``, and return the exit code."""
    return line.run(argv, make_verbs(), "blender --command meshfree")
