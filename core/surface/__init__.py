"""Meshes of points."""

from .meshing import SurfaceMesh as SurfaceMesh
from .meshing import mesh_surface as mesh_surface
from .meshing import values_on_mesh as values_on_mesh
