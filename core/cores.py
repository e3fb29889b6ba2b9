"""How many processor cores to use."""

import math
import os
from pathlib import Path

from .errors import PointCloudError

VARIABLE = "MESHFREE_CORES"
_CGROUP = Path("/sys/fs/cgroup")


def cores() -> int:
    """Return how many cores this process may use: what the variable MESHFREE_CORES says, or else what it is given.

    A scheduler gives a job some of a node's cores, by its affinity or by the limit of a container.

    Raises
    ------
    PointCloudError
        The variable is no whole number above zero.
    """
    text = os.environ.get(VARIABLE, "").strip()
    if text:
        if not text.isdecimal() or int(text) < 1:
            raise PointCloudError(f"{VARIABLE} is {text!r}. Let it be a whole number of at least 1, or remove it.")
        return int(text)
    given = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(given, _container_cores() or given)


def _container_cores(root: Path = _CGROUP) -> int | None:
    """Return the limit of a container, rounded up, None without one."""
    limit = root / "cpu.max"
    if not limit.exists():
        return None
    quota, period = limit.read_text().split()
    return None if quota == "max" else max(math.ceil(int(quota) / int(period)), 1)
