"""Progress of a computation while Blender blocks."""

import bpy

from ...command.stages import ToldStages


class Stages(ToldStages):
    """Times of stages, with progress at the mouse cursor; without a window, a line per stage on standard error."""

    def __init__(self, window_manager, label):
        super().__init__(label)
        self._window_manager = window_manager

    def __enter__(self):
        self._window_manager.progress_begin(0, 100)
        return self

    def __exit__(self, *exception):
        super().__exit__()
        self._window_manager.progress_end()

    def tell(self, stage, fraction):
        if bpy.app.background:
            super().tell(stage, fraction)

    def __call__(self, stage, fraction):
        super().__call__(stage, fraction)
        self._window_manager.progress_update(100 * fraction)
