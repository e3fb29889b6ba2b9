"""Names for the types that the annotations of core use."""

import os
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.integer[Any]]
Bools: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[Any]
FilePath: TypeAlias = str | os.PathLike[str]
Progress: TypeAlias = Callable[[str, float], None]  # stage and fraction of it
Report: TypeAlias = Callable[[], None]  # called between steps; may raise Cancelled
Response: TypeAlias = Callable[[Floats], ArrayLike]  # to eigenvalues
