"""The stability atlas as sentences, tables and heat maps, from its results alone."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from rom.reporting import html, words
from rom.reporting.figure import Figure, sheet
from rom.reporting.html import Cell

OUTCOMES = ("right", "warned", "refused", "silent", "crashed")
LETTERS = {"right": "", "warned": "W", "refused": "R", "silent": "S", "crashed": "X"}
# after Okabe and Ito: apart in lightness too
COLOURS = {"right": "#DCEBF7", "warned": "#F0E442", "refused": "#8C9BA5", "silent": "#D55E00", "crashed": "#000000",
           "": "#FFFFFF"}
FAMILIES = {
    "tissues": ("incompressibility", "nail", "soft hypodermis", "slivers"),
    "excitation": ("loss factor", "frequency", "resonance distance", "mode clusters"),
    "loads": ("load placement", "opposed forces", "force size"),
    "numerics": ("mesh density", "single precision", "POD snapshots", "rank", "networks outside their range",
                 "threads")}
LISTED = 15
"""Worst cases told one by one."""
DECADES = (-16.0, 2.0)
"""Errors between which the colours run."""
FACTOR = 3.0
"""An estimate is good that lies within this factor of the true error."""


def counts(results: xr.Dataset) -> dict[str, int]:
    """How often each outcome occurred."""
    return {name: int((results["outcome"] == name).sum()) for name in OUTCOMES}


def worst_first(results: xr.Dataset, *outcomes: str) -> list[tuple[int, int]]:
    """(case, method) positions of these outcomes: in their order, the largest error first, unknown ones before all."""
    found: list[tuple[int, int]] = []
    error = results["error"].values
    for name in outcomes:
        rows = np.argwhere(results["outcome"].values == name)
        size = [error[i, j] if math.isfinite(error[i, j]) else math.inf for i, j in rows]
        found += [tuple(rows[k].tolist()) for k in np.argsort(-np.array(size), kind="stable")]
    return found


def told(results: xr.Dataset, case: int, method: int) -> str:
    """One outcome in plain words."""
    one = results.isel(case=case, method=method)
    error = float(one["error"])
    outcome, where = str(one["outcome"].item()), f"`{one['method'].item()}`, {one['words'].item()}"
    if outcome == "crashed":
        return f"{where}: crashed with {str(one['message'].item())[:160]}."
    off = f"{words.error(error)} off" if math.isfinite(error) else "an answer where none can be known"
    return f"{where}: {off}" + (" and said nothing." if outcome == "silent" else f"; {one['message'].item()}"[:240])


def findings(results: xr.Dataset) -> list[str]:
    """The verdict, the worst cases, what bounds and estimates are worth, false alarms."""
    number = counts(results)
    total = sum(number.values())
    sentences = [
        f"Of {total:,} answers at {results.sizes['case']} extremes, {number['silent']} were silently wrong and "
        f"{number['crashed']} crashed; {number['right']} were right, {number['warned']} came with a warning, "
        f"{number['refused']} were refused in a sentence."]
    bad = worst_first(results, "silent", "crashed")
    sentences += [told(results, *at) for at in bad[:LISTED]]
    if len(bad) > LISTED:
        sentences.append(f"And {len(bad) - LISTED} more silent or crashed, in the table of defects below.")
    return [*sentences, *_bounds(results), *_alarms(results), *_conditions(results)]


def _bounds(results: xr.Dataset) -> list[str]:
    # where single answers cancel, the stated error is relative to the small rest and the true one is not
    plain = np.broadcast_to((results["cancels"].values == 0)[:, None], results["outcome"].shape)
    error, named, kind = (results[name].values for name in ("error", "assessed", "assessed_kind"))
    claimed = (kind == "bound") & np.isfinite(named)
    sentences = []
    if claimed.any():
        holds = int((results["bound_holds"].values[claimed] == 1).sum())
        sharp = claimed & plain & (np.nan_to_num(error, posinf=0.0) > 1e-9)
        ratio = f"; where the error exceeds 1e-9 their median effectivity is " \
                f"{np.median(named[sharp] / error[sharp]):.2f}" if sharp.any() else ""
        sentences.append(f"Of {int(claimed.sum())} finite error bounds that methods claimed, {holds} hold{ratio}.")
    # an estimate speaks of solving the equations; what a fully integrated element misses is another error
    solving = ~np.char.startswith(results["level"].values.astype(str), "full")[:, None]
    guessed = (kind == "estimate") & np.isfinite(named) & np.isfinite(error) & plain & solving & (error > 1e-9)
    if guessed.any():
        ratio = named[guessed] / error[guessed]
        good = np.mean((ratio >= 1 / FACTOR) & (ratio <= FACTOR))
        sentences.append(f"Of {int(guessed.sum())} estimates of errors in solving, {good:.0%} lie within a factor "
                         f"{FACTOR:g} of the true error, {np.mean(ratio < 1 / FACTOR):.0%} below that.")
    return sentences


def _alarms(results: xr.Dataset) -> list[str]:
    outcome = results["outcome"].values
    warned = outcome == "warned"
    false = warned & (results["error"].values <= results["tolerance"].values)
    own = (outcome == "right") & (results["error"].values > results["tolerance"].values)
    sentences = []
    if warned.any():
        method = int(false.sum(axis=0).argmax())
        sentences.append(
            f"{int(false.sum())} of the {int(warned.sum())} warnings were false alarms (the answer was within its "
            f"tolerance all the same), most of them by `{results['method'].values[method]}` "
            f"({int(false[:, method].sum())}).")
    if own.any():
        sentences.append(f"{int(own.sum())} of the right answers exceed their method's tolerance, but name an error "
                         "that covers it.")
    return sentences


def _conditions(results: xr.Dataset) -> list[str]:
    condition = results["condition_estimate"].values
    by_matrix = [name for name in ("direct", "direct-reused") if name in results["method"].values]
    if not by_matrix:
        return []
    right = (results["outcome"].sel({"method": by_matrix}).values == "right").any(axis=1) & np.isfinite(condition)
    if not right.any():
        return []
    k = int(np.argmax(np.where(right, condition, -1)))
    return [f"Direct solves are right up to a condition number of {words.power(condition[k])} "
            f"({results['words'].values[k]})."]


# ---- tables -----------------------------------------------------------------------------------------------------

def tables(results: xr.Dataset) -> list[str]:
    """Every method's record; every defect; what was refused and why."""
    return [_methods(results), *_defects(results), _axes(results)]


def _methods(results: xr.Dataset) -> str:
    rows = []
    for k, name in enumerate(results["method"].values):
        one = results.isel(method=k)
        asked = one["outcome"].values != ""
        if not asked.any():
            continue
        tolerance = sorted({float(t) for t in one["tolerance"].values[asked] if math.isfinite(t)})
        right = one["outcome"].values == "right"
        error = one["error"].values
        cells = [html.named(f"`{name}`"),
                 html.cell(" or ".join(words.error(t) for t in tolerance)),
                 *(html.cell(int((one["outcome"].values == kind).sum()),
                             kind="fail" if kind in ("silent", "crashed") and (one["outcome"] == kind).any() else "")
                   for kind in OUTCOMES),
                 html.cell(words.error(float(error[right].max())) if right.any() else words.NONE),
                 html.cell(words.seconds(float(np.nanmedian(one["seconds"].values)))
                           if np.isfinite(one["seconds"].values).any() else words.NONE),
                 html.cell(_first_doubt(one), kind="text")]
        rows.append(("", cells))
    return html.table(
        "Every method over all extremes. An answer is right within the tolerance (1e-6 for methods that claim to be "
        "exact, the scene's gate for the others; relative error in the energy norm) or within the error that the "
        "method itself names (an estimate may be a factor 3 too small).",
        ["method", "tolerance", *OUTCOMES, "largest error among right", "time of an answer",
         "what it warns of most"], rows)


def _first_doubt(one: xr.Dataset) -> str:
    """The commonest reason among a method's warnings."""
    texts = [str(text).split(";")[0] for text, outcome in zip(one["message"].values, one["outcome"].values,
                                                              strict=True) if outcome == "warned"]
    return max(set(texts), key=lambda text: (texts.count(text), text))[:120] if texts else words.NONE


def _defects(results: xr.Dataset) -> list[str]:
    rows = [("", _row(results, i, j)) for i, j in worst_first(results, "silent", "crashed")]
    return [html.table("Every defect, worst first.", ["method", "axis", "extreme", "outcome", "error", "named error",
                                                      "residual", "condition", "message"], rows)] if rows else []


def _row(results: xr.Dataset, i: int, j: int) -> list[Cell]:
    one = results.isel(case=i, method=j)
    return [html.named(f"`{one['method'].item()}`"), html.cell(one["axis"].item(), kind="text"),
            html.cell(one["level"].item(), kind="text"), html.cell(one["outcome"].item()),
            html.cell(words.error(float(one["error"]))),
            html.cell(words.error(float(one["bound"])), str(one["kind"].item())),
            html.cell(words.error(float(one["residual"]))), html.cell(_size(float(one["condition_estimate"]))),
            html.cell(one["message"].item(), kind="text")]


def _axes(results: xr.Dataset) -> str:
    rows = []
    for axis in dict.fromkeys(results["axis"].values):
        one = results.isel(case=results["axis"].values == axis)
        condition = one["condition_estimate"].values
        finite = condition[np.isfinite(condition)]
        rows.append(("", [html.named(str(axis)), html.cell(one.sizes["case"]),
                          *(html.cell(count) for count in counts(one).values()),
                          html.cell(_size(finite.max()) if finite.size else words.NONE)]))
    return html.table("Outcomes by axis, all methods together.",
                      ["axis", "extremes", *OUTCOMES, "largest condition number that is known"], rows)


def _size(value: float) -> str:
    return words.power(value) if math.isfinite(value) else words.NONE


# ---- figures ----------------------------------------------------------------------------------------------------

def draw(results: xr.Dataset) -> list[Figure]:
    """An overview of honesty, then honesty and error of each family of extremes."""
    families = {name: np.isin(results["axis"].values, axes) for name, axes in FAMILIES.items()}
    return [_overview(results), *(_family(results.isel(case=mask), name) for name, mask in families.items()
                                  if mask.any())]


def _overview(results: xr.Dataset) -> Figure:
    axes_names = list(dict.fromkeys(results["axis"].values))
    methods = [str(name) for name in results["method"].values]
    worst = np.full((len(axes_names), len(methods)), "", dtype=object)
    for i, axis in enumerate(axes_names):
        found = results["outcome"].values[results["axis"].values == axis]
        for j in range(len(methods)):
            seen = [name for name in OUTCOMES if name in found[:, j]]
            worst[i, j] = seen[-1] if seen else ""
    number = counts(results)
    figure = sheet(1.9 + 0.3 * len(axes_names), f"{number['silent']} answers are silently wrong, {number['crashed']} "
                   f"crashed; {number['warned'] + number['refused']} times a method warned or refused")
    panel = figure.subplots()
    _honesty(panel, worst, [str(name) for name in axes_names], methods)
    _key(figure)
    return Figure("overview.png", figure, "The worst outcome of each method along each axis. White: not asked.",
                 "Heat map of outcomes, axes by methods")


def _family(results: xr.Dataset, name: str) -> Figure:
    methods = [k for k, _ in enumerate(results["method"].values) if (results["outcome"].values[:, k] != "").any()]
    one = results.isel(method=methods)
    names = [str(method) for method in one["method"].values]
    rows = [f"{axis}: {level}" for axis, level in zip(one["axis"].values, one["level"].values, strict=True)]
    number = counts(one)
    figure = sheet(2.2 + 0.19 * len(rows), f"Extremes of {name}: {number['silent']} silently wrong, "
                   f"{number['warned']} warned, {number['refused']} refused, {number['right']} right", width=13.0)
    left, right = figure.subplots(1, 2, sharey=True)
    _honesty(left, one["outcome"].values, rows, names)
    _errors(right, one["error"].values, np.isin(one["outcome"].values, ("right", "warned", "silent")), names)
    breaks = np.flatnonzero(one["axis"].values[1:] != one["axis"].values[:-1]) + 0.5
    for panel in (left, right):
        for y in breaks:
            panel.axhline(y, color="black", linewidth=0.8)
    left.set_title("what it did", fontsize=10)
    right.set_title("true relative error in energy, as a power of ten", fontsize=10)
    _key(figure)
    return Figure(f"{name}.png", figure, "Left: letters as in the key, no letter where the answer is right. Right: the "
                 "power of ten of the true error (0 is 100 %), ? where no reference could be had. "
                 + ("Where forces nearly cancel, the error is relative to the sum of the single answers' norms."
                    if (one["cancels"].values == 1).any() else ""),
                 f"Heat maps of outcome and error for extremes of {name}")


def _honesty(panel, outcome: np.ndarray, rows: list[str], columns: list[str]) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    order = [*OUTCOMES, ""]
    codes = np.vectorize(order.index)(outcome)
    panel.imshow(codes, cmap=ListedColormap([COLOURS[name] for name in order]),
                 norm=BoundaryNorm(np.arange(-0.5, len(order)), len(order)), aspect="auto")
    for (row, column), name in np.ndenumerate(outcome):
        if LETTERS.get(name):
            panel.text(column, row, LETTERS[name], ha="center", va="center", fontsize=7,
                       color="white" if name in ("silent", "crashed") else "black")
    _ticks(panel, columns, rows)


def _errors(panel, error: np.ndarray, answered: np.ndarray, columns: list[str]) -> None:
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log10(error)
    panel.imshow(np.clip(power, *DECADES), cmap="cividis", vmin=DECADES[0], vmax=DECADES[1], aspect="auto")
    for (row, column), value in np.ndenumerate(power):
        if np.isnan(value) and answered[row, column]:
            panel.text(column, row, "?", ha="center", va="center", fontsize=6)
        elif not np.isnan(value):
            text = f"{value:.0f}".replace("-", "\u2212") if np.isfinite(value) else "0"
            text = "exact" if value == -np.inf else text.replace("\u22120", "0")
            panel.text(column, row, text, ha="center", va="center", fontsize=6,
                       color="white" if value < np.mean(DECADES) else "black")
    _ticks(panel, columns)


def _ticks(panel, columns: list[str], rows: list[str] | None = None) -> None:
    panel.set_xticks(range(len(columns)), columns, fontsize=8, rotation=40, ha="right")
    if rows is not None:
        panel.set_yticks(range(len(rows)), rows, fontsize=7)
    panel.tick_params(length=0)
    panel.spines[:].set_visible(False)


def _key(figure) -> None:
    from matplotlib.patches import Patch

    figure.legend([Patch(facecolor=COLOURS[name], edgecolor="#555555") for name in OUTCOMES],
                  [f"{LETTERS[name]} {name}".strip() for name in OUTCOMES], loc="outside lower center", ncols=5,
                  frameon=False, fontsize=9)
