"""How long each stage of a computation takes."""

from time import perf_counter


class Stages:
    """Progress callback for core: keeps the seconds of each stage and moves the progress number at the mouse cursor.

    Attributes
    ----------
    seconds : dict of str to float
        Seconds by stage, complete after the ``with`` block.
    """

    def __init__(self, window_manager):
        self.seconds = {}
        self._window_manager = window_manager
        self._current = None
        self._began = 0.0

    def __enter__(self):
        self._window_manager.progress_begin(0, 100)
        return self

    def __exit__(self, *exception):
        self._close()
        self._window_manager.progress_end()

    def __call__(self, stage, fraction):
        self._close()
        self._current = stage
        self._began = perf_counter()
        self._window_manager.progress_update(100 * fraction)

    def _close(self):
        if self._current is not None:
            spent = perf_counter() - self._began
            self.seconds[self._current] = self.seconds.get(self._current, 0.0) + spent
            self._current = None
