"""Verbs that add results to the points."""

from types import SimpleNamespace

import numpy as np

from . import analysis, clouds, orienting, quantities
from .cloud_verb import SurfaceVerb, floaters
from .results import Told
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
        [row] = quantities.rows_of(self.operator)
        return told._replace(values={row.attribute: told.values})


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
        values = {**turned.measures, quantities.ORIENTATION: turned.measures[quantities.NORMAL]}
        return Told(values, notices, orienting.reversed_line(None, sides, name))
