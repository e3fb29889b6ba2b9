"""The frames of a sequence: numbered files of one folder."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from ..arguments import as_path
from ..errors import PointCloudError
from ..types import FilePath
from .formats import READABLE, SPLATS

_NUMBERED = re.compile(r"(.*?)(\d+)(\D*)", re.ASCII)


def numbered_files(folder: FilePath) -> list[Path]:
    """Find the frames of a sequence: the files with points in a folder whose names differ by a number alone.

    Files without a number are not frames. See `order_frames`.

    Parameters
    ----------
    folder : path-like

    Returns
    -------
    list of pathlib.Path
        In the order of their numbers.

    Raises
    ------
    PointCloudError
        There is no such folder, no numbered file, or files of several names.
    """
    folder = as_path(folder)
    try:
        paths = [path for path in folder.iterdir() if path.suffix.lower() in (*READABLE, *SPLATS)]
    except OSError as error:
        raise PointCloudError(f"The folder {folder} cannot be read: {error.strerror or error}. Check it.") from error
    frames = [path for path in paths if _NUMBERED.fullmatch(path.stem)]
    if not frames:
        raise PointCloudError(
            f"{folder} has no numbered files with points, such as scan_001.ply. Name frames by numbers, of one of"
            f" {', '.join((*READABLE, *SPLATS))}."
        )
    return order_frames(frames)


def order_frames(paths: Sequence[FilePath]) -> list[Path]:
    """Put files in the order of the last number in their names, however many digits it has.

    Parameters
    ----------
    paths : sequence of path-like

    Returns
    -------
    list of pathlib.Path

    Raises
    ------
    PointCloudError
        A name without a number, names that differ by more than that, or the same number twice.
    """
    found = [(path, _parts(path)) for path in map(as_path, paths)]
    patterns = sorted({f"{match[1]}#{match[3]}{path.suffix}" for path, match in found})
    if len(patterns) > 1:
        shown = ", ".join(patterns[:3]) + (", ..." if len(patterns) > 3 else "")
        raise PointCloudError(f"There are frames of several names: {shown}. Choose those of one, in one folder.")
    frames = sorted(found, key=lambda item: int(item[1][2]))
    for (path, match), (other, following) in pairwise(frames):
        if int(match[2]) == int(following[2]):
            raise PointCloudError(f"{path.name} and {other.name} have the same number. Remove one of them.")
    return [path for path, _ in frames]


def frame_number(path: FilePath) -> int:
    """Return the last number in the name of a file, by which `order_frames` sorts."""
    return int(_parts(as_path(path))[2])


def _parts(path: Path) -> re.Match[str]:
    """Divide the name of a file at its last number."""
    match = _NUMBERED.fullmatch(path.stem)
    if match is None:
        raise PointCloudError(f"{path.name} has no number, so its order is unknown. Name frames by numbers.")
    return match
