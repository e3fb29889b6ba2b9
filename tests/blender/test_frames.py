"""Numbered files as one object that changes by frame: in the viewport, in renders, after saving, and analyzed."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, sphere_points
from tests.blender.conftest import part

COUNTS = (300, 260, 340)
RANGE = ("color_map", "range_mode", "range_low", "range_high")


def frame_points(number):
    """Points of a sphere that grows, other ones in each frame."""
    return (1.0 + number) * sphere_points(COUNTS[number])


@pytest.fixture
def folder(tmp_path):
    """Three frames, numbered 9, 10 and 11, in a folder with something else."""
    for number in range(3):
        np.save(tmp_path / f"scan_{number + 9}.npy", frame_points(number))
    (tmp_path / "notes.txt").write_text("taken on a Monday")
    return tmp_path


def run_import(folder, names=("scan_10.npy",), **options):
    if len(names) == 1:
        bpy.ops.meshfree.import_points(filepath=str(folder / names[0]), sequence=True, **options)
    else:
        files = [{"name": name} for name in names]
        bpy.ops.meshfree.import_points(directory=str(folder), files=files, sequence=True, **options)
    return bpy.context.object


def seen(obj, frame):
    """Positions that an object shows at a frame of the scene."""
    bpy.context.scene.frame_set(frame)
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    positions = np.empty((len(evaluated.data.vertices), 3), np.float32)
    evaluated.data.vertices.foreach_get("co", positions.reshape(-1))
    return positions


def check_frames(obj, numbers):
    for frame, number in numbers.items():
        assert_allclose(seen(obj, frame), frame_points(number), rtol=1e-6, atol=1e-6)


def unit(vector):
    return vector / np.linalg.norm(vector)


def open_frames(obj):
    """Turn on the check box of the collection, and select its objects, as somebody does in the Outliner."""
    layer = bpy.context.view_layer.layer_collection.children[f"{obj.name} Frames"]
    layer.exclude = False
    obj.select_set(False)
    frames = sorted(layer.collection.objects, key=lambda item: item.name)
    for item in frames:
        item.select_set(True)
    bpy.context.view_layer.objects.active = frames[0]
    return layer, frames


def test_each_frame_shows_its_file_and_the_ends_stay(folder):
    obj = run_import(folder)
    assert obj.name == "scan"
    assert [item.name for item in bpy.context.selected_objects] == ["scan"]
    check_frames(obj, {-5: 0, 0: 0, 1: 0, 2: 1, 3: 2, 4: 2, 100: 2})


def test_chosen_files_alone_from_the_first_frame_of_the_scene_on(folder):
    bpy.context.scene.frame_start = 11
    obj = run_import(folder, ("scan_11.npy", "scan_9.npy"))
    check_frames(obj, {1: 0, 11: 0, 12: 2, 20: 2})


def test_first_frame_and_step_can_be_changed(folder, modifiers):
    obj = run_import(folder)
    modifier = obj.modifiers["Mesh-Free Sequence"]
    modifiers.set_input(modifier, "First Frame", 10)
    modifiers.set_input(modifier, "Frame Step", 3)
    obj.update_tag()
    check_frames(obj, {9: 0, 10: 0, 12: 0, 13: 1, 15: 1, 16: 2, 40: 2})


def test_frames_follow_the_numbers_of_files_by_choice(tmp_path):
    for number, name in enumerate(("scan_1", "scan_2", "scan_5")):
        np.save(tmp_path / f"{name}.npy", frame_points(number))
    obj = run_import(tmp_path, ("scan_2.npy",), numbers=True)
    check_frames(obj, {-3: 0, 1: 0, 2: 1, 3: 1, 4: 1, 5: 2, 6: 2, 90: 2})
    other = run_import(tmp_path, ("scan_2.npy",))  # beside it, by the same nodes
    check_frames(other, {1: 0, 2: 1, 3: 2})
    check_frames(obj, {3: 1, 5: 2})


def test_followed_numbers_move_with_the_first_frame_and_step(tmp_path, modifiers):
    for number, name in enumerate(("a100b", "a101b", "a104b")):
        np.save(tmp_path / f"{name}.npy", frame_points(number))
    obj = run_import(tmp_path, ("a100b.npy",), numbers=True)
    check_frames(obj, {99: 0, 100: 0, 101: 1, 103: 1, 104: 2})
    modifiers.set_input(obj.modifiers["Mesh-Free Sequence"], "First Frame", 1)
    modifiers.set_input(obj.modifiers["Mesh-Free Sequence"], "Frame Step", 2)
    obj.update_tag()
    check_frames(obj, {1: 0, 2: 0, 3: 1, 8: 1, 9: 2})


def test_numbers_beyond_the_frames_of_blender_are_told(tmp_path):
    for number in (1_694_000_000, 1_694_000_010):
        np.save(tmp_path / f"scan_{number}.npy", frame_points(0))
    with pytest.raises(RuntimeError, match="beyond Blender's last frame 1,048,574. Turn off Follow Numbers"):
        run_import(tmp_path, ("scan_1694000000.npy",), numbers=True)
    assert not bpy.data.objects


def test_two_sequences_do_not_mix(folder):
    first = run_import(folder)
    second = run_import(folder, ("scan_11.npy", "scan_10.npy"))
    check_frames(first, {1: 0, 2: 1, 3: 2})
    check_frames(second, {1: 1, 2: 2})
    groups = [group for group in bpy.data.node_groups if "meshfree_sequence" in group]
    assert len(groups) == 1


def test_a_saved_sequence_changes_by_frame_again(folder):
    run_import(folder)
    path = str(folder / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    check_frames(bpy.data.objects["scan"], {1: 0, 2: 1, 3: 2})


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda folder: (folder / "scan_10.npy").write_bytes(b"nothing"), "scan_10.npy"),
        (lambda folder: (folder / "other_1.npy").write_bytes(b"nothing"), "several names"),
    ],
)
def test_a_broken_sequence_leaves_nothing(folder, change, text):
    change(folder)
    before = [len(getattr(bpy.data, name)) for name in ("objects", "meshes", "collections", "node_groups")]
    with pytest.raises(RuntimeError, match=text):
        run_import(folder, ("scan_9.npy",))
    assert [len(getattr(bpy.data, name)) for name in ("objects", "meshes", "collections", "node_groups")] == before


def test_a_missing_frame_is_told(folder):
    with pytest.raises(RuntimeError, match=r"There is no file .*scan_12"):
        run_import(folder, ("scan_11.npy", "scan_12.npy"))
    assert not bpy.data.objects


def test_one_button_analyzes_all_frames_in_one_range(folder):
    obj = run_import(folder)
    assert bpy.ops.meshfree.analyze_sequence(modes=4, shown_mode=2) == {"FINISHED"}
    frames = [bpy.data.objects[f"scan_{number}"] for number in (9, 10, 11)]
    assert {tuple(item.meshfree.path_resolve(name) for name in RANGE) for item in frames} == {
        tuple(frames[0].meshfree.path_resolve(name) for name in RANGE)
    }
    settings = frames[0].meshfree
    assert settings.range_mode == "LOCKED"
    values = np.concatenate([attribute(item, "lb_eigenvector_002") for item in frames])
    assert 0.5 * np.abs(values).max() < settings.range_high <= np.abs(values).max()
    assert settings.range_low == -settings.range_high
    for number, item in enumerate(frames):
        assert item.meshfree.total_area == pytest.approx(4.0 * np.pi * (1.0 + number) ** 2, rel=0.03)
    # Modes 2 to 4 of a sphere are coordinates in any basis; here in that of the first frame, whatever its points.
    first, *others = [
        np.stack([unit(attribute(item, f"lb_eigenvector_{mode:03d}") @ frame_points(number)) for mode in (2, 3, 4)])
        for number, item in enumerate(frames)
    ]
    for other in others:
        assert np.einsum("ij,ij->i", first, other).min() > 0.97
    assert bpy.context.object == obj


def test_a_frame_that_cannot_be_analyzed_leaves_all_as_they_were(folder):
    np.save(folder / "scan_11.npy", np.zeros((4, 3)) + np.arange(4.0)[:, None])
    run_import(folder)
    with pytest.raises(RuntimeError, match="scan_11"):
        bpy.ops.meshfree.analyze_sequence()
    for item in bpy.data.objects:
        assert not [layer.name for layer in item.data.attributes if layer.name.startswith("lb_")]
        assert item.meshfree.fingerprint == ""


def test_stopped_at_the_last_frame_nothing_is_written(stages, folder, core, monkeypatch):
    run_import(folder)
    told, seen = stages.Stages.__call__, []

    def tell(self, stage, fraction):
        seen.append((stage, fraction))
        if stage == "Frame 3 of 3":
            raise core.Cancelled
        told(self, stage, fraction)

    monkeypatch.setattr(stages.Stages, "__call__", tell)
    before = {item.name: everything(item) for item in bpy.data.objects}
    with pytest.raises(RuntimeError):
        bpy.ops.meshfree.analyze_sequence()
    assert list(dict.fromkeys(stage for stage, _ in seen)) == ["Frame 1 of 3", "Frame 2 of 3", "Frame 3 of 3"]
    assert seen == sorted(seen, key=lambda item: item[1])
    assert {item.name: everything(item) for item in bpy.data.objects} == before


def test_what_fails_at_the_last_frame_leaves_none_written(folder, monkeypatch):
    run_import(folder)
    tool = part("operators.tools.sequence")
    write = tool.write_result

    def fail_late(obj, *more):
        if obj.name == "scan_11":
            raise MemoryError
        write(obj, *more)

    monkeypatch.setattr(tool, "write_result", fail_late)
    before = {item.name: everything(item) for item in bpy.data.objects}
    with pytest.raises(RuntimeError, match="memory is used up"):
        bpy.ops.meshfree.analyze_sequence()
    assert {item.name: everything(item) for item in bpy.data.objects} == before


def test_a_frame_that_shares_its_mesh_gets_its_own_by_choice(folder):
    run_import(folder)
    shared = bpy.data.objects["scan_10"]
    twin = bpy.data.objects.new("Twin", shared.data)
    bpy.context.scene.collection.objects.link(twin)
    with pytest.raises(RuntimeError, match="Make Single User"):
        bpy.ops.meshfree.analyze_sequence()
    shared.meshfree.make_single_user = True
    bpy.ops.meshfree.analyze_sequence()
    assert "lb_area" in shared.data.attributes
    assert "lb_area" not in twin.data.attributes


def test_what_is_no_sequence_or_no_mode_of_it(folder):
    add_object(sphere_points(300))
    with pytest.raises(RuntimeError, match="No sequence is active"):
        bpy.ops.meshfree.analyze_sequence()
    run_import(folder)
    with pytest.raises(RuntimeError, match="Mode 3 is to be shown of 2"):
        bpy.ops.meshfree.analyze_sequence(modes=2, shown_mode=3)


def test_undo_takes_import_and_analysis_back(folder):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="Before")
    run_import(folder)
    bpy.ops.ed.undo_push(message="Import")
    bpy.ops.meshfree.analyze_sequence()
    bpy.ops.ed.undo_push(message="Analyze")
    bpy.ops.ed.undo()
    assert bpy.data.objects["scan_9"].meshfree.fingerprint == ""
    check_frames(bpy.data.objects["scan"], {1: 0, 2: 1, 3: 2})
    bpy.ops.ed.undo()
    assert not bpy.data.objects


def test_tools_say_where_the_points_are(folder):
    run_import(folder)
    with pytest.raises(RuntimeError, match="shows the objects of a collection, one at each frame"):
        bpy.ops.meshfree.analyze()


def test_analyzed_frames_are_rendered_one_by_one(folder):
    """An animation in background, as from a command line: colored points, larger from frame to frame."""
    obj = run_import(folder)
    layer, frames = open_frames(obj)
    assert [item.name for item in frames] == ["scan_10", "scan_11", "scan_9"]
    assert bpy.ops.meshfree.analyze() == {"FINISHED"}
    assert all("lb_mean_curvature" in item.data.attributes for item in frames)
    bpy.ops.meshfree.colormap(attribute="lb_mean_curvature")
    for item in frames[1:]:
        bpy.context.view_layer.objects.active = item
        bpy.ops.meshfree.colormap(attribute="lb_mean_curvature")
    layer.exclude = True
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0.0, 0.0, 20.0), "ORTHO", 8.0
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine, scene.cycles.samples = camera, "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.film_transparent = True
    scene.render.filepath = str(folder / "out_")
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.render.render(animation=True)
    covered = []
    for number in (1, 2, 3):
        image = bpy.data.images.load(str(folder / f"out_{number:04d}.png"))
        covered.append(np.count_nonzero(np.array(image.pixels).reshape(-1, 4)[:, 3] > 0.5))
    assert 20 < covered[0] < 0.6 * covered[1] < 0.6 * covered[2]
