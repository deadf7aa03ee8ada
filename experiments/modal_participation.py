"""Which natural modes carry a vibrating force on the finger pad, direction by direction and frequency by frequency.

Shares of strain energy, after the modes' orthogonality (`analysis.participation`); what the kept modes leave is the
residual, which a truncated superposition loses.
"""

from __future__ import annotations

import numpy as np
import script
import xarray as xr
from analysis.participation import energy_shares, participation, static_shares
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize

from rom.fingertip import DIRECTIONS
from rom.metamodels.modal import ModalKrylov
from rom.reporting import html, words
from rom.reporting.figure import Figure, legend_below, sheet, tidy
from rom.scenes import get_scene
from rom.vibration.frequency_response import frequency_response, sweep_cases
from rom.vibration.parity import parity

MODES, VECTORS = 12, 10
TABLED = (50.0, 100.0, 150.0, 200.0, 250.0)
"""Frequencies of the table [Hz]."""
LOSS_FACTOR = 0.1
RESIDUAL = "left"


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """Which natural modes carry a force on the finger pad?"""
    scene = get_scene("harmonic-patch-forces", script.fingertip(quick, "study"))
    model, tip = scene.model, scene.body.fingertip
    frequency = np.arange(10.0, 261.0, 10.0) if quick else np.arange(2.0, 261.0, 2.0)
    modes = model.natural_modes(count=MODES)
    answer = ModalKrylov(scene, modes=MODES, vectors=VECTORS).fit()
    shape = (len(frequency), len(DIRECTIONS))
    strain, kinetic = np.empty((2, shape[0] * shape[1], MODES + 1))

    def share(part: slice, field: np.ndarray) -> None:
        found = energy_shares(model, modes, field)
        strain[part] = np.column_stack([found.strain, found.strain_residual])
        kinetic[part] = np.column_stack([found.kinetic, found.kinetic_residual])

    response = frequency_response(answer, frequency, loss_factor=LOSS_FACTOR, watch=share,
                                  progress=lambda items: progress(items, "frequencies"))
    static, left = static_shares(model, modes, scene.unit_loads)
    one, dims = {"units": "1"}, ("direction", "frequency", "carrier")
    return xr.Dataset({
        "participation": (("direction", "mode"), participation(modes, scene.unit_loads), {
            "long_name": "mass-orthonormal mode times unit load, sign arbitrary", "units": "N kg-0.5"}),
        "static_share": (("direction", "carrier"), np.column_stack([static, left]), {
            "long_name": "share of the static strain energy", **one}),
        "strain_share": (dims, strain.reshape(*shape, -1).transpose(1, 0, 2), {
            "long_name": "share of the strain energy", **one}),
        "kinetic_share": (dims, kinetic.reshape(*shape, -1).transpose(1, 0, 2), {
            "long_name": "share of the kinetic energy", **one}),
        "natural_frequency": ("mode", modes.frequency_hz, {"long_name": "natural frequency", "units": "Hz"}),
        "parity": ("mode", np.asarray(parity(tip.mesh, tip.free_dofs, tip.mass, modes.shape), dtype=object), {
            "long_name": "behaviour under reflection in the mid-plane", **one}),
        "receptance": abs(response["receptance"]).assign_attrs(response["receptance"].attrs),
        "energy_error_bound": ((), float(answer.indicators(sweep_cases(scene, frequency))[
            "relative_energy_error_bound"][1].max()), {
            "long_name": "largest certified relative energy error of the answers", **one})},
        coords={"direction": list(DIRECTIONS), "mode": ("mode", np.arange(1, MODES + 1), {
            "long_name": "mode number", **one}), "carrier": [*map(str, range(1, MODES + 1)), RESIDUAL],
            "frequency": ("frequency", frequency, {"long_name": "excitation frequency", "units": "Hz"})},
        attrs={"fingertip": script.spoken(scene.body.fingertip)})


# ---- what is read off the results ---------------------------------------------------------------------------

def _first(share: xr.DataArray, count: int = 2) -> str:
    """The modes that carry most, with their shares; those below a twentieth are left out after the first."""
    modes = share.drop_sel(carrier=RESIDUAL)
    order = modes.argsort().values[::-1][:count]
    return words.listed([f"mode {modes['carrier'].values[k]} ({_percent(modes[k])})" for i, k in enumerate(order)
                         if i == 0 or float(modes[k]) > 0.05])


def findings(results: xr.Dataset) -> list[str]:
    """What carries each direction, at rest and at the peak; what modes leave; which a direction cannot drive."""
    static, strain = results["static_share"], results["strain_share"]
    whole = results["receptance"].sel(measure="whole")
    sentences = []
    for direction in DIRECTIONS:
        peak = float(whole.sel(direction=direction).idxmax("frequency"))
        sentences.append(
            f"{direction.capitalize()} force: at {peak:g} Hz, where the whole fingertip moves most, "
            f"{_first(strain.sel(direction=direction, frequency=peak))} carries the strain energy; at rest "
            f"{_first(static.sel(direction=direction))}, while "
            f"{_percent(static.sel(direction=direction, carrier=RESIDUAL))} lies beyond the "
            f"{results.sizes['mode']} modes kept.")
    left = strain.sel(carrier=RESIDUAL)
    spans = [f"{_percent(left.sel(direction=name).min())} to {_percent(left.sel(direction=name).max())} ({name})"
             for name in DIRECTIONS]
    sentences.append(f"From {float(results['frequency'].min()):g} to {float(results['frequency'].max()):g} Hz the kept "
                     f"modes leave {words.listed(spans)} of the strain energy: the local part of a patch load, which "
                     "superposition loses and load-dependent vectors carry.")
    largest = np.abs(results["participation"])
    silent = []
    for name in DIRECTIONS:
        numbers = results["mode"].values[(largest.sel(direction=name) < 1e-3 * largest.max()).values]
        silent.append(f"{name}: {words.listed([str(int(number)) for number in numbers]) or 'none'}")
    sentences.append(f"Modes that a direction does not drive, being of the other symmetry: {'; '.join(silent)}.")
    sentences.append("The answers behind these shares are within a certified "
                     f"{words.error(float(results['energy_error_bound']))} of the exact ones in the energy norm.")
    return sentences


def tables(results: xr.Dataset) -> list[str]:
    """Shares over direction and frequency by mode."""
    head = ["force", *(html.named(f"mode {int(mode)}", f"{float(f):.1f} Hz") for mode, f in zip(
        results["mode"].values, results["natural_frequency"].values, strict=True)), "left"]
    rows = []
    for direction in DIRECTIONS:
        share = results["static_share"].sel(direction=direction)
        rows.append(("headline", [html.named(direction, "static"), *(html.cell(_percent(v)) for v in share.values)]))
        for f in TABLED:
            share = results["strain_share"].sel(direction=direction).sel(frequency=f, method="nearest")
            rows.append(("", [html.named(direction, f"{float(share['frequency']):g} Hz"),
                              *(html.cell(_percent(v)) for v in share.values)]))
    rows += [("", [html.named(direction, "participation [N kg^-1/2]"), *(html.cell(
        f"{abs(v):.2f}") for v in results["participation"].sel(direction=direction).values), html.cell("")])
        for direction in DIRECTIONS]
    return [html.table("Share of the strain energy that each mode carries, and what the modes leave; below, the size "
                       "of each mode's participation.", head, rows)]


def _percent(value: float | xr.DataArray) -> str:
    return "0" if value < 5e-4 else f"{100 * float(value):.1f} %"


# ---- figures ------------------------------------------------------------------------------------------------

def draw(results: xr.Dataset) -> list[Figure]:
    """Static shares, shares over frequency, the residual."""
    return [_static(results), _over_frequency(results), _residual(results)]


def _static(results: xr.Dataset) -> Figure:
    share = results["static_share"]
    figure = sheet(3.5, "At rest the kept modes leave " + words.listed([
        f"{_percent(share.sel(direction=name, carrier=RESIDUAL))} ({name})" for name in DIRECTIONS])
        + " of the strain energy")
    axes = figure.subplots()
    norm = LogNorm(1e-3, 1.0)
    image = axes.imshow(np.maximum(share.values, 1e-9), norm=norm, cmap="cividis", aspect="auto")
    for (i, j), value in np.ndenumerate(share.values):
        axes.text(j, i, _percent(float(value)), ha="center", va="center", fontsize=8.5,
                  color="black" if value > 0.05 else "white")
    axes.set_xticks(range(share.sizes["carrier"]), [
        *(f"{int(m)}\n{f:.0f} Hz" for m, f in zip(results["mode"].values, results["natural_frequency"].values,
                                                  strict=True)), "left"])
    axes.set_yticks(range(len(DIRECTIONS)), DIRECTIONS)
    axes.set_xlabel("mode and its natural frequency")
    figure.colorbar(image, label="share of static\nstrain energy [-]")
    return Figure("static.png", figure, "Share of the strain energy of a steady patch force that each natural mode "
                  "carries; the last column is what all other modes carry together.",
                  "Heat map of static shares over mode")


def _over_frequency(results: xr.Dataset) -> Figure:
    strain = results["strain_share"]
    peaks = results["receptance"].sel(measure="whole").idxmax("frequency")
    figure = sheet(4.8, "What carries the strain energy at the resonances: " + "; ".join(
        f"{name} {_first(strain.sel(direction=name, frequency=float(peaks.sel(direction=name))), 1)}"
        for name in DIRECTIONS))
    axes = figure.subplots(1, 3, sharey=True)
    f, norm = results["frequency"].values, Normalize(0.0, 1.0)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        panel.pcolormesh(f, np.arange(strain.sizes["carrier"]), strain.sel(direction=direction).values.T, norm=norm,
                         cmap="cividis", shading="nearest")
        panel.plot(results["natural_frequency"], np.arange(results.sizes["mode"]), "|", color="white", markersize=13,
                   markeredgewidth=2, label="natural frequency")
        panel.set_xlim(f[0], f[-1])
        panel.set_title(direction, fontsize=10)
        panel.set_xlabel("frequency [Hz]")
    axes[0].set_yticks(range(strain.sizes["carrier"]), strain["carrier"].values)
    axes[0].set_ylabel("mode")
    figure.colorbar(ScalarMappable(norm, colormaps["cividis"]), ax=axes, label="share of strain energy [-]")
    return Figure("frequency.png", figure, "Share of the strain energy that each mode carries as the frequency rises; "
                  "white marks: natural frequencies; \"left\": what the kept modes leave.",
                  "Heat maps of strain energy share over frequency and mode")


def _residual(results: xr.Dataset) -> Figure:
    strain, kinetic = (results[name].sel(carrier=RESIDUAL) for name in ("strain_share", "kinetic_share"))
    figure = sheet(4.2, f"Beyond {results.sizes['mode']} modes lie up to {_percent(strain.max())} of the strain "
                   f"energy and {_percent(kinetic.max())} of the kinetic energy")
    axes = figure.subplots()
    tidy(axes)
    for direction, colour in zip(DIRECTIONS, ("#332288", "#CC6677", "#117733"), strict=True):
        for values, line, text in ((strain, "-", "strain"), (kinetic, (0, (4, 2)), "kinetic")):
            axes.semilogy(results["frequency"], values.sel(direction=direction), color=colour, linestyle=line,
                          label=f"{direction}, {text}")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("share of energy left by the modes [-]")
    legend_below(figure, [axes], columns=3)
    return Figure("residual.png", figure, "Energy that the kept modes leave to all others, as shares of the strain and "
                  "of the kinetic energy.", "Energy share beyond the kept modes over frequency")


if __name__ == "__main__":
    script.run(main, draw, findings, "modal-participation", tables=tables)
