"""Minimal surfaces with the boundary of a cloud."""

from typing import Any

from . import core
from .groups import FIXED, is_chosen
from .settings import Setting
from .tool import Array, Cloud, Laplacian, Length, MovingTool, Outcome, Progress, Row

HISTORY = "lb_area_history"  # name of the areas after each step


class MinimalSurface(MovingTool):
    """The tool."""

    name, label = "minimal_surface", "Minimal Surface"
    help = "Move the points to the surface of least area with their boundary"
    settings = (
        Setting(
            "group",
            "Vertex group with the points that stay, every boundary at least; where there is none of that name, the"
            " detected boundaries",
            FIXED,
            label="Fixed",
        ),
        Setting(
            "tolerance", "Stops when a step changes the area by a smaller fraction than this", 1e-4, 0.0, high=0.01
        ),
        Setting("steps", "Maximum number of steps", 100, 1, high=500),
    )
    panel, menu = Row("Advanced", 4, 1), Row("Object", 11, 1)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return the points that stay, (n,) bool, or None; options for the steps; and what errors name."""
        fixed = cloud.boundary
        if is_chosen(own.group, FIXED, cloud.has_group(own.group)):
            fixed = cloud.weights("group", own.group) > 0.0
        return fixed, cloud.options, cloud.name, cloud.kind

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> "core.deform.MinimalSurface":
        fixed, options, name, kind = inputs
        fixed = laplacian.boundary if fixed is None else fixed
        if not fixed.any():
            raise core.PointCloudError(
                f'"{name}" has no boundary, so that its surface would shrink to nothing. Assign the points that stay to'
                f' the {kind} "{FIXED}".'
            )
        count = 0

        def stepped(step: int, points: Array, area: float) -> None:
            nonlocal count
            count = step

        film = core.deform.minimal_surface(
            laplacian.points,
            fixed,
            epsilon=own.tolerance,
            max_steps=own.steps,
            options=options,
            callback=stepped,
            progress=lambda stage, fraction: progress("Steps", min(1.0, (count + fraction) / own.steps)),
        )
        if film.reason == "cancelled":  # it must not be kept
            raise core.Cancelled
        return film

    def moved(self, found: Any, laplacian: Laplacian, own: Any) -> Array:
        return found.points

    def shape(self, found: Any) -> Array:
        return found.points

    def told(self, found: Any, own: Any) -> list[str]:
        return found.notices

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        area = found.area_history[-1] if found.steps else found.initial_area
        line = f"area from {length(found.initial_area, 2)} to {length(area, 2)} in {found.steps} steps ({found.reason})"
        points = found.points if found.steps else None
        return Outcome({}, line, found.notices, points, numbers={HISTORY: found.area_history})


TOOL = MinimalSurface()
