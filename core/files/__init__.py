"""Point files to arrays in double precision and back, usable outside Blender: numpy only, and laspy for LAS and LAZ."""

from .digits import Digits, join_digits, split_digits
from .formats import (
    READABLE,
    SCANS,
    SPLATS,
    TEXTS,
    WRITABLE,
    doubts,
    precision_notices,
    read_points,
    reading,
    write_pieces,
    write_points,
)
from .frames import frame_number, numbered_files, order_frames
from .las_choices import LasChoices, parse_classes
from .las_form import LasForm, join_forms
from .lines import brief
from .mesh import MESHES, write_mesh
from .notices import join_notices
from .origin import choose_origin, is_coarse
from .pieces import Chunks, Extent, chunks, extent, has_levels, join_pieces
from .ply import PlyVertices, read_elements, read_vertex_columns, read_vertex_names, write_vertex_columns
from .rows import unpacks_too_far
from .table import CHANNELS, FARTHEST, SCANNER, PointTable, check_places, full_color, split_columns, unit_colors
from .whole import replacing
