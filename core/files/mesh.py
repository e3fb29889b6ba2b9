"""Meshes to files: vertices with their attributes, and faces."""

from collections.abc import Callable
from pathlib import Path
from typing import TextIO

import numpy as np

from ..arguments import as_path
from ..errors import PointCloudError
from ..types import Array, FilePath, Ints
from .origin import is_coarse
from .ply import write_ply
from .polygons import triangles
from .table import PointTable
from .whole import replacing

_BLOCK = 10_000  # lines that are written at once


def write_mesh(path: FilePath, table: PointTable, faces: list[Ints], double: bool = True) -> list[str]:
    """Write a mesh to a file of one of the kinds in `MESHES`; an older file stays if that fails.

    Parameters
    ----------
    path : path-like
    table : PointTable
        The vertices.
    faces : sequence of ndarray, (m, k) int
        Faces of k corners each, as indices of vertices.
    double : bool
        Whether coordinates are kept in double precision; STL has none.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix not in MESHES:
        raise PointCloudError(f"A mesh cannot be written to {path}. Give it one of {', '.join(MESHES)}.")
    with replacing(path) as temporary:
        return _WRITERS[suffix](temporary, table, double, faces) or []


def _write_obj(path: Path, table: PointTable, double: bool, faces: list[Ints]) -> None:
    """Write text: vertices, with colors after the coordinates if they have any, and faces."""
    values, digits = table.points, "%.15g" if double else "%.9g"
    line = " ".join(["v", *3 * [digits]])
    if table.colors is not None:
        values, line = np.hstack([values, table.colors[:, :3]]), " ".join([line, *3 * ["%.6g"]])
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        _write_rows(file, line, values)
        for polygons in faces:
            _write_rows(file, " ".join(["f", *polygons.shape[1] * ["%d"]]), polygons + 1)


def _write_rows(file: TextIO, line: str, rows: Array) -> None:
    """Write rows of numbers by the format of a line."""
    line += "\n"
    for start in range(0, len(rows), _BLOCK):
        block = rows[start : start + _BLOCK]
        file.write((line * len(block)) % tuple(block.reshape(-1).tolist()))


def _write_stl(path: Path, table: PointTable, double: bool, faces: list[Ints]) -> None:
    """Write binary triangles, in single precision, which is all that STL has."""
    if is_coarse(table.points):
        raise PointCloudError(
            "STL keeps single precision, too little for coordinates as large as these. Write .ply or .obj."
        )
    divided = [triangles(polygons, table.points) for polygons in faces]
    corners = np.concatenate(divided) if divided else np.zeros((0, 3), int)
    places = table.points[corners]
    normals = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("places", "<f4", (3, 3)), ("unused", "<u2")])
    rows["normal"], rows["places"] = normals / np.where(lengths > 0.0, lengths, 1.0), places
    with open(path, "wb") as file:
        file.write(b"triangles of a mesh".ljust(80))
        file.write(np.array(len(rows), "<u4").tobytes())
        rows.tofile(file)


_WRITERS: dict[str, Callable[..., list[str] | None]] = {".ply": write_ply, ".obj": _write_obj, ".stl": _write_stl}
MESHES = tuple(_WRITERS)
