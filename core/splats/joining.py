"""Several sets of Gaussian splats as one."""

from collections.abc import Sequence

import numpy as np

from ..types import Floats
from .columns import REST, SplatFile
from .file import encoded
from .splats import Splats

_ARRAYS = ("positions", "scales", "rotations", "opacities", "colors")


def joined(sets: Sequence[Splats]) -> Splats:
    """Join several sets of splats one after another.

    Parameters
    ----------
    sets : sequence of Splats
        At least one. Those with fewer harmonics than others get zeros.

    Returns
    -------
    Splats
        With all columns of all files, zeros where a file has none, in the layout of the first.
    """
    arrays = {name: np.concatenate([getattr(splats, name) for splats in sets]) for name in _ARRAYS}
    count = max(splats.harmonics.shape[1] for splats in sets)
    padded = [np.pad(each.harmonics, ((0, 0), (0, count - each.harmonics.shape[1]), (0, 0))) for each in sets]
    notices = [notice for splats in sets for notice in splats.notices]
    return Splats(**arrays, harmonics=np.concatenate(padded), notices=notices, file=_joined_files(sets))


def _joined_files(sets: Sequence[Splats]) -> SplatFile | None:
    """Return the columns of all files, in the layout of the first; None if there is no file."""
    files = [splats.file for splats in sets if splats.file is not None]
    if not files:
        return None
    tables = [splats.file.columns if splats.file is not None else _new_columns(splats) for splats in sets]
    columns = {}
    for name in dict.fromkeys(name for table in tables for name in table if not name.startswith(REST)):
        kind = np.result_type(*(table[name].dtype for table in tables if name in table))
        values = [table.get(name, np.zeros(len(splats), kind)) for splats, table in zip(sets, tables, strict=True)]
        columns[name] = np.concatenate(values).astype(kind)
    return SplatFile(columns, files[0].order, files[0].comments)


def _new_columns(splats: Splats) -> dict[str, Floats]:
    """Return the columns of splats that come from no file."""
    return {name: values.astype(np.float32) for name, values in encoded(splats, {}).items()}
