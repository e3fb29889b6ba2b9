"""Results that are kept: what is only shown in another way is not computed again, and memory has a bound."""

from threading import Thread
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.blender.test_application import add_ready, run, wave
from tests.blender.test_smooth import shown_points

# Settings of a first run, and those of a second one that asks for nothing new.
AGAIN = {
    "analyze": ({"modes": 6}, {"modes": 6, "write_limit": 2, "show": False}),
    "fewer modes": ("spectrum", {"count": 8}, {"count": 5, "write_limit": 3}),
    "remove noise": ("smooth", {}, {"strength": 0.3, "target": "IN_PLACE"}),
    "remove noise of a group": ("smooth", {}, {"group": "Handle"}),
    "soften": ("smooth", {"method": "HEAT"}, {"method": "HEAT", "strength": 0.0}),
    "keep area": (
        "smooth",
        {"keep": "AREA", "keep_boundary": False},
        {"keep": "AREA", "keep_boundary": False, "target": "IN_PLACE"},
    ),
    "scale details": ("smooth", {"method": "DETAIL"}, {"method": "DETAIL", "strength": 0.5}),
    "keep modes": ("smooth", {"method": "MODES", "modes": 30}, {"method": "MODES", "modes": 20, "strength": 0.5}),
    "mode_shape": ({}, {"mode": 7, "amplitude": 0.2, "phase": 1.0, "animate": True}),
    "show_surface": ({}, {}),
    "mesh_surface": ({}, {"keep_open": False}),
    "principal_curvatures": ({}, {"display": "CURVEDNESS", "show": False}),
    "roughness": ({}, {"show": False}),
    "orient_normals": ({}, {"flip": True, "show": False}),
    "segment": ({"parts": 3}, {"parts": 3, "vertex_groups": True, "show": False}),
    "signs": ("segment", {"method": "NODAL"}, {"method": "NODAL", "show": False}),
    "signature": ({"modes": 12}, {"modes": 12, "kind": "WAVE", "count": 3}),
    "harmonic_field": ({}, {"low": -1.0, "high": 3.0, "show": False}),
    "geodesic_distance": ({}, {"show": False}),
    "nearest_source": ({}, {"show": False}),
    "unwrap": ({}, {"radius": 0.5, "angle": 1.0, "show": False}),
    "extend_direction": ({"direction": (1.0, 0.0, 0.0)}, {"direction": (1.0, 0.0, 0.0), "show": False}),
    "minimal_surface": ({"steps": 3}, {"steps": 3, "target": "IN_PLACE"}),
}
COSTLY = {  # where each is called from
    "core": ("build_laplacian", "orient_normals"),
    "core.deform": ("minimal_surface",),
    "core.measure": ("mean_curvature",),
    "core.surface": ("surface_discs", "values_on_mesh"),
    "core.surface.meshing": ("_mesh",),
    "core.operator.laplacian": ("build_laplacian",),
    "core.algebra.cholesky": ("invert_factor",),
    "core.algebra.solvers": ("conjugate_gradients",),
    "core.operator.spectrum": ("coarse_to_fine", "lift_lowest"),
    "core.algebra.eigenvalue": ("eigsh",),
    "core.distance.geodesics": ("dijkstra",),
    "core.clean.smoothing": ("match_size",),
}


@pytest.fixture
def calls(installed, monkeypatch):
    """Names of the costly functions that were called."""
    called = []

    def count(module, name):
        function = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *args, **rest: called.append(name) or function(*args, **rest))

    for path, names in COSTLY.items():
        module = part(path)
        for name in names:
            count(module, name)
    return called


@pytest.mark.any_blender
@pytest.mark.parametrize("case", AGAIN)
def test_a_second_run_computes_nothing(cache, calls, case):
    name, first, second = AGAIN[case] if len(AGAIN[case]) == 3 else (case, *AGAIN[case])
    add_ready(wave())
    bpy.ops.ed.undo_push(message="Before")
    assert run(name, "EXEC_DEFAULT", True, **first) == {"FINISHED"}
    assert calls
    bpy.ops.ed.undo()  # as Adjust Last Operation does
    calls.clear()
    assert run(name, "EXEC_DEFAULT", True, **second) == {"FINISHED"}
    assert calls == []


@pytest.mark.parametrize("name", ["smooth", "mode_shape"])
def test_a_second_run_finds_no_discs_anew(cache, calls, name):
    changed = {"smooth": {"strength": 0.5}, "mode_shape": {"mode": 3, "amplitude": 0.2}}[name]
    obj = add_ready(wave())
    bpy.ops.meshfree.show_surface()
    bpy.ops.ed.undo_push(message="Before")
    before = attribute(obj, "lb_disc")
    assert run(name, "EXEC_DEFAULT", True) == {"FINISHED"}
    assert "surface_discs" in calls or name == "mode_shape"
    first = attribute(bpy.context.object, "lb_disc")
    bpy.ops.ed.undo()
    calls.clear()
    assert run(name, "EXEC_DEFAULT", True, **changed) == {"FINISHED"}
    assert calls == []
    second = attribute(bpy.context.object, "lb_disc")  # of the points as they are moved now
    assert len({discs.tobytes() for discs in (before, first, second)}) == 3


@pytest.mark.any_blender
def test_what_changes_results_is_computed(cache, calls):
    add_ready(wave())
    bpy.ops.meshfree.geodesic_distance()
    calls.clear()
    bpy.ops.meshfree.geodesic_distance(group="Anchor")
    assert calls == ["dijkstra"]
    bpy.ops.meshfree.harmonic_field()
    calls.clear()
    bpy.context.object.vertex_groups["Value"].add([7], 0.5, "REPLACE")
    bpy.ops.meshfree.harmonic_field()
    assert "conjugate_gradients" in calls
    calls.clear()
    bpy.context.object.data.vertices[7].co.z += 1e-3
    bpy.ops.meshfree.harmonic_field()
    assert "build_laplacian" in calls


def test_lengths_are_made_once_for_all_that_is_measured_along_the_surface(cache, monkeypatch):
    add_ready(wave())
    bpy.ops.meshfree.geodesic_distance()
    module = part("core.distance.geodesics")
    monkeypatch.setattr(module, "_lengths_of_pairs", lambda *_: pytest.fail("made again"))
    assert bpy.ops.meshfree.nearest_source() == {"FINISHED"}
    assert bpy.ops.meshfree.unwrap() == {"FINISHED"}


@pytest.mark.any_blender
def test_kept_results_are_those_of_a_first_run(cache):
    def places(strength, **settings):
        bpy.ops.object.select_all(action="DESELECT")  # one object at a time
        add_ready(wave())
        bpy.ops.meshfree.smooth(strength=strength, **settings)
        return shown_points(bpy.context.object)

    for settings in (
        {},
        {"method": "MODES", "modes": 20},
        {"keep_boundary": False, "keep": "AREA"},
        {"group": "Handle"},
    ):
        cache.clear()
        expected = places(0.4, **settings)
        cache.clear()
        places(1.0, **{**settings, "keep": "NONE", "group": ""})
        assert_allclose(places(0.4, **settings), expected, atol=1e-6)


def test_a_field_between_other_values_is_solved_once(cache, calls, core):
    obj = add_ready(wave())
    bpy.ops.meshfree.harmonic_field()
    between = attribute(obj, "lb_field")
    calls.clear()
    bpy.ops.meshfree.harmonic_field(low=-1.0, high=3.0)
    assert_allclose(attribute(obj, "lb_field"), 4.0 * between - 1.0, atol=1e-6)
    assert calls == []


@pytest.mark.any_blender
def test_a_film_that_was_stopped_is_not_kept(cache, core):
    minimal = part("tools.minimal_surface")
    laplacian, own = core.build_laplacian(wave()), SimpleNamespace(tolerance=0.0, steps=4)

    def stop_later(stage, fraction):
        if fraction > 0.5:
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        minimal.TOOL.compute(laplacian, (None, options(), "wave", "column"), own, stop_later)


def options():
    return part("operators.objects.options").DEFAULTS


class TestMemory:
    def test_bytes_are_those_of_the_arrays(self, cache, core):
        laplacian = core.build_laplacian(sphere_points(500))
        parts = (laplacian.stiffness.data, laplacian.stiffness.indices, laplacian.points)
        known = sum(part.nbytes for part in parts)
        assert known < cache.memory(laplacian) < 3 * known
        assert cache.memory((laplacian, [laplacian, {"again": laplacian}])) == cache.memory(laplacian)

    def test_factors_count(self, cache, core):
        laplacian = core.build_laplacian(sphere_points(500))
        deformer = core.deform.Deformer(laplacian, [0], [1])
        assert cache.memory(deformer._solve) > 12 * 500
        assert cache.memory(deformer) > cache.memory(deformer._solve)

    def test_what_was_not_used_for_longest_goes_first_and_the_newest_stays(self, cache, monkeypatch):
        monkeypatch.setattr(cache, "LIMIT", 100)
        made = []

        def get(key, size=40):
            return cache.fetch(key, lambda: made.append(key) or np.zeros(size, dtype=np.uint8))

        for key in ("a", "b", "a", "c", "a", "b"):
            get(key)
        assert made == ["a", "b", "c", "b"]
        assert len(get("large", 1000)) == 1000
        get("large")
        assert made[4:] == ["large"]
        assert len(cache._kept) == 1

    def test_an_operator_counts_with_what_it_keeps(self, cache, core, monkeypatch):
        cache.clear()
        laplacian = cache.build(sphere_points(500), options(), None, lambda stage, fraction: None).laplacian
        size = cache.memory(list(cache._kept.values()))
        monkeypatch.setattr(cache, "LIMIT", size + 100_000)
        cache.fetch("a", lambda: np.zeros(50_000, dtype=np.uint8))
        core.distance.geodesic_distance(laplacian, [0])
        assert cache.memory(list(cache._kept.values())) > size + 100_000
        known = set(cache._kept)
        cache.fetch("b", lambda: np.zeros(50_000, dtype=np.uint8))
        assert not known & set(cache._kept) - {"a"}

    def test_another_file_gives_it_back(self, cache, known_results):
        bpy.app.handlers.load_pre.remove(known_results.keep)
        add_object(sphere_points(300))
        bpy.ops.meshfree.analyze()
        assert len(cache._kept) > 0
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.app.handlers.load_pre.insert(0, known_results.keep)
        assert len(cache._kept) == 0

    def test_threads_share_it(self, cache, monkeypatch):
        monkeypatch.setattr(cache, "LIMIT", 2000)
        failed = []

        def work(seed):
            for key in np.random.default_rng(seed).integers(0, 40, 2000):
                value = cache.fetch(int(key), lambda key=key: np.full(100, key, dtype=np.uint8))
                if not (value == key).all():
                    failed.append(key)

        threads = [Thread(target=work, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not failed
        assert sum(map(cache.memory, cache._kept.values())) <= 2000
