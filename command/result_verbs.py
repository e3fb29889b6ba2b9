"""Verbs that add results to the points."""

from . import clouds, core, results
from .cloud_verb import SurfaceVerb, floaters
from .quantities import rows_of
from .settings import LAPLACIAN, chosen


class ResultVerb(SurfaceVerb):
    """A verb that adds the results of a tool; `compute` of a subclass returns them, with a line on them."""

    operator = ""  # of Blender, which writes the same results

    def work(self, path, given, arguments, output, progress):
        cloud = clouds.Cloud(path, given, floaters(arguments))
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        found, line = self.compute(laplacian, path.stem, chosen(self.settings, arguments), progress)
        written = []
        if output is not None:
            rows = rows_of(self.operator)
            named = {row.attribute: row.of(found) if row.source else found for row in rows}
            written = clouds.write(output, given, named)
        return {"points": len(cloud.points), "done": f"{path.stem}: {line}"}, [*laplacian.notices, *written]

    def compute(self, laplacian, name, own, progress):
        """Return the result of the tool on a cloud of some name by the values of its settings, and a line on it."""
        raise NotImplementedError


class PrincipalCurvatures(ResultVerb):
    """The verb `principal-curvatures`."""

    name, operator = "principal-curvatures", "principal_curvatures"
    help = "compute principal curvatures and directions, shape index and curvedness"

    def compute(self, laplacian, name, own, progress):
        found = core.principal_curvatures(laplacian)
        return found, results.curvature_line(found)


class SurfaceVariation(ResultVerb):
    """The verb `surface-variation`."""

    name, operator = "surface-variation", "surface_variation"
    help = "measure how far the neighborhood of each point is from a plane: edges, corners and noise are large"

    def compute(self, laplacian, name, own, progress):
        found = core.surface_variation(laplacian)
        return found, results.variation_line(found)


class Roughness(ResultVerb):
    """The verb `roughness`."""

    name = operator = "roughness"
    help = "measure the signed height of points above the smoothed surface"
    settings = tuple(results.ROUGHNESS.values())

    def compute(self, laplacian, name, own, progress):
        results.check_wavelength(own["wavelength"], laplacian.points, name)
        found = core.roughness(laplacian, own["wavelength"] or None, progress=progress)
        return found, results.roughness_line(found, "{:.4g}".format)
