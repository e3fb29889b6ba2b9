"""Operators in files: saved once, and loaded to the same bits wherever they are needed again."""

import json
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile
from scipy import sparse

from .arguments import as_path
from .errors import InvalidPointsError, PointCloudError
from .files import reading, write_arrays
from .geometry import Agreed
from .operator import LaplaceBeltrami
from .options import LaplacianOptions
from .types import Array, FilePath

_KIND, _VERSION = "operator of meshfree_laplacian", 1
_SPARSE = ("data", "indices", "indptr")


def save(laplacian: LaplaceBeltrami, path: FilePath) -> None:
    """Save an operator to a file, for `load`.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    path : path-like
        Its name ends in .npz: an archive of numpy without pickles, which other programs can read, too. An older file
        stays if saving fails.

    Raises
    ------
    PointCloudError
        Another name, or the file cannot be written.

    See Also
    --------
    load : Loads it.
    build_laplacian : Builds it.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> import tempfile
    >>> laplacian = mf.build_laplacian(points)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mf.save(laplacian, folder + "/sphere.npz")
    ...     again = mf.load(folder + "/sphere.npz")
    >>> print(np.array_equal(again.apply(points), laplacian.apply(points)))
    True
    """
    path = as_path(path)
    if path.suffix.lower() != ".npz":
        raise PointCloudError(f"An operator cannot be saved as {path}. Give it a name that ends in .npz.")
    arrays: dict[str, Array] = {}
    told: dict[str, Any] = {"kind": _KIND, "version": _VERSION, "options": asdict(laplacian.options)}
    for name, value in _parts(laplacian):
        if sparse.issparse(value):
            arrays |= {f"{name}.{part}": getattr(value, part) for part in _SPARSE}
        elif isinstance(value, np.ndarray):
            arrays[name] = value
        else:
            told[name] = value
    arrays["told"] = np.array(json.dumps(told, default=_plain))
    write_arrays(path, arrays)


def load(path: FilePath) -> LaplaceBeltrami:
    """Load an operator that `save` saved.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    LaplaceBeltrami
        The same to the last bit, and so is all that is computed with it.

    Raises
    ------
    PointCloudError
        There is no such file, it is broken, holds no operator, or one of another version.

    See Also
    --------
    save : Saves it, with an example.
    """
    path = as_path(path)
    with reading(path), open(path, "rb") as file, NpzFile(file, allow_pickle=False) as arrays:
        told = json.loads(str(arrays["told"])) if "told" in arrays.files else {}
        if told.get("kind") != _KIND:
            raise InvalidPointsError(f"{path} holds no operator. Give a file that save wrote, or build the operator.")
        if told["version"] != _VERSION:
            raise InvalidPointsError(
                f"{path} holds an operator of version {told['version']}, and this program reads version {_VERSION}."
                " Build and save it again."
            )
        count = len(arrays["points"])

        def part(name: str) -> Any:
            if name in arrays.files:
                return arrays[name]
            if f"{name}.data" not in arrays.files:
                return told[name]
            matrix = sparse.csr_array(tuple(arrays[f"{name}.{one}"] for one in _SPARSE), shape=(count, count))
            matrix.check_format(full_check=True)
            return matrix

        try:
            agreed: dict[str, Any] = {one.name: part(f"agreed.{one.name}") for one in fields(Agreed)}
            agreed["filling"] = None if agreed["filling"] is None else tuple(agreed["filling"])
            given = {
                one.name: part(one.name) for one in fields(LaplaceBeltrami) if one.name not in ("agreed", "options")
            }
        except KeyError as error:
            raise InvalidPointsError(f"{path} lacks {error} of an operator. Build and save it again.") from error
        return LaplaceBeltrami(options=LaplacianOptions(**told["options"]), agreed=Agreed(**agreed), **given)


def _parts(laplacian: LaplaceBeltrami) -> list[tuple[str, Any]]:
    """Return what an operator consists of, with names, what was agreed on part by part."""
    own = [(one.name, getattr(laplacian, one.name)) for one in fields(laplacian)]
    agreed = [(f"agreed.{one.name}", getattr(laplacian.agreed, one.name)) for one in fields(Agreed)]
    return [(name, value) for name, value in own if name not in ("agreed", "options")] + agreed


def _plain(value: Any) -> Any:
    """Return a number of numpy as Python's, for json."""
    return value.item()
