"""The paper as it stands, equation by equation: its area elements, its normals, its operator, its theorem."""

from .areas import algorithm_1, constrained_areas, regularized_areas
from .normals import covariance_normals
from .operator import build_laplacian, projected_distance, unsymmetrized_operator
from .stability import Stability, check_stability
