"""The effect of curvature on the kernel."""

import numpy as np

from ..geometry import CURVED
from ..kernel import SECOND_MOMENT
from ..types import Floats

_UNEVEN = 0.01  # relative change of a kernel's integral by varying h, up to which its expansion holds


def kernel_integral(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the integral of the kernel over the surface around each point, (m,): ``1 - mu2 h^2 K / 6``.

    Clipped, as all terms of curvature here.
    """
    return _curved(lengths, gaussian, -SECOND_MOMENT / 6.0)


def weight_factor(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the factor of the pair weights, (m,): ``1 + mu2 h^2 K / 4``.

    With it slow functions have the right Laplacian. A pair takes its ends' mean.
    """
    return _curved(lengths, gaussian, SECOND_MOMENT / 4.0)


def second_moment(lengths: Floats, gaussian: Floats) -> Floats:
    """Return the trace of the second moment of weights with that factor over 4 areas, (m,).

    The factor times ``1 - mu2 h^2 K / 3``.
    """
    return weight_factor(lengths, gaussian) * _curved(lengths, gaussian, -SECOND_MOMENT / 3.0)


def _curved(lengths: Floats, gaussian: Floats, factor: float) -> Floats:
    return 1.0 + np.clip(factor * lengths**2 * gaussian, -CURVED, CURVED)


def uneven(excess: Floats) -> Floats:
    """Return the gain of an integral of the kernel where h varies, damped where it varies too fast for that."""
    return excess / (1.0 + (excess / _UNEVEN) ** 2)
