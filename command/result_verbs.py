"""Verbs that add results to the points."""

from types import SimpleNamespace

import numpy as np

from . import analysis, clouds, core, fields, orienting, results, segmenting, uncached
from .cloud_verb import SurfaceVerb, floaters
from .groups import read_weights
from .quantities import NORMAL, ORIENTATION, rows_of
from .results import Told, number_text
from .settings import LAPLACIAN, chosen


class ResultVerb(SurfaceVerb):
    """A verb that adds the results of a tool; `compute` of a subclass computes them."""

    operator = ""  # of Blender, which writes the same results

    def work(self, path, given, arguments, output, progress):
        cloud = clouds.Cloud(path, given, floaters(arguments))
        own = SimpleNamespace(**chosen(self.settings, arguments))
        wanted = self.wanted(cloud, own, arguments)
        built = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress)
        told = self.compute(built, wanted, path.stem, own, progress)
        written = [] if output is None else clouds.write(output, given, told.values)
        return {"points": len(cloud.points), "done": told.line}, [
            *built.laplacian.notices,
            *told.notices,
            *written,
        ]

    def wanted(self, cloud, own, arguments):
        """Return what the result needs of a cloud beside its points, read before anything is computed."""
        return None

    def compute(self, built, wanted, name, own, progress) -> Told:
        """Return the results on a cloud of some name, by the names of attributes, and what there is to tell of them.

        Parameters
        ----------
        built : Built
        wanted : object
            What `wanted` has returned.
        name : str
        own : object
            With the values of the settings as its attributes.
        progress : callable
        """
        raise NotImplementedError

    def named(self, told) -> Told:
        """Return what a tool tells with its only result by the name of its attribute."""
        [row] = rows_of(self.operator)
        return told._replace(values={row.attribute: told.values})


class PrincipalCurvatures(ResultVerb):
    """The verb `principal-curvatures`."""

    name, operator = "principal-curvatures", "principal_curvatures"
    help = "compute principal curvatures and directions, shape index and curvedness"

    def compute(self, built, wanted, name, own, progress):
        found = core.measure.principal_curvatures(built.laplacian)
        values = {row.attribute: row.of(found) for row in rows_of(self.operator)}
        return Told(values, found.notices, f"{name}: {results.curvature_line(found)}")


class SurfaceVariation(ResultVerb):
    """The verb `surface-variation`."""

    name, operator = "surface-variation", "surface_variation"
    help = "measure how far the neighborhood of each point is from a plane: edges, corners and noise are large"

    def compute(self, built, wanted, name, own, progress):
        found = core.measure.surface_variation(built.laplacian)
        return self.named(Told(found, [], f"{name}: {results.variation_line(found)}"))


class Roughness(ResultVerb):
    """The verb `roughness`."""

    name = operator = "roughness"
    help = "measure the signed height of points above the smoothed surface"
    settings = tuple(results.ROUGHNESS.values())

    def compute(self, built, wanted, name, own, progress):
        results.check_wavelength(own.wavelength, built.laplacian.points, name)
        found = core.clean.roughness(built.laplacian, own.wavelength or None, progress=progress)
        return self.named(Told(found, [], f"{name}: {results.roughness_line(found, number_text)}"))


class Segment(ResultVerb):
    """The verb `segment`."""

    name = operator = "segment"
    help = "divide the points into parts, such as the limbs of a figure, or where a vibration mode has one sign"
    settings = tuple(segmenting.SEGMENT.values())

    def compute(self, built, wanted, name, own, progress):
        found = segmenting.segmented(built.laplacian, own.method, own.parts, own.mode, uncached, progress)
        return self.named(Told(found, [], segmenting.parts_line(found, name)))


class Signature(ResultVerb):
    """The verb `signature`."""

    name = operator = "signature"
    help = "compute heat or wave kernel signatures, which are unchanged by bending"
    settings = tuple(segmenting.SIGNATURE.values())

    def compute(self, built, wanted, name, own, progress):
        found = segmenting.signatures(built.laplacian, own.kind, own.count, own.modes, uncached, progress)
        values = dict(zip(segmenting.signature_names(own.kind, own.count), found.T, strict=True))
        return Told(values, [], segmenting.signature_line(own.count, name))


class HarmonicField(ResultVerb):
    """The verb `harmonic-field`."""

    name, operator = "harmonic-field", "harmonic_field"
    help = "interpolate a harmonic field between given values, or solve Poisson's equation"
    settings = tuple(fields.HARMONIC.values())

    def wanted(self, cloud, own, arguments):
        source = None
        if own.source:
            source = cloud.numbers(own.source, "--source").astype(np.float64)
            fields.check_source(source, own.source, str(cloud.path))
        weights = {}
        for setting in fields.giving(own, cloud.has):
            option = f"--{setting.replace('_', '-')}"
            least = int(own.values == "GROUPS")
            weights[setting] = read_weights(cloud, getattr(own, setting), option, least, outside=np.nan)
        how = "Name columns of the file by --low-group and --high-group, or by --group."
        count = len(cloud.points)
        return fields.given_shares(own, weights, count, "column", str(cloud.path), how, cloud.has), source

    def compute(self, built, wanted, name, own, progress):
        found = fields.solved(built.laplacian, *wanted, own.low, own.high, uncached, progress)
        return self.named(Told(found, [], fields.field_line(found, name)))


class Orient(ResultVerb):
    """The verb `orient`."""

    name, operator = "orient", "orient_normals"
    help = "choose the sign of the normals, for the results and all that is computed from them later"
    settings = tuple(orienting.ORIENT.values())

    def add_options(self, parser):
        orienting.add_viewpoint(parser, "the method VIEWPOINT", clouds.place_or_object)
        super().add_options(parser)

    def check(self, parser, arguments):
        orienting.imply_method(parser, arguments)
        needed = {"VIEWPOINT": ("--viewpoint", arguments.viewpoint), "ATTRIBUTE": ("--source", arguments.source)}
        option, value = needed.get(arguments.method, ("", ""))
        if option and (value is None or len(value) == 0):
            parser.error(f"the method {arguments.method} needs {option}")

    def wanted(self, cloud, own, arguments):
        if own.method == "VIEWPOINT":
            viewpoint = arguments.viewpoint
            return (cloud.owner.place(viewpoint) if isinstance(viewpoint, str) else viewpoint) - cloud.place, []
        if own.method != "ATTRIBUTE":
            return None, []
        vectors = cloud.numbers(own.source, "--source").astype(np.float64)
        orienting.check_vectors(vectors, own.source, str(cloud.path))
        vectors -= cloud.place if own.holds == "POSITIONS" else 0.0
        return orienting.seen_from(vectors, cloud.points, own.holds, own.source, cloud.path.name)

    def compute(self, built, wanted, name, own, progress):
        laplacian, (viewpoint, notices) = built.laplacian, wanted
        progress("Orientation", 0.9)
        sides = orienting.outward(
            laplacian.points,
            laplacian.normals,
            laplacian.areas,
            own.method,
            viewpoint,
            own.flip,
            lambda method, viewpoint, compute: compute(),
        )
        turned = analysis.oriented(built, sides)
        values = {**turned.measures, ORIENTATION: turned.measures[NORMAL]}
        return Told(values, notices, orienting.reversed_line(None, sides, name))
