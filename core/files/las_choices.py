"""Which points of LAS files are read."""

import re
from dataclasses import dataclass

from ..errors import PointCloudError

_GREATEST = 255  # class of LAS


@dataclass(frozen=True)
class LasChoices:
    """Which points of LAS files are read, and in which unit.

    Attributes
    ----------
    classes : frozenset of int
        Those whose points are read; empty for all.
    withheld : bool
        Whether points are read that are flagged as withheld, which means deleted.
    meters : bool
        Whether coordinates in another unit, which the file states, are converted to meters.
    """

    classes: frozenset[int] = frozenset()
    withheld: bool = False
    meters: bool = False


def parse_classes(text: str) -> frozenset[int]:
    """Return the classes of a text such as "2 5", "2, 5" or "2-5"; none of an empty one.

    Raises
    ------
    PointCloudError
        A word is neither a class nor a range.
    """
    classes: set[int] = set()
    for word in re.split(r"[\s,;]+", text.strip()) if text.strip() else ():
        match = re.fullmatch(r"(\d{1,3})(?:-(\d{1,3}))?", word, re.ASCII)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last <= _GREATEST:
            raise PointCloudError(
                f"{word!r} is no class of LAS. Give numbers from 0 to {_GREATEST}, such as 2 5, or nothing for all."
            )
        classes.update(range(first, last + 1))
    return frozenset(classes)
