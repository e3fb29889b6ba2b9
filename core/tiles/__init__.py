"""A cloud in tiles: cut with halos, surveyed for what all must agree on, and measured one by one as within it."""

from .cut import HALO, Tile, cut
from .measure import Measured, measure_tile
from .survey import survey
