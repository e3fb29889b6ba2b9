"""Minimal surfaces, Figure 14 of the paper."""

import time

import numpy as np
from scipy.optimize import brentq

import core

from .samplings import hemisphere_random, open_cylinder
from .targets import Goal, judge, percent


def tube(around, up, radius=2.0, height=2.0):
    """Return a regular grid on an open cylinder with both boundaries, and which points are on a boundary.

    Returns
    -------
    points : ndarray, (around * up, 3)
    fixed : ndarray, (around * up,) bool
    """
    angle = 2.0 * np.pi * np.arange(around) / around
    angle, z = (part.ravel() for part in np.meshgrid(angle, np.linspace(-0.5, 0.5, up) * height, indexing="ij"))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z]), np.abs(z) == 0.5 * height


def catenoid(radius=2.0, height=2.0):
    """Return the waist and the area of the stable catenoid through two rings."""
    waist = brentq(lambda c: c * np.cosh(0.5 * height / c) - radius, 0.5 * height / 1.1996, radius)
    return waist, np.pi * waist * (height + waist * np.sinh(height / waist))


def catenoid_errors(points, areas, radius=2.0, height=2.0):
    """Return the relative error of the area, that of the waist [L], and the largest of the profile [L].

    The waist is that of an even fit to the rows in the middle third, since a ring of points need not lie on it.
    """
    waist, area = catenoid(radius, height)
    across, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    middle = np.abs(z) < height / 6.0
    fitted = np.polyfit(z[middle] ** 2, across[middle], 1)[-1]
    return areas.sum() / area - 1.0, fitted - waist, np.abs(across - waist * np.cosh(z / waist)).max()


def cap(points, around):
    """Return a hemisphere's points with a ring of fixed ones on the equator, and which these are."""
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    return np.concatenate([ring, points]), np.arange(around + len(points)) < around


def helicoid(side=60):
    """Return a quarter turn of a helicoid, pushed off it inside, which points are at its boundary, and its area."""
    v, turn = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(0, 1, side * 4 // 5 + 1)))
    angle = 0.5 * np.pi * turn
    normals = np.column_stack([np.sin(angle), -np.cos(angle), v]) / np.sqrt(1.0 + v**2)[:, None]
    points = np.column_stack([v * np.cos(angle), v * np.sin(angle), angle])
    points += (0.15 * np.cos(0.5 * np.pi * v) * np.sin(np.pi * turn))[:, None] * normals
    boundary = (np.abs(v) == 1.0) | (turn == 0.0) | (turn == 1.0)
    return points, boundary, 0.5 * np.pi * (np.sqrt(2.0) + np.arcsinh(1.0))


def figure_14():
    """The paper's cylinder, until the area settles, and a hundred steps further."""
    points = open_cylinder()
    fixed = np.abs(points[:, 2]) > 1.0 - 1e-9
    goals = [percent("area", 0.1), Goal("waist", 1e-3), Goal("profile, max", 3e-3)]

    def measure(start, **settings):
        began = time.perf_counter()
        film = core.deform.minimal_surface(start, fixed, **settings)
        seconds = time.perf_counter() - began
        yield from catenoid_errors(film.points, film.areas)
        yield film.steps
        yield seconds
        yield film.reason
        yield film

    goals += [Goal("steps", form="{:d}"), Goal("seconds", form="{:.0f}"), Goal("ended by")]
    values = measure(points, epsilon=1e-4)
    yield from judge("catenoid from 196 x 40", goals, values)
    film = next(values)
    values = measure(film.points, epsilon=0.0, max_steps=100)
    yield from judge("the same, 100 steps further", goals, values)
    further = next(values)
    moved = np.linalg.norm(further.points - film.points, axis=1).max()
    yield Goal("largest move", 1e-3).row("the same, 100 steps further", moved)


def caps():
    """Hemispheres, whose equator spans the flat disc."""
    goals = [Goal("height", 1e-2), percent("area", 0.5), Goal("steps", form="{:d}")]
    for count in (2000, 5000):

        def measure(count=count):
            points, fixed = cap(hemisphere_random(count), round(np.sqrt(2.0 * np.pi * count)))
            film = core.deform.minimal_surface(points, fixed)
            yield np.abs(film.points[:, 2]).max()
            yield film.areas.sum() / np.pi - 1.0
            yield film.steps

        yield from judge(f"hemisphere, {count:,} random", goals, measure())


def corners():
    """A boundary with four corners."""
    points, boundary, area = helicoid()
    film = core.deform.minimal_surface(points, boundary)
    off = np.abs(film.points[:, 0] * np.sin(film.points[:, 2]) - film.points[:, 1] * np.cos(film.points[:, 2])).max()
    values = iter([film.areas.sum() / area - 1.0, off])
    yield from judge("helicoid, 61 x 49", [percent("area"), Goal("distance, max")], values)


def necks():
    """Two rings ever further apart: a catenoid exists up to 1.325 radii."""
    for height in (2.6, 2.7, 3.2, 5.0):
        points, fixed = tube(98, round(10.0 * height), height=height)
        film = core.deform.minimal_surface(points, fixed)
        case = f"rings {height / 2.0:g} radii apart, 98 x {round(10.0 * height)}"
        ended = film.reason if np.isfinite(film.points).all() else "not finite"
        wanted = "converged" if height < 2.65 else "pinching"
        yield [case, "ended by", f"{ended}, {film.steps} steps", wanted, "yes" if ended == wanted else "no"]
        if film.converged:
            goals = [percent("area"), Goal("waist"), Goal("profile, max")]
            yield from judge(case, goals, iter(catenoid_errors(film.points, film.areas, height=height)))


GROUPS = {"figure_14": figure_14, "caps": caps, "corners": corners, "necks": necks}
