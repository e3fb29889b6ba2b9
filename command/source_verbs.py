"""Verbs that lead along the surface from points or a curve."""

from . import quantities, simulation, tools, uncached
from .groups import add_at, check_sources, read_sources
from .motions import Chosen
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
        missed = tools.groups.unreached(simulation.reached(built.laplacian, wanted), "Nothing moves there.")
        notices = [*missed, *simulation.dead(own.kind, seen.last)]
        line = simulation.motion_line(own.kind, own.pattern, seen, name, number_text)
        return Told({quantities.MOTION: row}, notices, line)
