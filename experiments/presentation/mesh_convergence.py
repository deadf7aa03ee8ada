"""The page on mesh convergence: sentences, figures and tables from the experiment's results alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from rom.reporting import html, words
from rom.reporting.figure import Figure, legend_below, number_axis, sheet, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

STUDIED = 7
"""Modes that the published criterion speaks of."""
CRITERION = 0.01
FITTED = 5
"""Finest meshes that limits and orders are fitted to."""
ALIKE = 0.5
"""MAC below which following a mode from mesh to mesh is uncertain."""
COLOURS = ("#332288", "#88CCEE", "#117733", "#999933", "#DDCC77", "#CC6677", "#882255", "#AA4499")  # Tol, muted
LINES = {"full": ("#D55E00", "o", "-"), "b-bar": ("#0072B2", "s", "--")}


def largest_change(results: xr.Dataset, formulation: str) -> np.ndarray:
    """Largest change of the studied modes at each step but the first: (steps - 1,) ndarray."""
    change = results["change"].sel(formulation=formulation).values[1:, :STUDIED]
    return np.abs(change).max(axis=1)


def criterion_met(results: xr.Dataset, formulation: str) -> int | None:
    """First step from which on no studied frequency changes by more than the criterion."""
    within = largest_change(results, formulation) < CRITERION
    steps = np.flatnonzero([within[k:].all() for k in range(len(within))])
    return int(steps[0]) + 1 if len(steps) else None


def convergence_findings(results: xr.Dataset) -> list[str]:
    """Criterion, error left at the study's mesh, agreement of both formulations, orders, caveats, cost."""
    published = _from_published(results)
    results = results.isel(mode=slice(STUDIED))
    names = [str(name) for name in results["formulation"].values]
    return [*(_criterion(results, name) for name in names), _left(results, names), published, _agreement(results),
            _order_sentence(results, names), *_caveats(results), _cost_sentence(results)]


def _home(results: xr.Dataset) -> tuple[int, str]:
    """Step of the study's mesh, and its nodes in words."""
    home = int(results.attrs["home"])
    return home, f"{int(results['nodes'][home]):,} nodes"


def _criterion(results: xr.Dataset, name: str) -> str:
    step, (home, mesh) = criterion_met(results, name), _home(results)
    where = f"from {int(results['nodes'][step]):,} nodes on" if step else "by no mesh"
    change = largest_change(results, name)
    at_home = f"; at {mesh} the largest change is {words.error(change[home - 1])}" if home else ""
    return (f"{name}: the study's criterion, no change above {CRITERION:.0%} from mesh to mesh in modes 1 to "
            f"{STUDIED}, is met {where}{at_home}.")


def _left(results: xr.Dataset, names: list[str]) -> str:
    home, mesh = _home(results)
    left = 100 * (results["natural_frequency"].isel(step=home) / results["limit_second_order"] - 1)
    ends = {name: left.sel(formulation=name).values for name in names}
    parts = [f"{name} {values.min():+.1f} to {values.max():+.1f} %" for name, values in ends.items()]
    return (f"At {mesh} the frequencies differ from their limits, extrapolated at order 2, by (modes 1 to {STUDIED}) "
            f"{'; '.join(parts)}.")


def _from_published(results: xr.Dataset) -> str:
    """How far the published frequencies are from the finest mesh, to which they were not calibrated."""
    finest = results.isel(step=-1)
    parts = []
    for name in results["formulation"].values:
        off = 100 * (finest["natural_frequency"].sel(formulation=name) / results["published_frequency"] - 1)
        told = [f"{float(one):+.1f} % (mode {int(one['mode'])})" for one in off if np.isfinite(float(one))]
        parts.append(f"{name} {words.listed(told)}")
    return ("The surfaces were calibrated on the study's mesh with full integration; at "
            f"{int(finest['nodes']):,} nodes the published frequencies are missed by {'; '.join(parts)}.")


def _agreement(results: xr.Dataset) -> str:
    home, mesh = _home(results)
    start, end = (float(abs(values.sel(formulation="full") / values.sel(formulation="b-bar") - 1).max())
                  for values in (results["natural_frequency"].isel(step=home), results["limit_second_order"]))
    return (f"Both formulations have one limit in theory: they differ by up to {words.error(start)} at {mesh} and "
            f"by up to {words.error(end)} in the extrapolated limits.")


def _order_sentence(results: xr.Dataset, names: list[str]) -> str:
    parts = [f"{name} {_orders(results['observed_order'].sel(formulation=name).values)}" for name in names]
    return f"Observed orders of convergence in N^(-1/3), 2 for smooth solutions: {'; '.join(parts)}."


def _orders(values: np.ndarray) -> str:
    shown = values[np.isfinite(values)]
    if not len(shown):
        return "none visible"
    text = f"{shown.min():.1f} to {shown.max():.1f}"
    hidden = len(values) - len(shown)
    return text + (f" (none visible in {hidden} of {len(values)} modes)" if hidden else "")


def _caveats(results: xr.Dataset) -> list[str]:
    nail, volume = results["nail_volume"].values, results["volume"].values
    jump = np.abs(np.diff(nail) / nail[1:]).max()
    mac, weak = float(results["mac"].min()), int((results["mac"] < ALIKE).sum())
    followed = f"Modes were followed from mesh to mesh by parity and MAC; the smallest MAC is {mac:.2f}"
    return ["The body changes with the mesh too: the nail's edge follows element edges, so that its volume jumps by up "
            f"to {words.error(jump)} from one mesh to the next ({nail.min():.1f} to {nail.max():.1f} mm³), and the "
            f"whole volume goes from {volume[0]:.0f} to {volume[-1]:.0f} mm³ as elements meet the curved surfaces "
            "better. Both blur the orders.",
            f"{followed}; {weak} pairs lie below {ALIKE:g} and are uncertain." if weak else f"{followed}."]


def _cost_sentence(results: xr.Dataset) -> str:
    seconds, memory = (float(results[name][:, -1].max()) for name in ("seconds", "peak_memory"))
    return (f"The finest mesh, {int(results['nodes'][-1]):,} nodes and {int(results['free_dofs'][-1]):,} free degrees "
            f"of freedom, took {words.seconds(seconds)} and {words.size(memory)} of memory at most.")


def convergence_figures(results: xr.Dataset) -> list[Figure]:
    """Frequencies over nodes, changes against the criterion, distance from the limit, cost."""
    return [_frequencies(results), _changes(results), _distance(results), _cost(results)]


def _over_nodes(axes: Axes, results: xr.Dataset, label: str) -> None:
    published = int(results.attrs["published_nodes"])
    axes.axvline(published, color="#555555", linestyle=":", linewidth=1.2, label=f"published mesh, {published:,} nodes")
    axes.set_xscale("log")
    axes.set(xlabel="nodes", ylabel=label)
    _log_ticks(axes.xaxis)
    tidy(axes)


def _log_ticks(axis: Axis) -> None:
    """Plain numbers at 1, 2 and 5 of each decade."""
    from matplotlib.ticker import LogLocator

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    number_axis(axis)


def _frequencies(results: xr.Dataset) -> Figure:
    nodes, (home, mesh) = results["nodes"].values, _home(results)
    frequency = results["natural_frequency"]
    move = 100 * abs(frequency.isel(step=-1) / frequency.isel(step=home) - 1).isel(mode=slice(STUDIED)).max("mode")
    spoken = " and ".join(f"{float(move.sel(formulation=name)):.1f} % ({name})" for name in LINES)
    title = f"From {mesh} to {nodes[-1]:,} the first {STUDIED} frequencies move by at most {spoken}"
    figure = sheet(5.4, title if home < len(nodes) - 1 else "Natural frequencies over mesh density")
    axes = figure.subplots()
    for k, colour in enumerate(COLOURS[:results.sizes["mode"]]):
        for name, (_, marker, line) in LINES.items():
            axes.plot(nodes, frequency.sel(formulation=name).values[:, k], line, color=colour, marker=marker,
                      markersize=4, linewidth=1.4, label=f"mode {k + 1}" if line == "-" else None)
        printed = float(results["published_frequency"].values[k])
        if np.isfinite(printed):
            axes.plot(results.attrs["published_nodes"], printed, "*", color=colour, markersize=13,
                      markeredgecolor="black", markeredgewidth=0.6, zorder=5)
    axes.plot([], [], "--", marker="s", color="black", markersize=4, label="dashed: b-bar")
    axes.plot([], [], "*", color="white", markersize=13, markeredgecolor="black", label="published frequency")
    _over_nodes(axes, results, "natural frequency [Hz]")
    figure.legend(loc="outside right center", frameon=False, fontsize=9)
    return Figure("frequencies.png", figure, "The same modes on finer and finer meshes; solid: full integration, as "
                  "published, dashed: B-bar. Stars: published values at the published mesh.",
                  "Natural frequencies over the number of nodes")


def _changes(results: xr.Dataset) -> Figure:
    nodes = results["nodes"].values
    met = {name: criterion_met(results, name) for name in LINES}
    spoken = " and ".join(f"{f'from {nodes[step]:,} nodes on' if step else 'on no mesh'} with {name}"
                          for name, step in met.items())
    figure = sheet(4.5, f"The study's 1 % criterion is met {spoken}", width=8.5)
    axes = figure.subplots()
    for name, (colour, marker, _) in LINES.items():
        change = 100 * np.abs(results["change"].sel(formulation=name).values[1:, :STUDIED])
        axes.plot(nodes[1:], change.max(axis=1), marker + "-", color=colour,
                  label=f"{name}, largest of modes 1 to {STUDIED}")
        axes.plot(nodes[1:], np.median(change, axis=1), marker + ":", color=colour, alpha=0.6, markersize=4,
                  label=f"{name}, median")
    axes.axhline(100 * CRITERION, color="#B2182B", linestyle=(0, (6, 3)), linewidth=1.3, label="criterion, 1 %")
    axes.set_yscale("log")
    _log_ticks(axes.yaxis)
    _over_nodes(axes, results, "change from the coarser mesh [%]")
    legend_below(figure, [axes], columns=3)
    return Figure("criterion.png", figure, "Change of the natural frequencies from each mesh to the next, which has "
                  "about 1.5 times the nodes.",
                  "Largest change of frequencies over the number of nodes, beside the criterion")


def _distance(results: xr.Dataset) -> Figure:
    width = (results["nodes"].values / results["nodes"].values[-1]) ** (-1 / 3)
    orders = {name: results["observed_order"].sel(formulation=name).values[:STUDIED] for name in LINES}
    spoken = "; ".join(f"{name} {_orders(values)}" for name, values in orders.items())
    figure = sheet(4.6, f"Observed orders of convergence: {spoken}; the element's own is 2")
    panels = figure.subplots(1, len(LINES), sharey=True)
    for axes, name in zip(panels, LINES, strict=True):
        one = results.sel(formulation=name)
        away = 100 * np.abs(one["natural_frequency"].values / one["limit_second_order"].values - 1)[:, :STUDIED]
        for k, order in enumerate(orders[name]):
            seen = f"order {order:.1f}" if np.isfinite(order) else "none visible"
            axes.loglog(width, away[:, k], "o-", color=COLOURS[k], markersize=4, linewidth=1.2,
                        label=f"mode {k + 1}: {seen}")
        axes.loglog(width, np.nanmax(away) * (width / width[0]) ** 2, "k:", linewidth=1.2, label="slope 2")
        axes.set(xlabel="mesh width, (N / finest N)^(-1/3) [-]", title=name)
        _log_ticks(axes.xaxis)
        _log_ticks(axes.yaxis)
        tidy(axes)
        axes.legend(frameon=False, fontsize=8)
    panels[0].set_ylabel("distance from the limit [%]")
    return Figure("order.png", figure, "Distance of each frequency from its limit, extrapolated at order 2 from the "
                  f"{min(FITTED, len(width))} finest meshes; the legend's orders were fitted freely to the same "
                  "meshes.",
                  "Distance from the limit over mesh width for both formulations")


def _cost(results: xr.Dataset) -> Figure:
    nodes = results["nodes"].values
    seconds, memory = results["seconds"].values, results["peak_memory"].values / 1e9
    figure = sheet(3.8, f"{nodes[-1]:,} nodes cost {words.seconds(seconds[:, -1].max())} and "
                   f"{words.significant(memory[:, -1].max())} GB")
    panels = figure.subplots(1, 2)
    for axes, values, label in ((panels[0], seconds, "time of one mesh [s]"), (panels[1], memory, "peak memory [GB]")):
        for i, (name, (colour, marker, _)) in enumerate(LINES.items()):
            axes.loglog(nodes, values[i], marker + "-", color=colour, label=name)
        _log_ticks(axes.yaxis)
        _over_nodes(axes, results, label)
        axes.legend(frameon=False, fontsize=9)
    return Figure("cost.png", figure, "Time and peak memory of meshing, assembly, twelve modes and the Sturm count, "
                  "each mesh in a process of its own.", "Seconds and gigabytes over the number of nodes")


def convergence_tables(results: xr.Dataset) -> list[str]:
    """Frequencies mesh by mesh, limits and orders, the ladder."""
    return [*(_frequency_table(results, str(name)) for name in results["formulation"].values), _ladder_table(results)]


def _frequency_table(results: xr.Dataset, name: str) -> str:
    one = results.sel(formulation=name)
    rows = [("", [html.named(f"{nodes:,} nodes"), *(html.cell(f"{f:.1f}") for f in row)])
            for nodes, row in zip(results["nodes"].values, one["natural_frequency"].values, strict=True)]
    for label, key in (("limit at order 2 [Hz]", "limit_second_order"), ("limit at the observed order [Hz]", "limit"),
                       ("observed order [-]", "observed_order")):
        rows.append(("", [html.named(label), *(html.cell(f"{value:.1f}" if np.isfinite(value) else words.NONE)
                                               for value in one[key].values)]))
    return html.table(f"Natural frequencies [Hz], {name}.", ["mesh", *(f"mode {k}" for k in one["mode"].values)], rows)


def _ladder_table(results: xr.Dataset) -> str:
    rows = []
    for k, counts in enumerate(str(results.attrs["ladder"]).split("; ")):
        one = results.isel(step=k)
        rows.append(("", [html.named(f"{int(one['nodes']):,} nodes"), html.cell(counts),
                          html.cell(f"{int(one['free_dofs']):,}"), html.cell(f"{float(one['volume']):.1f}"),
                          html.cell(f"{float(one['nail_volume']):.1f}"),
                          html.cell(words.seconds(float(one["seconds"].max()))),
                          html.cell(words.size(float(one["peak_memory"].max())))]))
    return html.table("The meshes: counts of elements, body, and what one run costs at most.",
                      ["mesh", "elements", "free dofs", "volume [mm³]", "nail [mm³]", "time", "memory"], rows)
