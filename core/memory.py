"""The memory that an operator needs, estimated before the start: or the system may end Blender."""

import ctypes
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from .control_groups import groups_of, number_in
from .errors import NotEnoughMemoryError
from .options import LaplacianOptions

# Bytes for each neighbor of a point, at the peak of a build: resident memory of builds of 50,000 points of a sphere,
# beyond that before, with 40, 116 and 230 neighbors a point (3.6, 6.4 and 11.4 kB a point; of 150,000 random points,
# 54 and 156 take 3.7 and 7.7 kB).
_PER_NEIGHBOR = 42
_ALONE = 43  # neighbors that would take as much as what each point needs for itself
_PER_MODE = 70  # bytes a point for each mode beyond that: 50 and 400 modes took 3.4 and 28 kB a point
_PER_DOUBLE = 160  # where multigrid needs double precision: 50 and 100 modes of scans by lidars took 152 and 153 bytes
ADAPTIVE = 60.0  # neighbors in "adaptive" kernels on random points, which have the most
_SHARE = 0.8  # of the free memory, to leave some for other programs
# Files of a control group, of versions 2 and 1: the limit, what is taken, and which of that are cached files.
_GROUPS = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


def needed_memory(count: int, options: LaplacianOptions, modes: int = 0) -> int:
    """Estimate the most bytes that an operator takes while it is built and so many modes are computed.

    The kernel's width decides, which the options give. They are those of random points, which have the widest kernels;
    even samples take half.
    """
    return int(count * (_PER_NEIGHBOR * (points_in_kernel(options) + _ALONE) + _PER_MODE * modes))


def points_in_kernel(options: LaplacianOptions) -> float:
    """Estimate how many points a kernel holds, on random points, where "adaptive" ones hold most."""
    inside = ADAPTIVE if options.bandwidth == "adaptive" else 9.0 * options.neighbors  # of 3 h
    return inside * options.bandwidth_factor**2


def points_that_fit(options: LaplacianOptions, modes: int = 0) -> int | None:
    """Estimate how many points the free memory is enough for.

    Parameters
    ----------
    options, modes
        See `needed_memory`.

    Returns
    -------
    int or None
        None where the free memory is unknown.
    """
    free = available_memory()
    return None if free is None else _fitting(free, needed_memory(1, options, modes))


def check_memory(count: int, options: LaplacianOptions, modes: int = 0) -> None:
    """Refuse to build an operator that does not fit the free memory, as of `needed_memory`, by `NotEnoughMemoryError`.

    Its text says how many points fit.
    """
    check_room(count, needed_memory(1, options, modes), "Use fewer points, a narrower kernel, or free memory.")


def check_room(count: int, each: int, advice: str = "Use fewer points, or free memory.") -> None:
    """Refuse work on points that does not fit the free memory.

    Parameters
    ----------
    count : int
        Points.
    each : int
        Bytes that a point takes at the peak.
    advice : str
        What to do.

    Raises
    ------
    NotEnoughMemoryError
        It does not fit; the text says how many points do.

    See Also
    --------
    points_that_fit : How many points an operator has room for.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> mf.check_room(len(points), each=200)
    """
    free = available_memory()
    if free is not None and count > (most := _fitting(free, each)):
        raise NotEnoughMemoryError(
            f"{count:,} points would take about {count * each / 2**30:.1f} GB of memory, and {free / 2**30:.1f} GB are"
            f" free: enough for {_rounded(most):,} points. {advice}",
            fitting=most,
        )


def check_mode_memory(count: int, modes: int, double: bool = False) -> None:
    """Refuse to compute modes that do not fit the free memory, by `NotEnoughMemoryError`, which says how many do.

    With `double` those that multigrid finds in double precision.
    """
    free = available_memory()
    if free is None:
        return
    each = count * (_PER_DOUBLE if double else _PER_MODE)
    most = _fitting(free, each)
    if modes > most:
        needed = each * modes
        raise NotEnoughMemoryError(
            f"{modes} modes of {count:,} points would take about {needed / 2**30:.1f} GB of memory, and"
            f" {free / 2**30:.1f} GB are free: enough for {most} modes. Ask for fewer,"
            " use fewer points, or free memory.",
            fitting=most,
        )


def _fitting(free: int, each: int) -> int:
    """Return how many fit the free memory, of so many bytes each."""
    return int(_SHARE * free / each)


def _rounded(count: int) -> int:
    """Return a number down to two digits, for people."""
    unit = 10 ** max(len(str(count)) - 2, 0)
    return count // unit * unit


def available_memory() -> int | None:
    """Return the bytes of memory available without the system ending programs; None where unknown."""
    if sys.platform == "win32":
        return _windows_memory()
    if sys.platform == "darwin":  # it calls memory used that it gives at once when asked: half of all is taken as free
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    known = [_linux_memory(), *_group_memory(groups_of("memory"))]
    return min((free for free in known if free is not None), default=None)


def _linux_memory(path: Path = Path("/proc/meminfo")) -> int | None:
    if not path.exists():
        return None
    return 1024 * _numbers(path.read_text()).get("MemAvailable:", 0) or None


def _group_memory(groups: Iterable[Path]) -> Iterator[int]:
    """Yield the memory below the limit of each control group that has one; cached files count as free."""
    for group in groups:
        for limit, used, cached in _GROUPS:
            most, taken = number_in(group / limit), number_in(group / used)
            if most is not None and taken is not None:
                kinds = group / "memory.stat"
                given_back = _numbers(kinds.read_text()).get(cached, 0) if kinds.exists() else 0
                yield max(most - taken + given_back, 0)


def _numbers(text: str) -> dict[str, int]:
    """Return the numbers of lines that begin with a name and a number."""
    fields = (line.split() for line in text.splitlines())
    return {name: int(number) for name, number, *_ in fields}


class _WindowsStatus(ctypes.Structure):
    """MEMORYSTATUSEX of the Windows API."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("load", ctypes.c_uint32),
        ("total", ctypes.c_uint64),
        ("available", ctypes.c_uint64),
        *((name, ctypes.c_uint64) for name in ("total_page", "free_page", "total_virtual", "free_virtual", "extended")),
    )


def _windows_memory() -> int | None:
    status = _WindowsStatus(length=ctypes.sizeof(_WindowsStatus))
    if not ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):  # type: ignore[attr-defined,unused-ignore]
        return None
    return int(status.available)
