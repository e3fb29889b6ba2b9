"""Tables of measures as files."""

import csv
import json

from ...core.files import replacing
from ..objects.parts import PartRow

TABLES = (".csv", ".json")


def write_rows(path, rows):
    """Write measures of parts to a file of a kind in `TABLES`, in world lengths; an older file is kept if it fails."""
    records = [row.record() for row in rows]
    with replacing(path) as part, open(part, "w", encoding="utf-8", newline="") as file:
        if path.suffix.lower() == ".json":
            json.dump(records, file, indent=1)
            return
        table = csv.DictWriter(file, PartRow._fields, lineterminator="\n")
        table.writeheader()
        table.writerows(records)
