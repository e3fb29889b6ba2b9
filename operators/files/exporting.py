"""File > Export: points with results, the operator with its spectrum, and the eigenvalues alone."""

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty
from bpy_extras.io_utils import ExportHelper

from ... import core
from ...command import analysis
from ...command.rows import write_rows, write_text
from ...command.svg import profile_picture
from ...core import PointCloudError
from ...core.files import WRITABLE, replacing, write_arrays, write_points
from ..objects.options import laplacian_options
from ..objects.parts import kept_rows
from ..objects.place import place_of
from ..objects.reading import TYPES, read_points
from ..objects.result import read_eigenvalues
from ..objects.splats import LEFT_BEHIND, are_left_behind, has_splats
from ..registration import Registration, Row
from ..running.application import build_operator
from ..running.job import JobOperator
from ..running.ready import reporting
from ..tools.splats import SplatOperator
from .objects import file_filter, point_table
from .splats import splats_in_world, splats_to_write


class ExportOperator(JobOperator, ExportHelper):
    """An operator that writes a file about the active object; an older file is kept if that fails.

    A subclass has a method `plan`, which reads everything needed and returns a function of a path and a progress
    callback that writes the file, without access to Blender, and returns a line for the status bar, or notices and it.
    """

    bl_options = {"REGISTER", "PRESET"}  # the scene is not changed

    def invoke(self, context, event):
        self._attended = True
        if not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.filepath = str(folder / f"{bpy.path.clean_name(context.object.name)}{self.filename_ext}")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        path = Path(bpy.path.abspath(self.filepath))
        reason = self.obstacle(context)
        if reason:  # since the file browser opened
            raise PointCloudError(f"{reason}.")
        if not path.name:
            raise PointCloudError("No file is named to write to. Give a File Path.")
        write = self.plan(context, context.object)
        return self.work(context, [], lambda progress: write(path, progress))

    def finish(self, context, objects, results):
        """Report what was written."""
        *notices, line = [results] if isinstance(results, str) else results
        for notice in notices:
            self.warn(notice, context.object)
        self.report({"INFO"}, line)
        return {"FINISHED"}


class MESHFREE_OT_export_points(ExportOperator, bpy.types.Operator):
    """Export the points of the active object as they are seen, with results, to a PLY, LAS, LAZ, XYZ or CSV file"""

    bl_idname = "meshfree.export_points"
    bl_label = "Export Points"
    asks = ("format", "attributes", "colors")

    filter_glob: file_filter(*WRITABLE)
    format: EnumProperty(
        name="Format",
        description="Kind of the file in the file browser; in scripts the ending of the name decides",
        items=[
            ("PLY", "PLY", "Binary, with the types of all values"),
            ("LAS", "LAS", "As scanners write it, with the coordinate system of a LAS or LAZ file that was imported"),
            ("LAZ", "LAZ", "The same, compressed"),
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

    def plan(self, context, obj):
        table, name = point_table(context, obj, self.attributes, self.colors), obj.name

        def write(path, progress):
            progress("Write", 0.0)
            notices = write_points(path, table, double=not table.single)
            return *table.notices, *notices, f"{name}: {len(table.points):,} points written to {path.name}"

        return write


class MESHFREE_OT_export_splats(ExportOperator, SplatOperator, bpy.types.Operator):
    """Export Gaussian splats to a PLY file, as deformations show them: of the active object, or of all selected ones"""

    bl_idname = "meshfree.export_splats"
    bl_label = "Export Splats"
    filename_ext = ".ply"

    asks = ("all_selected",)

    filter_glob: file_filter(".ply")
    all_selected: BoolProperty(
        name="All Selected",
        description="Write all selected objects of splats to one file, in world space",
        default=True,
    )

    def plan(self, context, obj):
        objects = [each for each in context.selected_objects if each.type in TYPES and has_splats(each.data)]
        several = self.all_selected and len(objects) > 1
        if several:
            splats, name, hint = splats_in_world(objects), f"{len(objects)} objects", ", in world space"
        else:
            objects, splats, name, hint = [obj], splats_to_write(obj), obj.name, _scale_hint(obj)
        for each in filter(lambda each: are_left_behind(each.data), objects):
            self.warn(f"{each.name}: {LEFT_BEHIND}", each)

        def write(path, progress):
            progress("Write", 0.0)
            core.splats.write_splats(path, splats)
            return f"{name}: {len(splats):,} splats written to {path.name}{hint}"

        return write


def _scale_hint(obj):
    scaled = not np.allclose(np.linalg.norm(np.array(obj.matrix_world)[:3, :3], axis=0), 1.0, atol=1e-5)
    return ". The scale of the object is not in it: Apply Transform to Splats applies it" if scaled else ""


class MESHFREE_OT_export_operator(ExportOperator, bpy.types.Operator):
    """Export the Laplace-Beltrami operator of the active object, its areas and its modes as numpy arrays"""

    bl_idname = "meshfree.export_operator"
    bl_label = "Export Laplacian"
    filename_ext = ".npz"

    filter_glob: file_filter(".npz")

    def plan(self, context, obj):
        reading, options = read_points(context, obj), laplacian_options(obj.meshfree)
        name, place, count = obj.name, place_of(obj), len(read_eigenvalues(obj))

        def write(path, progress):
            built = build_operator(reading, options, progress)
            spectrum = built.laplacian.eigenpairs(count, progress=progress) if count else None
            progress("Write", 1.0)
            write_arrays(path, analysis.arrays(place, built, spectrum))
            return f"{name}: {built.laplacian.stiffness.nnz:,} weights and {count} modes written to {path.name}"

        return write


class MESHFREE_OT_export_eigenvalues(ExportOperator, bpy.types.Operator):
    """Export the eigenvalues of the active object as a CSV file"""

    bl_idname = "meshfree.export_eigenvalues"
    bl_label = "Export Eigenvalues"
    filename_ext = ".csv"

    filter_glob: file_filter(".csv")

    @classmethod
    def lack(cls, context, obj):
        return "" if len(read_eigenvalues(obj)) else f'"{obj.name}" has no eigenvalues. Press Compute Modes first'

    def plan(self, context, obj):
        name, values = obj.name, read_eigenvalues(obj)

        def write(path, progress):
            rows = np.stack([np.arange(1, len(values) + 1), values], axis=1)
            with replacing(path) as part:
                np.savetxt(part, rows, ["%d", "%.17g"], ",", header="mode,eigenvalue", comments="")
            return f"{name}: {len(values)} eigenvalues written to {path.name}"

        return write


class MESHFREE_OT_export_measures(ExportOperator, bpy.types.Operator):
    """Export the measures of the active object's parts as a CSV file, in world lengths"""

    bl_idname = "meshfree.export_measures"
    bl_label = "Export Measures"
    filename_ext = ".csv"

    filter_glob: file_filter(".csv")

    @classmethod
    def lack(cls, context, obj):
        return "" if len(obj.meshfree.parts) else f'"{obj.name}" has no measures. Press Measure Parts first'

    def plan(self, context, obj):
        name, rows = obj.name, kept_rows(obj)

        def write(path, progress):
            write_rows(path, [row.record() for row in rows])
            return f"{name}: {len(rows)} parts written to {path.name}"

        return write


class MESHFREE_OT_export_profile(ExportOperator, bpy.types.Operator):
    """Export the last profile of the active object: its table as a CSV file, or a small picture as an SVG file"""

    bl_idname = "meshfree.export_profile"
    bl_label = "Export Profile"
    works_in = ("OBJECT", "EDIT")
    filename_ext = ".csv"
    check_extension = None  # of two

    filter_glob: file_filter(".csv", ".svg")

    @classmethod
    def lack(cls, context, obj):
        missing = f'"{obj.name}" has no profile. Select two points and press Profile first'
        return missing if obj.meshfree.profile is None else ""

    def plan(self, context, obj):
        name, table, suffix = obj.name, obj.meshfree.profile.as_string(), Path(self.filepath).suffix.lower()
        if suffix not in (".csv", ".svg"):
            raise PointCloudError(f'A profile is written as .csv or .svg, not as "{suffix}". Give such an ending.')
        text = profile_picture(table, context.scene.unit_settings) if suffix == ".svg" else table

        def write(path, progress):
            write_text(path, text)
            return f"{name}: profile written to {path.name}"

        return write


TOOLS = (
    Registration(MESHFREE_OT_export_points),
    Registration(MESHFREE_OT_export_splats, panel=Row("Splats", 1, 5, "Export Splats...")),
    Registration(MESHFREE_OT_export_operator),
    Registration(MESHFREE_OT_export_eigenvalues),
    Registration(MESHFREE_OT_export_measures),
    Registration(MESHFREE_OT_export_profile, panel=Row("Measure", 1, 4, "Export Profile...")),
)
