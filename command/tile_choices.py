"""What is chosen for the results of tiles: sides, roughness, and the files that hold them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import core, tools
from .orienting import add_viewpoint
from .settings import Setting, add_setting

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterable

_FORMATS = (".ply", ".laz", ".las", ".csv", ".xyz", ".npy")
_ORIENT = Setting(
    "orient",
    "Side of the normals of each component: away from its middle, or up where it is a sheet; what is seen from above;"
    " or what is seen from the viewpoint, or by the scanner if the files tell its place at each point",
    "OUTSIDE",
    choices=("OUTSIDE", "UP", "VIEWPOINT"),  # as in core
)
_WAVELENGTH = tools.roughness.WAVELENGTH


def add_measures(parser: ArgumentParser) -> None:
    """Add options for what is computed, which is decided as a cloud is cut."""
    add_setting(parser, _ORIENT)
    add_viewpoint(parser, "--orient VIEWPOINT")
    parser.add_argument("--roughness", action="store_true", help="compute the roughness, too")
    add_setting(parser, _WAVELENGTH)


def check_measures(parser: ArgumentParser, arguments: Namespace) -> None:
    """Set what other options imply, and refuse what does not go together, by `parser.error`."""
    if arguments.viewpoint is not None and arguments.orient not in (None, "VIEWPOINT"):
        parser.error(f"--viewpoint goes with --orient VIEWPOINT, not {arguments.orient}")
    if arguments.wavelength is not None and not arguments.roughness:
        parser.error("--wavelength goes with --roughness")


def measures(arguments: Namespace) -> dict[str, Any]:
    """Return what these options ask `core.tiles.cut_to_store` for, as its manifest holds it."""
    place = arguments.viewpoint
    implied = _ORIENT.default if place is None else "VIEWPOINT"
    return {
        "orient": (arguments.orient or implied).lower(),
        "viewpoint": None if place is None else place.tolist(),
        "wavelength": (arguments.wavelength or _WAVELENGTH.default) if arguments.roughness else None,
    }


def add_files_of_tiles(parser: ArgumentParser, name: str = "--format") -> None:
    """Add options for the files of results, one for each tile."""
    endings = [suffix[1:] for suffix in _FORMATS]
    parser.add_argument(
        name,
        dest="tile_format",
        choices=endings,
        default=endings[0],
        help="results of each tile; npy leaves them in the store only, where they are as arrays in any case",
    )
    parser.add_argument(
        "--smoothed",
        action="store_true",
        help="write points where they are after noise was smoothed, to files of their own; else as they were read",
    )


def ending(arguments: Namespace) -> str:
    """Return how names of files of tiles end; empty where results stay in the store as .npz."""
    if arguments.tile_format == "npy":
        return ""
    return f"{'_smoothed' if arguments.smoothed else ''}.{arguments.tile_format}"


def add_one_file(parser: ArgumentParser) -> None:
    """Add an option for one file of all results."""
    parser.add_argument(
        "--one-file",
        type=Path,
        metavar="FILE",
        help=f"write the results of all tiles to one file, too: {', '.join(core.files.WRITABLE)}",
    )


def check_one_file(parser: ArgumentParser, arguments: Namespace, read: Iterable[Path]) -> None:
    """Refuse a name that no such file can have, by `parser.error`, such as that of a file that is read."""
    path = arguments.one_file
    if path is None:
        return
    if path.suffix.lower() not in core.files.WRITABLE:
        parser.error(f"--one-file must end in {', '.join(core.files.WRITABLE)}")
    if path.resolve() in {other.resolve() for other in read}:
        parser.error(f"--one-file would overwrite {path}, which is read")
