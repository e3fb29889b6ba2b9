"""Every setting of the operator, with defaults that serve scans."""

from dataclasses import dataclass
from numbers import Integral

from .arguments import check_switches, real
from .errors import PointCloudError

_CHOICES = {
    "bandwidth": ("adaptive", "local", "global"),
    "normals": ("quadric", "wpca", "pca"),
    "areas": ("fast", "regularized", "constrained", "uniform"),
    "boundary": ("auto", "off"),
    "projection": ("auto", "off", "quadric", "plane"),
}
_HUGE = 1e60  # whose squares are still numbers
_SWITCHES = "orient", "sheets", "curvature_correction", "symbol_correction"


@dataclass(frozen=True, kw_only=True)
class LaplacianOptions:
    """Settings of `build_laplacian`.

    Parameters
    ----------
    bandwidth : {"adaptive", "local", "global"}
        "adaptive": a smoothing length h per point, as wide as the widest gaps between the points around demand, h_ij
        the mean of both ends. "local": it follows the spacing alone. "global": one for all points, as in the paper.
    neighbors : int
        The smoothing length is measured by the distance to this neighbour; "adaptive" ones change as its square root.
    bandwidth_factor : float
        "local", "global": h in units of the distance to the neighbour named above. "adaptive": factor on the chosen
        length. The kernel reaches 3 h.
    normals : {"quadric", "wpca", "pca"}
        Where no normals are given: from a local quadric, or from the covariance of the neighbourhood, weighted by the
        kernel (eq. 9) or not.
    orient : bool
        Orient normals from the covariance consistently, outwards on closed surfaces, as those from quadrics always are.
    areas : {"fast", "regularized", "constrained", "uniform"}
        "fast": the unit-integral condition (eq. 6) from the points' Voronoi cells, with their area at large.
        "regularized": eq. (7). "constrained": eq. (8). "uniform": the mean of eq. (7) for every point.
    regularization : float
        rho of eqs. (7) and (8), in coordinates scaled to a root mean square radius of one.
    curvature_correction : bool
        Measure distances along the surface, correct areas and weights for its Gaussian curvature and for h that varies,
        and give the weights around every point the moments of the kernel. Without it, eqs. (6) and (10) as they stand:
        distances in space for the areas, in the mean-normal plane for the weights.
    boundary : {"auto", "off"}
        "auto": find where the surface ends, unless the boundary is given, and mirror the points there. "off": take the
        surface as closed.
    sheets : bool
        Keep points of close sheets, such as the two sides of a thin wall, from being neighbours.
    projection : {"auto", "off", "quadric", "plane"}
        Move the points that serve the operator, not the caller's, onto local quadrics: where the measured noise asks
        for it, never, or always; or onto local tangent planes, as the paper does for noisy points.
    symbol_correction : bool
        Correct eigenvalues and `apply` for the known effect of the kernel's width on a flat patch.

    Raises
    ------
    PointCloudError
        A choice that there is not, a number out of range, or a kernel that is too narrow for its neighbours.

    See Also
    --------
    build_laplacian : Takes them.
    LaplacianOptions.paper : The setting of the paper.

    Examples
    --------
    Half the distance to the 100th neighbour as the smoothing length, here about ``2 sqrt(100 / 800) / 2``:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> options = core.LaplacianOptions(bandwidth="local", bandwidth_factor=0.5)
    >>> lengths = core.build_laplacian(points, options=options).smoothing_lengths
    >>> print(lengths.mean().round(2))
    0.35
    >>> core.LaplacianOptions(bandwidth="wide")
    Traceback (most recent call last):
        ...
    core.errors.PointCloudError: Option bandwidth is 'wide'. Choose one of adaptive, local, global.
    """

    bandwidth: str = "adaptive"
    neighbors: int = 100
    bandwidth_factor: float = 1.0
    normals: str = "quadric"
    orient: bool = False
    areas: str = "fast"
    regularization: float = 1e-3
    boundary: str = "auto"
    sheets: bool = True
    projection: str = "auto"
    curvature_correction: bool = True
    symbol_correction: bool = True

    def __post_init__(self):
        for name, choices in _CHOICES.items():
            value = getattr(self, name)
            if not isinstance(value, str) or value not in choices:
                raise PointCloudError(f"Option {name} is {value!r}. Choose one of {', '.join(choices)}.")
        check_switches(**{name: getattr(self, name) for name in _SWITCHES})
        if not isinstance(self.neighbors, Integral) or self.neighbors < 6:
            raise PointCloudError(f"Option neighbors is {self.neighbors!r}. Use a whole number of at least 6.")
        for name in ("bandwidth_factor", "regularization"):
            value = real(getattr(self, name))
            if not 0.0 < value < _HUGE:
                raise PointCloudError(
                    f"Option {name} is {getattr(self, name)!r}. Use a number above zero, below {_HUGE:g}."
                )
            object.__setattr__(self, name, value)
        # About 9 factor^2 neighbors points share a support of 3 h on an even sample; ten keep a plane well determined.
        narrow = 0.3 if self.bandwidth == "adaptive" else 1.0
        if 9.0 * (narrow * self.bandwidth_factor) ** 2 * self.neighbors < 10.0:
            raise PointCloudError(
                f"A bandwidth factor of {self.bandwidth_factor:g} with {self.neighbors} neighbors leaves fewer"
                " than 10 points inside the kernel. Raise one of them."
            )

    @classmethod
    def paper(cls):
        """Return the paper's own setting: global h, WPCA normals, eq. (8) with rho = 1e-3, no corrections.

        Returns
        -------
        LaplacianOptions

        See Also
        --------
        build_laplacian : Takes them.
        check_stability : Measures what Theorem 1 of the paper assumes.

        Examples
        --------
        The total is the area of the unit sphere, 4 pi:

        >>> import numpy as np
        >>> import core
        >>> points = core.example_sphere()
        >>> options = core.LaplacianOptions.paper()
        >>> print(options.bandwidth, options.areas, options.boundary)
        global constrained off
        >>> print(core.estimate_areas(points, options=options).sum().round(2))
        12.57
        """
        return cls(
            bandwidth="global",
            bandwidth_factor=1.0,
            normals="wpca",
            areas="constrained",
            boundary="off",
            sheets=False,
            projection="off",
            curvature_correction=False,
            symbol_correction=False,
        )


def check_options(options):
    """Check that options are `LaplacianOptions`.

    Raises
    ------
    PointCloudError
        They are something else.
    """
    if not isinstance(options, LaplacianOptions):
        raise PointCloudError(f"The options are {options!r}. Use LaplacianOptions(...).")
