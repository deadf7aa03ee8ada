"""Along the positions of a case, where it has any: where methods err, and what their worst case looks like."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.reporting.cases import case_words
from rom.reporting.figure import COLUMN, Figure, drawable, error_panel, legend_below, sheet, tidy
from rom.reporting.results import Results


def error_over_positions(found: Results) -> Figure | None:
    """Largest and median error along the positions of a case, a column a coordinate that changes along them."""
    if "position_error" not in found.data:
        return None
    errors = found.data["position_error"].transpose("entry", "split", "case", "position").values
    stretches = list(_stretches(found))
    figure = sheet(1.8 + 2.7 * len(found.splits), _positions_title(found, errors[:, 0]), COLUMN)
    grid = figure.subplots(len(found.splits), len(stretches), sharex="col", sharey=True, squeeze=False,
                           width_ratios=[3 + len(part) for _, _, part in stretches])
    for s, (row, split) in enumerate(zip(grid, found.splits, strict=True)):
        for axes, (title, x, part) in zip(row, stretches, strict=True):
            for method in found.reduced:
                here = errors[found.headline(method), s]
                here = here[np.isfinite(here).any(axis=1)]
                if not len(here):
                    continue
                colour, marker = found.style(method)
                worst, middle = drawable(np.nanmax(here, axis=0)), drawable(np.nanmedian(here, axis=0))
                axes.plot(x[part], worst[part], color=colour, marker=marker, markersize=4, linewidth=1.1, label=method)
                axes.plot(x[part], middle[part], color=colour, linewidth=0.8, linestyle=":", alpha=0.8)
            error_panel(axes, found.gate)
            axes.set_xlabel(textwrap.fill(title, 30), fontsize=9)
        row[0].set_ylabel(f"relative error, {split} split")
    legend_below(figure, list(grid.ravel()), columns=4)
    return Figure("error-over-positions.png", figure,
                  f"Error along a {found.noun} at the settings that stand for their methods, over the held-out "
                  f"{found.noun}s: the largest with markers, the median dotted.",
                  f"Largest and median error of each method along the positions of a {found.noun}.")


def _scaled(values: xr.DataArray) -> tuple[str, float]:
    """A unit in which values need no exponents along their axis, and the factor to it."""
    largest, unit = float(np.nanmax(abs(values), initial=0.0)), values.attrs.get("units", "1")
    exponent = 3 * int(np.floor(np.log10(largest) / 3)) if largest > 0 else 0
    if -3 <= exponent <= 3:
        return unit, 1.0
    return f"10{str(exponent).translate(words.SUPERSCRIPT)} {unit}", 10.0 ** -exponent


def _stretches(found: Results) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Title, values and changing part of every coordinate along ``position``; of the position itself where none is."""
    named = [(name, one) for name, one in found.data.coords.items()
             if one.dims == ("position",) and name != "position" and one.dtype.kind == "f"]
    for name, one in named:
        moves = np.diff(one.values) != 0
        title, unit = one.attrs.get("long_name", str(name).replace("_", " ")), one.attrs.get("units", "1")
        yield f"{title} [{unit}]", one.values, np.flatnonzero(np.append(moves, False) | np.append(False, moves))
    if not named:
        every = np.arange(found.data.sizes["position"])
        yield "position", every, every


def worst_curves(found: Results) -> Figure | None:
    """What else is known along the positions of each method's worst case, true and answered."""
    names = [str(name).removesuffix("_truth") for name, one in found.data.data_vars.items()
             if str(name).endswith("_truth") and set(one.dims) == {"worst", "position"}]
    rows = found.worst
    if not names or not rows:
        return None
    title, x, part = max(_stretches(found), key=lambda stretch: len(stretch[2]))
    figure = sheet(1.0 + 1.9 * len(rows), f"The worst {found.noun} of each method, the most accurate first", COLUMN)
    grid = figure.subplots(len(rows), len(names), sharex=True, sharey="col", squeeze=False)
    for panels, (row, entry) in zip(grid, rows, strict=True):
        colour, marker = found.style(found.method[entry])
        for axes, name in zip(panels, names, strict=True):
            truth, answer = (found.data[f"{name}_{end}"].transpose("worst", "position") for end in ("truth", "answer"))
            unit, scale = _scaled(truth)
            axes.plot(x[part], scale * truth.values[row][part], color="black", linewidth=1.6, label=found.truth)
            axes.plot(x[part], scale * answer.values[row][part], color=colour, marker=marker, markersize=3.5,
                      linewidth=1.0, label=found.method[entry])
            long = str(truth.attrs.get("long_name", name.replace("_", " "))).split(",")[0]
            axes.set_ylabel(f"{long} [{unit}]", fontsize=8)
            axes.tick_params(labelsize=8)
            tidy(axes)
        panels[0].set_title(textwrap.fill(f"{found.method[entry]}: {case_words(found, entry)}", 80), fontsize=8.5,
                            loc="left")
    for axes in grid[-1]:
        axes.set_xlabel(title, fontsize=9)
    legend_below(figure, list(grid.ravel()), columns=4)
    return Figure("worst-curves.png", figure,
                  f"The {found.noun} in which each method errs most ({found.splits[0]} split); black: the full model.",
                  "Curves of the full-order model and of each metamodel in its worst case.")


def _positions_title(found: Results, errors: np.ndarray) -> str:
    best = _most_accurate(found)
    if best is None or not np.isfinite(errors[best]).any():
        return f"Error along a {found.noun}"
    worst = np.nanmax(np.where(np.isfinite(errors[best]), errors[best], -np.inf), axis=0)
    at = int(worst.argmax())
    return (f"{found.method[best]}, the most accurate, errs most at position {at + 1} of {len(worst)}: "
            f"{words.error(worst[at])}")


def _most_accurate(found: Results) -> int | None:
    errors = found.errors(found.splits[0])
    rows = [i for i in map(found.headline, found.reduced) if np.isfinite(errors[i])]
    return min(rows, key=lambda i: errors[i], default=None)
