"""How much is seen through holes where points are drawn as discs: ``python -m benchmarks.holes FOLDER``.

The folder holds NAME.npz with `vertices` and `faces`. Each surface is looked at from 20 directions, as its vertices and
as random points, in a picture of 400 pixels. A pixel shows a hole if nothing is there where the faces are, or what is
there lies more than three radii behind them; pixels next to an outline do not count. For comparison discs of one size,
the mean of those found, in the same planes: what dots are.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import minimum_filter

import core

SIZE = 1.1  # times the radius that covers the surface, as the display draws discs
PIXELS, DIRECTIONS = 400, 20
RANDOM, DENSE = 10_000, 1_000_000


def holes(points, normals, radii, dense, rng):
    """Return the share of the pixels of an object that show a hole, over random directions."""
    missed = total = 0
    far = 3.0 * np.median(radii)
    for _ in range(DIRECTIONS):
        frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        truth = dense @ frame
        low, unit = truth[:, :2].min(axis=0), np.ptp(truth[:, :2], axis=0).max() / PIXELS
        surface = np.full((PIXELS + 1) ** 2, -1e30)
        np.maximum.at(surface, np.floor((truth[:, :2] - low) / unit).astype(int) @ [PIXELS + 1, 1], truth[:, 2])
        drawn = draw(points @ frame, normals @ frame, radii, low, unit)
        around = surface.reshape(PIXELS + 1, -1)
        there = (around - minimum_filter(around, 3) < far).ravel()  # no pixel of an outline, which shows two surfaces
        missed += np.count_nonzero(drawn[there] < surface[there] - far)
        total += np.count_nonzero(there)
    return missed / total


def draw(places, tilt, radii, low, unit):
    """Return the height of the uppermost disc at the middle of each pixel, looking along -z; -1e30 for none."""
    reach = int(np.ceil(radii.max() / unit))
    steps = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    middle = np.floor((places[:, :2] - low) / unit).astype(int)
    slope = -tilt[:, :2] / np.where(np.abs(tilt[:, 2:]) > 1e-3, tilt[:, 2:], np.inf)
    upmost = np.full((PIXELS + 1) ** 2, -1e30)
    for step in steps:
        near = np.flatnonzero(radii > unit * (np.linalg.norm(step) - 1.0))
        pixel = middle[near] + step
        way = low + (pixel + 0.5) * unit - places[near, :2]
        rise = np.einsum("ij,ij->i", way, slope[near])  # to the plane of the disc
        inside = np.einsum("ij,ij->i", way, way) + rise**2 < radii[near] ** 2
        inside &= ((pixel >= 0) & (pixel <= PIXELS)).all(axis=1)
        np.maximum.at(upmost, pixel[inside] @ [PIXELS + 1, 1], places[near[inside], 2] + rise[inside])
    return upmost


def sample(vertices, faces, count, rng):
    """Return random points on faces."""
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = rng.dirichlet([1.0, 1.0, 1.0], count)
    return np.einsum("ij,ijk->ik", share, corners[rng.choice(len(faces), count, p=area / area.sum())])


def main(folder):
    """Print a table of all shapes."""
    print("| shape | points | holes, % | with discs of one size, % |\n| --- | --- | --- | --- |")
    for path in sorted(Path(folder).glob("*.npz")):
        with np.load(path) as shape:
            vertices, faces = shape["vertices"].astype(float), shape["faces"]
        rng = np.random.default_rng(0)
        dense = sample(vertices, faces, DENSE, rng)
        clouds = {
            f"{len(vertices):,} vertices": vertices,
            f"{RANDOM:,} at random": sample(vertices, faces, RANDOM, rng),
        }
        for kind, points in clouds.items():
            discs = core.surface.surface_discs(points)
            radii = SIZE * discs.radii
            even = np.full(len(radii), radii.mean())
            shares = [holes(points, discs.normals, size, dense, rng) for size in (radii, even)]
            print(f"| {path.stem} | {kind} | {100 * shares[0]:.3f} | {100 * shares[1]:.3f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
