"""The table of results at the points, a row each: results are written, transferred, exported and shown by it.

To add a result, add a row. Nothing here needs Blender.
"""

from operator import attrgetter
from typing import Any, NamedTuple

PREFIX = "lb_"  # of the names of attributes of this extension
COMPARED = "lb_compared"  # where there is a deviation from another cloud
ORIENTATION = "lb_orientation"  # vectors that orient the normals, where a user chose a side
AREA, NORMAL = "lb_area", "lb_normal"
MEAN_CURVATURE, GAUSSIAN_CURVATURE = "lb_mean_curvature", "lb_gaussian_curvature"
BOUNDARY, COMPONENT = "lb_boundary", "lb_component"
TRUST, DOUBT = "lb_trust", "lb_doubt"
SEGMENT = "lb_segment"
STRAY = "lb_stray"
SHAPE_INDEX, CURVEDNESS = "lb_shape_index", "lb_curvedness"
CURVATURE_1, CURVATURE_2, DIRECTION_1 = "lb_curvature_1", "lb_curvature_2", "lb_direction_1"
ROUGHNESS, SURFACE_VARIATION = "lb_roughness", "lb_surface_variation"
FIELD = "lb_field"
DISTANCE, SIGNED_DISTANCE, DEVIATION = "lb_distance", "lb_signed_distance", "lb_deviation"
RESIDUAL = "lb_residual"
WEIGHT = "lb_weight"
CELL, DIRECTION, UV = "lb_cell", "lb_direction", "lb_uv"
DISPLACEMENT = "lb_displacement"
MOTION, MOTION_MODE = "lb_motion", "lb_motion_"
TRANSFER = "lb_transfer"
EIGENVECTOR = "lb_eigenvector_"
EIGENVALUES = "lb_eigenvalues"  # which are not at the points
HEAT_SIGNATURE, WAVE_SIGNATURE = "lb_heat_signature_", "lb_wave_signature_"


class Quantity(NamedTuple):
    """A result at the points.

    Attributes
    ----------
    attribute : str
        Name of the attribute that holds it; for a numbered one, what comes before the number.
    label, tooltip : str
        Title, and description in the words of the manual.
    tool : str
        Name of the operator that writes it.
    source : str
        Its path in the result of the tool, which is `Built` for the analysis; empty for the result itself.
    data_type : str
        As Blender names it.
    power : int
        Its physical dimension, as a power of length.
    carried : {"smooth", "label", "share", "normal"}
        How it is transferred to other points: by interpolation, from the nearest point, divided among the points
        nearest to one, or interpolated as a unit vector. Principal directions, which have no sign, from the nearest.
    left_out : float, optional
        Value of points that are left out.
    bounds : tuple of float, optional
        Least and greatest possible value.
    color_range : {"", "symmetric", "positive"}
        Range of the colors: by the values, symmetric about zero, or from zero, where negative numbers mark points
        without a value.
    along_surface : bool
        Whether it is a vector in the tangent plane.
    numbered : bool
        Whether there are several, with numbers of three digits; written without a unit, since they are compared.
    names : tuple of str
        What its whole numbers from zero stand for; empty where they are numbers.
    """

    attribute: str
    label: str
    tooltip: str
    tool: str
    source: str = ""
    data_type: str = "FLOAT"
    power: int = 0
    carried: str = "smooth"
    left_out: float | None = None
    bounds: tuple[float, float] | None = None
    color_range: str = ""
    along_surface: bool = False
    numbered: bool = False
    names: tuple[str, ...] = ()

    def of(self, found: Any) -> Any:
        """Return its values from the result of the tool."""
        return attrgetter(self.source)(found)

    @property
    def is_direction(self) -> bool:
        """Whether it is a unit vector in space, such as a normal."""
        return self.carried == "normal" or self.along_surface


QUANTITIES = (  # in the order of the panel
    Quantity(
        AREA,
        "Area",
        "Area of the surface element of each point",
        "analyze",
        "laplacian.areas",
        power=2,
        carried="share",
    ),
    Quantity(
        NORMAL,
        "Normal",
        "Unit normal in local space, outwards where the points enclose a volume",
        "analyze",
        "laplacian.normals",
        "FLOAT_VECTOR",
        carried="normal",
    ),
    Quantity(
        MEAN_CURVATURE,
        "Mean Curvature",
        "Half the sum of the principal curvatures",
        "analyze",
        "mean_curvature",
        power=-1,
    ),
    Quantity(
        GAUSSIAN_CURVATURE,
        "Gaussian Curvature",
        "Product of the principal curvatures",
        "analyze",
        "laplacian.gaussian_curvature",
        power=-2,
    ),
    Quantity(
        BOUNDARY,
        "Boundary",
        "True for points on the boundary of the surface",
        "analyze",
        "laplacian.boundary",
        "BOOLEAN",
        carried="label",
    ),
    Quantity(
        COMPONENT,
        "Component",
        "Number of the point's component, the largest 0; -1 for points left out",
        "analyze",
        "laplacian.component",
        "INT",
        carried="label",
        left_out=-1,
    ),
    Quantity(
        TRUST,
        "Trust",
        "Reliability of the results at the point, 0 to 1",
        "analyze",
        "laplacian.trust",
        left_out=0.0,
        bounds=(0.0, 1.0),
    ),
    Quantity(
        DOUBT,
        "Doubt",
        "Why the results are in doubt where trust is below 0.5",
        "analyze",
        "laplacian.doubt",
        "INT",
        carried="label",
        left_out=6,
        # As in `core.Doubt`.
        names=("Trusted", "Too Few", "Volume", "Noise", "Rows", "Sheets", "Left Out"),
    ),
    Quantity(
        STRAY,
        "Stray Points",
        "True for points off the surface, and for those of small parts beside it",
        "stray_points",
        data_type="BOOLEAN",
        carried="label",
    ),
    Quantity(SEGMENT, "Segment", "Number of the part", "segment", data_type="INT", carried="label"),
    Quantity(
        SHAPE_INDEX,
        "Shape Index",
        "1 a cap, 0.5 a ridge, 0 a saddle, -0.5 a valley, -1 a cup",
        "principal_curvatures",
        "shape_index",
    ),
    Quantity(
        CURVEDNESS,
        "Curvedness",
        "Root mean square of both principal curvatures",
        "principal_curvatures",
        "curvedness",
        power=-1,
    ),
    Quantity(
        CURVATURE_1,
        "Curvature 1",
        "Greatest principal curvature",
        "principal_curvatures",
        "first",
        power=-1,
    ),
    Quantity(
        CURVATURE_2,
        "Curvature 2",
        "Least principal curvature",
        "principal_curvatures",
        "second",
        power=-1,
    ),
    Quantity(
        DIRECTION_1,
        "Direction 1",
        "Direction of the greatest curvature",
        "principal_curvatures",
        "direction",
        "FLOAT_VECTOR",
        carried="label",
        along_surface=True,
    ),
    Quantity(ROUGHNESS, "Roughness", "Signed height of each point above the smoothed surface", "roughness", power=1),
    Quantity(
        SURFACE_VARIATION,
        "Surface Variation",
        "Smallest eigenvalue of the covariance of the neighborhood over the sum of all three",
        "surface_variation",
        bounds=(0.0, 1.0 / 3.0),
    ),
    Quantity(FIELD, "Field", "The smoothest field between given values", "harmonic_field"),
    Quantity(
        WEIGHT,
        "Weight",
        "Weight in the group that Weights from Selection wrote last",
        "weights_from_selection",
        bounds=(0.0, 1.0),
    ),
    Quantity(
        DISTANCE,
        "Distance",
        "Geodesic distance, along the surface, to the nearest of the given points",
        "geodesic_distance",
        power=1,
        color_range="positive",
    ),
    Quantity(
        SIGNED_DISTANCE,
        "Signed Distance",
        "Geodesic distance from a curve on the surface, with the side as its sign",
        "signed_distance",
        power=1,
        color_range="symmetric",
    ),
    Quantity(
        DEVIATION,
        "Deviation",
        "Distance of each point of a cloud from the surface of another one, signed along its normal, or to the nearest"
        " place",
        "compare",
        power=1,
        color_range="symmetric",
    ),
    Quantity(
        RESIDUAL,
        "Residual",
        "Distance of each point of an aligned cloud from the surface of the other one",
        "align_points",
        power=1,
        color_range="positive",
    ),
    Quantity(CELL, "Cell", "Number of the nearest source", "nearest_source", data_type="INT", carried="label"),
    Quantity(
        DIRECTION,
        "Direction",
        "Unit vector along the surface",
        "extend_direction",
        data_type="FLOAT_VECTOR",
        along_surface=True,
    ),
    Quantity(
        UV, "UV", "Texture coordinates: 0.5, 0.5 at the center, 0 and 1 at the borders", "unwrap", data_type="FLOAT2"
    ),
    Quantity(
        DISPLACEMENT,
        "Displacement",
        "Displacement of each point",
        "deform_bind",
        data_type="FLOAT_VECTOR",
        power=1,
    ),
    Quantity(MOTION, "Motion", "Heat, wave, reaction or front at the frame on show", "simulate"),
    Quantity(MOTION_MODE, "Motion Mode", "What a mode adds to the motion at its begin", "simulate", numbered=True),
    Quantity(
        TRANSFER,
        "Transfer",
        "Whether the point takes its values from the surface of a source, or has them filled in from around",
        "transfer_weights",
        data_type="INT",
        carried="label",
        names=("Filled In", "Taken", "Far"),
    ),
    Quantity(EIGENVECTOR, "Mode", "Vibration mode of the surface", "spectrum", power=-1, numbered=True),
    Quantity(
        HEAT_SIGNATURE, "Heat Signature", "Heat that is left after some time", "signature", power=-2, numbered=True
    ),
    Quantity(WAVE_SIGNATURE, "Wave Signature", "Waves of one energy", "signature", power=-2, numbered=True),
)
_BY_NAME = {row.attribute: row for row in QUANTITIES}
_NO_RESULT = Quantity("", "", "", "")


def quantity(name: str) -> Quantity:
    """Return the row of the result that an attribute holds; a row of empty texts if it holds none."""
    known = _BY_NAME.get(name)
    if known is not None:
        return known
    several = _BY_NAME.get(name.rstrip("0123456789"), _NO_RESULT)
    return several if several.numbered else _NO_RESULT


def rows_of(tool: str) -> tuple[Quantity, ...]:
    """Return the rows of the results of a tool, by the name of its operator."""
    return tuple(row for row in QUANTITIES if row.tool == tool)


def written_by(tool: str) -> tuple[str, ...]:
    """Return the names of the attributes that a tool writes."""
    return tuple(row.attribute for row in rows_of(tool))


def eigenvector_name(mode: int) -> str:
    """Return the name of the attribute that holds a mode; modes are counted from 1."""
    return f"{EIGENVECTOR}{mode:03d}"


RESULTS = written_by("analyze")  # first in the list of results
APPLICATIONS = tuple(row.attribute for row in QUANTITIES if row.tool != "analyze" and not row.numbered)
