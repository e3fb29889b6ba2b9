"""What moves along the surface frame by frame, as it is watched and told of: for files and for Blender's tool."""

import numpy as np

from .groups import SOURCE
from .motions import SPOT, frame_rows
from .settings import Setting

_DEAD = 0.05  # highest concentration where a reaction has ended

SIMULATE = {
    setting.name: setting
    for setting in (
        Setting(
            "kind",
            "What moves along the surface",
            "HEAT",
            choices=("HEAT", "WAVE", "REACTION", "FRONT"),
        ),
        Setting(
            "group",
            "Vertex group of the sources; where there is none of that name, the points selected in Edit Mode",
            SOURCE,
        ),
        Setting("pattern", "What the reaction makes", "SPOTS", choices=("SPOTS", "STRIPES")),
        Setting(
            "distance",
            "How far heat spreads, or a wave or front travels, within all frames; for patterns, from one spot or stripe"
            " to the next. 0 for a distance that fits the object",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting(
            "width",
            "Width of the pulse from which heat or a wave starts, or of the edge of a front; 0 for as narrow as the"
            " points resolve",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting("frames", "How many frames, from the first frame of the scene on; 0 for all of the scene", 0, 0, 10000),
    )
}


class Watched:
    """Frames as they are made, with progress, and what is known of their values when all have passed.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    chosen : Chosen
    cache : object
    progress : callable

    Attributes
    ----------
    distance : float
        How far the motion goes, or the size of a pattern.
    """

    def __init__(self, laplacian, chosen, cache, progress):
        self._rows, self.distance = frame_rows(laplacian, chosen, cache, progress)
        self._chosen, self._progress = chosen, progress
        self._ranges = []

    def __iter__(self):
        for number, row in zip(range(self._chosen.kept), self._rows, strict=False):
            self._progress("Frames", number / self._chosen.kept)
            self._ranges.append((row.min(), row.max()))
            yield row

    @property
    def low(self) -> float:
        """Least value of all frames."""
        return np.min(self._ranges, axis=0)[0]

    @property
    def high(self) -> float:
        """Greatest value of all frames."""
        return np.max(self._ranges, axis=0)[1]

    @property
    def last(self) -> float:
        """The largest size on show in the end."""
        late = np.abs(self._ranges[len(self._ranges) // 2 :]).max()
        return {"WAVE": late, "REACTION": self._ranges[-1][1]}.get(self._chosen.kind, self.high)


def reached(laplacian, sources):
    """Return the points, (n,) bool, of components with sources, (n,) bool."""
    component = laplacian.component
    return np.isin(component, component[sources]) & (component >= 0)


def dead(kind, last) -> list:
    """Return a notice of a reaction that has died out, by the largest size of the motion in the end."""
    if kind != "REACTION" or last >= _DEAD:
        return []
    return [
        f"The reaction has died out. Patterns need a Distance of {SPOT:g} smoothing lengths of the points or more, and"
        " sources that are single points or small groups."
    ]


def motion_line(kind, pattern, motion, name, length_text) -> str:
    """Return how far a motion went, and the range of its values, as a text."""
    done = {
        "HEAT": "heat spreads by",
        "WAVE": "waves run",
        "REACTION": f"{pattern.lower()} at a distance of",
        "FRONT": "the front travels",
    }[kind]
    return f"{name}: {done} {length_text(motion.distance)}, values {motion.low:.3g} to {motion.high:.3g}"
