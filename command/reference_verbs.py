"""Verbs that hold clouds against that of another file."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from . import alignment, clouds, colors, comparison, core, quantities, transferring
from .cloud_verb import CloudVerb, SurfaceVerb, boundary_of, floaters
from .naming import naming
from .results import number_text
from .settings import LAPLACIAN, chosen


class WithReference(CloudVerb):
    """A verb with another file, which is read once, before the first input."""

    reads = ("reference",)
    use = ""  # what the reference is for, for the help
    required = True  # whether there must be one
    _own = _target = None  # arguments with the settings of the reference, and its cloud

    def add_options(self, parser):
        parser.add_argument(
            "--reference", required=self.required, metavar="FILE", help=f"{self.use}, of the kinds of inputs"
        )
        for ending in clouds.kinds():
            parser.add_argument(
                "--reference-object", default="", metavar="NAME", help=f"object of a {ending} file; else the active one"
            )
        super().add_options(parser)

    def run(self, path, arguments, output):
        if self._target is None and arguments.reference is not None:
            reference = Path(arguments.reference)
            given = self.read(reference, arguments, "reference_object")  # whose errors have its name already
            self._own = clouds.with_own(arguments, given)
            with naming(reference):
                self._target = self.target(reference, given)
        return super().run(path, arguments, output)

    def target(self, path, given):
        """Return the cloud of the reference, with all that is read of it."""
        return clouds.Cloud(path, given)


class Align(WithReference):
    """The verb `align`, whose outputs are in the coordinates of the reference."""

    name = "align"
    help = "move points onto the surface of those of another file, from nearby"
    bytes_a_point = 500
    settings = tuple(alignment.ALIGN.values())
    operator = "align_points"  # which writes the same result in Blender
    use = "point cloud that the points are moved onto"

    def work(self, path, given, arguments, output, progress):
        reference = Path(arguments.reference)
        cloud, target = clouds.Cloud(path, given), self._target
        shift = cloud.place - target.place
        found = core.measure.align(
            cloud.points + shift, target.points, **chosen(self.settings, arguments), progress=progress
        )
        alignment.check_found(found, path.stem, reference.stem)
        written = []
        if output is not None:
            [residual] = quantities.written_by(self.operator)
            moved = clouds.moved(given, cloud.points + shift, found.matrix, target.place)
            written = clouds.write(output, moved, {residual: found.residual})
        half = f"half of them within {alignment.middle(found):.4g}"
        line = f"{path.stem}: {found.overlap:.0%} of the points lie on {reference.name}, {half}"
        figures = {"points": len(cloud.points), "done": line, **alignment.figures(found, target.place)}
        return figures, [*target.notices, *alignment.doubts(found), *written]


class ReferenceVerb(WithReference, SurfaceVerb):
    """A verb that holds surfaces against that of another file, which is analyzed once."""

    _laplacian = None

    def target(self, path, given):
        cloud = clouds.Cloud(path, given, floaters(self._own))
        boundary_of(cloud, vars(self._own))
        return cloud

    @property
    def read_notices(self) -> list:
        """What was told as the reference was read, if there is one."""
        return [] if self._target is None else self._target.notices

    def reference(self, progress):
        """Return the cloud of the reference, and its operator."""
        if self._laplacian is None:
            with naming(self._target.path):
                values = chosen(LAPLACIAN.values(), self._own)
                self._laplacian = self.build(self._target, values, progress).laplacian
        return self._target, self._laplacian


class Compare(ReferenceVerb):
    """The verb `compare`."""

    name = operator = "compare"
    help = "distance of points from the surface of those of another file, along normals or the nearest one"
    settings = tuple(comparison.COMPARE.values())
    use = "point cloud from whose surface distances are measured"

    def work(self, path, given, arguments, output, progress):
        (target, laplacian), reference = self.reference(progress), Path(arguments.reference)
        cloud, values = clouds.Cloud(path, given, floaters(arguments)), chosen(LAPLACIAN.values(), arguments)
        own, shift = SimpleNamespace(**chosen(self.settings, arguments)), cloud.place - target.place

        def build(progress):
            return comparison.Sided(
                self.build(cloud, values, progress).laplacian, cloud.columns.get(quantities.ORIENTATION)
            )

        other = comparison.Sided(laplacian, target.columns.get(quantities.ORIENTATION))
        names = path.stem, reference.name
        found, aligned, told = comparison.compared(
            cloud.points + shift, build, lambda _: other, own, names, "", progress
        )
        told = [*target.notices, *([] if aligned is None else alignment.doubts(aligned)), *told]
        if output is not None:
            moved = given
            if aligned is not None:
                moved = clouds.moved(given, cloud.points + shift, aligned.matrix, target.place)
            [deviation] = quantities.written_by(self.operator)
            told += clouds.write(output, moved, {deviation: found.distance, quantities.COMPARED: found.known})
        line = comparison.line(found, path.stem, reference.name, number_text)
        return {"points": len(cloud.points), "done": line, **comparison.figures(found)}, told


class TransferAttributes(ReferenceVerb):
    """The verb `transfer-attributes`."""

    name, operator = "transfer-attributes", "transfer_attributes"
    help = "colors, numbers, vectors and labels from the surface of those of another file"
    settings = (*transferring.MATCH.values(), *transferring.ATTRIBUTES.values())
    use = "points whose attributes are taken"

    def work(self, path, given, arguments, output, progress):
        target, laplacian = self.reference(progress)
        own, reference = SimpleNamespace(**chosen(self.settings, arguments)), arguments.reference
        arrays, left_out = _values(target, own)
        cloud, values = clouds.Cloud(path, given, floaters(arguments)), chosen(LAPLACIAN.values(), arguments)
        built = self.build(cloud, values, progress).laplacian
        offsets = [target.place - cloud.place]
        match = transferring.matched(built, [laplacian], offsets, own, path.stem, [reference], progress)
        smooth = [name for name, column in arrays.items() if _is_smooth(name, column)]
        new = transferring.taken(match, arrays, smooth, progress)
        notices, line = transferring.told(match, transferring.counted(arrays), path.stem, reference, number_text)
        told = [*target.notices, *transferring.left_out(left_out), *notices]
        if output is not None:
            told += _write_taken(output, cloud, new, match.state)
        return {"points": len(cloud.points), "done": line, **match.figures}, [*built.notices, *told]


def _values(cloud, own):
    """Return the columns of a cloud that settings ask for, by name, colors as linear ones; and which are left out."""
    columns, tint = dict(cloud.columns), cloud.given.colors if cloud.splats is None else None
    if tint is not None:
        columns[colors.COLOR] = colors.linear(np.asarray(tint, dtype=np.float64))
    wanted = {name: column for name, column in columns.items() if transferring.is_wanted(name, own, colors.COLOR)}
    found = {name: column for name, column in wanted.items() if np.isfinite(column).all()}
    transferring.check_found(found, own, str(cloud.path))
    return found, sorted(wanted.keys() - found.keys())


def _is_smooth(name, column):
    """Whether numbers are averaged: those that are no labels."""
    return column.dtype.kind == "f" and quantities.quantity(name).carried != "label"


def _write_taken(output, cloud, new, state):
    """Write a cloud with what it has taken, by name; return notices."""
    given, tint, state = cloud.given, new.pop(colors.COLOR, None), {quantities.TRANSFER: state}
    if output.suffix.lower() == ".npz":
        return clouds.write(output, given, {**new, **state} | ({} if tint is None else {"colors": colors.srgb(tint)}))
    if cloud.splats is not None:
        kept = [] if tint is None else ["Splats have colors of their own, so that none are taken."]
        return [*clouds.write(output, given, {**new, **state}), *kept]
    if tint is not None:
        given = replace(given, colors=np.clip(colors.srgb(tint), 0.0, 1.0).astype(np.float32))
    return clouds.write(output, replace(given, attributes={**given.attributes, **new}), state)
