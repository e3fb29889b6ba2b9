"""Gaussian splats: points with an ellipsoid and a view-dependent colour, their files, and their deformation."""

from .columns import LENGTHS, NEEDED
from .file import SplatFile, encoded, holds_splats, read_file, read_splats, write_splats
from .floaters import floaters, floating_rows
from .harmonics import CONSTANT, COUNTS
from .joining import joined
from .splats import Splats
