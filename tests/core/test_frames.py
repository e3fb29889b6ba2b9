"""Numbered files of a folder."""

from pathlib import Path

import pytest

from core import PointCloudError
from core.files import numbered_files, order_frames


def names(folder, *given):
    for name in given:
        (folder / name).touch()
    return [path.name for path in numbered_files(folder)]


def test_frames_come_in_the_order_of_their_numbers(tmp_path):
    found = names(tmp_path, "v2_10.ply", "v2_9.ply", "v2_0100.ply", "notes.txt", "v2_3.jpg")
    assert found == ["v2_9.ply", "v2_10.ply", "v2_0100.ply"]


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ((), "no numbered files"),
        (("a.ply", "1.jpg"), "no numbered files"),
        (("a_1.ply", "b_2.ply"), "several names: a_#.ply, b_#.ply"),
        (("a_1.ply", "a_1.xyz"), "several names"),
        (("a_1.ply", "a_01.ply"), "same number"),
    ],
)
def test_what_is_no_sequence_is_told(tmp_path, given, text):
    with pytest.raises(PointCloudError, match=text):
        names(tmp_path, *given)


def test_a_missing_folder_is_told(tmp_path):
    with pytest.raises(PointCloudError, match="cannot be read"):
        numbered_files(tmp_path / "none")


def test_a_chosen_file_without_a_number_is_told():
    with pytest.raises(PointCloudError, match=r"b\.ply has no number"):
        order_frames([Path("a_1.ply"), Path("b.ply")])
