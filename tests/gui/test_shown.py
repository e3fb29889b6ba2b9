"""What is shown follows what the user does: points that go, objects that are deleted, views, and the legend."""

import pytest

from tests.gui.test_measures import edit
from tests.gui.test_panels import COLORED, opened  # noqa: F401
from tests.gui.test_play import add_sphere, finish, shading

COUNT = "len(bpy.context.object.data.vertices)"
FRESH = "bpy.context.object.meshfree.discs_of == bpy.context.object.meshfree.spacing_of != known"
SHADING = "view3d()[0].spaces.active.shading.type"
# How many points of the active object lie behind its legend, and the size of that beside those of its texts.
COVERED = """
from bl_ext.user_default.meshfree_laplacian.ui import canvas, overlay
area, region, _ = view3d()
with bpy.context.temp_override(window=main_window(), area=area, region=region):
    context, obj = bpy.context, bpy.context.object
    [(picture, corner), *_], placed = overlay.in_view(context, obj)
    places, low = overlay.seen_places(context, obj), np.array(corner)
    behind = ((places > low) & (places < low + placed.size)).all(axis=1).sum()
ends = [text.x + canvas.text_width(text.text) for text in picture.texts]
(int(behind), [float(value) for value in corner], picture.width - max(ends))
"""


def with_surface(gui, count):
    add_sphere(gui, count)
    gui.python("bpy.ops.meshfree.show_surface(); known = bpy.context.object.meshfree.discs_of; bpy.ops.ed.undo_push()")


MOVED = """
from bpy_extras.view3d_utils import region_2d_to_location_3d
_, region, space = view3d()[0], view3d()[1], view3d()[0].spaces.active
behind = region_2d_to_location_3d(region, space.region_3d, ({}, {}), (0.0, 0.0, 0.0))
bpy.context.object.location = behind
"""


@pytest.mark.parametrize("count", [3000, 90_000])  # at once, and in a thread
def test_discs_follow_thinning(gui, count):
    with_surface(gui, count)
    gui.search("Mesh-Free Thin Out")
    gui.key("Return")
    gui.wait_until(f"{COUNT} < {count // 2}", 90)
    finish(gui)
    gui.wait_until(FRESH)


def test_discs_are_there_again_after_undo(gui):
    with_surface(gui, 30_000)
    gui.python("""
import numpy as np
mesh = bpy.context.object.data
places = np.empty(90_000, dtype=np.float32)
mesh.attributes["position"].data.foreach_get("vector", places)
mesh.attributes["position"].data.foreach_set("vector", (places.reshape(-1, 3) * [1.0, 1.0, 0.5]).reshape(-1))
mesh.update()
bpy.context.view_layer.update()
bpy.ops.ed.undo_push(message="Flatter")
""")
    gui.wait_until(FRESH)
    gui.python("bpy.context.object.location.x += 0.1; bpy.ops.ed.undo_push(message='Moved')")
    gui.point_at_view()
    gui.key("ctrl+z")
    gui.wait_until("bpy.context.object.location.x < 0.05")
    gui.wait_until(FRESH)


def test_discs_follow_edit_mode(gui):
    with_surface(gui, 3000)
    edit(gui)
    gui.key("a")
    gui.python("bpy.ops.mesh.remove_doubles(threshold=0.05)")
    gui.key("Tab")
    gui.wait_until("bpy.context.object.mode == 'OBJECT'")
    assert gui.python(COUNT) < 3000
    gui.wait_until(FRESH)


@pytest.fixture
def smoothing(gui, request):
    """The window with so many points that show their places along X; `smooth` tells if they do so within discs."""
    with_surface(gui, request.param)
    gui.python("bpy.ops.meshfree.colormap(attribute='position'); shown = bpy.context.object.meshfree")
    gui.python("smooth = lambda axis: bpy.context.object.meshfree.slopes_of.startswith(f'{axis} position ')")
    gui.python("shown.component = 'X'")
    gui.wait_until("smooth('X') and '.lb_slope' in bpy.context.object.data.attributes")
    return gui


@pytest.mark.parametrize(("smoothing", "at_once"), [(3000, True), (30_000, False)], indirect=["smoothing"])
def test_colors_within_discs_of_many_points_come_later_and_are_saved(smoothing, at_once):
    gui = smoothing
    assert gui.python("shown.component = 'Y'; smooth('Y')") == at_once  # no timer has run in between
    gui.wait_until("smooth('Y')")
    path = str(gui.place.inside(gui.folder / "shown.blend"))
    gui.python(f"shown.component = 'Z'; bpy.ops.wm.save_as_mainfile(filepath={path!r}, copy=True)")
    assert gui.python("smooth('Z')")
    gui.python("shown.component = 'X'; shown.component = 'Y'")  # what is not wanted any more is dropped
    gui.wait_until("smooth('Y')")


@pytest.mark.parametrize("smoothing", [30_000], indirect=True)
def test_no_second_thread_looks_for_the_same_colors(smoothing):
    """Such as while a setting is dragged that they do not depend on."""
    gui = smoothing
    gui.python("from bl_ext.user_default.meshfree_laplacian.operators.running.later import _works")
    gui.python("shown.component = 'Y'; first = [*_works.values()]; shown.reverse = True; then = [*_works.values()]")
    assert gui.python("len(first) == 1 and first[0] is then[0] and not first[0].job.reason")
    gui.wait_until("smooth('Y')")


@pytest.mark.parametrize("smoothing", [3000, 30_000], indirect=True)
def test_colors_within_discs_are_there_again_after_undo(smoothing):
    gui = smoothing
    gui.python("shown.component = 'Y'; bpy.ops.ed.undo_push(message='Y')")
    gui.wait_until("smooth('Y')")
    gui.python("bpy.context.object.location.x += 0.1; bpy.ops.ed.undo_push(message='Moved')")
    gui.point_at_view()
    gui.key("ctrl+z")
    gui.wait_until("bpy.context.object.location.x < 0.05")
    gui.wait_until("smooth('Y') and not bpy.context.object.meshfree.slopes_later")


@pytest.mark.parametrize("smoothing", [30_000], indirect=True)
def test_colors_within_discs_that_come_in_edit_mode_are_there_after_it(smoothing):
    gui = smoothing
    gui.python("shown.component = 'Y'; bpy.ops.object.mode_set(mode='EDIT')")
    gui.wait_until("shown.colors_behind")
    gui.python("bpy.ops.object.mode_set(mode='OBJECT')")
    gui.wait_until("smooth('Y') and not shown.colors_behind")


def test_a_deleted_object_goes(gui):
    add_sphere(gui)
    gui.python("other = bpy.data.objects['Cloud'].copy(); other.name = 'Other'")
    gui.python("bpy.context.collection.objects.link(other); bpy.data.objects['Cloud'].meshfree.compared_with = other")
    gui.python("bpy.data.objects['Cloud'].select_set(False); other.select_set(True)")
    gui.python("bpy.context.view_layer.objects.active = other; bpy.ops.ed.undo_push()")
    gui.point_at_view()
    gui.key("Delete")
    gui.wait_until("bpy.data.objects['Other'].users == 0")  # which is not saved
    assert gui.python("bpy.data.objects['Cloud'].meshfree.compared_with is None")
    gui.key("ctrl+z")
    gui.wait_until("bpy.data.objects['Cloud'].meshfree.compared_with == bpy.data.objects['Other']")


@pytest.mark.parametrize("opened", ["MESHFREE_PT_display"], indirect=True)
def test_group_colors_give_the_shading_back(opened):  # noqa: F811
    gui = opened
    shading(gui, "SOLID")
    gui.open_panel(".meshfree.show_groups")
    gui.press(".meshfree.show_groups", across=0.6)
    gui.wait_until(f"{SHADING} == 'MATERIAL'")
    gui.press(".meshfree.show_groups", across=0.6)
    gui.wait_until(f"{SHADING} == 'SOLID'")


@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_the_legend_is_small_and_covers_nothing(gui, scale):
    add_sphere(gui, 3000)
    gui.python("bpy.ops.meshfree.show_surface(); bpy.ops.meshfree.colormap(attribute='position')")
    gui.python("bpy.context.object.meshfree.component = 'Z'")
    gui.python(COLORED)
    gui.python(f"bpy.context.preferences.view.ui_scale = {scale}")
    try:
        gui.settle()
        gui.shot(f"legend_{scale}")
        behind, corner, left = gui.python(COVERED)
        assert behind == 0
        assert left < 24.0
        gui.python(MOVED.format(*corner))
        gui.settle()
        gui.shot(f"legend_moved_{scale}")
        behind, moved, _ = gui.python(COVERED)
        assert behind == 0
        assert moved != corner
    finally:
        gui.python("bpy.context.preferences.view.ui_scale = 1.0")
