"""Stray points: single ones off the surface, small floating parts, and floaters among splats."""

from typing import Any

import numpy as np

from . import core
from .quantities import STRAY
from .settings import Choice, Setting
from .tool import Array, Cloud, Length, Outcome, PointTool, Progress, Row

SIZES = (
    Setting(
        "strictness",
        "How near to the surface points may be and still be stray: above 1 more are, below 1 fewer",
        1.0,
        0.01,
        100.0,
        low=0.25,
        high=4.0,
    ),
    Setting(
        "smallest",
        "Points of parts with fewer points than this are stray, too; the largest part never is",
        30,
        0,
        label="Small Parts Below",
        high=1000,
    ),
    Setting(
        "smallest_area",
        "Points of parts with less area than this are stray, too; the largest part never is",
        0.0,
        0.0,
        form="AREA",
        label="Small Areas Below",
    ),
)


class StrayPoints(PointTool):
    """The tool."""

    name, label = "stray_points", "Stray Points"
    help = "Find stray points: single ones off the surface, small floating parts, and floaters among splats"
    settings = (
        Setting(
            "action",
            "What happens to the stray points",
            "SHOW",
            choices=(
                Choice("SHOW", "Show", "Color them, and change nothing else"),
                Choice("DELETE", "Delete", "Delete them"),
            ),
        ),
        *SIZES,
    )
    panel, menu = Row("Clean", 1, 1), Row("Object", 4, 3)
    quick = Row("Object", 1, 1, "Clean", (("action", "DELETE"),))
    keeps_line = deletes = extended = True
    bytes_a_point = 3000

    def inputs(self, cloud: Cloud, own: Any) -> Array:
        return cloud.out

    def compute(self, points: Array, inputs: Any, own: Any, progress: Progress) -> Array:
        found = chosen(core.clean.Strays(points, progress=progress), inputs, own)
        check_some_stay(found)
        return found

    def finish(self, found: Any, points: Array, own: Any, length: Length) -> Outcome:
        count, deleted = np.count_nonzero(found), own.action == "DELETE"
        line = f"{count:,} of {len(found):,} points are stray ({count / len(found):.2%})"
        line += ", deleted" if deleted and count else ""
        return Outcome({STRAY: found}, line, kept=~found if deleted else None)


def chosen(strays: "core.clean.Strays", out: Array, own: Any) -> Array:
    """Return the stray points, (n,) bool, by settings, with floaters among splats, (m,) int."""
    found = strays.chosen(own.strictness, smallest=own.smallest, smallest_area=own.smallest_area)
    found[out] = True
    return found


def check_some_stay(found: Array) -> None:
    """Refuse stray points, (n,) bool, that are all."""
    if found.all():
        raise core.PointCloudError(f"All {len(found):,} points are stray at this strictness. Lower it.")


TOOL = StrayPoints()
