"""Gaussian splats: files bit for bit, ellipsoids under linear maps, harmonics that turn."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import sph_harm_y

import core
from benchmarks.samplings import fibonacci_sphere
from core.splats import joined
from core.splats.ellipsoids import mapped, matrices_of, quaternions_of
from core.splats.harmonics import COUNTS, harmonics, rotated

RNG = np.random.default_rng(20)
TURNS = Rotation.random(500, random_state=1)


def some_splats(count=500, rest=15):
    return core.splats.Splats(
        positions=RNG.standard_normal((count, 3)),
        scales=np.exp(RNG.uniform(-9.0, 0.0, (count, 3))),
        rotations=Rotation.random(count, random_state=2).as_quat(scalar_first=True),
        opacities=RNG.uniform(0.0, 1.0, count),
        colors=RNG.standard_normal((count, 3)),
        harmonics=RNG.standard_normal((count, rest, 3)),
    )


def written_ply(path, rest=9, order="<", count=50, extra=(), comments=()):
    """Write a file of splats as trainers do, by other code than that of core."""
    names = ["x", "y", "z", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(rest))]
    names += ["opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4)), *extra]
    rows = np.zeros(count, [(name, f"{order}f4") for name in names])
    for name in names:
        rows[name] = RNG.standard_normal(count) * (3.0 if name == "opacity" else 1.0)
    kind = "little" if order == "<" else "big"
    header = ["ply", f"format binary_{kind}_endian 1.0", *comments, f"element vertex {count}"]
    header += [f"property float {name}" for name in names] + ["end_header", ""]
    path.write_bytes("\n".join(header).encode() + rows.tobytes())
    return rows


def close_covariances(found, wanted, rtol):
    size = np.abs(wanted).max(axis=(1, 2))
    assert (np.abs(found - wanted).max(axis=(1, 2)) <= rtol * size).all()


def test_harmonics_are_orthonormal_and_those_of_scipy():
    z, weight = np.polynomial.legendre.leggauss(12)
    angle = np.arange(24) * np.pi / 12
    ring = np.sqrt(1.0 - z**2)[:, None]
    directions = np.stack([ring * np.cos(angle), ring * np.sin(angle), np.repeat(z[:, None], 24, axis=1)], axis=-1)
    values = harmonics(directions, 24)
    products = np.einsum("i,ijk,ijl->kl", weight * np.pi / 12, values, values)
    np.testing.assert_allclose(products, np.eye(24), atol=1e-13)
    polar, azimuth = np.arccos(directions[..., 2]), np.arctan2(directions[..., 1], directions[..., 0])
    for degree in range(1, 5):
        for order in range(-degree, degree + 1):
            complex_one = sph_harm_y(degree, abs(order), polar, azimuth)
            part = complex_one.real if order >= 0 else complex_one.imag
            wanted = part * (np.sqrt(2.0) if order else 1.0)
            np.testing.assert_allclose(values[..., degree**2 - 1 + degree + order], wanted, atol=1e-12)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turned_harmonics_are_the_old_ones_in_directions_turned_back(count, sign):
    coefficients = RNG.standard_normal((500, count, 3))
    turns = sign * TURNS.as_matrix()  # proper ones, and such that mirror
    directions = Rotation.random(200, random_state=3).apply([0.0, 0.0, 1.0])
    found = harmonics(directions, count) @ rotated(coefficients, turns)
    back = np.einsum("dk,nke->nde", directions, turns)
    np.testing.assert_allclose(found, harmonics(back, count) @ coefficients, atol=1e-12)


def test_quaternions_and_matrices_are_those_of_scipy():
    quaternions = np.concatenate([TURNS.as_quat(scalar_first=True), np.eye(4)])
    matrices = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    np.testing.assert_allclose(np.moveaxis(matrices_of(quaternions), 2, 0), matrices, atol=1e-15)
    found = quaternions_of(np.moveaxis(matrices, 0, 2))
    np.testing.assert_allclose(np.abs(np.einsum("nk,nk->n", found, quaternions)), 1.0, atol=1e-14)


@pytest.mark.parametrize("kind", ["any", "turns", "mirrors", "stretches", "singular"])
def test_mapped_ellipsoids_have_the_mapped_covariances(kind):
    splats = some_splats()
    maps = {
        "any": RNG.standard_normal((500, 3, 3)),
        "turns": TURNS.as_matrix(),
        "mirrors": TURNS.as_matrix() * [1.0, 1.0, -1.0],
        "stretches": np.tile(np.diag([3.0, 1e-4, 50.0]), (500, 1, 1)),
        "singular": RNG.standard_normal((500, 3, 1)) * RNG.standard_normal((500, 1, 3)),
    }[kind]
    moved = splats.deformed(splats.positions, maps)
    wanted = np.einsum("nab,nbc,ndc->nad", maps, splats.covariances, maps)
    close_covariances(moved.covariances, wanted, 1e-9 if kind == "singular" else 1e-12)  # that cancels
    np.testing.assert_allclose(np.linalg.norm(moved.rotations, axis=1), 1.0, atol=1e-14)
    assert (np.einsum("nk,nk->n", moved.rotations, splats.rotations) >= 0.0).all()


def test_a_turn_keeps_the_digits_of_the_shortest_axes():
    scales = np.tile([1.0, 1e-3, 1e-9], (500, 1))
    rotations = Rotation.random(500, random_state=2).as_quat(scalar_first=True)
    found, _ = mapped(scales, rotations, TURNS.as_matrix())
    np.testing.assert_allclose(np.sort(found, axis=1), np.sort(scales, axis=1), rtol=1e-6)


def test_a_uniform_scale_scales_the_axes_alone():
    splats = some_splats()
    moved = splats.deformed(2.5 * splats.positions, np.tile(2.5 * np.eye(3), (500, 1, 1)))
    np.testing.assert_allclose(moved.scales, 2.5 * splats.scales, rtol=1e-12)
    np.testing.assert_allclose(moved.rotations, splats.rotations, atol=1e-7)
    np.testing.assert_allclose(moved.harmonics, splats.harmonics, atol=1e-12)


def test_splats_without_a_length_keep_a_rotation():
    splats = core.splats.Splats([[0, 0, 0]], [[0, 0, 0]], [[1, 0, 0, 0]], [1.0], [[0, 0, 0]], np.zeros((1, 3, 3)))
    moved = splats.deformed([[1, 1, 1]], np.zeros((1, 3, 3)))
    np.testing.assert_array_equal(moved.scales, 0.0)
    np.testing.assert_allclose(np.linalg.norm(moved.rotations), 1.0)


@pytest.mark.parametrize("rest", [0, 9, 24, 45, 72])
@pytest.mark.parametrize("order", ["<", ">"])
def test_what_is_not_changed_is_written_bit_for_bit(tmp_path, rest, order):
    given, again = tmp_path / "given.ply", tmp_path / "again.ply"
    rows = written_ply(given, rest, order, extra=("confidence",), comments=["comment made by a trainer"])
    splats = core.splats.read_splats(given)
    assert splats.notices == []
    np.testing.assert_allclose(splats.scales[:, 1], np.exp(rows["scale_1"].astype(float)))
    np.testing.assert_allclose(splats.opacities, 1.0 / (1.0 + np.exp(-rows["opacity"].astype(float))))
    np.testing.assert_array_equal(splats.colors[:, 2], rows["f_dc_2"])
    assert splats.harmonics.shape == (50, rest // 3, 3)
    for channel in range(3):  # channel by channel
        for number in range(rest // 3):
            wanted = rows[f"f_rest_{channel * rest // 3 + number}"]
            np.testing.assert_array_equal(splats.harmonics[:, number, channel], wanted)
    core.splats.write_splats(again, splats)
    assert given.read_bytes() == again.read_bytes()


def test_only_what_changed_is_written_anew(tmp_path):
    given, again = tmp_path / "given.ply", tmp_path / "again.ply"
    rows = written_ply(given)
    splats = core.splats.read_splats(given)
    maps = np.tile(np.eye(3), (50, 1, 1))
    maps[7] = Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix() * 2.0
    moved = splats.deformed(splats.positions, maps)
    core.splats.write_splats(again, moved)
    found = core.splats.read_splats(again)
    close_covariances(found.covariances, moved.covariances, 1e-5)
    before, after = (np.array(path.read_bytes()[-rows.nbytes :]) for path in (given, again))
    before, after = (np.frombuffer(each.tobytes(), rows.dtype) for each in (before, after))
    others = np.arange(50) != 7
    for name in ("scale_0", "opacity", "nx", "x"):
        np.testing.assert_array_equal(before[name][others], after[name][others])
    np.testing.assert_array_equal(before["opacity"], after["opacity"])
    assert before["scale_0"][7] != after["scale_0"][7]


def test_new_splats_are_written_in_the_common_layout(tmp_path):
    splats = some_splats(40, 8)
    core.splats.write_splats(tmp_path / "new.ply", splats)
    found = core.splats.read_splats(tmp_path / "new.ply")
    for name in ("positions", "scales", "opacities", "colors", "harmonics"):
        np.testing.assert_allclose(getattr(found, name), getattr(splats, name), rtol=2e-6, atol=1e-6)
    close_covariances(found.covariances, splats.covariances, 1e-5)


def test_joined_splats_keep_the_columns_of_all_files(tmp_path):
    """One set is of a big-endian file with a column more, one of a file without harmonics, one of none."""
    written_ply(tmp_path / "a.ply", 24, ">", extra=("confidence",), comments=["comment first"])
    written_ply(tmp_path / "b.ply", 0, count=30)
    sets = [
        core.splats.read_splats(tmp_path / "a.ply"),
        core.splats.read_splats(tmp_path / "b.ply"),
        some_splats(20, 3),
    ]
    core.splats.write_splats(tmp_path / "joined.ply", joined(sets))
    found = core.splats.read_splats(tmp_path / "joined.ply")
    np.testing.assert_array_equal(found.positions[:80], np.concatenate([sets[0].positions, sets[1].positions]))
    np.testing.assert_allclose(found.scales, np.concatenate([each.scales for each in sets]), rtol=1e-5)
    np.testing.assert_array_equal(found.harmonics[:50], sets[0].harmonics)
    assert not found.harmonics[50:80].any()
    np.testing.assert_allclose(found.harmonics[80:, :3], sets[2].harmonics, atol=1e-6)
    assert (found.file.order, list(found.file.comments)) == (">", ["comment first"])
    np.testing.assert_array_equal(found.file.columns["confidence"][:50], sets[0].file.columns["confidence"])
    assert not found.file.columns["confidence"][50:].any()
    assert joined([some_splats(2), some_splats(3)]).file is None


def test_extreme_numbers_of_a_file_are_read_and_written_again(tmp_path):
    path = tmp_path / "extreme.ply"
    rows = written_ply(path, 0, count=6)
    rows["opacity"] = [np.inf, -np.inf, 0.0, 100.0, -100.0, 0.0]
    rows["scale_0"] = [0.0, -np.inf, 80.0, 80.0, -120.0, 0.0]
    for number in range(4):
        rows[f"rot_{number}"][1] = 0.0
    path.write_bytes(path.read_bytes()[: -rows.nbytes] + rows.tobytes())
    splats = core.splats.read_splats(path)
    np.testing.assert_allclose(splats.opacities, [1.0, 0.0, 0.5, 1.0, 0.0, 0.5], atol=1e-12)
    np.testing.assert_array_equal(splats.rotations[1], [1, 0, 0, 0])
    assert np.isfinite(splats.scales).all()
    core.splats.write_splats(tmp_path / "again.ply", splats)
    assert (tmp_path / "again.ply").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(("rest", "used"), [(12, 3), (51, 15), (7, 0), (75, 0)])
def test_harmonics_of_no_whole_degree_are_left_out_with_a_notice(tmp_path, rest, used):
    written_ply(tmp_path / "odd.ply", rest)
    splats = core.splats.read_splats(tmp_path / "odd.ply")
    assert splats.harmonics.shape[1] == used
    assert "f_rest" in splats.notices[0]
    core.splats.write_splats(tmp_path / "again.ply", splats)
    assert (tmp_path / "again.ply").read_bytes() == (tmp_path / "odd.ply").read_bytes()


def test_files_that_hold_no_splats_are_refused(tmp_path):
    (tmp_path / "points.ply").write_bytes(
        b"ply\nformat ascii 1.0\nelement vertex 1\n"
        b"property float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n"
    )
    with pytest.raises(core.InvalidPointsError, match="no Gaussian splats.*opacity"):
        core.splats.read_splats(tmp_path / "points.ply")
    with pytest.raises(core.PointCloudError, match="no file"):
        core.splats.read_splats(tmp_path / "none.ply")
    with pytest.raises(core.PointCloudError, match=r"\.ply"):
        core.splats.write_splats(tmp_path / "splats.txt", some_splats(2))
    with pytest.raises(core.PointCloudError, match="no name of a file"):
        core.splats.read_splats(5)
    with pytest.raises(core.PointCloudError, match="not Splats"):
        core.splats.write_splats(tmp_path / "splats.ply", [1.0])
    rows = written_ply(tmp_path / "bad.ply", 0)
    rows["x"][3] = 1e35
    (tmp_path / "bad.ply").write_bytes((tmp_path / "bad.ply").read_bytes()[: -rows.nbytes] + rows.tobytes())
    assert len(core.splats.read_splats(tmp_path / "bad.ply")) == len(rows) - 1
    (tmp_path / "short.ply").write_bytes((tmp_path / "bad.ply").read_bytes()[:-9])
    with pytest.raises(core.InvalidPointsError):
        core.splats.read_splats(tmp_path / "short.ply")


def test_arrays_of_wrong_shapes_are_refused():
    splats = some_splats(10)
    with pytest.raises(core.InvalidPointsError, match="Rotations"):
        core.splats.Splats(
            splats.positions, splats.scales, np.ones((10, 3)), splats.opacities, splats.colors, splats.harmonics
        )
    with pytest.raises(core.InvalidPointsError, match="harmonics"):
        core.splats.Splats(
            splats.positions, splats.scales, splats.rotations, splats.opacities, splats.colors, np.ones((10, 7, 3))
        )
    with pytest.raises(core.InvalidPointsError, match="[Gg]radients"):
        splats.deformed(splats.positions, np.eye(3))
    with pytest.raises(core.InvalidPointsError, match="2 of 10"):
        splats.deformed(splats.positions, np.where(np.arange(10)[:, None, None] < 2, np.nan, np.eye(3)))


def test_floaters_are_found_whatever_the_units_and_the_order():
    """A sphere of flat splats, with faint ones, huge ones, and such as float above it."""
    points = fibonacci_sphere(2000)
    rng = np.random.default_rng(4)
    frames = np.stack([np.cross(points, [0.3, 0.8, 0.1]), np.zeros_like(points), points], axis=2)
    frames[:, :, 0] /= np.linalg.norm(frames[:, :, 0], axis=1)[:, None]
    frames[:, :, 1] = np.cross(frames[:, :, 2], frames[:, :, 0])
    opacities, scales = rng.uniform(0.3, 1.0, 2000), np.tile([0.05, 0.04, 0.003], (2000, 1))
    wrong = rng.permutation(2000)[:90]
    faint, huge, apart = wrong[:30], wrong[30:60], wrong[60:]
    opacities[faint], scales[huge] = 0.01, 2.0
    points[apart] *= 1.6
    rotations = quaternions_of(np.moveaxis(frames, 0, 2))
    splats = core.splats.Splats(points, scales, rotations, opacities, points, np.zeros((2000, 0, 3)))
    found = core.splats.floaters(splats)
    np.testing.assert_array_equal(np.flatnonzero(found), np.sort(wrong))
    similar = 300.0 * TURNS.as_matrix()[0]
    turned_ones = splats.deformed(points @ similar.T, np.tile(similar, (2000, 1, 1)))
    np.testing.assert_array_equal(core.splats.floaters(turned_ones), found)
    order = rng.permutation(2000)
    parts = (points[order], scales[order], rotations[order], opacities[order], points[order], np.zeros((2000, 0, 3)))
    np.testing.assert_array_equal(core.splats.floaters(core.splats.Splats(*parts)), found[order])


def test_floaters_need_splats_with_finite_numbers():
    with pytest.raises(core.InvalidPointsError, match="not Splats"):
        core.splats.floaters(np.zeros((5, 3)))
    splats = some_splats(20)
    scales = splats.scales.copy()
    scales[3] = np.nan
    splats = replace(splats, scales=scales)
    with pytest.raises(core.InvalidPointsError, match="1 of 20"):
        core.splats.floaters(splats)
    assert core.splats.floaters(some_splats(5)).shape == (5,)
