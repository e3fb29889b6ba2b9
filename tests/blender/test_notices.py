"""What tools and imports tell stays with the object and in the panel, until it is dismissed or renewed."""

import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, grid_points, sphere_points
from tests.blender.conftest import part
from tests.blender.test_panel import Layout, Narrow, draw

ROOT = Path(__file__).parents[2]
FACES = "The mesh has 1 faces: only its 1000 vertices are used."


def kept(obj):
    """What an object keeps: tools, levels and texts."""
    return [(told.tool, told.level, told.text) for told in obj.meshfree.notices]


def texts(obj):
    return [told.text for told in obj.meshfree.notices]


def sphere_with_a_face(name="Cloud"):
    return add_object(sphere_points(), name, faces=[(0, 1, 2)])


def test_no_operator_warns_without_keeping_it():
    """The status bar forgets; `NoticeOperator` in operators/running/ready.py does not."""
    files = [path for wing in ("operators", "ui") for path in (ROOT / wing).rglob("*.py")]
    found = [path.name for path in files if re.search(r"report\(\s*\{\s*.WARNING", path.read_text(encoding="utf-8"))]
    assert found == []


def test_a_warning_is_kept_and_drawn_until_it_is_dismissed():
    obj = sphere_with_a_face()
    bpy.ops.meshfree.analyze()
    assert ("Analyze Points", "NOTICE", FACES) in kept(obj)
    assert f"Analyze Points: {FACES}" in draw()
    bpy.ops.meshfree.dismiss(index=texts(obj).index(FACES))
    assert FACES not in texts(obj)
    assert f"Analyze Points: {FACES}" not in draw()


@pytest.mark.parametrize(
    ("text", "level"),
    [
        ("Points that lie on another one: 12. They share one area.", "NOTICE"),
        ("Noise of 0.12 of the spacing, at 30% of the points. Results are of a smoothed surface.", "NOTICE"),
        ("a.txt: not all columns have names. Read column_1 as x. If that is wrong, give their names.", "NOTICE"),
        ("Floaters left out: 12. They move with the nearest splats, and Select Floaters selects them.", "NOTICE"),
        ("Analyzed 100 of 1,000 points. The setting Point Budget decides how many.", "NOTICE"),
        ("The rotations had not converged. Raise Steps.", "WARNING"),
        ("a.ply: x and y are degrees of longitude and latitude. Project the points to meters first.", "WARNING"),
        ('Smooth Points wrote nothing: "Cloud" was changed meanwhile. Start it again', "WARNING"),
    ],
)
def test_only_what_says_what_to_do_is_a_warning(text, level):
    obj, icons = add_object(sphere_points()), {}
    notices = part("operators.objects.notices")
    notices.keep(obj, "Tool", text)
    assert kept(obj) == [("Tool", level, text)]
    draw(icons=icons)
    assert icons["1 Notice"] == ("ERROR" if level == "WARNING" else "INFO")


def test_figures_stand_below_the_tools_and_are_no_notices():
    obj = add_object(np.vstack([sphere_points(), [[0.0, 0.0, 3.0]]]))
    bpy.ops.meshfree.stray_points()
    assert kept(obj) == [("Stray Points", "INFO", "Cloud: 1 of 1,001 points are stray (0.10%)")]
    assert "No Notices" in draw()
    texts = draw(["clean"])
    figure = texts.index("Stray Points: 1 of 1,001 points are stray (0.10%)")
    assert figure > max(texts.index(tool) for tool in ("Thin Out...", "Smooth Points...", "Separate"))
    assert not any("0.10%" in text for text in draw(["main", "measure"]))


def test_a_new_analysis_of_changed_points_takes_back_what_was_told_of_them():
    obj = sphere_with_a_face()
    notices = part("operators.objects.notices")
    notices.keep(obj, "Import Points", "is shifted")
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.spectrum(count=4)  # which tells of the faces last
    bpy.ops.meshfree.analyze()
    notices.keep(obj, "Smooth Points", "The rotations had not converged. Raise Steps.")
    bpy.ops.meshfree.analyze()
    assert len(texts(obj)) == 3  # of the same points
    obj.data.clear_geometry()
    obj.data.from_pydata((1.1 * sphere_points()).tolist(), [], [])
    bpy.ops.meshfree.analyze()
    assert texts(obj) == ["is shifted"]


def test_the_notice_of_a_material_goes_with_the_display_that_replaced_it():
    obj = sphere_with_a_face()
    obj.data.materials.append(bpy.data.materials.new("Mine"))
    bpy.ops.meshfree.analyze()
    assert [text for text in texts(obj) if '"Mine"' in text]
    bpy.ops.meshfree.own_material()
    assert not [text for text in texts(obj) if '"Mine"' in text]


def test_all_are_dismissed_at_once():
    obj = sphere_with_a_face()
    bpy.ops.meshfree.analyze()
    module = obj.meshfree.notices
    for text in ("one", "two"):
        told = module.add()
        told.tool, told.text = "Try", text
    assert "Dismiss All" in draw()
    bpy.ops.meshfree.dismiss()
    assert kept(obj) == []
    assert not bpy.ops.meshfree.dismiss.poll()


def test_the_next_run_of_a_tool_takes_the_place_of_its_notices():
    obj = sphere_with_a_face()
    bpy.ops.meshfree.analyze()
    before = kept(obj)
    bpy.ops.meshfree.analyze()
    assert kept(obj) == before
    obj.data.clear_geometry()
    obj.data.from_pydata(sphere_points().tolist(), [], [])
    bpy.ops.meshfree.analyze()
    assert FACES not in texts(obj)


def test_another_tool_leaves_notices_and_says_nothing_twice():
    obj = sphere_with_a_face()
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.spectrum(count=4)
    assert kept(obj).count(("Compute Modes", "NOTICE", FACES)) == 1
    assert texts(obj).count(FACES) == 1
    bpy.ops.meshfree.roughness()
    assert FACES in texts(obj)


def test_what_is_told_while_colors_are_put_on_show_is_kept_too():
    obj = sphere_with_a_face()
    obj.data.materials.append(bpy.data.materials.new("Mine"))
    bpy.ops.meshfree.show_surface()
    bpy.ops.meshfree.analyze()
    told = [text for text in texts(obj) if '"Mine"' in text]
    assert len(told) == 1
    assert "Own Material" in told[0]
    assert FACES in texts(obj)


def test_many_notices_are_not_all_drawn_at_once():
    obj = add_object(sphere_points())
    for number in range(40):
        obj.meshfree.notices.add().text = f"The {number}th"
    drawn = draw()
    assert "40 Notices" in drawn
    assert len([text for text in drawn if re.fullmatch(r": The \d+th", text)]) == 6
    assert "and 34 more, seen when these are dismissed" in draw()


def test_undo_and_redo_take_notices_along():
    sphere_with_a_face()
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.meshfree.analyze()
    told = kept(bpy.context.object)
    bpy.ops.ed.undo_push(message="Analyzed")
    bpy.ops.ed.undo()
    assert kept(bpy.context.object) == []
    bpy.ops.ed.redo()
    assert kept(bpy.context.object) == told != []


def test_notices_are_saved_with_the_file(tmp_path):
    sphere_with_a_face()
    bpy.ops.meshfree.analyze()
    told = kept(bpy.context.object)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert kept(bpy.context.object) == told


def test_objects_that_share_a_mesh_keep_what_was_told_of_it():
    obj = sphere_with_a_face()
    twin = obj.copy()
    bpy.context.scene.collection.objects.link(twin)
    twin.select_set(True)
    obj.select_set(True)
    bpy.ops.meshfree.analyze()
    assert kept(twin) == kept(obj) != []


def test_a_selected_object_that_is_left_out_is_named():
    obj = add_object(sphere_points())
    empty = add_object(np.empty((0, 3)), "Nothing")
    bpy.context.view_layer.objects.active = obj
    for one in (obj, empty):
        one.select_set(True)
    bpy.ops.meshfree.analyze()
    assert any("Left out" in text and "Nothing" in text for text in texts(obj))


def far(path, shift):
    np.savetxt(path, sphere_points(200) + shift)


def test_each_object_of_an_import_keeps_its_own(tmp_path):
    far(tmp_path / "near.xyz", 0.0)
    far(tmp_path / "east.xyz", (5e6, 0.0, 0.0))
    far(tmp_path / "north.xyz", (0.0, 9e8, 0.0))
    names = [{"name": f"{name}.xyz"} for name in ("near", "east", "north")]
    bpy.ops.meshfree.import_points(files=names, directory=str(tmp_path))
    near, east, north = (bpy.data.objects[name] for name in ("near", "east", "north"))
    assert kept(near) == []
    assert [text for text in texts(east) if "shifted by (-5000000, 0, 0)" in text]
    assert "north is too far from the points imported before to share their shift" in texts(north)


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="Blender imports no Point Cloud objects before 4.5")
def test_point_clouds_keep_what_their_file_told(tmp_path):
    far(tmp_path / "east.xyz", (5e6, 0.0, 0.0))
    bpy.ops.meshfree.import_points(filepath=str(tmp_path / "east.xyz"), kind="POINTCLOUD")
    assert bpy.context.object.type == "POINTCLOUD"
    assert "shifted by" in " ".join(texts(bpy.context.object))


def test_a_sequence_keeps_what_was_told_of_its_frames(tmp_path):
    for number in (1, 2):
        far(tmp_path / f"wave_{number}.xyz", (5e6, 0.0, 0.0))
    bpy.ops.meshfree.import_points(filepath=str(tmp_path / "wave_1.xyz"), sequence=True)
    sequence = bpy.context.object
    assert len([text for text in texts(sequence) if "is shifted by" in text]) == 2
    assert "Import Points: wave_1 is shifted by (-5000000, 0, 0)" in draw()
    apart = (0.0, 0.0, 9.0)  # one point far from all others
    for frame in next(iter(bpy.data.collections)).objects:
        frame.data.vertices[0].co = apart
    bpy.ops.meshfree.analyze_sequence()
    told = [text for tool, _, text in kept(sequence) if tool == "Analyze Sequence"]
    assert {text.split(":")[0] for text in told} == {"wave_1", "wave_2"}


def test_a_change_meanwhile_is_told_on_the_object_too():
    """The operator of the job is not asked for: all of them complete alike."""
    running = part("operators.running.job")
    obj = add_object(sphere_points())
    snapshot = running.Snapshot(bpy.context, obj)
    obj.data.vertices[0].co.x += 1.0
    reports = []

    class Try(running.JobOperator):
        bl_label = "Try"

        def report(self, level, text):
            reports.append(text)

    job = SimpleNamespace(label="Try", snapshots=[snapshot], result=lambda: None)
    assert Try().complete(bpy.context, job) == {"CANCELLED"}
    assert texts(obj) == reports
    assert reports[0].startswith("Try wrote nothing: ")


def test_texts_are_wrapped_by_the_width_of_the_region():
    import blf

    obj = add_object(grid_points()[0])
    obj.meshfree.notices.add().text = "Of 1,000 points 12 lie too far apart from others to take part, and are left out."
    lines = {}
    for width in (180, 260, 600):
        drawn = []
        bpy.types.MESHFREE_PT_main.draw(SimpleNamespace(layout=Layout(drawn)), Narrow(width))
        lines[width] = drawn[drawn.index("1 Notice") + 1 : drawn.index("")]  # the cross of the notice has no text
        blf.size(0, 11.0)
        assert max(blf.dimensions(0, line)[0] for line in lines[width]) < width - 60
        assert " ".join(lines[width]).endswith(obj.meshfree.notices[0].text)
    assert len(lines[180]) > len(lines[260]) > len(lines[600])


def test_a_number_stays_with_its_unit():
    wrapping = part("ui.wrapping")
    text = "Scan: 2.01 cm from Plan on average, 95 % within 1.5 mm, 12.6 m² of 13 miles at most (0.07 %)."
    lines = wrapping.wrapped(text, 1, len)
    assert {"2.01 cm", "95 %", "1.5 mm,", "12.6 m²", "13", "miles", "(0.07 %)."} <= set(lines)
    assert " ".join(lines) == text
    assert " ".join(wrapping.wrapped(text, 20, len)) == text
