"""Errors that name what they are about, and the order of names."""

from __future__ import annotations

import re
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


def natural(name: str) -> list[str | int]:
    """Return a key by which names are in the order of the numbers in them."""
    parts = re.split(r"(\d+)", name.lower(), flags=re.ASCII)
    return [int(part) if index % 2 else part for index, part in enumerate(parts)]
