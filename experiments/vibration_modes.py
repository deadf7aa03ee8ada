"""The fingertip's natural modes beside the published ones, rear free and fixed.

Every published fact is looked up in the results: volume, frequencies, parity, and the seven shapes by computed measures
instead of by eye. The surfaces' free parameters were calibrated on some of these facts, so agreement with those is no
prediction; the page says how far each lies away, met or not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import script
import xarray as xr
from analysis.mode_pairing import on_common_dofs, pair_modes
from presentation import mode_tables
from presentation.published_facts import DESCRIBED, FREQUENCY_TOLERANCE, Fact, elsewhere, facts, rises, with_facts

from rom.reporting import words
from rom.reporting.figure import Figure, sheet, tidy
from rom.reporting.mode_shapes import Shape, magnitude_sheet, normal_sheet
from rom.vibration.modal_analysis import ModalAnalysis, analyse_modes, modes_below
from rom.vibration.published import published, published_frequencies

FORMULATION = "full"
"""As published; the other one stands beside it."""
OTHER = {"full": "b-bar", "b-bar": "full"}[FORMULATION]
BAND = 300.0  # [Hz]
SHOWN = 8
SPARE = 4  # modes beyond the band, so that every mode inside it finds its partner when the rear is held
ORTHOGONAL = 1e-9
REARS = ("free", "fixed")
ONE = {"units": "1"}


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """Do the fingertip's natural modes agree with the published ones?"""
    free = replace(script.fingertip(quick, "study"), formulation=FORMULATION)
    fixed = replace(free, rear="fixed")
    below = [modes_below(free, BAND), modes_below(fixed, BAND)]
    count = max(SHOWN, below[0]) + SPARE
    found, others = [], []
    for tip in progress([free, fixed], "rear boundaries"):
        found.append(analyse_modes(tip, count))
        others.append(analyse_modes(replace(tip, formulation=OTHER), count))
    count = min(one.modes.count for one in [*found, *others])
    shapes = on_common_dofs(free, found[0].modes.shape[:, :count], fixed), found[1].modes.shape[:, :count]
    pairs = pair_modes(*shapes, fixed.mass, parity=found[0].parity[:count], other_parity=found[1].parity[:count],
                       first=SHOWN)
    rears = xr.Variable("rear", np.array(REARS, dtype=object), {"long_name": "section at the joint", **ONE})
    results = xr.concat([one.to_dataset().isel(mode=slice(count)) for one in found], rears, join="exact")
    results["paired_mode"] = ("mode", pairs.partner + 1, {
        "long_name": "number of the rear-fixed mode that this rear-free mode becomes", **ONE})
    results["pair_mac"] = ("mode", pairs.mac, {"long_name": "mass-weighted MAC of the pair", **ONE})
    printed = published_frequencies()
    results["published_frequency"] = ("mode", [printed.get(k, np.nan) for k in range(1, count + 1)], {
        "long_name": "published natural frequency, rear free", "units": "Hz"})
    _beside(results, found, others, count)
    _proofs(results, found, below)
    _skin(results, found, pairs.partner)
    digitip = published()["digitip"]
    results.attrs = {"volume_mm3": free.mesh.volume * 1e9, "published_volume_mm3": digitip["volume_mm3"],
                     "formulation": FORMULATION, "other_formulation": OTHER, "nodes": free.mesh.n_nodes,
                     "elements": len(free.mesh.hexahedra), "fingertip": script.spoken(free)}
    return with_facts(results)


def _beside(results: xr.Dataset, found: list[ModalAnalysis], others: list[ModalAnalysis], count: int) -> None:
    """The other formulation's frequencies in the order of these modes."""
    frequency, mac = np.empty((2, len(REARS), count))
    for i, (one, other) in enumerate(zip(found, others, strict=True)):
        pairs = pair_modes(one.modes.shape[:, :count], other.modes.shape, one.fingertip.mass,
                           parity=one.parity[:count], other_parity=other.parity, first=SHOWN)
        frequency[i], mac[i] = other.modes.frequency_hz[pairs.partner], pairs.mac
    results["other_formulation_frequency"] = (("rear", "mode"), frequency, {
        "long_name": f"natural frequency of the most similar mode, {OTHER}", "units": "Hz"})
    results["other_formulation_mac"] = (("rear", "mode"), mac, {"long_name": "its mass-weighted MAC", **ONE})


def _proofs(results: xr.Dataset, found: list[ModalAnalysis], below: list[int]) -> None:
    """Sturm counts against modes found, and orthogonality."""
    results["sturm_count"] = ("rear", below, {
        "long_name": f"natural modes below {BAND:g} Hz by the inertia of K - omega^2 M", **ONE})
    results["modes_found"] = ("rear", [int((one.modes.frequency_hz < BAND).sum()) for one in found], {
        "long_name": f"computed modes below {BAND:g} Hz", **ONE})
    results["orthogonality"] = (("rear", "matrix"), [list(one.orthogonality.values()) for one in found], {
        "long_name": "largest off-diagonal element of the scaled Gram matrix of the modes", **ONE})
    results.coords["matrix"] = ("matrix", np.array(["stiffness", "mass"], dtype=object), {"long_name": "matrix", **ONE})


def _skin(results: xr.Dataset, found: list[ModalAnalysis], partner: np.ndarray) -> None:
    """What the figures show: the first modes on the skin, and their partners, turned to the same sign."""
    mesh = found[0].fingertip.mesh
    free, fixed = found[0].field[:SHOWN, mesh.skin_nodes], found[1].field[partner[:SHOWN]][:, mesh.skin_nodes]
    fixed *= np.where(np.einsum("knc,knc->k", free, fixed) < 0, -1.0, 1.0)[:, None, None]
    results["skin_shape"] = (("rear", "shown", "skin_node", "component"), np.stack([free, fixed]).astype(np.float32), {
        "long_name": "mode shape on the skin, largest displacement 1; rear fixed: the partner's", **ONE})
    for k, axis in enumerate("xyz"):
        results[f"skin_{axis}"] = ("skin_node", mesh.nodes[mesh.skin_nodes, k], {
            "long_name": f"{axis} of the skin's nodes", "units": "m"})
    results["skin_normal"] = (("skin_node", "component"), mesh.normals.astype(np.float32), {
        "long_name": "outward normal", **ONE})
    results["skin_quads"] = (("skin_quad", "corner"), mesh.skin_quads.astype(np.int32), {
        "long_name": "skin nodes of each quadrilateral", **ONE})
    results.coords["component"] = ("component", np.array(["x", "y", "z"], dtype=object), {
        "long_name": "displacement component", **ONE})


def findings(results: xr.Dataset) -> list[str]:
    """Facts met and missed, in sentences."""
    listed = facts(results)
    missed = [one for one in listed if not one.met]
    sentences = [f"{len(listed) - len(missed)} of {len(listed)} published facts are met (formulation: "
                 f"{results.attrs['formulation']}; {results.attrs['nodes']:,} nodes)."
                 + (f" Missed: {'; '.join(_short(one) for one in missed)}." if missed else "")]
    sentences.append("The surfaces' free parameters were calibrated on volume, frequencies, parities and order: "
                     "agreement with those is no prediction.")
    sentences += elsewhere(results)
    rise, mac = rises(results), results["pair_mac"].values[:DESCRIBED]
    sentences.append(f"With the rear fixed the first {DESCRIBED} modes rise by {100 * rise.min():.0f} to "
                     f"{100 * rise.max():.0f} %; their shapes agree with a MAC of {mac.min():.2f} to {mac.max():.2f}.")
    shift = results["other_formulation_frequency"].sel(rear="free").values[:DESCRIBED] / (
        results["natural_frequency"].sel(rear="free").values[:DESCRIBED]) - 1
    sentences.append(f"{results.attrs['other_formulation']} instead of {results.attrs['formulation']} moves the first "
                     f"{DESCRIBED} frequencies by {100 * shift.min():+.1f} to {100 * shift.max():+.1f} %.")
    return [*sentences, _proof(results)]


def _short(fact: Fact) -> str:
    """Without the description of a shape."""
    mode, colon, _ = fact.name.partition(":")
    return f"{f'shape of {mode}' if colon else fact.name} ({fact.text})"


def _proof(results: xr.Dataset) -> str:
    worst = float(results["orthogonality"].max())
    complete = (results["sturm_count"] == results["modes_found"]).all()
    verdict = f"{'within' if worst <= ORTHOGONAL else 'beyond'} the bar of {words.power(ORTHOGONAL)}"
    counts = words.listed([f"{int(results['sturm_count'].sel(rear=rear))} with the rear {rear}" for rear in REARS])
    return (f"{'Every' if complete else 'Not every'} mode below {BAND:g} Hz is found, by Sturm counts ({counts}); the "
            f"modes are orthogonal in K and M to {words.power(worst)} ({verdict}); the largest residual is "
            f"{words.power(float(results['residual'].max()))}.")


def draw(results: xr.Dataset) -> list[Figure]:
    """Shapes of both rears, normal motion, frequencies beside the published ones."""
    return [_shapes(results), _normal(results), _frequencies(results)]


def _geometry(results: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    position = np.column_stack([results[f"skin_{axis}"].values for axis in "xyz"]) * 1e3
    return position, results["skin_quads"].values.astype(int)


def _shapes(results: xr.Dataset) -> Figure:
    frequency, shape = results["natural_frequency"], results["skin_shape"]
    partner, mac = results["paired_mode"].values, results["pair_mac"].values
    panels = []
    for k in range(shape.sizes["shown"]):
        panels.append(Shape(f"mode {k + 1}, free: {float(frequency.sel(rear='free')[k]):.1f} Hz\n"
                            f"({results['parity'].sel(rear='free').values[k]})",
                            shape.sel(rear="free").values[k]))
        held = float(frequency.sel(rear="fixed")[partner[k] - 1])
        panels.append(Shape(f"mode {partner[k]}, fixed: {held:.1f} Hz\n(MAC {mac[k]:.2f})",
                            shape.sel(rear="fixed").values[k]))
    kept = int((partner[:DESCRIBED] == np.arange(1, DESCRIBED + 1)).sum())
    title = (f"Fixing the rear raises the first {DESCRIBED} modes by {100 * rises(results).min():.0f} to "
             f"{100 * rises(results).max():.0f} %; {kept} of {DESCRIBED} keep their number")
    return Figure("mode-shapes.png", magnitude_sheet(title, *_geometry(results), panels),
                  "The first modes with the rear free, each beside the mode that it becomes when the rear is fixed, "
                  "paired by mass-weighted MAC. Seen from the pad's side, the tip to the right; displacements are "
                  "exaggerated, the largest to 2 mm; amplitude and sign of a mode are arbitrary.",
                  "Displaced fingertip skin for eight pairs of natural modes, coloured by displacement magnitude")


def _normal(results: xr.Dataset) -> Figure:
    free = results.sel(rear="free")
    frequency, shape, parity = (free[name].values for name in ("natural_frequency", "skin_shape", "parity"))
    met = free["description_met"].values
    panels = []
    for k in range(len(shape)):
        fits = mode_tables.likeness(results, k)
        panels.append(Shape(f"mode {k + 1}, {frequency[k]:.1f} Hz: {parity[k]},\n"
                            f"looks as {f'published mode {fits}' if fits else 'no published mode'}", shape[k]))
    own = sum(bool(met[k, k]) for k in range(DESCRIBED))
    title = f"{own} of {DESCRIBED} modes look as the published mode of the same number, by computed measures"
    return Figure("normal-motion.png", normal_sheet(title, *_geometry(results), results["skin_normal"].values, panels),
                  "Motion along the skin's outward normal with the rear free: red and blue are out of phase. Which "
                  "published description a mode meets is decided by the measures tabulated below, not by the picture.",
                  "Displaced fingertip skin of eight natural modes, coloured by normal motion")


def _frequencies(results: xr.Dataset) -> Figure:
    frequency = results["natural_frequency"]
    number = results["mode"].values[:SHOWN]
    printed = results["published_frequency"].values[:SHOWN]
    bars = [one for one in facts(results) if one.units == "Hz"]
    met = sum(one.met for one in bars)
    figure = sheet(4.4, f"{met} of {len(bars)} published frequencies are reproduced within their tolerance", width=8.5)
    axes = figure.subplots()
    for mode, tolerance in FREQUENCY_TOLERANCE.items():
        f, ends = printed[mode - 1], [mode - 0.4, mode + 0.4]
        axes.fill_between(ends, f * (1 - tolerance), f * (1 + tolerance), color="#E69F00", alpha=0.3, linewidth=0,
                          label="published, with tolerance")
        axes.plot(ends, [f, f], color="#B07800", linewidth=1.2)
    colours = {"symmetric": "#0072B2", "antisymmetric": "#D55E00"}
    parity = results["parity"].sel(rear="free").values[:SHOWN]
    for kind, colour in colours.items():
        which = parity == kind
        axes.plot(number[which], frequency.sel(rear="free").values[:SHOWN][which], "o", color=colour, markersize=7,
                  label=f"rear free, {kind}")
    partner = results["paired_mode"].values[:SHOWN] - 1
    axes.plot(number, frequency.sel(rear="fixed").values[partner], "_", color="black", markersize=13,
              markeredgewidth=1.8, label="the same mode, rear fixed")
    axes.plot(number, results["other_formulation_frequency"].sel(rear="free").values[:SHOWN], "x", color="#777777",
              label=f"rear free, {results.attrs['other_formulation']}")
    axes.set(xlabel="mode", ylabel="natural frequency [Hz]", xticks=number)
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    axes.legend(handles.values(), handles.keys(), frameon=False, fontsize=9, loc="upper left")
    tidy(axes, "y")
    return Figure("frequencies.png", figure,
                  "Computed natural frequencies beside those that the study prints; it prints none of modes 3, 5 and "
                  "6.", "Natural frequency over mode number, computed and published")


def tables(results: xr.Dataset) -> list[str]:
    """Facts with verdicts, modes, measures, criteria."""
    return [mode_tables.fact_table(results), mode_tables.mode_table(results), mode_tables.measure_table(results, SHOWN),
            mode_tables.criteria_table()]


if __name__ == "__main__":
    script.run(main, draw, findings, "vibration-modes", tables=tables)
