"""What a user would pick instead: every operator of the evaluation behind one form.

``build("pcl", points)`` gives an `Operator`; `METHODS` lists the names. Those that need triangles get them from the
caller: `sphere_triangles` makes the ones of a sphere.
"""

from .meshes import sphere_triangles
from .methods import METHODS, build
from .operator import Modes, Operator

__all__ = ["METHODS", "Modes", "Operator", "build", "sphere_triangles"]
