"""How many processor cores to use."""

import functools
import math
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from .control_groups import groups_of, number_in
from .errors import PointCloudError

VARIABLE = "MESHFREE_CORES"


def cores() -> int:
    """Return how many cores this process may use: what the variable MESHFREE_CORES says, or else what it is given.

    A scheduler gives a job some of a node's cores, by its affinity or by the limit of a container. A variable that is
    no whole number above zero raises `PointCloudError`.
    """
    text = os.environ.get(VARIABLE, "").strip()
    if text:
        if not text.isdecimal() or int(text) < 1:
            raise PointCloudError(f"{VARIABLE} is {text!r}. Let it be a whole number of at least 1, or remove it.")
        return int(text)
    given = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min([given, *_limits()])


@functools.cache
def _limits() -> tuple[int, ...]:
    """Return the limits of the control groups of this process, read once: each search for neighbors asks for them."""
    return tuple(_group_cores(groups_of("cpu")))


def _group_cores(groups: Iterable[Path]) -> Iterator[int]:
    """Yield the limit of each control group that has one, rounded up."""
    for group in groups:
        if (group / "cpu.max").exists():  # of version 2
            quota, _, period = (group / "cpu.max").read_text(encoding="utf-8").partition(" ")
        else:
            quota, period = (str(number_in(group / f"cpu.cfs_{name}_us") or "") for name in ("quota", "period"))
        if quota.isdecimal() and int(period) > 0:
            yield max(math.ceil(int(quota) / int(period)), 1)
