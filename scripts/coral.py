"""A shape to show things on: needs numpy only, in Blender and outside."""

import math

import numpy as np

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
_PAINT = (
    (52, 20, 44),
    (133, 36, 60),
    (206, 74, 52),
    (240, 140, 62),
    (250, 205, 130),
    (255, 245, 226),
)  # from low to high


def spread_directions(count):
    """Spread directions evenly along a spiral, (count, 3)."""
    index = np.arange(count) + 0.5
    height = 1.0 - 2.0 * index / count
    width = np.sqrt(1.0 - height**2)
    return np.stack([width * np.cos(GOLDEN_ANGLE * index), width * np.sin(GOLDEN_ANGLE * index), height], axis=1)


class Coral:
    """A closed surface with arms: the distance from its centre is a sum of smooth bumps about some directions."""

    def __init__(self, arms=9, height=1.25, sharpness=9.0):
        self._arms = spread_directions(arms)
        self._heights = height * (1.0 + 0.35 * np.cos(2.0 * GOLDEN_ANGLE * (np.arange(arms) + 0.5) + 1.0))
        self._sharpness = sharpness

    def radii(self, directions):
        """Distance of the surface from the centre, and surface area per solid angle, by direction."""
        bumps = self._heights * np.exp(self._sharpness * (directions @ self._arms.T - 1.0))
        radii = 0.7 + bumps.sum(axis=1)
        along = (bumps @ self._arms) * self._sharpness
        along -= (along * directions).sum(axis=1, keepdims=True) * directions
        return radii, radii * np.sqrt(radii**2 + (along**2).sum(axis=1))

    def area(self, count=400_000):
        """Area of the surface, by a sum over directions that are spread evenly."""
        return 4.0 * math.pi * self.radii(spread_directions(count))[1].mean()

    def scan(self, count):
        """Draw points as a scan of a coral that has grown to this shape would: with polyps, (count, 3), and in colors.

        Returns
        -------
        points : ndarray, (count, 3)
        colors : ndarray, (count, 3) uint8
        """
        smooth = self.sample(count)
        return smooth * (1.0 + 0.03 * _polyps(smooth))[:, None], self.paint(smooth)

    def paint(self, points):
        """Return colors of points of the surface, of sRGB, (n, 3) uint8: dark between the arms, pale at the tips."""
        height = np.interp(np.linalg.norm(points, axis=1), (0.75, 2.05), (0.0, 1.0))
        height = np.clip(height + 0.1 * _polyps(points), 0.0, 1.0)
        steps = np.linspace(0.0, 1.0, len(_PAINT))
        return np.rint(
            np.stack([np.interp(height, steps, channel) for channel in np.transpose(_PAINT)], axis=1)
        ).astype(np.uint8)

    def sample(self, count, seed=2):
        """Draw points at random, evenly over the area."""
        random = np.random.default_rng(seed)
        directions = random.normal(size=(40 * count, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        radii, densities = self.radii(directions)
        kept = np.flatnonzero(random.random(len(radii)) * densities.max() < densities)[:count]
        return radii[kept, None] * directions[kept]


def _polyps(points):
    """Return a pattern of knobs as high as 1, and pits as deep, at points, (n, 3) to (n,): a gyroid and a finer one."""
    result = np.zeros(len(points))
    for size, share in ((13.0, 0.65), (23.0, 0.35)):
        x, y, z = size * points.T + 0.3 * size
        result += share * (np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)) / 1.5
    return result
