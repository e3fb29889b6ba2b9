"""Points for examples."""

import numpy as np

from .types import Floats


def example_sphere(count: int = 800) -> Floats:
    """Return points evenly on the unit sphere, where results are known: those of the examples in all docstrings.

    Parameters
    ----------
    count : int
        How many, at least 1.

    Returns
    -------
    ndarray, (count, 3) float64
        From the north pole to the south, along a spiral whose steps rotate by the golden angle.

    See Also
    --------
    build_laplacian : Takes them.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(points.shape, np.allclose(np.linalg.norm(points, axis=1), 1.0))
    (800, 3) True
    """
    angle = 2.39996 * np.arange(count)
    z = 1.0 - (np.arange(count) + 0.5) * (2.0 / count)
    ring = np.sqrt(1.0 - z**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
