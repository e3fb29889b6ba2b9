"""File > Export: points with results, the operator with its spectrum, and the eigenvalues alone."""

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..core import PointCloudError
from ..core.files import replacing, write_points
from . import cache
from .files import analysis_arrays, point_table, save_arrays
from .options import laplacian_options
from .reading import read_points
from .ready import ReadyOperator
from .result import EIGENVALUES
from .stages import Stages


class ExportOperator(ReadyOperator, ExportHelper):
    """An operator that writes one file about the active object; an older file stays if that fails."""

    bl_options = {"REGISTER", "PRESET"}  # nothing of the scene is changed
    suffix = ""  # of the name in the file browser

    @property
    def filename_ext(self):
        """What `ExportHelper` adds to a name."""
        return self.suffix

    def invoke(self, context, event):
        if not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.filepath = str(folder / f"{bpy.path.clean_name(context.object.name)}{self.filename_ext}")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        path = Path(bpy.path.abspath(self.filepath))
        try:
            message = self.export(context, context.object, path)
        except (PointCloudError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{context.object.name}: {message} written to {path.name}")
        return {"FINISHED"}


class MESHFREE_OT_export_points(ExportOperator, bpy.types.Operator):
    """Export the points of the active object as they are seen, with their results, to a PLY, XYZ or CSV file"""

    bl_idname = "meshfree.export_points"
    bl_label = "Export Points"

    filter_glob: StringProperty(
        name="File Filter",
        description="Names of files that are listed",
        default="*.ply;*.xyz;*.csv",
        options={"HIDDEN"},
    )
    format: EnumProperty(
        name="Format",
        description="Kind of the file in the file browser; in scripts the ending of the name decides",
        items=[
            ("PLY", "PLY", "Binary, with the types of all values"),
            ("XYZ", "XYZ", "Text with a point a line, and the names of the columns in a comment"),
            ("CSV", "CSV", "Text for spreadsheets, with the names of the columns in the first line"),
        ],
        default="PLY",
        options={"SKIP_SAVE"},
    )
    attributes: EnumProperty(
        name="Attributes",
        description="Which values of the points are written",
        items=[
            ("ALL", "All", "All attributes of the points that are numbers, vectors or truth values"),
            ("RESULTS", "Results", "Those of this extension alone"),
            ("NONE", "None", "Coordinates alone"),
        ],
        default="ALL",
    )
    colors: BoolProperty(name="Colors", description="Write the color attribute as red, green and blue", default=True)

    @property
    def filename_ext(self):
        """What `ExportHelper` adds to a name."""
        return f".{self.format.lower()}"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("format", "attributes", "colors"):
            layout.prop(self, name)

    def export(self, context, obj, path):
        table = point_table(context, obj, self.attributes, self.colors)
        write_points(path, table, double=not table.single)
        for notice in table.notices:
            self.report({"WARNING"}, notice)
        return f"{len(table.points):,} points"


class MESHFREE_OT_export_operator(ExportOperator, bpy.types.Operator):
    """Export the Laplace-Beltrami operator of the active object, its areas and its modes as numpy arrays"""

    bl_idname = "meshfree.export_operator"
    bl_label = "Export Laplacian"
    suffix = ".npz"

    filter_glob: StringProperty(
        name="File Filter", description="Names of files that are listed", default="*.npz", options={"HIDDEN"}
    )

    def export(self, context, obj, path):
        reading = read_points(context, obj)
        count = len(obj.get(EIGENVALUES, ()))
        with Stages(context.window_manager) as stages:
            built = cache.build(reading.points, laplacian_options(obj.meshfree), reading.rim, stages)
            spectrum = cache.lowest_modes(built.laplacian, count, stages) if count else None
        save_arrays(path, analysis_arrays(obj, built.laplacian, built.mean_curvature, spectrum))
        return f"{built.laplacian.stiffness.nnz:,} weights and {count} modes"


class MESHFREE_OT_export_eigenvalues(ExportOperator, bpy.types.Operator):
    """Export the eigenvalues of the active object as a CSV file"""

    bl_idname = "meshfree.export_eigenvalues"
    bl_label = "Export Eigenvalues"
    suffix = ".csv"

    filter_glob: StringProperty(
        name="File Filter", description="Names of files that are listed", default="*.csv", options={"HIDDEN"}
    )

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if EIGENVALUES not in context.object:
            cls.poll_message_set(f'"{context.object.name}" has no eigenvalues. Press Compute Modes first')
            return False
        return True

    def export(self, context, obj, path):
        values = np.array(obj[EIGENVALUES])
        rows = np.stack([np.arange(1, len(values) + 1), values], axis=1)
        with replacing(path) as part:
            np.savetxt(part, rows, ["%d", "%.17g"], ",", header="mode,eigenvalue", comments="")
        return f"{len(values)} eigenvalues"


CLASSES = (MESHFREE_OT_export_points, MESHFREE_OT_export_operator, MESHFREE_OT_export_eigenvalues)
