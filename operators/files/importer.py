"""What all imports of points have in common: their settings, and what happens to the new objects."""

import math
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ... import core
from ...core import PointCloudError
from ...core.files import LasChoices, parse_classes
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import own_positions
from ..objects.place import offset_of
from ..objects.reading import TYPES
from ..running.job import JobOperator
from .columns import column_notices

_SENSOR = 36.0  # half the width of what a view of a lens shows, in its unit
_DEPTH = 10.0  # clipping distance of views relative to that of their center
_KINDS = [("MESH", "Mesh", "A mesh of loose vertices, which Edit Mode can select and vertex groups can hold")]
if bpy.app.version >= (4, 5, 0):
    _KINDS.append(("POINTCLOUD", "Point Cloud", "A point cloud object, which shows its points by itself"))


# Blender 5.2 crashes when it is given a path relative to the file for a property that does not say so.
_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


class ImportOperator(JobOperator, ImportHelper):
    """An operator that imports points of the chosen files; `_add` puts into the scene what was read."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}
    filepath: StringProperty(
        name="File Path",
        description="File to import",
        maxlen=1024,
        subtype="FILE_PATH",
        options={"HIDDEN", "SKIP_PRESET", *_RELATIVE},
    )
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Files",
        description="Names of the files in the folder, if there are several",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    directory: StringProperty(
        name="Folder",
        description="Folder of several files",
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE", *_RELATIVE},
    )
    kind: EnumProperty(name="Object", description="What the points become", items=_KINDS, default="MESH")
    attributes: BoolProperty(
        name="Attributes",
        description="Import the other columns too: colors, normals, intensity and so on",
        default=True,
    )
    classes: StringProperty(
        name="Classes",
        description="Import only points of these classes of LAS files, such as 2 5 or 3-5 (2 is the ground); empty for"
        " all",
    )
    withheld: BoolProperty(
        name="Withheld Points",
        description="Import points of LAS files, too, that are flagged as withheld, which means deleted",
        default=False,
    )
    meters: BoolProperty(
        name="Convert to Meters",
        description="Convert coordinates of LAS files that are in feet or the like, as the file states, to meters; else"
        " they are imported as they are",
        default=False,
    )
    frame: BoolProperty(
        name="Frame in View",
        description="Let the 3D views look at the imported points, unless a script imports them",
        default=True,
    )

    @classmethod
    def obstacle(cls, context):
        if context.mode == "OBJECT":
            return ""
        return "Points are imported in Object Mode. Switch to Object Mode first"

    def invoke(self, context, event):
        self._attended = True
        return self.invoke_popup(context)

    def begin(self, context, compute):
        """Read in the background, or at once for scripts: `compute` is called with the progress callback."""
        self._framed = self._attended and self.frame
        return self.work(context, [], compute)

    def chosen(self):
        """Return the chosen files."""
        names = [item.name for item in self.files if item.name]
        folder = Path(bpy.path.abspath(self.directory))
        return [folder / name for name in names] or [Path(bpy.path.abspath(self.filepath))]

    def las_choices(self) -> LasChoices:
        """Return which points of LAS files are read, and in which unit."""
        return LasChoices(parse_classes(self.classes), self.withheld, self.meters)

    def finish(self, context, objects, results):
        """Add objects of what was read."""
        reason = self.obstacle(context)
        if reason:  # while the files were read
            raise PointCloudError(reason)
        with all_or_nothing([]):
            for other in context.selected_objects:
                other.select_set(False)
            self._add(context, results)
        if self._framed:
            _frame_selected(context)
        return {"FINISHED"}

    def tell(self, obj, table, shared, what):
        """Report what was imported, and how its coordinates were shifted."""
        for notice in (*table.notices, *column_notices(obj, getattr(table, "attributes", {}))):
            self.warn(notice, obj)
        offset = offset_of(obj)
        self.report({"INFO"}, f"{obj.name}: {what}")
        if offset.any():
            self.note(f"{obj.name} is shifted by ({', '.join(f'{0.0 - value:.10g}' for value in offset)})", obj)
        if shared is not None and (offset != shared).any():
            self.warn(f"{obj.name} is too far from the points imported before to share their shift", obj)


def convert(context, objects):
    """Convert new meshes to point clouds, where Blender can."""
    if bpy.app.version < (4, 5) or not objects:
        return
    context.view_layer.update()
    for other in context.view_layer.objects:
        other.select_set(other in objects)
    active = context.view_layer.objects.active
    context.view_layer.objects.active = objects[0]
    meshes = [obj.data for obj in objects]
    bpy.ops.object.convert(target="POINTCLOUD")
    bpy.data.batch_remove(meshes)
    context.view_layer.objects.active = active


def _frame_selected(context):
    """Frame the selected objects in all 3D views of the window, without a few points far from all others."""
    points = np.concatenate([_world_points(obj) for obj in context.selected_objects] or [np.zeros((0, 3))])
    near = core.geometry.without_far(points) if len(points) else points
    for area in context.window.screen.areas:
        if area.type == "VIEW_3D":
            region = next(region for region in area.regions if region.type == "WINDOW")
            with context.temp_override(area=area, region=region):
                space, view = area.spaces.active, area.spaces.active.region_3d
                if len(near) == len(points):
                    bpy.ops.view3d.view_selected()
                else:  # which would frame strays, too
                    _look_at(near, region, space)
                space.clip_end = max(space.clip_end, _DEPTH * view.view_distance)  # else large scans are clipped


def _world_points(obj):
    """Read the points of an object in the world that are finite, (n, 3)."""
    points = own_positions(obj.data) if obj.type in TYPES else np.zeros((0, 3))
    matrix = np.array(obj.matrix_world)
    return points[np.isfinite(points).all(axis=1)] @ matrix[:3, :3].T + matrix[:3, 3]


def _look_at(points, region, space):
    """Let a 3D view show points, (n, 3), from where it looks."""
    low, high = points.min(axis=0), points.max(axis=0)
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        view.view_perspective = "PERSP"
    view.view_location = 0.5 * (low + high)
    wide = max(region.width, region.height) / max(min(region.width, region.height), 1)
    slope = _SENSOR / space.lens / wide  # of the nearer edge of the view
    view.view_distance = max(0.5 * float(np.linalg.norm(high - low)) * math.hypot(1.0, 1.0 / slope), 1e-3)
