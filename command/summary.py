"""The verb that merges reports to one table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import core
from .records import SUFFIX, last_records, read_plans, read_reports, shares_not_begun
from .rows import TABLES, write_rows
from .verb import Verb

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

_COLUMNS = ("path", "verb", "points", "total_area", "elapsed", "output", "notices", "error")


class Report(Verb):
    """The verb `report`."""

    name = "report"
    help = "merge the reports of a folder to one table, with totals and errors"
    description = (
        f"Merge the reports of a folder (files ending in {SUFFIX}, of --report) to one table: a row for each file with"
        " points, area, seconds, notices and error. Writes one JSON line with totals and errors, and"
        " counts files that were to be processed and were not reached."
    )
    inputs = "folders with reports"
    outputs = TABLES
    prints_all = True

    def expand(self, path: Path, arguments: Namespace) -> list[Path]:
        return [path]

    def run(self, path: Path, arguments: Namespace, output: Path | None) -> dict[str, Any]:
        if not path.is_dir():
            raise core.PointCloudError(f"There is no folder {path}. Name the one with the reports.")
        found, broken = read_reports(path)
        plans = read_plans(path)
        records, waiting = last_records(found, plans), shares_not_begun(plans)
        if not records:
            raise core.PointCloudError(f"{path} has no reports. They are written by --report, and end in {SUFFIX}.")
        rows = [_row(record) for record in records]
        errors = [{"path": row["path"], "error": row["error"]} for row in rows if row["error"]]
        errors += [{"path": None, "error": f"{name}, was not begun: {count} files"} for name, count in waiting.items()]
        unseen = sum(waiting.values())
        totals = {
            "files": len(rows) + unseen,
            "failed": sum(row["error"] is not None for row in rows) + unseen,
            "unreached": sum(record.get("unreached", False) for record in records) + unseen,
            "points": sum(row["points"] or 0 for row in rows),
            "total_area": sum(row["total_area"] or 0.0 for row in rows),
            "elapsed": round(sum(row["elapsed"] for row in rows), 3),
        }
        if output is not None and output.suffix.lower() == ".csv":
            write_rows(output, [*rows, {**dict.fromkeys(_COLUMNS), **_total_row(totals)}])
        elif output is not None:
            write_rows(output, {"totals": totals, "errors": errors, "files": records})
        lost = f"{broken} lines are no records: their writers were stopped, or another program wrote them."
        return {**totals, "errors": errors, "notices": [lost] if broken else []}


def _row(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record as a row of the table: areas also of parts, and notices as one text."""
    area = record.get("total_area")
    parts = [part["area"] for part in record.get("parts", []) if part["name"].startswith("Component")]
    row = {name: record.get(name) for name in _COLUMNS}
    row["total_area"] = sum(parts) if area is None and parts else area
    row["notices"] = " ".join(record.get("notices", []))
    return row


def _total_row(totals: dict[str, Any]) -> dict[str, Any]:
    """Return the last row of the table, whose path counts the files."""
    return {
        "path": f"{totals['files']} files, {totals['failed']} failed",
        **{name: totals[name] for name in ("points", "total_area", "elapsed")},
    }
