"""Surfaces that bend by handles, and that shrink to the least area."""

from .coarse_deformation import CoarseDeformer as CoarseDeformer
from .coarse_deformation import coarse_deformer as coarse_deformer
from .deformation import Deformation as Deformation
from .deformation import Deformer as Deformer
from .gradients import deformation_gradients as deformation_gradients
from .minimal_surface import MinimalSurface as MinimalSurface
from .minimal_surface import minimal_surface as minimal_surface
