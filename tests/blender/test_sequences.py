"""Random sequences of operators, with undo, redo, saving and opening in between, against their own history.

MESHFREE_SEQUENCES in the environment says how many are tried, from the seed MESHFREE_FIRST on; a failure names its own.
"""

import os

import bpy
import numpy as np
import pytest

from tests.blender.test_all_or_nothing import film, handled, keyed, scene

COUNT = int(os.environ.get("MESHFREE_SEQUENCES", "12"))
FIRST = int(os.environ.get("MESHFREE_FIRST", "0"))
LENGTH = 14
STEPS = [
    ("analyze", {"modes": 4}),
    ("analyze", {}),
    ("spectrum", {"count": 5}),
    ("colormap", {"attribute": "lb_area"}),
    ("principal_curvatures", {"display": "CURVEDNESS"}),
    ("roughness", {}),
    ("orient_normals", {}),
    ("orient_normals", {"method": "KEEP", "flip": True}),
    ("show_surface", {}),
    ("mesh_surface", {"detail": 0.7}),
    ("segment", {"parts": 3}),
    ("segment", {"parts": 2, "vertex_groups": True}),
    ("separate_by_segment", {}),
    ("signature", {"count": 2, "modes": 10}),
    ("smooth", {}),
    ("smooth", {"target": "IN_PLACE"}),
    ("mode_shape", {"animate": True}),
    ("mode_shape", {"target": "IN_PLACE"}),
    ("harmonic_field", {}),
    ("geodesic_distance", {}),
    ("nearest_source", {}),
    ("unwrap", {}),
    ("extend_direction", {"direction": (1.0, 0.0, 0.0)}),
    ("deform_bind", {}),
    ("deform_update", {}),
    ("deform_to_shape_key", {}),
    ("deform_apply", {}),
    ("deform_reset", {}),
    ("deform_bake", {"first": 1, "last": 2}),
    ("deform_free", {}),
    ("deform_unbind", {}),
    ("minimal_surface", {"steps": 2}),
    ("group_from_selection", {"role": "HANDLE", "action": "ADD"}),
    ("convert", {}),
    ("convert", {"target": "MESH"}),
]


def move_handle(obj):
    """Move the first handle, as a user does."""
    items = [item for item in obj.meshfree.deform.handle_items if item.empty]
    if items:
        items[0].empty.location.x += 0.1
        bpy.context.view_layer.update()


def change_setting(obj):
    obj.meshfree.neighbors = 20 + (obj.meshfree.neighbors + 1) % 7


BY_HAND = [move_handle, change_setting]


class History:
    """What the scene held after each step, and where in it we are."""

    def __init__(self):
        bpy.ops.ed.undo_push(message="Start")
        self.states, self.now = [scene()], 0

    def step(self, rng):
        """Do something; return what it was."""
        obj, number = bpy.context.view_layer.objects.active, rng.integers(len(STEPS) + len(BY_HAND))
        if number < len(STEPS):
            name, settings = STEPS[number]
            refused = ""
            try:
                getattr(bpy.ops.meshfree, name)(**settings)
            except RuntimeError as error:
                refused = str(error)
            assert "Traceback" not in refused
            if refused:
                assert scene() == self.states[self.now], f"{name}{settings} was refused: {refused}"
                return f"{name} refused"
        else:
            name = BY_HAND[number - len(STEPS)].__name__
            BY_HAND[number - len(STEPS)](obj)
        bpy.ops.ed.undo_push(message=name)
        self.states = [*self.states[: self.now + 1], scene()]
        self.now += 1
        return name

    def undo(self, rng):
        if self.now:
            bpy.ops.ed.undo()
            self.now -= 1
        return "undo"

    def redo(self, rng):
        if self.now < len(self.states) - 1:
            bpy.ops.ed.redo()
            self.now += 1
        return "redo"

    def check(self, done, *left_out):
        """Compare what there is with what there was."""
        found, expected = scene(), self.states[self.now]
        assert found.keys() == expected.keys(), done
        for name in found:
            different = {key for key in found[name] if found[name][key] != expected[name][key]} - {*left_out}
            assert not different, (done, name, {key: (expected[name][key], found[name][key]) for key in different})


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_undo_and_redo_go_through_the_history(seed):
    rng = np.random.default_rng(seed)
    (handled, keyed, film)[rng.integers(3)]()
    history, done = History(), []
    for _ in range(LENGTH):
        way = (history.step, history.step, history.step, history.undo, history.redo)[rng.integers(5)]
        done.append(way(rng))
        history.check(done)


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_a_file_that_is_saved_and_opened_again_holds_the_same(seed, tmp_path):
    rng = np.random.default_rng(seed)
    (handled, keyed, film)[rng.integers(3)]()
    history, done = History(), []
    for _ in range(LENGTH // 2):
        done.append(history.step(rng))
        before = scene()
        path = str(tmp_path / "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        assert scene() == before, done
        bpy.ops.wm.open_mainfile(filepath=path)
        history.states, history.now = [before], 0
        history.check(done, "blocks")  # those that nobody uses are not saved
