"""A loss factor for each tissue: what it does to the response of the pad, and which reduced model still tells it.

Direct solutions are the truth at some frequencies, for several contrasts between the tissues' loss factors, from equal
to strong, at one mean modal loss factor. One reduced basis, prepared for two of them, answers all by Galerkin
projection; the real-mode model keeps of the projected losses only what each vector does to itself: its loss factor.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
import script
import xarray as xr
from analysis.tissue_damped_rom import TissueDampedModel
from analysis.tissue_damping import (
    ASSUMED_LOSS_FACTORS,
    damped_model,
    loss_factors,
    modal_loss_factors,
    strain_energy_shares,
    with_contrast,
)
from tissue_loss_factors_figures import METHODS, draw, highest

from rom.fingertip import DIRECTIONS
from rom.fingertip.anatomy import TISSUES
from rom.fullorder import Modes, SecondOrderModel
from rom.relative import relative_errors
from rom.reporting import html, words

CONTRASTS = (0.0, 0.5, 1.0, 1.5, 2.0)
ASSUMED = CONTRASTS.index(1.0)
PREPARED = (1.0, 2.0)
"""Contrasts whose loss factors the basis is prepared for; the others test it elsewhere."""
MODES, VECTORS = 20, 3
SHOWN = 8
SWEEP = np.arange(5.0, 301.0)
SPACING = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
"""Frequencies of the direct solutions, beside the first two natural frequencies."""
REPEATS = 5


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How does the pad vibrate if each tissue has a loss factor of its own, and which reduced model tells it?"""
    tip = script.fingertip(quick, "study")
    force = np.stack([tip.patch_force(tip.mesh.fingerprint_centroid, one) for one in DIRECTIONS], axis=1)
    model = SecondOrderModel(tip.stiffness, tip.mass)
    modes = model.natural_modes(count=MODES)
    shown = Modes(modes.eigenvalue[:SHOWN], modes.shape[:, :SHOWN], modes.residual[:SHOWN], modes.sturm_count,
                  modes.sturm_shift, modes.next_eigenvalue_bound)
    sets = _of_one_level(strain_energy_shares(tip, shown).mean(axis=1))
    begin = perf_counter()
    reduced = TissueDampedModel(tip, modes, force, VECTORS, [sets[CONTRASTS.index(c)] for c in PREPARED], model)
    offline = perf_counter() - begin

    frequency = np.sort(np.append(SPACING, modes.frequency_hz[:2]))
    error = np.empty((len(METHODS), len(CONTRASTS), len(frequency), len(DIRECTIONS)))
    at = np.empty(error.shape[1:], dtype=np.complex128)
    curve = np.empty((len(METHODS), len(CONTRASTS), len(SWEEP), len(DIRECTIONS)), dtype=np.complex128)
    seconds = np.empty((len(METHODS) + 1, REPEATS))
    for i, loss in enumerate(progress(sets, "contrasts")):
        direct = damped_model(tip, loss)
        answers = {name: getattr(reduced, name) for name in METHODS}
        for k, answer in enumerate(answers.values()):
            curve[k, i] = reduced.receptance(answer(SWEEP, loss))
        for j, one in enumerate(frequency):
            truth = direct.solve_harmonic(force, one, 0.0)
            at[i, j] = np.sum(force * truth, axis=0)
            for k, answer in enumerate(answers.values()):
                error[k, i, j] = relative_errors(reduced.field(answer([one], loss)[0]).T, truth.T)
        if i == ASSUMED:
            for r in range(REPEATS):  # interleaved, each at another frequency, three loads and their full fields
                one = frequency[r % len(frequency)] + 0.5
                seconds[0, r] = _time(lambda f, do=direct: do.solve_harmonic(force, f, 0.0), one)
                for k, answer in enumerate(answers.values()):
                    seconds[k + 1, r] = _time(lambda f, do=answer, eta=loss: reduced.field(do([f], eta)[0]), one)
    by_contrast = np.array([modal_loss_factors(tip, shown, loss).sum("tissue") for loss in sets])
    one, receptance = {"units": "1"}, {"long_name": "receptance of the patch", "units": "m N-1"}
    return xr.Dataset({
        "loss_factor": (("contrast", "tissue"), np.array([list(loss.values()) for loss in sets]), {
            "long_name": "loss factor of the tissue", **one}),
        "modal_loss_factor": (("tissue", "mode"), modal_loss_factors(tip, shown, sets[ASSUMED]).values, {
            "long_name": "share of a tissue in the mode's loss factor, as assumed", **one}),
        "modal_loss_factor_by_contrast": (("contrast", "mode"), by_contrast, {
            "long_name": "modal loss factor", **one}),
        "natural_frequency": ("mode", shown.frequency_hz, {"long_name": "natural frequency", "units": "Hz"}),
        "receptance": (("model", "contrast", "sweep", "direction"), curve, receptance),
        "direct_receptance": (("contrast", "frequency", "direction"), at, receptance),
        "error": (("model", "contrast", "frequency", "direction"), error, {
            "long_name": "relative error of the full field against the direct solution", **one}),
        "seconds": (("timed", "repeat"), seconds, {
            "long_name": "wall time of three loads at one frequency, full fields", "units": "s"}),
        "offline_seconds": ((), offline, {
            "long_name": "wall time of basis and projection, modes given", "units": "s"}),
        "vectors": ((), reduced.size, {"long_name": "vectors of the reduced basis", **one}),
    }, coords={"contrast": ("contrast", list(CONTRASTS), {
                   "long_name": "exponent of the ratios between tissues", **one}),
               "prepared": ("contrast", np.isin(CONTRASTS, PREPARED).astype(int), {
                   "long_name": "1 where the basis was prepared for these loss factors", **one}),
               "tissue": list(TISSUES), "mode": np.arange(1, SHOWN + 1), "model": list(METHODS),
               "timed": ["direct", *METHODS], "direction": list(DIRECTIONS),
               "frequency": ("frequency", frequency, {"long_name": "frequency", "units": "Hz"}),
               "sweep": ("sweep", SWEEP, {"long_name": "frequency", "units": "Hz"})},
        attrs={"formulation": tip.formulation, "rear": tip.rear, "modes": MODES})


def _of_one_level(share: np.ndarray) -> list[dict[str, float]]:
    """Loss factors by contrast, scaled to one mean modal loss factor, so that nothing but their ratios changes."""
    level = share @ loss_factors(ASSUMED_LOSS_FACTORS)
    sets = [with_contrast(ASSUMED_LOSS_FACTORS, contrast) for contrast in CONTRASTS]
    return [{name: value * level / (share @ loss_factors(one)) for name, value in one.items()} for one in sets]


def _time(call, frequency: float) -> float:
    begin = perf_counter()
    call(frequency)
    return perf_counter() - begin


def findings(results: xr.Dataset) -> list[str]:
    """What real modes lose, what Galerkin keeps, what modes make of the tissues' loss factors, and the cost."""
    worst, seconds = results["error"].max(("frequency", "direction")), results["seconds"].median("repeat")
    assumed, strong = {"contrast": 1.0}, {"contrast": float(results["contrast"].max())}
    galerkin, real = (worst.sel(model=name) for name in METHODS)
    unseen = galerkin.where(results["prepared"] == 0, drop=True)
    eta = results["modal_loss_factor"].sum("tissue")
    share = results["modal_loss_factor"] / eta
    main_tissue = share.mean("mode").idxmax("tissue").item()
    ratio = results["loss_factor"].max("tissue") / results["loss_factor"].min("tissue")
    loss = results["loss_factor"].sel(assumed)

    def told(value: xr.DataArray) -> str:
        return words.error(float(value))

    lines = [
        f"With the assumed loss factors ({float(ratio.sel(assumed)):.1f} to 1 between tissues) uncoupled real modes "
        f"miss the field by up to {told(real.sel(assumed))}, at {float(ratio.sel(strong)):.0f} to 1 by up to "
        f"{told(real.sel(strong))}; with equal ones by {told(real.sel(contrast=0.0))}, the truncation that the basis "
        "leaves to either model.",
        f"Galerkin on the same {int(results['vectors'])} vectors stays within {told(galerkin.max())} at every "
        f"contrast, {told(unseen.max())} where the basis was not prepared for the loss factors.",
        f"The assumed loss factors, {float(loss.min()):.2g} to {float(loss.max()):.2g}, give the first {eta.size} "
        f"modes {float(eta.min()):.3f} to {float(eta.max()):.3f}; on average "
        f"{told(share.sel(tissue=main_tissue).mean())} of it comes from the {main_tissue.replace('_', ' ')}. Published "
        "is one measured number for the whole pad, 0.1.",
    ]
    peaks = [f"{a[0]:.1f} to {b[0]:.1f} Hz and change by {100 * (b[1] / a[1] - 1):+.1f} % ({name})"
             for name in results["direction"].values
             for a, b in [(highest(results, 0.0, name), highest(results, strong["contrast"], name))]
             if np.isfinite([a, b]).all()]
    if peaks:
        lines.append("From equal loss factors to the strongest contrast, at one mean modal loss factor, the highest "
                     f"peaks move from {words.listed(peaks)}.")
    direct = float(seconds.sel(timed="direct"))
    fast = [f"{METHODS[name]} {words.seconds(float(seconds.sel(timed=name)))}" for name in METHODS]
    lines.append(
        f"Three loads at one frequency, full fields: direct {words.seconds(direct)}, {'; '.join(fast)}"
        f"; the basis takes {words.seconds(float(results['offline_seconds']))} once the modes are known.")
    return lines


def tables(results: xr.Dataset) -> list[str]:
    """Loss factors, and errors by contrast."""
    contrast = [f"contrast {c:g}" for c in results["contrast"].values]
    loss = [("", [name.replace("_", " "), *(html.cell(f"{v:.3f}") for v in one.values)])
            for name, one in zip(results["tissue"].values, results["loss_factor"].T, strict=True)]
    worst = results["error"].max(("frequency", "direction"))
    rows = [("", [METHODS[name], *(html.cell(words.error(float(v))) for v in worst.sel(model=name).values)])
            for name in METHODS]
    eta = results["modal_loss_factor_by_contrast"]
    modal = [("", [f"mode {m}, {float(f):.1f} Hz", *(html.cell(f"{v:.3f}") for v in eta.sel(mode=m).values)])
             for m, f in zip(results["mode"].values, results["natural_frequency"].values, strict=True)]
    return [html.table("Loss factors of the tissues: assumptions, drawn together and spread apart",
                       ["tissue", *contrast], loss),
            html.table("Largest relative error of the field over frequencies and directions", ["model", *contrast],
                       rows),
            html.table("Modal loss factors by strain energy", ["mode", *contrast], modal)]


if __name__ == "__main__":
    script.run(main, draw, findings, "tissue-loss-factors", tables=tables)
