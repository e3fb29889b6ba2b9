"""Meshes of points, and discs that cover their surface."""

from ..geometry import Discs as Discs
from ..geometry import surface_discs as surface_discs
from .meshing import SurfaceMesh as SurfaceMesh
from .meshing import mesh_surface as mesh_surface
from .meshing import values_on_mesh as values_on_mesh
