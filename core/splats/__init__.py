"""Gaussian splats: points with an ellipsoid and a view-dependent colour, their files, and their deformation."""

from .columns import LENGTHS as LENGTHS
from .columns import NEEDED as NEEDED
from .columns import SplatFile as SplatFile
from .file import encoded as encoded
from .file import from_columns as from_columns
from .file import holds_splats as holds_splats
from .file import read_file as read_file
from .file import read_splats as read_splats
from .file import write_splats as write_splats
from .floaters import floaters as floaters
from .floaters import floating_rows as floating_rows
from .harmonics import CONSTANT as CONSTANT
from .harmonics import COUNTS as COUNTS
from .joining import joined as joined
from .layouts import hold_enough as hold_enough
from .splats import Splats as Splats
