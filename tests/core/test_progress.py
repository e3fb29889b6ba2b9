"""Progress as its callers are told of it: plain floats, and 1 at last."""

import inspect

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from core.progress import ends_at_one
from tests.public import PUBLIC


def told():
    """Public functions and methods that tell their progress by stages."""
    for one in PUBLIC.values():
        calls = [one] if inspect.isfunction(one) else [call for _, call in inspect.getmembers(one, inspect.isfunction)]
        calls += [call.__func__ for _, call in inspect.getmembers(one, inspect.ismethod)]
        for call in calls:
            given = inspect.signature(call).parameters.get("progress")
            public = call.__name__ == "__init__" or not call.__name__.startswith("_")
            if (
                public
                and given is not None
                and ("Progress" in (kind := str(given.annotation)) or "[str, float]" in kind)
            ):
                yield call


def test_all_calls_end_it():
    calls = {call.__qualname__: call for call in told()}
    assert len(calls) > 30
    assert [name for name, call in calls.items() if not hasattr(call, "__wrapped__")] == []


CALLS = {
    "spectrum": lambda laplacian, **given: laplacian.eigenpairs(4, **given),
    "distance": lambda laplacian, **given: core.distance.geodesic_distance(laplacian, 0, **given),
    "several inside": lambda laplacian, **given: core.distance.logarithmic_map(laplacian, 0, **given),
    "heat": lambda laplacian, **given: core.motion.Heat(laplacian, 0.1).advance(laplacian.points[:, 0], **given),
    "smooth": lambda laplacian, **given: core.clean.smooth_points(laplacian, 9, **given),
    "mesh": lambda laplacian, **given: core.surface.mesh_surface(laplacian, **given),
    "segment": lambda laplacian, **given: core.spectral.segment(laplacian, 3, **given),
    "volume": lambda laplacian, **given: core.measure.enclosed_volume(laplacian, **given),
    "poisson": lambda laplacian, **given: core.distance.solve_poisson(laplacian, laplacian.points[:, 0], **given),
    "paper": lambda laplacian, **given: core.paper.build_laplacian(laplacian.points, **given),
    "slopes": lambda laplacian, **given: core.measure.Slopes(
        laplacian.points, core.surface.surface_discs(laplacian.points)
    ).of(laplacian.points[:, 0], **given),
    "discs": lambda laplacian, **given: core.surface.surface_discs(laplacian.points, **given),
}


@pytest.fixture(scope="module")
def laplacian():
    return core.build_laplacian(fibonacci_sphere(500))


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_ends_at_one(laplacian, call):
    calls = []
    call(laplacian, progress=lambda *told: calls.append(told))
    assert {(type(stage), type(fraction)) for stage, fraction in calls} == {(str, float)}
    assert len(calls) > 1
    assert min(fraction for _, fraction in calls) >= 0.0
    assert calls[-1] == (calls[-2][0], 1.0)


def test_what_is_told_by_the_way_is_the_callers_own():
    @ends_at_one
    def inner(*, progress=None):
        progress("inner", np.float32(0.5))

    @ends_at_one
    def outer(*, progress=None):
        inner(progress=progress)  # of the same progress: it goes on
        inner(progress=lambda stage, fraction: progress(stage, 0.5 + 0.25 * fraction))  # of a part of its own
        return "result"

    calls = []
    assert outer(progress=lambda *told: calls.append(told)) == "result"
    assert calls == [("inner", 0.5), ("inner", 0.625), ("inner", 0.75), ("inner", 1.0)]
    with pytest.raises(TypeError):
        outer()


def test_one_that_cancels_ends_nothing():
    def cancel(stage, fraction):
        calls.append(fraction)
        raise core.Cancelled

    calls = []
    with pytest.raises(core.Cancelled):
        core.build_laplacian(fibonacci_sphere(300), progress=cancel)
    assert len(calls) == 1
