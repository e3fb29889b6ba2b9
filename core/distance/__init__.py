"""Distances, paths and directions along a surface, and functions between given values."""

from .falloff import falloff as falloff
from .fields import harmonic_field as harmonic_field
from .fields import solve_poisson as solve_poisson
from .geodesics import geodesic_distance as geodesic_distance
from .geodesics import nearest_source as nearest_source
from .geodesics import signed_distance as signed_distance
from .paths import geodesic_path as geodesic_path
from .paths import polygon_length as polygon_length
from .selection import front_point as front_point
from .selection import grow as grow
from .selection import opposite_ends as opposite_ends
from .transport import logarithmic_map as logarithmic_map
from .transport import transport as transport
from .visibility import seen_points as seen_points
