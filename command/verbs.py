"""The verbs that need no Blender."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import analysis, clouds, core, quantities
from .analysis import WRITE_LIMIT
from .bending import Deform, SplatInfo
from .cloud_verb import CloudVerb, Printed, SurfaceVerb, Task
from .mesh_verb import MeshVerb
from .orienting import OrientVerb
from .reference_verbs import AlignVerb, CompareVerb, MeasureVerb, TransferAttributes
from .settings import LAPLACIAN, Setting, chosen
from .summary import Report
from .table_verbs import ProfileVerb, SectionVerb
from .tile_verbs import TilesAgree, TilesCut, TilesMeasure, TilesModes, TilesReport, TilesRun, TilesSurvey
from .tool_verb import declared_verbs
from .verb import Verb

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from pathlib import Path

    from tools.tool import Array

_DECLARED = {
    "align_points": AlignVerb,
    "compare": CompareVerb,
    "cross_section": SectionVerb,
    "measure_parts": MeasureVerb,
    "mesh_surface": MeshVerb,
    "orient_normals": OrientVerb,
    "profile": ProfileVerb,
}


def make_verbs() -> list[Verb]:
    """Return new verbs of all kinds: those on surfaces, those on points, and those that need no object."""
    return [Analyze(), *declared_verbs(_DECLARED), TransferAttributes(), *without_object()]


def without_object() -> list[Verb]:
    """Return new verbs that in Blender, too, need no object."""
    on_tiles = TilesRun(), TilesCut(), TilesSurvey(), TilesAgree(), TilesMeasure(), TilesModes(), TilesReport()
    return [Info(), Convert(), SplatInfo(), Deform(), Report(), *on_tiles]


class Info(CloudVerb):
    """The verb `info`."""

    name = "info"
    help = "summarize files of points: number, bounds, spacing, columns"
    outputs = ()

    def work(self, task: Task) -> Printed:
        cloud = clouds.Cloud(task.path, task.given, floaters=False)
        return {
            "points": len(cloud.points),
            "low": (cloud.points.min(axis=0) + cloud.place).tolist(),
            "high": (cloud.points.max(axis=0) + cloud.place).tolist(),
            "spacing": float(core.geometry.typical_distance(cloud.points)),
            "columns": list(cloud.columns),
            "colors": cloud.splats is not None or task.given.colors is not None,
        }, []


class Convert(CloudVerb):
    """The verb `convert`."""

    name = "convert"
    help = "write points to another kind of file, with all their columns"

    def work(self, task: Task) -> Printed:
        given, output = task.given, task.output
        if output is None:
            raise core.PointCloudError("Nothing would be written. Give --out or --out-dir.")
        if isinstance(given, core.splats.Splats):
            lost = ["Of splats, .npz holds the positions only."] if output.suffix.lower() == ".npz" else []
            return {"points": len(given)}, [*clouds.write(output, given, {}), *lost]
        columns = given.attributes if given.colors is None else {**given.attributes, "colors": given.colors}
        written = clouds.write(output, given, columns if output.suffix.lower() == ".npz" else {})
        return {"points": len(given.points)}, written


class Frames(Verb):
    """A verb that takes its inputs as frames of a sequence, if the option `sequence` is given."""

    prints_all = True  # but what is at each point, which is said on standard error

    def add_sequence(self, parser: ArgumentParser) -> None:
        """Add the option."""
        parser.add_argument(
            "--sequence",
            action="store_true",
            help="the inputs are frames in their order: each mode continues one of the frame before, with its sign, so"
            " that eigenvalues need not ascend; overlaps of the two are written, too",
        )

    def expand(self, path: Path, arguments: Namespace) -> list[Path]:
        """Return the numbered files of a folder."""
        if arguments.sequence and path.is_dir():
            return core.files.numbered_files(path)
        return super().expand(path, arguments)

    def check_sequence(self, parser: ArgumentParser, arguments: Namespace, modes: int) -> None:
        """Refuse what does not go with a sequence, by `parser.error`."""
        if arguments.sequence and not modes:
            parser.error("--sequence matches modes: give --modes, too")
        if arguments.sequence and (arguments.part != (1, 1) or arguments.skip_done):
            parser.error("--sequence needs all frames, one after the other: leave --part and --skip-done out")


class Analyze(Frames, SurfaceVerb):
    """The verb `analyze`, for single files or for the frames of a sequence."""

    name = "analyze"
    help = "areas, normals, curvature, boundaries and vibration modes of point clouds"
    settings = (
        Setting("modes", "how many vibration modes to compute", 0, 0),
        Setting("write_limit", "modes written as attributes at most", WRITE_LIMIT, 1),
    )
    _earlier: tuple[core.Spectrum, Array] | None = None  # modes and points of the frame before

    def add_options(self, parser: ArgumentParser) -> None:
        self.add_sequence(parser)
        super().add_options(parser)

    def check(self, parser: ArgumentParser, arguments: Namespace) -> None:
        self.check_sequence(parser, arguments, chosen(self.settings, arguments)["modes"])

    def work(self, task: Task) -> Printed:
        cloud, arguments, output = task.cloud, task.arguments, task.output
        own = chosen(self.settings, arguments)
        built = self.build(cloud, chosen(LAPLACIAN.values(), arguments), task.progress)
        laplacian, spectrum, notices, matched = built.laplacian, None, list[str](), dict[str, Any]()
        if own["modes"]:
            spectrum, notices = analysis.resolved_modes(laplacian, own["modes"], task.progress)
        if arguments.sequence and spectrum is not None:
            places = cloud.points + cloud.place
            spectrum, overlaps, self._earlier = analysis.continued(spectrum, laplacian.areas, places, self._earlier)
            matched["overlaps"] = overlaps.tolist()
        measures, written = built.measures, []
        numbers = {} if spectrum is None else {quantities.EIGENVALUES: spectrum.eigenvalues}
        if output is not None:
            vectors = () if spectrum is None else spectrum.eigenvectors[:, : own["write_limit"]].T
            modes = {quantities.eigenvector_name(number): vector for number, vector in enumerate(vectors, 1)}
            everything = analysis.arrays(cloud.place, built, spectrum) if output.suffix.lower() == ".npz" else None
            written = clouds.write(output, task.given, {**measures, **modes}, everything, numbers)
        return {**analysis.figures(measures, spectrum), **matched}, [*built.notices, *notices, *written]
