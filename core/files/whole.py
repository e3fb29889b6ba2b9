"""Files written completely or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..arguments import as_path
from ..errors import PointCloudError
from ..types import FilePath


@contextmanager
def replacing(path: FilePath) -> Iterator[Path]:
    """Provide a temporary file beside this one to write to, which replaces it at the end.

    If writing fails, an older file stays. The folder is created if it is missing.

    Parameters
    ----------
    path : path-like

    Yields
    ------
    pathlib.Path
        With the same suffix.

    Raises
    ------
    PointCloudError
        The file or its folder cannot be written to.
    """
    path = as_path(path)
    temporary = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.unlink(missing_ok=True)  # of a writer that was killed; a link there would lead elsewhere
        try:
            yield temporary
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise PointCloudError(f"{path} cannot be written: {error.strerror or error}. Choose another place.") from error
