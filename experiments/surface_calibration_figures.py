"""Figures, findings and tables of the surface calibration, from its results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr
from presentation.published_facts import FREQUENCY_TOLERANCE, VOLUME_TOLERANCE

from rom.reporting import html, words
from rom.reporting.figure import Figure, legend_below, sheet, tidy

TOLERANCE = {"volume": VOLUME_TOLERANCE, "mode_1": FREQUENCY_TOLERANCE[1], "mode_2": FREQUENCY_TOLERANCE[2],
             "mode_4_about": FREQUENCY_TOLERANCE[4], "mode_7": FREQUENCY_TOLERANCE[7], "mode_8": FREQUENCY_TOLERANCE[8]}
NAME = {"volume": "volume", "mode_1": "mode 1", "mode_2": "mode 2", "mode_4_about": "mode 4", "mode_7": "mode 7",
        "mode_8": "mode 8", "order_fixed": "order with the rear fixed"}
COLOUR = {"volume": "#999999", "mode_1": "#0072B2", "mode_2": "#D55E00", "mode_4_about": "#009E73", "mode_7": "#CC79A7",
          "mode_8": "#000000"}
WITHOUT, PULLED = "without ", "mode 8 at "


def used(results: xr.Dataset, fit: str) -> xr.DataArray:
    """Distance from each published value over what is allowed: (fact,), 1 at the limit."""
    allowed = xr.DataArray([TOLERANCE[name] for name in results["fact"].values], dims="fact")
    return results["deviation"].sel(fit=fit) / allowed


def predictions(results: xr.Dataset) -> list[tuple[str, float, float, bool]]:
    """Fact left out, what the others predict it to be (relative to what is published), allowed, met."""
    found = []
    for fit in map(str, results["fit"].values):
        name = fit.removeprefix(WITHOUT)
        if name == fit or not np.isfinite(results["found"].sel(fit=fit)).all():
            continue
        if name == "order_fixed":
            gap = float(results["order_gap"].sel(fit=fit, rear="fixed").min())
            found.append((name, gap, 0.0, gap > 0))
        else:
            off = float(results["deviation"].sel(fit=fit, fact=name))
            found.append((name, off, TOLERANCE[name], abs(off) <= TOLERANCE[name]))
    return found


def findings(results: xr.Dataset) -> list[str]:
    """What was tuned against what, how well, what the facts predict of each other, what disagrees."""
    share = used(results, "adopted")
    worst = _worst(share)
    gap = results["order_gap"].sel(fit="adopted")
    rise = results["rise"].sel(fit="adopted")
    met = bool((np.abs(share) <= 1).all())
    sentences = [
        f"The adopted shape meets {'all' if met else int((np.abs(share) <= 1).sum())} of the {share.size} published "
        f"numbers it was fitted to; nearest to its limit is {NAME[worst]} "
        f"({100 * float(results['deviation'].sel(fit='adopted', fact=worst)):+.1f} %, allowed "
        f"{100 * TOLERANCE[worst]:g} %). This is calibration, not prediction.",
        f"Tuned: {results.sizes['assumption']} numbers of the surfaces ({_spoken(results['assumption'].values)}). "
        f"Against: {words.listed([NAME[str(name)] for name in results['fact'].values])}, and the order of modes with "
        "either rear. Not looked at: the shapes of the modes, the frequency responses, and where forced vibration is "
        "largest; tables 1 and 2 stay as published.",
        f"Order: neighbours in the published order are {100 * float(gap.min()):.1f} % apart at least "
        f"({'kept' if float(gap.min()) > 0 else 'broken'}); a fixed rear raises every frequency, by "
        f"{100 * float(rise.min()):.1f} to {100 * float(rise.max()):.0f} %."]
    ends = [used(results, fit) for fit in ("fit from plain", "fit from fuller")]
    sentences.append(
        "From plain surfaces the fit ends at "
        f"{float(np.abs(ends[0]).max()):.1f} times what is allowed ({NAME[_worst(ends[0])]}), from a fuller start at "
        f"{float(np.abs(ends[1]).max()):.1f} times ({NAME[_worst(ends[1])]}), after "
        f"{int(results['evaluations'].sel(fit='fit from plain'))} and "
        f"{int(results['evaluations'].sel(fit='fit from fuller'))} shapes: there is more than one valley, and kinks "
        "where the hypodermis reaches its least share.")
    told = predictions(results)
    good, bad = ([one for one in told if one[3] == which] for which in (True, False))
    if good:
        sentences.append(f"Left out of the fit and still met: {words.listed([_told(*one) for one in good])}.")
    if bad:
        sentences.append(f"Left out and missed, so the other facts do not imply it: "
                         f"{words.listed([_told(*one) for one in bad])}.")
    pulled = _pulled(results)
    broken = [str(fit) for fit in results["fit"].values if not np.isfinite(results["found"].sel(fit=fit)).all()]
    if broken:
        sentences.append(f"On the study mesh the layers find no room in {words.listed(broken)}: the cheap mesh was "
                         "pushed too far there.")
    if len(pulled) > 1:
        last = pulled[-1]
        gap = results["order_gap"].sel(fit=last)
        others = used(results, last).drop_sel(fact="mode_8")
        sentences.append(
            f"Pulling mode 8 to {100 * float(results['deviation'].sel(fit=last, fact='mode_8')):+.1f} % from its "
            f"published value costs {NAME[_worst(others)]} most: {float(np.abs(others).max()):.2f} times what is "
            f"allowed; the least gap in the order is then {100 * float(gap.min()):.1f} %.")
    return sentences


def _worst(share: xr.DataArray) -> str:
    """The fact that uses most of what it is allowed."""
    return str(share["fact"].values[np.abs(share.values).argmax()])


def _told(name: str, off: float, _: float, __: bool) -> str:
    if name == "order_fixed":
        return f"{NAME[name]} (least gap {100 * off:+.1f} %)"
    return f"{NAME[name]} ({100 * off:+.2f} %)"


def _spoken(names: np.ndarray) -> str:
    return words.listed([str(name).replace("_", " ") for name in names])


def _pulled(results: xr.Dataset) -> list[str]:
    names = [str(fit) for fit in results["fit"].values if str(fit).startswith(PULLED)
             and np.isfinite(float(results["deviation"].sel(fit=fit, fact="mode_8")))]
    return sorted(names, key=lambda fit: float(results["deviation"].sel(fit=fit, fact="mode_8")))


def draw(results: xr.Dataset) -> list[Figure]:
    """Shapes, facts met, facts predicted, trade-off."""
    figures = [_sections(results), _facts(results)]
    if predictions(results):
        figures.append(_left_out(results))
    if len(_pulled(results)) > 1:
        figures.append(_trade_off(results))
    return figures


def _sections(results: xr.Dataset) -> Figure:
    bed = results["assumption_value"].sel(assumption="nail_bed_thickness")
    figure = sheet(4.6, f"The adopted shape beside plain surfaces: nail bed {float(bed.sel(fit='adopted')):.1f} mm "
                        f"instead of {float(bed.sel(fit='plain')):.1f} mm deep, a squarer bone, a fuller equator")
    panels = figure.subplots(1, 2, width_ratios=(1.75, 1))
    styles = {"plain": ("#999999", "--", 1.2), "adopted": ("#0072B2", "-", 1.6)}
    for panel, section, label in zip(panels, ("longitudinal", "lateral"), ("x, joint to tip [mm]", "y [mm]"),
                                     strict=True):
        lines = results[f"outline_{section}"]
        for fit, (colour, dash, width) in styles.items():
            for k in range(lines.sizes["surface"]):
                line = lines.sel(outlined=fit).isel(surface=k)
                panel.plot(line.sel(axis="horizontal"), line.sel(axis="vertical"), dash, color=colour, linewidth=width,
                           label=fit if k == 0 else None)
        panel.set_aspect("equal")
        panel.set_xlabel(label)
        panel.set_ylabel("z, dorsal [mm]")
        tidy(panel)
    legend_below(figure, list(panels))
    return Figure("sections.png", figure, "Mid-plane, and a section across the front (a ring of the mesh, seen along "
                  "the finger): skin, lower face of dermis and nail bed, bone.", "Sections of plain and adopted shape")


def _facts(results: xr.Dataset) -> Figure:
    fits = [fit for fit in ("plain", "fit from plain", "fit from fuller", "adopted") if fit in results["fit"].values]
    miss = float(np.abs(used(results, "plain")).max())
    most = float(np.abs(used(results, "adopted")).max())
    figure = sheet(3.8, f"Plain surfaces miss a fact by {miss:.1f} times what is allowed, the adopted ones use "
                        f"{100 * most:.0f} % of it at most")
    axes = figure.subplots()
    names = list(results["fact"].values)
    for k, (fit, marker) in enumerate(zip(fits, "xo^s", strict=False)):
        axes.plot(used(results, fit), np.arange(len(names)) + 0.14 * (k - 1.5), marker, label=fit, markersize=6)
    axes.axvspan(-1, 1, color="#DCE6F2", zorder=0, label="met")
    axes.set_yticks(range(len(names)), [NAME[str(name)] for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel("distance from the published value, over the allowed one [-]")
    tidy(axes)
    legend_below(figure, [axes])
    return Figure("facts.png", figure,
                  "Study mesh, full integration as published. Inside the band a fact counts as met.",
                  "Published facts for plain, fitted and adopted surfaces")


def _left_out(results: xr.Dataset) -> Figure:
    told = predictions(results)
    met = sum(one[3] for one in told)
    figure = sheet(3.6, f"{met} of {len(told)} facts are met by a fit that never saw them")
    axes = figure.subplots()
    for row, (name, off, allowed, _) in enumerate(told):
        if name == "order_fixed":
            axes.plot(100 * off, row, "D", color="#0072B2")
            axes.text(100 * off, row - 0.22, "least gap: above zero is met", fontsize=8, ha="center")
            continue
        axes.plot([-100 * allowed, 100 * allowed], [row, row], color="#9FB8D6", linewidth=7, solid_capstyle="butt",
                  label=None if row else "allowed")
        axes.plot(100 * float(results["deviation"].sel(fit="fit from plain", fact=name)), row, "o", color="#777777",
                  label=None if row else "seen by the fit")
        axes.plot(100 * off, row, "D", color="#0072B2", label=None if row else "left out of the fit")
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_yticks(range(len(told)), [NAME[one[0]] for one in told])
    axes.set_ylim(len(told) - 0.5, -0.6)
    axes.set_xlabel("distance from the published value [%]")
    tidy(axes, "x")
    legend_below(figure, [axes])
    return Figure("left-out.png", figure, "Each row is a fit of its own, from plain surfaces, without that fact.",
                  "Predictions of facts that were left out")


def _trade_off(results: xr.Dataset) -> Figure:
    fits = sorted([*_pulled(results), "adopted"], key=lambda f: float(results["deviation"].sel(fit=f, fact="mode_8")))
    at = [100 * float(results["deviation"].sel(fit=fit, fact="mode_8")) for fit in fits]
    figure = sheet(4.4, f"Mode 8 from {at[0]:+.1f} to {at[-1]:+.1f} % of its published frequency: what the other facts "
                        "pay for it")
    left, right = figure.subplots(1, 2)
    for name in results["fact"].values:
        if name != "mode_8":
            left.plot(at, [float(used(results, fit).sel(fact=name)) for fit in fits], "o-", color=COLOUR[str(name)],
                      label=NAME[str(name)])
    left.axhspan(-1, 1, color="#DCE6F2", zorder=0, label="met")
    left.set_ylabel("distance from published, over allowed [-]")
    for rear, dash in (("free", "o-"), ("fixed", "s--")):
        for neighbours, colour in zip(results["neighbours"].values, ("#0072B2", "#D55E00", "#009E73", "#CC79A7"),
                                      strict=True):
            gap = [100 * float(results["order_gap"].sel(fit=fit, rear=rear, neighbours=neighbours)) for fit in fits]
            right.plot(at, gap, dash, color=colour, label=f"{neighbours}, rear {rear}", markersize=4)
    right.axhline(0, color="black", linewidth=0.8)
    right.set_ylabel("distance of neighbours in the order [%]")
    for panel in (left, right):
        panel.set_xlabel("mode 8 from its published frequency [%]")
        tidy(panel)
    legend_below(figure, [left, right], columns=4)
    return Figure("trade-off.png", figure, "Each abscissa is a fit in which mode 8 counts ten times as much as usual; "
                  "A and S are antisymmetric and symmetric modes by rank.",
                  "Trade-off between mode 8 and the other facts")


def tables(results: xr.Dataset) -> list[str]:
    """The shapes in numbers, and the facts."""
    fits = [str(fit) for fit in results["fit"].values]
    head = [html.named("assumption", "bounds"), *(html.named(fit) for fit in fits)]
    rows = []
    for name in results["assumption"].values:
        low, high = results["bound"].sel(assumption=name).values
        value = results["assumption_value"].sel(assumption=name)
        rows.append(("", [html.named(str(name).replace("_", " "), f"{low:g} to {high:g}"),
                          *(html.cell(f"{float(value.sel(fit=fit)):.4g}") for fit in fits)]))
    facts = []
    for name in results["fact"].values:
        cells = [html.named(NAME[str(name)], f"{float(results['published'].sel(fact=name)):g}")]
        for fit in fits:
            cells.append(html.cell(f"{float(results['found'].sel(fit=fit, fact=name)):.1f}",
                                   f"{100 * float(results['deviation'].sel(fit=fit, fact=name)):+.2f} %"))
        facts.append(("", cells))
    return [html.table("Surface assumptions: nine numbers that tables 1 and 2 leave open.", head, rows),
            html.table("Published facts, on the study mesh with full integration.",
                       [html.named("fact", "published"), *(html.named(fit) for fit in fits)], facts)]
