"""What the operator is for: filters, segments, fields, distances, deformation, minimal surfaces."""

from .coarse_deformation import CoarseDeformer, coarse_deformer
from .deformation import Deformation, Deformer
from .descriptors import heat_kernel_signature, signature_energies, signature_times, wave_kernel_signature
from .deviation import Deviation, surface_deviation
from .fields import harmonic_field, solve_poisson
from .filters import band, boost, chebyshev_filter, exponential, fairing, spectral_filter
from .geodesics import Geodesics, geodesic_distance, nearest_source, signed_distance
from .gradients import deformation_gradients
from .iso_lines import IsoLine, iso_lines
from .matching import MatchedModes, match_modes
from .meshing import SurfaceMesh, mesh_surface, values_on_mesh
from .minimal_surface import MinimalSurface, minimal_surface
from .segmentation import modes_needed, nodal_domains, segment
from .selection import front_point, grow, opposite_ends
from .slopes import Slopes
from .smoothing import PointBlend, displace_by_mode, fair_points, roughness, smooth_points, smoothing_base
from .transport import Transport, logarithmic_map, transport
