"""Point files to arrays in double precision and back, usable outside Blender: numpy only, and laspy for LAS and LAZ."""

from .formats import READABLE, WRITABLE, read_points, write_points
from .frames import numbered_files, order_frames
from .origin import choose_origin, is_coarse
from .table import PointTable
from .whole import replacing
