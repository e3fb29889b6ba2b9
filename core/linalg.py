"""What is taken from numpy.linalg, for threads: before numpy 2.1 two calls at one time may spoil each other.

Built without a LAPACK library, as Blender's may be, these numpys keep working memory in one place for all threads: they
then crash, hang, or return wrong numbers (numpy issue 22509, mended by 26750).
"""

from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

_NEEDED = np.lib.NumpyVersion(np.__version__) < "2.1.0"
_LOCK = Lock()


def one_at_a_time(function: Function, needed: bool = _NEEDED) -> Function:
    """Return the same function, which waits, if that is needed, while another thread is in one of these."""

    @wraps(function)
    def waiting(*given: Any, **named: Any) -> Any:
        with _LOCK:
            return function(*given, **named)

    return cast(Function, waiting) if needed else function


cond = one_at_a_time(np.linalg.cond)
det = one_at_a_time(np.linalg.det)
eigh = one_at_a_time(np.linalg.eigh)
eigvalsh = one_at_a_time(np.linalg.eigvalsh)
inv = one_at_a_time(np.linalg.inv)
pinv = one_at_a_time(np.linalg.pinv)
solve = one_at_a_time(np.linalg.solve)
svd = one_at_a_time(np.linalg.svd)
