"""Verbs that move points, and splats with them."""

from dataclasses import replace

from . import clouds, core, minimal
from .cloud_verb import SurfaceVerb, floaters
from .groups import is_chosen, read_weights
from .results import number_text
from .settings import LAPLACIAN, chosen, default_options


class MinimalSurface(SurfaceVerb):
    """The verb `minimal-surface`."""

    name = "minimal-surface"
    help = "move the points to the surface of least area with their boundary"
    settings = tuple(minimal.MINIMAL.values())

    def work(self, path, given, arguments, output, progress):
        cloud, own = clouds.Cloud(path, given, floaters(arguments)), chosen(self.settings, arguments)
        values, name = chosen(LAPLACIAN.values(), arguments), own["group"]
        fixed, laplacian = self.boundary(cloud, values), None
        if is_chosen(name, minimal.MINIMAL["group"].default, cloud.has(name)):
            fixed = read_weights(cloud, name, "--group") > 0.0
        if fixed is None or cloud.splats is not None:
            laplacian = self.build(cloud, values, progress).laplacian
        if fixed is None:
            fixed = laplacian.boundary
            minimal.check_boundary(fixed, "column", path.stem)
        film = minimal.shrink(cloud.points, fixed, own["tolerance"], own["steps"], default_options(values), progress)
        written = []
        if output is not None:
            written = write_moved(output, cloud, film.points, laplacian, {minimal.HISTORY: film.area_history})
        line = minimal.film_line(film, path.stem, number_text)
        told = [] if laplacian is None else laplacian.notices
        return {"points": len(film.points), "done": line}, [*told, *film.notices, *written]


def write_moved(output, cloud, points, laplacian, numbers=None) -> list:
    """Write a cloud whose points have moved, with further numbers as of `clouds.write`; return notices.

    Splats are deformed by the gradients that their operator gives.
    """
    given, moved = cloud.given, points - cloud.points
    if cloud.splats is not None:
        after = given.deformed(given.positions + moved, core.deform.deformation_gradients(laplacian, points))
    else:
        after = replace(given, points=given.points + moved)  # so that points that stay keep all of their digits
    return clouds.write(output, after, {}, numbers=numbers)
