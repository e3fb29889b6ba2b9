"""Several sets of Gaussian splats as one."""

from collections.abc import Sequence

import numpy as np

from ..types import Floats
from .columns import REST
from .file import SplatFile, encoded
from .splats import Splats

_ARRAYS = ("positions", "scales", "rotations", "opacities", "colors")


def joined(parts: Sequence[Splats]) -> Splats:
    """Join splats one after another.

    Parameters
    ----------
    parts : sequence of Splats
        At least one. Colours of those with fewer harmonics than others depend no more on the direction than before.

    Returns
    -------
    Splats
        With all columns of all files, zeros where a file has none, in the layout of the first.
    """
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    count = max(part.harmonics.shape[1] for part in parts)
    return Splats(
        **arrays,
        harmonics=np.concatenate([with_harmonics(part.harmonics, count) for part in parts]),
        notices=[notice for part in parts for notice in part.notices],
        file=_joined_files(parts),
    )


def with_harmonics(harmonics: Floats, count: int) -> Floats:
    """Return harmonics, (n, k, 3), with zeros for those that are missing of so many, (n, count, 3)."""
    return np.pad(harmonics, ((0, 0), (0, count - harmonics.shape[1]), (0, 0)))


def _joined_files(parts: Sequence[Splats]) -> SplatFile | None:
    files = [part.file for part in parts if part.file is not None]
    if not files:
        return None
    held = [part.file.columns if part.file is not None else _new_columns(part) for part in parts]
    names = dict.fromkeys(name for columns in held for name in columns if not name.startswith(REST))
    columns = {}
    for name in names:
        values = [columns.get(name) for columns in held]
        kind = np.result_type(*(each.dtype for each in values if each is not None))
        fill = (np.zeros(len(part), kind) if each is None else each for part, each in zip(parts, values, strict=True))
        columns[name] = np.concatenate(list(fill)).astype(kind)
    return SplatFile(columns, files[0].order, files[0].comments)


def _new_columns(splats: Splats) -> dict[str, Floats]:
    return {name: values.astype(np.float32) for name, values in encoded(splats, {}).items()}
