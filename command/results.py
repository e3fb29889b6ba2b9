"""What verbs tell."""

from __future__ import annotations


def number_text(value: float, power: int = 1) -> str:
    """Write a length, or with another power an area or a volume, of a file, whose unit is not known."""
    return f"{value:.4g}"
