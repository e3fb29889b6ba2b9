"""A mesh of the surface."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from . import core
from .settings import Setting
from .tool import Array, Laplacian, Length, Outcome, Progress, Row, Tool

GAP = 12  # edges around a hole that counts as a gap between points, and is closed


class Closed(NamedTuple):
    """A mesh without its small holes."""

    mesh: "core.surface.SurfaceMesh"
    faces: list[Array]  # (m, k) int each
    opened: int  # how many edges of one face are left


class MeshSurface(Tool):
    """The tool."""

    name, verb, label = "mesh_surface", "mesh", "Surface from Points"
    help = "Reconstruct a mesh from the points, with their results, colors and groups on its vertices"
    settings = (
        Setting(
            "detail",
            "How many edges there are along the distance between neighboring points; 2 makes four times as many faces"
            " as 1",
            1.0,
            0.05,
            16.0,
            low=0.25,
            high=4.0,
        ),
    )
    panel, menu = Row("Make", 1, 1), Row("Object", 2, 1)
    extended = True

    def adjustable(self, own: Any) -> tuple[str, ...]:
        return self.asks(own)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        mesh = core.surface.mesh_surface(laplacian, own.detail, progress=progress)
        closed, opened = close_gaps(mesh.faces)
        return Closed(mesh, [mesh.faces, closed], opened)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        count = sum(map(len, found.faces))
        figures = {"vertices": len(found.mesh.vertices), "faces": count, "open_edges": found.opened}
        return Outcome({}, line(count, found.opened), found.mesh.notices, figures=figures, made=found)


def line(faces: int, opened: int) -> str:
    """Return what is told of a mesh of so many faces, and edges of one face."""
    return f"{faces:,} faces, {'open' if opened else 'closed'}"


def carried_mesh(laplacian: Laplacian, detail: float, progress: Progress) -> tuple["core.surface.SurfaceMesh", Any]:
    """Return a mesh of the points of an operator, and the `Prolongation` to its vertices, made only once."""
    mesh = core.surface.mesh_surface(laplacian, detail, progress=progress)
    told = lambda: progress("Results", 0.95)  # noqa: E731
    work = lambda: core.surface.values_on_mesh(laplacian, mesh.vertices, progress=told)  # noqa: E731
    return mesh, laplacian.kept.result("values on mesh", work, detail)


def close_gaps(faces: Array, most: int = GAP) -> tuple[Array, int]:
    """Close the small holes of a mesh, of so many edges at most, by triangles, oriented as the faces are, (t, 3) int.

    Faces, (q, k), are oriented alike. Return also how many edges of one face are left.
    """
    begin, end = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2).T.astype(np.int64)
    count = int(faces.max(initial=-1)) + 1
    lone = ~np.isin(begin * count + end, end * count + begin)
    begin, end = begin[lone], end[lone]
    following = np.full(count, -1)
    following[end] = begin  # against the faces, as those in a hole have these edges
    following[np.bincount(begin, minlength=count) != 1] = -1  # where holes touch, it is not known which way to go
    loops = list(_small_loops(following, most))
    return np.concatenate([np.empty((0, 3), np.int64), *map(_fans, loops)]), len(begin) - sum(map(np.size, loops))


def _small_loops(following: Array, most: int) -> Iterator[Array]:
    """Yield the loops of vertices, by which of them follows each, as arrays (m, k) for k from 3 on."""
    walks = np.flatnonzero(following >= 0)[:, None]
    for size in range(1, most + 1):
        step = following[walks[:, -1]]
        closed = step == walks[:, 0]
        loops = walks[closed]
        if size > 2:
            yield loops[loops[:, 0] == loops.min(axis=1)]  # each is found from all of its vertices
        going = ~closed & (step >= 0)
        walks = np.column_stack([walks[going], step[going]])


def _fans(loops: Array) -> Array:
    """Return the triangles of loops, (m, k), around the first vertex of each, (m (k - 2), 3)."""
    corners = np.arange(1, loops.shape[1] - 1)
    first = np.broadcast_to(loops[:, :1], (len(loops), len(corners)))
    return np.stack([first, loops[:, corners], loops[:, corners + 1]], axis=2).reshape(-1, 3)


TOOL = MeshSurface()
