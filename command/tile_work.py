"""Clouds larger than memory: what is read of their files, who works on their tiles, and what is written of each."""

import contextlib
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from . import clouds, core
from .quantities import eigenvector_name, rows_of

STORE = "store"  # the folder within that of a run
_PIECE = 1_000_000  # points that are read at once
_PACKAGE = "meshfree-laplacian[scale]"


class Sources:
    """The points of some files, read in pieces, as often as they are asked for.

    Parameters
    ----------
    paths : sequence of pathlib.Path
    las : LasChoices

    Attributes
    ----------
    notices : list of str
        Of the last time that they were read.
    full : float
        The number of a full color in them; zero if they have none.
    """

    def __init__(self, paths, las):
        self._paths, self._las = paths, las
        self.notices, self.full = [], 0.0

    def __call__(self):
        """Yield points, and their other numbers."""
        notices, channels = [], []
        for path in self._paths:
            pieces = core.files.chunks(path, _PIECE, las=self._las)
            for points, columns in pieces:
                channels += [
                    columns[name].max(keepdims=True) for name in core.files.CHANNELS[:3] if len(columns.get(name, ()))
                ]
                yield points, columns
            notices += pieces.notices
        self.notices = notices
        self.full = core.files.full_color(np.concatenate(channels)) if channels else 0.0


def tile_path(folder, number, suffix):
    """Return the path of the results of a tile, in the folder of a run."""
    return Path(folder) / f"tile_{number:06d}{suffix}"


def write_tile(store, number, path):
    """Write the results of a tile, with the columns of its points, unless that is done; return its number."""
    path, store = Path(path), core.tiles.Store(store)
    if path.exists() and path.stat().st_mtime_ns >= store.changed(number, ("measure", "modes")):
        return number
    table = _table(store, number)
    if path.suffix.lower() not in core.files.LASER_FILES:
        core.files.write_points(path, table)
        return number
    with core.files.replacing(path) as part:
        core.files.write_las(part, table)
    return number


def _table(store, number):
    """Return the points of a tile, with their columns and results."""
    found = {name: store.read("measure", number, name) for name in store.names("measure", number)}
    results = SimpleNamespace(laplacian=SimpleNamespace(**found), mean_curvature=found["mean_curvature"])
    columns, colors = store.columns(number), None
    channels = [columns.pop(name) for name in core.files.CHANNELS if name in columns]
    if len(channels) >= 3:
        alpha = channels[3] if len(channels) > 3 else None
        colors = core.files.unit_colors(np.stack(channels[:3], axis=1), alpha, store.manifest["full color"])
    measures = {row.attribute: row.of(results) for row in rows_of("analyze")}
    if store.done("modes", number):
        vectors = store.read("modes", number, "modes").T
        measures |= {eigenvector_name(place): vector for place, vector in enumerate(vectors, 1)}
    return clouds.with_results(core.files.PointTable(store.own(number), columns, colors), measures)


@contextlib.contextmanager
def workers(count, memory, address):
    """Provide a function that calls another with a folder, and each of some arguments, on all workers.

    Parameters
    ----------
    count : int
        Processes on this machine; with one, and no address, all is done in this one.
    memory : int
        Bytes that each may take.
    address : str
        Of the scheduler of a Dask cluster, or empty.

    Yields
    ------
    callable
        Takes a function and tuples of arguments, and yields its results as they come.
    """
    if count == 1 and not address:
        yield lambda function, many: (function(*given) for given in many)
        return
    try:
        from distributed import Client, LocalCluster, as_completed
    except ImportError as error:
        raise core.PointCloudError(
            f"Several workers need Dask, and {error.name} is missing. Install {_PACKAGE}, or use one worker."
        ) from error
    with contextlib.ExitStack() as stack:
        if not address:
            cluster = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                memory_limit=memory,
                dashboard_address=None,
                env={"MESHFREE_CORES": str(core.tiles.cores_of_worker(count))},
            )
            address = stack.enter_context(cluster)
        client = stack.enter_context(Client(address))

        def spread(function, many):
            futures = client.map(function, *zip(*many, strict=True), pure=False) if many else []
            return (done.result() for done in as_completed(futures))

        yield spread


def seconds_of(store, number):
    """Return the CPU seconds that the steps have taken at a tile."""
    done = [step.name for step in core.tiles.steps_of(store) if store.done(step.name, number)]
    return sum(float(store.read(step, number, "seconds")) for step in done)


def tile_records(store, folder, suffix):
    """Return what a report tells of each tile: its points, area, seconds and notices, or the error."""
    records = []
    for number in range(store.count):
        path = tile_path(folder, number, suffix) if suffix else core.tiles.tile_folder(store.folder, number)
        record = {
            "file": str(path),
            "tile": number,
            "points": len(store.own(number)),
            "elapsed": round(seconds_of(store, number), 3),
        }
        error = store.error(number)
        if error is not None:
            records.append({**record, "error": error})
        elif store.done("measure", number):
            area = float(store.read("measure", number, "areas").sum())
            notices = store.read("measure", number, "notices").tolist()
            records.append({**record, "total_area": area, "notices": notices})
        else:
            records.append({**record, "waiting": True})
    return records


def eigenvalues(store):
    """Return the eigenvalues of the modes that all tiles have."""
    return next(store.told("spectrum", "values")).tolist()


def totals(store, records):
    """Return the sums over all tiles."""
    measured = [record for record in records if "total_area" in record]
    components = set()
    for record in measured:
        components |= set(np.unique(store.read("measure", record["tile"], "component")).tolist())
    return {
        "points": sum(record["points"] for record in records),
        "measured_points": sum(record["points"] for record in measured),
        "total_area": float(sum(record["total_area"] for record in measured)),
        "component_count": len(components - {-1}),
        "tiles": len(records),
        "failed_tiles": sum("error" in record for record in records),
        "cpu_seconds": round(sum(record["elapsed"] for record in records), 3),
    }


def bytes_of(text):
    """Parse a size such as 2GB or 500MB as bytes.

    Raises
    ------
    ValueError
        It is something else.
    """
    units = {"B": 1, "KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30, "TB": 1 << 40}
    number = text.strip().upper()
    unit = next((unit for unit in ("KB", "MB", "GB", "TB", "B") if number.endswith(unit)), "")
    digits = number.removesuffix(unit).strip()
    value = float(digits) * units.get(unit, 1) if re.fullmatch(r"[0-9]+(\.[0-9]+)?", digits) else 0.0
    if not value > 0.0:
        raise ValueError(f"{text!r} is no size, such as 2GB")
    return int(value)
