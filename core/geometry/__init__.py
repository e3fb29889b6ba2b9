"""Measurements on the points: neighbourhoods, components, normals, boundary, pairs; `cloud` runs the stages."""

from .agreed import Agreed
from .boundary import Boundary
from .cloud import Cloud, Discs, estimate_normals, read_cloud, read_surface, surface_discs
from .components import move_apart
from .distances import arc_length, arc_squared, circle_arc, dots, pair_heights
from .doubt import Doubt
from .moments import LARGEST, MET, TERMS, EdgeTerms, put_terms
from .nearest import COUNT, ON, ROUNDS, SMOOTH, fading_weights, find_nearest, nearest_rows, typical_distance
from .normals import unit_normals
from .orientation import orient_normals, toward
from .pairs import Pairs, find_pairs
from .patches import Patch
from .points import FEWEST, ScaledPoints, as_indices, as_mask, check_points, check_values, scale_points
from .prolongation import Prolongation, balanced_weights
from .quadrics import CURVED, check_surface, frames, roundness
from .rows import look_across_rows
from .sheets import same_sheet
from .strays import PARTS, label_parts, stray_scores, without
from .subset import blue_noise_subset, independent
from .thinning import nearest_in_blocks, thin
