"""Cross sections of a surface by a plane, for the command line and for Blender's tool."""

import numpy as np

from . import core
from .settings import place

_CURVES = "curve,closed,x,y,z", ["%d", "%d", "%.17g", "%.17g", "%.17g"]  # columns of a file of corners, and their form
UP = np.array([0.0, 0.0, 1.0])


def add_normal(parser, more=""):
    """Add the option for the normal of a plane, with `more` on it."""
    parser.add_argument("--normal", type=place, metavar="X,Y,Z", help=f"vector across the plane{more}; else upwards")


def add_options(parser, unless=""):
    """Add the options for the normal of the plane, `unless` something else gives it, and for the curves."""
    add_normal(parser, unless)
    parser.add_argument(
        "--curves", action="store_true", help="write the corners of the curves, too, beside the output: _curves.csv"
    )


def middle(points):
    """Return the middle of the bounds of points, (n, 3), where they are cut if nobody says where."""
    return 0.5 * (points.min(axis=0) + points.max(axis=0))


def through_middle(name) -> str:
    """Return the notice that a cloud of some name is cut through its middle."""
    return f"{name} is cut through its middle: no --plane is given."


def cut(laplacian, position, normal, name, progress):
    """Cut the surface of a cloud of some name by a plane; see `cross_section` of core."""
    found = core.measure.cross_section(laplacian, position, normal, progress=progress)
    if not found.curves:
        raise core.PointCloudError(
            f'The plane passes beside the surface of "{name}", or only touches it. Move it to where it cuts.'
        )
    return found


def section_line(found, name, length_text, area_text) -> str:
    """Return how many curves there are, and their size, as a text."""
    count = len(found.curves)
    curves = "1 curve" if count == 1 else f"{count:,} curves"
    return f"{name}: {curves}, {length_text(found.length)} long, enclosed area {area_text(found.enclosed_area)}"


def figures(found) -> dict:
    """Return what the command line prints of a section."""
    return {
        "curves": len(found.curves),
        "open_curves": sum(not curve.closed for curve in found.curves),
        "length": found.length,
        "enclosed_area": found.enclosed_area,
    }


def curve_records(found) -> list:
    """Return the measures of each curve by name, in world lengths; of a hole the area that it takes away."""
    return [
        {
            "curve": number,
            "length": curve.length,
            "enclosed_area": abs(curve.enclosed_area),
            "closed": int(curve.closed),
            "hole": int(curve.enclosed_area < 0.0),
        }
        for number, curve in enumerate(found.curves, 1)
    ]


def corners_path(output):
    """Return the path of the corners of curves beside an output."""
    return output.with_name(f"{output.stem}_curves.csv")


def write_corners(path, curves, origin):
    """Write the corners of curves, which are less an origin, in the coordinates of the file."""
    columns = [
        np.column_stack([np.full((len(curve.points), 2), (number, curve.closed)), curve.points + origin])
        for number, curve in enumerate(curves, 1)
    ]
    with core.files.replacing(path) as part:
        np.savetxt(part, np.concatenate(columns), _CURVES[1], ",", header=_CURVES[0], comments="")
