"""Presets of the settings that change results: built-in ones, and the user's own files."""

import ast
import re
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..operators.objects.options import NAMES, PRESETS, apply_preset
from ..operators.running.ready import ReadyOperator, reporting

_BUILT_IN = (
    ("DEFAULT", "Default", "Suited to most scans"),
    ("PAPER", "Paper", "The method of the paper, with its own settings"),
    ("CLEAN", "Clean CAD", "For exact points with sharp edges: points are not moved"),
    ("NOISY", "Noisy Scan", "For noisy scans: a wider kernel gives smoother curvature and less detail"),
)
_SAVED = re.compile(r"\.meshfree\.(\w+) = (.+)")  # a line of a file of Blender's


class MESHFREE_OT_apply_preset(ReadyOperator, bpy.types.Operator):
    """Set all settings that change results to those of a preset"""

    bl_idname = "meshfree.apply_preset"
    bl_label = "Apply Preset"

    preset: EnumProperty(name="Preset", description="Which settings to take", items=_BUILT_IN, default="DEFAULT")
    filepath: StringProperty(
        name="File Path", description="File of a user preset, instead", options={"HIDDEN", "SKIP_SAVE"}
    )

    @reporting
    def execute(self, context):
        settings, path = context.object.meshfree, Path(self.filepath)
        if not self.filepath:
            apply_preset(settings, PRESETS[self.preset])
            return {"FINISHED"}
        saved = dict(_SAVED.findall(path.read_text(encoding="utf-8")))
        apply_preset(settings, PRESETS["DEFAULT"])
        unknown = [name for name, value in saved.items() if not _set(settings, name, value)]
        if unknown:
            missing = ", ".join(unknown)
            self.warn(f"{path.stem} has settings or values that no longer exist: {missing}", context.object)
        bpy.types.MESHFREE_MT_presets.bl_label = bpy.path.display_name(path.name, title_case=False)  # for Remove Active
        return {"FINISHED"}


def _set(settings, name, value) -> bool:
    """Set an option to a value of a file; return whether both exist in this version."""
    if name not in NAMES:
        return False
    try:
        setattr(settings, name, ast.literal_eval(value))
    except TypeError:  # no such choice
        return False
    return True


class MESHFREE_OT_add_preset(ReadyOperator, AddPresetBase, bpy.types.Operator):
    """Save the settings as a user preset, or remove it"""

    bl_idname = "meshfree.add_preset"
    bl_label = "Add Settings Preset"
    bl_options = {"REGISTER", "INTERNAL"}  # it changes nothing that could be undone
    preset_menu = "MESHFREE_MT_presets"
    preset_subdir = "meshfree_laplacian"
    # In full: names in preset_defines are not found by Python 3.13 in Blender 4.3 and the like.
    preset_values = [f"bpy.context.object.meshfree.{name}" for name in NAMES]

    name: StringProperty(name="Name", description="Name of the preset", maxlen=64, options={"SKIP_SAVE"})
    remove_name: BoolProperty(
        name="Remove by Name",
        description="Remove the preset of this name",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )
    remove_active: BoolProperty(
        name="Remove Active",
        description="Remove the preset that was chosen last",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )


class MESHFREE_MT_presets(bpy.types.Menu):
    """Settings that suit some kind of points"""

    bl_label = "Presets"
    preset_subdir = MESHFREE_OT_add_preset.preset_subdir
    preset_operator = MESHFREE_OT_apply_preset.bl_idname

    def draw(self, context):
        for identifier, name, _ in _BUILT_IN:
            self.layout.operator("meshfree.apply_preset", text=name).preset = identifier
        self.layout.separator()
        bpy.types.Menu.draw_preset(self, context)


CLASSES = (MESHFREE_OT_apply_preset, MESHFREE_OT_add_preset, MESHFREE_MT_presets)
