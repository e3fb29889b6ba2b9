"""Clouds larger than memory: what is read of their files, who works on their tiles, and what is written of each."""

from __future__ import annotations

import contextlib
import logging
import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from . import clouds, core, quantities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from tools.tool import Array

Spread: TypeAlias = "Callable[[Callable[..., Any], Sequence[tuple[Any, ...]]], Iterable[Any]]"
STORE = "store"  # the folder within that of a run
_TILE = re.compile(r"tile_\d{6,}(_smoothed)?\.\w+")
_PIECE = 1_000_000  # points that are read at once
_SPAWNED = "distributed.nanny.pre-spawn-environ"
_NEVER = 1 << 40  # bytes
# For workers on this machine; docs/tiles.md tells them for clusters of others.
DASK = {
    # Memory that is given back is asked for again at once, and cleared first: that took a sixth of a worker's time.
    _SPAWNED: {"MALLOC_MMAP_THRESHOLD_": _NEVER, "MALLOC_TRIM_THRESHOLD_": _NEVER, "MALLOC_ARENA_MAX": 1},
    # What workers hold between tasks is of no use on disk, and looking after them took a twentieth of the time.
    # Nor are workers ended for what they seem to take, in which files count that they look at in place.
    **{f"distributed.worker.memory.{name}": False for name in ("target", "spill", "pause", "terminate")},
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}
_LOCAL = {
    # A worker that ended is waited for: on a busy machine it takes longer than 15 s to come back, those that were given
    # up then did not, and without any all waited for ever. Where none comes back at all, that is told.
    "distributed.deploy.lost-worker-timeout": "1 day",
    "distributed.scheduler.no-workers-timeout": "5 minutes",
}
_QUIET = {"DASK_LOGGING__DISTRIBUTED": "critical"}  # what workers meet while they are ended is no one's concern
_CLOSING = 60  # seconds
_IGNORE_STOP = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"  # this process ends its workers itself
_CONNECTING = 15  # seconds
_BRIEF = 200  # characters of an error of Dask
_OF_DASK = {"asyncio", "concurrent", "dask", "distributed", "tornado"}  # modules of errors
_PACKAGE = "meshfree-laplacian[scale]"


class Sources:
    """The points of some files, read in pieces, as often as they are asked for.

    Columns are the names of those of files of text; empty to find them. Bounds are the lowest and highest corner of the
    box that is read, six numbers, the level is the last one of detail; files that have none are broken then. `broken`
    has the files that cannot be read, and are left out, and why; `notices` are of the last time that they were read;
    `full` is the number of a full color, zero if they have none; `las` is what those of LAS state besides.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        las: core.files.LasChoices,
        columns: str = "",
        bounds: Sequence[float] | None = None,
        level: int | None = None,
    ) -> None:
        self._columns = columns
        self._choices: dict[str, Any] = {
            "las": las,
            "bounds": None if bounds is None else np.reshape(bounds, (2, 3)),
            "level": level,
        }
        self._sizes = {path: path.stat().st_size if path.is_file() else 0 for path in paths}
        self._counts: dict[Path, int] = {}  # of points, as far as known
        self.notices: list[str] = []
        self.full = 0.0
        self.las: core.files.LasForm | None = None
        self.broken: dict[Path, core.PointCloudError] = {}
        self._forms: dict[Path, core.files.LasForm | None] = {}

    def __call__(self, progress: Callable[[float], None]) -> Iterator[tuple[Array, dict[str, Array]]]:
        """Yield points, and their other numbers.

        `progress` is called with the share that has been read, by the sizes of files, and of points within them. If a
        file breaks off after points of it were given, `Incomplete` is raised: it is left out the next time. If none of
        the files can be read, `PointCloudError` is.
        """
        self.notices, channels = [], [np.zeros(0)]
        total, before = max(sum(self._sizes.values()), 1), 0
        for path, size in self._sizes.items():
            count = 0
            try:
                for points, columns in () if path in self.broken else self._pieces(path):
                    count += len(points)
                    channels += [
                        columns[name].max(keepdims=True)
                        for name in core.files.CHANNELS[:3]
                        if len(columns.get(name, ()))
                    ]
                    yield points, columns
                    progress((before + size * min(count / self._counts.get(path, np.inf), 1.0)) / total)
            except core.NotEnoughMemoryError:
                raise
            except core.PointCloudError as error:
                self.broken[path] = error
                if count:
                    raise Incomplete from error
            before += size
            self._counts[path] = max(count, 1)
            if not count and path not in self.broken:
                self.notices.append(f"{path.name} has no points.")
        if len(self.broken) == len(self._sizes):
            raise next(iter(self.broken.values()))
        left_out = [f"Left out a file: {error}" for error in self.broken.values()]
        found = np.concatenate(channels)
        self.full = core.files.full_color(found) if len(found) else 0.0
        forms = [form for path, form in self._forms.items() if path not in self.broken]
        self.las, differing = core.files.join_forms(forms, self.full)
        self.notices = core.files.join_notices([*self.notices, *left_out, *differing])

    def _pieces(self, path: Path) -> Iterator[tuple[Array, dict[str, Array]]]:
        """Yield the points of a file, and note what is to be told of it."""
        is_text, is_scan = (path.suffix.lower() in kinds for kinds in (core.files.TEXTS, core.files.SCANS))
        pieces = core.files.chunks(path, _PIECE, columns=self._columns if is_text else "", **self._choices)
        if is_scan:
            self._counts[path] = max(core.files.extent(path).count, 1)
        corners: list[Array] = []
        for points, columns in pieces:
            corners = [*corners, points.min(axis=0), points.max(axis=0)]
            corners = [np.min(corners, axis=0), np.max(corners, axis=0)]
            yield points, columns
        self._forms[path] = pieces.las
        notices = list(pieces.notices)
        if corners:
            table = core.files.PointTable(np.stack(corners), single=pieces.single, degrees=pieces.degrees)
            notices += core.files.doubts(table, path)
        self.notices += dict.fromkeys(notices)  # some files tell of that themselves


class Incomplete(Exception):
    """Points of a file were given, and more cannot be read."""


def is_tile_path(path: Path, folder: str | Path) -> bool:
    """Whether a file may be that of the results of a tile, in the folder of a run."""
    return path.resolve().parent == Path(folder).resolve() and _TILE.fullmatch(path.name) is not None


def tile_path(folder: Path, number: int, suffix: str) -> Path:
    """Return the path of the results of a tile, in the folder of a run."""
    return Path(folder) / f"tile_{number:06d}{suffix}"


def write_tile(store: str, number: int, path: str, smoothed: bool) -> int:
    """Write the results of a tile, with the columns of its points, unless that is done; return its number."""
    file, tiles = Path(path), core.tiles.Store(store)
    if not file.exists() or file.stat().st_mtime_ns < tiles.changed(number, ("measure", "modes")):
        core.files.write_pieces(file, lambda: [_table(tiles, number, smoothed)])
    return number


def write_one(store: core.tiles.Store, path: Path, smoothed: bool) -> list[str]:
    """Write the results of all tiles that could be measured to one file, and return notices."""
    waiting = core.tiles.pending(store)
    if waiting is not None:
        raise core.PointCloudError(
            f"The tiles wait for the step {waiting[0].name}. Take all steps before {path.name} is written."
        )
    return core.files.write_pieces(path, lambda: (_table(store, number, smoothed) for number in store.alive))


def _table(store: core.tiles.Store, number: int, smoothed: bool) -> core.files.PointTable:
    """Return the points of a tile, as they were read or where they are on the surface, with columns and results."""
    found = {name: store.read("measure", number, name) for name in store.names("measure", number)}
    results = SimpleNamespace(laplacian=SimpleNamespace(**found), mean_curvature=found["mean_curvature"])
    columns, colors = store.columns(number), None
    channels = [columns.pop(name) for name in core.files.CHANNELS if name in columns]
    if len(channels) >= 3:
        alpha = channels[3] if len(channels) > 3 else None
        colors = core.files.unit_colors(np.stack(channels[:3], axis=1), alpha, store.manifest["full color"])
    measures = {row.attribute: row.of(results) for row in quantities.rows_of("analyze")}
    if core.tiles.ROUGHNESS in found:
        measures |= dict.fromkeys(quantities.written_by("roughness"), found[core.tiles.ROUGHNESS])
    if store.done("modes", number):
        vectors = store.read("modes", number, "modes").T
        measures |= {quantities.eigenvector_name(place): vector for place, vector in enumerate(vectors, 1)}
    points = found["surface_points"] if smoothed else store.own(number)
    stated = store.manifest.get("las")
    las = None if stated is None else core.files.LasForm(**stated)
    return clouds.with_results(core.files.PointTable(points, columns, colors, las=las), measures)


def doubts(store: core.tiles.Store) -> list[str]:
    """Return notices on what halos are too narrow for."""
    found = core.tiles.doubted_wavelength(store.record, store.manifest["halo"])
    if found is None:
        return []
    wavelength, share = found
    return [
        f"The wavelength {wavelength:.4g} is long against the halos of {store.manifest['halo']:g} spacings: next to the"
        f" borders of tiles, roughness may be off by {share:.1%} of the smoothing. Use a shorter one."
    ]


def one_by_one(function: Callable[..., Any], many: Iterable[tuple[Any, ...]]) -> Iterator[Any]:
    """Call a function with each of some arguments in this process, and yield its results."""
    return (function(*given) for given in many)


def check_workers(count: int, address: str, folder: Path) -> None:
    """Raise `PointCloudError` where Dask or a cluster is missing, or workers of it do not see a folder."""
    if count > 1 or address:
        _imported()
    if not address:
        return
    with _client(address) as client:
        try:
            blind = [worker for worker, sees in client.run(sees_folder, str(folder)).items() if not sees]
        except Exception as error:  # of any sort, as workers raise them
            raise core.PointCloudError(
                f"The workers at {address} cannot run this program: {_brief(error)}. Install the same version there."
            ) from error
    if blind:
        raise core.PointCloudError(
            f"{len(blind)} workers at {address} do not see the folder {folder}, {blind[0]} among them. Choose one that"
            " all see under the same path."
        )


def sees_folder(folder: str) -> bool:
    """Whether this process sees a folder."""
    return Path(folder).is_dir()


def _imported() -> tuple[Any, Any]:
    """Return Dask's packages."""
    try:
        import dask
        import distributed
    except ImportError as error:
        raise core.PointCloudError(
            f"Several workers need Dask, and {error.name} is missing. Install {_PACKAGE}, or use one worker."
        ) from error
    return dask, distributed


@contextlib.contextmanager
def _client(address: str) -> Iterator[Any]:
    """Connect to a scheduler."""
    _, distributed = _imported()
    _silence()
    try:
        client = distributed.Client(address, timeout=_CONNECTING)
    except (OSError, ValueError, TypeError) as error:  # no answer, or no address at all
        raise core.PointCloudError(
            f"No scheduler of Dask answers at {address!r}: {_brief(error)}. Start it, or correct its address, such as"
            " tcp://head:8786."
        ) from error
    with client:
        yield client


def _silence() -> None:
    """Let Dask log nothing, by any of its loggers, most of which have their own level: we tell what matters of it."""
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] in ("asyncio", "distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _brief(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())[:_BRIEF]}".removesuffix(": ")


@contextlib.contextmanager
def workers(count: int, address: str) -> Iterator[Spread]:
    """Provide a function that calls another with a folder, and each of some arguments, on all workers.

    Those are processes on this machine, or of the Dask cluster whose scheduler has an address. With one, and no
    address, all is done in this process. The function yields results as they come. It may raise `NotEnoughMemoryError`,
    and a PointCloudError where the cluster fails.
    """
    if count == 1 and not address:
        yield one_by_one
        return
    dask, distributed = _imported()
    with contextlib.ExitStack() as stack:
        if not address:
            spawned = {_SPAWNED: dask.config.get(_SPAWNED) | DASK[_SPAWNED] | _QUIET}
            _silence()
            stack.enter_context(dask.config.set({**DASK, **_LOCAL, **spawned}))
            address = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",  # any free port: without an address Dask asks for the same one always
                env={"MESHFREE_CORES": str(core.tiles.cores_of_worker(count))},
                preload=[_IGNORE_STOP],
                silence_logs=logging.CRITICAL,
            )
            stack.callback(_close, address, count)
        client = stack.enter_context(_client(address))

        def spread(function: Callable[..., Any], many: Sequence[tuple[Any, ...]]) -> Iterator[Any]:
            futures = client.map(function, *zip(*many, strict=True), pure=False) if many else []
            try:
                yield from (done.result() for done in distributed.as_completed(futures))
            except (distributed.KilledWorker, distributed.scheduler.NoWorkerError) as error:
                raise core.NotEnoughMemoryError(
                    "Workers ended one after the other, as where the memory is not enough. Go on with fewer workers, or"
                    " with --tile-points for smaller tiles, which are cut anew."
                ) from error
            except Exception as error:
                if type(error).__module__.partition(".")[0] not in _OF_DASK:  # of a tile
                    raise
                raise core.PointCloudError(
                    f"The cluster failed: {_brief(error)}. What is done stays: start the run again once it works."
                ) from error

        yield spread


def _close(cluster: Any, count: int) -> None:
    """End the workers of this machine. What they were to do is done by now, or its error is on the way."""
    with contextlib.suppress(TimeoutError):
        cluster.wait_for_workers(count, timeout=_CLOSING)  # one that is just starting again would stumble
    cluster.shutdown_on_close = False  # here, and not once more as the program ends
    try:
        cluster.close(timeout=_CLOSING)
    except Exception as error:  # of any sort: Dask may stumble over workers that it is just starting again
        print(f"Workers are ended with the program, for Dask did not close them: {error!r}", file=sys.stderr)


def seconds_of(store: core.tiles.Store, number: int) -> float:
    """Return the CPU seconds that the steps have taken at a tile."""
    done = [step.name for step in core.tiles.steps_of(store) if store.done(step.name, number)]
    return sum(float(store.read(step, number, "seconds")) for step in done)


def tile_records(store: core.tiles.Store, folder: Path, suffix: str) -> list[dict[str, Any]]:
    """Return what a report tells of each tile: its points, area, seconds and notices, or the error."""
    records = []
    for number in range(store.count):
        path = tile_path(folder, number, suffix)
        if not path.is_file():  # results are in the store only, or nowhere
            path = core.tiles.tile_folder(store.folder, number)
        record = {
            "file": str(path),
            "tile": number,
            "points": len(store.own(number)),
            "elapsed": round(seconds_of(store, number), 3),
        }
        if store.error(number) is not None:
            records.append({**record, **failure(store, number)})
        elif store.done("measure", number):
            area = float(store.read("measure", number, "areas").sum())
            notices = store.read("measure", number, "notices").tolist()
            records.append({**record, "total_area": area, "notices": notices})
        else:
            records.append({**record, "waiting": True})
    return records


def failure(store: core.tiles.Store, number: int) -> dict[str, Any]:
    """Return what is told of a tile that failed."""
    return {"tile": number, "error": store.error(number), "scarce": store.is_scarce(number)}


def file_records(store: core.tiles.Store) -> list[dict[str, Any]]:
    """Return what a report tells of each file that was left out."""
    broken = store.manifest["broken"]
    return [{"file": path, "elapsed": 0.0, "error": error} for path, error in broken.items()]


def eigenvalues(store: core.tiles.Store) -> list[float]:
    """Return the eigenvalues of the modes that all tiles have."""
    return next(store.told("spectrum", "values")).tolist()


def totals(store: core.tiles.Store, records: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the sums over all tiles."""
    measured = [record for record in records if "total_area" in record]
    components, points, on, doubtful = set(), sum(record["points"] for record in records), 0, 0
    for record in measured:
        component = store.read("measure", record["tile"], "component")
        components |= set(np.unique(component).tolist())
        on += int(np.count_nonzero(component >= 0))
        doubtful += int(np.count_nonzero((store.read("measure", record["tile"], "doubt") > 0) & (component >= 0)))
    return {
        "points": points,
        "measured_points": sum(record["points"] for record in measured),
        "total_area": float(sum(record["total_area"] for record in measured)),
        "component_count": len(components - {-1}),
        "share_in_doubt": round(doubtful / max(points, 1), 6),
        "share_unmeasured": round(1.0 - on / max(points, 1), 6),
        "tiles": len(records),
        "failed_tiles": sum("error" in record for record in records),
        "cpu_seconds": round(sum(record["elapsed"] for record in records), 3),
    }


def bytes_of(text: str) -> int:
    """Parse a size such as 2GB or 500MB as bytes; something else raises ValueError."""
    units = {"B": 1, "KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30, "TB": 1 << 40}
    number = text.strip().upper()
    unit = next((unit for unit in ("KB", "MB", "GB", "TB", "B") if number.endswith(unit)), "")
    digits = number.removesuffix(unit).strip()
    value = float(digits) * units.get(unit, 1) if re.fullmatch(r"[0-9]+(\.[0-9]+)?", digits) else 0.0
    if not value > 0.0:
        raise ValueError(f"{text!r} is no size, such as 2GB")
    return int(value)
