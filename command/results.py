"""What verbs write and tell."""

from typing import NamedTuple


class Told(NamedTuple):
    """A result at the points as it is written, with notices, and a line on it."""

    values: object
    notices: list
    line: str


def number_text(value, power=1) -> str:
    """Write a length, or with another power an area or a volume, of a file, whose unit is not known."""
    return f"{value:.4g}"
