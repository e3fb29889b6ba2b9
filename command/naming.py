"""Errors that name what they are about."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from . import core

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextmanager
def naming(name: str | Path) -> Iterator[None]:
    """Add the name of an object or a file to errors."""
    try:
        yield
    except core.PointCloudError as error:
        if f'"{name}"' in str(error):
            raise
        raise core.PointCloudError(f'"{name}": {error}') from error
