"""What moves along the surface: heat, waves, patterns and fronts, frame by frame, or as modes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from . import core
from .tool import Array, Laplacian, Length, Progress

SPOT = 10.0  # smoothing lengths in the size of a pattern: finer ones are not resolved, and die out
_WIDTH = 6.0  # smoothing lengths: a pulse that the points resolve
_ACROSS = 12.0  # patterns of automatic size across the root of the area, at most
_SEED = 0.4  # of that size, around the sources: where a reaction starts
_PATTERN_TIME = 5000.0  # units of time in which patterns cover the surface, over all frames
_LONGEST = 5.0  # of these, in one step of a reaction
_EDGE = math.exp(-1.0)  # of a pulse, at its width
_FAR = 6.0  # widths from which a pulse is nothing
_FADED = 0.4  # height of a wave that has left its pulse, over that


class Formula(NamedTuple):
    """A motion as a sum of modes, with the time from 0 at the first frame of the scene to 1 at the last.

    Each start adds to the amplitude of a mode its share times a function of the time since then.
    """

    function: str  # "COSINE" or "EXPONENT", of nodes: ``cos(rate * time)``, or ``exp(rate * time)``
    rates: Array  # (k,)
    modes: Array  # (n, k)
    starts: Array  # (j,), times, ascending
    shares: Array  # (j, k)

    @property
    def is_single(self) -> bool:
        """Whether all starts at the time zero, so that nodes need no more than the function."""
        return len(self.starts) == 1 and self.starts[0] == 0.0

    def amplitudes(self, time: float) -> Array:
        """Return the amplitudes of the modes at a time, (k,)."""
        begun = self.starts <= max(time, 0.0)
        since = max(time, 0.0) - self.starts[begun]
        function = {"COSINE": np.cos, "EXPONENT": np.exp}[self.function]
        return np.sum(self.shares[begun] * function(np.multiply.outer(since, self.rates)), axis=0)

    def at(self, time: float) -> Array:
        """Return the motion at a time, (n,)."""
        return self.modes @ self.amplitudes(time)


class Chosen(NamedTuple):
    """The settings of a motion, with zero for automatic lengths."""

    kind: str  # "HEAT", "WAVE", "REACTION", "FRONT"
    sources: Array  # (n,) bool, where it begins; where it ever does, if something touches the points
    # Frames of the scene, and how many are from one that is kept to the next
    frames: int
    step: int
    distance: float
    width: float
    pattern: str  # "spots" or "stripes"
    # (k,) int each, the points there, for each frame that is kept: also those touched since the one before
    touched: list[Array] | None = None

    @property
    def kept(self) -> int:
        """How many frames are kept."""
        return -(-(self.frames - 1) // self.step) + 1

    @property
    def share(self) -> float:
        """Of the time of all frames, from one that is kept to the next."""
        return self.step / max(self.frames - 1, 1)

    def starts(self, number: int) -> Array:
        """Return the points where something begins at a frame that is kept, (k,) int."""
        if self.touched is not None:
            return self.touched[number] if number < len(self.touched) else np.arange(0)
        return np.flatnonzero(self.sources) if number == 0 else np.arange(0)


class InModes(NamedTuple):
    """A motion as modes."""

    formula: Formula
    # Range of its values; without a touching object that of the first frame
    low: float
    high: float
    last: float  # the largest size on show in the end, about: waves are lower once they have left their pulse
    held: float  # share of the pulses that the modes hold
    distance: float  # how far it went


def find_touched(laplacian: Laplacian, chosen: Chosen, places: list[Array], length: Length) -> Chosen:
    """Return the settings with the points that are touched: the nearest ones of places that are not too far off.

    The places, (k, 3) each, are those of what touches the points, for each frame of the scene.
    """
    points, reach, together = laplacian.points, _width(laplacian, chosen), np.concatenate(places)
    rows = core.geometry.nearest_rows(points, together)
    near = (np.linalg.norm(points[rows] - together, axis=1) <= reach) & (laplacian.component[rows] >= 0)
    if not near.any():
        raise core.PointCloudError(
            f"The Touching Object comes within {length(reach)} of no point in any frame. Move it nearer, or raise"
            " Width."
        )
    of_scene = np.repeat(np.arange(len(places)), [len(one) for one in places])
    frame = -(-of_scene // chosen.step)
    touched = [np.unique(rows[near & (frame == number)]) for number in range(chosen.kept)]
    return chosen._replace(sources=np.isin(np.arange(len(points)), rows[near]), touched=touched)


def frame_rows(laplacian: Laplacian, chosen: Chosen, progress: Progress) -> tuple[Iterator[Array], float]:
    """Simulate frame by frame: return an iterator of the frames that are kept, (n,) each, without end.

    Return also how far the motion goes, or the size of a pattern.
    """
    return {"HEAT": _heat, "WAVE": _wave, "REACTION": _reaction, "FRONT": _front}[chosen.kind](
        laplacian, chosen, progress
    )


def in_modes(laplacian: Laplacian, chosen: Chosen, count: int, progress: Progress) -> InModes:
    """Compute heat or a wave as a number of modes.

    Each touch drives the modes by what it adds to the motion as they hold it, projected onto them: so many numbers for
    each touch, and a formula of the time since then.
    """
    areas, spectrum = laplacian.areas, laplacian.eigenpairs(count, progress=progress)
    distance, modes = _reach(laplacian, chosen), spectrum.eigenvectors
    if chosen.kind == "WAVE":
        function, rates = "COSINE", distance * np.sqrt(spectrum.eigenvalues)
    else:
        function, rates = "EXPONENT", -0.25 * distance * distance * spectrum.eigenvalues
    formula = Formula(function, rates, modes, np.zeros(0), np.zeros((0, len(rates))))
    ranges, held, whole = [], 0.0, 0.0
    for number in range(chosen.kept if chosen.touched is not None else 1):
        progress("Frames", number / chosen.kept)
        time = number * chosen.share
        now, pulse = formula.at(time), _pulse(laplacian, chosen, chosen.starts(number), progress)
        if pulse is not None:
            added = (areas * (_pushed(now, pulse) - now)) @ modes
            starts, shares = np.append(formula.starts, time), np.concatenate([formula.shares, [added]])
            formula = formula._replace(starts=starts, shares=shares)
            now = now + modes @ added
            held += float(np.sum(((areas * pulse) @ modes) ** 2))
            whole += float(np.sum(areas * pulse**2))
        ranges.append((now.min(), now.max()))
    low, high = np.min(ranges, axis=0)[0], np.max(ranges, axis=0)[1]
    if chosen.touched is not None:
        last = np.abs(ranges[len(ranges) // 2 :]).max()
    else:
        last = _FADED * high if chosen.kind == "WAVE" else formula.at(0.5).max()
    return InModes(formula, low, high, last, held / whole, distance)


def _reach(laplacian: Laplacian, chosen: Chosen) -> float:
    """Return how far heat spreads, or waves and fronts run, within all frames."""
    return chosen.distance or {"HEAT": 0.5, "WAVE": 1.0, "FRONT": 1.0}[chosen.kind] * _size(laplacian)


def _size(laplacian: Laplacian) -> float:
    known = laplacian.component >= 0
    return float(np.linalg.norm(np.ptp(laplacian.points[known], axis=0)))


def _width(laplacian: Laplacian, chosen: Chosen) -> float:
    return chosen.width or _WIDTH * float(np.median(laplacian.smoothing_lengths))


def _pulse(laplacian: Laplacian, chosen: Chosen, rows: Array, progress: Progress) -> Array | None:
    """Return 1 at points, and less around them: one point alone would be less than the points resolve. None for none.

    A point that is left out of the operator starts nothing.
    """
    rows = rows[laplacian.component[rows] >= 0] if chosen.touched is not None else rows
    if not len(rows):
        return None
    width = _width(laplacian, chosen)
    away = core.distance.geodesic_distance(laplacian, rows, limit=_FAR * width, progress=progress)
    return np.exp(-((away / width) ** 2))


def _pushed(values: Array, pulse: Array) -> Array:
    """Return values that are raised to a pulse where they are less; those below zero only as far as it reaches."""
    return np.maximum(values, pulse + (1.0 - pulse) * np.minimum(values, 0.0))


def _heat(laplacian: Laplacian, chosen: Chosen, progress: Progress) -> tuple[Iterator[Array], float]:
    distance = _reach(laplacian, chosen)
    heat = core.motion.Heat(laplacian, 0.25 * distance * distance * chosen.share, progress=progress)

    def begin(state: Any, number: int) -> Any:
        pulse = _pulse(laplacian, chosen, chosen.starts(number), progress)
        return state if pulse is None else _pushed(state, pulse)

    return _advance(heat, np.zeros(len(laplacian.points)), begin, lambda state: state), distance


def _wave(laplacian: Laplacian, chosen: Chosen, progress: Progress) -> tuple[Iterator[Array], float]:
    distance = _reach(laplacian, chosen)
    wave = core.motion.Wave(laplacian, chosen.share, distance, progress=progress)

    def begin(state: Any, number: int) -> Any:
        pulse = _pulse(laplacian, chosen, chosen.starts(number), progress)
        return state if pulse is None else (_pushed(state[0], pulse), state[1])

    nothing = np.zeros(len(laplacian.points))
    return _advance(wave, (nothing, nothing), begin, lambda state: state[0]), distance


def _reaction(laplacian: Laplacian, chosen: Chosen, progress: Progress) -> tuple[Iterator[Array], float]:
    known = laplacian.component >= 0
    resolved = SPOT * float(np.median(laplacian.smoothing_lengths[known]))
    automatic = max(resolved, math.sqrt(float(laplacian.areas[known].sum())) / _ACROSS)
    size, time = chosen.distance or automatic, _PATTERN_TIME * chosen.share
    steps = math.ceil(time / _LONGEST)
    kind = core.motion.ReactionDiffusion
    reaction = kind.of_pattern(laplacian, time / steps, chosen.pattern, size, progress=progress)
    chosen = chosen._replace(width=_SEED * size)  # a single point would fade before it reacts

    def begin(state: Any, number: int) -> Any:
        pulse = _pulse(laplacian, chosen, chosen.starts(number), progress)
        if pulse is None:
            return state
        inside = pulse > _EDGE
        return np.where(inside, 0.0, state[0]), np.where(inside, 1.0, state[1])

    start = np.ones(len(laplacian.points)), np.zeros(len(laplacian.points))
    return _advance(reaction, start, begin, lambda state: state[1], steps), size


def _advance(
    motion: Any, state: Any, begin: Callable[[Any, int], Any], part: Callable[[Any], Array], steps: int = 1
) -> Iterator[Array]:
    """Yield a part of the state at each frame, after what begins there."""
    number = 0
    while True:
        state = begin(state, number)
        yield part(state)
        for _ in range(steps):
            state = motion.advance(state)
        number += 1


def _front(laplacian: Laplacian, chosen: Chosen, progress: Progress) -> tuple[Iterator[Array], float]:
    """Frames are 1 behind the front and 0 before it.

    A front arrives where the time of a touch and that of the way from there, together, are the least of all touches.
    """
    width = _width(laplacian, chosen)
    arrival = np.full(len(laplacian.points), np.inf)  # how far the front has travelled by then
    if chosen.touched is None:
        arrival = core.distance.geodesic_distance(laplacian, chosen.sources, progress=progress)
        far = chosen.distance or float(arrival[np.isfinite(arrival)].max())
    else:
        far = _reach(laplacian, chosen)

    def frames() -> Iterator[Array]:
        number, last = 0, far * chosen.share * (chosen.kept - 1)
        while True:
            travelled = far * chosen.share * number
            rows = np.arange(0) if chosen.touched is None else chosen.starts(number)
            rows = rows[arrival[rows] > travelled]  # others are behind the front, which adds nothing
            if len(rows):
                left = max(last - travelled, 0.0) + width
                away = core.distance.geodesic_distance(laplacian, rows, limit=left, progress=progress)
                np.minimum(arrival, travelled + away, out=arrival)
            yield np.clip(1.0 + (travelled - arrival) / width, 0.0, 1.0)
            number += 1

    return frames(), far
