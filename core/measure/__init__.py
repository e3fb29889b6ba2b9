"""Areas, lengths, volumes, sections and slopes of a surface."""

from .alignment import Alignment as Alignment
from .alignment import align as align
from .alignment import match_places as match_places
from .deviation import Deviation as Deviation
from .deviation import outer_sides as outer_sides
from .deviation import sides_beside as sides_beside
from .deviation import surface_deviation as surface_deviation
from .iso_lines import IsoLine as IsoLine
from .iso_lines import iso_lines as iso_lines
from .parts import Parts as Parts
from .parts import measure_parts as measure_parts
from .parts import part_means as part_means
from .piles import Pile as Pile
from .piles import pile_volume as pile_volume
from .profile import Profile as Profile
from .profile import profile as profile
from .regions import Region as Region
from .regions import SurfaceMeasures as SurfaceMeasures
from .regions import measure_region as measure_region
from .sections import CrossSection as CrossSection
from .sections import SectionCurve as SectionCurve
from .sections import cross_section as cross_section
from .slopes import Slopes as Slopes
from .variation import surface_variation as surface_variation
from .volume import EnclosedVolume as EnclosedVolume
from .volume import enclosed_volume as enclosed_volume
