"""Whole numbers and times keep their digits in parts of 32 bits, and in files."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from core.files import Digits, PointTable, join_digits, read_points, split_digits, write_points

COUNT = 400
STEPS = np.arange(COUNT)
RANDOM = np.random.default_rng(0)
WHOLE = {
    "beyond single precision": (16_777_217 + STEPS).astype(np.uint32),
    "without a sign": (3_000_000_017 + STEPS).astype(np.uint32),
    "all of 32 bits": np.array([0, 2**31, 2**32 - 1], np.uint32),
    "far, of 64 bits": (2**60 + STEPS).astype(np.uint64),
    "far below zero": -(2**60) + STEPS,
    "hashes": RANDOM.integers(0, 2**64 - 1, COUNT, dtype=np.uint64),
    "hashes with a sign": RANDOM.integers(-(2**63), 2**63 - 1, COUNT),
    "a mark for none": np.array([0, 1, 2, 2**64 - 1], np.uint64),
    "nanoseconds since 1970": 1_700_000_000_123_456_789 + 100_000_000 * STEPS,
    "microseconds in nanoseconds": (3_000 * RANDOM.integers(0, 2**30, COUNT) + 17).astype(np.uint64),
    "whole doubles": 2.0**40 + STEPS,
    "bytes": STEPS.astype(np.uint8),
}
TIMES = {
    "of the day": np.round(86_400.0 * RANDOM.random(COUNT), 4),
    "since 1970": 1.7e9 + 1e-4 * STEPS,
    "since 1970, of an hour": np.round(1.7e9 + 3600.0 * RANDOM.random(COUNT), 6),
    "all the same": np.full(COUNT, 1.7e9 + 0.25),
}


def kept(values):
    """What becomes of values on the way through attributes of Blender."""
    parts, digits = split_digits(values)
    assert all(part.dtype in (np.int32, np.float32) for part in parts) or digits is None
    parts = [part if part.dtype.kind in "iu" else part.astype(np.float32) for part in parts]
    return (parts[0] if digits is None else join_digits(parts, digits)), parts, digits


@pytest.mark.parametrize("kind", WHOLE)
def test_whole_numbers_are_exact(kind):
    found, parts, _ = kept(WHOLE[kind])
    assert [int(value) for value in found] == [int(value) for value in WHOLE[kind]]
    assert all(part.dtype == np.int32 for part in parts)


@pytest.mark.parametrize("kind", [name for name in WHOLE if "hashes" not in name and "none" not in name])
def test_whole_numbers_of_a_narrow_range_are_different_in_one_attribute(kind):
    _, parts, _ = kept(WHOLE[kind])
    assert len(parts) == 1
    assert len(np.unique(parts[0])) == len(np.unique(WHOLE[kind]))


@pytest.mark.parametrize("kind", TIMES)
def test_times_are_exact(kind):
    assert_array_equal(kept(TIMES[kind])[0], TIMES[kind])


def test_times_of_a_moment_are_different_in_one_attribute():
    _, parts, digits = kept(TIMES["since 1970"])
    assert (len(parts), len(np.unique(parts[0]))) == (1, COUNT)
    assert digits.offset == pytest.approx(1.7e9, abs=0.1)


def test_times_without_decimals_keep_their_differences():
    times = 1.7e9 + np.cumsum(RANDOM.random(COUNT)) * 1e-3
    found, parts, _ = kept(times)
    assert len(np.unique(parts[0])) == COUNT
    assert np.abs(found - times).max() < 1e-6


def test_gps_times_of_a_flight_keep_a_millisecond_at_least():
    times = 245_370.0 + np.sort(RANDOM.random(COUNT)) * 4400.0
    found, parts, _ = kept(times)
    assert len(parts) == 1
    assert np.abs(found - times).max() < 5e-4


def test_large_numbers_that_no_offset_helps_stay_as_they_are():
    assert split_digits(1e6 * RANDOM.random(COUNT))[1] is None


@pytest.mark.parametrize(
    "values",
    [
        np.round(RANDOM.random(COUNT), 3),
        np.round(1013.0 + RANDOM.random(COUNT), 1),
        RANDOM.random(COUNT),
        RANDOM.random(COUNT).astype(np.float32),
        np.array([float(f"{value:.9g}") for value in 100.0 * RANDOM.random(COUNT).astype(np.float32)]),
        np.array([float(f"{value:f}") for value in 100.0 * RANDOM.random(COUNT).astype(np.float32)]),
        np.round(2.0 * RANDOM.random(COUNT) - 1.0, 9),
        np.array([np.nan, 1.0, np.inf]),
        np.array([]),
        np.full(3, np.nan),
        np.array([1e300, -1e300]),
        np.zeros(3, bool),
    ],
)
def test_what_single_precision_tells_is_left_alone(values):
    (found,), digits = split_digits(values)
    assert digits is None
    with np.errstate(over="ignore"):
        assert_array_equal(found.astype(np.float32), values.astype(np.float32))


def test_missing_values_stay_missing():
    ids = np.append(16_777_217.0 + STEPS, np.nan)
    assert_array_equal(kept(ids)[0], ids)


def test_what_a_user_changed_is_not_rounded_to_the_decimals_of_the_file():
    times = TIMES["since 1970"]
    parts, digits = split_digits(times)
    changed = join_digits([parts[0] + np.float32(0.00005)], digits)
    assert np.abs(changed - times - 0.00005).max() < 1e-6


def test_a_known_offset_is_shared_where_it_serves():
    known = Digits(2_999_000_000)
    assert split_digits(WHOLE["without a sign"], known)[1] == known
    assert split_digits(WHOLE["far, of 64 bits"], known)[1] != known
    known = Digits(1.7e9, 4)
    assert split_digits(TIMES["since 1970"], known)[1] == known


def test_vectors_far_from_the_origin():
    places = np.array([446_000.0, 4_000_000.0, 0.5]) + RANDOM.random((COUNT, 3))
    (found,), digits = split_digits(places)
    assert digits.offset[2] == 0.0
    assert np.abs(join_digits([found.astype(np.float32)], digits) - places).max() < 1e-6
    assert split_digits(RANDOM.random((COUNT, 3)))[1] is None


COLUMNS = {
    "id": WHOLE["beyond single precision"].astype(np.int64),
    "wide": WHOLE["without a sign"],
    "time": TIMES["since 1970"],
    "hash": WHOLE["hashes"],
    "value": RANDOM.random(COUNT),
}


def test_text_has_all_digits(tmp_path):
    write_points(tmp_path / "a.csv", PointTable(RANDOM.random((COUNT, 3)), COLUMNS))
    read = read_points(tmp_path / "a.csv")
    for name, values in COLUMNS.items():
        assert [float(value) for value in read.attributes[name]] == [float(value) for value in values]
    assert [int(value) for value in read.attributes["hash"]] == COLUMNS["hash"].tolist()


def test_text_has_no_digits_of_single_precision_alone(tmp_path):
    values = np.array([0.123, 0.25, -7.5, 0.001], np.float32)
    table = PointTable(np.column_stack([values, values, values]).astype(np.float64), {"value": values})
    write_points(tmp_path / "a.csv", table, double=False)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[:2] == ["x,y,z,value", "0.123,0.123,0.123,0.123"]
    random = RANDOM.random(COUNT).astype(np.float32) * np.float32(1e-5)
    write_points(tmp_path / "a.csv", PointTable(RANDOM.random((COUNT, 3)), {"value": random}))
    assert_array_equal(read_points(tmp_path / "a.csv").attributes["value"].astype(np.float32), random)


def test_ply_has_all_digits(tmp_path):
    notices = write_points(tmp_path / "a.ply", PointTable(RANDOM.random((COUNT, 3)), COLUMNS))
    head = (tmp_path / "a.ply").read_bytes().split(b"end_header")[0]
    for line in (b"int id", b"uint wide", b"double time", b"uint hash", b"uint hash_high", b"double value"):
        assert b"property " + line + b"\n" in head
    read = read_points(tmp_path / "a.ply").attributes
    for name in ("id", "wide", "time", "value"):
        assert_array_equal(read[name], COLUMNS[name])
    whole = read["hash"].astype(np.uint64) + (read["hash_high"].astype(np.uint64) << np.uint64(32))
    assert_array_equal(whole, COLUMNS["hash"])
    assert notices == ["PLY has no type for hash: it is hash + 4294967296 hash_high of the file."]


def test_whole_numbers_with_a_sign_in_ply(tmp_path):
    values = WHOLE["hashes with a sign"]
    write_points(tmp_path / "a.ply", PointTable(RANDOM.random((COUNT, 3)), {"hash": values}))
    read = read_points(tmp_path / "a.ply").attributes
    assert_array_equal(read["hash"].astype(np.int64) + (read["hash_high"].astype(np.int64) << 32), values)


@pytest.mark.parametrize("kind", ["int64", "uint64"])
def test_ply_with_whole_numbers_of_64_bits(tmp_path, kind):
    values = np.arange(3, dtype=kind) + 2**62
    rows = np.zeros(3, [(axis, "<f4") for axis in "xyz"] + [("id", "<" + np.dtype(kind).str[1:])])
    rows["x"], rows["id"] = np.arange(3), values
    head = (
        "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty {} id\n"
    )
    head += "end_header\n"
    (tmp_path / "a.ply").write_bytes(head.format("binary_little_endian", kind).encode() + rows.tobytes())
    assert_array_equal(read_points(tmp_path / "a.ply").attributes["id"], values)
    text = "".join(f"{index} 0 0 {value}\n" for index, value in enumerate(values.tolist()))
    (tmp_path / "a.ply").write_text(head.format("ascii", kind) + text)
    found = read_points(tmp_path / "a.ply").attributes["id"]
    assert [int(value) for value in found] == values.tolist()


def test_names_become_words_of_ascii(tmp_path):
    names = ["Höhe", "Hoehe", "Intensité", "高さ", "強度", "two words", "two_words", "Größe [m]", "a\tb", "plain"]
    columns = {name: np.full(COUNT, float(number)) for number, name in enumerate(names)}
    notices = write_points(tmp_path / "a.ply", PointTable(RANDOM.random((COUNT, 3)), columns))
    (tmp_path / "a.ply").read_bytes().split(b"end_header")[0].decode("ascii")
    read = read_points(tmp_path / "a.ply").attributes
    words = ["Hoehe_2", "Hoehe", "Intensite", "_", "__2", "two_words_2", "two_words", "Groesse_[m]", "a_b", "plain"]
    assert {name: values[0] for name, values in read.items()} == dict(zip(words, range(10), strict=True))
    assert "Höhe as Hoehe_2" in notices[0]
