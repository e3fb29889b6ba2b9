"""The volume that a surface encloses, holes in it closed, and how far it may be off."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..frozen import Frozen
from ..operator import ImplicitSurface, LaplaceBeltrami
from ..progress import ends_at_one
from ..surface import SurfaceMesh, mesh_surface
from ..types import Array, Bools, Floats, Ints, Progress

NOISE = 0.12  # of the noise that a surface through noisy points may be off as a whole
_HIDDEN = 0.2  # of the area of an opening times its radius, within which the surface that closes it is taken to be
_TUBE = 1.0  # radii that a surface may go on at an opening where it stands upright; with a dome nearly its width
_MIXED = 0.05  # share of the area whose normals may point to the other side before it is said


@dataclass(frozen=True)
class EnclosedVolume(Frozen):
    """The volume within a surface.

    Attributes
    ----------
    volume : float
        Of all components [L^3]; those inside another one are cavities of it, and subtracted.
    uncertainty : float
        The true volume is expected within this of it [L^3]: what openings, noise and the spacing leave.
    volumes, uncertainties : ndarray, (c,)
        The same of each component alone, none negative.
    openings : ndarray, (c,) int
        Boundaries of each component that were closed.
    notices : list of str
        Texts for the user: openings, cavities, normals to both sides.
    """

    volume: float
    uncertainty: float
    volumes: Floats
    uncertainties: Floats
    openings: Ints
    notices: list[str]


@ends_at_one
def enclosed_volume(laplacian: LaplaceBeltrami, *, progress: Progress | None = None) -> EnclosedVolume:
    """Measure the volume that the surface of points encloses.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points. The signs of its normals do not matter.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    EnclosedVolume
        An open surface is no error: its openings are closed, and the uncertainty holds a dome or a tube beyond.

    Raises
    ------
    PointCloudError
        So few points that there is no mesh of them.
    NotEnoughMemoryError
        More points than the free memory is enough for, before the start.

    See Also
    --------
    measure_region : Area and boundary of a part of the surface.
    surface.mesh_surface : The mesh that is integrated over.

    Notes
    -----
    By the divergence theorem over a mesh of the surface, and between each of its triangles and the quadric with the
    normals of its vertices. The area elements with the normals at the points would do only to first order. An opening
    is closed by triangles around its centre, and by a part of the spherical dome that continues the surface around it:
    all of it in a surface that is smooth there, none where the surface ends upright, as that of an open vessel. The
    uncertainty covers both, a fifth of the radius more, and where the surface ends upright a tube as long as it is
    wide. A longer part that is cut off, such as a limb, is not in it. Of noise, a surface through the points may be off
    by 12 % of its height, towards the inside of curved parts.

    Examples
    --------
    The unit ball, 4 pi / 3:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> found = mf.measure.enclosed_volume(mf.build_laplacian(points))
    >>> print(round(found.volume, 2), found.uncertainty < 0.2, found.openings)
    4.19 True [0]
    """
    return laplacian.kept.result("volume", lambda: _volume(laplacian, progress))


def _volume(laplacian: LaplaceBeltrami, progress: Progress | None) -> EnclosedVolume:
    """Measure the volume."""
    report = progress or (lambda stage, fraction: None)
    mesh = mesh_surface(laplacian, progress=progress)
    report("Volume", 0.95)
    kept = laplacian.component >= 0
    unit = float(np.sqrt(np.median(laplacian.areas[kept])))
    surface = ImplicitSurface(laplacian, unit)
    skin = _Skin(surface, mesh, laplacian.component[kept])
    bulge = skin.bulges(surface.heights(surface.scaled(mesh.vertices), lambda: report("Volume", 0.97)).normal)
    caps = _Caps(skin)
    count = int(laplacian.component.max()) + 1

    flat = np.bincount(skin.component, skin.volumes(), count) + np.bincount(caps.component, caps.flat, count)
    curved = np.bincount(skin.component, bulge, count)
    side = np.where(flat < 0.0, -1.0, 1.0)
    dome, doubt = caps.domes(side)
    volumes = np.abs(flat + curved) + np.bincount(caps.component, dome, count)
    area = np.bincount(laplacian.component[kept], laplacian.areas[kept], count)
    off = np.bincount(skin.component, np.abs(bulge), count) + NOISE * unit * _noise(laplacian, surface, count) * area
    off += np.bincount(caps.component, doubt, count)
    inside = _cavities(skin, caps, count)
    return EnclosedVolume(
        volume=float(volumes @ np.where(inside, -1.0, 1.0)),
        uncertainty=float(off.sum()),
        volumes=volumes,
        uncertainties=off,
        openings=np.bincount(caps.component, minlength=count),
        notices=mesh.notices
        + _notices(np.bincount(skin.component, minlength=count), caps.component, inside, skin.mixed()),
    )


class _Skin:
    """Triangles of a mesh, (t, 3), each of the component of the nearest point.

    Vertices, (v, 3), are from their middle on; edges, (e, 2), are sides of quads, in their sense of rotation.
    """

    def __init__(self, surface: ImplicitSurface, mesh: SurfaceMesh, component: Ints) -> None:
        faces = mesh.faces
        nearest = surface.nearest(surface.scaled(mesh.vertices[faces].mean(axis=1)))
        self.vertices = mesh.vertices - mesh.vertices.mean(axis=0)
        self.triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
        self.component = np.tile(component[nearest], 2)
        self.edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
        self._normals = np.tile(surface.normals[nearest], (2, 1))

    def corners(self) -> Floats:
        """Return the corners of triangles, (t, 3, 3)."""
        return self.vertices[self.triangles]

    def crosses(self) -> Floats:
        """Return the normals of triangles, twice their areas long, (t, 3)."""
        a, b, c = np.moveaxis(self.corners(), 1, 0)
        return np.cross(b - a, c - a)

    def volumes(self) -> Floats:
        """Return the signed volumes between triangles and the middle, (t,)."""
        return np.einsum("tc,tc->t", self.vertices[self.triangles[:, 0]], self.crosses()) / 6.0

    def bulges(self, normals: Floats) -> Floats:
        """Return the volumes between triangles and the quadrics with the normals of their corners, (t,).

        Over the middle of a side e between normals m and n the quadric is (n - m) . e / 8 high.
        """
        crosses = self.crosses()
        own = normals[self.triangles]
        own = own * np.where(np.einsum("tkc,tc->tk", own, crosses) < 0.0, -1.0, 1.0)[:, :, None]
        sides = np.roll(self.corners(), -1, axis=1) - self.corners()
        high = np.einsum("tkc,tkc->t", np.roll(own, -1, axis=1) - own, sides) / 8.0
        return np.linalg.norm(crosses, axis=1) * high / 6.0

    def mixed(self) -> float:
        """Return the share of the area whose normals point to the other side than most of their component."""
        along = np.einsum("tc,tc->t", self.crosses(), self._normals)
        total = np.bincount(self.component, np.abs(along))
        return float(np.sum(total - np.abs(np.bincount(self.component, along))) / (2.0 * total.sum()))


class _Caps:
    """Fans of triangles, (e, 3, 3), that close the openings of a mesh, each around the centre of its boundary.

    Openings, (k,), are of components, and `flat` is the signed volume between each fan and the middle.
    """

    def __init__(self, skin: _Skin) -> None:
        count = len(skin.vertices)
        begin, end = _open_edges(skin.edges, count).T
        graph = sparse.coo_array((np.ones(len(begin), dtype=bool), (begin, end)), shape=(count, count))
        label = connected_components(graph, directed=False)[1]
        opening = np.unique(label[begin], return_inverse=True)[1].reshape(-1)
        owner = np.zeros(count, dtype=int)
        owner[skin.triangles] = skin.component[:, None]
        self._count = int(opening.max()) + 1 if len(opening) else 0
        self.component = np.zeros(self._count, dtype=int)
        self.component[opening] = owner[begin]
        self._opening, self._begin, self._end = opening, skin.vertices[begin], skin.vertices[end]
        self._across = _across(skin, begin, end)
        step = np.linalg.norm(self._end - self._begin, axis=1)
        length = np.maximum(self._sums(step), 1e-300)
        self.apex = self._sums(step[:, None] * 0.5 * (self._begin + self._end)) / length[:, None]
        self.triangles = np.stack([self.apex[opening], self._end, self._begin], axis=1)
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        self._crosses = np.cross(b - a, c - a)
        self.component_of_triangles = self.component[opening]
        self.flat = self._sums(np.einsum("ec,ec->e", a, self._crosses) / 6.0)

    def _sums(self, values: Floats) -> Floats:
        """Add up values of edges, (e,) or (e, 3), for each opening."""
        result = np.zeros((self._count, *values.shape[1:]))
        np.add.at(result, self._opening, values)
        return result

    def domes(self, side: Floats) -> tuple[Array, Array]:
        """Return the volume beyond each fan, (k,), and by how much that may be wrong, (k,).

        Sides, (c,), are 1 for components whose faces point outwards, -1 for others.
        """
        vector = 0.5 * self._sums(self._crosses) * side[self.component, None]
        area = 0.5 * self._sums(np.linalg.norm(self._crosses, axis=1))
        radius = np.sqrt(area / np.pi)
        axis = vector / np.maximum(np.linalg.norm(vector, axis=1), 1e-300)[:, None]
        up = axis[self._opening]
        inward = self.apex[self._opening] - 0.5 * (self._begin + self._end)
        inward -= np.einsum("ec,ec->e", inward, up)[:, None] * up
        inward /= np.maximum(np.linalg.norm(inward, axis=1), 1e-300)[:, None]
        step = np.linalg.norm(self._end - self._begin, axis=1)
        rise = self._sums(step * np.einsum("ec,ec->e", self._across, up))
        run = self._sums(step * np.einsum("ec,ec->e", self._across, inward))
        angle = np.clip(np.arctan2(rise, run), -0.5 * np.pi, 0.5 * np.pi)
        high = radius * np.tan(0.5 * angle)
        dome = np.pi * high * (3.0 * radius**2 + high**2) / 6.0
        share = np.cos(angle)
        doubt = np.maximum(share, 1.0 - share) * np.abs(dome) + (_HIDDEN + _TUBE * (1.0 - share)) * area * radius
        return share * dome, doubt


def _open_edges(edges: Ints, count: int) -> Ints:
    """Return the edges that no face passes in the other sense, (e, 2) int."""
    forth = edges[:, 0].astype(np.int64) * count + edges[:, 1]
    back = edges[:, 1].astype(np.int64) * count + edges[:, 0]
    return edges[~np.isin(forth, back)]


def _across(skin: _Skin, begin: Ints, end: Ints) -> Floats:
    """Return unit vectors from open edges on, tangential to the surface, out of it, (e, 3)."""
    normals = np.zeros_like(skin.vertices)
    np.add.at(normals, skin.triangles.ravel(), np.repeat(skin.crosses(), 3, axis=0))
    across = np.cross(skin.vertices[end] - skin.vertices[begin], normals[begin] + normals[end])
    return across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]


def _noise(laplacian: LaplaceBeltrami, surface: ImplicitSurface, count: int) -> Array:
    """Return the root mean square height of the points of each component above the surface, in its units, (c,)."""
    kept = laplacian.component >= 0
    above = surface.heights(surface.scaled(laplacian.points[kept])).height
    component, weight = laplacian.component[kept], laplacian.areas[kept]
    return np.sqrt(np.bincount(component, weight * above**2, count) / np.bincount(component, weight, count))


def _cavities(skin: _Skin, caps: _Caps, count: int) -> Bools:
    """Return which components lie inside an odd number of others, (c,) bool."""
    first = np.full(count, -1)
    first[skin.component[::-1]] = skin.triangles[::-1, 0]
    corners = skin.corners()
    depth = np.zeros(count, dtype=int)
    for outer in range(count):
        own = corners[skin.component == outer]
        if not len(own):
            continue
        low, high = own.min(axis=(0, 1)), own.max(axis=(0, 1))
        places = skin.vertices[first]
        among = (first >= 0) & (places > low).all(axis=1) & (places < high).all(axis=1)
        among[outer] = False
        closed = np.concatenate([own, caps.triangles[caps.component_of_triangles == outer]])
        for inner in np.flatnonzero(among):
            depth[inner] += abs(_winding(closed - places[inner])) > 0.5
    return depth % 2 == 1


def _winding(triangles: Floats) -> float:
    """Return how often triangles, (t, 3, 3), go around the origin, by their solid angles (van Oosterom, Strackee)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    one, other, third = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    above = np.einsum("tc,tc->t", a, np.cross(b, c))
    below = one * other * third + third * np.einsum("tc,tc->t", a, b)
    below += one * np.einsum("tc,tc->t", b, c) + other * np.einsum("tc,tc->t", c, a)
    return float(np.arctan2(above, below).sum() / (2.0 * np.pi))


def _notices(faces: Array, opening: Ints, inside: Bools, mixed: float) -> list[str]:
    """Return texts on what was closed, subtracted or not counted.

    `faces`, (c,), are how many each component has, `opening`, (k,), the component of each opening, and `mixed` the
    share of the area whose normals point to the other side.
    """
    result = []
    if len(opening):
        result.append(
            f"{len(opening)} openings in {len(np.unique(opening))} of {len(faces)} components were closed to measure"
            " the volume; the uncertainty holds a dome, or a tube as long as it is wide, beyond each, and no longer"
            " part that is cut off."
        )
    if inside.any():
        result.append(f"{np.count_nonzero(inside)} of {len(faces)} components lie inside others: they are cavities.")
    if not faces.all():
        result.append(f"{np.count_nonzero(faces == 0)} of {len(faces)} components have too few points for a volume.")
    if mixed > _MIXED:
        result.append(
            f"The normals of {mixed:.0%} of the area point to the other side than those around them. The volume does"
            " not depend on them; orient them for what does."
        )
    return result
