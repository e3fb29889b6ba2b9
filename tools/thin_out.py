"""Fewer points of the same surface, with all that they hold."""

from typing import Any

import numpy as np

from . import core
from .settings import Choice, Setting
from .tool import Array, Length, Outcome, PointTool, Progress, Row

_SPACINGS = 2.0  # of the points, between those that stay, where none is given
SHARE = 4  # one in so many stays where no number is given


class ThinOut(PointTool):
    """The tool."""

    name, label = "thin_out", "Thin Out"
    help = "Delete points so that the others are evenly spread, to a spacing or a number; edges and results stay"
    settings = (
        Setting(
            "by",
            "What says how many points stay",
            "SPACING",
            choices=(
                Choice("SPACING", "Spacing", "No two points are nearer to each other than the spacing"),
                Choice("NUMBER", "Number", "At most a number of points stays"),
            ),
        ),
        Setting(
            "spacing",
            "Least distance between points, for Spacing; 0 for twice the present one",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="Automatic",
        ),
        Setting(
            "count",
            "How many points stay at most, for Number; 0 for a quarter of them",
            0,
            0,
            label="Number",
            high=1_000_000,
            at_zero="A Quarter",
        ),
        Setting("keep_edges", "Keep points at edges before others, the sharpest first", True),
    )
    panel, menu = Row("Clean", 1, 2), Row("Object", 4, 4)
    keeps_line = deletes = extended = True

    def adjustable(self, own: Any) -> tuple[str, ...]:
        return self.asks(own)

    def compute(self, points: Array, inputs: Any, own: Any, progress: Progress) -> Any:
        """Return which points stay, (n,) bool, and the least distance between them, or None if that is not known."""
        least = (own.spacing or _SPACINGS * core.geometry.typical_distance(points)) or None
        count = own.count or -(-len(points) // SHARE)
        size = {"count": count} if own.by == "NUMBER" or least is None else {"spacing": least}
        kept = np.zeros(len(points), dtype=bool)
        kept[core.clean.thin_out(points, keep_edges=own.keep_edges, progress=progress, **size)] = True
        return kept, size.get("spacing")

    def finish(self, found: Any, points: Array, own: Any, length: Length) -> Outcome:
        kept, spacing = found
        apart = "" if spacing is None else f", at least {length(spacing)} from each other"
        line = f"{np.count_nonzero(kept):,} of {len(kept):,} points are left{apart}"
        return Outcome({}, line, kept=kept)


TOOL = ThinOut()
