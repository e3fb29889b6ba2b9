"""Results that stay what they are."""

import copy
from dataclasses import fields
from typing import Any

import numpy as np


class Frozen:
    """Base of frozen dataclasses whose arrays are frozen, too: nobody changes a result by writing to what it gave.

    They are views of what was given, so that the caller's own stay as they were; those of sparse matrices, and of lists
    and named tuples in a result, are read-only likewise. `numpy.copy` gives one to write to.
    """

    def __post_init__(self) -> None:
        for each in fields(self):  # type: ignore[arg-type]
            object.__setattr__(self, each.name, _frozen(getattr(self, each.name)))


def _frozen(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.view()
        value.flags.writeable = False
    elif hasattr(value, "indptr"):  # a sparse matrix by rows or columns
        value = copy.copy(value)
        if not value.has_canonical_format:  # scipy would sort the entries in place, when it needs them so
            value = value.copy()
            value.sum_duplicates()
        value.data, value.indices, value.indptr = map(_frozen, (value.data, value.indices, value.indptr))
    elif isinstance(value, list):
        value = [_frozen(each) for each in value]
    elif hasattr(value, "_make"):
        value = value._make(map(_frozen, value))
    return value
