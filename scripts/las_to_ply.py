"""Convert LAS and LAZ files to PLY with coordinates in double precision, which Blender's Python reads without laspy."""

import argparse
import sys
from pathlib import Path

import laspy
import numpy as np

from core import PointCloudError
from core.files import PointTable, write_points

COLUMNS = ("intensity", "classification", "return_number")  # of every LAS file
PACKED = 100  # bytes of points in one of a LAZ file at most; 5 to 20 are usual
COLORS = ("red", "green", "blue")


def read_las(path) -> PointTable:
    """Read a LAS or LAZ file: coordinates, intensity, class, return, colors and what its maker added.

    Parameters
    ----------
    path : pathlib.Path

    Raises
    ------
    PointCloudError
        It is no such file, or broken, or empty.
    """
    try:
        with laspy.open(path) as reader:
            header, size = reader.header, path.stat().st_size
            held = PACKED * size if header.are_points_compressed else size - header.offset_to_point_data
            if header.point_count * header.point_format.size > held:  # before there is memory for so many
                raise PointCloudError(
                    f"{path} is too short for the {header.point_count:,} points that its header names. Copy it again."
                )
            las = reader.read()
    except PointCloudError:
        raise
    except (laspy.errors.LaspyException, OSError, ValueError) as error:
        raise PointCloudError(f"{path} cannot be read as a LAS or LAZ file: {error}") from error
    if len(las.points) == 0:
        raise PointCloudError(f"{path} has no points.")
    table = PointTable(np.stack([las.x, las.y, las.z], axis=1).astype(np.float64))
    for name in (*COLUMNS, *las.point_format.extra_dimension_names):
        values = np.asarray(las[name])
        if values.ndim == 1 or values.shape[1] == 3:
            table.attributes[name] = values
    if set(COLORS) <= set(las.point_format.dimension_names):
        values = np.stack([las[name] for name in COLORS], axis=1).astype(np.float32)
        full = 255.0 if values.max() <= 255.0 else 65535.0  # some programs use the low byte alone
        table.colors = np.ones((len(values), 4), np.float32)
        table.colors[:, :3] = values / full
    return table


def main():
    """Convert files, each to one beside it that ends in .ply."""
    parser = argparse.ArgumentParser(prog="make convert", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, help=".las and .laz files")
    for path in parser.parse_args().files:
        try:
            table = read_las(path)
            target = path.with_suffix(".ply")
            if target.exists():
                raise PointCloudError(f"{target} exists already. Move or rename it.")
            write_points(target, table)
        except (PointCloudError, OSError) as error:
            sys.exit(str(error))
        print(f"{target}: {len(table.points):,} points, {', '.join(table.attributes)}")


if __name__ == "__main__":
    main()
