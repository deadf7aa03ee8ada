"""Figures of the whole published population: where networks err, and how errors grow with fewer snapshots."""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.reporting import words
from rom.reporting.figure import (
    COLUMN,
    Figure,
    drawable,
    error_axis,
    error_panel,
    legend_below,
    number_axis,
    sheet,
    tidy,
)
from rom.reporting.results import Results

AXES = {"full_scale_frequency": "frequency [Hz]", "full_scale_loss_factor": "loss factor [1]",
        "number_of_forces": "number of forces"}
MILLIMETRES = 1e3


def networks(found: Results) -> list[str]:
    """Methods whose headline has weights that were trained on the whole published set."""
    return [method for method in found.methods if learned_cases(found, method)]


def population(found: Results) -> list[str]:
    """Methods whose headline was judged on the whole population or a sample of it."""
    if "full_scale_max" not in found.data:
        return []
    known = found.data["full_scale_count"].transpose("entry", "split").values[:, 0] > 0
    return [method for method in found.methods if known[found.headline(method)]]


def full_scale_error(found: Results, entry: int, split: str, statistic: str = "max") -> float:
    """Error of an entry over the held-out cases of the whole population; NaN where not judged."""
    if "full_scale_max" not in found.data:
        return float("nan")
    return float(found.data[f"full_scale_{statistic}"].transpose("entry", "split").values[
        entry, found.splits.index(split)])


def full_scale_count(found: Results, entry: int, split: str) -> int:
    """Cases behind :func:`full_scale_error`."""
    return int(found.data["full_scale_count"].transpose("entry", "split").values[entry, found.splits.index(split)])


def by(found: Results, name: str, entry: int, split: str) -> np.ndarray:
    """Largest errors along a dimension of the full-scale study."""
    return found.data[f"by_{name}"].transpose("entry", "split", name).values[entry, found.splits.index(split)]


def error_over_population(found: Results) -> Figure | None:
    """Largest error over all held-out cases by frequency and loss factor, or by the number of forces, and by node."""
    names = [name for name in AXES if f"by_{name}" in found.data]
    methods = population(found)
    if not names or not methods or not networks(found):
        return None
    figure = sheet(6.6, _population_title(found), COLUMN)
    panels = figure.subplots(len(found.splits), len(names) + 1, sharey=True, squeeze=False)
    for row, split in zip(panels, found.splits, strict=True):
        for method in methods:
            i, (colour, marker) = found.headline(method), found.style(method)
            line = {"color": colour, "linewidth": 1.3, "label": method}
            for axes, name in zip(row, names, strict=False):
                x, error = found.data[name].values, drawable(by(found, name, i, split))
                few = {"marker": marker, "markersize": 4} if len(x) < 30 else {}
                if name == "number_of_forces":
                    axes.set_xticks(x)
                axes.plot(x, error, **line, **few)
            ordered = np.sort(drawable(by(found, "pad_node", i, split)))
            known = ordered[np.isfinite(ordered)]
            row[-1].plot(np.arange(1, len(known) + 1), known, **line)
        for axes, label in zip(row, [*(AXES[name] for name in names), "pad nodes, best to worst"], strict=True):
            error_panel(axes, found.gate)
            axes.set_xlabel(label, fontsize=9)
        row[0].set_ylabel(f"largest relative error [1]\n{split} split")
    legend_below(figure, list(panels.ravel()), columns=4)
    return Figure("error-over-population.png", figure,
                 "Largest error over the held-out cases of the whole published population at headline settings. "
                 "Networks answered every one of them, the others a random sample (the table of the networks says how "
                 "many); the solvers of the full model are left out. The truth is a verified ROM where it moves, and "
                 "superposed direct answers where it is static, which is what `superposition` does itself.",
                 "Largest error by frequency, by loss factor or number of forces, and by pad node, for each method.")


def pad_map(found: Results) -> Figure | None:
    """Where on the finger pad networks err most."""
    methods = networks(found)
    if not methods or "pad_x" not in found.data.variables:
        return None
    from matplotlib.colors import LogNorm

    pairs = [(method, split) for split in found.splits for method in methods]
    shape = (len(found.splits), len(methods)) if len(methods) > 1 else (1, len(found.splits))
    figure = sheet(2.4 * shape[0] + 1.1, "Where on the surface the worst cases of each network act", COLUMN)
    panels = figure.subplots(*shape, squeeze=False, sharex=True, sharey=True)
    tables = {(m, s): drawable(by(found, "pad_node", found.headline(m), s)) for m, s in pairs}
    known = np.concatenate([t[np.isfinite(t)] for t in tables.values()])
    if not len(known):
        return None
    norm = LogNorm(known.min(), max(known.max(), 1.01 * known.min()))
    x, y = (MILLIMETRES * found.data[name].values for name in ("pad_x", "pad_y"))
    image: Any = None
    for axes, (method, split) in zip(panels.ravel(), pairs, strict=True):
        error = tables[method, split]
        image = axes.scatter(y, x, c=error, norm=norm, cmap="viridis_r", s=12, linewidths=0,
                             label="pad node, coloured by its largest error")
        if np.isfinite(error).any():
            worst = int(np.nanargmax(error))
            axes.plot(y[worst], x[worst], "o", markersize=7, markerfacecolor="none", markeredgecolor="black",
                      linestyle="none", label="worst node")
        axes.set_title(f"{method}, {split}", fontsize=9)
        axes.set_aspect("equal")
        tidy(axes)
    for axes in panels[-1]:
        axes.set_xlabel("lateral position [mm]")
    for axes in panels[:, 0]:
        axes.set_ylabel("distance from the joint [mm]")
    bar = figure.colorbar(image, ax=panels.ravel().tolist(), aspect=30, pad=0.02)
    bar.set_label("largest relative error [1]", fontsize=9)
    error_axis(bar.ax.yaxis)
    legend_below(figure, list(panels.ravel()), 2)
    return Figure("pad-map.png", figure,
                 "The surface seen from below: the largest error of each network among all held-out cases that "
                 "load a node. In the hard split a tenth of the nodes and whole bands were never in training.",
                 "Map of the pad's nodes coloured by each network's largest error.")


def fewer_snapshots(found: Results) -> Figure | None:
    """Error of every learner against the number of snapshots it learned from."""
    if "fewer_error_max" not in found.data:
        return None
    counts = found.data["snapshots"].values
    figure = sheet(4.6, _fewer_title(found), COLUMN)
    panels = list(figure.subplots(1, 2, sharey=True))
    for axes, statistic in zip(panels, ("max", "median"), strict=True):
        axes.set_xscale("log")
        for method, errors in zip(found.data["learner"].values.astype(str), found.data[
                f"fewer_error_{statistic}"].transpose("learner", "snapshots").values, strict=True):
            colour, marker = found.style(method)
            x, y = counts.astype(float), drawable(errors)
            learned = learned_cases(found, method)
            if learned:
                i = found.headline(method)
                whole = full_scale_error(found, i, found.splits[0], statistic)
                axes.plot([x[-1], learned], [y[-1], whole], color=colour, linewidth=1, linestyle=":")
                axes.plot([learned], [whole], marker=marker, color=colour, markersize=7)
            axes.plot(x, y, color=colour, marker=marker, markersize=5, linewidth=1.3, label=method)
        error_panel(axes, found.gate)
        axes.set_xlabel("training cases")
        axes.set_title({"max": "largest held-out error", "median": "median held-out error"}[statistic], fontsize=10)
        number_axis(axes.xaxis)
        axes.set_xticks([counts[0], counts[-1]])
    panels[0].set_ylabel("relative error [1]")
    legend_below(figure, panels, columns=3)
    return Figure("fewer-snapshots.png", figure,
                 "Every learner at its headline setting on parts of the comparison's own training cases, judged on the "
                 "same held-out cases. Dotted, to the right: the weights that were trained on the whole published set "
                 "and judged on its held-out cases; they lie in half precision in their file, which adds some 0.02 %.",
                 "Error of each learner against the number of training cases.")


def learned_cases(found: Results, method: str) -> int:
    """Cases from which the trained weights of a method's headline learned; 0 where it has none."""
    value = found.per_entry("learned_cases")[found.headline(method)]
    return int(value) if np.isfinite(value) else 0


# ---- titles -------------------------------------------------------------------------------------------------


def _population_title(found: Results) -> str:
    split = found.splits[0]
    errors = {m: full_scale_error(found, found.headline(m), split) for m in networks(found)}
    most = max(full_scale_count(found, found.headline(m), split) for m in errors)
    each = words.listed([f"{m} {words.error(e)}" for m, e in sorted(errors.items(), key=lambda item: item[1])])
    return f"Largest error over all {most:,} held-out cases of the published population: {each}"


def _fewer_title(found: Results) -> str:
    errors = found.data["fewer_error_max"].transpose("learner", "snapshots").values[:, -1]
    names = found.data["learner"].values.astype(str)
    most = int(found.data["snapshots"].values[-1])
    learned = [m for m, e in zip(names, errors, strict=True) if m in found.learners and e > found.gate]
    if not learned:
        return f"{most:,} snapshots are enough for every regression to stay within {words.error(found.gate)}"
    return (f"{most:,} snapshots are too few for {words.listed(learned)} to stay within {words.error(found.gate)}")
