"""Operators of large clouds, built once for all tests of the core, and the command line."""

import functools
import json

import pytest

import core
from benchmarks.samplings import (
    edge_collapsed_sphere,
    fibonacci_sphere,
    marching_cubes_sphere,
    random_sphere,
    sausage,
    square_grid,
    square_random,
    torus_low_discrepancy,
    torus_points,
    uneven_sphere,
)
from command import verbs
from command.line import run as run_command
from tests.wheel_name import put_in_place

put_in_place()

CLOUDS = {
    "even sphere": lambda: fibonacci_sphere(2500),
    "random sphere": lambda: random_sphere(4000),
    "another random sphere": lambda: random_sphere(2000, 11),
    "marching cubes": lambda: marching_cubes_sphere(30),
    "edges collapsed": lambda: edge_collapsed_sphere(3000),
    "density jump": lambda: uneven_sphere(3000),
    "random torus": lambda: torus_points(3000),
    "coarse torus": lambda: torus_low_discrepancy(2000),
    "fine torus": lambda: torus_low_discrepancy(8000),
    "square grid": lambda: square_grid(60),
    "random square": lambda: square_random(2500),
    "capsule": lambda: sausage()[0],
    "bent capsule": lambda: sausage(bent=True)[0],
}


@pytest.fixture(scope="session")
def operators():
    """Function from the name of a cloud, and a bandwidth factor, to its operator; nobody may change it."""

    @functools.cache
    def build(name, factor=1.0):
        return core.build_laplacian(CLOUDS[name](), options=core.LaplacianOptions(bandwidth_factor=factor))

    return build


@pytest.fixture(scope="session")
def eigenvalues(operators):
    """Function from the name of a cloud, a count, and a bandwidth factor to the first eigenvalues of its operator."""

    @functools.cache
    def solve(name, count, factor=1.0):
        return operators(name, factor).eigenpairs(count).eigenvalues

    return solve


@pytest.fixture
def bar(operators):
    """A capsule along an axis, with its operator."""
    laplacian = operators("capsule")
    return laplacian.points, laplacian


@pytest.fixture
def run(capsys):
    """Run the command line; return the exit code and the JSON lines."""

    def run(*arguments):
        code = run_command([str(argument) for argument in arguments], verbs.make_verbs(), "meshfree")
        return code, [json.loads(line) for line in capsys.readouterr().out.splitlines() if line.startswith("{")]

    return run
