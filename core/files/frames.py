"""The frames of a sequence: numbered files of one folder."""

import re
from itertools import pairwise

from ..errors import PointCloudError
from .formats import READABLE

_NUMBERED = re.compile(r"(.*?)(\d+)(\D*)", re.ASCII)


def numbered_files(folder) -> list:
    """Find the frames of a sequence: the files with points in a folder whose names differ by a number alone.

    The last number of a name counts, however many digits it has. Files without a number are no frames.

    Parameters
    ----------
    folder : pathlib.Path

    Returns
    -------
    list of pathlib.Path
        In the order of their numbers.

    Raises
    ------
    PointCloudError
        There is no such folder, no numbered file, or files of several names.
    """
    try:
        names = [path for path in folder.iterdir() if path.suffix.lower() in READABLE]
    except OSError as error:
        raise PointCloudError(f"The folder {folder} cannot be read: {error.strerror or error}. Check it.") from error
    found = [(path, match) for path in names if (match := _NUMBERED.fullmatch(path.stem))]
    if not found:
        raise PointCloudError(
            f"{folder} has no numbered files with points, such as scan_001.ply. Name frames by numbers, of one of"
            f" {', '.join(READABLE)}."
        )
    patterns = sorted({f"{match[1]}#{match[3]}{path.suffix}" for path, match in found})
    if len(patterns) > 1:
        shown = ", ".join(patterns[:3]) + (", ..." if len(patterns) > 3 else "")
        raise PointCloudError(f"{folder} has numbered files of several names: {shown}. Give each a folder of its own.")
    frames = sorted(found, key=lambda item: int(item[1][2]))
    for (path, match), (other, following) in pairwise(frames):
        if int(match[2]) == int(following[2]):
            raise PointCloudError(f"{path.name} and {other.name} have the same number. Remove one of them.")
    return [path for path, _ in frames]
