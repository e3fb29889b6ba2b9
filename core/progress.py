"""Progress that callers are told of."""

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from .errors import Cancelled
from .types import Progress

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


class _Told:
    """A caller's progress, as plain floats, and its last stage; calls that it is passed on to do not end it."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self.stage, self.cancelled = progress, "Done", False

    def __call__(self, stage: str, fraction: float) -> None:
        self.stage = stage
        try:
            self._progress(stage, float(fraction))
        except Cancelled:
            self.cancelled = True
            raise


def ends_at_one(call: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """Let a function with the keyword `progress` tell its caller that all is done: 1.0 at last, in its last stage."""

    @wraps(call)
    def ended(*given: _Given.args, **named: _Given.kwargs) -> _Result:
        progress: Any = named.get("progress")
        if progress is None or isinstance(progress, _Told):
            return call(*given, **named)
        named["progress"] = told = _Told(progress)
        result = call(*given, **named)
        if not told.cancelled:  # or the result is what was reached until then
            told(told.stage, 1.0)
        return result

    return ended
