"""The verbs for clouds larger than memory: `tiles run`, and its stages one by one."""

from __future__ import annotations

import argparse
import json
import shutil
import time
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import core, tile_choices, tile_work
from .inputs import add_choices, files_in, las_choices, parse_share
from .records import SUFFIX, stamp
from .rows import TABLES, write_rows, write_text
from .settings import LAPLACIAN, add_setting, chosen
from .stages import ToldStages, tell_aside
from .tile_work import STORE
from .verb import DONE, ELSEWHERE, FAILED, ONE_LINE, Verb

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from tools.tool import Array, Progress

_SETTINGS = [LAPLACIAN[field.name] for field in fields(core.LaplacianOptions)]
_EACH = 0.01  # of the work is told
_READ, _WRITTEN = 0.02, 0.02  # shares of a run that reading and writing files take about
_CHOICES = ("classes", "withheld", "meters", "columns", "bounds", "level")  # options for what is read of files
_SIZES = ("memory", "tile_points")  # options for how large tiles are
_ONE_FILES = "one_files.json"  # in the store: which files of all results were written
_REPORT = f"tiles{SUFFIX}"  # in the folder of a run
_LOCK = ".run.lock"  # beside it


class _TileVerb(Verb):
    """A verb for tiles; what it says of itself is in full by its help."""

    @property
    def description(self) -> str:  # type: ignore[override]  # computed
        """What it does, in full."""
        return f"{self.help[0].upper()}{self.help[1:]}. {ONE_LINE}"

    def expand(self, path: Path, arguments: argparse.Namespace) -> list[Path]:
        return [path]

    def failure(self, result: dict[str, Any]) -> int:
        scarce = [error.get("scarce", False) for error in result.get("errors", ())]
        return (ELSEWHERE if any(scarce) else FAILED) if scarce else DONE

    def check(self, parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
        if arguments.part != (1, 1):
            parser.error("--part divides files, not tiles: use --tiles K/N with survey and measure")


class _Cutting(_TileVerb):
    """A verb that cuts files into tiles: all inputs together, into one folder."""

    inputs = "point clouds that are parts of one; or folders of such"
    _own: tuple[Any, ...] = ()  # the files that an earlier run has written, but for those of tiles, and its store

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "--out-dir", dest="folder", type=Path, required=True, metavar="DIR", help="folder for the tiles and results"
        )
        parser.add_argument(
            "--memory", type=_size, metavar="SIZE", help="memory of each worker, such as 2GB; else what is free"
        )
        parser.add_argument("--tile-points", type=int, metavar="INT", help="points of a tile; else by the memory")
        for setting in _SETTINGS:
            add_setting(parser, setting)
        tile_choices.add_measures(parser)
        add_choices(parser)
        corners = [f"{axis}{end}" for end in (1, 2) for axis in "XYZ"]
        parser.add_argument(
            "--bounds",
            type=float,
            nargs=6,
            metavar=tuple(corners),
            help="lowest and highest corner of a box to read, in meters with --meters",
        )
        parser.add_argument("--level", type=int, metavar="INT", help="last level of detail of COPC files to read")

    def expand(self, path: Path, arguments: argparse.Namespace) -> list[Path]:
        if not path.is_dir():
            return [path]
        return [file for file in files_in(path) if not self.owns(file, arguments)]

    def owns(self, path: Path, arguments: argparse.Namespace) -> bool:
        if not self._own:
            folder = arguments.folder / STORE
            store = core.tiles.Store(folder) if folder.exists() else None
            self._own = ({str((arguments.folder / _REPORT).resolve()), *_one_files(store)} if store else set(), store)
        files, store = self._own
        if store is None or str(path.resolve()) in store.manifest["sources"]:
            return False
        return str(path.resolve()) in files or tile_work.is_tile_path(path, arguments.folder)

    def written_once(self, arguments: argparse.Namespace) -> list[Path]:
        return [arguments.folder / _REPORT]

    def check(self, parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
        if arguments.part != (1, 1):
            parser.error("--part would leave points out: all inputs are one cloud")
        if arguments.tile_points is not None and arguments.tile_points < 1:
            parser.error("--tile-points must be at least 1")
        if arguments.columns and not any(path.suffix.lower() in core.files.TEXTS for path in arguments.inputs):
            parser.error(f"--columns is for files of text, {', '.join(core.files.TEXTS)}")
        for path in arguments.inputs:
            if tile_work.is_tile_path(path, arguments.folder):
                parser.error(f"results of tiles would overwrite {path}, which is read: choose another --out-dir")
        tile_choices.check_measures(parser, arguments)
        arguments.sources, arguments.inputs = arguments.inputs, [arguments.folder]

    def cut(self, arguments: argparse.Namespace, count: int, progress: Progress) -> tuple[core.tiles.Store, list[str]]:
        """Return the store of a folder, for so many workers, and the notices of what was read; cut it if need be."""
        given = chosen(_SETTINGS, arguments)
        given = {name: value.lower() if isinstance(value, str) else value for name, value in given.items()}
        options = core.LaplacianOptions(**given)
        if any(path.suffix.lower() in core.files.SCANS for path in arguments.sources):
            core.files.import_las()
        folder, memory = arguments.folder / STORE, arguments.memory or core.tiles.memory_of_worker(count)
        known = {
            "sources": [str(path.resolve()) for path in arguments.sources],
            "read": {name: getattr(arguments, name) for name in _CHOICES},
        }
        own = {"stamps": _stamps(arguments), "asked": {name: getattr(arguments, name) for name in _SIZES}}
        measures, anew = tile_choices.measures(arguments), []
        halo = core.tiles.halo_of(options)
        if folder.exists():
            store = core.tiles.Store(folder)
            same = {name: store.manifest["agreed"].get(name) for name in measures} == measures
            if not same or ({name: store.manifest.get(name) for name in known}, store.options) != (known, options):
                raise core.PointCloudError(
                    f"{arguments.folder} has tiles of other files or settings. Choose another folder, or delete it."
                )
            _check_stamps(store.manifest.get("stamps", {}), own["stamps"], arguments.folder, "the tiles were cut")
            if not _wants_others(store, own["asked"]):
                return store, _notices(store)
            anew = [f"The tiles are cut anew, for another {' or '.join(_options(_SIZES))} than before."]
        most = arguments.tile_points or core.tiles.points_of_tile(memory, options, halo)
        if anew:
            _delete(store, arguments.folder)
        sources = tile_work.Sources(
            arguments.sources, las_choices(arguments), arguments.columns, arguments.bounds, arguments.level
        )
        choices = {**measures, "halo": halo, "memory": memory, "workers": 1 if arguments.tile_points else count}
        while True:
            try:
                store = _cut(sources, folder, most, options, {**known, **own}, choices, progress)
            except tile_work.Incomplete:
                continue  # without the file that broke off
            try:
                _check_stamps(own["stamps"], _stamps(arguments), arguments.folder, "reading began")
            except core.PointCloudError:
                shutil.rmtree(folder)
                raise
            return store, [*anew, *_notices(store)]


def _stamps(arguments: argparse.Namespace) -> dict[str, list[int] | None]:
    """Return size and time of each file that is read."""
    return {str(path.resolve()): stamp(path) for path in arguments.sources}


def _check_stamps(before: dict[str, Any], now: dict[str, Any], folder: Path, since: str) -> None:
    """Refuse files that have changed since."""
    changed = [path for path, known in before.items() if now.get(path) != known]
    if changed:
        more = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
        sizes = [f"{found[0]:,} bytes" if found else "no file" for found in (before[changed[0]], now[changed[0]])]
        how = f"{sizes[0]} then, {sizes[1]} now" if sizes[0] != sizes[1] else "another time, the same size"
        raise core.PointCloudError(
            f"{changed[0]}{more} changed since {since} ({how}): the results would be of neither. Choose another folder,"
            f" or delete {folder}."
        )


def _wants_others(store: core.tiles.Store, asked: dict[str, Any]) -> bool:
    """Whether tiles of another size are wanted than a store has: not for other memory alone where all are measured."""
    before = store.manifest.get("asked", dict.fromkeys(_SIZES))
    other = [name for name in _SIZES if asked[name] not in (None, before[name])]
    done = core.tiles.pending(store) is None and len(store.alive) == store.count
    return "tile_points" in other or (bool(other) and not done)


def _options(names: Iterable[str]) -> list[str]:
    return [f"--{name.replace('_', '-')}" for name in names]


def _delete(store: core.tiles.Store, folder: Path) -> None:
    """Delete tiles that are cut anew, with their files."""
    for path in list(folder.iterdir()):
        if tile_work.is_tile_path(path, folder) and str(path.resolve()) not in store.manifest["sources"]:
            path.unlink()
    shutil.rmtree(store.folder)


def _one_files(store: core.tiles.Store) -> list[str]:
    """Return the files of all results that were written from a store."""
    path = store.folder / _ONE_FILES
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _notices(store: core.tiles.Store) -> list[str]:
    """Return what is to be told of the files that were cut."""
    columns = store.manifest["columns left out"]
    missing = [f"Left out {', '.join(columns)}, which not all files have."] if columns else []
    return [*store.manifest["notices"], *missing]


def _cut(
    sources: tile_work.Sources,
    folder: Path,
    most: int,
    options: core.LaplacianOptions,
    known: dict[str, Any],
    choices: dict[str, Any],
    progress: Progress,
) -> core.tiles.Store:
    begin = 0.0

    def chunks() -> Iterator[tuple[Array, dict[str, Array]]]:
        nonlocal begin
        yield from sources(lambda share: progress("Read", begin + 0.5 * share))  # twice
        begin = 0.5
        broken = {str(path): str(error) for path, error in sources.broken.items()}
        las = None if sources.las is None else sources.las.to_json()
        known.update({"full color": sources.full, "las": las, "notices": sources.notices, "broken": broken})

    progress("Read", 0.0)
    return core.tiles.cut_to_store(chunks, folder, most, options, known=known, **choices)


class TilesRun(_Cutting):
    """The verb `tiles run`."""

    name = "tiles run"
    help = "analyze a cloud larger than memory, tile by tile; a run that was stopped goes on where it was"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        super().add_options(parser)
        _add_modes(parser, 0)
        parser.add_argument("--workers", type=int, default=1, metavar="INT", help="processes on this machine")
        parser.add_argument("--scheduler", default="", metavar="ADDRESS", help="of a Dask cluster that does the work")
        tile_choices.add_files_of_tiles(parser)
        tile_choices.add_one_file(parser)

    def written_once(self, arguments: argparse.Namespace) -> list[Path]:
        several = [arguments.one_file, tile_work.tile_path(arguments.folder, 0, tile_choices.ending(arguments))]
        return [*super().written_once(arguments), *(path for path in several if path is not None and path.suffix)]

    def check(self, parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
        super().check(parser, arguments)
        if arguments.workers < 1:
            parser.error("--workers must be at least 1")
        tile_choices.check_one_file(parser, arguments, arguments.sources)
        _check_modes(parser, arguments, 0)

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        with core.files.alone_in(arguments.folder, _LOCK), _ToldTiles(self.name, _EACH) as stages:
            tile_work.check_workers(arguments.workers, arguments.scheduler, path)
            store, notices = self.cut(arguments, arguments.workers, _share(stages, 0.0, _READ))
            if arguments.modes:
                core.tiles.ask_for_modes(store, arguments.modes, arguments.mode_points)
            with tile_work.workers(arguments.workers, arguments.scheduler) as spread:

                def visit_all(step: str, numbers: Sequence[int]) -> Iterable[int]:
                    [known] = [one for one in core.tiles.steps_of(store) if one.name == step]
                    many = [(str(store.folder), step, number) for number in numbers]
                    count = len(known.where(store))
                    return stages.counted(spread(core.tiles.visit_tile, many), count - len(many), count)

                try:
                    core.tiles.run_steps(store, visit_all, _share(stages, _READ, 1.0 - _WRITTEN))
                except core.PointCloudError:
                    _report(store, path, arguments)  # which tiles have failed before
                    raise
                written = _share(stages, 1.0 - _WRITTEN, 1.0)
                _write(store, path, store.alive, arguments, spread, written)
            return {**_report(store, path, arguments), "notices": [*notices, *_finish(store, arguments)]}


class _ToldTiles(ToldStages):
    """Tells at how many of all tiles a step is done, and the time that is left of all steps."""

    def __init__(self, label: str, each: float) -> None:
        super().__init__(label, each)
        self._tiles = ""
        self._first: tuple[float, float] | None = None

    def counted(self, visited: Iterable[int], before: int, count: int) -> Iterator[int]:
        """Count what is visited, after those before, from now on; return it."""
        self._tiles = f", {before} of {count} tiles"

        def counted() -> Iterator[int]:
            for done, one in enumerate(visited, before + 1):
                self._tiles = f", {done} of {count} tiles"
                yield one
            self._tiles = ""

        return counted()

    def tell(self, stage: str, fraction: float) -> None:
        now = time.monotonic()
        began, before = self._first = self._first or (now, fraction)
        left = (now - began) * (1.0 - fraction) / (fraction - before) if fraction > before + _EACH else None
        rest = "" if left is None else f", {_duration(left)} left"
        tell_aside(f"{self._label}: {stage}{self._tiles}, {fraction:.0%}{rest}")


def _duration(seconds: float) -> str:
    """Write a time for people."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


class TilesCut(_Cutting):
    """The verb `tiles cut`."""

    name = "tiles cut"
    help = "cut a cloud larger than memory into tiles, the first stage"

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        with core.files.alone_in(arguments.folder, _LOCK), ToldStages(self.name, _EACH) as stages:
            store, notices = self.cut(arguments, 1, stages)
        errors = tile_work.file_records(store)
        broken = [{"file": record["file"], "error": record["error"]} for record in errors]
        told = {"failed_files": len(broken), "errors": broken, "notices": notices}
        return {"points": store.manifest["points"], "tiles": store.count, **told}


class _Stage(_TileVerb):
    """A stage for a folder of tiles."""

    inputs = "folders with tiles, of tiles cut"

    def store(self, path: Path) -> core.tiles.Store:
        """Return the store in a folder."""
        return core.tiles.Store(path / STORE)

    def visit(
        self, store: core.tiles.Store, waiting: tuple[Any, list[int]] | None, arguments: argparse.Namespace
    ) -> dict[str, Any]:
        """Take a step at a share of the tiles that wait for it; none where nothing waits. Return which failed, too."""
        if waiting is None:
            return {"step": None, "visited": 0, "waiting": 0, "errors": []}
        (step, numbers), (number, count) = waiting, arguments.tiles
        mine = [tile for tile in numbers if tile % count == number - 1]
        with ToldStages(self.name, _EACH) as stages:
            for done, tile in enumerate(mine):
                stages(step.stage, done / len(mine))
                core.tiles.visit_tile(store.folder, step.name, tile)
        errors = [tile_work.failure(store, tile) for tile in mine if store.error(tile) is not None]
        return {"step": step.name, "visited": len(mine), "waiting": len(numbers) - len(mine), "errors": errors}


class TilesSurvey(_Stage):
    """The verb `tiles survey`."""

    name = "tiles survey"
    help = "take the next step at the tiles, all or a share of them; tiles agree follows each"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        _add_share(parser)

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        store = self.store(path)
        waiting = core.tiles.pending(store)
        if waiting is None or store.agreed_after("measure") or waiting[0].name == "measure":
            return {**self.visit(store, None, arguments), "notices": ["The survey is done: measure the tiles."]}
        return {**self.visit(store, waiting, arguments), "notices": []}


class TilesAgree(_Stage):
    """The verb `tiles agree`."""

    name = "tiles agree"
    help = "merge what the tiles have told in a step; prints the next one"

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        store = self.store(path)
        waiting = core.tiles.pending(store)
        if waiting is not None and waiting[1]:
            raise core.PointCloudError(
                f"{len(waiting[1])} tiles of {path} wait for the step {waiting[0].name}. Survey or measure them first."
            )
        core.tiles.settle(store)
        waiting = core.tiles.pending(store)
        return {"next": None if waiting is None else waiting[0].name, "notices": []}


class TilesMeasure(_Stage):
    """The verb `tiles measure`."""

    name = "tiles measure"
    help = "measure the tiles, all or a share of them, and write the results of each"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        _add_share(parser)
        tile_choices.add_files_of_tiles(parser)

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        store = self.store(path)
        waiting = core.tiles.pending(store)
        if store.agreed_after("measure"):
            waiting = None
        elif waiting is not None and waiting[0].name != "measure":
            raise core.PointCloudError(f"{path} waits for the step {waiting[0].name} of the survey. Take it first.")
        found = self.visit(store, waiting, arguments)
        number, count = arguments.tiles
        measured = [tile for tile in store.alive if store.done("measure", tile)]
        mine = [tile for tile in measured if tile % count == number - 1]
        _write(store, path, mine, arguments, tile_work.one_by_one)
        return {**found, "notices": []}


class TilesModes(_Stage):
    """The verb `tiles modes`."""

    name = "tiles modes"
    help = "take the next step towards the low vibration modes at the tiles, all or a share; tiles agree follows each"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        _add_modes(parser, 10)
        _add_share(parser)

    def check(self, parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
        super().check(parser, arguments)
        _check_modes(parser, arguments, 1)

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        store = self.store(path)
        waiting = core.tiles.pending(store)
        if waiting is not None and not store.agreed_after("measure"):
            raise core.PointCloudError(f"{path} waits for the step {waiting[0].name}. Measure the tiles first.")
        core.tiles.ask_for_modes(store, arguments.modes, arguments.mode_points)
        waiting = core.tiles.pending(store)
        return {**self.visit(store, waiting, arguments), "notices": [] if waiting else ["The modes are done."]}


class TilesReport(_Stage):
    """The verb `tiles report`."""

    name = "tiles report"
    help = "tell the results and errors of all tiles, and totals"
    outputs = TABLES
    prints_all = True

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        tile_choices.add_files_of_tiles(parser, "--tile-format")
        tile_choices.add_one_file(parser)

    def check(self, parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
        super().check(parser, arguments)
        if arguments.one_file is not None and len(arguments.inputs) > 1:
            parser.error("--one-file takes one folder of tiles")
        tile_choices.check_one_file(parser, arguments, [])

    def run(self, path: Path, arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
        store = self.store(path)
        found = _report(store, path, arguments)
        if output is not None:
            rows = tile_work.tile_records(store, path, tile_choices.ending(arguments))
            rows += tile_work.file_records(store)
            names = ("tile", "file", "points", "total_area", "elapsed", "error")
            write_rows(output, [{name: row.get(name) for name in names} for row in rows])
        return {**found, "notices": _finish(store, arguments)}


def _share(progress: Progress, begin: float, end: float) -> Progress:
    """Return a progress callback whose fractions are those of a share of the work."""
    return lambda stage, fraction: progress(stage, begin + (end - begin) * fraction)


def _write(
    store: core.tiles.Store,
    folder: Path,
    numbers: Sequence[int],
    arguments: argparse.Namespace,
    spread: tile_work.Spread,
    progress: Progress = lambda stage, fraction: None,
) -> None:
    """Write the results of some tiles."""
    suffix = tile_choices.ending(arguments)
    if not suffix:
        return
    paths = [str(tile_work.tile_path(folder, number, suffix)) for number in numbers]
    many = [(str(store.folder), number, path, arguments.smoothed) for number, path in zip(numbers, paths, strict=True)]
    progress("Write", 0.0)
    for done, _ in enumerate(spread(tile_work.write_tile, many), 1):
        progress("Write", done / len(many))


def _finish(store: core.tiles.Store, arguments: argparse.Namespace) -> list[str]:
    """Write one file of all results, if that is asked for, and return what is to be told of the results."""
    notices = tile_work.doubts(store)
    if arguments.one_file is not None:
        notices += tile_work.write_one(store, arguments.one_file, arguments.smoothed)
        known = {*_one_files(store), str(arguments.one_file.resolve())}
        write_text(store.folder / _ONE_FILES, json.dumps(sorted(known)))
    return notices


def _report(store: core.tiles.Store, folder: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """Write the report of all tiles, a line of JSON for each, and return the totals with the errors."""
    records = tile_work.tile_records(store, folder, tile_choices.ending(arguments))
    files = tile_work.file_records(store)
    shared = {"verb": "tiles run", "settings": store.manifest["options"], "stamps": {}, "ended": round(time.time(), 3)}
    lines = [{"path": record["file"], **shared, **record} for record in [*files, *records]]
    write_text(folder / _REPORT, "".join(f"{json.dumps(line)}\n" for line in lines))
    errors = [{"file": record["file"], "error": record["error"]} for record in files]
    errors += [tile_work.failure(store, record["tile"]) for record in records if "error" in record]
    modes = {"eigenvalues": tile_work.eigenvalues(store)} if store.agreed_after("spectrum") else {}
    return {**tile_work.totals(store, records), **modes, "failed_files": len(files), "errors": errors}


def _add_modes(parser: argparse.ArgumentParser, default: int) -> None:
    parser.add_argument(
        "--modes",
        type=int,
        default=default,
        metavar="INT",
        help="how many vibration modes to compute, by evenly spread points; all points get them",
    )
    parser.add_argument(
        "--mode-points", type=int, metavar="INT", help="how many such points; else a million, or as the memory allows"
    )


def _check_modes(parser: argparse.ArgumentParser, arguments: argparse.Namespace, least: int) -> None:
    if arguments.modes < least or (arguments.mode_points is not None and arguments.mode_points < 1):
        parser.error("--modes and --mode-points are numbers above zero")


def _add_share(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--tiles",
        type=parse_share,
        default=(1, 1),
        metavar="K/N",
        help="take the K-th of N equal shares of the tiles only",
    )


def _size(text: str) -> int:
    try:
        return tile_work.bytes_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
