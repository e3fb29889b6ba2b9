"""Fewer, smoother and better points."""

from ..geometry import Prolongation as Prolongation
from ..geometry import blue_noise_subset as blue_noise_subset
from .cleaning import clean_points as clean_points
from .filters import band as band
from .filters import boost as boost
from .filters import chebyshev_filter as chebyshev_filter
from .filters import exponential as exponential
from .filters import fairing as fairing
from .filters import spectral_filter as spectral_filter
from .smoothing import DETAIL as DETAIL
from .smoothing import PointBlend as PointBlend
from .smoothing import displace_by_mode as displace_by_mode
from .smoothing import fair_points as fair_points
from .smoothing import roughness as roughness
from .smoothing import smooth_points as smooth_points
from .smoothing import smoothing_base as smoothing_base
from .strays import Strays as Strays
from .strays import stray_points as stray_points
from .thin_out import thin_out as thin_out
from .thin_pieces import thin_pieces as thin_pieces
