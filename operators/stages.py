"""How long each stage of a computation takes, how far it is, and whether to go on."""

from concurrent.futures import ThreadPoolExecutor
from threading import Event
from time import perf_counter

from ..core import Cancelled


class StageTimes:
    """Progress callback for core that keeps the seconds of each stage.

    Attributes
    ----------
    seconds : dict of str to float
        Seconds by stage, complete after the ``with`` block.
    stage : str
        The one that goes on.
    fraction : float
        How much of it, or of all, is done.
    """

    def __init__(self):
        self.seconds = {}
        self.stage, self.fraction = "", 0.0
        self._began = 0.0

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self._close()

    def __call__(self, stage, fraction):
        self._close()
        self.stage, self.fraction = stage, fraction
        self._began = perf_counter()

    def _close(self):
        if self.stage:
            spent = perf_counter() - self._began
            self.seconds[self.stage] = self.seconds.get(self.stage, 0.0) + spent
            self.stage = ""


class Stages(StageTimes):
    """The same while Blender waits: the number at the mouse cursor shows how far it is."""

    def __init__(self, window_manager):
        super().__init__()
        self._window_manager = window_manager

    def __enter__(self):
        self._window_manager.progress_begin(0, 100)
        return self

    def __exit__(self, *exception):
        super().__exit__()
        self._window_manager.progress_end()

    def __call__(self, stage, fraction):
        super().__call__(stage, fraction)
        self._window_manager.progress_update(100 * fraction)


class Work(StageTimes):
    """A computation in a thread of its own, so that the window stays alive and Esc can stop it.

    Parameters
    ----------
    compute : callable
        Called with this as its progress callback; must not touch Blender.
    """

    def __init__(self, compute):
        super().__init__()
        self._stop = Event()
        pool = ThreadPoolExecutor(max_workers=1)
        self._future = pool.submit(self._run, compute)
        pool.shutdown(wait=False)

    def __call__(self, stage, fraction):
        if self._stop.is_set():
            raise Cancelled
        super().__call__(stage, fraction)

    def _run(self, compute):
        with self:
            return compute(self)

    def cancel(self):
        """Ask it to stop; it does at its next report of progress."""
        self._stop.set()

    @property
    def stopping(self):
        """Whether it was asked to stop."""
        return self._stop.is_set()

    @property
    def ended(self):
        """Whether there is a result, or an error."""
        return self._future.done()

    def result(self):
        """Return what was computed, or raise what went wrong, `Cancelled` among it."""
        return self._future.result()
