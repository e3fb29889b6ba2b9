"""Distinct points without units, and how they map to the caller's."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..types import Array, Bools, Floats, Ints


@dataclass(frozen=True)
class ScaledPoints:
    """Distinct points, centered and divided by their root mean square radius."""

    # (m, 3), distinct points in scaled coordinates, in the order of a k-d tree, which keeps neighbors near in memory
    points: Floats
    scale: float  # the root mean square radius [L]: caller's length = scale * scaled length
    inverse: Ints  # (n,), for each of the caller's points, its row in `points`; -1 for points that were left out
    copies: Ints  # (m,), how many of the caller's points share each row
    first: Ints  # (m,), the caller's point that each row was first seen at

    @property
    def shared(self) -> bool:
        """Whether some of the caller's points are at one place."""
        return self.copies.max() > 1

    def scatter(self, quantity: Array, neutral: bool | float | tuple[float, float, float]) -> Array:
        """Return a quantity of the distinct points for the caller's; those left out get the neutral value."""
        result = quantity[self.inverse]
        result[self.inverse < 0] = neutral
        return result

    def leave_out(self, dropped: Bools) -> Self:
        """Return the same without some of the distinct points, (m,) bool."""
        kept = ~dropped
        row = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1)  # what was left out before stays so
        return replace(
            self, points=self.points[kept], inverse=row[self.inverse], copies=self.copies[kept], first=self.first[kept]
        )

    def among(self, rows: Ints, count: int) -> Self:
        """Return the same as some rows, (k,), of a caller's points, so many in all; the others were left out."""
        inverse = np.full(count, -1)
        inverse[rows] = self.inverse
        return replace(self, inverse=inverse, first=rows[self.first])
