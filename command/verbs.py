"""The verbs that need no Blender."""

from types import SimpleNamespace

from . import analysis, clouds, core, quantities
from .analysis import WRITE_LIMIT
from .bending import Deform, SplatInfo
from .cloud_verb import CloudVerb, SurfaceVerb, floaters
from .measures import (
    OVER,
    add_base,
    base_of,
    check_base,
    check_labels,
    check_numbers,
    measured_line,
    part_table,
    volumes_over,
)
from .mesh_verb import Mesh
from .reference_verbs import Align, Compare, ReferenceVerb, TransferAttributes
from .result_verbs import Orient
from .results import number_text
from .rows import TABLES, write_rows
from .settings import LAPLACIAN, Setting, chosen
from .source_verbs import Simulate
from .summary import Report
from .table_verbs import Profile, Section
from .tile_verbs import TilesAgree, TilesCut, TilesMeasure, TilesModes, TilesReport, TilesRun, TilesSurvey
from .tool_verb import declared_verbs


def make_verbs() -> list:
    """Return new verbs of all kinds: those on surfaces, those on points, and those that need no object."""
    others = Measure, Section, Profile, Orient, Mesh, Simulate, Align, Compare, TransferAttributes
    return [Analyze(), *declared_verbs(), *(verb() for verb in others), *without_object()]


def without_object() -> list:
    """Return new verbs that in Blender, too, need no object."""
    on_tiles = TilesRun(), TilesCut(), TilesSurvey(), TilesAgree(), TilesMeasure(), TilesModes(), TilesReport()
    return [Info(), Convert(), SplatInfo(), Deform(), Report(), *on_tiles]


class Info(CloudVerb):
    """The verb `info`."""

    name = "info"
    help = "summarize files of points: number, bounds, spacing, columns"
    outputs = ()

    def work(self, path, given, arguments, output, progress):
        cloud = clouds.Cloud(path, given, floaters=False)
        return {
            "points": len(cloud.points),
            "low": (cloud.points.min(axis=0) + cloud.place).tolist(),
            "high": (cloud.points.max(axis=0) + cloud.place).tolist(),
            "spacing": float(core.geometry.typical_distance(cloud.points)),
            "columns": list(cloud.columns),
            "colors": cloud.splats is not None or given.colors is not None,
        }, []


class Convert(CloudVerb):
    """The verb `convert`."""

    name = "convert"
    help = "write points to another kind of file, with all their columns"

    def work(self, path, given, arguments, output, progress):
        if output is None:
            raise core.PointCloudError("Nothing would be written. Give --out or --out-dir.")
        if isinstance(given, core.splats.Splats):
            lost = ["Of splats, .npz holds the positions only."] if output.suffix.lower() == ".npz" else []
            return {"points": len(given)}, [*clouds.write(output, given, {}), *lost]
        columns = given.attributes if given.colors is None else {**given.attributes, "colors": given.colors}
        written = clouds.write(output, given, columns if output.suffix.lower() == ".npz" else {})
        return {"points": len(given.points)}, written


class Frames:
    """A verb that takes its inputs as frames of a sequence, if the option `sequence` is given."""

    prints_all = True  # but what is at each point, which is said on standard error

    def add_sequence(self, parser):
        """Add the option."""
        parser.add_argument(
            "--sequence",
            action="store_true",
            help="the inputs are frames in their order: each mode continues one of the frame before, with its sign, so"
            " that eigenvalues need not ascend; overlaps of the two are written, too",
        )

    def expand(self, path, arguments):
        """Return the numbered files of a folder."""
        if arguments.sequence and path.is_dir():
            return core.files.numbered_files(path)
        return super().expand(path, arguments)

    def check_sequence(self, parser, arguments, modes):
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
    _earlier = None  # modes and points of the frame before

    def add_options(self, parser):
        self.add_sequence(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        self.check_sequence(parser, arguments, chosen(self.settings, arguments)["modes"])

    def work(self, path, given, arguments, output, progress):
        cloud, own = clouds.Cloud(path, given, floaters(arguments)), chosen(self.settings, arguments)
        built = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress)
        laplacian, spectrum, notices, matched = built.laplacian, None, [], {}
        if own["modes"]:
            spectrum, notices = analysis.resolved_modes(laplacian, own["modes"], progress)
        if arguments.sequence:
            places = cloud.points + cloud.place
            spectrum, overlaps, self._earlier = analysis.continued(spectrum, laplacian.areas, places, self._earlier)
            matched["overlaps"] = overlaps.tolist()
        measures, written = built.measures, []
        numbers = {} if spectrum is None else {quantities.EIGENVALUES: spectrum.eigenvalues}
        if output is not None:
            vectors = () if spectrum is None else spectrum.eigenvectors[:, : own["write_limit"]].T
            modes = {quantities.eigenvector_name(number): vector for number, vector in enumerate(vectors, 1)}
            everything = analysis.arrays(cloud.place, built, spectrum) if output.suffix.lower() == ".npz" else None
            written = clouds.write(output, given, {**measures, **modes}, everything, numbers)
        return {**analysis.figures(measures, spectrum), **matched}, [*built.notices, *notices, *written]


class Measure(ReferenceVerb):
    """The verb `measure`, whose outputs are tables."""

    name, operator = "measure", "measure_parts"
    help = "measure every component and segment: points, area, boundary, volume, and the mean of a column"
    outputs = TABLES
    prints_all = True
    settings = (
        Setting("volume", "Measure the volume within closed components, too. It takes longer", True),
        Setting("source", "Numbers at the points whose mean is wanted; empty for the roughness, if there is one", ""),
    )
    use, required = OVER, False

    def add_options(self, parser):
        add_base(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        check_base(parser, arguments)
        super().check(parser, arguments)

    def work(self, path, given, arguments, output, progress):
        cloud, own = clouds.Cloud(path, given, floaters(arguments)), SimpleNamespace(**chosen(self.settings, arguments))
        labels, [roughness] = cloud.columns.get(quantities.SEGMENT), quantities.written_by("roughness")
        if labels is not None:
            check_labels(labels, quantities.SEGMENT, str(path))
        name = own.source or (roughness if roughness in cloud.columns else "")
        values = cloud.numbers(name, "--source") if name else None
        if values is not None:
            check_numbers(values, name, str(path))
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        rows, notices = part_table(laplacian, labels, values, own.volume, progress)
        base = base_of(arguments.plane, arguments.normal, cloud.place, *self._ground(arguments, progress))
        volumes, told = volumes_over(laplacian, rows, labels, base, progress)
        records = [row.record() | over for row, over in zip(rows, volumes, strict=True)]
        if output is not None:
            write_rows(output, records)
        line = measured_line(rows, path.stem, number_text)
        return {"points": len(cloud.points), "done": line, "parts": records}, [*notices, *self.read_notices, *told]

    def _ground(self, arguments, progress):
        """Return what `base_of` takes of the other cloud, if there is one."""
        if arguments.reference is None:
            return ()
        target, laplacian = self.reference(progress)
        return lambda _: laplacian, target.place, target.path.name
