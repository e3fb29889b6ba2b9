"""Times of the stages of a computation, and its progress."""

import sys
from time import perf_counter

import bpy


class StageTimes:
    """Progress callback for core that keeps the seconds of each stage.

    Parameters
    ----------
    progress : callable, optional
        Another one, which is called too.

    Attributes
    ----------
    seconds : dict of str to float
        Seconds by stage, complete after the ``with`` block.
    stage : str
        The last one that was started.
    fraction : float
        Its progress, or that of the whole.
    """

    def __init__(self, progress=None):
        self.seconds = {}
        self.stage, self.fraction = "", 0.0
        self._began = None
        self._progress = progress or (lambda stage, fraction: None)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self._close()

    def __call__(self, stage, fraction):
        self._close()
        self._progress(stage, fraction)
        self.stage, self.fraction = stage, fraction
        self._began = perf_counter()

    def _close(self):
        if self._began is not None:
            spent = perf_counter() - self._began
            self.seconds[self.stage] = self.seconds.get(self.stage, 0.0) + spent
            self._began = None


class Stages(StageTimes):
    """The same while Blender blocks: progress at the mouse cursor; without a window, a line per stage.

    Lines go to standard error, so that standard output holds results only.

    Parameters
    ----------
    window_manager : bpy.types.WindowManager
    label : str
        What is computed.
    """

    def __init__(self, window_manager, label):
        super().__init__()
        self._window_manager, self._label = window_manager, label

    def __enter__(self):
        self._window_manager.progress_begin(0, 100)
        return self

    def __exit__(self, *exception):
        super().__exit__()
        self._window_manager.progress_end()

    def __call__(self, stage, fraction):
        if bpy.app.background and stage != self.stage:
            print(f"{self._label}: {stage}, {fraction:.0%}", file=sys.stderr, flush=True)
        super().__call__(stage, fraction)
        self._window_manager.progress_update(100 * fraction)
