"""Notices of tools, kept on an object until they are dismissed or the tool runs again."""

import re

import bpy
from bpy.props import EnumProperty, StringProperty

from ..registration import Registration, Row
from .words import in_blender

# What sentences begin with that say what to do. Those that begin otherwise, "If that is wrong", leave it to the user.
_ORDERS = (
    "Add|Analyze|Bind|Choose|Copy|Delete|Export|Give|Install|Leave|Lower|Make|Measure|Name|Open|Press|Project|Raise|Save|"
    "Select|Set|Start|Switch|Thin|Train|Turn|Undo|Use|Wait"
)
_ORDER = re.compile(rf"(?:^|[.:] )(?:{_ORDERS})\b")
IMPORTS = ("Import Points", "Import Tiles")  # what these told is of the file, whatever becomes of the points


class MESHFREE_PG_notice(bpy.types.PropertyGroup):
    """A notice of a tool about an object"""

    tool: StringProperty(name="Tool", description="Label of the tool")
    text: StringProperty(name="Text", description="Text of the notice")
    level: EnumProperty(
        name="Level",
        description="Importance of the notice",
        items=(
            ("WARNING", "Warning", "There is something to do"),
            ("INFO", "Info", "Figures to be read again"),
            ("NOTICE", "Notice", "Something was guessed, left out or replaced, and there is nothing to do"),
        ),
        default="NOTICE",
    )


def level_of(text: str) -> str:
    """Return the level of a notice: a warning where a sentence of it says what to do."""
    return "WARNING" if _ORDER.search(text) else "NOTICE"


def keep(obj, tool: str, text: str, level: str = ""):
    """Keep a notice of a tool on an object, in place of the same one of another tool; its level is that of the text."""
    notices, text = obj.meshfree.notices, in_blender(text)
    _remove(notices, lambda kept: kept.text == text)
    kept = notices.add()
    kept.tool, kept.text, kept.level = tool, text, level or level_of(text)


def forget(obj, tool: str):
    """Remove the notices of an earlier run of a tool from an object."""
    _remove(obj.meshfree.notices, lambda kept: kept.tool == tool)


def withdraw(obj, text: str):
    """Remove a notice from an object, since what it asks for is done."""
    _remove(obj.meshfree.notices, lambda kept: kept.text == in_blender(text))


def forget_results(obj):
    """Remove what tools told of points that have changed since, which their results are not of any more."""
    _remove(obj.meshfree.notices, lambda kept: kept.tool not in IMPORTS)


def renew(obj, tool: str, texts):
    """Replace the notices of an earlier run of a tool."""
    forget(obj, tool)
    for text in texts:
        keep(obj, tool, text)


def _remove(notices, unwanted):
    for index in reversed(range(len(notices))):
        if unwanted(notices[index]):
            notices.remove(index)


class MESHFREE_OT_dismiss(bpy.types.Operator):
    """Remove a notice"""

    bl_idname = "meshfree.dismiss"
    bl_label = "Dismiss Notice"
    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(
        name="Index", description="Number of the notice, from 0; -1 for all of them", default=-1, min=-1, soft_max=100
    )

    @classmethod
    def poll(cls, context):
        any_kept = context.object is not None and len(context.object.meshfree.notices) > 0
        if not any_kept:
            cls.poll_message_set("The active object has no notices. They come with tools and imports")
        return any_kept

    def execute(self, context):
        notices = context.object.meshfree.notices
        if self.index < 0:
            notices.clear()
        elif self.index < len(notices):
            notices.remove(self.index)
        return {"FINISHED"}


PROPERTY_GROUPS = (MESHFREE_PG_notice,)
TOOLS = (Registration(MESHFREE_OT_dismiss, menu=Row("Object", 12, 1)),)
