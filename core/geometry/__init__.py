"""What the points tell: neighbourhoods, components, normals, boundary, bandwidth and pairs; `cloud` runs the stages."""

from .boundary import FEWEST
from .cloud import estimate_normals, read_cloud
from .components import SMALLEST
from .distances import arc_length, projected_distance
from .nearest import find_nearest
from .points import as_indices, as_mask, check_points, check_values
from .quadrics import frames

__all__ = [
    "FEWEST",
    "SMALLEST",
    "arc_length",
    "as_indices",
    "as_mask",
    "check_points",
    "check_values",
    "estimate_normals",
    "find_nearest",
    "frames",
    "projected_distance",
    "read_cloud",
]
