"""What was computed of an operator, kept for whoever needs it next."""

import hashlib
from collections.abc import Callable, Hashable
from threading import Lock, RLock
from typing import Any, TypeVar

import numpy as np

_Value = TypeVar("_Value")


class Kept:
    """Results by name, each computed when it is first asked for: of those that depend on settings, the last one.

    Threads that need a result that another one computes wait for it. Of a computation that ends with an error, such as
    `Cancelled`, nothing is kept.
    """

    def __init__(self) -> None:
        self._guard = Lock()
        self._found: dict[str, tuple[tuple[Hashable, ...], Any]] = {}
        self._locks: dict[str, Any] = {}  # those of `RLock`

    def result(self, name: str, compute: Callable[[], _Value], *settings: Any) -> _Value:
        """Return the result of a name for settings: hashable ones, arrays, which count by their content, and tuples."""
        key = tuple(map(_content, settings))
        return self.serving(name, compute, lambda kept, _: kept == key, key)

    def serving(
        self,
        name: str,
        compute: Callable[[], _Value],
        serves: Callable[[Any, _Value], bool],
        key: tuple[Hashable, ...] = (),
    ) -> _Value:
        """Return the result of a name if it serves, by its key and itself; or another in its place."""
        with self._guard:
            lock = self._locks.setdefault(name, RLock())
        with lock:
            found = self._found.get(name)
            if found is not None and serves(*found):
                kept: _Value = found[1]
                return kept
            value = compute()
            self._found[name] = key, value
            return value

    def known(self, name: str) -> Any:
        """Return the result of a name that is kept, whatever its settings; None if there is none."""
        return self._found.get(name, ((), None))[1]

    def clear(self) -> None:
        """Drop all results."""
        self._found.clear()


def _content(setting: Any) -> Hashable:
    """Return what stands for a setting: of an array its shape, type, and a digest of its bytes."""
    if isinstance(setting, tuple):
        return tuple(map(_content, setting))
    if not isinstance(setting, np.ndarray):
        return setting
    return setting.shape, setting.dtype.str, hashlib.blake2b(np.ascontiguousarray(setting)).digest()
