"""Verbs that move points, and splats with them."""

from dataclasses import replace
from types import SimpleNamespace

from . import clouds, core, minimal, smoothing, uncached
from .cloud_verb import SurfaceVerb, floaters
from .groups import is_chosen, read_weights
from .results import number_text
from .settings import LAPLACIAN, chosen, default_options


class MovingVerb(SurfaceVerb):
    """A verb that moves points by their operator; `moved` of a subclass returns where to, and a line on that."""

    def work(self, path, given, arguments, output, progress):
        cloud = clouds.Cloud(path, given, floaters(arguments))
        own = SimpleNamespace(**chosen(self.settings, arguments))
        wanted = self.wanted(cloud, own)
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        points, line = self.moved(laplacian, wanted, path.stem, own, progress)
        written = [] if output is None else _write(output, cloud, points, laplacian)
        return {"points": len(points), "done": line}, [*laplacian.notices, *written]

    def wanted(self, cloud, own):
        """Return what the motion needs of a cloud beside its points, read before anything is computed."""
        return None

    def moved(self, laplacian, wanted, name, own, progress):
        """Return the points, (n, 3), and a line on them, of a cloud of some name, by the values of the settings."""
        raise NotImplementedError


class Smooth(MovingVerb):
    """The verb `smooth`."""

    name = "smooth"
    help = "smooth the shape of the points: remove noise, soften details, keep a few modes, or strengthen details"
    settings = tuple(smoothing.SMOOTH.values())

    def wanted(self, cloud, own):
        return read_weights(cloud, own.group, "--group") if own.group else None

    def moved(self, laplacian, wanted, name, own, progress):
        points, _ = smoothing.smoothed(laplacian, own, wanted, name, uncached, progress)
        return points, smoothing.smooth_line(laplacian.points, points, name, number_text)


class ModeShape(MovingVerb):
    """The verb `mode-shape`."""

    name = "mode-shape"
    help = "displace the points along their normals by a vibration mode"
    settings = tuple(smoothing.MODE_SHAPE.values())

    def moved(self, laplacian, wanted, name, own, progress):
        points = smoothing.by_mode(laplacian, own.mode, own.amplitude, own.phase, uncached, progress)
        return points, smoothing.mode_line(laplacian.points, points, own.mode, name, number_text)


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
            written = _write(output, cloud, film.points, laplacian, {minimal.HISTORY: film.area_history})
        line = minimal.film_line(film, path.stem, number_text)
        told = [] if laplacian is None else laplacian.notices
        return {"points": len(film.points), "done": line}, [*told, *film.notices, *written]


def _write(output, cloud, points, laplacian, numbers=None) -> list:
    """Write a cloud whose points have moved, with further numbers as of `clouds.write`; return notices.

    Splats are deformed by the gradients that their operator gives.
    """
    given, moved = cloud.given, points - cloud.points
    if cloud.splats is not None:
        after = given.deformed(given.positions + moved, core.deform.deformation_gradients(laplacian, points))
    else:
        after = replace(given, points=given.points + moved)  # so that points that stay keep all of their digits
    return clouds.write(output, after, {}, numbers=numbers)
