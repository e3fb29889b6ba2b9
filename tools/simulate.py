"""What moves along the surface frame by frame: heat, waves, patterns and fronts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .groups import source_setting, unreached
from .motions import SPOT, Chosen, frame_rows
from .quantities import MOTION
from .settings import Choice, Setting
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

_FRAMES = 250  # of a new scene in Blender
_DEAD = 0.05  # highest concentration where a reaction has ended


class Simulate(Tool):
    """The tool, of which files hold the last frame."""

    name, label = "simulate", "Simulate Along Surface"
    help = (
        "Simulate heat, waves, patterns or a front along the surface, to be played with the frames of the scene; files"
        " of points hold the last frame"
    )
    settings = (
        Setting(
            "kind",
            "What moves along the surface",
            "HEAT",
            choices=(
                Choice("HEAT", "Heat", "Spreads from the sources and becomes even"),
                Choice(
                    "WAVE",
                    "Wave",
                    "A pulse at the sources, which runs in all directions and is reflected at boundaries",
                ),
                Choice("REACTION", "Reaction", "Two substances that react and spread: patterns of spots or stripes"),
                Choice("FRONT", "Front", "Travels from the sources at one speed, as fire does"),
            ),
            label="Motion",
        ),
        source_setting("Vertex group of the sources"),
        Setting(
            "pattern",
            "What the reaction makes",
            "SPOTS",
            choices=(
                Choice("SPOTS", "Spots", "Spots that divide until they cover the surface"),
                Choice("STRIPES", "Stripes", "Winding stripes"),
            ),
        ),
        Setting(
            "distance",
            "How far heat spreads, or a wave or front travels, within all frames; for patterns, from one spot or stripe"
            " to the next. 0 for a distance that fits the object",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="Automatic",
        ),
        Setting(
            "width",
            "Width of the pulse from which heat or a wave starts, or of the edge of a front; 0 for as narrow as the"
            " points resolve",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="Automatic",
        ),
        Setting(
            "frames",
            f"How many frames, from the first frame of the scene on; 0 for all of the scene, {_FRAMES} where there is"
            " none",
            0,
            0,
            10000,
            high=1000,
            at_zero="Scene",
        ),
    )
    reads = ("sources",)
    panel, menu = Row("Move", 1, 1), Row("Object", 6, 3)
    extended = True

    def inputs(self, cloud: Cloud, own: Any) -> Array:
        return cloud.sources(own.group)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        """Return the last frame, and what was watched of all."""
        seen = Watched(laplacian, chosen(own, inputs, own.frames or _FRAMES), progress)
        row = np.zeros(0)
        for row in seen:  # noqa: B007
            pass
        return row, seen, inputs

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        row, seen, sources = found
        notices = motion_notices(own, seen, reached(laplacian, sources))
        return Outcome({MOTION: row}, motion_line(own, seen, length), notices)


def chosen(own: Any, sources: Array, count: int, step: int = 1) -> Chosen:
    """Return the settings of a motion of some frames from sources, (n,) bool, of which every so many are kept."""
    return Chosen(own.kind, sources, count, step, own.distance, own.width, own.pattern.lower())


class Watched:
    """Frames as they are made, with progress, and what is known of their values when all have passed.

    The distance is how far the motion goes, or the size of a pattern.
    """

    def __init__(self, laplacian: Laplacian, chosen: Chosen, progress: Progress) -> None:
        self._rows, self.distance = frame_rows(laplacian, chosen, progress)
        self._chosen, self._progress = chosen, progress
        self._ranges: list[tuple[float, float]] = []

    def __iter__(self) -> Iterator[Array]:
        for number, row in zip(range(self._chosen.kept), self._rows, strict=False):
            self._progress("Frames", number / self._chosen.kept)
            self._ranges.append((row.min(), row.max()))
            yield row

    @property
    def low(self) -> float:
        """Least value of all frames."""
        return min(low for low, _ in self._ranges)

    @property
    def high(self) -> float:
        """Greatest value of all frames."""
        return max(high for _, high in self._ranges)

    @property
    def last(self) -> float:
        """The largest size on show in the end: of the second half, as heat and waves fade; patterns grow."""
        late = self._ranges[-1:] if self._chosen.kind == "REACTION" else self._ranges[len(self._ranges) // 2 :]
        return float(np.abs(late).max())


def reached(laplacian: Laplacian, sources: Array) -> Array:
    """Return the points, (n,) bool, of components with sources, (n,) bool."""
    component = laplacian.component
    return np.isin(component, component[sources]) & (component >= 0)


def motion_notices(own: Any, motion: Any, reached: Array) -> list[str]:
    """Return notices of points, (n,) bool, that nothing has reached, and of a reaction that has died out."""
    notices = unreached(reached, "Nothing moves there.")
    if own.kind == "REACTION" and motion.last < _DEAD:
        notices.append(
            f"The reaction has died out. Patterns need a Distance of {SPOT:g} smoothing lengths of the points or more,"
            " and sources that are single points or small groups."
        )
    return notices


def motion_line(own: Any, motion: Any, length: Length) -> str:
    """Return how far a motion went, and the range of its values, as a text."""
    done = {
        "HEAT": "heat spreads by",
        "WAVE": "waves run",
        "REACTION": f"{own.pattern.lower()} at a distance of",
        "FRONT": "the front travels",
    }[own.kind]
    return f"{done} {length(motion.distance)}, values {motion.low:.3g} to {motion.high:.3g}"


TOOL = Simulate()
