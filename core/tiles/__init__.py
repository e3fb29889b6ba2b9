"""A cloud in tiles: cut with halos, surveyed for what all must agree on, and measured one by one as within it."""

from .cut import HALO, Tile, cut, halo_of
from .cutting import cut_to_store, points_of_tile
from .measure import Measured, measure_tile
from .modes import ask_for_modes
from .roughness import ROUGHNESS, doubted_wavelength
from .run import pending, run_steps, settle, steps_of, visit_tile
from .seen import ORIENTS
from .store import Store, tile_folder
from .survey import survey
from .workers import cores_of_worker, memory_of_worker
