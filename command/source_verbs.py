"""Verbs that lead along the surface from points or a curve."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from . import along, clouds, core, simulation, uncached
from .groups import add_at, check_sources, read_sources, unreached
from .motions import Chosen
from .quantities import MOTION
from .result_verbs import ResultVerb
from .results import Told, number_text

_FRAMES = 250  # of a new scene in Blender


class SourceVerb(ResultVerb):
    """A verb with source points, which `wanted` returns."""

    def add_options(self, parser):
        add_at(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        check_sources(parser, arguments)

    def wanted(self, cloud, own, arguments):
        return read_sources(cloud, arguments)


class GeodesicDistance(SourceVerb):
    """The verb `geodesic-distance`."""

    name, operator = "geodesic-distance", "geodesic_distance"
    help = "geodesic distance from given points"
    settings = tuple(along.GEODESIC.values())

    def wanted(self, cloud, own, arguments):
        sources = super().wanted(cloud, own, arguments)
        along.check_distances(sources, cloud.path.stem)
        return sources

    def compute(self, built, wanted, name, own, progress):
        found = along.distance(built.laplacian, wanted, uncached, progress)
        return self.named(along.told_distance(found, name, number_text))


class NearestSource(SourceVerb):
    """The verb `nearest-source`."""

    name, operator = "nearest-source", "nearest_source"
    help = "divide the surface into geodesic Voronoi cells of the sources"
    settings = tuple(along.NEAREST.values())

    def compute(self, built, wanted, name, own, progress):
        return self.named(along.told_cells(along.cells(built.laplacian, wanted, uncached, progress), name))


class Unwrap(SourceVerb):
    """The verb `unwrap`."""

    name = operator = "unwrap"
    help = "map the surface around a point to texture coordinates, like a decal"
    settings = tuple(along.UNWRAP.values())

    def compute(self, built, wanted, name, own, progress):
        center = along.center_of(built.laplacian.points, wanted)
        found, border = along.texture(built.laplacian, center, own.radius, own.angle, name, uncached, progress)
        return self.named(Told(found, [], along.texture_line(border, name, number_text)))


class ExtendDirection(SourceVerb):
    """The verb `extend-direction`."""

    name, operator = "extend-direction", "extend_direction"
    help = "extend directions at some points to the whole surface by parallel transport"
    settings = tuple(along.EXTEND.values())

    def compute(self, built, wanted, name, own, progress):
        direction = np.array(own.direction, dtype=np.float64)
        found = along.directions(built.laplacian, wanted, direction, uncached, progress)
        return self.named(along.told_directions(along.unit_directions(found), name))


class SignedDistance(ResultVerb):
    """The verb `signed-distance`, with a curve of a file."""

    name, operator = "signed-distance", "signed_distance"
    help = "geodesic distance from a curve, positive on its left"
    reads = ("curve",)

    def add_options(self, parser):
        add_curve(parser)
        super().add_options(parser)

    def wanted(self, cloud, own, arguments):
        curve, closed = Path(arguments.curve), arguments.closed
        if clouds.kinds() and curve.suffix.lower() not in core.files.READABLE:
            places, closed = cloud.owner.curve(arguments.curve)
        else:
            places = core.files.read_points(curve).points
        return SimpleNamespace(places=places - cloud.place, closed=closed)

    def compute(self, built, wanted, name, own, progress):
        found = along.beside_curve(built.laplacian, wanted.places, wanted.closed, uncached, progress)
        return self.named(along.told_sides(found, name, number_text))


def add_curve(parser):
    """Add the options for a curve."""
    more = "; or the name of a curve object of the input" if clouds.kinds() else ""
    parser.add_argument(
        "--curve",
        required=True,
        metavar="FILE",
        help=f"points of a curve on the surface in their order: {', '.join(core.files.READABLE)}{more}",
    )
    parser.add_argument("--closed", action="store_true", help="join the last point of the file with the first")


class Simulate(SourceVerb):
    """The verb `simulate`, whose output holds the last frame."""

    name = operator = "simulate"
    help = "simulate heat, waves, patterns or a front along the surface; the last frame is written"
    settings = tuple(
        setting._replace(description=f"How many frames; 0 for {_FRAMES}, as of a new scene in Blender")
        if setting.name == "frames"
        else setting
        for setting in simulation.SIMULATE.values()
    )

    def compute(self, built, wanted, name, own, progress):
        chosen = Chosen(own.kind, wanted, own.frames or _FRAMES, 1, own.distance, own.width, own.pattern.lower())
        seen = simulation.Watched(built.laplacian, chosen, uncached, progress)
        for row in seen:  # noqa: B007
            pass
        missed = unreached(simulation.reached(built.laplacian, wanted), name, "Nothing moves there.")
        notices = [*missed, *simulation.dead(own.kind, seen.last)]
        line = simulation.motion_line(own.kind, own.pattern, seen, name, number_text)
        return Told({MOTION: row}, notices, line)
