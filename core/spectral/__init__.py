"""What the modes of a surface are for: descriptors, matching, segments."""

from .descriptors import heat_kernel_signature as heat_kernel_signature
from .descriptors import signature_energies as signature_energies
from .descriptors import signature_times as signature_times
from .descriptors import wave_kernel_signature as wave_kernel_signature
from .matching import MatchedModes as MatchedModes
from .matching import match_modes as match_modes
from .segmentation import modes_needed as modes_needed
from .segmentation import nodal_domains as nodal_domains
from .segmentation import segment as segment
