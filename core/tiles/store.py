"""Tiles on disk: each step writes files that are whole or missing, so that it can be taken again after anything."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np

from ..arguments import as_path
from ..errors import NotEnoughMemoryError, PointCloudError
from ..files import replacing, write_arrays
from ..options import LaplacianOptions
from ..types import Array, Bools, FilePath, Floats, Ints

VERSION = 4
POINTS, COLUMNS = "points.npy", "columns.npy"
_MANIFEST, _ERROR = "manifest.json", "error.json"
_TRUSTED = ("numpy", "scipy", "builtins", "copyreg", __package__.rpartition(".")[0])  # packages of what states hold
_ALIGNED = 64  # bytes to a multiple of which arrays begin in a state
_BUILTINS = {"slice", "set", "frozenset", "complex", "bytearray", "range", "object"}

Told: TypeAlias = dict[str, Array]  # what a step tells of a tile, by names
Record: TypeAlias = dict[str, Array]  # what all tiles have agreed on so far, by names


@dataclass(frozen=True, eq=False)
class Part:
    """The points of a tile with its halo, and whose they are."""

    points: Floats  # (k, 3), coordinates [L]
    inner: Bools  # (k,), which lie in the box; each point lies in that of one tile
    # (k,), which lie in the box or in the nearer half of the halo: the far end tells less, as its neighbors are missing
    close: Bools
    owner: Ints  # (k,), the tile in whose box each point lies
    place: Ints  # (k,), its place among the points in that box


class Store:
    """A folder with the tiles of a cloud, and what each step has found about them.

    Parameters
    ----------
    folder : path-like
        Made by `cut_to_store`.

    Attributes
    ----------
    manifest : dict
        Options, sources, how the cloud was cut, and what is agreed on from the start.
    record : dict
        What is agreed on so far.

    Raises
    ------
    PointCloudError
        There is no such store, or it was written by another version.
    """

    def __init__(self, folder: FilePath) -> None:
        self.folder = as_path(folder)
        try:
            self.manifest = json.loads((self.folder / _MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise PointCloudError(f"{folder} holds no tiles: {error}. Cut a cloud into it first.") from error
        if self.manifest.get("version") != VERSION:
            raise PointCloudError(
                f"{folder} was written by another version of this package. Cut the cloud into a new folder."
            )
        agreed: dict[str, Any] = {name: np.asarray(value) for name, value in self.manifest["agreed"].items()}
        self._start, self.record = agreed, agreed
        self.load_record()

    @property
    def options(self) -> LaplacianOptions:
        """The settings."""
        return LaplacianOptions(**self.manifest["options"])

    @property
    def count(self) -> int:
        """How many tiles there are."""
        return len(self.manifest["tiles"])

    @property
    def alive(self) -> Sequence[int]:
        """The numbers of the tiles that can be measured."""
        return [number for number in range(self.count) if not (self._tile(number) / _ERROR).exists()]

    def load_record(self) -> None:
        """Read what is agreed on so far."""
        record: Record = dict(self._start)
        for path in sorted(self.folder.glob("agreed-*.npz")):
            with np.load(path) as found:
                record |= dict(found)
        self.record = record

    def agreed_after(self, step: str) -> bool:
        """Whether all tiles have agreed on something after a step."""
        return self._agreed(step).exists()

    def settle(self, step: str, record: Record) -> None:
        """Keep what all tiles agree on after a step."""
        write_arrays(self._agreed(step), record)
        self.record = {**self.record, **record}

    def part(self, number: int) -> Part:
        """Return the points of a tile with its halo."""
        own = self.own(number)
        halo = {name: self.read("halo", number, name) for name in ("points", "owner", "place", "close")}
        inner = np.arange(len(own) + len(halo["owner"])) < len(own)
        return Part(
            points=np.concatenate([own, halo["points"]]),
            inner=inner,
            close=np.concatenate([np.ones(len(own), dtype=bool), halo["close"]]),
            owner=np.concatenate([np.full(len(own), number), halo["owner"]]),
            place=np.concatenate([np.arange(len(own)), halo["place"]]),
        )

    def bounds(self, number: int) -> tuple[Floats, Floats]:
        """Return the lowest and highest coordinates in the box of a tile."""
        return self.record["low"][number], self.record["high"][number]

    def own(self, number: int) -> Floats:
        """Return the points in the box of a tile."""
        return np.load(self._tile(number) / POINTS)

    def columns(self, number: int) -> dict[str, Array]:
        """Return what the input told of these points besides."""
        path = self._tile(number) / COLUMNS
        if not path.exists():
            return {}
        found = np.load(path)
        return {name: np.ascontiguousarray(found[name]) for name in found.dtype.names or ()}

    def read(self, step: str, number: int, name: str) -> Array:
        """Return what a step has told of a tile under a name."""
        path = self._path(step, number)
        try:
            with np.load(path) as found:
                result: Array = found[name]
                return result
        except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
            raise PointCloudError(f"{path} cannot be read: {error}. Delete it, and take the steps again.") from error

    def visited(self, step: str) -> list[int]:
        """Return the tiles that can be measured and that a step has been at, in their order, as `told` has them."""
        return [number for number in self.alive if self.done(step, number)]

    def told(self, step: str, name: str) -> Iterator[Array]:
        """Yield what a step has told of each tile under a name, but for those where it has not been."""
        return (self.read(step, number, name) for number in self.visited(step))

    def names(self, step: str, number: int) -> list[str]:
        """Return the names under which a step has told something of a tile."""
        with np.load(self._path(step, number)) as found:
            return list(found.files)

    def done(self, step: str, number: int) -> bool:
        """Whether a step has been at a tile."""
        return self._path(step, number).exists()

    def changed(self, number: int, steps: Sequence[str]) -> int:
        """Return when the last of some steps has told of a tile, in nanoseconds."""
        paths = [self._path(step, number) for step in steps]
        return max((path.stat().st_mtime_ns for path in paths if path.exists()), default=0)

    def state(self, step: str, number: int) -> Any:
        """Return what the last step at a tile before this one has left to go on from; None at first.

        A step that was killed after it had left its own state begins again from the one before.
        """
        before = self._states(number, but=step)
        if not before:
            return None
        path = before[-1]
        try:
            return _load_state(path)
        except (OSError, EOFError, IndexError, ValueError, pickle.UnpicklingError) as error:
            raise PointCloudError(f"{path} cannot be read: {error}. Cut the cloud again.") from error

    def put(self, step: str, number: int, told: Told, state: Any) -> None:
        """Keep what a step has told of a tile, and its state, unless that is None: then the last one stays."""
        before = self._states(number, but=step)
        if state is not None:
            place = int(before[-1].stem.split("-")[1]) + 1 if before else 0
            path = self._tile(number) / f"state-{place:02d}-{step}.pickle"
            with replacing(path) as part:
                _save_state(part, state)
        write_arrays(self._path(step, number), told)
        if state is not None:
            for path in before:
                path.unlink(missing_ok=True)

    def forget(self, number: int) -> None:
        """Delete the states of a tile: no step goes on from there."""
        for path in self._states(number):
            path.unlink(missing_ok=True)

    def fail(self, step: str, number: int, error: PointCloudError) -> None:
        """Note that a tile cannot be measured."""
        with replacing(self._tile(number) / _ERROR) as part:
            scarce = isinstance(error, NotEnoughMemoryError)
            part.write_text(json.dumps({"step": step, "error": str(error), "scarce": scarce}), encoding="utf-8")
        self.forget(number)

    def error(self, number: int) -> str | None:
        """Return why a tile cannot be measured; None if it can."""
        text: str | None = self._failure(number).get("error")
        return text

    def is_scarce(self, number: int) -> bool:
        """Whether that is for want of memory."""
        return bool(self._failure(number).get("scarce"))

    def _failure(self, number: int) -> dict[str, Any]:
        path = self._tile(number) / _ERROR
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        return found

    def take_back(self, steps: Sequence[str]) -> None:
        """Delete what some steps have told, and what was agreed on after them; they must be the last ones.

        If that is stopped, these steps can be taken again from where it was.
        """
        for step in reversed(steps):
            self._agreed(step).unlink(missing_ok=True)
        for step in reversed(steps):
            for number in range(self.count):
                self._path(step, number).unlink(missing_ok=True)
        self.load_record()

    def _tile(self, number: int) -> Path:
        return tile_folder(self.folder, number)

    def _path(self, step: str, number: int) -> Path:
        return self._tile(number) / f"{step}.npz"

    def _states(self, number: int, but: str = "") -> list[Path]:
        """Return the states of a tile in the order in which they were left, but for that of one step."""
        found = sorted(self._tile(number).glob("state-*.pickle"))
        return [path for path in found if path.stem.split("-")[2] != but]

    def _agreed(self, step: str) -> Path:
        return self.folder / f"agreed-{step}.npz"


def tile_folder(folder: FilePath, number: int) -> Path:
    """Return the folder of a tile in that of a store."""
    return as_path(folder) / f"{number:06d}"


def _save_state(path: Path, state: Any) -> None:
    """Write a state: a pickle without what its arrays hold, that, and last where each part of the file begins."""
    buffers: list[pickle.PickleBuffer] = []
    pickled = pickle.dumps(state, protocol=5, buffer_callback=buffers.append)
    parts, begins = [memoryview(pickled), *(buffer.raw() for buffer in buffers)], [0]
    with open(path, "wb") as file:
        for part in parts:
            file.write(part)
            file.write(bytes(-file.tell() % _ALIGNED))
            begins += [begins[-1] + len(part), file.tell()]
        file.write(np.array([*begins[:-1], len(begins) - 1], dtype="<i8").tobytes())


def _load_state(path: Path) -> Any:
    """Read a state, of whose arrays no more is copied to memory than is looked at or changed."""
    # A file whose data are looked at in place cannot be deleted in Windows.
    data = np.fromfile(path, np.uint8) if os.name == "nt" else np.memmap(path, np.uint8, mode="c")
    count = int(data[-8:].view("<i8")[0])
    begins = data[-8 * (count + 1) : -8].view("<i8").reshape(-1, 2).tolist()
    pickled, *buffers = (data[begin:end] for begin, end in begins)
    return _Reader(io.BytesIO(pickled.tobytes()), buffers).load()


class _Reader(pickle.Unpickler):
    """Reads states, which hold arrays and classes of this package: anything else is no state."""

    def __init__(self, file: IO[bytes], buffers: Iterable[Any]) -> None:
        super().__init__(file, buffers=buffers)

    def find_class(self, module: str, name: str) -> Any:
        """Return a class that a state may hold."""
        package = module if module.startswith(_TRUSTED[-1]) else module.partition(".")[0]
        known = any(package == trusted or package.startswith(f"{trusted}.") for trusted in _TRUSTED)
        if not known or (package == "builtins" and name not in _BUILTINS):
            raise pickle.UnpicklingError(f"it holds {module}.{name}, which is no part of a state")
        return super().find_class(module, name)


def write_manifest(
    folder: Path, options: LaplacianOptions, tiles: Sequence[int], agreed: dict[str, Any], known: dict[str, Any]
) -> None:
    """Write the manifest of a store, of which it is the last file.

    `tiles` are the points in each box, `agreed` is what is agreed on from the start, `known` what else is told of the
    cloud.
    """
    manifest = {
        "version": VERSION,
        **known,
        "options": asdict(options),
        "agreed": {name: np.asarray(value).tolist() for name, value in agreed.items()},
        "tiles": [{"points": int(count)} for count in tiles],
    }
    with replacing(folder / _MANIFEST) as part:
        part.write_text(json.dumps(manifest, indent=1), encoding="utf-8")
