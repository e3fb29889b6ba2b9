"""Errors that name what they are about."""

from contextlib import contextmanager

from . import core


@contextmanager
def naming(name):
    """Add the name of an object or a file to errors."""
    try:
        yield
    except core.PointCloudError as error:
        if f'"{name}"' in str(error):
            raise
        raise core.PointCloudError(f'"{name}": {error}') from error
