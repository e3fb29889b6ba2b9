"""The command line in Blender: `blender --command meshfree VERB FILE ...`, from files to files without a window."""

import bpy

from ...command import main, verbs
from ...command.groups import SOURCE
from .. import registration
from .measure_verbs import MeasureFile, ProfileBetween, Section
from .rigging import Rig
from .tool_verbs import AlignWith, AlongCurve, CompareWith, Frames, FromSources, Mesh, Orient
from .transfer_verbs import AttributesFrom, WeightsFrom
from .verbs import Analyze, Apply

_OWN = {
    "align_points": AlignWith,
    "auto_weights": Rig,
    "signed_distance": AlongCurve,
    "measure_parts": MeasureFile,
    "mesh_surface": Mesh,
    "compare": CompareWith,
    "orient_normals": Orient,
    "simulate": Frames,
    "cross_section": Section,
    "profile": ProfileBetween,
    "transfer_attributes": AttributesFrom,
    "transfer_weights": WeightsFrom,
}
_handles = []


def attach():
    """Add the command to Blender."""
    _handles.append(bpy.utils.register_cli_command("meshfree", run))


def detach():
    """Remove the command from Blender."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())


def make_verbs():
    """Return all verbs: the analysis, tools in the order of the menu, and those without an object."""
    groups = [group for home in ("Object", "Points") for group in registration.groups("menu", home)]
    tools = [tool for group in groups for tool in group if tool.verb]
    return [Analyze(), *map(_verb, tools), *verbs.without_object()]


def _verb(tool):
    """Return the verb of a tool: one of its own if it needs more than settings, or the common one."""
    if tool.name in _OWN:
        return _OWN[tool.name]()
    group = getattr(bpy.ops.meshfree, tool.name).get_rna_type().properties.get("group")
    starts = group is not None and group.default == SOURCE
    return (FromSources if starts else Apply)(tool.name, tool.verb)


def run(argv) -> int:
    """Run the command line with what follows ``--command meshfree``, and return the exit code."""
    return main.run(argv, make_verbs(), "blender --command meshfree")
