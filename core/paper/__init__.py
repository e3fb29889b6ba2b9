"""The paper as it stands, equation by equation: its area elements, its normals, its operator, its theorem."""

from .areas import constrained_areas as constrained_areas
from .areas import regularized_areas as regularized_areas
from .normals import covariance_normals as covariance_normals
from .operator import build_laplacian as build_laplacian
from .operator import projected_distance as projected_distance
from .stability import Stability as Stability
from .stability import check_stability as check_stability
