"""Where metamodels of the contact scene err: along the path, in what the contact tells, by arrangement of fibres."""

from __future__ import annotations

import numpy as np

from rom.reporting import palette, words
from rom.reporting.error_over_inputs import shown_methods
from rom.reporting.figure import Figure, drawable, error_axis, gate_line, legend_below, sheet, tidy
from rom.reporting.results import Results


def error_along_path(found: Results) -> Figure | None:
    """Displacement error over load share and travel; None for scenes without contact."""
    if not found.contact or "position_error" not in found.data:
        return None
    errors = found.data["position_error"].transpose("entry", "split", "case", "position").values
    travel = found.data["travel"].values.astype(float) * 1e3
    pressing = travel == 0
    share = found.data["force_share"].values.astype(float)
    figure = sheet(7.6, _path_title(found, errors[:, 0], travel))
    grid = figure.subplots(len(found.splits), 2, sharey=True, squeeze=False, gridspec_kw={"width_ratios": (1, 2.4)})
    for (left, right), (s, split) in zip(grid, enumerate(found.splits), strict=True):
        for method in shown_methods(found):
            colour, marker = palette.style(method)
            here = errors[found.headline(method), s]
            here = here[np.isfinite(here).any(axis=1)]
            if not len(here):
                continue
            worst, middle = drawable(np.nanmax(here, axis=0)), drawable(np.nanmedian(here, axis=0))
            for axes, part, x in ((left, pressing, share), (right, ~pressing, travel)):
                axes.plot(x[part], worst[part], color=colour, marker=marker, markersize=4.5, linewidth=1.2,
                          label=method)
                axes.plot(x[part], middle[part], color=colour, linewidth=0.8, linestyle=":", alpha=0.8)
        for axes in (left, right):
            axes.set_yscale("log")
            gate_line(axes, found.gate)
            error_axis(axes.yaxis)
            tidy(axes)
        right.set_title(f"{split} split: largest error (line with markers) and median (dotted)", fontsize=10,
                        loc="left")
        left.set_ylabel("relative error [1]")
    grid[-1][0].set_xlabel("pressing: share of the normal force [1]")
    grid[-1][1].set_xlabel("sliding: travel of the plate [mm]")
    legend_below(figure, list(grid.ravel()))
    return Figure("error-along-path.png", figure,
                 "Displacement error along the path, over the held-out paths, at each method's headline setting: first "
                 "while the plate is pressed on, then while it is moved along.",
                 "Largest and median displacement error of each method over load share and over travel.")


def contact_quantities(found: Results) -> Figure | None:
    """Errors of what one measures at the contact, apart from displacements."""
    if not found.contact:
        return None
    largest = found.data["contact_error_max"].transpose("entry", "split", "quantity").values
    middle = found.data["contact_error_median"].transpose("entry", "split", "quantity").values
    names = [str(name) for name in found.data["quantity"].values]
    figure = sheet(5.8, _quantity_title(found, largest[:, 0], names))
    panels = list(figure.subplots(1, len(found.splits), sharey=True, squeeze=False)[0])
    methods = shown_methods(found)
    for s, (axes, split) in enumerate(zip(panels, found.splits, strict=True)):
        axes.set_yscale("log")
        for k, method in enumerate(methods):
            i = found.headline(method)
            at = np.arange(len(names)) + 0.7 * ((k + 0.5) / len(methods) - 0.5)
            top, typical = drawable(largest[i, s]), drawable(middle[i, s])
            colour, marker = palette.style(method)
            axes.vlines(at, typical, top, color=colour, linewidth=1.4)
            axes.plot(at, top, linestyle="none", marker=marker, color=colour, markersize=7, label=method)
            axes.plot(at, typical, linestyle="none", marker="_", color=colour, markersize=7)
        gate_line(axes, found.gate)
        axes.set_xticks(np.arange(len(names)), [name.replace(" ", "\n") for name in names])
        axes.set_title(f"{split} split", fontsize=11)
        error_axis(axes.yaxis)
        tidy(axes, "y")
    panels[0].set_ylabel("relative error [1]: marker largest, dash median")
    legend_below(figure, panels)
    meaning = found.record("quantity_definitions") or {}
    return Figure("contact-quantities.png", figure,
                 "Contact quantities at each method's headline setting, over all positions of the held-out paths. "
                 + " ".join(f"{name.capitalize()}: {text}." for name, text in meaning.items()),
                 "Largest and median error of tangential force, contact area, pressure profile and approach by method.")


def error_by_variant(found: Results) -> Figure | None:
    """Displacement and force errors by arrangement of the fibres, published split."""
    if not found.contact or "variant" not in found.data.variables:
        return None
    variant = found.data["variant"].values.astype(str)
    names = list(dict.fromkeys(variant))
    quantity = [str(name) for name in found.data["quantity"].values]
    force = found.data["contact_case_error"].transpose("entry", "split", "case", "quantity").values[
        :, 0, :, quantity.index("tangential force")]
    shown = shown_methods(found)
    tables = [("displacement", np.stack([found.case_errors(found.headline(m), found.splits[0]) for m in shown])),
              ("tangential force", np.stack([force[found.headline(m)] for m in shown]))]
    figure = sheet(4.6, _variant_title(found, shown, tables[0][1], variant, names))
    panels = list(figure.subplots(1, 2, sharey=True))
    for axes, (what, errors) in zip(panels, tables, strict=True):
        axes.set_yscale("log")
        for k, method in enumerate(shown):
            colour, marker = palette.style(method)
            groups = [errors[k, (variant == name) & np.isfinite(errors[k])] for name in names]
            at = np.arange(len(names)) + 0.7 * ((k + 0.5) / len(shown) - 0.5)
            top, typical = (drawable(np.array([f(g) if len(g) else np.nan for g in groups]))
                            for f in (np.max, np.median))
            axes.vlines(at, typical, top, color=colour, linewidth=1.4)
            axes.plot(at, top, linestyle="none", marker=marker, color=colour, markersize=7, label=method)
            axes.plot(at, typical, linestyle="none", marker="_", color=colour, markersize=7)
        gate_line(axes, found.gate)
        axes.set_xticks(range(len(names)), names)
        axes.set_title(what, fontsize=11)
        error_axis(axes.yaxis)
        tidy(axes, "y")
    panels[0].set_ylabel("relative error [1]: marker largest, dash median")
    legend_below(figure, panels)
    return Figure("error-by-fibres.png", figure,
                 f"Error of held-out paths ({found.splits[0]} split) by arrangement of the collagen fibres.",
                 "Largest and median error of displacement and of tangential force for each fibre arrangement.")


def _path_title(found: Results, errors: np.ndarray, travel: np.ndarray) -> str:
    best = _best(found)
    if best is None:
        return "Displacement error along the path"
    here = errors[best]
    worst = np.nanmax(here[np.isfinite(here).any(axis=1)], axis=0)
    at = int(np.nanargmax(worst))
    where = f"after {travel[at]:.3g} mm of sliding" if travel[at] > 0 else "while pressing"
    return f"{found.name(best)}, the most accurate reduced method, errs most {where}: {words.error(worst[at])}"


def _quantity_title(found: Results, largest: np.ndarray, names: list[str]) -> str:
    best = _best(found)
    if best is None:
        return "Errors of contact quantities"
    parts = [f"{name} {words.error(value)}" for name, value in zip(names, largest[best], strict=True)]
    return f"What the contact tells, at most, by {found.method[best]}: {words.listed(parts)}"


def _variant_title(found: Results, shown: list[str], errors: np.ndarray, variant: np.ndarray, names: list[str]) -> str:
    best = _best(found)
    if best is None or found.method[best] not in shown:
        return "Error by arrangement of the fibres"
    row = errors[shown.index(found.method[best])]
    worst = {name: np.nanmax(row[variant == name]) for name in names if np.isfinite(row[variant == name]).any()}
    hard = max(worst, key=lambda name: worst[name])
    return f"Paths with {hard} fibres are the hardest for {found.method[best]}: {words.error(worst[hard])} at most"


def _best(found: Results) -> int | None:
    errors = found.errors(found.splits[0])
    rows = [found.headline(m) for m in shown_methods(found) if np.isfinite(errors[found.headline(m)])]
    return min(rows, key=lambda i: errors[i]) if rows else None
