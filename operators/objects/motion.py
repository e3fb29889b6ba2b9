"""Motion along a surface: frames on disk, which one attribute of the points plays."""

import os
from pathlib import Path

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core import PointCloudError
from ...tools.quantities import MOTION
from .attributes import in_edit_mesh, point_count, tag_changed, write_attribute
from .handlers import add_handlers, notify, remove_handlers
from .notices import keep

TOOL = "Simulate Along Surface"  # whose notices these are
TEMPORARY = "The frames are in a temporary folder until the file is saved, which takes them along."
_DTYPE = np.dtype("<f4")
_open = {}  # frames by path and time of change: memory maps of files


def write_frames(path: Path, count: int, points: int, rows):
    """Write so many frames of so many points to a file, one after the other; after a failure there is none.

    Rows, (points,), are at least as many as that.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    header = {"descr": _DTYPE.str, "fortran_order": False, "shape": (count, points)}
    try:
        with path.open("wb") as file:
            np.lib.format.write_array_header_1_0(file, header)
            for _, row in zip(range(count), rows, strict=False):
                file.write(np.ascontiguousarray(row, _DTYPE).data)
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def frame_of(obj, frame: float):
    """Return the values of an object's motion at a frame of the scene, (n,) float32, between those on disk.

    A file that is missing, or does not fit the points, raises `PointCloudError`.
    """
    settings = obj.meshfree
    frames = _frames(bpy.path.abspath(settings.motion_file), obj)
    if frames.shape[1] != point_count(obj.data):
        raise PointCloudError(
            f'The motion of "{obj.name}" was simulated on {frames.shape[1]} points, and there are'
            f" {point_count(obj.data)}. Simulate again."
        )
    place = np.clip((frame - settings.motion_first) / max(settings.motion_step, 1), 0.0, len(frames) - 1.0)
    first = int(place)
    share = np.float32(place - first)
    if share == 0.0:
        return np.array(frames[first])
    return (1 - share) * frames[first] + share * frames[first + 1]


def _frames(path, obj):
    """Return the frames of a file, (frames, n), without reading all of it."""
    try:
        key = path, os.stat(path).st_mtime_ns
        if key not in _open:
            _open.clear()
            _open[key] = np.load(path, mmap_mode="r")
    except (OSError, ValueError) as error:
        raise PointCloudError(
            f'The frames of "{obj.name}" cannot be read: {error}. Simulate again, or bring the file back.'
        ) from error
    return _open[key]


def show_frame(obj, frame: float):
    """Write the values at a frame of the scene to the attribute of an object, and show them."""
    show_values(obj, frame_of(obj, frame))


def show_values(obj, values):
    """Write the values of a motion, (n,), to the attribute of an object, and show them."""
    write_attribute(obj.data, MOTION, values)
    tag_changed(obj.data)
    notify("frame_shown", obj)


@persistent
def _on_frame_change(scene, _depsgraph):
    for obj in [obj for obj in scene.objects if obj.meshfree.motion_file]:
        if not obj.is_editable or not obj.data.is_editable or in_edit_mesh(obj):
            continue
        try:
            show_frame(obj, scene.frame_current_final)
        except PointCloudError as error:
            keep(obj, TOOL, str(error))


def close_frames():
    """Close the files of frames, which are opened again as they are needed."""
    _open.clear()


@persistent
def _forget(*_):
    close_frames()


_HANDLERS = {"frame_change_post": _on_frame_change, "load_pre": _forget}


def attach():
    """Add the handlers."""
    add_handlers(_HANDLERS)


def detach():
    """Remove the handlers, and close the files."""
    remove_handlers(_HANDLERS)
    close_frames()
