"""What an analysis computes from arrays, for the command line and for Blender's tools."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import core, quantities

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tools.tool import Array, Progress

WRITE_LIMIT = 50  # default number of modes written as attributes: each takes 4 bytes per point in the file


class Built(NamedTuple):
    """An operator and the mean curvature computed by it."""

    laplacian: core.LaplaceBeltrami
    curvature: core.measure.MeanCurvature

    @property
    def mean_curvature(self) -> np.ndarray:
        """The mean curvature, (n,)."""
        return self.curvature.values

    @property
    def notices(self) -> list[str]:
        """Notices about the operator and about the curvature."""
        return [*self.laplacian.notices, *self.curvature.notices]

    @property
    def measures(self) -> dict[str, Array]:
        """Results at the points, by the names of their attributes."""
        return {row.attribute: row.of(self) for row in quantities.rows_of("analyze")}


def build(
    points: Array,
    options: core.LaplacianOptions | core.PaperOptions,
    boundary: Array | None,
    left_out: Array,
    progress: Progress,
) -> Built:
    """Build the operator of points, (n, 3), by the method of the options; the paper's has no boundary.

    Boundary points are (n,) bool; None leaves them to the options. Splats in `left_out`, (m,), take no part.
    """
    given: dict[str, Any] = {"left_out": left_out, "progress": progress}
    if isinstance(options, core.PaperOptions):
        laplacian = core.paper.build_laplacian(points, **asdict(options), **given)
    else:
        laplacian = core.build_laplacian(points, options=options, boundary=boundary, **given)
    progress("Curvature", 1.0)
    laplacian = replace(laplacian, notices=[*floating_notices(left_out), *laplacian.notices])
    return Built(laplacian, core.measure.measure_mean_curvature(laplacian))


def oriented(built: Built, orientation: Array) -> Built:
    """Return the same with normals turned to the side of some vectors, (n, 3)."""
    laplacian = built.laplacian.toward(orientation)
    kept = np.einsum("ij,ij->i", laplacian.normals, built.laplacian.normals) > 0.0
    values = np.where(kept, built.mean_curvature, -built.mean_curvature)
    return Built(laplacian, replace(built.curvature, values=values))


def floating_notices(out: Array) -> list[str]:
    """Return a notice of the splats that were left out, if any."""
    if not len(out):
        return []
    return [
        f"Floaters left out (nearly transparent, huge or isolated splats): {len(out):,}. They move with the nearest"
        " splats, and Select Floaters selects them."
    ]


def resolved_modes(laplacian: core.LaplaceBeltrami, modes: int, progress: Progress) -> tuple[core.Spectrum, list[str]]:
    """Compute modes of an operator, or as many of them as the points resolve, with a notice."""
    try:
        return laplacian.eigenpairs(modes, progress=progress), []
    except core.UnresolvedModesError as error:
        if error.resolved == 0:
            raise
        notice = f"Only {error.resolved} of {modes} modes were computed: the others are finer than the points resolve."
        return laplacian.eigenpairs(error.resolved, progress=progress), [notice]


def continued(
    spectrum: core.Spectrum, areas: Array, points: Array, earlier: tuple[core.Spectrum, Array] | None
) -> tuple[core.Spectrum, Array, tuple[core.Spectrum, Array]]:
    """Match modes to those of the frame before; return them, how well each continues, see `match_modes`, and `earlier`.

    Of a subset, fewer modes may be transferred than there are eigenvalues. Points are all of the object, in the world.
    `earlier` is for the next frame; the first frame has None, and is not changed.
    """
    count = spectrum.eigenvectors.shape[1]
    spectrum, overlaps = replace(spectrum, eigenvalues=spectrum.eigenvalues[:count]), np.ones(count)
    if earlier is not None:
        matched = core.spectral.match_modes(spectrum, areas, points, *earlier)
        spectrum, overlaps = matched.spectrum, matched.overlaps
    return spectrum, overlaps, (spectrum, points)


def total_area(measures: Mapping[str, Array]) -> float:
    """Return the area of the whole surface."""
    return float(measures[quantities.AREA].sum())


def trusted_area(measures: Mapping[str, Array]) -> float:
    """Return the area of the parts whose results are not in doubt."""
    return float(measures[quantities.AREA][measures[quantities.DOUBT] == 0].sum())


def counts(measures: Mapping[str, Array]) -> dict[str, int]:
    """Return the numbers of components, boundary points and points left out."""
    component = measures[quantities.COMPONENT]
    return {
        "component_count": int(component.max()) + 1,
        "boundary_count": int(np.count_nonzero(measures[quantities.BOUNDARY])),
        "left_out_count": int(np.count_nonzero(component < 0)),
    }


def figures(measures: Mapping[str, Array], spectrum: core.Spectrum | None) -> dict[str, Any]:
    """Return what the command line prints of an analysis; `spectrum` may be None."""
    return {
        "points": len(measures[quantities.AREA]),
        "total_area": total_area(measures),
        "trusted_area": trusted_area(measures),
        **counts(measures),
        "eigenvalues": [] if spectrum is None else spectrum.eigenvalues.tolist(),
    }


def arrays(place: Array, built: Built, spectrum: core.Spectrum | None) -> dict[str, Array]:
    """Return all arrays of an analysis, in double precision, in lengths and axes of the world.

    Those of the stiffness matrix have the names of scipy.sparse.save_npz, so that scipy.sparse.load_npz reads it. The
    place, (3,), is the offset of the operator's points from those of the file.
    """
    laplacian, stiffness = built.laplacian, built.laplacian.stiffness
    return {
        "points": laplacian.points + place,
        **{row.source.rpartition(".")[2]: row.of(built) for row in quantities.rows_of("analyze")},
        "smoothing_lengths": laplacian.smoothing_lengths,
        "eigenvalues": np.empty(0) if spectrum is None else spectrum.eigenvalues,
        "eigenvectors": np.empty((len(laplacian.areas), 0)) if spectrum is None else spectrum.eigenvectors,
        "format": np.array(b"csr"),
        "shape": np.array(stiffness.shape),
        "data": stiffness.data,
        "indices": stiffness.indices,
        "indptr": stiffness.indptr,
    }
