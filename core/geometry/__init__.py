"""Measurements on the points: neighborhoods, components, normals, boundary, pairs; `cloud` runs the stages."""

from .agreed import Agreed, Decisions
from .arcs import arc_length
from .bandwidth import neighbor_distance
from .boundary import Boundary
from .cloud import (
    Cloud,
    Discs,
    Surface,
    divide_components,
    divide_sheets,
    drop_outliers,
    estimate_normals,
    fit_surface,
    gather,
    measure_noise,
    measure_surface,
    read_cloud,
    read_surface,
    remove_noise,
    surface_discs,
    with_scatter,
)
from .components import find_gaps, gap_reach, label_connected, move_apart, number_sizes
from .discs import scatter_radii
from .distances import arc_ahead, arc_squared, circle_arc, dots, pair_heights
from .doubt import Doubt
from .framing import without_far
from .moments import LARGEST, MET, TERMS, EdgeTerms, put_terms
from .nearest import (
    COUNT,
    FEW,
    ON,
    ROUNDS,
    SMOOTH,
    fading_weights,
    find_nearest,
    nearest_rows,
    spacing_of,
    typical_distance,
)
from .noise import FILLING, near_misfit
from .normals import near_edges, side_sums, sides_by_sums, signs_by_sums, unit_normals
from .orientation import orient_normals, toward
from .pairs import Pairs
from .patches import Patch
from .points import FEWEST, as_indices, as_mask, check_values, order_of, scale_points
from .prolongation import Prolongation, balanced_weights
from .quadrics import CURVED, MANY, check_surface, count_curves, frames, lengthened, roundness
from .rounding import find_rounding, smooth_rounded
from .rows import look_across_rows
from .sample import Sample
from .scaled import ScaledPoints
from .sheets import choose_bridges, join_touching, sheet_neighbors
from .strays import PARTS, label_parts, stray_scores, without
from .subset import FINEST, blue_noise_subset, mix_bits
from .thinning import NEIGHBORS, apart, nearest_in_blocks, thin
from .winding import orient_patches
