"""Operators in files: the same bits after loading, and broken files told."""

import json
import zipfile
from dataclasses import fields

import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.samplings import fibonacci_sphere, hemisphere_random, random_sphere

CLOUDS = {
    "sphere": lambda: core.build_laplacian(random_sphere(600)),
    "boundary": lambda: core.build_laplacian(hemisphere_random(700) + 100.0),
    "twice": lambda: core.build_laplacian(np.concatenate([fibonacci_sphere(300)] * 2)),
    "left out": lambda: core.build_laplacian(np.vstack([fibonacci_sphere(400), [[5.0, 0.0, 0.0]]])),
    "options": lambda: core.build_laplacian(fibonacci_sphere(400), options=core.LaplacianOptions(bandwidth="global")),
    "noise": lambda: core.build_laplacian(
        fibonacci_sphere(900) * (1.0 + 0.05 * np.random.default_rng(0).normal(size=(900, 1)))
    ),
    "paper": lambda: core.paper.build_laplacian(fibonacci_sphere(400)),
}


def same(left, right):
    if sparse.issparse(left):
        return all(same(getattr(left, part), getattr(right, part)) for part in ("data", "indices", "indptr"))
    if isinstance(left, np.ndarray):
        return left.dtype == right.dtype and left.tobytes() == right.tobytes() and left.shape == right.shape
    if isinstance(left, core.Agreed):
        return all(same(getattr(left, one.name), getattr(right, one.name)) for one in fields(left))
    return left == right


@pytest.mark.parametrize("cloud", CLOUDS)
def test_the_same_bits(cloud, tmp_path):
    laplacian = CLOUDS[cloud]()
    core.save(laplacian, tmp_path / "a.npz")
    again = core.load(tmp_path / "a.npz")
    assert [one.name for one in fields(again) if not same(getattr(laplacian, one.name), getattr(again, one.name))] == []
    assert same(laplacian.eigenpairs(4, raw=True).eigenvectors, again.eigenpairs(4, raw=True).eigenvectors)
    assert repr(again) == repr(laplacian)


@pytest.fixture
def saved(tmp_path):
    core.save(core.build_laplacian(fibonacci_sphere(300)), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:  # which reads no pickles
        return tmp_path / "a.npz", dict(arrays)


def test_of_another_version(saved):
    path, arrays = saved
    told = json.loads(str(arrays["told"]))
    assert told["version"] == 1
    np.savez(path, **(arrays | {"told": np.array(json.dumps(told | {"version": 2}))}))
    with pytest.raises(core.PointCloudError, match="version 2, and this program reads version 1. Build and save"):
        core.load(path)


def no_operator(path, arrays):
    np.savez(path, points=arrays["points"])


def without_areas(path, arrays):
    np.savez(path, **{name: array for name, array in arrays.items() if name != "areas"})


def indices_beyond(path, arrays):
    np.savez(path, **(arrays | {"stiffness.indices": arrays["stiffness.indices"] + 300}))


def cut(path, arrays):
    path.write_bytes(path.read_bytes()[:5000])


def changed(path, arrays):
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("told.npy", b"no array")


def one_array(path, arrays):
    with open(path, "wb") as file:
        np.save(file, arrays["points"])


def pickled(path, arrays):
    np.savez(path, **(arrays | {"points": np.array([{}], dtype=object)}))


@pytest.mark.parametrize("breaks", [no_operator, without_areas, indices_beyond, cut, changed, one_array, pickled])
def test_what_is_none(saved, breaks):
    breaks(*saved)
    with pytest.raises(core.PointCloudError, match="a.npz"):
        core.load(saved[0])


def test_no_file(tmp_path):
    with pytest.raises(core.PointCloudError, match="There is no file"):
        core.load(tmp_path / "none.npz")
    with pytest.raises(core.PointCloudError, match="a name that ends in .npz"):
        core.save(core.build_laplacian(fibonacci_sphere(300)), tmp_path / "a.npy")
    assert not list(tmp_path.iterdir())
