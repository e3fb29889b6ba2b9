"""The verb that makes a mesh of a cloud."""

import argparse

import numpy as np

from . import clouds, colors, core
from .cloud_verb import SurfaceVerb, floaters
from .meshing import MESH, close_gaps
from .settings import LAPLACIAN, chosen


class Mesh(SurfaceVerb):
    """The verb `mesh`, whose outputs are files of meshes."""

    name = "mesh"
    help = "reconstruct a mesh from the points, with their columns and colors on its vertices"
    settings = tuple(MESH.values())
    operator = "mesh_surface"

    @property
    def outputs(self):
        """Endings of files."""
        return (*clouds.kinds(), *core.files.MESHES)

    def add_options(self, parser):
        super().add_options(parser)
        if clouds.kinds():
            told = "end the mesh where the points end; otherwise all openings are closed (default on)"
            parser.add_argument("--keep-open", action=argparse.BooleanOptionalAction, default=True, help=told)

    def work(self, path, given, arguments, output, progress):
        cloud = clouds.Cloud(path, given, floaters(arguments))
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        mesh = core.surface.mesh_surface(laplacian, **chosen(self.settings, arguments), progress=progress)
        closed, opened = close_gaps(mesh.faces)
        faces, written = [mesh.faces, closed], []
        for kind in clouds.kinds().values() if opened else ():
            if not arguments.keep_open:
                faces, opened = kind.close(mesh.vertices, faces)
        if output is not None:
            table = _on_vertices(cloud, laplacian, mesh.vertices)
            if clouds.kind_of(output) is not None:
                given.owner.add_mesh(table, faces)
            else:
                written = core.files.write_mesh(output, table, faces, double=not table.single)
        figures = {"vertices": len(mesh.vertices), "faces": sum(map(len, faces)), "open_edges": opened}
        return {"points": len(cloud.points), **figures}, [*laplacian.notices, *mesh.notices, *written]


def _on_vertices(cloud, laplacian, vertices):
    """Return vertices in the coordinates of the file, with the columns and colors of the points."""
    if cloud.splats is not None:
        tint = colors.of_splats(cloud.splats.colors)
    else:
        tint = None if cloud.given.colors is None else colors.linear(cloud.given.colors)
    single = cloud.splats is not None or cloud.given.single
    table = core.files.PointTable(vertices + cloud.place, single=single)
    columns = {**cloud.columns, **{name: np.nan_to_num(weights) for name, weights in cloud.groups.items()}}
    if columns or tint is not None:
        carrying, count = core.surface.values_on_mesh(laplacian, vertices), len(vertices)
        for name, values in columns.items():
            carry = carrying.interpolate if values.dtype.kind == "f" else carrying.labels
            table.attributes[name] = carry(values)[-count:]
        if tint is not None:
            averaged = colors.average(tint, carrying.interpolate)[-count:]
            table.colors = np.clip(colors.srgb(averaged), 0.0, 1.0)
    return table
