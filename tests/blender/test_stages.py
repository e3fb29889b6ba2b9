"""A computation in a thread of its own: its result, its errors, and how Esc stops it."""

import importlib
import time
from threading import Event

import pytest


@pytest.fixture
def stages(extension):
    return importlib.import_module(f"{extension.__name__}.operators.stages")


def wait(work):
    for _ in range(500):
        if work.ended:
            return
        time.sleep(0.01)
    raise TimeoutError


def test_a_result_and_its_stages(stages):
    def compute(progress):
        progress("One", 0.0)
        progress("Two", 0.5)
        return 7

    work = stages.Work(compute)
    wait(work)
    assert work.result() == 7
    assert list(work.seconds) == ["One", "Two"]
    assert not work.stopping


def test_it_stops_at_the_next_report_after_cancel(stages, core):
    reported, go_on = Event(), Event()

    def compute(progress):
        progress("One", 0.25)
        reported.set()
        go_on.wait(5.0)
        progress("Two", 0.5)
        return "never"

    work = stages.Work(compute)
    reported.wait(5.0)
    assert (work.stage, work.fraction, work.ended) == ("One", 0.25, False)
    work.cancel()
    assert work.stopping
    go_on.set()
    wait(work)
    with pytest.raises(core.Cancelled):
        work.result()
    assert list(work.seconds) == ["One"]


def test_an_error_comes_with_the_result(stages, core):
    def compute(progress):
        raise core.PointCloudError("No")

    work = stages.Work(compute)
    wait(work)
    with pytest.raises(core.PointCloudError, match="No"):
        work.result()
