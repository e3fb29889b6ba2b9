"""Minimal surfaces with the boundary of a cloud, for the command line and for Blender's tool."""

from . import core
from .groups import FIXED
from .settings import Setting

HISTORY = "lb_area_history"  # name of the areas after each step

MINIMAL = {
    setting.name: setting
    for setting in (
        Setting(
            "group",
            "Vertex group with the points that stay, every boundary at least; where there is none of that name, the"
            " detected boundaries",
            FIXED,
        ),
        Setting("tolerance", "Stops when a step changes the area by a smaller fraction than this", 1e-4, 0.0),
        Setting("steps", "Maximum number of steps", 100, 1),
    )
}


def check_boundary(boundary, kind, name):
    """Refuse a cloud without boundary points, (n,) bool, by the word for its groups, and its name."""
    if not boundary.any():
        raise core.PointCloudError(
            f'"{name}" has no boundary, so that its surface would shrink to nothing. Assign the points that stay to the'
            f' {kind} "{FIXED}".'
        )


def shrink(points, boundary, tolerance, steps, options, progress):
    """Compute the minimal surface of a boundary, with the fraction of the steps as progress."""
    count = 0

    def stepped(step, points, area):
        nonlocal count
        count = step

    def report(stage, fraction):
        progress("Steps", min(1.0, (count + fraction) / steps))

    film = core.deform.minimal_surface(
        points,
        boundary,
        epsilon=tolerance,
        max_steps=steps,
        options=options,
        callback=stepped,
        progress=report,
    )
    if film.reason == "cancelled":  # it must not be cached
        raise core.Cancelled
    return film


def film_line(film, name, area_text) -> str:
    """Return how the area has changed as a text."""
    area = film.area_history[-1] if film.steps else film.initial_area
    return f"{name}: area from {area_text(film.initial_area)} to {area_text(float(area))} in {film.steps} steps" + (
        f" ({film.reason})"
    )
