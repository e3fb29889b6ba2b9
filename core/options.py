"""Every setting of the operator, with defaults that serve scans."""

from dataclasses import dataclass
from numbers import Integral
from typing import Any

from .arguments import check_switches, real
from .errors import PointCloudError

_CHOICES = {
    "bandwidth": ("adaptive", "local", "global"),
    "boundary": ("auto", "off"),
    "projection": ("auto", "off", "quadric"),
}
_HUGE = 1e60  # whose squares do not overflow
_PAPER_CHOICES = {
    "areas": ("constrained", "regularized", "uniform"),
    "normals": ("wpca", "pca"),
}


@dataclass(frozen=True, kw_only=True)
class LaplacianOptions:
    """Settings of `build_laplacian`.

    Parameters
    ----------
    bandwidth : {"adaptive", "local", "global"}
        "adaptive": a smoothing length h per point, chosen by the widest gaps between the points around, h_ij
        the mean of both ends. "local": it follows the spacing alone. "global": one for all points.
    neighbors : int
        "local", "global": the smoothing length is measured by the distance to this neighbor. Where a component has no
        more points than that it is extrapolated from the last one.
    bandwidth_factor : float
        "local", "global": h in units of the distance to the neighbor named above. "adaptive": factor on
        the narrowest length, which is wider where the points ask for it. The radius of the kernel is 3 h.
    boundary : {"auto", "off"}
        "auto": detect the boundary, unless it is given, and mirror the points there. "off": take the surface as closed.
    sheets : bool
        Keep points of close sheets, such as the two sides of a thin wall, from being neighbors.
    projection : {"auto", "off", "quadric"}
        Move the points that serve the operator, not the caller's, onto local quadrics: where the measured noise asks
        for it, never, or always.

    Raises
    ------
    PointCloudError
        An unknown choice, a number out of range, or a kernel that is too narrow for its neighbors.

    See Also
    --------
    build_laplacian : Takes them.
    paper.build_laplacian : The paper's own operator, which takes none of them.

    Examples
    --------
    Half the distance to the 100th neighbor as the smoothing length, here about ``2 sqrt(100 / 800) / 2``:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> options = mf.LaplacianOptions(bandwidth="local", bandwidth_factor=0.5)
    >>> lengths = mf.build_laplacian(points, options=options).smoothing_lengths
    >>> print(lengths.mean().round(2))
    0.35
    >>> mf.LaplacianOptions(bandwidth="wide")
    Traceback (most recent call last):
        ...
    meshfree_laplacian.errors.PointCloudError: Option bandwidth is 'wide'. Choose one of adaptive, local, global.
    """

    bandwidth: str = "adaptive"
    neighbors: int = 100
    bandwidth_factor: float = 1.0
    boundary: str = "auto"
    sheets: bool = True
    projection: str = "auto"

    def __post_init__(self) -> None:
        _check_choices(self, _CHOICES)
        check_switches(sheets=self.sheets)
        _check_neighbors(self)
        _make_positive(self, "bandwidth_factor")
        # So many points share a support of 3 h on an even sample; ten keep a plane well determined.
        inside = self.bandwidth_factor**2 * (13.0 if self.bandwidth == "adaptive" else 9.0 * self.neighbors)
        if inside < 10.0:
            raise PointCloudError(
                f"A bandwidth factor of {self.bandwidth_factor:g} leaves fewer than 10 points inside the kernel."
                " Raise it."
            )


@dataclass(frozen=True, kw_only=True)
class PaperOptions:
    """Settings of `paper.build_laplacian`, which names and explains them.

    Raises
    ------
    PointCloudError
        An unknown choice, or a number out of range.
    """

    areas: str = "constrained"
    normals: str = "wpca"
    regularization: float = 1e-3
    neighbors: int = 100
    denoise: bool = False

    def __post_init__(self) -> None:
        _check_choices(self, _PAPER_CHOICES)
        check_switches(denoise=self.denoise)
        _check_neighbors(self)
        _make_positive(self, "regularization")

    @property
    def cloud(self) -> LaplacianOptions:
        """One h, the mean distance to that neighbor, without boundary, separation of sheets, or denoising."""
        return LaplacianOptions(
            bandwidth="global", neighbors=self.neighbors, boundary="off", sheets=False, projection="off"
        )


def _check_choices(options: LaplacianOptions | PaperOptions, known: dict[str, tuple[str, ...]]) -> None:
    for name, choices in known.items():
        value = getattr(options, name)
        if not isinstance(value, str) or value not in choices:
            raise PointCloudError(f"Option {name} is {value!r}. Choose one of {', '.join(choices)}.")


def _check_neighbors(options: LaplacianOptions | PaperOptions) -> None:
    if not isinstance(options.neighbors, Integral) or options.neighbors < 6:
        raise PointCloudError(f"Option neighbors is {options.neighbors!r}. Use a whole number of at least 6.")


def _make_positive(options: LaplacianOptions | PaperOptions, name: str) -> None:
    value = real(getattr(options, name))
    if not 0.0 < value < _HUGE:
        raise PointCloudError(f"Option {name} is {getattr(options, name)!r}. Use a number above zero, below {_HUGE:g}.")
    object.__setattr__(options, name, value)


def check_options(options: Any) -> None:
    """Check that options are `LaplacianOptions`; something else raises `PointCloudError`."""
    if not isinstance(options, LaplacianOptions):
        raise PointCloudError(f"The options are {options!r}. Use LaplacianOptions(...).")
