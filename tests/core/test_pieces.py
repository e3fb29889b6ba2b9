"""Pieces of a file are together what the whole file is; COPC files give levels and boxes."""

import tracemalloc

import laspy
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from core import PointCloudError
from core.files import LasChoices, PointTable, chunks, extent, has_levels, join_pieces, read_points, write_points
from tests.core.copc_files import write_copc
from tests.core.e57_files import integer, make_e57, points, seal

COUNT = 700
FAR = np.array([446_000.0, 4_000_000.0, 120.0])


def cloud(count=COUNT, seed=0):
    return FAR + np.round(np.random.default_rng(seed).uniform(0.0, 100.0, (count, 3)), 3)


def write_las(path, places=None):
    places = cloud() if places is None else places
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.offsets, header.scales = FAR, np.full(3, 0.001)
    for name, kind in (("lb_normal", "3f4"), ("four", "4u1")):
        header.add_extra_dim(laspy.ExtraBytesParams(name, kind))
    las = laspy.LasData(header)
    las.x, las.y, las.z = places.T
    las.classification = np.arange(len(places)) % 7
    las.withheld = np.arange(len(places)) % 10 == 0
    las.lb_normal = np.random.default_rng(1).normal(size=places.shape)
    las.gps_time = 1e9 + np.arange(len(places))
    las.red, las.green = np.arange(len(places)) * 11 % 65536, np.full(len(places), 65535)
    las.write(str(path))


def write_table(path):
    numbers = {"intensity": np.arange(COUNT, dtype=np.int32), "wave": np.arange(3.0 * COUNT).reshape(-1, 3)}
    colors = np.random.default_rng(2).integers(0, 256, (COUNT, 4)).astype(np.float32) / 255.0
    write_points(path, PointTable(cloud(), numbers, colors))


def write_big_endian(path):
    """With faces before the vertices, colors of 16 bits, and coordinates in single precision."""
    lines = ["ply", "format binary_big_endian 1.0", "element face 2", "property list uchar int vertex_indices"]
    lines += [f"element vertex {COUNT}", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"property ushort {name}" for name in ("red", "green", "blue")]
    rows = np.zeros(COUNT, [("place", ">f4", 3), ("color", ">u2", 3)])
    rows["place"], rows["color"] = cloud() - FAR, np.arange(3 * COUNT).reshape(-1, 3)
    faces = b"".join(bytes([3]) + np.array([0, 1, 2], ">i4").tobytes() for _ in range(2))
    path.write_bytes("\n".join([*lines, "end_header\n"]).encode() + faces + rows.tobytes())


def write_e57(path):
    """Of two scans, with colors."""
    scans = []
    for rows in (slice(0, 400), slice(400, COUNT)):
        places = (cloud() - FAR)[rows]
        colors = {
            f"color{name}": integer(np.arange(len(places)) * factor % 256, 0, 255)
            for name, factor in (("Red", 1), ("Green", 3), ("Blue", 7))
        }
        scans.append(({**points(places), **colors}, len(places), ""))
    path.write_bytes(seal(make_e57(*scans)))


def write_rows(path, rows, names=""):
    path.write_text("".join(f"{row}\n" for row in ([names] if names else []) + rows))


def write_nameless(path):
    """With columns that only all rows tell: the first colors are 0 and 1, and normals are missing in half of them."""
    rng = np.random.default_rng(3)
    colors, normals = rng.integers(0, 256, (COUNT, 3)), rng.normal(size=(COUNT, 3))
    colors[:300] %= 2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[:300] = 0.0
    forms = [*3 * ["%.3f"], *3 * ["%d"], *3 * ["%.6f"]]
    np.savetxt(path, np.column_stack([cloud(), colors, normals]), forms)


def write_survey(path):
    """With whole numbers of 64 bits, empty cells, a comment, and a column that is text in a late row only."""
    texts = [
        f"{x},{y},{z},{2**60 + 3 * row},{'' if row % 3 else row},{'late' if row == 600 else row},,{row / 7}"
        for row, (x, y, z) in enumerate(cloud().tolist())
    ]
    texts[400:400] = ["# moved", ""]
    write_rows(path, texts, "x,y,z,stamp,sparse,note,nothing,gps_time")


def write_scans(path):
    """Of two scans with their numbers of points."""
    rows = [f"{x} {y} {z} {row % 9} {row % 256} 7 0" for row, (x, y, z) in enumerate(cloud().tolist())]
    write_rows(path, ["300", *rows[:300], str(COUNT - 300), *rows[300:]])


def write_obj(path):
    rows = [f"v {x} {y} {z} {row / COUNT:.4f} 0.5 0.25" for row, (x, y, z) in enumerate(cloud().tolist())]
    write_rows(path, ["# points", *rows[:200], "f 1 2 3", *rows[200:]])


def write_columnwise(path):
    np.save(path, np.asfortranarray((cloud() - FAR).astype(np.float32)))


def write_ptx(path):
    """Of two scans, with missed rays, in their own coordinates."""
    texts = []
    for rows, place in ((slice(0, 300), 4.0), (slice(300, COUNT), -7.0)):
        count = len(range(COUNT)[rows])
        texts += [f"{count + 5}", "1", f"{place} 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0"]
        texts += [f"{place} 0 0 1", *["0 0 0 0.5 0 0 0"] * 5]
        texts += [
            f"{x} {y} {z} {index / 1024} {index % 256} 3 9" for index, (x, y, z) in enumerate(cloud()[rows].tolist())
        ]
    write_rows(path, texts)


WRITERS = {
    "a.las": write_las,
    "a.laz": write_las,
    "a.copc.laz": lambda path: write_copc(path, cloud()),
    "a.ply": write_table,
    "b.ply": write_big_endian,
    "a.xyz": write_table,
    "a.csv": write_table,
    "a.e57": write_e57,
    "a.txt": write_nameless,
    "b.csv": write_survey,
    "a.pts": write_scans,
    "a.ptx": write_ptx,
    "ptx.txt": write_ptx,
    "a.obj": write_obj,
    "a.npy": lambda path: np.save(path, cloud().astype(">f8")),
    "b.npy": write_columnwise,
    "a.npz": lambda path: np.savez(path, points=cloud()),
    "b.npz": lambda path: np.savez_compressed(path, points=np.asfortranarray(cloud())),
}


_UNEVEN = ("a.las", "a.laz", "a.copc.laz", "a.e57", "a.ptx", "ptx.txt")  # withheld points, and scans


@pytest.mark.parametrize("size", [1, 100, 256, 10_000])
@pytest.mark.parametrize("name", WRITERS)
def test_pieces_are_the_whole(tmp_path, name, size):
    path = tmp_path / name
    WRITERS[name](path)
    if size == 1:
        size = COUNT - 1  # a last piece of one point, or of none
    whole, found = read_points(path), chunks(path, size)
    pieces = list(found)
    assert all(len(piece) <= size and piece.dtype == np.float64 for piece, _ in pieces)
    table = join_pieces(pieces, path, found.single, found.degrees)
    assert_array_equal(table.points, whole.points)
    assert table.attributes.keys() == whole.attributes.keys()
    for column, values in whole.attributes.items():
        assert table.attributes[column].dtype == values.dtype
        assert_array_equal(table.attributes[column], values)
    assert len(pieces) == -(-len(whole.points) // size) or name in _UNEVEN
    assert (table.colors is None) == (whole.colors is None)
    if whole.colors is not None:
        assert_array_equal(table.colors, whole.colors)
    assert (table.single, table.degrees) == (whole.single, whole.degrees)
    assert sorted({*found.notices, *table.notices}) == sorted(whole.notices)


@pytest.mark.parametrize("name", WRITERS)
def test_the_extent_of_a_file(tmp_path, name):
    WRITERS[name](tmp_path / name)
    count, low, high, names = extent(tmp_path / name)
    places = np.concatenate([piece for piece, _ in chunks(tmp_path / name, las=LasChoices(withheld=True))])
    assert count == COUNT
    assert_array_equal([low, high], [places.min(axis=0), places.max(axis=0)])
    assert names == [*next(iter(chunks(tmp_path / name)))[1]]


@pytest.mark.parametrize("name", WRITERS)
def test_a_box(tmp_path, name):
    WRITERS[name](tmp_path / name)
    whole = read_points(tmp_path / name)
    low, high = whole.points.min(axis=0) + (10.0, 20.0, 0.0), whole.points.max(axis=0) - (30.0, 0.0, 40.0)
    inside = ((whole.points >= low) & (whole.points <= high)).all(axis=1)
    assert 0 < np.count_nonzero(inside) < len(inside)
    table = join_pieces([*chunks(tmp_path / name, 64, bounds=(low, high))], tmp_path)
    order, wanted = np.lexsort(table.points.T), np.lexsort(whole.points[inside].T)
    assert_array_equal(table.points[order], whole.points[inside][wanted])
    for column, values in whole.attributes.items():
        assert_array_equal(table.attributes[column][order], values[inside][wanted])
    assert list(chunks(tmp_path / name, bounds=(high + 1e6, high + 2e6))) == []


def test_files_without_points_give_no_piece(tmp_path):
    write_las(tmp_path / "a.laz", np.empty((0, 3)))
    assert list(chunks(tmp_path / "a.laz")) == []
    count, low, _, _ = extent(tmp_path / "a.laz")
    assert (count, np.isnan(low).all()) == (0, True)
    with pytest.raises(PointCloudError, match="has no points"):
        join_pieces([], tmp_path / "a.laz")


def test_points_that_the_sensor_missed_are_left_out(tmp_path):
    write_big_endian(tmp_path / "a.ply")
    data = bytearray((tmp_path / "a.ply").read_bytes())
    data[-18:-14] = np.array([np.nan], ">f4").tobytes()
    (tmp_path / "a.ply").write_bytes(data)
    found = chunks(tmp_path / "a.ply", 300)
    assert [len(piece) for piece, _ in found] == [300, 300, 99]
    assert "left out 1 points that the sensor missed (NaN)" in found.notices[-1]


def test_classes_of_las_files(tmp_path):
    write_las(tmp_path / "a.las")
    found = chunks(tmp_path / "a.las", 50, las=LasChoices(frozenset({3})))
    assert {int(number) for _, numbers in found for number in numbers["classification"]} == {3}
    assert any("points of other classes" in notice for notice in found.notices)
    assert list(chunks(tmp_path / "a.las", las=LasChoices(frozenset({99})))) == []


@pytest.mark.parametrize("name", ["a.las", "a.laz", "a.ply", "a.xyz", "a.npy", "a.npz"])
def test_memory_is_that_of_a_piece(tmp_path, name):
    count = 60_000 if name == "a.xyz" else 400_000
    places = FAR + np.random.default_rng(0).uniform(0.0, 100.0, (count, 3))
    if name in ("a.las", "a.laz"):
        write_las(tmp_path / name, places)
    elif name == "a.npy":
        np.save(tmp_path / name, places)
    elif name == "a.npz":
        np.savez(tmp_path / name, points=places)
    else:
        write_points(tmp_path / name, PointTable(places))
    tracemalloc.start()
    try:
        found = sum(len(piece) for piece, _ in chunks(tmp_path / name, count // 40))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found == (0.9 * count if name in ("a.las", "a.laz") else count)
    assert peak < places.nbytes


def test_columns_of_text_by_the_names_given(tmp_path):
    write_nameless(tmp_path / "a.txt")
    whole = read_points(tmp_path / "a.txt", "z y x a b - ...")
    pieces = [*chunks(tmp_path / "a.txt", 100, columns="z y x a b - ...")]
    assert_array_equal(np.concatenate([points for points, _ in pieces]), whole.points)
    assert_array_equal(np.concatenate([numbers["a"] for _, numbers in pieces]), whole.attributes["a"])
    with pytest.raises(PointCloudError, match="names its columns itself"):
        chunks(tmp_path / "a.ply", columns="x y z")


def test_an_error_of_the_caller_is_not_one_of_the_file(tmp_path):
    def fail(_):
        raise ValueError("mine")

    write_las(tmp_path / "a.las")
    with pytest.raises(ValueError, match="mine"):
        list(map(fail, chunks(tmp_path / "a.las", 100)))
    before = np.geterr()
    pieces = iter(chunks(tmp_path / "a.las", 100))
    next(pieces)
    assert np.geterr() == before


@pytest.mark.parametrize("name", ["a.las", "a.laz", "a.ply"])
def test_files_that_are_cut_off(tmp_path, name):
    WRITERS[name](tmp_path / name)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(PointCloudError, match=r"Copy it again|Copy or (save|export) it again"):
        list(chunks(tmp_path / name))


def test_what_is_asked_for_is_checked(tmp_path):
    write_las(tmp_path / "a.laz")
    with pytest.raises(PointCloudError, match="Ask for at least 1"):
        chunks(tmp_path / "a.laz", 0)
    with pytest.raises(PointCloudError, match="are no box"):
        chunks(tmp_path / "a.laz", bounds=(FAR + 1.0, FAR))
    with pytest.raises(PointCloudError, match="has no levels of detail, which only COPC files have"):
        chunks(tmp_path / "a.laz", level=2)
    with pytest.raises(PointCloudError, match="Levels begin with 0"):
        chunks(tmp_path / "a.laz", level=-1)
    with pytest.raises(PointCloudError, match="There is no file"):
        list(chunks(tmp_path / "none.laz"))


def test_numbers_that_some_files_lack(tmp_path):
    pieces = [(np.zeros((2, 3)), {"wave": np.ones(2)}), (np.ones((3, 3)), {"red": np.full(3, 7)})]
    table = join_pieces(pieces, tmp_path / "tiles")
    assert table.attributes["wave"].tolist() == [1.0, 1.0, 0.0, 0.0, 0.0]
    assert table.notices[0] == "tiles: 3 points have no wave; it is 0 there."
    colors = {"red": np.array([200.0, 0.0]), "green": np.ones(2), "blue": np.zeros(2)}
    table = join_pieces([(np.zeros((2, 3)), colors), (np.ones((1, 3)), {})], tmp_path)
    np.testing.assert_allclose(table.colors, np.array([[200, 1, 0, 255], [0, 1, 0, 255], [255] * 4]) / 255.0)
    colors = {name: np.full(2, 100, np.uint8) for name in ("red", "green", "blue")}
    table = join_pieces([(np.zeros((2, 3)), colors), (np.ones((1, 3)), {})], tmp_path)
    np.testing.assert_allclose(table.colors[:, 0], [100 / 255, 100 / 255, 1.0])


BROKEN = {
    "place": lambda entries: [(*entries[0][:4], 10**12, *entries[0][5:]), *entries[1:]],
    "length": lambda entries: [(*entries[0][:5], entries[0][5] + 1, entries[0][6]), *entries[1:]],
    "count": lambda entries: [(*entries[0][:6], entries[0][6] + 10**9), *entries[1:]],
    "missing": lambda entries: entries[:-1],
    "twice": lambda entries: [*entries, entries[-1]],
    "page": lambda entries: [*entries, (1, 0, 0, 0, 10**12, 32, -1)],
    "page within itself": lambda entries: [*entries, (1, 0, 0, 0, entries[0][4], 32, -1)] * 2,
}


class TestCopc:
    @pytest.mark.parametrize("pages", [False, True])
    def test_levels_are_those_of_laspy(self, tmp_path, pages):
        """laspy's own reader, which takes no part in ours, agrees about the file of the tests, too."""
        path = tmp_path / "a.copc.laz"
        levels = write_copc(path, cloud(), pages=pages)
        assert levels.max() > 1
        with laspy.CopcReader.open(str(path)) as reader:
            for level in range(levels.max() + 2):
                query = reader.query(level=range(level + 1))
                pieces = [*chunks(path, 100, level=level)]
                numbers = np.concatenate([numbers["intensity"] for _, numbers in pieces])
                assert_array_equal(np.sort(numbers), np.sort(query.intensity))
                assert_array_equal(np.sort(numbers), np.flatnonzero(levels <= level))

    def test_a_level_in_a_box(self, tmp_path):
        places = cloud()
        levels = write_copc(tmp_path / "a.copc.laz", places)
        low, high = FAR + 20.0, FAR + 70.0
        found = chunks(tmp_path / "a.copc.laz", level=1, bounds=(low, high))
        numbers = np.concatenate([numbers["intensity"] for _, numbers in found])
        inside = ((places >= low) & (places <= high)).all(axis=1)
        assert_array_equal(np.sort(numbers), np.flatnonzero(inside & (levels <= 1)))

    def test_only_they_have_levels(self, tmp_path):
        for name, writer in WRITERS.items():
            writer(tmp_path / name)
            assert has_levels(tmp_path / name) == (name == "a.copc.laz")

    @pytest.mark.parametrize("what", BROKEN)
    def test_an_octree_that_lies(self, tmp_path, what):
        path = tmp_path / "a.copc.laz"
        write_copc(path, cloud(), change=BROKEN[what])
        with pytest.raises(PointCloudError, match="is broken: its octree .* Copy it again"):
            list(chunks(path, bounds=(FAR, FAR + 10.0)))
        assert len(read_points(path).points) == COUNT
