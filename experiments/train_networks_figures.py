"""Figures, findings and the table of `train_networks`."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from rom.reporting import html, palette, words
from rom.reporting.figure import Figure, drawable, error_axis, legend_below, number_axis, sheet, tidy


def findings(results: xr.Dataset) -> list[str]:
    """Errors at the most cases, what fewer cases cost, and what the data cost."""
    names = results["method"].values.astype(str)
    last = results["error_max"].values[:, -1]
    most = words.listed([f"{m} {words.error(e)}" for m, e in zip(names, last, strict=True)])
    fewer = [f"{m} {words.error(e[0])} from {int(n[0]):,} and {words.error(e[-1])} from {int(n[-1]):,}"
             for m, e, n in zip(names, results["error_max"].values, results["cases"].values, strict=True)]
    seconds = words.listed([f"{m} {words.seconds(t)}" for m, t in zip(names, results["seconds"].values[:, -1],
                                                                    strict=True)])
    return [
        f"From all cases the largest held-out errors are: {most} (learning curves: {_sizes(results)}).",
        f"How errors fall with the number of cases: {'; '.join(fewer)}.",
        f"Training on one thread takes: {seconds}.",
        f"The whole grid of {int(results.attrs['n_cases']):,} harmonic cases takes "
        f"{words.seconds(float(results['grid_seconds']))} to make and check and "
        f"{words.size(float(results['grid_bytes']))} to store; its largest residual is "
        f"{words.error(float(results['grid_residual']))}, and {int(results.attrs['n_confirmed'])} direct solves differ "
        f"by at most {words.error(float(results['grid_confirmed']))}. One case is read back in "
        f"{words.seconds(float(np.median(results['grid_read_seconds'])))} (median of "
        f"{results.sizes['read']} random ones)."]


def tables(results: xr.Dataset) -> list[str]:
    """One row a network and number of cases."""
    head = [html.named("method"), "training cases", html.named("largest error", "all held-out cases"),
            "median error", "training"]
    rows = []
    for i, method in enumerate(results["method"].values.astype(str)):
        for k in range(results.sizes["count"]):
            rows.append(("", [html.named(method, colour=palette.style(method).colour),
                              html.cell(f"{int(results['cases'].values[i, k]):,}"),
                              html.cell(words.error(results["error_max"].values[i, k])),
                              html.cell(words.error(results["error_median"].values[i, k])),
                              html.cell(words.seconds(results["seconds"].values[i, k]))]))
    return [html.table("Learning curves: every held-out case was judged.", head, rows)]


def _sizes(results: xr.Dataset) -> str:
    """Size of each network, with the settings that shorten its training."""
    sizes, settings = (json.loads(results.attrs[name]) for name in ("sizes", "settings"))
    return ", ".join(" ".join([method, size, *(f"{k}={v}" for k, v in settings.get(method, {}).items())])
                     for method, size in sizes.items())


def draw(results: xr.Dataset) -> list[Figure]:
    """Error over training cases, and over training time."""
    names = results["method"].values.astype(str)
    error = results["error_max"].values
    gain = words.listed([f"{m} {words.ratio(e[0] / e[-1])}" for m, e in zip(names, error, strict=True)])
    figure = sheet(4.8, f"More cases lower the largest error, from the fewest to the most by: {gain}")
    left, right = figure.subplots(1, 2)
    for i, method in enumerate(names):
        colour, marker = palette.style(method)
        cases = results["cases"].values[i]
        left.plot(cases, drawable(error[i]), color=colour, marker=marker, label=method)
        left.plot(cases, drawable(results["error_median"].values[i]), color=colour, linestyle=":", linewidth=1)
        seconds, validation = results["look_seconds"].values[i], results["look_validation"].values[i]
        known = np.isfinite(seconds)
        right.plot(np.maximum(seconds[known], 0.05), drawable(validation[known]), color=colour, label=method)
    left.set_xlabel("training cases")
    left.set_ylabel("relative error [1]: line largest, dotted median")
    left.set_title("on every held-out case", fontsize=10)
    right.set_xlabel("training time [s], one thread")
    right.set_ylabel("validation error [1], root mean square")
    right.set_title("while training from the most cases", fontsize=10)
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_yscale("log")
        error_axis(axes.yaxis)
        number_axis(axes.xaxis)
        tidy(axes)
    legend_below(figure, [left, right])
    return [Figure("learning-curves.png", figure,
                   "Left: error against the number of training cases, judged on every held-out case. Right: validation "
                   "error while training; harmonic networks are validated on random combinations of their outputs, "
                   "with the output layer at its optimum. Sizes, and steps where they are fewer than the committed "
                   f"weights took: {_sizes(results)}.",
                   "Learning curves of four networks: error against cases and against training time.")]
