"""Times of the stages of a computation, and its progress."""

from __future__ import annotations

import math
import os
import sys
from time import perf_counter
from typing import IO, TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Callable


class StageTimes:
    """Progress callback for core that keeps the seconds of each stage, complete after the ``with`` block.

    Another one may be called, too. The stage is the last one that was started, the fraction its progress, or that of
    the whole.
    """

    def __init__(self, progress: Callable[[str, float], None] | None = None) -> None:
        self.seconds: dict[str, float] = {}
        self.stage, self.fraction = "", 0.0
        self._began: float | None = None
        self._progress = progress or (lambda stage, fraction: None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._close()

    def __call__(self, stage: str, fraction: float) -> None:
        self._close()
        self._progress(stage, fraction)
        self.stage, self.fraction = stage, fraction
        self._began = perf_counter()

    def _close(self) -> None:
        if self._began is not None:
            spent = perf_counter() - self._began
            self.seconds[self.stage] = self.seconds.get(self.stage, 0.0) + spent
            self._began = None

    @property
    def rounded(self) -> dict[str, float]:
        """Seconds by stage, in milliseconds' steps."""
        return {name: round(spent, 3) for name, spent in self.seconds.items()}


class ToldStages(StageTimes):
    """The same, with a line for each stage on standard error, so that standard output holds results only.

    The label says what is computed; after a share of the work a stage gets a further line.
    """

    def __init__(self, label: str, each: float = math.inf) -> None:
        super().__init__()
        self._label, self._each, self._told = label, each, 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        if stage != self.stage or fraction >= self._told + self._each:
            self.tell(stage, fraction)
            self._told = fraction
        super().__call__(stage, fraction)

    def tell(self, stage: str, fraction: float) -> None:
        """Write the line of a stage that begins."""
        tell_aside(f"{self._label}: {stage}, {fraction:.0%}")


def tell_aside(text: str) -> None:
    """Write a line on standard error, or nothing from then on where nobody reads that any more."""
    try:
        print(text, file=sys.stderr, flush=True)
    except BrokenPipeError:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115


def silence(stream: IO[str]) -> None:
    """Lead nowhere what is still to be written to a stream, which would fail once more at the end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
