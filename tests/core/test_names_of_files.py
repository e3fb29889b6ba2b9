"""Names of files and folders as texts and as paths, wherever the public calls take them."""

import inspect
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import core
from core import files, paper, splats, tiles
from core.files import PointTable
from core.types import FilePath

SAMPLE = np.random.default_rng(0).normal(size=(40, 3))
COLUMNS = {"x": np.arange(3.0), "y": np.ones(3), "z": np.zeros(3)}


def named():
    """Functions of the public packages that take a path, with what they call it."""
    for package in (core, files, paper, splats, tiles):
        for name in core.__all__ if package is core else dir(package):
            call = getattr(package, name)
            if inspect.isfunction(call):
                given = inspect.signature(call).parameters
                yield from ((call, given[one]) for one in ("path", "paths", "folder") if one in given)


def test_all_take_both():
    found = [(call.__name__, each) for call, each in named()]
    assert len(found) > 20
    wrong = {name for name, each in found if each.annotation not in (FilePath, "FilePath", Sequence[FilePath])}
    assert wrong == set()


def splats_of(points):
    one = np.ones(len(points))
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1))
    return core.splats.Splats(
        points, points**2 + 0.1, rotations, 0.5 * one, np.zeros((len(points), 3)), np.zeros((len(points), 0, 3))
    )


CALLS = {
    "write_points": lambda path: files.write_points(path("a.ply"), PointTable(SAMPLE)),
    "read_points": lambda path: files.read_points(path("a.ply")).points.tolist(),
    "write_pieces": lambda path: files.write_pieces(path("b.csv"), lambda: [PointTable(SAMPLE)]),
    "chunks": lambda path: [len(points) for points, _ in files.chunks(path("b.csv"), 25)],
    "extent": lambda path: files.extent(path("b.csv")).count,
    "has_levels": lambda path: files.has_levels(path("b.csv")),
    "write_arrays": lambda path: files.write_arrays(path("e.npz"), {"points": SAMPLE, "file": SAMPLE}),
    "write_mesh": lambda path: files.write_mesh(path("c.obj"), PointTable(SAMPLE), [np.array([[0, 1, 2]])]),
    "join_pieces": lambda path: files.join_pieces([(SAMPLE, {})], path("a.ply")).points.shape,
    "write_vertex_columns": lambda path: files.write_vertex_columns(path("d.ply"), COLUMNS),
    "read_vertex_columns": lambda path: [*files.read_vertex_columns(path("d.ply")).columns],
    "read_vertex_names": lambda path: files.read_vertex_names(path("d.ply")),
    "read_elements": lambda path: [*files.read_elements(path("d.ply"))[2]],
    "doubts": lambda path: [*files.doubts(PointTable(SAMPLE, single=True, degrees=True), path("a.ply"))],
    "precision_notices": lambda path: [*files.precision_notices(SAMPLE + 1e6, path("a.ply"))],
    "check_places": lambda path: files.check_places(SAMPLE, path("a.ply")),
    "frame_number": lambda path: files.frame_number(path("scan_012.ply")),
    "order_frames": lambda path: [one.name for one in files.order_frames([path("s_2.ply"), path("s_1.ply")])],
    "write_splats": lambda path: core.splats.write_splats(path("s.ply"), splats_of(SAMPLE)),
    "read_splats": lambda path: len(core.splats.read_splats(path("s.ply"))),
    "read_file": lambda path: len(splats.read_file(path("s.ply"))),
    "tile_folder": lambda path: tiles.tile_folder(path("store"), 3),
    "cut_to_store": lambda path: tiles.cut_to_store(lambda: [(SAMPLE, {})], path("store"), 20).count,
    "Store": lambda path: tiles.Store(path("store")).count,
}


def test_texts_and_paths_are_the_same(tmp_path, monkeypatch):
    found = []
    for kind in (str, Path):
        folder = tmp_path / kind.__name__
        folder.mkdir()
        monkeypatch.chdir(folder)
        found.append({name: call(lambda name, kind=kind: kind(name)) for name, call in CALLS.items()})
    assert found[0] == found[1]


@pytest.mark.parametrize(
    "call", [files.read_points, files.has_levels, core.splats.read_splats, tiles.Store], ids=lambda one: one.__name__
)
@pytest.mark.parametrize("wrong", [None, 7, ["a.ply"]], ids=str)
def test_what_is_no_name(call, wrong):
    with pytest.raises(core.PointCloudError, match="is no name of a file. Give a text or a path."):
        call(wrong)
