"""Run the benchmarks and write docs/results.md: ``python -m benchmarks.run [name ...]``."""

import platform
import sys
import time
from pathlib import Path

import numpy
import scipy

from . import accuracy, speed, targets

TABLES = {
    "figure3": accuracy.paper_figure_3,
    "spheres": accuracy.default_on_spheres,
    "structure": accuracy.structure,
    "invariance": accuracy.invariance,
    "targets": targets.targets,
    "areas": speed.areas_against_algorithm_1,
    "stages": speed.stages_and_memory,
}


def main(names):
    """Print the named tables, all of them if none is named; all together are written to docs/results.md."""
    texts = [
        "# Results",
        "",
        "Made by `make benchmark`; times are of the machine it ran on, compare only those of one table."
        f" Python {platform.python_version()}, numpy {numpy.__version__}, scipy {scipy.__version__}.",
        "",
    ]
    for name in names or TABLES:
        began = time.perf_counter()
        texts.append(TABLES[name]().markdown())
        print(texts[-1], f"({time.perf_counter() - began:.0f} s)\n", flush=True)
    if not names:
        path = Path(__file__).parents[1] / "docs" / "results.md"
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(texts), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
