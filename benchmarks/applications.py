"""What the applications must reach: ``python -m benchmarks.applications [name ...]``, such as fields.geodesic."""

import sys

from . import deformation, fields, plateau, segmentation, smoothing
from .tables import Table, gather, print_rows
from .targets import HEADER

GROUPS = {
    f"{module.__name__.rpartition('.')[2]}.{name}": group
    for module in (smoothing, segmentation, fields, deformation, plateau)
    for name, group in module.GROUPS.items()
}


def applications():
    """Measure all groups."""
    return Table("Targets of the applications", HEADER, gather(GROUPS))


if __name__ == "__main__":
    print_rows(HEADER, GROUPS, sys.argv[1:])
