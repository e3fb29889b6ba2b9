"""The control groups of Linux, by which a scheduler or a container limits what a process may take."""

from collections.abc import Iterator
from pathlib import Path

_OWN = Path("/proc/self/cgroup")
_ROOT = Path("/sys/fs/cgroup")


def groups_of(controller: str, own: Path = _OWN, root: Path = _ROOT) -> Iterator[Path]:
    """Yield the folders of the groups that limit this process, from its own group up to that of the machine.

    Parameters
    ----------
    controller : str
        What is limited: "memory" or "cpu".
    own : pathlib.Path
        What the system tells of this process: lines of a number, controllers, and the path of a group. The number is 0,
        without controllers, in version 2.
    root : pathlib.Path
        Where groups are folders: those of version 1 in one for each controller, those of version 2 in it or in
        `unified`.
    """
    try:
        lines = own.read_text(encoding="utf-8").splitlines()
    except OSError:  # of another system
        return
    for _, names, path in (line.split(":", 2) for line in lines if line.count(":") >= 2):
        if not names:
            homes = [root, root / "unified"]
        elif controller in names.split(","):
            homes = [root / controller, root / names]
        else:
            continue
        parts = Path(path).parts[1:]
        for home in homes:
            # A container may see its groups from its own on, and yet be told the path from that of the machine on.
            seen = (home.joinpath(*parts[start:]) for start in range(len(parts) + 1))
            group = next((folder for folder in seen if folder.is_dir()), None)
            if group is not None:
                yield group
                yield from group.parents[: len(group.parts) - len(home.parts)]


def number_in(path: Path) -> int | None:
    """Return the number in a file of a group; None where there is none, or no limit."""
    try:
        text = path.read_text(encoding="utf-8").strip()
    except OSError:
        return None
    return int(text) if text.isdecimal() else None
