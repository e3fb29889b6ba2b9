"""Stray points: single ones off the surface, and small parts that float beside it."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import check_points, positive, real, whole
from ..errors import PointCloudError
from ..geometry import (
    PARTS,
    find_nearest,
    label_parts,
    look_across_rows,
    scale_points,
    smooth_rounded,
    stray_scores,
    without,
)
from ..progress import ends_at_one
from ..types import Bools, Floats, Progress

_SPARSE = 2.0  # times the spacing of the cloud: sparser parts must have more points


class Strays:
    """The stray points of a cloud, measured once, for any strictness.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Attributes
    ----------
    scores : ndarray, (n,)
        Above 1 for a stray point: the height over the surface that its neighbors describe, over what counts as on the
        surface there and 4 at most, or its cube where above 1, times the fourth power of the distance of the third
        neighbor over two spacings. It does not change with the scale.
    part_counts : ndarray, (n,) int
        Number of points of the part that holds the point; gaps separate parts. 0 for a point off the surface, which
        no part holds.
    part_areas : ndarray, (n,)
        Area of that part [L^2], by the squared spacings of its points; 0 off the surface.

    Raises
    ------
    PointCloudError
        Points of a wrong shape, not finite, fewer than 13 different ones, or all on one line.

    See Also
    --------
    stray_points : The same in one call.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> strays = mf.clean.Strays(np.concatenate([points, [[0.0, 0.0, 1.5]]]))
    >>> print(np.flatnonzero(strays.chosen()), strays.scores[800] > 2.0, strays.part_counts[0])
    [800] True 800
    """

    @ends_at_one
    def __init__(self, points: ArrayLike, *, progress: Progress | None = None) -> None:
        report = progress or (lambda stage, fraction: None)
        report("Neighbors", 0.0)
        scaled = scale_points(check_points(points))
        nearest = look_across_rows(smooth_rounded(find_nearest(scaled.points)).nearest)
        report("Strays", 0.3)
        scores = stray_scores(nearest, lambda: report("Strays", 0.3))
        report("Parts", 0.9)
        off = scores > 1.0
        counts, areas = np.zeros(len(off), dtype=np.int64), np.zeros(len(off))
        if not off.all():
            kept = without(nearest, off)
            label = label_parts(kept)
            counts[~off] = np.bincount(label, scaled.copies[~off])[label]
            areas[~off] = np.bincount(label, kept.spacing**2)[label] * scaled.scale**2
        self.scores: Floats = scores[scaled.inverse]
        self.part_counts = counts[scaled.inverse]
        self.part_areas: Floats = areas[scaled.inverse]
        self._beside = (self.part_counts > 0) & (self.part_counts < self.part_counts.max())
        sparsity = np.sqrt(self.part_areas / np.maximum(self.part_counts, 1)) / np.median(
            nearest.spacing * scaled.scale
        )
        self._evident = self.part_counts / np.maximum(1.0, sparsity / _SPARSE)

    def chosen(self, strictness: float = 1.0, *, smallest: int = PARTS, smallest_area: float = 0.0) -> Bools:
        """Choose the stray points.

        Parameters
        ----------
        strictness : float
            Above 1 points nearer to the surface are stray, below 1 only those farther away. More strictness never
            chooses fewer.
        smallest : int
            Points of parts with fewer points are stray, but for the part of most points; 0 for no parts. Of parts
            more than twice as sparse as the cloud, which scattered points make by chance, more are asked for.
        smallest_area : float
            Points of parts with less area are stray, too [L^2].

        Returns
        -------
        ndarray, (n,) bool

        Raises
        ------
        PointCloudError
            A strictness that is not above zero, or sizes that are negative.
        """
        positive(strictness, "strictness")
        if not whole(smallest) >= 0:
            raise PointCloudError(
                f"The smallest part has {smallest!r} points. Use a whole number that is not negative."
            )
        if not real(smallest_area) >= 0.0:
            raise PointCloudError(f"The smallest area is {smallest_area!r}. Use a number that is not negative.")
        small = (self._evident < smallest) | (self.part_areas < smallest_area)
        return (self.scores * strictness > 1.0) | (small & self._beside)


@ends_at_one
def stray_points(
    points: ArrayLike,
    *,
    strictness: float = 1.0,
    smallest: int = PARTS,
    smallest_area: float = 0.0,
    progress: Progress | None = None,
) -> Bools:
    """Find stray points: single ones off the surface of their neighbors, and those of small parts beside it.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    strictness : float
        Above 1 points nearer to the surface are stray, below 1 only those farther away. More strictness never chooses
        fewer.
    smallest : int
        Points of parts with fewer points are stray, but for the part of most points; 0 for no parts. Gaps separate
        parts. Of parts more than twice as sparse as the cloud, which scattered points make by chance, more are asked
        for.
    smallest_area : float
        Points of parts with less area are stray, too [L^2].
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,) bool
        Rotating, moving or scaling the points, or their order, makes no difference.

    Raises
    ------
    PointCloudError
        Points of a wrong shape, not finite, fewer than 13 different ones, or all on one line; a strictness that is not
        above zero, or sizes that are negative.

    See Also
    --------
    Strays : Measures once, for any strictness.
    splats.floaters : The same for Gaussian splats.
    build_laplacian : Leaves stray points out by itself.

    Notes
    -----
    Twelve neighbors of a point are its witnesses. Each describes the surface by a quadric through its own neighbors,
    fitted robustly, without points that are sparse against their surroundings. The height of a point is the third
    least over these, in units of 0.4 of its spacing and three standard deviations of the scatter around the witness. A
    point is stray by its height and by its distance from the points on the surface, see `Strays.scores`: points that
    scatter about a rough surface as densely as those around are kept.

    References
    ----------
    Breunig, Kriegel, Ng, Sander. LOF: identifying density-based local outliers. 2000 (spacing against that of the
    neighbors).

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> cloud = np.concatenate([points, 1.4 * points[::100]])
    >>> print(np.flatnonzero(mf.clean.stray_points(cloud)))
    [800 801 802 803 804 805 806 807]
    """
    return Strays(points, progress=progress).chosen(strictness, smallest=smallest, smallest_area=smallest_area)
