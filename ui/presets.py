"""Presets of the settings that change results: those that come along, and the user's own files."""

import bpy
from bl_operators.presets import AddPresetBase
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..operators.objects.options import NAMES, PRESETS, apply_preset
from ..operators.running.ready import ReadyOperator

_BUILT_IN = (
    ("DEFAULT", "Default", "Suited to most scans"),
    ("PAPER", "Paper", "The method of the paper, with its own settings"),
    ("CLEAN", "Clean CAD", "For exact points with sharp edges: points are not moved"),
    ("NOISY", "Noisy Scan", "For noisy scans: a wider kernel gives smoother curvature and less detail"),
)


class MESHFREE_OT_apply_preset(ReadyOperator, bpy.types.Operator):
    """Set all settings that change results to those of a preset"""

    bl_idname = "meshfree.apply_preset"
    bl_label = "Apply Preset"

    preset: EnumProperty(name="Preset", description="Which settings to take", items=_BUILT_IN, default="DEFAULT")

    def execute(self, context):
        apply_preset(context.object.meshfree, PRESETS[self.preset])
        return {"FINISHED"}


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
    preset_operator = "script.execute_preset"

    def draw(self, context):
        for identifier, name, _ in _BUILT_IN:
            self.layout.operator("meshfree.apply_preset", text=name).preset = identifier
        self.layout.separator()
        bpy.types.Menu.draw_preset(self, context)


CLASSES = (MESHFREE_OT_apply_preset, MESHFREE_OT_add_preset, MESHFREE_MT_presets)
