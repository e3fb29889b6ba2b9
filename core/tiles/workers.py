"""What each of several workers may take of this machine."""

from ..cores import cores
from ..errors import NotEnoughMemoryError
from ..memory import available_memory


def cores_of_worker(workers: int) -> int:
    """Return how many cores each of so many workers may use."""
    return max(1, cores() // workers)


def memory_of_worker(workers: int) -> int:
    """Return how many bytes each of so many workers may take.

    Raises
    ------
    NotEnoughMemoryError
        The free memory is unknown.
    """
    free = available_memory()
    if free is None:
        raise NotEnoughMemoryError("The free memory of this machine is unknown. Say how much a worker may take.")
    return free // workers
