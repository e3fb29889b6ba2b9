"""The methods by name, and the clock around their construction."""

import importlib
import time
from dataclasses import dataclass, replace

import numpy as np

import core

from .clouds import gmls2, pcl
from .meshes import cotangent, levy, robust, tufted
from .operator import Operator, Ours


def ours(points, **settings):
    """This project, with its default settings or others."""
    return _ours(core.build_laplacian(points, **settings))


def ours_paper(points, **settings):
    """The paper's operator as this project has it."""
    return _ours(core.paper.build_laplacian(points, **settings))


def _ours(laplacian):
    return Ours(laplacian.points, laplacian.stiffness, laplacian.areas, laplacian.areas, laplacian=laplacian)


@dataclass(frozen=True)
class Method:
    """A way to an operator.

    Attributes
    ----------
    label : str
        For tables and plots.
    function : callable
        Gives the operator of points (n, 3), and of their triangles (m, 3) where `mesh` says so.
    mesh : bool
        It is given the true triangles.
    packages : tuple of str
        What it imports beyond the project's own.
    """

    label: str
    function: callable
    mesh: bool = False
    packages: tuple = ()


METHODS = {
    "ours": Method("this project", ours),
    "ours_paper": Method("this project, paper's settings", ours_paper),
    "cotangent": Method("cotangent on the true mesh, 1/3 areas", cotangent, mesh=True),
    "levy": Method("symmetric cotangent (Levy) on the true mesh", levy, mesh=True),
    "pcl": Method("PCL (Luo et al.)", pcl),
    "robust": Method("robust_laplacian, point_cloud_laplacian", robust, packages=("robust_laplacian",)),
    "tufted": Method("tufted on potpourri3d's triangles", tufted, packages=("robust_laplacian", "potpourri3d")),
    "gmls2": Method("GMLS of degree 2", gmls2),
}


def build(name, points, triangles=None, **settings) -> Operator:
    """Build an operator by name and take the time.

    Parameters
    ----------
    name : str
        A key of `METHODS`.
    points : ndarray, (n, 3)
    triangles : ndarray, (m, 3), optional
        The true mesh, for the methods that need one; the others never see it.
    **settings
        Of the method: those of `core.build_laplacian` and `core.paper.build_laplacian`, ``time_factor`` of pcl,
        ``neighbors`` of robust.
    """
    method = METHODS[name]
    if method.mesh and triangles is None:
        raise ValueError(f"{name} needs the triangles of the true mesh")
    for package in method.packages:
        importlib.import_module(package)  # not within the time
    points = np.ascontiguousarray(points, dtype=np.float64)
    given = (points, triangles) if method.mesh else (points,)
    began = time.perf_counter()
    operator = method.function(*given, **settings)
    return replace(operator, name=name, seconds=time.perf_counter() - began)
