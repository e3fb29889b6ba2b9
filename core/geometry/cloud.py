"""From coordinates to neighbourhoods: everything that the operator needs to know of a cloud."""

from dataclasses import dataclass

import numpy as np

from ..errors import ComponentError, InvalidPointsError
from ..options import LaplacianOptions
from .bandwidth import depth, smoothing_lengths
from .boundary import FEWEST, Boundary, find_boundary, given_boundary, measure_boundary, no_boundary
from .components import label_components, move_apart
from .distances import roughness
from .nearest import find_nearest
from .noise import LEAST, STRONG, noise_level, project_points
from .normals import covariance_normals, orient_normals, unit_normals
from .pairs import Pairs, find_pairs
from .points import ScaledPoints, as_mask, check_distances, check_points, scale_points
from .quadrics import fit_quadrics
from .sheets import fit_sheets, label_sheets, last_pairs, pairs_on_one_sheet, unsure_orientation

_SAME_BOUNDARY = 0.5  # spacings between the measured and the given distance to a boundary, near a corner
_BOUNDARY_REACH = 20.0  # spacings from a boundary at which no kernel sees it
_NARROW, _MANY = 0.6, 0.1  # h over the depth of the surface that is too wide, and the share of points that tells of it


@dataclass(frozen=True)
class Cloud:
    """What is known of a cloud, in scaled coordinates.

    Attributes
    ----------
    scaled : ScaledPoints
        The m distinct points that take part, and the way back to the caller's.
    label : ndarray, (m,) int
        Component of each point.
    normals : ndarray, (m, 3)
        Unit normals.
    moved : ndarray, (m, 3)
        How far the points were moved to smooth noise.
    mean_curvature, gaussian : ndarray, (m,)
        Mean and Gaussian curvature of local quadrics; the latter is zero where the options do not ask for it.
    spacing : ndarray, (m,)
        Distance between neighbouring points.
    roughness : ndarray, (m,)
        Mean squared slope of what is finer than the normals; zero where it is noise.
    boundary : Boundary
    pairs : Pairs
        Where the operator takes the points to be, smoothing lengths and pairs.
    definite : bool
        The kernel matrix is that of a smooth surface: no noise is in its distances, no pairs within reach were left out
        because they lie on different sheets, and there are no images in a boundary.
    notices : list of str
        What a user should know.
    """

    scaled: ScaledPoints
    label: np.ndarray
    normals: np.ndarray
    moved: np.ndarray
    mean_curvature: np.ndarray
    gaussian: np.ndarray
    spacing: np.ndarray
    roughness: np.ndarray
    boundary: Boundary
    pairs: Pairs
    definite: bool
    notices: list


def read_cloud(points, options, normals=None, boundary=None, boundary_distance=None, progress=None):
    """Go from coordinates to neighbourhoods.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    options : LaplacianOptions
        Settings.
    normals, boundary, boundary_distance, progress
        See `build_laplacian`.

    Returns
    -------
    Cloud

    Raises
    ------
    PointCloudError
        No sound neighbourhoods.
    """
    report = progress or (lambda stage, fraction: None)
    report("Normals", 0.0)
    points = check_points(points)
    scaled = scale_points(points, options.neighbors + 1)
    notices = []
    if scaled.duplicates:
        notices.append(f"Points that lie exactly on another one: {scaled.duplicates}. They share one area.")
    nearest = find_nearest(scaled.points)
    label = label_components(nearest)
    lone = np.count_nonzero(label < 0)
    if lone:
        scaled, label = _leave_out(scaled, label, options)
    if lone or label.max() > 0:
        nearest = find_nearest(move_apart(scaled.points, label))
    surface, nearest = _fit(nearest, options)
    noise = noise_level(nearest.tree, np.median(surface.misfit / nearest.spacing))
    if options.projection == "auto":
        if noise >= LEAST:
            notices.append(f"Noise of {noise:.2f} of the spacing was smoothed within the operator.")
            for _ in range(2 if noise > STRONG else 1):
                nearest = find_nearest(project_points(nearest.points, "quadric", label))
            surface, nearest = _fit(nearest, options)
    elif options.projection != "off":
        surface, nearest = _fit(find_nearest(project_points(nearest.points, options.projection, label)), options)
    moved = nearest.points - move_apart(scaled.points, label)
    if options.sheets:
        sheets = label_sheets(nearest, surface.normals, label)
        off = np.count_nonzero(sheets < 0)
        if off or sheets.max() > label.max():
            lone, moved = lone + off, moved[sheets >= 0]
            scaled, label = _leave_out(scaled, sheets, options)
            surface, nearest = _fit(find_nearest(move_apart(scaled.points, label) + moved), options)
    if lone:
        notices.append(f"Points that lie apart from the rest, left out of the operator: {lone}.")

    own = surface.normals if normals is None else unit_normals(normals, len(points))[scaled.first]
    oriented = orient_normals(nearest, own)
    boundary = _boundary(nearest, oriented, options, scaled, boundary, boundary_distance)

    report("Neighbors", 0.2)
    deepest = depth(nearest, boundary.distance)
    lengths = smoothing_lengths(nearest, options, label, surface.max_abs_curvature, boundary.distance, deepest)
    if np.mean(lengths > _NARROW * deepest) > _MANY:
        notices.append(
            "Part of the surface is so narrow that the kernel reaches several of its sides, so its areas may be"
            " off by 10 % and more. Add points."
        )
    found = find_pairs(nearest.tree, lengths, lambda: report("Neighbors", 0.3))
    pairs = Pairs(nearest.points, lengths, *found)
    if normals is None and options.normals != "quadric":
        own = covariance_normals(pairs, weighted=options.normals == "wpca")
        own = orient_normals(nearest, own) if options.orient else own
    elif normals is None:
        own = oriented
    flipped = np.sign(np.einsum("ij,ij->i", own, surface.normals))
    definite = noise == 0.0 and not np.isfinite(boundary.distance).any()
    report("Neighbors", 0.4)
    if options.sheets:
        same_side = np.sign(np.einsum("ij,ij->i", oriented, surface.normals))
        shape_operator = same_side[:, None, None] * surface.shape_operator
        unsure = unsure_orientation(nearest, oriented)
        same = pairs_on_one_sheet(pairs, oriented, unsure, shape_operator, nearest.spacing)
        if not same.all():
            definite, pairs = False, pairs.keep(same | last_pairs(pairs, same))
    return Cloud(
        scaled=scaled,
        label=label,
        normals=own,
        moved=moved,
        mean_curvature=0.5 * flipped * np.trace(surface.shape_operator, axis1=1, axis2=2),
        gaussian=surface.gaussian if options.curvature_correction else np.zeros(len(own)),
        spacing=nearest.spacing,
        roughness=np.zeros(len(own))
        if noise > 0.0 and options.projection == "auto"
        else roughness(nearest, surface.normals),
        boundary=boundary,
        pairs=pairs,
        definite=definite,
        notices=notices,
    )


def _fit(nearest, options):
    if options.sheets:
        return fit_sheets(nearest)
    return fit_quadrics(nearest.points, nearest.index, nearest.weight), nearest


def _boundary(nearest, normals, options, scaled, boundary, boundary_distance):
    distance = None
    if boundary_distance is not None:
        distance = check_distances(boundary_distance, len(scaled.inverse))[scaled.first] / scaled.scale
        if boundary is None:
            return given_boundary(nearest, normals, distance)
    if boundary is not None:
        at_boundary = as_mask(boundary, len(scaled.inverse))[scaled.first]
        if 0 < np.count_nonzero(at_boundary) < FEWEST:
            raise InvalidPointsError(
                f"The boundary is given by {np.count_nonzero(at_boundary)} different points. Give at least {FEWEST}, or"
                " none."
            )
    elif options.boundary == "auto":
        at_boundary = find_boundary(nearest, normals)
    else:
        return no_boundary(len(normals))
    boundary = measure_boundary(nearest, normals, at_boundary, _BOUNDARY_REACH * nearest.spacing)
    if distance is not None:
        nearer = np.argmin(boundary.distance, axis=1)[:, None]
        measured = np.take_along_axis(boundary.distance, nearer, axis=1)[:, 0]
        # Around a corner that the surface fills, the nearest place is the corner, which mirrors nothing.
        low, high = (measured + side * _SAME_BOUNDARY * nearest.spacing for side in (-1.0, 1.0))
        same = np.isinf(boundary.distance[:, 1]) | ((low < distance) & (distance < high))
        np.put_along_axis(boundary.distance, nearer, np.where(same, distance, measured)[:, None], axis=1)
    return boundary


def _leave_out(scaled, label, options):
    """Leave out the points of no part, or raise if too little is left."""
    out = label < 0
    count, left = np.count_nonzero(out), np.count_nonzero(~out)
    if left < max(options.neighbors + 1, count):
        raise ComponentError(
            f"{count} of {len(label)} points lie apart from each other, in components of too few points. Use points"
            " of a surface, or delete the lone ones."
        )
    return scaled.leave_out(out), label[~out]


def estimate_normals(points, options=LaplacianOptions()):
    """Estimate unit normals from points alone.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    options : LaplacianOptions
        Settings.

    Returns
    -------
    ndarray, (n, 3)
        Unit normals. Those from quadrics agree in sign, outwards on closed surfaces; those from the covariance are of
        arbitrary sign unless ``options.orient``. Points left out get the z axis.

    Raises
    ------
    PointCloudError
        The points have no tangent planes; see `build_laplacian`.

    See Also
    --------
    build_laplacian : The operator, whose ``normals`` these are.
    mean_curvature : How the surface bends.

    Examples
    --------
    On the unit sphere they are the points themselves:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> print(np.abs(core.estimate_normals(points) - points).max().round(2))
    0.0
    """
    cloud = read_cloud(points, options)
    return cloud.scaled.scatter(cloud.normals, (0.0, 0.0, 1.0))
