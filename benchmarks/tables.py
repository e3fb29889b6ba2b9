"""Rows of figures, written as Markdown."""

from dataclasses import dataclass


@dataclass
class Table:
    """A titled table; every row is a list of texts as long as the header."""

    title: str
    header: list
    rows: list
    note: str = ""

    def markdown(self):
        """Return the table as Markdown text."""
        lines = [f"## {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        lines += ["| " + " | ".join(row) + " |" for row in (self.header, ["---"] * len(self.header), *self.rows)]
        return "\n".join([*lines, ""])
