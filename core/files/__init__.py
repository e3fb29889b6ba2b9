"""Point files to arrays in double precision and back, usable outside Blender: numpy only, and laspy for LAS and LAZ."""

from .digits import Digits, join_digits, split_digits
from .formats import READABLE, SCANS, TEXTS, WRITABLE, read_points, reading, write_points
from .frames import frame_number, numbered_files, order_frames
from .las_choices import LasChoices, parse_classes
from .mesh import MESHES, write_mesh
from .origin import choose_origin, is_coarse
from .ply import PlyVertices, read_vertex_columns, read_vertex_names, write_vertex_columns
from .table import PointTable, check_places
from .whole import replacing
