"""What ends or fails in the middle of a computation: nothing has changed, no thread is left, and the next run is right.

MESHFREE_FAULTS in the environment says how many are tried, from the seed MESHFREE_FIRST on; a failure names its own.
"""

import importlib
import os
import threading

import bpy
import numpy as np
import pytest
from numpy.linalg import LinAlgError

from tests.blender.clouds import everything
from tests.blender.test_all_or_nothing import film, handled, keyed, shared

COUNT = int(os.environ.get("MESHFREE_FAULTS", "40"))
FIRST = int(os.environ.get("MESHFREE_FIRST", "0"))
FAULTS = {  # and what of it is told
    MemoryError: "The memory is used up",
    LinAlgError: "The equations have no solution (injected)",
    OSError: "A file could not be read or written: injected",
    KeyboardInterrupt: "",
    "Cancelled": "",
}


def colored():
    obj = handled()
    bpy.ops.meshfree.colormap()
    return obj


def bound():
    obj = handled()
    obj.meshfree.neighbors -= 1
    bpy.ops.meshfree.deform_bind()
    return obj


def animated():
    obj = bound()
    empty = obj.meshfree.deform.handle_items[0].empty
    for frame in (1, 3):
        empty.location.z += 0.2
        empty.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(2)
    return obj


RUNS = [
    (colored, "analyze", {"modes": 4}),
    (shared, "analyze", {}),
    (handled, "spectrum", {"count": 5}),
    (handled, "principal_curvatures", {}),
    (keyed, "roughness", {}),
    (handled, "segment", {"parts": 3}),
    (handled, "segment", {"method": "NODAL"}),
    (handled, "signature", {"count": 3, "modes": 10}),
    (handled, "smooth", {"target": "IN_PLACE"}),
    (keyed, "smooth", {"method": "HEAT"}),
    (handled, "mode_shape", {"animate": True}),
    (handled, "harmonic_field", {}),
    (handled, "geodesic_distance", {}),
    (handled, "deform_bind", {}),
    (bound, "deform_update", {}),
    (animated, "deform_bake", {"first": 1, "last": 3}),
    (film, "minimal_surface", {"target": "IN_PLACE", "steps": 3}),
]


@pytest.fixture
def fresh(extension):
    """Function that starts from an empty file, with nothing computed."""
    cache = importlib.import_module(f"{extension.__name__}.operators.running.cache")
    live = importlib.import_module(f"{extension.__name__}.operators.deform.live")

    def start(make):
        bpy.ops.wm.read_homefile(use_empty=True)
        made = make()
        cache.clear()
        live._lives.clear()
        return made

    return start


@pytest.fixture
def reports(extension, monkeypatch):
    """Let the report of progress of a number, counted from 0, raise an error; return how many there were."""
    stages = importlib.import_module(f"{extension.__name__}.operators.running.stages")
    told = stages.Stages.__call__

    def arm(number=-1, error=None):
        seen = []

        def tell(self, stage, fraction):
            seen.append(stage)
            if len(seen) - 1 == number:
                raise error
            told(self, stage, fraction)

        monkeypatch.setattr(stages.Stages, "__call__", tell)
        return seen

    return arm


def scene():
    """All that the objects hold."""
    return {obj.name: everything(obj) for obj in bpy.data.objects}


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_fault_while_computing_changes_nothing(fresh, reports, core, seed):
    rng = np.random.default_rng(seed)
    index, kind = rng.integers(len(RUNS)), list(FAULTS)[rng.integers(len(FAULTS))]
    make, name, settings = RUNS[index]
    fresh(make)
    seen = reports()
    getattr(bpy.ops.meshfree, name)(**settings)
    undisturbed, count = scene(), len(seen)
    assert count > 0

    fresh(make)
    before, threads = scene(), threading.active_count()
    error = core.Cancelled("injected") if kind == "Cancelled" else kind("injected")
    seen = reports(int(rng.integers(count)), error)
    try:
        with pytest.raises((RuntimeError, KeyboardInterrupt)) as told:
            getattr(bpy.ops.meshfree, name)(**settings)
    finally:
        reports()
    assert FAULTS[kind] in str(told.value)
    assert not FAULTS[kind] or "Traceback" not in str(told.value)
    assert scene() == before
    assert threading.active_count() == threads

    getattr(bpy.ops.meshfree, name)(**settings)
    assert scene() == undisturbed
