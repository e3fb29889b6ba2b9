"""Deformation: bound once, the points follow their handles by themselves, in this file and when it is opened again."""

import functools
import os
import re
import subprocess
import sys
import textwrap
import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_group, add_object, attribute, everything, grid_points, local_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_panel import draw
from tests.blender.test_smooth import key_points, shown_points

HEIGHTS = (0.0, 0.5, 1.5, -1.0)  # of the animated handle at frames 1 to 4


def threads(live):
    """The threads that work for bound objects."""
    return [followed.thread for followed in live._followed.values() if followed.thread is not None]


def is_settled(obj):
    """Whether what a bound object shows is exact."""
    return bool(obj.data["lb_pose"][0])


@pytest.fixture
def strip():
    """Add a flat strip along x, held at one end, with handles at the other."""
    points, _ = grid_points(columns=60, rows=12, step=0.1, jitter=0.0)
    obj = add_object(points)
    add_group(obj, "Anchor", points[:, 0] < 0.25)
    add_group(obj, "Handle", points[:, 0] > 5.65)
    return obj


def bind(**settings):
    """Bind the active object by these settings, and return the empty of its first handles, if there is one."""
    deform = bpy.context.object.meshfree.deform
    for name, value in settings.items():
        setattr(deform, name, value)
    assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
    return deform.handle_items[0].empty


def lift(empty, height):
    """Move an empty up and let Blender see it, as a drag does."""
    empty.location.z += height
    bpy.context.view_layer.update()


def animate(empty):
    """Let an empty go up and down by `HEIGHTS`."""
    start = empty.location.z
    for frame, height in enumerate(HEIGHTS, start=1):
        empty.location.z = start + height
        empty.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, len(HEIGHTS)


def move_points(obj, chosen, shift):
    """Move points of the data themselves, as Edit Mode does."""
    points = local_points(obj)
    points[chosen] += shift
    obj.data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).reshape(-1))
    obj.data.update()
    bpy.context.view_layer.update()


def curves_of(obj):
    """Return the F-curves of an object."""
    return part("operators.objects.animation").curves(obj)


def displacement(obj):
    return attribute(obj, "lb_displacement")


def is_end(points):
    return points[:, 0] > 5.65


class TestFollowing:
    """The points go where the handles take them."""

    def test_nothing_moves_without_a_move(self, strip):
        before = local_points(strip)
        bind()
        assert bpy.ops.meshfree.deform_update() == {"FINISHED"}
        assert_allclose(shown_points(strip), before, atol=1e-6)
        assert not displacement(strip).any()

    def test_an_empty_that_is_moved(self, strip):
        before = local_points(strip)
        strip.location, strip.rotation_euler, strip.scale = (5.0, 1.0, 2.0), (0.4, 0.0, 0.3), (1.0, 1.0, 2.0)
        lift(bind(), 1.0)
        after = shown_points(strip)
        handles, anchors = is_end(before), before[:, 0] < 0.25
        assert_allclose(after[handles] - before[handles], np.tile([0.0, 0.0, 1.0], (handles.sum(), 1)), atol=1e-4)
        assert_allclose(after[anchors], before[anchors], atol=1e-5)
        height = after[:, 2][np.argsort(before[:, 0], kind="stable")].reshape(60, 12).mean(axis=1)
        assert (np.diff(height) > -1e-3).all()
        assert_allclose(attribute(strip, "position"), before, atol=1e-6)  # the points at rest are kept
        assert_allclose(attribute(strip, "lb_rest"), before, atol=1e-6)

    def test_the_same_as_core(self, core, strip):
        before = local_points(strip)
        lift(bind(), 0.7)
        handles, anchors = is_end(before), before[:, 0] < 0.25
        laplacian = core.build_laplacian(before)
        deformer = core.deform.Deformer(laplacian, np.flatnonzero(handles), np.flatnonzero(anchors))
        assert_allclose(shown_points(strip), deformer.solve(before[handles] + (0.0, 0.0, 0.7)), atol=1e-4)

    def test_several_handles_each_with_its_empty(self, strip):
        before = local_points(strip)
        middle = np.abs(before[:, 0] - 3.0) < 0.25
        add_group(strip, "Handle.001", middle)
        bind()
        empties = {item.name: item.empty for item in strip.meshfree.deform.handle_items}
        assert empties["Handle.001"].location.x == pytest.approx(before[middle, 0].mean(), abs=1e-4)
        lift(empties["Handle.001"], 0.4)
        lift(empties["Handle"], -0.2)
        assert_allclose(displacement(strip)[middle], np.tile([0.0, 0.0, 0.4], (middle.sum(), 1)), atol=1e-5)
        assert_allclose(displacement(strip)[is_end(before), 2], -0.2, atol=1e-5)

    def test_handles_without_empties_are_moved_themselves(self, strip):
        before = local_points(strip)
        assert bind(add_empties=False) is None
        move_points(strip, is_end(before), (-0.5, 0.0, 1.0))
        shown = shown_points(strip)
        assert_allclose(shown[is_end(before)], before[is_end(before)] + (-0.5, 0.0, 1.0), atol=1e-5)
        assert 0.1 < shown[np.abs(before[:, 0] - 4.0) < 0.1, 2].mean() < 1.0
        assert_allclose(attribute(strip, "lb_rest"), before, atol=1e-6)

    def test_handles_that_are_moved_in_edit_mode(self, strip):
        before = local_points(strip)
        bind(add_empties=False)
        strip.data.vertices.foreach_set("select", is_end(before))
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.transform.translate(value=(0.0, 0.0, 0.8))
        bpy.context.view_layer.update()
        bpy.ops.object.mode_set(mode="OBJECT")
        moved = displacement(strip)  # written while the mesh was edited
        assert_allclose(moved[is_end(before)], np.tile([0.0, 0.0, 0.8], (is_end(before).sum(), 1)), atol=1e-5)
        assert 0.1 < moved[np.abs(before[:, 0] - 4.0) < 0.1, 2].mean() < 0.8
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), before + moved, atol=1e-5)

    def test_every_way_to_the_same_place(self, strip):
        empty = bind()
        lift(empty, 1.0)
        once = shown_points(strip)
        for height in (1.0, -3.0, 2.0):
            lift(empty, height)
        assert_allclose(shown_points(strip), once, atol=1e-5)
        lift(empty, -1.0)
        assert_allclose(shown_points(strip), local_points(strip), atol=1e-6)

    def test_a_quick_update_is_settled_later(self, strip, live):
        empty = bind()
        lift(empty, 1.0)
        settled = displacement(strip)
        empty.location.z -= 1.0
        bpy.context.view_layer.update()
        empty.location.z += 1.0
        handlers = bpy.app.handlers.depsgraph_update_post
        place = [function.__module__ for function in handlers].index(live.__name__)
        following = handlers.pop(place)
        try:
            bpy.context.view_layer.update()
            live.update(strip, bpy.context.evaluated_depsgraph_get(), live.State.QUICK)
            assert not is_settled(strip)
            assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], 1.0, atol=1e-5)
            live.update(strip, bpy.context.evaluated_depsgraph_get())
        finally:
            handlers.insert(place, following)
        assert is_settled(strip)
        assert_allclose(displacement(strip), settled, atol=1e-5)

    def test_soft_handles_give_way(self, strip):
        lift(bind(soft=True, weight=0.01), 1.0)
        assert np.abs(displacement(strip)[is_end(local_points(strip)), 2] - 1.0).max() > 1e-3

    def test_settings_take_effect_without_binding_again(self, strip):
        lift(bind(), 2.0)
        turned = displacement(strip)
        strip.meshfree.deform.rotation_aware = False
        bpy.ops.meshfree.deform_update()
        straight = displacement(strip)
        assert np.abs(straight - turned).max() > 0.01
        strip.meshfree.deform.rotation_aware = True
        bpy.ops.meshfree.deform_update()
        assert_allclose(displacement(strip), turned, atol=1e-5)

    def test_a_setting_that_is_dragged_starts_no_thread_before_it_rests(self, strip, live):
        lift(bind(soft=True), 1.0)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for weight in (0.5, 0.1, 0.01):
            strip.meshfree.deform.weight = weight
            assert live._attend(strip, depsgraph)
            assert not threads(live)
        live._followed[strip.session_uid].due = 0.0
        assert live._attend(strip, depsgraph)
        (thread,) = threads(live)
        thread.work.wait(30.0)
        live._attend(strip, depsgraph)
        assert not live._attend(strip, depsgraph)
        assert is_settled(strip)
        assert np.abs(displacement(strip)[is_end(local_points(strip)), 2] - 1.0).max() > 1e-3

    def test_strength(self, modifiers, strip):
        before = local_points(strip)
        lift(bind(), 1.0)
        full = shown_points(strip)
        modifiers.set_input(strip.modifiers["Mesh-Free Deform"], "Strength", 0.5)
        strip.update_tag()
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), 0.5 * (before + full), atol=1e-5)

    def test_an_object_that_is_moved_takes_its_handles_along(self, strip):
        lift(bind(), 1.0)
        moved = displacement(strip)
        strip.scale, strip.location = (-1.0, 2.0, 0.5), (3.0, 0.0, 0.0)
        bpy.context.view_layer.update()
        assert_allclose(displacement(strip), moved, atol=1e-5)

    def test_the_display_comes_after_it_and_shows_lengths(self, display, strip):
        lift(bind(), 1.0)
        bpy.ops.meshfree.colormap(attribute="lb_displacement")
        assert [item.name for item in strip.modifiers] == ["Mesh-Free Deform", "Mesh-Free Display"]
        assert display.range_node(strip).inputs["From Max"].default_value == pytest.approx(1.0, abs=0.1)

    def test_results_are_those_of_the_points_at_rest(self, strip):
        bpy.ops.meshfree.analyze(show=False)
        areas = attribute(strip, "lb_area")
        lift(bind(), 1.0)
        bpy.ops.meshfree.analyze(show=False)
        assert_allclose(attribute(strip, "lb_area"), areas, rtol=1e-5)


class TestManyPoints:
    """Where points are many, some of them carry the others until the handles rest."""

    @pytest.fixture(autouse=True)
    def few(self, core, live, monkeypatch):
        """Take a strip for many points."""
        monkeypatch.setattr(core.deform, "coarse_deformer", functools.partial(core.deform.coarse_deformer, count=300))

    @pytest.fixture
    def unattended(self, live):
        """Let nothing follow by itself, as a script in the background would have it settled at once."""
        handlers = bpy.app.handlers.depsgraph_update_post
        place = [function.__module__ for function in handlers].index(live.__name__)
        following = handlers.pop(place)
        yield
        handlers.insert(place, following)

    def rest(self, live, obj):
        """Do what the timer does, until nothing is left to do."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        live._followed[obj.session_uid].due, seen = 0.0, []
        while live._attend(obj, depsgraph):
            live._followed[obj.session_uid].due = 0.0
            for thread in threads(live):
                thread.work.wait(60.0)
                seen.append(live.is_prepared(live.find(obj)))
        return seen

    def expected(self, core, points):
        """What all points do when the handles go up by 0.7."""
        laplacian = core.build_laplacian(points)
        deformer = core.deform.Deformer(laplacian, is_end(points), points[:, 0] < 0.25)
        return deformer.solve(points[deformer.handles] + (0.0, 0.0, 0.7)) - points

    def test_roughly_while_dragged_and_exactly_at_rest(self, core, live, strip, unattended):
        before = local_points(strip)
        lift(bind(), 0.7)
        assert live.find(strip).exact is None
        live.update(strip, wanted=live.State.QUICK)
        live.update(strip, wanted=live.State.QUICK)
        rough, exact = displacement(strip), self.expected(core, before)
        assert live.find(strip).exact is None
        assert not is_settled(strip)
        assert_allclose(rough[is_end(before)], np.tile([0.0, 0.0, 0.7], (is_end(before).sum(), 1)), atol=1e-5)
        assert 1e-5 < np.abs(rough - exact).max() < 0.05
        assert self.rest(live, strip)
        assert is_settled(strip)
        assert_allclose(displacement(strip), exact, atol=1e-4)

    def test_an_opened_file_follows_before_it_is_exact(self, core, live, strip, unattended):
        before = local_points(strip)
        lift(bind(), 0.7)
        live._forget()
        live.update(strip, wanted=live.State.QUICK)
        assert not displacement(strip).any()
        live._attend(strip, bpy.context.evaluated_depsgraph_get())
        (thread,) = threads(live)
        thread.work.wait(60.0)
        live._attend(strip, bpy.context.evaluated_depsgraph_get())
        assert live.find(strip).exact is None
        assert_allclose(displacement(strip)[is_end(before), 2], 0.7, atol=1e-5)
        assert "Bound: follows its handles" in draw()
        self.rest(live, strip)
        assert_allclose(displacement(strip), self.expected(core, before), atol=1e-4)

    def test_the_panel_tells_that_it_will_be_exact(self, live, strip, unattended):
        bind()
        work = SimpleNamespace(stage="Factors", fraction=0.5)
        live._followed[strip.session_uid].thread = live._Thread(work, None, prepares=True)
        try:
            assert "Follows its handles roughly. Exact soon: Factors, 50%" in " ".join(draw())
        finally:
            live._followed.clear()

    def test_esc_leaves_what_was_dragged(self, core, live, strip, unattended):
        lift(bind(), 0.7)
        live.update(strip, wanted=live.State.QUICK)
        rough = displacement(strip)
        live._followed[strip.session_uid].due = 0.0
        live._attend(strip, bpy.context.evaluated_depsgraph_get())
        (thread,) = threads(live)
        thread.work.stop()
        live._attend(strip, bpy.context.evaluated_depsgraph_get())
        assert not live._attend(strip, bpy.context.evaluated_depsgraph_get())
        assert "The exact result was stopped" in live.state(strip)[1]
        assert_allclose(displacement(strip), rough)

    def test_a_script_waits_for_what_is_exact(self, core, strip):
        before = local_points(strip)
        lift(bind(), 0.7)
        assert_allclose(displacement(strip), self.expected(core, before), atol=1e-4)

    def test_what_is_baked_is_exact(self, live, strip, monkeypatch):
        animate(bind())
        bpy.ops.meshfree.deform_bake()
        bpy.context.scene.frame_set(3)
        baked = shown_points(strip)
        bpy.ops.meshfree.deform_free()
        monkeypatch.undo()
        live._forget()
        bpy.context.scene.frame_set(2)
        bpy.context.scene.frame_set(3)
        assert_allclose(shown_points(strip), baked, atol=1e-5)


class TestFrames:
    """What an animation shows does not depend on the way there."""

    def heights(self, obj, frames):
        """Heights of the points at some frames, in that order."""
        found = {}
        for frame in frames:
            bpy.context.scene.frame_set(frame)
            found[frame] = shown_points(obj)[:, 2]
        return [found[frame] for frame in sorted(found)]

    def test_frames_in_any_order(self, strip):
        animate(bind())
        ends = is_end(local_points(strip))
        forward = self.heights(strip, (1, 2, 3, 4))
        assert_allclose([height[ends].mean() for height in forward], HEIGHTS, atol=1e-4)
        assert_allclose(self.heights(strip, (3, 1, 4, 2)), forward, atol=1e-5)

    def test_a_jump_leaves_factors_to_a_thread_where_it_need_not_wait(self, strip, live, monkeypatch):
        animate(bind())
        bpy.context.scene.frame_set(1)
        live._forget()
        before = displacement(strip)
        asked = []
        monkeypatch.setattr(live, "settle_later", asked.append)
        handlers = bpy.app.handlers.frame_change_post
        place = [function.__module__ for function in handlers].index(live.__name__)
        following = handlers.pop(place)
        others = bpy.app.handlers.depsgraph_update_post
        other = [function.__module__ for function in others].index(live.__name__)
        drawing = others.pop(other)
        try:
            bpy.context.scene.frame_set(3)
            live.update(strip, wanted=live.State.PREPARING)
            assert asked == [strip]
            assert_allclose(displacement(strip), before)
            live.update(strip)  # as a render does
        finally:
            handlers.insert(place, following)
            others.insert(other, drawing)
        assert is_settled(strip)
        assert displacement(strip)[:, 2].max() == pytest.approx(1.5, abs=0.01)

    def test_lock_interface_is_set(self, strip):
        assert not bpy.context.scene.render.use_lock_interface
        bind()
        assert bpy.context.scene.render.use_lock_interface

    def another_process(self, tmp_path, enabled, installed, *codes):
        """Open the file in another Blender, with the extension or without it; return the points of each code."""
        script = textwrap.dedent(f"""
            import bpy, numpy as np
            name = "bl_ext.user_default.meshfree_laplacian"
            if {enabled}:
                bpy.ops.preferences.addon_enable(module=name)
            def shown():
                mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
                points = np.empty((len(mesh.vertices), 3), np.float32)
                mesh.vertices.foreach_get("co", points.reshape(-1))
                return points
            found = []
        """)
        for code in codes:
            script += f"bpy.ops.wm.open_mainfile(filepath={str(tmp_path / 'strip.blend')!r})\n"
            script += f"obj, points = bpy.data.objects['Cloud'], []\n{textwrap.dedent(code)}\nfound.append(points)\n"
        script += f"np.save({str(tmp_path / 'shown.npy')!r}, found)\n"
        script += "import os; os._exit(0)\n"  # disabling it would take its wheels from the other Blender, too
        folder = installed if enabled else tmp_path / "nobody"
        environment = os.environ | {"BLENDER_USER_RESOURCES": str(folder)}
        command = [sys.executable, "-c", script]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240)
        assert done.returncode == 0, done.stderr
        return np.load(tmp_path / "shown.npy")

    FRAMES = """
        for frame in (3, 1, 2, 4):
            bpy.context.scene.frame_set(frame)
            points.append(shown())
        points = [points[i] for i in (1, 2, 0, 3)]
    """
    RENDERED = """
        scene = bpy.context.scene
        scene.render.resolution_x = scene.render.resolution_y = 8
        scene.render.filepath = bpy.app.tempdir
        seen = {}
        def look(scene, depsgraph):
            other = obj.evaluated_get(depsgraph).data
            found = np.empty((len(other.vertices), 3), np.float32)
            other.vertices.foreach_get("co", found.reshape(-1))
            seen[scene.frame_current] = found
        class Engine(bpy.types.RenderEngine):
            bl_idname, bl_label = "LOOK", "Look"
            def update(self, data, depsgraph):
                look(depsgraph.scene, depsgraph)
            def render(self, depsgraph):
                pass
        bpy.utils.register_class(Engine)
        scene.render.engine = "LOOK"
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        bpy.ops.render.render(animation=True)
        bpy.utils.unregister_class(Engine)
        points = [seen[frame] for frame in (1, 2, 3, 4)]
    """

    @pytest.fixture
    def saved(self, strip, tmp_path):
        """Save the animated strip at its last frame, and return what is seen at each."""
        animate(bind())
        frames = []
        for frame in (1, 2, 3, 4):
            bpy.context.scene.frame_set(frame)
            frames.append(shown_points(strip))
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "strip.blend"))
        return np.array(frames)

    def test_an_opened_file_binds_by_itself(self, saved, tmp_path, installed):
        for found in self.another_process(tmp_path, True, installed, self.RENDERED, self.FRAMES):
            assert_allclose(found, saved, atol=2e-5)

    def test_without_the_extension_a_file_shows_the_last_state_and_a_bake_plays(self, saved, tmp_path, installed):
        (shown,) = self.another_process(tmp_path, False, installed, "points = [shown()]")
        assert_allclose(shown[0], saved[-1], atol=1e-5)
        assert bpy.ops.meshfree.deform_bake() == {"FINISHED"}
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "strip.blend"))
        (shown,) = self.another_process(tmp_path, False, installed, self.FRAMES)
        assert_allclose(shown, saved, atol=1e-5)


class TestBake:
    """The animation in the file."""

    def test_between_and_beyond_its_frames(self, strip):
        animate(bind())
        assert bpy.ops.meshfree.deform_bake(first=2, last=4) == {"FINISHED"}
        ends = is_end(local_points(strip))
        found = {}
        for frame, subframe in ((1, 0.0), (2, 0.0), (2, 0.5), (3, 0.0), (4, 0.0), (9, 0.0)):
            bpy.context.scene.frame_set(frame, subframe=subframe)
            found[frame + subframe] = shown_points(strip)[ends, 2].mean()
        expected = {1: 0.5, 2: 0.5, 2.5: 1.0, 3: 1.5, 4: -1.0, 9: -1.0}
        assert found == pytest.approx(expected, abs=1e-4)

    def test_the_frame_on_show_and_the_handles_stay(self, strip):
        empty = bind()
        animate(empty)
        bpy.context.scene.frame_set(3)
        bpy.ops.meshfree.deform_bake()
        assert bpy.context.scene.frame_current == 3
        assert shown_points(strip)[:, 2].max() == pytest.approx(1.5, abs=0.01)

    def test_delete_bake(self, strip):
        empty = bind()
        bpy.ops.meshfree.deform_bake(first=1, last=2)
        with pytest.raises(RuntimeError, match="baked. Delete the bake"):
            bpy.ops.meshfree.deform_update()
        lift(empty, 1.0)
        assert shown_points(strip)[:, 2].max() < 1e-6
        blocks = len(bpy.data.objects), len(bpy.data.meshes)
        assert bpy.ops.meshfree.deform_free() == {"FINISHED"}
        assert (len(bpy.data.objects), len(bpy.data.meshes)) == (blocks[0] - 1, blocks[1] - 1)
        assert shown_points(strip)[is_end(local_points(strip)), 2] == pytest.approx(1.0, abs=1e-4)

    def test_what_has_no_keyframe_stays(self, strip):
        empty = bind()
        animate(empty)
        bpy.context.scene.frame_set(3)
        empty.location.x += 0.25
        empty.location.z -= 0.5
        bpy.context.view_layer.update()
        place, shown = empty.location.copy(), shown_points(strip)
        bpy.ops.meshfree.deform_bake()
        bpy.ops.meshfree.deform_free()
        assert empty.location == place
        assert_allclose(shown_points(strip), shown, atol=1e-5)

    @pytest.fixture
    def stepped(self, strip):
        """A bake in steps, as a window takes them, at frame 3."""
        animate(bind())
        bpy.context.scene.frame_set(3)
        bake = part("operators.deform.bake")
        operator = SimpleNamespace(first=1, last=4, bl_label="Bake", _kept=bake._Kept(bpy.context.scene, strip))
        operator._frames = lambda progress: bake.MESHFREE_OT_deform_bake._frames(operator, progress)
        return operator, bake

    def test_stopped_half_way(self, stepped, strip):
        before = everything(strip)
        operator, _ = stepped
        steps = operator._frames(lambda stage, fraction: None)
        next(steps), next(steps)
        assert everything(strip) != before
        operator._kept.put_back()
        assert everything(strip) == before
        assert bpy.context.scene.frame_current == 3

    @pytest.mark.parametrize("what", ["handle", "frame"])
    def test_what_is_changed_meanwhile(self, core, stepped, strip, what):
        operator, _ = stepped
        steps = operator._frames(lambda stage, fraction: None)
        next(steps), next(steps)
        if what == "handle":
            bpy.data.objects["Cloud Handle"].rotation_euler.x = 0.5
        else:
            bpy.context.scene.frame_set(4)
        with pytest.raises(core.PointCloudError, match="were changed meanwhile. Nothing was baked"):
            next(steps)
        operator._kept.put_back()
        assert bpy.context.scene.frame_current == 3
        assert (bpy.data.objects["Cloud Handle"].rotation_euler.x == 0.5) == (what == "handle")

    def test_edit_mode_meanwhile(self, stepped, strip):
        operator, _ = stepped
        before = everything(strip)
        steps = operator._frames(lambda stage, fraction: None)
        next(steps), next(steps)
        bpy.ops.object.mode_set(mode="EDIT")
        next(steps)
        operator._kept.put_back()
        bpy.ops.object.mode_set(mode="OBJECT")
        after = everything(strip)
        assert after["attributes"]["lb_displacement"] == before["attributes"]["lb_displacement"]
        assert after["data properties"] == before["data properties"]
        assert after["scene"] == before["scene"]

    @pytest.mark.parametrize("count", [0, 2])
    def test_the_scene_is_deleted_meanwhile(self, core, stepped, strip, count):
        operator, _ = stepped
        bpy.data.scenes.new("Other").collection.objects.link(strip)
        steps = operator._frames(lambda stage, fraction: None)
        for _ in range(count):
            next(steps)
        bpy.data.scenes.remove(bpy.context.scene)
        with pytest.raises(core.PointCloudError, match="scene was deleted meanwhile. Nothing was baked"):
            next(steps)
        operator._kept.put_back()

    def test_factors_are_made_first_beside_the_window(self, stepped, strip, live):
        operator, bake = stepped
        live._forget()
        told = []
        steps = bake.MESHFREE_OT_deform_bake._prepared_frames(operator, lambda *progress: told.append(progress))
        while live.find(strip) is None:
            time.sleep(0.01)  # as a window's timer leaves the processor to the thread
            next(steps)
        assert {stage for stage, _ in told} - {"Frames"}
        assert len(bake.all_steps(steps)) == 4

    def test_frames_in_the_wrong_order(self, strip):
        bind()
        with refused(strip, "The last frame, 2, comes before the first one, 5"):
            bpy.ops.meshfree.deform_bake(first=5, last=2)


class TestTakingOver:
    """Apply, To Shape Key, Reset and Unbind."""

    def test_apply(self, strip):
        empty = bind()
        lift(empty, 1.0)
        seen = shown_points(strip)
        assert bpy.ops.meshfree.deform_apply() == {"FINISHED"}
        assert_allclose(local_points(strip), seen, atol=1e-6)
        assert_allclose(attribute(strip, "lb_rest"), seen, atol=1e-6)
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), seen, atol=1e-6)
        lift(empty, 0.5)  # from there on
        assert_allclose(displacement(strip)[is_end(seen), 2], 0.5, atol=1e-4)

    def test_apply_of_animated_handles_stays(self, strip, capfd):
        empty = bind()
        animate(empty)
        empty["note"] = 1.0
        empty.keyframe_insert('["note"]', frame=1)
        bpy.context.scene.frame_set(3)
        seen = shown_points(strip)
        capfd.readouterr()
        assert bpy.ops.meshfree.deform_apply() == {"FINISHED"}
        assert 'keyframes that moved "Cloud Handle" were removed' in capfd.readouterr().out
        for frame in (1, 2, 3, 4):
            bpy.context.scene.frame_set(frame)
            assert_allclose(shown_points(strip), seen, atol=1e-6)
        assert [curve.data_path for curve in curves_of(empty)] == ['["note"]']  # which moves nothing

    def test_apply_that_keeps_the_keyframes(self, strip):
        empty = bind()
        animate(empty)
        bpy.context.scene.frame_set(3)
        seen = shown_points(strip)
        assert bpy.ops.meshfree.deform_apply(keep_keyframes=True) == {"FINISHED"}
        assert_allclose(shown_points(strip), seen, atol=1e-6)
        bpy.context.scene.frame_set(1)
        assert_allclose(shown_points(strip)[is_end(seen), 2], 0.0, atol=1e-4)

    def test_apply_leaves_an_action_that_others_use(self, strip):
        empty = bind()
        animate(empty)
        empty["note"] = 1.0
        empty.keyframe_insert('["note"]', frame=1)
        action = empty.animation_data.action
        other = bpy.data.objects.new("Other", None)
        other.animation_data_create().action = action
        if hasattr(action, "slots"):  # Blender 4.4 on
            other.animation_data.action_slot = action.slots[0]
        bpy.context.scene.frame_set(3)
        bpy.ops.meshfree.deform_apply()
        assert [curve.data_path for curve in curves_of(empty)] == ['["note"]']
        assert len(curves_of(other)) == 4

    def test_apply_of_animated_handles_is_undone_as_one_step(self, strip):
        empty = bind()
        animate(empty)
        bpy.context.scene.frame_set(3)
        bpy.ops.ed.undo_push(message="Animated")
        name, before = empty.name, everything(strip)
        bpy.ops.meshfree.deform_apply("EXEC_DEFAULT", True)
        bpy.ops.ed.undo()
        assert everything(bpy.data.objects["Cloud"]) == before
        assert len(curves_of(bpy.data.objects[name])) == 3

    def test_apply_of_handles_moved_themselves(self, strip):
        ends = is_end(local_points(strip))
        bind(add_empties=False)
        move_points(strip, ends, (0.0, 0.0, 1.0))
        seen = shown_points(strip)
        bpy.ops.meshfree.deform_apply()
        assert_allclose(local_points(strip), seen, atol=1e-6)
        assert not displacement(strip).any()

    def test_to_shape_key(self, strip, binding):
        before = local_points(strip)
        empty = bind()
        lift(empty, 1.0)
        seen = shown_points(strip)
        assert bpy.ops.meshfree.deform_to_shape_key() == {"FINISHED"}
        assert_allclose(key_points(strip, "Deform"), seen, atol=1e-6)
        assert empty.location.z == pytest.approx(0.0, abs=1e-6)
        assert_allclose(shown_points(strip), before, atol=1e-6)
        assert binding.stale_reason(strip) == ""
        lift(empty, -0.5)
        assert_allclose(displacement(strip)[is_end(before), 2], -0.5, atol=1e-5)
        bpy.ops.meshfree.deform_to_shape_key()
        assert [key.name for key in strip.data.shape_keys.key_blocks] == ["Basis", "Deform", "Deform.001"]
        strip.data.shape_keys.key_blocks["Deform"].value = 1.0
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), seen, atol=1e-5)

    def test_a_shape_key_of_handles_moved_themselves(self, strip):
        bind(add_empties=False)
        with refused(strip, "Add Empties"):
            bpy.ops.meshfree.deform_to_shape_key()

    @pytest.mark.parametrize("add_empties", [True, False])
    def test_reset(self, strip, add_empties):
        before = local_points(strip)
        empty = bind(add_empties=add_empties)
        if add_empties:
            empty.rotation_euler.x = 0.3
            lift(empty, 1.0)
        else:
            move_points(strip, is_end(before), (0.0, 0.0, 1.0))
        assert displacement(strip).max() > 0.5
        assert bpy.ops.meshfree.deform_reset() == {"FINISHED"}
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), before, atol=1e-6)
        assert_allclose(local_points(strip), before, atol=1e-6)
        assert not displacement(strip).any()
        if add_empties:
            assert tuple(empty.rotation_euler) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)

    def test_unbind(self, strip):
        before = everything(strip)
        lift(bind(), 1.0)
        assert bpy.ops.meshfree.deform_unbind() == {"FINISHED"}
        after = everything(strip)
        assert after["blocks"].pop("GeometryNodeTree") == 1
        for record in (before, after):  # the lock stays, and what tells of a binding means nothing without one
            record.pop("scene"), record["settings"].pop("deform")
        assert after == before


class TestHolding:
    """Whether the binding holds, and why not."""

    def test_it_holds(self, strip, binding):
        lift(bind(), 1.0)
        assert binding.stale_reason(strip) == ""

    @pytest.mark.parametrize(
        ("change", "text"),
        [
            (lambda obj: move_points(obj, 100, (0.0, 0.0, 0.01)), "points at rest were moved"),
            (lambda obj: obj.data.vertices.add(3), "had 720 points and has 723 now"),
            (lambda obj: obj.vertex_groups["Handle"].remove([719]), "groups of handles or anchors changed"),
            (lambda obj: add_group(obj, "Handle.001", [330]), "groups of handles or anchors changed"),
            (lambda obj: setattr(obj.meshfree, "neighbors", 40), "Settings changed"),
            (lambda obj: bpy.data.objects.remove(bpy.data.objects["Cloud Handle"]), "empty of Handle was deleted"),
            (lambda obj: obj.modifiers.clear(), "modifier.*was removed"),
            (lambda obj: obj.data.attributes.remove(obj.data.attributes["lb_rest"]), "attributes.*were removed"),
        ],
    )
    def test_what_lets_go(self, strip, binding, change, text):
        empty = bind()
        lift(empty, 0.5)
        change(strip)
        bpy.context.view_layer.update()
        assert re.search(text, binding.stale_reason(strip))
        kept = None if "lb_displacement" not in strip.data.attributes else displacement(strip)[:720]
        if "Cloud Handle" in bpy.data.objects:
            lift(bpy.data.objects["Cloud Handle"], 0.5)  # nothing follows
            assert_allclose(displacement(strip)[:720], kept)
        with pytest.raises(RuntimeError, match=f"(?s)not up to date.*{text}"):
            bpy.ops.meshfree.deform_update()
        assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
        assert binding.stale_reason(strip) == ""

    def test_binding_again_keeps_the_pose(self, strip):
        empty = bind()
        lift(empty, 1.0)
        assert bind() == empty
        assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], 1.0, atol=1e-5)
        assert len([obj for obj in bpy.data.objects if obj.type == "EMPTY"]) == 1

    def test_two_that_share_the_mesh_and_have_the_same_free_empty(self, strip, binding):
        empty = bind()
        empty.parent = None  # so that it is not told which one is the copy
        other = strip.copy()
        bpy.context.scene.collection.objects.link(other)
        assert "shares its mesh" in binding.stale_reason(strip)
        other.data = other.data.copy()
        assert binding.stale_reason(strip) == ""

    def test_an_object_scaled_to_nothing_is_left_alone(self, strip, live):
        bind()
        strip.scale.x = 0.0
        bpy.context.view_layer.update()
        assert "scaled to nothing along an axis" in live.state(strip)[1]
        with pytest.raises(RuntimeError, match="scaled to nothing along an axis"):
            bpy.ops.meshfree.deform_update()
        strip.scale.x = 1.0
        bpy.context.view_layer.update()
        assert live.state(strip)[1] == ""

    def test_a_mesh_that_another_object_edits(self, strip):
        bind(add_empties=False)
        other = strip.copy()
        other.meshfree.deform.is_bound = False
        bpy.context.scene.collection.objects.link(other)
        strip.data.vertices.foreach_set("select", is_end(local_points(strip)))
        bpy.context.view_layer.objects.active = other
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.transform.translate(value=(0.0, 0.0, 0.8))
        bpy.context.view_layer.update()
        bpy.ops.object.mode_set(mode="OBJECT")
        assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], 0.8, atol=1e-5)

    def test_a_copy_keeps_what_it_shares(self, strip):
        animate(bind())
        bpy.ops.meshfree.deform_bake()
        copy = strip.copy()
        copy.data = strip.data.copy()
        bpy.context.scene.collection.objects.link(copy)
        assert bpy.ops.meshfree.deform_free() == {"FINISHED"}
        bpy.context.scene.frame_set(3)
        assert_allclose(shown_points(copy)[is_end(local_points(copy)), 2], 1.5, atol=1e-4)
        assert bpy.ops.meshfree.deform_unbind() == {"FINISHED"}
        assert [item.empty.name for item in copy.meshfree.deform.handle_items] == ["Cloud Handle"]
        bpy.context.view_layer.objects.active = copy
        assert bpy.ops.meshfree.deform_unbind() == {"FINISHED"}
        assert [obj.name for obj in bpy.data.objects] == ["Cloud", "Cloud.001"]
        assert len(bpy.data.meshes) == 2

    def test_weights_of_the_groups_count(self, strip, binding):
        bind(soft=True)
        strip.vertex_groups["Handle"].add([719], 0.5, "REPLACE")
        assert "groups of handles or anchors changed" in binding.stale_reason(strip)
        strip.vertex_groups["Handle"].add([719], 1.0, "REPLACE")
        assert binding.stale_reason(strip) == ""

    def test_settings_of_modifiers_that_are_used(self, strip, binding):
        wave = strip.modifiers.new("Displace", "DISPLACE")
        wave.strength = 0.0
        strip.meshfree.use_modifiers = True
        bind()
        wave.show_expanded = not wave.show_expanded
        assert binding.stale_reason(strip) == ""
        wave.strength = 0.5
        assert "points at rest were moved" in binding.stale_reason(strip)
        wave.strength = 0.0
        assert binding.stale_reason(strip) == ""

    def test_inputs_of_nodes_that_are_used(self, strip, binding, modifiers):
        group = modifiers.new_group("Try", "own", [("Amount", "Float", "Of something")])
        del group["own"]
        used = strip.modifiers.new("Try", "NODES")
        used.node_group = group
        strip.meshfree.use_modifiers = True
        given, result = (group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput"))
        group.links.new(given.outputs["Geometry"], result.inputs["Geometry"])
        bind()
        modifiers.set_input(used, "Amount", 2.0)
        assert "points at rest were moved" in binding.stale_reason(strip)

    def test_an_input_that_somebody_renames_or_removes(self, core, strip, binding, modifiers):
        empty = bind()
        modifier = strip.modifiers["Mesh-Free Deform"]
        sockets = modifier.node_group.interface
        sockets.items_tree["Strength"].name = "Amount"
        modifiers.set_input(modifier, "Strength", 0.5)
        assert modifiers.get_input(modifier, "Strength") == 0.5
        assert "Strength" in draw()
        sockets.remove(sockets.items_tree["Amount"])
        with pytest.raises(core.PointCloudError, match='have no input "Strength" any more. Undo that'):
            modifiers.get_input(modifier, "Strength")
        assert "an input of its nodes was removed. Bind again" in binding.stale_reason(strip)
        assert "Bind Again" in draw()
        strip.modifiers.remove(modifier)
        bind()
        lift(empty, 1.0)
        assert_allclose(shown_points(strip)[is_end(local_points(strip)), 2], 1.0, atol=1e-4)

    def test_new_names_do_not_matter(self, strip):
        empty = bind()
        empty.name, strip.name = "Lever", "Strip"
        lift(empty, 1.0)
        assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], 1.0, atol=1e-5)


class TestUndo:
    """Undo and redo give a state that holds."""

    def test_a_move(self, strip, binding):
        bind()
        bpy.ops.ed.undo_push(message="Bound")
        lift(bpy.data.objects["Cloud Handle"], 1.0)
        bpy.ops.ed.undo_push(message="Moved")
        lift(bpy.data.objects["Cloud Handle"], 1.0)
        bpy.ops.ed.undo_push(message="Moved again")
        for step, height in ((bpy.ops.ed.undo, 1.0), (bpy.ops.ed.undo, 0.0), (bpy.ops.ed.redo, 1.0)):
            step()
            strip = bpy.data.objects["Cloud"]
            assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], height, atol=1e-5)
            assert binding.stale_reason(strip) == ""

    def test_binding(self, strip):
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.meshfree.deform_bind("EXEC_DEFAULT", True)
        bpy.ops.ed.undo()
        strip = bpy.data.objects["Cloud"]
        assert not strip.meshfree.deform.is_bound
        assert not strip.modifiers
        bpy.ops.ed.redo()
        strip = bpy.data.objects["Cloud"]
        lift(bpy.data.objects["Cloud Handle"], 1.0)
        assert_allclose(displacement(strip)[is_end(local_points(strip)), 2], 1.0, atol=1e-5)

    def test_applying(self, strip):
        lift(bind(), 1.0)
        bpy.ops.ed.undo_push(message="Moved")
        seen = shown_points(strip)
        bpy.ops.meshfree.deform_apply("EXEC_DEFAULT", True)
        bpy.ops.ed.undo()
        strip = bpy.data.objects["Cloud"]
        bpy.context.view_layer.update()
        assert_allclose(shown_points(strip), seen, atol=1e-5)
        assert displacement(strip).max() > 0.5

    @pytest.mark.parametrize("bound", [False, True])
    def test_handlers_evaluate_the_scene_only_for_bound_objects(self, strip, bound):
        if bound:
            bind()
        bpy.ops.ed.undo_push(message="Ready")
        strip.location.x = 1.0
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="Moved")
        evaluated, then = [], []
        handlers = bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.undo_post
        handlers[0].append(bpy.app.handlers.persistent(lambda scene, depsgraph: evaluated.append(scene)))
        handlers[1].append(bpy.app.handlers.persistent(lambda *_: then.append(len(evaluated))))
        try:
            bpy.ops.ed.undo()
        finally:
            for functions in handlers:
                functions.pop()
        assert then == [int(bound)]


class TestFinding:
    """Bound objects are found among all others without a look at these."""

    @pytest.fixture
    def looked(self, binding, monkeypatch):
        """Count how many objects are looked at."""
        seen, known = [], binding.is_bound
        monkeypatch.setattr(binding, "is_bound", lambda obj: seen.append(obj) or known(obj))
        return seen

    def names(self, binding):
        return [obj.name for obj in binding.bound_objects(bpy.context.scene)]

    def test_only_once(self, strip, binding, looked):
        for number in range(50):
            add_object(local_points(strip)[:3], f"Other {number}")
        bpy.context.view_layer.objects.active = strip
        bind()
        assert self.names(binding) == ["Cloud"]
        looked.clear()
        assert self.names(binding) == ["Cloud"]
        assert looked == []

    def test_after_every_change(self, strip, binding):
        other = add_object(local_points(strip), "Other")
        assert self.names(binding) == []
        bpy.context.view_layer.objects.active = strip
        bind()
        assert self.names(binding) == ["Cloud"]
        strip.name = "Zebra"  # in another place of the list
        assert self.names(binding) == ["Zebra"]
        bpy.data.objects.remove(other)
        assert self.names(binding) == ["Zebra"]
        copy = strip.copy()
        assert self.names(binding) == ["Zebra"]  # it is in no scene
        bpy.context.scene.collection.objects.link(copy)
        assert self.names(binding) == ["Zebra", "Zebra.001"]
        copy.hide_viewport = copy.hide_render = True
        assert self.names(binding) == ["Zebra", "Zebra.001"]
        copy.meshfree.deform.is_bound = False
        assert self.names(binding) == ["Zebra"]
        bpy.ops.ed.undo_push(message="Bound")
        assert bpy.ops.meshfree.deform_unbind("EXEC_DEFAULT", True) == {"FINISHED"}
        assert self.names(binding) == []
        bpy.ops.ed.undo()
        assert self.names(binding) == ["Zebra"]
        bpy.ops.wm.read_homefile(use_empty=True)
        assert self.names(binding) == []

    def test_an_empty_that_is_hidden_is_there_and_a_deleted_one_is_not(self, strip, binding):
        empty = bind()
        empty.hide_viewport = True
        assert binding.is_there(empty)
        bpy.context.scene.collection.objects.unlink(empty)
        assert not binding.is_there(empty)
        assert "empty of Handle was deleted" in binding.stale_reason(strip)


class TestMemory:
    """What is kept ends with what it is for."""

    def test_factors_end_with_their_binding_and_with_the_file(self, strip, live):
        bind()
        bind()
        assert len(live._followers) == 1
        bpy.ops.wm.read_homefile(use_empty=True)
        assert not live._followers


class TestBadInput:
    """What cannot be bound stays as it is."""

    @pytest.mark.parametrize(
        ("settings", "text"),
        [
            ({"handles": "Nowhere"}, 'no vertex group named "Nowhere"'),
            ({"handles": ""}, "no Handles chosen.*Edit Mode"),
            ({"anchors": "Handle"}, "handles and anchors|both"),
            ({"handles": "Handle", "add_empties": False}, "36 handles.*Turn on Add Empties"),
        ],
    )
    def test_settings_that_do_not_fit(self, strip, settings, text):
        strip.shape_key_add(name="Basis")  # which empties alone can bend
        for name, value in settings.items():
            setattr(strip.meshfree.deform, name, value)
        with refused(strip, text):
            bpy.ops.meshfree.deform_bind()

    def test_points_in_two_handles(self, strip):
        add_group(strip, "Handle.001", [719, 718])
        with refused(strip, "2 points.*more than one of the groups Handle, Handle.001"):
            bpy.ops.meshfree.deform_bind()

    @pytest.mark.parametrize("name", ["update", "apply", "reset", "to_shape_key", "unbind", "bake", "free"])
    def test_what_is_not_bound(self, strip, name):
        with refused(strip, "not bound.*Bind it"):
            getattr(bpy.ops.meshfree, f"deform_{name}")()


class TestAddHandle:
    """A group of its own for the selected points."""

    @pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
    def test_numbered_groups(self, strip, mode):
        strip.data.vertices.foreach_set("select", np.arange(720) % 60 == 30)
        bpy.ops.object.mode_set(mode=mode)
        assert bpy.ops.meshfree.handle_add() == {"FINISHED"}
        assert bpy.context.object.mode == mode
        bpy.ops.object.mode_set(mode="OBJECT")
        assert list(strip.vertex_groups.keys()) == ["Anchor", "Handle", "Handle.001"]
        bind()
        assert [item.name for item in strip.meshfree.deform.handle_items] == ["Handle", "Handle.001"]

    def test_a_point_has_one_handle(self, strip):
        strip.data.vertices.foreach_set("select", np.arange(720) % 60 == 59)
        bpy.ops.meshfree.handle_add()
        held = [[item.group for item in strip.data.vertices[index].groups] for index in (719, 718)]
        assert held == [[2], [1]]


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="needs a conversion to Point Cloud")
class TestPointCloud:
    """The same for Point Cloud objects, whose groups are attributes."""

    @pytest.fixture
    def cloud(self, strip):
        groups = {group.name: strip.vertex_groups[group.name] for group in strip.vertex_groups}
        chosen = {
            name: [any(item.group == group.index for item in vertex.groups) for vertex in strip.data.vertices]
            for name, group in groups.items()
        }
        strip.vertex_groups.clear()
        strip.select_set(True)
        bpy.ops.object.convert(target="POINTCLOUD")
        obj = bpy.context.object
        assert obj.type == "POINTCLOUD"
        for name, members in chosen.items():
            layer = obj.data.attributes.get(name)
            if layer is not None:
                obj.data.attributes.remove(layer)
            obj.data.attributes.new(name, "BOOLEAN", "POINT").data.foreach_set("value", members)
        return obj

    def shown(self, obj):
        data = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        points = np.empty((len(data.points), 3), np.float32)
        data.attributes["position"].data.foreach_get("vector", points.reshape(-1))
        return points

    def test_following_and_taking_over(self, cloud):
        before = local_points(cloud)
        lift(bind(), 1.0)
        shown = self.shown(cloud)
        assert_allclose(shown[is_end(before), 2], 1.0, atol=1e-5)
        assert 0.1 < shown[np.abs(before[:, 0] - 4.0) < 0.1, 2].mean() < 1.0
        bpy.ops.meshfree.deform_apply()
        assert_allclose(local_points(cloud), shown, atol=1e-6)

    def test_bake(self, cloud):
        animate(bind())
        bpy.ops.meshfree.deform_bake()
        ends = is_end(local_points(cloud))
        for frame, height in enumerate(HEIGHTS, start=1):
            bpy.context.scene.frame_set(frame)
            assert_allclose(self.shown(cloud)[ends, 2], height, atol=1e-4)

    def test_a_modifier_takes_the_place_of_a_shape_key(self, cloud, modifiers, binding):
        before, empty = local_points(cloud), bind()
        lift(empty, 1.0)
        seen = self.shown(cloud)
        assert bpy.ops.meshfree.deform_to_shape_key() == {"FINISHED"}
        assert empty.location.z == pytest.approx(0.0, abs=1e-6)
        assert_allclose(self.shown(cloud), before, atol=1e-6)
        assert binding.stale_reason(cloud) == ""
        modifiers.set_input(cloud.modifiers["Deform"], "Value", 0.5)
        cloud.update_tag()
        bpy.context.view_layer.update()
        assert_allclose(self.shown(cloud), 0.5 * (before + seen), atol=1e-5)
        lift(empty, -0.5)
        bpy.ops.meshfree.deform_to_shape_key()
        assert [item.name for item in cloud.modifiers][:2] == ["Deform.001", "Deform"]
        bpy.ops.meshfree.deform_unbind()
        modifiers.set_input(cloud.modifiers["Deform"], "Value", 1.0)
        cloud.update_tag()
        bpy.context.view_layer.update()
        assert_allclose(self.shown(cloud), seen, atol=1e-5)


class TestPanel:
    """What the panel says, for the object and for its empties."""

    def texts(self):
        return " ".join(draw())

    def test_before_binding(self, strip):
        assert "Bind" in draw()
        assert "Bind Again" not in draw()

    def test_while_it_holds_and_when_it_does_not(self, strip):
        empty = bind()
        assert "Bound: follows its handles" in draw()
        assert "Strength" in draw()
        bpy.context.view_layer.objects.active = empty
        assert "Bound: follows its handles" in draw()
        assert "Moves handles of Cloud" in draw()
        assert "not a Mesh" not in self.texts()
        for name in ("bake", "free", "reset", "apply"):
            assert getattr(bpy.ops.meshfree, f"deform_{name}")() == {"FINISHED"}
        move_points(strip, 100, 1.0)
        assert "Not up to date. The points at rest were moved. Bind again" in self.texts()

    def test_lock_interface_is_asked_for(self, strip):
        bind()
        assert "use_lock_interface" not in draw()
        bpy.context.scene.render.use_lock_interface = False
        assert "use_lock_interface" in draw()

    def test_baked(self, strip):
        bind()
        assert "Bake" in draw()
        bpy.ops.meshfree.deform_bake(first=1, last=2)
        assert "Delete Bake" in draw()
        assert "Baked." in self.texts()

    def test_while_it_binds_and_when_that_was_stopped(self, strip, live, core):
        bind()
        live._followers.clear()
        work = SimpleNamespace(stage="Areas", fraction=0.5)
        live._followed[strip.session_uid].thread = live._Thread(work, None, prepares=True)
        try:
            assert "Not up to date. Binding: Areas, 50%" in self.texts()
        finally:
            live._followed.clear()
        stopped = "Binding was stopped. Press Update, or move a handle"
        live._followed[strip.session_uid].trouble = stopped
        assert "Not up to date. Binding was stopped. Press Update, or move a handle" in self.texts()

    def test_buttons_for_the_object_of_the_empty(self, strip):
        empty = bind()
        strip.meshfree.neighbors = 40
        bpy.context.view_layer.objects.active = empty
        assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
        lift(empty, 1.0)
        assert bpy.ops.meshfree.deform_update() == {"FINISHED"}
        assert displacement(strip)[:, 2].max() == pytest.approx(1.0, abs=0.01)

    def test_in_edit_mode(self, strip):
        bind(add_empties=False)
        bpy.ops.object.mode_set(mode="EDIT")
        assert "Bound: follows its handles" in draw()
        bpy.ops.object.mode_set(mode="OBJECT")


def keep_four(obj):
    """Leave four points of an object."""
    obj.data.clear_geometry()
    obj.data.from_pydata(np.eye(4)[:, :3].tolist(), [], [])


class TestAtOnce:
    """One click chooses the handles, where there are none, and binds them."""

    @pytest.fixture
    def pole(self):
        """An upright strip without groups, six long."""
        points, _ = grid_points(columns=60, rows=12, step=0.1, jitter=0.0)
        obj = add_object(points[:, [2, 1, 0]])
        obj.select_set(True)
        return obj

    def members(self, obj, name):
        index = obj.vertex_groups[name].index
        held = [any(item.group == index for item in vertex.groups) for vertex in obj.data.vertices]
        return np.flatnonzero(held)

    def test_the_upper_end_moves_and_the_lower_one_stays(self, pole):
        assert bpy.ops.meshfree.deform_bind(at_once=True) == {"FINISHED"}
        rest = local_points(pole)
        moved, kept = self.members(pole, "Handle"), self.members(pole, "Anchor")
        assert 3 <= len(moved) < 0.06 * len(rest)
        assert rest[moved, 2].min() > 4.5
        assert rest[kept, 2].max() < 1.5
        empty = bpy.context.object  # ready to be moved by G and R
        assert (empty.type, empty.name, bpy.context.selected_objects) == ("EMPTY", "Cloud Handle", [empty])
        empty.location.x += 1.0
        bpy.context.view_layer.update()
        bpy.ops.meshfree.deform_update()
        shift = attribute(pole, "lb_displacement")
        assert_allclose(shift[moved], np.tile([1.0, 0.0, 0.0], (len(moved), 1)), atol=1e-4)
        assert_allclose(shift[kept], 0.0, atol=1e-4)
        middle = np.abs(rest[:, 2] - 3.0) < 0.2
        assert 0.2 < shift[middle, 0].mean() < 0.8

    def test_the_turn_of_the_object_counts(self, pole):
        pole.rotation_euler.y = np.pi
        bpy.context.view_layer.update()
        bpy.ops.meshfree.deform_bind(at_once=True)
        assert local_points(pole)[self.members(pole, "Handle"), 2].max() < 1.5

    def test_groups_that_are_there_are_used_as_they_are(self, strip):
        handles, anchors = self.members(strip, "Handle"), self.members(strip, "Anchor")
        assert bpy.ops.meshfree.deform_bind(at_once=True) == {"FINISHED"}
        assert_array_equal(self.members(strip, "Handle"), handles)
        assert_array_equal(self.members(strip, "Anchor"), anchors)
        assert [group.name for group in strip.vertex_groups] == ["Anchor", "Handle"]
        assert bpy.context.object.name == "Cloud Handle"

    def test_the_end_far_from_anchors_moves(self, pole):
        rest = local_points(pole)
        add_group(pole, "Anchor", rest[:, 2] > 5.0)
        bpy.ops.meshfree.deform_bind(at_once=True)
        assert_array_equal(self.members(pole, "Anchor"), np.flatnonzero(rest[:, 2] > 5.0))
        assert rest[self.members(pole, "Handle"), 2].max() < 1.5

    def test_it_stays_bound_and_fresh(self, pole, binding):
        bpy.ops.meshfree.deform_bind(at_once=True)
        assert binding.stale_reason(pole) == ""
        before = {name: self.members(pole, name).tolist() for name in ("Handle", "Anchor")}
        assert bpy.ops.meshfree.deform_bind(at_once=True) == {"FINISHED"}  # from the empty, which is active
        assert {name: self.members(pole, name).tolist() for name in before} == before
        assert sum(obj.type == "EMPTY" for obj in bpy.data.objects) == 1

    @pytest.mark.parametrize(
        ("change", "at_once", "text"),
        [
            (lambda obj: None, False, "no vertex group named"),
            (lambda obj: add_group(obj, "Anchor", np.ones(720, dtype=bool)), True, "Error"),
            (keep_four, True, "Error"),
            (lambda obj: obj.data.attributes.new("Anchor", "FLOAT", "POINT"), True, 'an attribute named "Anchor"'),
        ],
        ids=["not at once", "anchors all over", "a few points", "a name that an attribute has"],
    )
    def test_what_cannot_be_bound(self, pole, change, at_once, text):
        change(pole)
        with refused(pole, text):
            bpy.ops.meshfree.deform_bind(at_once=at_once)
        assert bpy.context.object == pole

    def test_one_undo_takes_it_back(self, pole):
        bpy.ops.ed.undo_push(message="Before")
        before = everything(pole)
        bpy.ops.meshfree.deform_bind("EXEC_DEFAULT", True, at_once=True)
        bpy.ops.ed.undo()
        obj = bpy.data.objects["Cloud"]
        assert everything(obj) == before
        assert not obj.vertex_groups
        assert len(bpy.data.objects) == 1

    @pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")
    def test_of_point_clouds_the_groups_are_attributes(self, pole):
        bpy.ops.meshfree.convert()
        assert bpy.ops.meshfree.deform_bind(at_once=True) == {"FINISHED"}
        cloud = next(obj for obj in bpy.data.objects if obj.type == "POINTCLOUD")
        assert {"Handle", "Anchor"} <= {*cloud.data.attributes.keys()}
