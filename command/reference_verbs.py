"""Verbs that hold clouds against that of another file."""

from pathlib import Path

from . import alignment, clouds, comparison, core
from .cloud_verb import CloudVerb, SurfaceVerb, floaters
from .quantities import COMPARED, written_by
from .settings import LAPLACIAN, chosen


def add_reference(parser, use):
    """Add the option for the other file."""
    parser.add_argument("--reference", required=True, metavar="FILE", help=f"{use}, of the kinds of inputs")


class Align(CloudVerb):
    """The verb `align`, whose outputs are in the coordinates of the reference."""

    name = "align"
    help = "move points onto the surface of those of another file, from nearby"
    settings = tuple(alignment.ALIGN.values())
    reads = ("reference",)
    operator = "align_points"  # which writes the same result in Blender
    _target = None  # points of the reference, in its coordinates

    def add_options(self, parser):
        add_reference(parser, "point cloud that the points are moved onto")
        super().add_options(parser)

    def work(self, path, given, arguments, output, progress):
        reference = Path(arguments.reference)
        if self._target is None:
            self._target = clouds.Cloud(reference, self.read(reference, arguments))
        cloud, target = clouds.Cloud(path, given), self._target
        shift = cloud.place - target.place
        found = core.align(cloud.points + shift, target.points, **chosen(self.settings, arguments), progress=progress)
        alignment.check_found(found, path.stem, reference.stem)
        written = []
        if output is not None:
            [residual] = written_by(self.operator)
            moved = clouds.moved(given, cloud.points + shift, found.matrix, target.place)
            written = clouds.write(output, moved, {residual: found.residual})
        half = f"half of them within {alignment.middle(found):.4g}"
        line = f"{path.stem}: {found.overlap:.0%} of the points lie on {reference.name}, {half}"
        figures = {"points": len(cloud.points), "done": line, **alignment.figures(found, target.place)}
        return figures, [*target.notices, *alignment.doubts(found), *written]


class Compare(SurfaceVerb):
    """The verb `compare`."""

    name = operator = "compare"
    help = "signed distance of points from the surface of those of another file"
    settings = tuple(comparison.COMPARE.values())
    reads = ("reference",)
    _target = _laplacian = None  # of the reference, in its coordinates

    def add_options(self, parser):
        add_reference(parser, "point cloud from whose surface distances are measured")
        super().add_options(parser)

    def work(self, path, given, arguments, output, progress):
        reference, values = Path(arguments.reference), chosen(LAPLACIAN.values(), arguments)
        if self._target is None:
            target = clouds.Cloud(reference, self.read(reference, arguments), floaters(arguments))
            self._laplacian = self.build(target, values, progress).laplacian
            self._target = target
        target, cloud = self._target, clouds.Cloud(path, given, floaters(arguments))
        normals, shift = self.build(cloud, values, progress).laplacian.normals, cloud.place - target.place
        names = path.stem, reference.stem
        own = chosen(self.settings, arguments)
        found, aligned = comparison.compared(
            cloud.points + shift, normals, self._laplacian, **own, names=names, advice="", progress=progress
        )
        told, written = [*target.notices, *([] if aligned is None else alignment.doubts(aligned))], []
        if output is not None:
            moved = given
            if aligned is not None:
                moved = clouds.moved(given, cloud.points + shift, aligned.matrix, target.place)
            [deviation] = written_by(self.operator)
            written = clouds.write(output, moved, {deviation: found.distance, COMPARED: found.known})
        line = comparison.line(found, path.stem, reference.name, "{:.4g}".format)
        figures = {"points": len(cloud.points), "done": line, **comparison.figures(found)}
        return figures, [*told, *comparison.left_out(found, reference.name), *written]
