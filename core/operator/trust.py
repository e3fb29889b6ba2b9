"""How far results can be trusted, and what to say where they cannot."""

from __future__ import annotations

import numpy as np

from ..geometry import Cloud, Doubt
from ..types import Floats, Ints

_FAR, _MISSED = 0.1, 1.0  # residual of the moments, and misfit of quadrics in spacings, at which trust is a half
_DOUBTFUL = 0.02  # share of the area in doubt from which there is a notice
_CAUSES = {  # with what helps
    Doubt.FEW: "the points are too few for how much it bends, or their density changes too fast. Add points there.",
    Doubt.VOLUME: "the points fill a volume and lie on no surface, as in vegetation, or where details are finer than"
    " the spacing. Leave such points out, or add more.",
    Doubt.NOISE: "the noise is about as large as the spacing. Use more exact points.",
    Doubt.ROWS: "the points lie in rows, far from each other. Add points between these, or thin them out along these.",
    Doubt.SHEETS: "sheets of it are as close to each other as the points are. Add points, or analyze each sheet alone.",
}


def measure_trust(cloud: Cloud, residual: Floats) -> Floats:
    """Return how reliable results are, (m,), from 0 to 1, by residuals of the moments, (m,), and misfits of fits."""
    return 1.0 / (1.0 + (residual / _FAR) ** 2 + (cloud.misfit / (_MISSED * cloud.spacing)) ** 2)


def doubt_notices(doubt: Ints, areas: Floats) -> list[str]:
    """Return a notice of how much of the area is in doubt, of the cause of most of that, and of what helps.

    There is none where little is in doubt.
    """
    shares = np.bincount(doubt, areas, len(Doubt)) / areas.sum()
    doubtful, largest = shares[1:].sum(), Doubt(shares[1:].argmax() + 1)
    if doubtful <= _DOUBTFUL:
        return []
    share = "" if shares[largest] > 0.9 * doubtful else f", on {shares[largest]:.0%}"
    return [
        f"On {doubtful:.0%} of the surface the results are in doubt{share} since {_CAUSES[largest]}"
        " LaplaceBeltrami.doubt tells where."
    ]
