"""The namespaces of core, and what everyone needs: `core/__init__.py` imports them as they are asked for."""

from . import clean as clean
from . import deform as deform
from . import distance as distance
from . import files as files
from . import measure as measure
from . import motion as motion
from . import paper as paper
from . import rig as rig
from . import spectral as spectral
from . import splats as splats
from . import surface as surface
from . import tiles as tiles
from .arguments import check_points as check_points
from .errors import AreaError as AreaError
from .errors import BrokenLibraryError as BrokenLibraryError
from .errors import Cancelled as Cancelled
from .errors import ComponentError as ComponentError
from .errors import InvalidPointsError as InvalidPointsError
from .errors import NotASurfaceError as NotASurfaceError
from .errors import NotEnoughMemoryError as NotEnoughMemoryError
from .errors import PointCloudError as PointCloudError
from .errors import SolverError as SolverError
from .errors import TooFewPointsError as TooFewPointsError
from .errors import UnresolvedModesError as UnresolvedModesError
from .example import example_sphere as example_sphere
from .geometry import Agreed as Agreed
from .geometry import Doubt as Doubt
from .geometry import estimate_normals as estimate_normals
from .geometry import orient_normals as orient_normals
from .memory import check_room as check_room
from .memory import points_that_fit as points_that_fit
from .operator import LaplaceBeltrami as LaplaceBeltrami
from .operator import Spectrum as Spectrum
from .operator import build_laplacian as build_laplacian
from .operator import divergence_matrix as divergence_matrix
from .operator import estimate_areas as estimate_areas
from .operator import gradient_matrix as gradient_matrix
from .options import LaplacianOptions as LaplacianOptions
from .options import PaperOptions as PaperOptions
from .saving import load as load
from .saving import save as save

__version__: str
