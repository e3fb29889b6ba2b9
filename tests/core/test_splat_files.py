"""Files of Gaussian splats of all layouts: what each holds is read, what it lacks is told."""

import gzip
import re
import tracemalloc

import numpy as np
import pytest

import core
from core.files import SPLATS, PointTable, numbered_files, read_points
from core.splats import holds_splats, read_file
from core.splats.harmonics import COUNTS
from tests import splat_files

NOISE = np.random.default_rng(0).bytes(1_000_000)


def read_as_trained(tmp_path, columns):
    splat_files.write_ply(tmp_path / "trained.ply", columns)
    return core.splats.read_splats(tmp_path / "trained.ply")


def without(columns, *names):
    return {name: values for name, values in columns.items() if name not in names}


def close(found, wanted, place, size, turn, opacity, color, harmonic):
    """Compare with what was written, within half a step of each kind of number; sizes by their ratio."""
    np.testing.assert_allclose(found.positions, wanted.positions, atol=place)
    np.testing.assert_allclose(np.log(found.scales), np.log(wanted.scales), atol=size)
    sides = np.abs(np.einsum("nk,nk->n", found.rotations, wanted.rotations))
    assert np.arccos(np.minimum(sides, 1.0)).max() < turn
    np.testing.assert_allclose(found.opacities, wanted.opacities, atol=opacity)
    np.testing.assert_allclose(found.colors, wanted.colors, atol=color)
    np.testing.assert_allclose(found.harmonics, wanted.harmonics, atol=harmonic)


class TestLayouts:
    def test_two_scales_are_flat_splats(self, tmp_path):
        columns = splat_files.some_columns()
        splat_files.write_ply(tmp_path / "flat.ply", without(columns, "scale_2"))
        assert holds_splats(tmp_path / "flat.ply")
        found, wanted = core.splats.read_splats(tmp_path / "flat.ply"), read_as_trained(tmp_path, columns)
        np.testing.assert_array_equal(found.scales[:, :2], wanted.scales[:, :2])
        np.testing.assert_allclose(found.scales[:, 2], 1e-3 * found.scales[:, :2].min(axis=1), rtol=1e-5)
        np.testing.assert_array_equal(found.rotations, wanted.rotations)
        assert "no scale_2" in found.notices[0]

    @pytest.mark.parametrize(("kind", "full"), [(np.uint8, 255.0), (np.float32, 1.0)])
    @pytest.mark.parametrize("names", [("red", "green", "blue"), ("r", "g", "b")])
    def test_red_green_and_blue_are_colors_without_directions(self, tmp_path, names, kind, full):
        columns = without(splat_files.some_columns(), "f_dc_0", "f_dc_1", "f_dc_2")
        values = np.random.default_rng(1).integers(0, 256, (300, 3)) / 255.0
        columns |= {name: (full * part).round(4).astype(kind) for name, part in zip(names, values.T, strict=True)}
        splat_files.write_ply(tmp_path / "rgb.ply", columns)
        found = core.splats.read_splats(tmp_path / "rgb.ply")
        np.testing.assert_allclose(0.5 + splat_files.CONSTANT * found.colors, values, atol=1e-4)
        assert found.harmonics.shape[1] == 0
        assert f"colors by {' '.join(names)}" in found.notices[0]
        core.splats.write_splats(tmp_path / "again.ply", found)
        again = core.splats.read_splats(tmp_path / "again.ply")
        np.testing.assert_array_equal(again.colors, found.colors)
        assert again.notices == []

    def test_without_rotations_ellipsoids_lie_along_the_axes(self, tmp_path):
        columns = without(splat_files.some_columns(), "rot_0", "rot_1", "rot_2", "rot_3")
        splat_files.write_ply(tmp_path / "straight.ply", columns)
        found = core.splats.read_splats(tmp_path / "straight.ply")
        np.testing.assert_array_equal(found.rotations, np.tile([1.0, 0.0, 0.0, 0.0], (300, 1)))
        assert "no rotations" in found.notices[0]

    def test_one_scale_is_that_of_balls(self, tmp_path):
        columns = without(splat_files.some_columns(), "scale_1", "scale_2")
        splat_files.write_ply(tmp_path / "balls.ply", columns)
        found = core.splats.read_splats(tmp_path / "balls.ply")
        np.testing.assert_array_equal(found.scales, np.repeat(found.scales[:, :1], 3, axis=1))
        assert "balls" in found.notices[0]

    def test_what_else_is_missing_is_guessed_and_told(self, tmp_path):
        columns = without(splat_files.some_columns(), "opacity", "f_dc_0", "f_dc_1", "f_dc_2")
        splat_files.write_ply(tmp_path / "bare.ply", columns)
        found = core.splats.read_splats(tmp_path / "bare.ply")
        np.testing.assert_allclose(found.opacities, 1.0)
        np.testing.assert_array_equal(found.colors, 0.0)
        assert "no colors" in found.notices[0]
        assert "no opacity" in found.notices[0]

    @pytest.mark.parametrize(
        "missing", [("scale_0",), ("scale_1",), ("rot_2",), ("f_dc_1",), ("scale_0", "scale_1", "scale_2")]
    )
    def test_files_that_lack_too_much_are_points_with_a_word(self, tmp_path, missing):
        splat_files.write_ply(tmp_path / "less.ply", without(splat_files.some_columns(), *missing))
        assert not holds_splats(tmp_path / "less.ply")
        found = read_file(tmp_path / "less.ply")
        assert isinstance(found, PointTable)
        wanted = f"less.ply looks like Gaussian splats, but has no {', '.join(missing)}: read as plain points."
        assert found.notices == [wanted]
        with pytest.raises(core.InvalidPointsError, match=f"has no {', '.join(missing)} among its properties"):
            core.splats.read_splats(tmp_path / "less.ply")

    def test_points_with_an_opacity_are_no_splats(self, tmp_path):
        columns = {name: np.arange(5.0, dtype=np.float32) for name in ("x", "y", "z", "opacity", "scale")}
        splat_files.write_ply(tmp_path / "points.ply", columns)
        assert read_file(tmp_path / "points.ply").notices == []

    def test_what_was_completed_comes_back_as_trainers_write_it(self, tmp_path):
        given = without(splat_files.some_columns(harmonics=3), "scale_2")
        splat_files.write_ply(tmp_path / "flat.ply", given)
        core.splats.write_splats(tmp_path / "again.ply", core.splats.read_splats(tmp_path / "flat.ply"))
        found = core.splats.read_splats(tmp_path / "again.ply")
        assert found.notices == []
        for name, values in given.items():
            np.testing.assert_array_equal(found.file.columns[name], values)


class TestPacked:
    @pytest.mark.parametrize("name", ["a.splat", "a.SPLAT"])
    def test_files_of_32_bytes_a_splat(self, tmp_path, name):
        columns = splat_files.some_columns()
        (tmp_path / name).write_bytes(splat_files.make_splat(columns))
        assert holds_splats(tmp_path / name)
        found, wanted = core.splats.read_splats(tmp_path / name), read_as_trained(tmp_path, columns)
        close(found, wanted, 0.0, 1e-6, 0.02, 0.002, 0.0071, 0.0)

    @pytest.mark.parametrize("version", [1, 2, 3])
    @pytest.mark.parametrize("harmonics", COUNTS)
    def test_spz(self, tmp_path, version, harmonics):
        columns = splat_files.some_columns(200, harmonics)
        (tmp_path / "a.spz").write_bytes(splat_files.make_spz(columns, version))
        assert holds_splats(tmp_path / "a.spz")
        found, wanted = core.splats.read_splats(tmp_path / "a.spz"), read_as_trained(tmp_path, columns)
        place, turn = 2e-3 if version == 1 else 2**-12, 0.002 if version == 3 else 0.12
        close(found, wanted, place, 1 / 31.9, turn, 0.002, 0.0131, 1 / 255)
        assert found.notices == []

    def test_spz_of_other_fractions_unpacked_and_with_additions(self, tmp_path):
        columns = splat_files.some_columns(50)
        (tmp_path / "b.spz").write_bytes(splat_files.make_spz(columns, fraction=18, flags=2, pack=bytes) + b"more")
        found, wanted = core.splats.read_splats(tmp_path / "b.spz"), read_as_trained(tmp_path, columns)
        np.testing.assert_allclose(found.positions, wanted.positions, atol=2**-18)
        assert "ignored vendor extensions" in found.notices[0]

    @pytest.mark.parametrize("with_colors", [True, False])
    @pytest.mark.parametrize("harmonics", COUNTS[:4])
    def test_packed_ply(self, tmp_path, with_colors, harmonics):
        columns = splat_files.some_columns(300, harmonics)
        (tmp_path / "a.ply").write_bytes(splat_files.make_packed(columns, with_colors))
        assert holds_splats(tmp_path / "a.ply")
        found, wanted = core.splats.read_splats(tmp_path / "a.ply"), read_as_trained(tmp_path, columns)
        close(found, wanted, 6.0 / 2000, 7.0 / 2000, 0.004, 0.002, 0.0075, 8 / 500)

    @pytest.mark.parametrize("make", [splat_files.make_spz, splat_files.make_packed, splat_files.make_splat])
    def test_they_are_written_in_the_layout_of_trainers(self, tmp_path, make):
        name = "a.splat" if make is splat_files.make_splat else "a.ply"  # what is in it decides, not the name
        (tmp_path / name).write_bytes(make(splat_files.some_columns(40)))
        found = core.splats.read_splats(tmp_path / name)
        core.splats.write_splats(tmp_path / "again.ply", found)
        again = core.splats.read_splats(tmp_path / "again.ply")
        for part in ("positions", "scales", "rotations", "opacities", "colors", "harmonics"):
            np.testing.assert_array_equal(getattr(again, part), getattr(found, part))
        assert set(again.file.columns) == set(splat_files.PROPERTIES)

    def test_a_ply_with_the_name_of_another_kind(self, tmp_path):
        splat_files.write_ply(tmp_path / "a.splat", splat_files.some_columns(20))
        assert len(core.splats.read_splats(tmp_path / "a.splat")) == 20


class TestNotFinite:
    def test_splats_that_are_not_finite_are_left_out_with_a_notice(self, tmp_path):
        columns = splat_files.some_columns(20)
        for row, name in enumerate(("x", "scale_1", "rot_3", "opacity", "f_dc_2")):
            columns[name][row] = np.nan
        columns["y"][5], columns["scale_0"][6], columns["rot_0"][7] = np.inf, np.inf, -np.inf
        columns["opacity"][8], columns["scale_0"][9] = -np.inf, -np.inf  # numbers, of nothing
        found = read_as_trained(tmp_path, columns)
        assert len(found) == 12
        assert found.notices == ["trained.ply: left out 8 splats with numbers that are not finite (NaN or infinity)."]
        np.testing.assert_array_equal(found.file.columns["x"], columns["x"][8:])
        core.splats.write_splats(tmp_path / "again.ply", found)
        assert len(core.splats.read_splats(tmp_path / "again.ply")) == 12

    def test_harmonics_without_a_number_and_places_far_out_are_left_out_too(self, tmp_path):
        columns = splat_files.some_columns(20)
        columns |= {f"f_rest_{number}": np.zeros(20, np.float32) for number in range(9)}
        columns["f_rest_4"][3], columns["y"][7] = np.nan, np.finfo(np.float32).max
        found = read_as_trained(tmp_path, columns)
        assert len(found) == 18
        assert np.isfinite(found.harmonics).all()
        assert "left out 2 splats" in found.notices[0]
        assert "or positions beyond 1e+30." in found.notices[0]

    def test_a_file_of_nothing_else_is_refused(self, tmp_path):
        columns = splat_files.some_columns(5)
        columns["x"][:] = np.nan
        with pytest.raises(core.InvalidPointsError, match="all 5 splats have numbers that are not finite"):
            read_as_trained(tmp_path, columns)

    def test_in_other_kinds_too(self, tmp_path):
        columns = splat_files.some_columns(5)
        columns["z"][2] = np.nan
        (tmp_path / "a.splat").write_bytes(splat_files.make_splat(columns))
        assert len(core.splats.read_splats(tmp_path / "a.splat")) == 4


class TestLengths:
    def test_the_filter_of_mip_splatting_grows_with_its_splat(self, tmp_path):
        columns = splat_files.some_columns(30)
        columns["filter_3D"] = np.full(30, 0.25, np.float32)
        splats = read_as_trained(tmp_path, columns)
        maps = np.tile(2.0 * np.eye(3), (30, 1, 1))
        maps[7] = np.diag([1.0, 2.0, 4.0])
        maps[8] = np.eye(3)[[1, 0, 2]]
        core.splats.write_splats(tmp_path / "big.ply", splats.deformed(splats.positions, maps))
        found = core.splats.read_splats(tmp_path / "big.ply").file.columns["filter_3D"]
        np.testing.assert_allclose(np.delete(found, 8), 0.5, rtol=1e-6)
        assert found[8] == np.float32(0.25)


def test_columns_that_another_program_has_read(tmp_path):
    """They are what the file is, and are told of by the name of what holds them."""
    columns = without(splat_files.some_columns(20, harmonics=3), "scale_2")
    read, given = read_as_trained(tmp_path, columns), core.splats.from_columns(columns, "Bonsai")
    for name in ("positions", "scales", "rotations", "opacities", "colors", "harmonics"):
        np.testing.assert_array_equal(getattr(given, name), getattr(read, name))
    assert given.notices == [text.replace("trained.ply", "Bonsai") for text in read.notices] != []
    columns["x"][:] = np.nan
    with pytest.raises(core.InvalidPointsError, match="Bonsai: all 20 splats have numbers that are not finite"):
        core.splats.from_columns(columns, "Bonsai")


def test_far_away_places_are_written_in_double_precision(tmp_path):
    splats = core.splats.Splats(
        positions=np.random.default_rng(0).random((9, 3)) + [437251.0, 5412893.0, 310.0],
        scales=np.ones((9, 3)),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (9, 1)),
        opacities=np.ones(9),
        colors=np.zeros((9, 3)),
        harmonics=np.zeros((9, 0, 3)),
    )
    core.splats.write_splats(tmp_path / "far.ply", splats)
    np.testing.assert_array_equal(core.splats.read_splats(tmp_path / "far.ply").positions, splats.positions)


@pytest.mark.parametrize(("kind", "count"), [(np.float32, 1), (np.float64, 0)])
def test_wide_steps_of_single_precision_are_told(tmp_path, kind, count):
    columns = splat_files.some_columns(30)
    columns["y"] = (columns["y"] + 5412893.0).astype(kind)
    notices = read_as_trained(tmp_path, columns).notices
    assert len(notices) == count
    assert all("kept in single precision, in steps of 0.5" in notice for notice in notices)


def test_more_harmonics_than_the_file_had_are_written(tmp_path):
    splats = read_as_trained(tmp_path, splat_files.some_columns(20, 3))
    more = np.random.default_rng(2).standard_normal((20, 15, 3)).astype(np.float32)
    core.splats.write_splats(tmp_path / "more.ply", core.splats.Splats(**{**vars(splats), "harmonics": more}))
    np.testing.assert_array_equal(core.splats.read_splats(tmp_path / "more.ply").harmonics, more)


COLUMNS = splat_files.some_columns(300)
SPZ = splat_files.make_spz(COLUMNS)
PLAIN = splat_files.make_spz(COLUMNS, pack=bytes)
PACKED = splat_files.make_packed(COLUMNS)


@pytest.mark.parametrize(
    ("name", "data", "text"),
    [
        ("a.splat", splat_files.make_splat(COLUMNS)[:-1], "no .splat file: its 9599 bytes"),
        ("a.splat", b"", "has no points"),
        ("a.spz", b"", "does not begin with NGSP"),
        ("a.spz", NOISE, "does not begin with NGSP"),
        ("a.spz", SPZ[:3000], r"ends after [\d,]+ of the 6,000 bytes of its 300 splats"),
        ("a.spz", SPZ[:9] + b"\xff" * 99, "is broken"),
        ("a.spz", PLAIN[:-1], "ends after 5,999 of the 6,000 bytes"),
        ("a.spz", splat_files.make_spz(COLUMNS, version=4), "of version 4, and only 1 to 3 are read.*as PLY"),
        ("a.spz", splat_files.make_spz(COLUMNS, degree=7), "harmonics of degree 7"),
        ("a.spz", splat_files.make_spz(COLUMNS, fraction=25), "25 bits behind the point"),
        ("a.spz", splat_files.make_spz(COLUMNS, count=0), "has no splats"),
        ("a.spz", splat_files.make_spz(COLUMNS, count=2**32 - 1), "would unpack to 85,899 MB from"),
        ("a.ply", PACKED[:-1], "ends after 299 of the 300 points"),
        ("a.ply", PACKED.replace(b"element chunk 2", b"element chunk 1"), "300 packed splats, but 1 chunks"),
        ("a.ply", PACKED.replace(b"min_scale_x", b"min_other_x"), "300 packed splats, but no min_scale_x"),
        ("a.ply", PACKED.replace(b"packed_color", b"packed_shade"), "but no packed_color"),
    ],
)
def test_broken_files(tmp_path, name, data, text):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(core.PointCloudError, match=text) as raised:
        core.splats.read_splats(tmp_path / name)
    assert str(tmp_path / name) in str(raised.value)
    assert re.search(r"\. [A-Z].*\.$", str(raised.value))


LARGE = {
    "bomb.spz": lambda: splat_files.make_spz(
        COLUMNS, count=10**8, pack=lambda head: gzip.compress(head + bytes(10**8))
    ),
    "claim.spz": lambda: splat_files.make_spz(COLUMNS, count=3 * 10**6, pack=bytes) + NOISE,
    "packed.spz": lambda: splat_files.make_spz(COLUMNS, count=3 * 10**6, pack=lambda head: gzip.compress(head + NOISE)),
    "claim.ply": lambda: (
        PACKED.replace(b"vertex 300", b"vertex 99999999999").replace(b"chunk 2", b"chunk 3906") + NOISE
    ),
    "noise.splat": lambda: NOISE + b"1",
    "noise.spz": lambda: NOISE,
}


@pytest.mark.parametrize("name", LARGE)
def test_what_is_refused_takes_little_memory(tmp_path, name):
    data = LARGE[name]()
    (tmp_path / name).write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(core.PointCloudError):
            core.splats.read_splats(tmp_path / name)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4 * len(data) + 5e5


@pytest.mark.parametrize("name", ["a.spz", "plain.spz", "a.ply", "a.splat", "flat.ply"])
def test_what_is_broken_is_read_or_refused(tmp_path, name):
    if name == "flat.ply":
        splat_files.write_ply(tmp_path / name, without(COLUMNS, "scale_2"))
    else:
        good = {"a.spz": SPZ, "plain.spz": PLAIN, "a.ply": PACKED, "a.splat": splat_files.make_splat(COLUMNS)}
        (tmp_path / name).write_bytes(good[name])
    data = bytearray((tmp_path / name).read_bytes())
    for seed in range(80):
        rng, changed = np.random.default_rng(seed), bytearray(data)
        for place in rng.integers(0, min(len(data), 1 + 700 * (seed % 2) + 20), rng.integers(1, 4)):
            changed[place] = rng.integers(256)
        (tmp_path / name).write_bytes(changed[: rng.integers(len(data) // 2, 2 * len(data))])
        told, found = read_or_refuse(tmp_path / name)
        assert str(tmp_path / name) in told or isinstance(found, PointTable) or np.isfinite(found.positions).all()


def read_or_refuse(path):
    """Return the text of the error, if there is one, and what was read; any other error goes on."""
    try:
        return "", read_file(path)
    except core.PointCloudError as error:
        return str(error), None


@pytest.mark.parametrize("suffix", SPLATS)
def test_what_reads_points_says_what_reads_splats(tmp_path, suffix):
    with pytest.raises(core.PointCloudError, match="There is no file"):
        read_points(tmp_path / f"a{suffix}")
    (tmp_path / f"a{suffix}").touch()
    with pytest.raises(core.PointCloudError, match="is a file of Gaussian splats. Read it as such, by read_splats"):
        read_points(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", [".ksplat", ".sog", ".SOG", ".lcc"])
def test_splats_that_other_programs_convert(tmp_path, suffix):
    (tmp_path / f"a{suffix}").touch()
    for read in (read_points, read_file, core.splats.read_splats):
        with pytest.raises(core.PointCloudError, match=rf"SuperSplat.*\(splat-transform a{suffix} a.ply\)\.$"):
            read(tmp_path / f"a{suffix}")


def write_more(path, names):
    """Write splats with further columns."""
    splat_files.write_ply(path, {**splat_files.some_columns(), **dict.fromkeys(names, np.ones(300, np.float32))})


def test_anchors_are_points(tmp_path):
    write_more(tmp_path / "a.ply", ["f_offset_0", *(f"f_anchor_feat_{i}" for i in range(32)), "scale_3", "scale_5"])
    table = read_file(tmp_path / "a.ply")
    assert isinstance(table, PointTable)
    assert table.attributes.keys() >= {"f_offset_0", "f_anchor_feat_31", "scale_5"}
    assert "a.ply holds anchors of Scaffold-GS, Octree-GS or the like" in table.notices[-1]
    with pytest.raises(core.PointCloudError, match="holds no Gaussian splats: it has anchors"):
        core.splats.read_splats(tmp_path / "a.ply")


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("trbf_center", "trbf_scale"), "its splats move and have a life time (trbf_center, trbf_scale), as"),
        ([f"motion_{i}" for i in range(9)], "(motion_0, motion_1, motion_2, ...), as those of SpacetimeGaussians"),
        (("binding_0",), "its splats are bound to triangles (binding_0), as those of GaussianAvatars"),
        (("nx", "ny", "nz", "filter_3D", "label"), ""),
    ],
)
def test_splats_that_are_not_all_there_is(tmp_path, names, told):
    write_more(tmp_path / "a.ply", names)
    splats = core.splats.read_splats(tmp_path / "a.ply")
    assert [told in notice for notice in splats.notices] == [True] * bool(told)
    assert splats.file.columns.keys() >= set(names)


def test_splats_of_a_folder_are_frames(tmp_path):
    for number in (2, 10):
        (tmp_path / f"a_{number}.spz").write_bytes(SPZ)
    assert [path.name for path in numbered_files(tmp_path)] == ["a_2.spz", "a_10.spz"]
