"""Files written completely or not at all, by one process at a time."""

import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..arguments import as_path
from ..errors import PointCloudError
from ..types import FilePath

try:
    import fcntl
except ImportError:  # in Windows, where files that are open cannot be deleted
    fcntl = None  # type: ignore[assignment]

_LONGEST = 200  # bytes of a name, to which those of a part are added
_PART = re.compile(r"\..*\.\d+-[0-9a-f]{8}\.part(\.[^.]*)?")
_cleaned = set[Path]()  # folders


@contextmanager
def replacing(path: FilePath) -> Iterator[Path]:
    """Provide a temporary file beside this one to write to, which replaces it at the end.

    If writing fails, an older file stays. The folder is created if it is missing. Of several processes that write the
    same file each has a temporary one of its own, and the last one to end replaces those of the others.

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
    stem = os.fsdecode(os.fsencode(path.stem)[:_LONGEST])
    temporary = path.with_name(f".{stem}.{os.getpid()}-{secrets.token_hex(4)}.part{path.suffix}")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        _clean(path.parent)
        with holding(temporary):
            yield temporary
            os.replace(temporary, path)


@contextmanager
def writing(path: FilePath) -> Iterator[None]:
    """Convert errors while a file or folder is written into typed ones that name it.

    Raises
    ------
    PointCloudError
        It cannot be written. The cause tells the number of the error, and that of a write that fell short is the one of
        a full disk: numpy and lazrs tell none.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and type(error).__module__ != "lazrs":
            raise
        known = error if isinstance(error, OSError) and error.errno else _full()
        raise PointCloudError(f"{path} cannot be written: {known.strerror}. Choose another place.") from known


def _full() -> OSError:
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@contextmanager
def holding(path: FilePath) -> Iterator[bool]:
    """Hold a file for this process, made if it is missing, and delete it at the end.

    Yields
    ------
    bool
        False if another process holds it, which then goes on to. A process that is killed holds nothing any more. Where
        files cannot be locked, as in Windows and on some network drives, each process is told that it holds it.
    """
    path = as_path(path)
    if fcntl is None:
        try:
            yield True
        finally:
            path.unlink(missing_ok=True)
        return
    file = _open(path)
    try:
        while (free := _lock(file) is not False) and not _is_at(file, path):  # another one has deleted it at its end
            os.close(file)
            file = _open(path)
        try:
            yield free
        finally:
            if free:
                path.unlink(missing_ok=True)
    finally:
        os.close(file)


@contextmanager
def holding_folder(folder: FilePath, lock: str) -> Iterator[bool]:
    """Hold a file of some name in a folder, which is made if it is missing; see `holding`.

    Raises
    ------
    PointCloudError
        The folder cannot be written to.
    """
    folder = as_path(folder)
    with ExitStack() as stack:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            alone = stack.enter_context(holding(folder / lock))
        yield alone


@contextmanager
def alone_in(folder: FilePath, lock: str) -> Iterator[None]:
    """Hold a file of some name in a folder, as `holding_folder`, and refuse to go on where another process does.

    Raises
    ------
    PointCloudError
        It does, or the folder cannot be written to.
    """
    with holding_folder(folder, lock) as alone:
        if not alone:
            raise PointCloudError(f"Another run is at work in {folder}. Wait until it ends, or choose another folder.")
        yield


def _open(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)


def _lock(file: int) -> bool | None:
    """Lock an open file and tell whether that went well; False if another process has, None if that is not known."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except FileNotFoundError:
        return False


def _clean(folder: Path) -> None:
    """Delete the parts that killed processes have left in a folder, the first time that something is written to it."""
    if folder in _cleaned:
        return
    _cleaned.add(folder)
    for path in [folder / name for name in os.listdir(folder) if _PART.fullmatch(name)]:
        with suppress(OSError):  # others clean up, too
            file = None if fcntl is None else os.open(path, os.O_RDWR | os.O_NOFOLLOW)
            try:
                if file is None or _lock(file):
                    path.unlink()
            finally:
                if file is not None:
                    os.close(file)
