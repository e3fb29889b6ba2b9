"""Run the benchmarks and write docs/results.md: ``python -m benchmarks.run [name ...]``."""

import platform
import sys
import time
from pathlib import Path

import numpy
import scipy

from . import accuracy, applications, interaction, responsiveness, speed, targets
from .peers import check

TABLES = {
    "figure3": accuracy.paper_figure_3,
    "spheres": accuracy.default_on_spheres,
    "structure": accuracy.structure,
    "invariance": accuracy.invariance,
    "peers": check.check,
    "targets": targets.targets,
    "applications": applications.applications,
    "areas": speed.areas_against_algorithm_1,
    "responsiveness": responsiveness.responsiveness,
    "dragged_handle": interaction.dragged_handle,
    "second_runs": interaction.second_runs,
    "window": interaction.window,
    "stages": speed.stages_and_memory,
}


def main(names):
    """Print the named tables, all of them if none is named, and renew them in docs/results.md."""
    path = Path(__file__).parents[1] / "docs" / "results.md"
    known = path.read_text(encoding="utf-8").split("\n## ")[1:] if names and path.exists() else []
    tables = {text.partition("\n")[0]: f"## {text.strip()}\n" for text in known}
    for name in names or TABLES:
        began = time.perf_counter()
        table = TABLES[name]()
        tables[table.title] = table.markdown()
        print(tables[table.title], f"({time.perf_counter() - began:.0f} s)\n", flush=True)
    head = (
        "# Results\n\nMade by `make benchmark`; times are of the machine it ran on, compare only those of one table."
        f" Python {platform.python_version()}, numpy {numpy.__version__}, scipy {scipy.__version__}.\n"
    )
    path.write_text("\n".join([head, *tables.values()]), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
