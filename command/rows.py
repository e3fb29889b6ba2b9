"""Tables of measures as files."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

from . import core

if TYPE_CHECKING:
    from pathlib import Path

TABLES = (".csv", ".json")


def write_rows(path: Path, records: Any) -> None:
    """Write records of numbers by name, all of the same names, to a file of a kind in `TABLES`.

    An older file is kept if it fails.
    """
    with core.files.replacing(path) as part, open(part, "w", encoding="utf-8", newline="") as file:
        if path.suffix.lower() == ".json":
            json.dump(records, file, indent=1)
            return
        table = csv.DictWriter(file, records[0].keys(), lineterminator="\n")
        table.writeheader()
        table.writerows(records)


def write_text(path: Path, text: str) -> None:
    """Write a file of text; an older one is kept if it fails."""
    with core.files.replacing(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
