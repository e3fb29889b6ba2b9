"""The paper to the letter, for comparison: its area elements, which become options, its operator, its theorem."""

from .areas import algorithm_1, constrained_areas, regularized_areas  # which makes them choices of the operator
from .operator import unsymmetrized_operator
from .stability import Stability, check_stability
