"""Verbs that add results to the points."""

from types import SimpleNamespace

from . import clouds, quantities
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
