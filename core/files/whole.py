"""Files that are there whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import PointCloudError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the name of a file beside this one to write to, and put it in its place at the end.

    If writing fails, what was there before stays. The folder is made if it is missing.

    Parameters
    ----------
    path : pathlib.Path

    Yields
    ------
    pathlib.Path
        With the same suffix, which numpy goes by.

    Raises
    ------
    PointCloudError
        The file or its folder cannot be written to.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.unlink(missing_ok=True)  # of a writer that was killed; a link there would lead elsewhere
        try:
            yield part
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise PointCloudError(f"{path} cannot be written: {error.strerror or error}. Choose another place.") from error
