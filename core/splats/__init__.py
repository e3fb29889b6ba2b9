"""Gaussian splats: points with an ellipsoid and a colour that depends on the direction of view, and what bends them."""

from .file import NEEDED, SplatFile, holds_splats, read_splats, write_splats
from .floaters import floaters, floating_rows
from .harmonics import COUNTS
from .splats import Splats
