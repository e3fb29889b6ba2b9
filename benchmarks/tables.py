"""Rows of figures, written as Markdown."""

from dataclasses import dataclass, field


@dataclass
class Table:
    """A titled table; every row is a list of texts as long as the header.

    Attributes
    ----------
    plots : list of str
        Pictures of the same figures, as files beside the document.
    goals : list of list of str
        Rows of quantity, target, what was measured, and whether it was met, for the summary of the document.
    """

    title: str
    header: list
    rows: list
    note: str = ""
    plots: list = field(default_factory=list)
    goals: list = field(default_factory=list)

    def markdown(self):
        """Return the table as Markdown text."""
        lines = [f"## {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        for plot in self.plots:
            lines += [f"![{self.title}]({plot})", ""]
        lines += ["| " + " | ".join(row) + " |" for row in (self.header, ["---"] * len(self.header), *self.rows)]
        return "\n".join([*lines, ""])


def rows_of(text):
    """Return the rows of the first table in Markdown text, as lists of texts."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def goal(quantity, target, measured, met):
    """Return a row of the summary."""
    return [quantity, target, measured, "yes" if met else "no"]


def gather(groups, names=(), report=lambda row: None):
    """Measure groups of rows, by their names; all of them if none is named; each row is reported as it comes."""
    unknown = sorted(set(names) - groups.keys())
    if unknown:
        raise ValueError(f"No groups {unknown}. Choose from {', '.join(groups)}.")
    rows = []
    for name in names or groups:
        for row in groups[name]():
            report(row)
            rows.append(row)
    return rows


def print_rows(header, groups, names):
    """Print the rows of groups as a table, each as it comes."""
    show = lambda row: print("| " + " | ".join(row) + " |", flush=True)  # noqa: E731
    show(header)
    show(["---"] * len(header))
    gather(groups, names, show)
