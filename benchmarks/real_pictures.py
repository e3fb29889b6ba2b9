"""Pictures of real shapes: where the area is off, and what is trusted on clouds as scanners give them.

MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.real_pictures
"""

import os
from pathlib import Path

import matplotlib
import numpy as np
from scipy.spatial import cKDTree

import core
from core.cores import cores

from .real_shapes import random_points, shapes

matplotlib.use("Agg")
from matplotlib import pyplot

FOLDER = Path(__file__).parents[1] / "docs" / "pictures" / "results"
SHAPES = "rocker-arm", "fandisk", "cat", "turtle", "cheburashka", "screwdriver"
CLOUDS = "cgm_man", "vtk_horse", "ml_brain", "vtk_Human", "cg_kitten", "icp_bunny_part1"
MOST = 25_000  # points that are drawn of a shape


def area_error(vertices, faces, count=10_000):
    """Random points of a shape, and how far the area around each is off, as a share."""
    points, _ = random_points(vertices, faces, count)
    laplacian = core.build_laplacian(points)
    dense, _ = random_points(vertices, faces, 400_000, 7)
    exact = np.bincount(cKDTree(points).query(dense, workers=cores())[1], minlength=count) / len(dense)
    near = cKDTree(points).query(points, k=60, workers=cores())[1]
    return points, laplacian.areas[near].sum(axis=1) / exact[near].sum(axis=1) - 1.0


def draw(axes, points, values, title, low, high, colors):
    """Draw points in the colors of values, seen from the widest side."""
    centered = points - points.mean(axis=0)
    flat = centered @ np.linalg.eigh(centered.T @ centered)[1][:, ::-1]
    order = np.argsort(flat[:, 2])  # the nearer ones last
    order = order[:: -(-len(order) // MOST)]
    drawn = axes.scatter(flat[order, 0], flat[order, 1], 2.0, values[order], cmap=colors, vmin=low, vmax=high, lw=0)
    axes.set_title(title, fontsize=8)
    axes.set_aspect("equal")
    axes.axis("off")
    return drawn


def save(name, label, panels, low, high, colors):
    """Save a picture of panels (points, values, title)."""
    figure, axes = pyplot.subplots(2, 3, figsize=(9, 6), dpi=90)
    for place, panel in zip(axes.flat, panels, strict=True):
        drawn = draw(place, *panel, low, high, colors)
    figure.colorbar(drawn, ax=axes, shrink=0.6, label=label)
    figure.savefig(FOLDER / name, bbox_inches="tight")
    pyplot.close(figure)


def area_panels():
    """Shapes of the zoo, with where their area is off."""
    zoo = shapes()
    for name in SHAPES:
        vertices, faces, _ = zoo[name]
        points, error = area_error(vertices, faces)
        yield points, 100.0 * error, name


def trust_panels():
    """Raw clouds, with what is trusted."""
    for name in CLOUDS:
        with np.load(Path(os.environ["MESHFREE_RAW"]) / f"{name}.npz") as file:
            points = np.asarray(file["points"], dtype=np.float64)
        laplacian = core.build_laplacian(points)
        doubtful = laplacian.areas[laplacian.trust < 0.5].sum() / laplacian.areas.sum()
        yield points, laplacian.trust, f"{name}, {len(points):,} points\n{doubtful:.0%} of the area in doubt"


if __name__ == "__main__":
    save("area_error.png", "area off by, %, over 60 points", area_panels(), -10.0, 10.0, "RdBu_r")
    save("trust.png", "trust", trust_panels(), 0.0, 1.0, "viridis")
