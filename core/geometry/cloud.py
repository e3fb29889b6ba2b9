"""From coordinates to pairs, in stages, each a function from one typed value to the next."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..algebra import workers
from ..arguments import check_points
from ..errors import ComponentError, TooFewPointsError
from ..frozen import Frozen
from ..options import LaplacianOptions, check_options
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress, Report
from .agreed import Agreed, Decisions
from .bandwidth import depth, mean_gaps, smoothing_lengths
from .boundary import Boundary, find_boundary, given_boundary, measure_boundary, no_boundary
from .cells import Cells, measure_cells
from .components import gap_reach, label_components, move_apart
from .discs import disc_radii, scatter_radii
from .distances import measure_squared_slope
from .doubt import likely_causes
from .edges import Sides, find_sides, one_side
from .nearest import find_nearest
from .noise import FALLING, FILLING, LEFT, mean_misfits, misfits, near_misfit, noise_level, project_points
from .normals import unit_normals
from .outliers import find_outliers
from .pairs import Pairs, find_pairs
from .points import (
    FEWEST_OF_SURFACE,
    as_mask,
    check_boundary,
    check_distances,
    scale_points,
)
from .quadrics import MANY, Quadrics, check_surface, count_curves, frames
from .rounding import smooth_rounded
from .rows import look_across_rows
from .sample import Sample
from .scaled import ScaledPoints
from .sheets import Sheets, fit_sheets, label_sheets, separate_sheets
from .voids import find_voids, no_voids
from .winding import orient_by_winding

_SAMPLE = 5000  # points that fill volumes, about, whose median misfit is that of all
_DRAWN = 20  # points that a surface needs at least, to be drawn
_NARROW = 0.6  # h over the depth of a narrow surface, see `depth`, from which the kernel is too wide for it


@dataclass(frozen=True)
class Surface:
    """A sample, and a quadric through the neighbors of each point on its own sheet; others weigh nothing there.

    `sheets` is how these were separated; None where close sheets are not kept apart.
    """

    sample: Sample
    quadrics: Quadrics
    sheets: Sheets | None = None

    @property
    def mixed(self) -> Quadrics:
        """The quadrics through all neighbors, whatever their sheet."""
        return self.quadrics if self.sheets is None else self.sheets.mixed


@dataclass(frozen=True)
class Cloud:
    """The quantities measured on a cloud, in scaled coordinates."""

    scaled: ScaledPoints  # the m distinct points that take part, and how they map to the caller's
    component: Ints  # (m,), component of each point
    normals: Floats  # (m, 3), unit normals
    sides: Sides  # the smooth sides that the points lie on, between edges, towards the same side of the surface
    moved: Floats  # (m, 3), offsets by which the points were moved to smooth noise
    # (m, 3, 3), second fundamental form of local quadrics, positive where the surface curves away from the normal
    shape_operator: Floats
    gaussian_curvature: Floats  # (m,), of local quadrics
    curvature_scatter: Floats  # (m,), of their mean curvature, over that of noise across the surface
    cell_areas: Floats  # (m,), areas of the points' Voronoi cells
    cell_radius: Floats  # (m,), distance of the furthest corner of each cell from its point
    disc_radii: Floats  # (m,), of discs to be drawn: `disc_radii`
    spacing: Floats  # (m,), distance between neighboring points
    misfit: Floats  # (m,), root mean square distance of the neighbors from the quadric
    # (m,), mean squared slope of the roughness that is finer than the normals resolve; zero where it is noise
    squared_slope: Floats
    cause: Ints  # (m,), of `Doubt`: why results would be in doubt
    boundary: Boundary
    pairs: Pairs  # points as moved, smoothing lengths and pairs
    decisions: Decisions  # what is decided for the points as a whole
    notices: list[str]  # texts for the user


@workers()
def read_cloud(
    points: ArrayLike,
    options: LaplacianOptions,
    normals: ArrayLike | None = None,
    boundary: ArrayLike | None = None,
    boundary_distance: ArrayLike | None = None,
    progress: Progress | None = None,
    left_out: ArrayLike = (),
    agreed: Agreed | None = None,
) -> Cloud:
    """Go from coordinates [L], (n, 3), to pairs; for the other arguments see `build_laplacian`.

    Points without sound neighborhoods raise `PointCloudError`.
    """
    report = progress or (lambda stage, fraction: None)
    report("Normals", 0.0)
    check_options(options)
    points = check_points(points)
    kept = np.flatnonzero(~as_mask(left_out, len(points)))
    if not len(kept):
        raise TooFewPointsError(f"All {len(points)} points are named to be left out. Name fewer.")
    scaled, surface = read_surface(points, options, report, kept, agreed)
    given = None if normals is None else unit_normals(normals, len(points))[surface.sample.scaled.first]
    counts = len(kept), len(scaled.points)
    return measure_surface(surface, options, counts, given, boundary, boundary_distance, report)


def measure_surface(
    surface: Surface,
    options: LaplacianOptions,
    counts: tuple[int, int],
    given: Floats | None = None,
    boundary: ArrayLike | None = None,
    boundary_distance: ArrayLike | None = None,
    report: Progress = lambda stage, fraction: None,
) -> Cloud:
    """Go from quadrics to pairs.

    `counts` are how many points there were at first, and how many distinct ones among them, for the notices; `given`,
    (m, 3), are unit normals to use as they are. For the other arguments see `build_laplacian`.
    """
    sample, quadrics, nearest = surface.sample, surface.quadrics, surface.sample.nearest
    decisions = sample.decisions

    report("Normals", 0.25)
    oriented = orient_surface(surface, given)
    report("Neighbors", 0.36)
    gaussian = quadrics.gaussian_curvature
    sides = one_side(quadrics, oriented) if given is not None else find_sides(nearest, quadrics).toward(oriented)

    def cells_within(boundary: Boundary, before: Cells | None = None) -> Cells:
        reported = functools.partial(report, "Neighbors", 0.36)
        return measure_cells(nearest, sides.normals, gaussian, boundary, sample.component, reported, before, sides)

    cells = cells_within(no_boundary(len(oriented)))
    gaps = mean_gaps(nearest, cells.radius, 1)
    found = options.boundary == "auto" and boundary is None and boundary_distance is None
    edge = locate_boundary(sample, oriented, gaps if found else None, boundary, boundary_distance)
    if np.isfinite(edge.distance).any():
        cells = cells_within(edge, cells)
    voids = find_voids(nearest, sides.normals, cells, gaps, sample.scatter[1]) if found else no_voids()
    if len(voids.rims):
        edge = measure_boundary(nearest, oriented, as_mask(voids.rims, len(oriented)) | edge.at_boundary)
        cells = cells_within(edge, cells)
    report("Neighbors", 0.48)
    lengths = smoothing_lengths(nearest, oriented, quadrics, cells, edge, options, sample.component, decisions)
    first_and_second = find_pairs(nearest.tree, lengths, lambda: report("Neighbors", 0.6))
    pairs = Pairs(nearest.points, lengths, *first_and_second)
    parted = edge.parting(nearest.tree, sides.normals, pairs.first, pairs.second, gaps)
    if len(parted):
        pairs = pairs.keep(~as_mask(parted, len(pairs.first)))
    own = oriented if given is None else given

    report("Neighbors", 0.64)
    if options.sheets:
        settle = functools.partial(decisions.bridges, sample.scaled)
        pairs = separate_sheets(pairs, nearest, oriented, sides.normals, settle)
    side = np.sign(np.einsum("ij,ij->i", own, quadrics.normals))
    return Cloud(
        scaled=sample.scaled,
        component=sample.component,
        normals=own,
        sides=sides,
        moved=sample.moved,
        shape_operator=side[:, None, None] * quadrics.shape_operator,
        gaussian_curvature=gaussian,
        curvature_scatter=quadrics.scatter,
        cell_areas=cells.areas,
        cell_radius=cells.radius,
        disc_radii=disc_radii(nearest, sides.normals, cells),
        spacing=nearest.spacing,
        misfit=quadrics.misfit,
        # Where noise was smoothed, slopes are noise.
        squared_slope=np.where(sample.noise > 0.0, 0.0, measure_squared_slope(nearest, sides.normals)),
        cause=likely_causes(nearest, oriented, cells, sample.scatter),
        boundary=edge,
        pairs=pairs,
        decisions=decisions,
        notices=_notices(
            duplicates=counts[0] - counts[1],
            left_out=counts[1] - len(own),
            share=1.0 - len(own) / counts[1],
            noise=sample.noise,
            step=sample.step,
            neighbors=options.neighbors,
            short=0 if options.bandwidth == "adaptive" else _too_few(sample.component, options.neighbors),
            narrow=bool(np.mean(lengths > _NARROW * depth(nearest, edge.distance)) > MANY),
        )
        + voids.notices(sample, edge.at_boundary),
    )


def orient_surface(surface: Surface, given: Floats | None = None) -> Floats:
    """Return the normals of quadrics, or given ones, (m, 3), with signs that agree, outwards or up."""
    sample, own = surface.sample, surface.quadrics.normals if given is None else given
    return sample.decisions.sides(
        sample.scaled, own, lambda: orient_by_winding(sample.nearest, own, sample.places, sample.component)
    )


def read_surface(
    points: Floats,
    options: LaplacianOptions,
    report: Progress = lambda stage, fraction: None,
    kept: Ints | None = None,
    agreed: Agreed | None = None,
) -> tuple[ScaledPoints, Surface]:
    """Go from coordinates, checked, to quadrics; of some rows of them alone, if these are named.

    What is agreed on for more points than these is taken as it is. Return all distinct points, and the surface of those
    that take part.
    """
    decisions = Decisions(agreed)
    scaled = scale_points(points if kept is None else points[kept], decisions)
    if kept is not None:
        scaled = scaled.among(kept, len(points))
    report("Normals", 0.01)
    sample = leave_outliers(scaled, lambda: report("Normals", 0.1), decisions)
    report("Normals", 0.13)
    sample = divide_components(sample)
    report("Normals", 0.15)
    surface = with_scatter(fit_surface(sample, options.sheets))
    report("Normals", 0.18)
    surface = remove_noise(surface, options)
    report("Normals", 0.22)
    return scaled, divide_sheets(surface) if options.sheets else surface


def gather(scaled: ScaledPoints, decisions: Decisions) -> Sample:
    """Find the neighbors of all distinct points."""
    count = len(scaled.points)
    smoothed = smooth_rounded(find_nearest(scaled.points), functools.partial(decisions.settle, "rounded"))
    nearest, noise = look_across_rows(smoothed.nearest), smoothed.noise
    return Sample(scaled, np.zeros(count, dtype=int), nearest, noise, np.zeros((2, count)), smoothed.step, decisions)


def leave_outliers(scaled: ScaledPoints, report: Report = lambda: None, decisions: Decisions | None = None) -> Sample:
    """Leave out distinct points that do not lie on the surface of their neighbors; return a sample of one component.

    Without decisions for the sample they are taken by these points. `report` is called between the two stages; it may
    raise `Cancelled`. If too few points are left, `ComponentError` is raised.
    """
    sample = gather(scaled, decisions or Decisions())
    report()
    return drop_outliers(sample)


def drop_outliers(sample: Sample) -> Sample:
    """Leave outliers out of a sample of one component, see `leave_outliers`."""
    usual = sample.decisions.settle("spacing", lambda: float(np.median(sample.nearest.spacing)))
    return _regroup(sample, np.where(find_outliers(sample.nearest, usual), -1, 0))


def divide_components(sample: Sample) -> Sample:
    """Divide a sample into components that gaps separate, and leave out those of too few points.

    If too few points are left, `ComponentError` is raised.
    """
    decisions = sample.decisions
    usual = decisions.settle("reach", lambda: float(np.median(gap_reach(sample.nearest))))
    label = decisions.label("component", sample.scaled, lambda: label_components(sample.nearest, usual))
    divided = _regroup(sample, label)
    decisions.settle("smallest", lambda: int(np.bincount(divided.component).min()))
    return divided


def fit_surface(sample: Sample, sheets: bool, before: Surface | None = None, changed: Bools | None = None) -> Surface:
    """Fit a quadric around every point, to the neighbors of its own sheet if close sheets are to be kept apart.

    With `before`, the surface before some points moved, only points in `changed` are fitted again: those that moved or
    have neighbors that did.
    """
    nearest = sample.nearest
    if sample.decisions.whole:
        check_surface(count_curves(nearest.quadrics.roundness), len(nearest.points))
    if not sheets:
        return Surface(sample, nearest.quadrics)
    fitted = fit_sheets(nearest, before.sheets if before else None, changed)
    return Surface(replace(sample, nearest=fitted.nearest), fitted.quadrics, fitted)


def with_scatter(surface: Surface) -> Surface:
    """Return the same surface, with what quadrics miss the neighbors of each point by before noise is smoothed."""
    scatter = mean_misfits(surface.sample.nearest, surface.mixed.misfit, surface.quadrics.misfit)
    return replace(surface, sample=replace(surface.sample, scatter=scatter))


def remove_noise(surface: Surface, options: LaplacianOptions, near: Floats | None = None) -> Surface:
    """Move points onto the surface that their neighbors describe, where the options or the noise ask for it.

    Once is enough, but where points fill volumes: these are moved again as long as it brings them nearer to a surface.
    `near_misfit`, (m,), may be given where it is known. Where nothing is to be done the same surface is returned.
    """
    if options.projection == "off":
        return surface
    sample, nearest = surface.sample, surface.sample.nearest
    noise = measure_noise(surface, near_misfit(nearest) if near is None else near)
    if options.projection != "auto":
        return _moved(surface, _onto_quadrics(sample, nearest.tree, np.arange(len(noise)), noise), noise >= 0.0)
    noisy, volumes = noise > 0.0, noise > FILLING
    if not sample.decisions.settle("noisy", lambda: bool(noisy.mean() >= MANY)):
        return surface
    filling = np.flatnonzero(volumes | (noisy & (nearest.averaged(volumes.astype(float)) > 0.5)))
    tree, rows, rounds = nearest.tree, np.flatnonzero(noisy), 0
    left = _misfit_of_some(sample, tree, filling, rounds)
    while len(rows):
        tree, rounds, before = _onto_quadrics(sample, tree, rows, noise), rounds + 1, left
        left = _misfit_of_some(sample, tree, filling, rounds)
        # Where it falls too slowly it is shape and not noise, as of leaves.
        rows = filling if LEFT < left < FALLING * before else filling[:0]
    moved = _moved(surface, tree, noisy)
    noise = np.maximum(sample.noise, np.where(noisy, noise, 0.0))
    return replace(moved, sample=replace(moved.sample, noise=noise))


def measure_noise(surface: Surface, near: Floats) -> Floats:
    """Return the noise of all points, (m,), from `near_misfit` and the misfits of both fits: see `noise_level`."""
    return noise_level(surface.sample.nearest, near, surface.mixed.misfit, surface.quadrics.misfit)


def _misfit_of_some(sample: Sample, tree: cKDTree, rows: Ints, rounds: int) -> float:
    """Return the median misfit, in spacings, of points that fill volumes, (k,) int, after so many rounds; 0 of none."""

    def measure() -> float:
        some = rows[:: 1 + len(rows) // _SAMPLE]
        return float(np.median(misfits(tree, some))) if len(some) else 0.0

    return sample.decisions.settle_round("filling", rounds, measure)


def _onto_quadrics(sample: Sample, tree: cKDTree, rows: Ints, noise: Floats) -> cKDTree:
    """Return the points of a tree, some of them, (k,) int, moved onto quadrics through their neighbors."""
    smallest = sample.decisions.settle("smallest", lambda: int(np.bincount(sample.component).min()))
    points = tree.data.copy()
    points[rows] = project_points(tree, rows, noise, smallest)
    return cKDTree(points)


def _moved(surface: Surface, tree: cKDTree, moving: Bools) -> Surface:
    """Return the surface of the points at other places, a tree, to which some, (m,) bool, have moved."""
    nearest = surface.sample.nearest
    changed = moving | moving[nearest.index].any(axis=1)
    nearest = nearest.with_quadrics(surface.mixed).renewed(tree, changed)
    moved = replace(surface.sample, nearest=look_across_rows(nearest))
    return fit_surface(moved, surface.sheets is not None, surface, changed)


def divide_sheets(surface: Surface) -> Surface:
    """Divide components into disjoint sheets, and leave out points that lie off all of them.

    Where there is nothing to divide the same surface is returned. If too few points are left, `ComponentError` is
    raised.
    """
    sample, fitted = surface.sample, surface.sheets
    sheets = sample.decisions.label(
        "sheet",
        sample.scaled,
        lambda: label_sheets(sample.nearest, surface.quadrics.normals, sample.component),
    )
    whole = replace(sample, nearest=sample.nearest.with_quadrics(surface.mixed))
    divided = _regroup(whole, sheets)
    if divided is whole or fitted is None:
        return surface
    kept, changed = sheets >= 0, sample.nearest.across(sheets)
    rows = np.flatnonzero(kept)
    before = fitted.take(rows, divided.nearest)
    return fit_surface(divided, True, Surface(divided, before.quadrics, before), changed[rows])


def _regroup(sample: Sample, component: Ints) -> Sample:
    """Assign points to other components, and leave out those of component -1; the same sample if nothing changes."""
    kept = component >= 0
    if kept.all() and component.max() == sample.component.max():
        return sample
    count, left = int(np.count_nonzero(~kept)), int(np.count_nonzero(kept))
    if left < FEWEST_OF_SURFACE:
        raise ComponentError(
            f"{count} of {len(kept)} points lie apart from the others, so that {left} are left, and a surface needs at"
            f" least {FEWEST_OF_SURFACE}. Add points around them."
        )
    if left < count:
        raise ComponentError(
            f"{count} of {len(kept)} points are in components of too few points. Use points of a surface, or delete the"
            " lone ones."
        )
    scaled, changed, moved = sample.scaled.leave_out(~kept), sample.nearest.across(component), sample.moved[kept]
    component = component[kept]
    tree = cKDTree(move_apart(scaled.points, component) + moved)
    nearest = look_across_rows(sample.nearest.renewed(tree, changed, kept))
    return replace(
        sample,
        scaled=scaled,
        component=component,
        nearest=nearest,
        noise=sample.noise[kept],
        scatter=sample.scatter[:, kept],
    )


def locate_boundary(
    sample: Sample,
    oriented: Floats,
    gaps: Floats | None = None,
    boundary: ArrayLike | None = None,
    boundary_distance: ArrayLike | None = None,
) -> Boundary:
    """Detect the boundary of the surface, or take the caller's, as of `build_laplacian`.

    It is detected by unit normals, (m, 3), whose signs agree, and the `mean_gaps`, (m,). A given one that does not fit
    the points, or names too few of them, raises `InvalidPointsError`.
    """
    scaled, nearest = sample.scaled, sample.nearest
    distance = None
    if boundary_distance is not None:
        distance = check_distances(boundary_distance, len(scaled.inverse))[scaled.first] / scaled.scale
        if boundary is None:
            return given_boundary(nearest, oriented, distance)
    if boundary is not None:
        at_boundary = check_boundary(boundary, len(scaled.inverse), scaled.first)
    elif gaps is not None:
        at_boundary = find_boundary(nearest, oriented, gaps)
    else:
        return no_boundary(len(oriented))
    measured = measure_boundary(nearest, oriented, at_boundary)
    return measured if distance is None else measured.with_nearest(distance, nearest.spacing)


def _too_few(component: Ints, neighbors: int) -> int:
    """Return how many points are in components that are too small for so many neighbors."""
    size = np.bincount(component)
    return int(size[size <= neighbors].sum())


def _notices(
    duplicates: int, left_out: int, share: float, noise: Floats, step: float, neighbors: int, short: int, narrow: bool
) -> list[str]:
    """Return texts on what was merged, smoothed and left out."""
    noisy, filling = np.mean(noise > 0.0), np.mean(noise > FILLING)
    level, rounded = noise.mean() / max(noisy, 1e-300), step > 0.0
    texts = {
        f"Points that lie on another one: {duplicates:,}. They share one area.": duplicates,
        f"Depth is rounded in steps of {step:.2g} of the spacing. Results are of a surface that is smoothed by"
        f" {level:.2f} of the spacing at {noisy:.0%} of the points, and lacks details of a few spacings.": rounded,
        f"Noise of {level:.2f} of the spacing, at {noisy:.0%} of the points. Results are of a smoothed surface.": noisy
        > filling
        and not rounded,
        f"Noise of more than half the spacing, at {filling:.0%} of the points. Results are of a smoothed surface"
        " without their details: areas may be off by 10 % and more. Use more exact points.": filling > MANY
        and not rounded,
        f"Outliers and small components left out: {left_out:,} ({100.0 * share:.2g} %).": left_out,
        f"Points in components of no more than {neighbors} points: {short:,}. How far off the neighbor of that number"
        " would be was extrapolated there.": short,
        "Part of the surface is too narrow for its points: areas there may be off by 10 % or more. Add points.": narrow,
    }
    return [text for text, holds in texts.items() if holds]


def estimate_normals(points: ArrayLike, options: LaplacianOptions = LaplacianOptions()) -> Floats:
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
        Unit normals of local quadrics. They agree in sign, outwards on closed surfaces, up on sheets such as terrain.
        Points left out get the z axis.

    Raises
    ------
    PointCloudError
        The points have no tangent planes; see `build_laplacian`.

    See Also
    --------
    build_laplacian : The operator, whose ``normals`` these are.
    measure.mean_curvature : Half their divergence.

    Examples
    --------
    On the unit sphere they are the points themselves:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(np.abs(mf.estimate_normals(points) - points).max().round(2))
    0.0
    """
    check_options(options)
    surface = read_surface(check_points(points), options)[1]
    return surface.sample.scaled.scatter(orient_surface(surface), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Discs(Frozen):
    """Discs in the tangent planes of points, made by `surface.surface_discs`.

    Attributes
    ----------
    normals : ndarray, (n, 3)
        Unit normals, outwards on closed surfaces, up on sheets such as terrain; the z axis at points that lie off the
        surface.
    radii : ndarray, (n,)
        Of the points' Voronoi cells [L], so that all together leave no hole; at most three spacings of the points
        around.
    """

    normals: Floats
    radii: Floats

    def deformed(self, gradients: Floats) -> Discs:
        """Return these discs after a deformation, scaled by its largest stretch of the surface.

        Parameters
        ----------
        gradients : ndarray, (n, 3, 3)
            Its linear map around each point, of `deform.deformation_gradients` or any other.

        Returns
        -------
        Discs
            With the normals of the mapped tangent planes; where these are degenerate, the normal stays as it is.
        """
        along = gradients @ frames(self.normals)[:, :, 1:]
        across = np.cross(along[:, :, 1], along[:, :, 0])  # as `frames` orders them
        area = np.linalg.norm(across, axis=1)
        normals = np.where(area[:, None] > 0.0, across / np.where(area > 0.0, area, 1.0)[:, None], self.normals)
        squares = np.einsum("nak,nak->nk", along, along)
        product = np.einsum("na,na->n", along[:, :, 0], along[:, :, 1])
        longest = 0.5 * (squares.sum(axis=1) + np.hypot(squares[:, 0] - squares[:, 1], 2.0 * product))
        return Discs(normals, self.radii * np.sqrt(longest))


@ends_at_one
def surface_discs(points: ArrayLike, *, progress: Progress | None = None) -> Discs:
    """Find discs that cover the surface, to be drawn: much faster than the operator.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Discs
        Where there are no neighbors, at open boundaries and in holes, their radius is up to a spacing.

    Raises
    ------
    PointCloudError
        The points have no tangent planes; see `build_laplacian`.

    See Also
    --------
    estimate_normals : The normals alone, where noise was smoothed.

    Examples
    --------
    On the unit sphere with 800 points, whose spacing is ``sqrt(4 pi / 800)``, 0.13:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> discs = mf.surface.surface_discs(points)
    >>> print(discs.radii.mean().round(2), np.abs(discs.normals - points).max().round(2))
    0.08 0.0
    """
    report = progress or (lambda stage, fraction: None)
    report("Normals", 0.0)
    points = check_points(points)
    surface = read_surface(points, LaplacianOptions(bandwidth="local", neighbors=_DRAWN, projection="off"), report)[1]
    sample = surface.sample
    oriented = orient_by_winding(sample.nearest, surface.quadrics.normals, sample.places, sample.component)
    report("Discs", 0.5)
    curvature, everywhere = surface.quadrics.gaussian_curvature, no_boundary(len(oriented))
    cells = measure_cells(
        sample.nearest, oriented, curvature, everywhere, sample.component, lambda: report("Discs", 0.6)
    )
    radii = scatter_radii(disc_radii(sample.nearest, oriented, cells), sample.scaled, points)
    return Discs(sample.scaled.scatter(oriented, (0.0, 0.0, 1.0)), radii)
