"""Run the benchmarks and write docs/results.md: ``python -m benchmarks.run [name ...]``.

Without names: the evaluation of the paper beside the peers, in 20 minutes. The other tables stay as they are until
they are named, or ``all``.
"""

import platform
import re
import sys
import time
from pathlib import Path

import numpy
import scipy

from . import accuracy, applications, interaction, responsiveness, speed, targets
from .paper import areas, pictures, pointwise, poisson, spectra
from .peers import check
from .tables import Table, rows_of

EVALUATION = {
    "figure1": areas.figure_1,
    "figure2": areas.figure_2,
    "figure3": pointwise.figure_3,
    "figure4": pointwise.figure_4,
    "figure5": pointwise.figure_5,
    "figure6": spectra.figure_6,
    "figure7": spectra.figure_7,
    "figure8": poisson.figure_8,
    "pictures": pictures.pictures,
    "figure14": areas.figure_14,
    "neighbors": spectra.neighbors,
    "figure17": spectra.figure_17,
    "race": spectra.race,
    "peers": check.check,
}
OTHERS = {
    "spheres": accuracy.default_on_spheres,
    "structure": accuracy.structure,
    "invariance": accuracy.invariance,
    "targets": targets.targets,
    "applications": applications.applications,
    "areas": speed.areas_against_algorithm_1,
    "responsiveness": responsiveness.responsiveness,
    "dragged_handle": interaction.dragged_handle,
    "second_runs": interaction.second_runs,
    "window": interaction.window,
    "stages": speed.stages_and_memory,
}
SUMMARY = "Goals"
PAGES = """\
The defaults are made for [real shapes](real_shapes.md): eleven, in eleven samplings, compared with the best packaged
peer. Further pages: [awkward samplings and raw clouds](awkward.md), with the problems that are reported; [the
ablation](ablation.md) of each correction and each constant; [time and memory](scaling.md) of all stages up to a million
points; [the alignment](alignment.md) of two clouds. The default kernels, of 22 points a row on even points and 54 on
random ones, suit real shapes; `bandwidth_factor=1.7` gives 41 and 117, with smaller errors on spheres.
"""
ABOUT = "Goals of the figures and tables below. Peer over ours: the error of the peer divided by that of this project."


def main(names):
    """Print the named tables, those of the evaluation if none is named, and renew them in docs/results.md."""
    path = Path(__file__).parents[1] / "docs" / "results.md"
    every = EVALUATION | OTHERS
    known = {}
    for text in path.read_text(encoding="utf-8").split("\n## ")[1:] if path.exists() else []:
        known[text.partition("\n")[0]] = f"## {text.strip()}\n"
    goals = {row[0]: row for row in rows_of(known.pop(SUMMARY, ""))}
    tables, seconds = {}, {}
    for name in every if names == ["all"] else names or EVALUATION:
        began = time.perf_counter()
        table = every[name]()
        seconds[name] = time.perf_counter() - began
        tables[table.title] = table.markdown()
        figure = table.title.partition(":")[0]
        goals = {key: row for key, row in goals.items() if not key.startswith(f"{figure}:")}
        goals |= {row[0]: row for row in table.goals}
        print(tables[table.title], f"({seconds[name]:.0f} s)\n", flush=True)
    summary = Table(SUMMARY, ["quantity", "target", "measured", "met"], [goals[key] for key in sorted(goals)], ABOUT)
    head = (
        "# Results\n\nMade by `make benchmark`, on two cores in 20 minutes; the tables after the peers'"
        ' by their names, such as `make benchmark ARGUMENTS="targets applications"`. Times depend on the machine:'
        f" compare only those of one table. Python {platform.python_version()}, numpy {numpy.__version__},"
        f" scipy {scipy.__version__}.\n\n{PAGES}"
    )
    # The figures by their numbers, then the other tables as they stood.
    number = {title: re.match(r"Figures? (\d+)", title) for title in [*known, *tables]}
    order = sorted(number, key=lambda title: int(number[title][1]) if number[title] else 100)
    parts = [tables.get(title) or known[title] for title in order]
    path.write_text("\n".join([head, summary.markdown(), *parts]), encoding="utf-8")
    print(summary.markdown(), f"{sum(seconds.values()):.0f} s: {seconds}")


if __name__ == "__main__":
    main(sys.argv[1:])
