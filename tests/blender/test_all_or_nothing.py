"""What fails while results are written leaves everything as it was, wherever it fails."""

import inspect
import os
import sys
from collections import Counter

import bpy
import numpy as np
import pytest

from tests.blender.armatures import add_armature, choose
from tests.blender.clouds import add_group, add_object, differences, everything, grid_points, sphere_points
from tests.blender.conftest import new_file, part
from tests.blender.operators import applications
from tests.blender.splats import add_splats, bar_splats
from tests.blender.test_follow import add_arm, pose

SKIPPED = inspect.CO_GENERATOR, "all_or_nothing.py"  # what Python ends by itself, and what puts things back
TRIED = set()  # places where an operator has failed


class Calls:
    """Calls of the extension's functions while results are written, by their places; at one the memory runs out.

    A place is a function and the line that calls it. The fault is the one of that number at its place. Where core calls
    itself is no place of its own: core writes nothing, so that all its faults come out of what called it.
    """

    def __init__(self, extension, place=None, number=0):
        self._folder, self._place, self._number = extension.__path__[0], place, number
        self._core = os.path.join(self._folder, "core", "")
        self._writing, self.seen = False, Counter()

    def _trace(self, frame, event, argument):
        code = frame.f_code
        if not code.co_filename.startswith(self._folder):
            return
        self._writing |= code.co_name in ("write_all", "_convert", "_add", "change", "show_attribute", "_join")
        if not self._writing or code.co_flags & SKIPPED[0] or code.co_filename.endswith(SKIPPED[1]):
            return
        if code.co_filename.startswith(self._core) and frame.f_back.f_code.co_filename.startswith(self._core):
            return
        place = code, frame.f_back.f_code, frame.f_back.f_lineno
        self.seen[place] += 1
        if (place, self.seen[place]) == (self._place, self._number):
            sys.settrace(None)
            raise MemoryError("injected")

    def __enter__(self):
        sys.settrace(self._trace)
        return self

    def __exit__(self, *_):
        sys.settrace(None)


@pytest.fixture(autouse=True)
def made_nodes(known_nodes, monkeypatch):
    """Make the nodes of the display where it is shown, for that may fail, too."""
    monkeypatch.setattr(part("ui.nodes"), "_new_display", known_nodes)


def scene():
    """All that the objects hold."""
    return {obj.name: everything(obj) for obj in bpy.data.objects}


def undo():
    """Take back what was done since the last step."""
    bpy.ops.ed.undo_push(message="Done")
    bpy.ops.ed.undo()


def fail_everywhere(extension, make, name, every=2, **settings):
    """Let an operator fail at the last call from every second place, and find everything as it was, then let it end.

    Places where another operator failed before, as in the display, are tried again, but fewer of them. Return how often
    it failed.
    """
    new_file()
    make()
    bpy.ops.ed.undo_push(message="Made")
    before, active = scene(), bpy.context.object.name
    with Calls(extension) as calls:
        getattr(bpy.ops.meshfree, name)(**settings)
    undo()
    failures = 0
    known = [place for place in calls.seen if place in TRIED]
    for place in [place for place in calls.seen if place not in TRIED][::every] + known[:: 5 * every]:
        TRIED.add(place)
        with Calls(extension, place, calls.seen[place]):
            try:
                getattr(bpy.ops.meshfree, name)(**settings)
                failed = False  # it did not get there, or Blender goes on when a setting's own function fails
            except RuntimeError:
                failed = True
        if failed:
            failures += 1
            assert bpy.context.object.name == active
            assert not differences(scene(), before), place
        else:
            undo()
    assert getattr(bpy.ops.meshfree, name)(**settings) == {"FINISHED"}
    return failures


def handled():
    """A sphere whose ends are handle and anchor, with results of other settings, and a shape key."""
    points = sphere_points(250)
    obj = add_object(points)
    for name, members in {"Handle": points[:, 2] > 0.9, "Anchor": points[:, 2] < -0.9}.items():
        add_group(obj, name, members)
        add_group(obj, {"Handle": "Source", "Anchor": "Value"}[name], members)
    bpy.ops.meshfree.analyze(modes=6)
    obj.meshfree.neighbors += 1
    return obj


def painted():
    obj = handled()
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    return obj


def unhandled():
    obj = handled()
    for name in ("Handle", "Anchor"):
        obj.vertex_groups.remove(obj.vertex_groups[name])
    return obj


def keyed():
    obj = handled()
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Own").value = 0.3
    return obj


def shared():
    """Two objects of one mesh."""
    obj = handled()
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    other.select_set(True)
    return obj


def film():
    points, boundary = grid_points(20, 15)
    obj = add_object(points)
    add_group(obj, "Fixed", boundary)
    return obj


def parted():
    obj = handled()
    bpy.ops.meshfree.segment(parts=3)
    return obj


def colored():
    obj = handled()
    bpy.ops.meshfree.colormap()
    return obj


def compared():
    """Two selected spheres of other sizes, the first one active."""
    obj = handled()
    other = add_object(1.1 * sphere_points(200, seed=3), "Other")
    bpy.context.view_layer.objects.active = obj
    for each in (obj, other):
        each.select_set(True)
    return obj


def compared_before():
    obj = compared()
    bpy.ops.meshfree.compare()
    return obj


def lent():
    """Two selected spheres, of which the one that is not active has weights and a number at its points."""
    obj = compared()
    other = bpy.data.objects["Other"]
    add_group(other, "lower", np.arange(120), 0.5)
    add_group(other, "Handle", np.arange(50), 0.5)
    other.data.attributes.new("Own", "FLOAT", "POINT").data.foreach_set("value", np.arange(200.0))
    return obj


def crossed():
    """A sphere with a curve across it."""
    obj = handled()
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions = "3D"
    spline = curve.splines.new("POLY")
    spline.points.add(2)
    for point, place in zip(spline.points, ((-0.8, 0.0, 0.6), (0.0, 0.0, 1.0), (0.8, 0.0, 0.6)), strict=True):
        point.co = (*place, 1.0)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Curve", curve))
    return obj


def bound():
    obj = handled()
    obj.meshfree.neighbors -= 1
    bpy.ops.meshfree.deform_bind()
    return obj


def boned():
    """A sphere in which an armature lies, the active object, with other weights of one of its bones."""
    obj = handled()
    add_group(obj, "upper", [1, 2], 0.5)
    armature = add_armature({"lower": ((0, 0, -0.8), (0, 0, 0)), "upper": ((0, 0, 0), (0, 0, 0.8))})
    choose(armature, obj)
    return obj


def weighted():
    """Splats with weights of the bones of an armature, which is selected, too."""
    armature = add_arm(5.0, 5.0)
    obj = add_splats(bar_splats(part("core"), degree=1))
    weights = np.tile([0.25, 0.75], (len(obj.data.attributes["position"].data), 1))
    part("operators.rigging.weights").write_weights(obj, ["Bone.0", "Bone.1"], weights)
    armature.select_set(True)
    return obj


def rigged():
    """Splats that follow an armature in a pose."""
    obj = weighted()
    bpy.ops.meshfree.bind_armature()
    pose(bpy.data.objects["Arm"], "Bone.1")
    return obj


FIRST = {  # what is there before tools that a sphere with groups is not enough for, and what they have to be told
    "align_points": (compared, {}),
    "auto_weights": (boned, {}),
    "bind_armature": (weighted, {}),
    "compare": (compared, {}),
    "compare_swap": (compared_before, {}),
    "deform_update": (bound, {}),
    "iso_lines_to_curves": (colored, {}),
    "minimal_surface": (film, {}),
    "separate_by_segment": (parted, {}),
    "signature": (handled, {"count": 3, "modes": 10}),
    "simulate": (handled, {"frames": 3}),
    "signed_distance": (crossed, {"curve": "Curve"}),
    "transfer_attributes": (lent, {"reverse": True}),
    "transfer_weights": (lent, {"reverse": True}),
}
VARIANTS = [
    (handled, "simulate", {"kind": "FRONT", "frames": 3, "height": 0.1}),
    (handled, "simulate", {"keep": "MODES", "modes": 4}),
    (handled, "analyze", {"modes": 4}),
    (shared, "analyze", {}),
    (handled, "spectrum", {}),
    (handled, "segment", {"parts": 3, "vertex_groups": True}),
    (handled, "signature", {"count": 3, "modes": 10}),
    (handled, "smooth", {"target": "IN_PLACE"}),
    (keyed, "smooth", {}),
    (handled, "mode_shape", {"animate": True}),
    (handled, "harmonic_field", {}),
    (painted, "smooth_weights", {"groups": "ALL"}),
    (handled, "geodesic_distance", {}),
    (handled, "deform_bind", {}),
    (unhandled, "deform_bind", {"at_once": True}),
    (film, "minimal_surface", {"target": "IN_PLACE"}),
    (film, "minimal_surface", {}),
    (weighted, "bind_armature", {}),
    (rigged, "bind_armature", {}),
]


@pytest.mark.any_blender
@pytest.mark.parametrize(("make", "name", "settings"), VARIANTS)
def test_failure_while_writing_changes_nothing(extension, make, name, settings):
    assert fail_everywhere(extension, make, name, **settings) > 2


def by_default():
    """All tools that compute, as they are without settings: what is there first, name, and what they must be told."""
    return [(make, name, told) for name in applications() for make, told in [FIRST.get(name, (handled, {}))]]


def test_failure_while_any_tool_writes_changes_nothing(extension):
    """Coarsely, for all that are not tried above; none can be forgotten."""
    tried = {name for _, name, _ in VARIANTS} | {"separate_by_segment"}
    others = [(make, name, told) for make, name, told in by_default() if name not in tried]
    assert len(others) > 10
    for make, name, told in others:
        assert fail_everywhere(extension, make, name, every=6, **told) > 0, name


def test_parts_stay_one_object_if_separating_fails(extension):
    assert fail_everywhere(extension, parted, "separate_by_segment") > 2
    assert len(bpy.data.objects) == 3


def test_what_was_active_and_selected_stays_so_if_a_tool_fails_after_it_chose_what_it_made(monkeypatch):
    obj = compared()
    before = scene()

    def fail(points):
        assert bpy.context.object != obj
        assert not obj.select_get()
        raise MemoryError("injected")

    monkeypatch.setattr(part("operators.tools.mesh"), "hide", fail)
    with pytest.raises(RuntimeError, match="The memory is used up"):
        bpy.ops.meshfree.mesh_surface()
    assert bpy.context.object == obj
    assert not differences(scene(), before)


def test_place_and_lock_are_put_back():
    obj = handled()
    bpy.context.view_layer.update()
    before = scene()

    def move_and_fail():
        with part("operators.objects.all_or_nothing").all_or_nothing([obj]):
            obj.location = 1.0, 2.0, 3.0
            bpy.context.scene.render.use_lock_interface = True
            raise MemoryError("injected")

    with pytest.raises(MemoryError):
        move_and_fail()
    bpy.context.view_layer.update()
    assert not differences(scene(), before)


def with_modifiers():
    obj = keyed()
    bpy.ops.meshfree.colormap()
    obj.modifiers.new("Array", "ARRAY").show_viewport = False
    add_object(sphere_points(50), "Other").select_set(True)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return obj


def as_cloud():
    obj = handled()
    bpy.ops.meshfree.colormap()
    obj.select_set(True)
    bpy.ops.meshfree.convert()


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="from Blender 4.5 on")
@pytest.mark.parametrize(("make", "target"), [(with_modifiers, "POINTCLOUD"), (as_cloud, "MESH")])
def test_objects_keep_their_type_if_converting_fails(extension, make, target):
    assert fail_everywhere(extension, make, "convert", target=target) > 2


@pytest.mark.parametrize("kind", ["MESH", "POINTCLOUD"][: 1 + (bpy.app.version >= (4, 5))])
def test_nothing_is_left_of_an_import_that_fails(extension, tmp_path, kind):
    path = tmp_path / "points.xyz"
    path.write_text("".join(f"{x} {y} {z} 7\n" for x, y, z in sphere_points(50)))
    assert fail_everywhere(extension, handled, "import_points", filepath=str(path), kind=kind) > 2


@pytest.mark.parametrize("kind", ["MESH", "POINTCLOUD"][: 1 + (bpy.app.version >= (4, 5))])
def test_nothing_is_left_of_tiles_whose_import_fails(extension, tmp_path, kind):
    for number in (1, 2):
        files = part("core.files")
        table = files.PointTable(sphere_points(50) + number, {"classification": np.arange(50)})
        files.write_points(tmp_path / f"tile_{number}.ply", table)
    tiles = {"directory": str(tmp_path), "files": [{"name": path.name} for path in tmp_path.iterdir()]}
    assert fail_everywhere(extension, handled, "import_tiles", kind=kind, **tiles) > 2


def test_nothing_is_left_of_a_sequence_whose_import_fails(extension, tmp_path):
    for number in (1, 2):
        np.save(tmp_path / f"points_{number}.npy", sphere_points(50))
    path = str(tmp_path / "points_1.npy")
    assert fail_everywhere(extension, handled, "import_points", filepath=path, sequence=True) > 2


def two_of_splats():
    splats = bar_splats(part("core"), degree=1)
    for name in ("First", "Second"):
        add_splats(splats, name).rotation_euler.x = 0.4
    for obj in bpy.data.objects:
        obj.select_set(True)
    bpy.context.view_layer.update()


@pytest.mark.parametrize("name", ["deform_apply", "deform_to_shape_key", "deform_unbind"])
def test_what_follows_an_armature_stays_so_if_taking_it_over_fails(extension, name):
    assert fail_everywhere(extension, rigged, name, every=3) > 2


def test_splats_stay_if_joining_fails(extension):
    assert fail_everywhere(extension, two_of_splats, "join_splats", every=1) > 10


@pytest.mark.parametrize("make", [handled, colored])
def test_colors_stay_if_showing_others_fails(extension, make):
    assert fail_everywhere(extension, make, "colormap", every=4, attribute="lb_area", color_map="MAGMA") > 2


def partly_selected():
    obj = handled()
    obj.data.vertices.foreach_set("select", [index < 50 for index in range(250)])
    return obj


def test_groups_stay_if_assigning_fails(extension):
    assert fail_everywhere(extension, partly_selected, "group_from_selection", every=1, role="BOUNDARY") > 2
