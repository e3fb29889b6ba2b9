"""The walk over a store, step by step, by whoever is to visit its tiles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..errors import ComponentError, NotEnoughMemoryError
from ..types import FilePath, Progress
from .cutting import HALOS
from .modes import MODES
from .steps import MEASURE, Step, agree, part_of, survey_steps, visit
from .store import Store


def steps_of(store: Store) -> list[Step]:
    """Return all steps of a store, in their order."""
    modes = MODES if "modes" in store.record else ()
    return [*HALOS, *survey_steps(store.options), MEASURE, *modes]


def pending(store: Store) -> tuple[Step, list[int]] | None:
    """Return the step that a store waits for, and the tiles at which it has not been; None if all is done.

    Where no tile is left to visit, it waits for what `settle` does.
    """
    for step in steps_of(store):
        if not store.agreed_after(step.name):
            return step, [number for number in step.where(store) if not store.done(step.name, number)]
    return None


def visit_tile(folder: FilePath, step: str, number: int) -> int:
    """Take a step at a tile of a store, in whatever process, and return its number.

    Parameters
    ----------
    folder : path-like
        Of the store.
    step : str
        Its name.
    number : int
        Of the tile.
    """
    store = Store(folder)
    [chosen] = [known for known in steps_of(store) if known.name == step]
    visit(store, chosen, number, store.options)
    if chosen is MEASURE:
        store.forget(number)
    return number


def settle(store: Store) -> bool:
    """Agree on what the step that a store waits for has found, and tell whether it waits for another one.

    Nothing is done while tiles are left to visit.

    Raises
    ------
    ComponentError, NotEnoughMemoryError
        None of the tiles can be measured; for want of memory, if that is why of one.
    """
    if not store.alive:
        kind = NotEnoughMemoryError if any(map(store.is_scarce, range(store.count))) else ComponentError
        raise kind("None of the tiles can be measured. See the error of each in the report.")
    waiting = pending(store)
    if waiting is not None and not waiting[1]:
        store.settle(waiting[0].name, agree(store, waiting[0], store.options))
        waiting = pending(store)
    return waiting is not None


def run_steps(
    store: Store,
    visit_all: Callable[[str, Sequence[int]], Iterable[int]] | None = None,
    progress: Progress | None = None,
) -> None:
    """Take all steps that are left.

    Parameters
    ----------
    store : Store
    visit_all : callable, optional
        Takes the name of a step and the numbers of tiles, and calls `visit_tile` for each, in any order and any
        process; yields their numbers as they are done. One after the other in this process if not given.
    progress : callable, optional
        Called as ``progress(stage, fraction)``, where the fraction is that of the work of all steps; may raise
        `Cancelled`.

    Examples
    --------
    >>> import tempfile
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     store = mf.tiles.cut_to_store(lambda: [(points, {})], folder + "/store", 400)
    ...     mf.tiles.run_steps(store)
    ...     area = sum(store.read("measure", number, "areas").sum() for number in store.alive)
    >>> print(area.round(1))
    12.6
    """
    report = progress or (lambda stage, fraction: None)

    def one_by_one(step: str, numbers: Sequence[int]) -> Iterable[int]:
        return (visit_tile(store.folder, step, number) for number in numbers)

    while (waiting := pending(store)) is not None:
        step, numbers = waiting
        begin, end = part_of(steps_of(store), step)
        count = len(step.where(store))
        visited = (visit_all or one_by_one)(step.name, numbers)
        report(step.stage, begin)
        for left, _ in enumerate(visited, 1 - len(numbers)):
            report(step.stage, end + (end - begin) * left / count)
        settle(store)
