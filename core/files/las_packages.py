"""laspy and lazrs, which are imported only as files of LAS or LAZ are read or written."""

from typing import Any

from ..errors import PointCloudError


def import_las() -> tuple[Any, Any]:
    """Return laspy and lazrs.

    Raises
    ------
    PointCloudError
        One of them is missing.
    """
    try:
        import laspy
        import lazrs
    except ImportError as error:
        raise PointCloudError(
            f"LAS and LAZ files need laspy and lazrs, and {error.name} is missing. Install both, or take another"
            " format, such as PLY."
        ) from error
    return laspy, lazrs
