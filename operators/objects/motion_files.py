"""Files of frames: where they are, how they go along when the file is saved, and how long former ones stay for Undo."""

import os
import shutil
import uuid
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from .handlers import add_handlers, remove_handlers
from .motion import TEMPORARY, TOOL, close_frames
from .notices import keep, withdraw

FOLDER = "//motion"  # beside the file
_known = {}  # files that were made or replaced since Blender started, in their order, as keys
_saved = {}  # by .blend file: the frames that it plays, as saved or loaded
_before = []  # objects whose frames go along with the file that is being saved, and what they named before


def home(folder: str) -> Path:
    """Return the folder of frames: a temporary one for a file that is not saved yet."""
    if folder.startswith("//") and not bpy.data.filepath:
        folder = ""
    return _absolute(folder) if folder else Path(bpy.app.tempdir).resolve()


def _absolute(kept):
    """Return a path that may begin at the .blend file, one form for one file."""
    return Path(bpy.path.abspath(kept)).resolve()


def new_path(obj, folder: str) -> Path:
    """Return a new path for the frames of an object; what is written there is removed when nothing can play it."""
    path = home(folder) / f"{_stem(obj)}-{uuid.uuid4().hex[:8]}.npy"
    _known[path] = None
    return path


def as_kept(path: Path, folder: str) -> str:
    """Return a path as it is kept: relative where the folder is."""
    relative = folder.startswith("//") and bpy.data.filepath
    return bpy.path.relpath(str(path)) if relative else str(path)


def note_replaced(obj, before: str, folder: str):
    """Note the earlier frames of an object, which are removed when nothing can play them; not files of others."""
    old = _absolute(before)
    if before and old.parent == home(folder) and old.match(f"{_stem(obj)}-????????.npy"):
        _known.setdefault(old)


def _stem(obj):
    return bpy.path.clean_name(obj.name)


def frames_of(obj) -> Path | None:
    """Return the file that an object plays, or None."""
    kept = obj.meshfree.motion_file
    return _absolute(kept) if kept else None


def former() -> list:
    """Return the files that no object plays, but may after Undo, the oldest first."""
    played = _played()
    return [path for path in _known if path not in played and path.exists()]


def size_of(paths) -> int:
    """Return how many bytes files take together."""
    return sum(path.stat().st_size for path in paths if path.exists())


def shrink_former(most: float) -> int:
    """Remove former files, the oldest first, until the others take so many bytes at most; return how many were removed.

    Those stay that a .blend file plays as it was saved.
    """
    kept = _all_saved()
    removed, left = 0, former()
    for path in [path for path in left if path not in kept]:
        if size_of(left) <= most:
            break
        left.remove(path)
        _remove(path)
        removed += 1
    return removed


def _played():
    """Return the files that objects play, as a set."""
    return {_absolute(name) for name in _named()}


def _named():
    return {obj.meshfree.motion_file for obj in bpy.data.objects} - {""}


def _all_saved():
    return set().union(*_saved.values())


def _remove(path):
    close_frames()  # Windows removes no open file
    _known.pop(path, None)
    path.unlink(missing_ok=True)


def _remove_all():
    """Remove what nothing can play any more, after Undo has ended."""
    for path in set(_known) - _played() - _all_saved():
        _remove(path)


@persistent
def _before_save(path, *_):
    """Let objects name their frames as seen from the file that is to be saved; temporary ones are copied beside it."""
    _before.clear()
    if not path:  # the startup file
        return
    folder = Path(path).resolve().parent
    for obj in [obj for obj in bpy.data.objects if obj.meshfree.motion_file and obj.is_editable]:
        named, file = obj.meshfree.motion_file, frames_of(obj)
        try:
            if file.is_relative_to(Path(bpy.app.tempdir).resolve()) and file.exists():
                file = _copied(file, folder / FOLDER.removeprefix("//"))
            elif not named.startswith("//"):
                continue
            obj.meshfree.motion_file = f"//{os.path.relpath(file, folder)}".replace(os.sep, "/")
        except (OSError, ValueError) as error:  # no room, no right to write, another drive
            keep(obj, TOOL, f"The frames did not go along with the file: {error}. Save it in another folder.")
            continue
        _before.append((obj, named))


def _copied(file, folder):
    """Copy frames to a folder, unless they are there, and return their new path."""
    target = folder / file.name
    if not target.exists():
        folder.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(".part")
        shutil.copyfile(file, part)
        part.replace(target)
    _known[target] = None
    return target


def _take_back():
    """Let objects name their frames as before."""
    for obj, named in _before:
        obj.meshfree.motion_file = named
    _before.clear()


@persistent
def _on_save(path, *_):
    path = path or bpy.data.filepath
    folder = Path(path).parent
    _saved[path] = {Path(bpy.path.abspath(name, start=str(folder))).resolve() for name in _named()}
    if Path(path).resolve() != Path(bpy.data.filepath).resolve():  # it is a copy, and this file goes on
        _take_back()
    for obj, _ in _before:
        withdraw(obj, TEMPORARY)
    _before.clear()


@persistent
def _on_failure(*_):
    _take_back()


@persistent
def _on_load(*_):
    _saved[bpy.data.filepath] = _played()
    _remove_all()


_HANDLERS = {
    "save_pre": _before_save,
    "save_post": _on_save,
    "save_post_fail": _on_failure,
    "load_post": _on_load,
}


def attach():
    """Add the handlers."""
    add_handlers(_HANDLERS)


def detach():
    """Remove the handlers, and what nothing can play any more: Blender quits."""
    remove_handlers(_HANDLERS)
    _remove_all()
    for kept in (_known, _saved, _before):
        kept.clear()
