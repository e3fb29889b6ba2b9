"""Base classes of tools that apply the Laplacian: read all, compute, and only then write."""

from bpy.props import BoolProperty

from ...command.analysis import Built
from ...command.naming import naming
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import DISC
from ..objects.carried import write_discs
from ..objects.colors import replaced_material, shows_own_material
from ..objects.handlers import notify
from ..objects.options import laplacian_options
from ..objects.reading import TYPES, discs, obstacle, read_points, sharing_objects
from ..objects.result import check_writable
from . import cache
from .job import JobOperator
from .ready import reporting


class Tool:
    """A computation on objects by settings: those of an operator, or attributes that the command line sets.

    A subclass has two methods: `plan` reads everything that is needed of an object and returns a function of a progress
    callback that computes, without access to Blender; `write` writes the result to the object and returns texts:
    notices, and last a line for the status bar.
    """

    asks = ()  # names of the settings in a dialog before the work; without any there is no dialog
    adjustable = ()  # names of those in Adjust Last Operation, which blocks: they repeat no long computation
    at_zero = {}  # texts beside settings of 0, by name, where 0 means automatic or unlimited
    writes = ()  # names of the attributes that `write` makes
    changes = True  # whether anything is written to the objects; else they may share their meshes with others

    @property
    def shown(self) -> str:
        """Name of the attribute to show; empty if the result is not an attribute."""
        return self.writes[0] if self.writes else ""

    def plan_all(self, context, objects, among=()):
        """Return name and plan of each object; for `among` see `check_writable`, which refuses others."""
        plans = []
        for obj in objects:
            with naming(obj.name):
                if self.changes:
                    check_writable(obj, self.writes, self.becomes_single(obj), among)
                plans.append((obj.name, self.plan(context, obj)))
        return plans

    def write_all(self, context, objects, results) -> list:
        """Write what was computed, and return the texts of each object."""
        for obj in objects:  # before anything is written to a mesh that is copied
            if self.becomes_single(obj) and sharing_objects(obj):
                obj.data = obj.data.copy()
        return [self.write(context, obj, result) for obj, result in zip(objects, results, strict=True)]

    def becomes_single(self, obj) -> bool:
        """Whether an object that shares its mesh gets its own."""
        return self.changes and obj.meshfree.make_single_user

    def is_repeated(self, context) -> bool:
        """Whether Adjust Last Operation runs this again."""
        return False


class ApplicationOperator(Tool, JobOperator):
    """An operator on the active object and on all other selected ones that can be read and written.

    Of objects that share a mesh and its scale, one is computed.
    """

    only_active = False  # whether other selected objects are ignored
    keeps_line = False  # whether its summary is kept as a notice

    at_once: BoolProperty(
        name="At Once",
        description="Use these settings, without asking",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def invoke(self, context, event):
        self._attended = True
        asked = self.asks and not self.at_once
        return context.window_manager.invoke_props_dialog(self) if asked else self.execute(context)

    @reporting
    def execute(self, context):
        context.view_layer.update()  # a script may have moved or scaled an object a line ago
        objects, self._left_out = self.chosen(context)
        plans = self.plan_all(context, objects, among=context.selected_objects)
        return self.work(context, objects, lambda progress: compute_all(plans, progress))

    def chosen(self, context):
        """Return the objects to work on, and why others were left out; see `chosen_objects`."""
        return ([self.subject(context)], []) if self.only_active else chosen_objects(context, self.becomes_single)

    def finish(self, context, objects, results):
        """Write what was computed, and report it."""
        sharing = [other for obj in objects for other in sharing_objects(obj)]
        with all_or_nothing([*objects, *sharing]):
            texts = self.write_all(context, objects, results)
            self.begin_notices(objects)
            self.conclude(context, objects)
            for reason in self._left_out:
                self.warn(f"Left out: {reason}.", objects[0])
            for obj, (*notices, line) in zip(objects, texts, strict=True):
                self.report_result(obj, notices, line)
        return {"FINISHED"}

    def conclude(self, context, objects):
        """Finish after all objects are written."""

    def report_result(self, obj, notices, line: str):
        """Report notices about an object, and a summary."""
        for notice in notices:
            self.warn(notice, obj)
        if self.keeps_line:
            self.note(line, obj)
        else:
            self.report({"INFO"}, line)

    def is_repeated(self, context):
        return any(last.as_pointer() == self.as_pointer() for last in context.window_manager.operators)


class ShownOperator(ApplicationOperator):
    """An operator that shows its attribute at the end."""

    show: BoolProperty(name="Show", description="Show the result as colors on the points", default=True)
    adjustable = ("show",)

    def conclude(self, context, objects):
        sharing = [other for obj in objects for other in sharing_objects(obj) if other in context.selected_objects]
        if self.show:
            for obj in objects:
                _write_discs(context, obj)
            for obj in filter(shows_own_material, [*objects, *sharing]):
                self.warn(replaced_material(obj), obj)
            for obj in [*objects, *sharing]:
                notify("result_written", obj, self.shown if self.shown in obj.data.attributes else "")


def _write_discs(context, obj):
    """Write the discs of an object's points for the display, if the operator of all of them is kept."""
    reading, options = read_points(context, obj), laplacian_options(obj.meshfree)
    if DISC in obj.vertex_groups or not cache.holds(reading.points, options, reading.boundary, reading.splats):
        return
    laplacian = build_operator(reading, options, lambda *_: None).laplacian
    write_discs(obj, discs(reading.local_normals(laplacian.normals), laplacian.disc_radii, reading.points))


def compute_all(plans, progress):
    """Compute plans of objects, given by name, and return the results."""
    results = []
    for number, (name, plan) in enumerate(plans):

        def report(stage, fraction, number=number):
            progress(stage, (number + fraction) / len(plans))

        with naming(name):
            results.append(plan(report))
    return results


def chosen_objects(context, becomes_single):
    """Choose among the active object and the other selected ones all that can be read and written.

    Of those that share a mesh one is chosen, but each that becomes single, as the function tells. Return them, and why
    others were left out.
    """
    chosen, left_out = {}, []
    for obj in [context.object, *context.selected_objects]:
        reason = obstacle(obj)
        if not reason:
            chosen.setdefault(obj if becomes_single(obj) else obj.data, obj)
        elif obj.type in TYPES:
            left_out.append(reason)
    return list(chosen.values()), left_out


def operator_reader(context, obj):
    """Read an object's points; return them, and a function of a progress callback that gives their operator."""
    reading = read_points(context, obj)
    options = laplacian_options(obj.meshfree)

    def operator(progress):
        return build_operator(reading, options, progress).laplacian

    return reading, operator


def build_operator(reading, options, progress) -> Built:
    """Return the operator of an object's points as they were read, with the mean curvature."""
    return cache.build(
        reading.points, options, reading.boundary, progress, orientation=reading.orientation, splats=reading.splats
    )
