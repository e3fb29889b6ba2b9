"""Plots of the evaluation, one color per method everywhere."""

from pathlib import Path

import matplotlib
import numpy as np

from ..peers import METHODS

matplotlib.use("Agg")

from matplotlib import pyplot

DOCUMENTS = Path(__file__).parents[2] / "docs"
FOLDER = "pictures/results"
_COLORS = dict(zip(METHODS, matplotlib.colormaps["tab10"].colors, strict=False))
_SIZE = 3.4  # inches of a panel
_LEGEND = 8.5  # inches of the widest legend


def convergence(name, panels, label="points"):
    """Draw errors on a logarithmic axis against the number of points, as the paper does.

    Parameters
    ----------
    name : str
        Of the file.
    panels : dict of str to dict of str to (list, list)
        Title of a panel, method, then numbers of points and errors.

    Returns
    -------
    str
        The file, relative to the documents.
    """
    figure, axes = _panels(len(panels))
    for axis, (title, curves) in zip(axes, panels.items(), strict=False):
        for method, (counts, errors) in curves.items():
            axis.semilogy(counts, errors, **_style(method))
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(label, fontsize=8)
    return _save(figure, axes, name)


def bars(name, panels):
    """Draw errors as bars on a logarithmic axis: title of a panel, group, then method and error."""
    figure, axes = _panels(len(panels))
    for axis, (title, groups) in zip(axes, panels.items(), strict=False):
        methods = list(dict.fromkeys(method for group in groups.values() for method in group))
        methods.sort(key=lambda method: not method.startswith("ours"))  # side by side
        width = 0.85 / len(methods)
        for k, method in enumerate(methods):
            heights = [group.get(method, np.nan) for group in groups.values()]
            places = np.arange(len(groups)) + (k - 0.5 * (len(methods) - 1)) * width
            style = _style(method)
            faint = 0.5 if style["linestyle"] == "--" else 1.0
            axis.bar(places, heights, width, color=style["color"], label=style["label"], alpha=faint)
        axis.set_yscale("log")
        axis.set_xticks(range(len(groups)), groups, fontsize=7)
        axis.set_title(title, fontsize=9)
    return _save(figure, axes, name)


def histograms(name, panels, label):
    """Draw the distribution of values; those that are not positive in another color."""
    figure, axes = _panels(len(panels))
    for axis, (title, values) in zip(axes, panels.items(), strict=False):
        low, high = np.percentile(values, (0.2, 99.8))
        edges = np.linspace(low, high, 81)
        parts = [values[values > 0.0], values[values <= 0.0]]
        axis.hist(parts, bins=edges, stacked=True, color=["tab:blue", "tab:red"])
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(label, fontsize=8)
    return _save(figure, axes, name, legend=False)


def steps(name, values, exact, label):
    """Draw a value per step beside the exact one."""
    figure, axes = _panels(1)
    axes[0].plot(values, "o-", label="this project")
    axes[0].axhline(exact, color="tab:red", label="exact")
    axes[0].set_xlabel("step", fontsize=8)
    axes[0].set_ylabel(label, fontsize=8)
    return _save(figure, axes, name)


def _panels(count):
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, axes = pyplot.subplots(
        rows, columns, figsize=(max(_SIZE * columns + 0.6, _LEGEND), 0.9 * _SIZE * rows), squeeze=False
    )
    for axis in axes.ravel()[count:]:
        axis.axis("off")
    return figure, axes.ravel()


def _style(method):
    known, _, rest = method.partition(", ")
    if known not in METHODS:
        return {"color": "gray", "label": method, "marker": ".", "linestyle": "-"}
    label = METHODS[known].label + (f", {rest}" if rest else "")
    thick = 2.0 if known.startswith("ours") else 1.0
    return {
        "color": _COLORS[known],
        "label": label,
        "marker": ".",
        "linewidth": thick,
        "linestyle": "--" if rest else "-",
    }


def _save(figure, axes, name, legend=True):
    for axis in axes:
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
    if legend:
        entries = {text: mark for axis in axes for mark, text in zip(*axis.get_legend_handles_labels(), strict=True)}
        figure.legend(entries.values(), entries, loc="lower center", ncols=3, fontsize=7, frameon=False)
        lines = -(-len(entries) // 3)
        figure.tight_layout(rect=(0.0, 0.18 * lines / figure.get_figheight() + 0.01, 1.0, 1.0))
    else:
        figure.tight_layout()
    (DOCUMENTS / FOLDER).mkdir(parents=True, exist_ok=True)
    path = f"{FOLDER}/{name}.png"
    figure.savefig(DOCUMENTS / path, dpi=100, metadata={"Software": None})
    pyplot.close(figure)
    return path
