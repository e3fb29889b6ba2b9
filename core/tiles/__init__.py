"""A cloud in tiles: cut with halos, surveyed for what all must agree on, and measured one by one as within it."""

from .cut import HALO as HALO
from .cut import halo_of as halo_of
from .cutting import cut_to_store as cut_to_store
from .cutting import points_of_tile as points_of_tile
from .modes import ask_for_modes as ask_for_modes
from .roughness import ROUGHNESS as ROUGHNESS
from .roughness import doubted_wavelength as doubted_wavelength
from .run import pending as pending
from .run import run_steps as run_steps
from .run import settle as settle
from .run import steps_of as steps_of
from .run import visit_tile as visit_tile
from .seen import ORIENTS as ORIENTS
from .store import Store as Store
from .store import tile_folder as tile_folder
from .workers import cores_of_worker as cores_of_worker
from .workers import memory_of_worker as memory_of_worker
