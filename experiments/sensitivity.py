"""What decides the fingertip's natural frequencies and its answer to vibration: derivatives by all it is made from.

Natural frequencies by analytic and semi-analytic derivatives; the receptance of the nine-node patch through a reduced
model whose basis is held, checked by direct solves. Re-solved models check all parameters at once, along random
directions of relative change, and some one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import script
import xarray as xr
from analysis.receptance_sensitivity import receptance_sensitivity, reduced_receptance_sensitivity
from analysis.tissue_damped_rom import TissueDampedModel
from sensitivity_figures import draw, off_similarity, ranking, spoken

from rom.fingertip import DIRECTIONS, Fingertip
from rom.fullorder import Modes, SecondOrderModel
from rom.reporting import html, words
from rom.vibration.matrix_derivatives import projected_derivatives
from rom.vibration.parameters import parameters, with_parameter
from rom.vibration.resonance import highest_peak
from rom.vibration.sensitivity import frequency_sensitivity

MODES = 8
KEPT, VECTORS = 30, 4
"""Modes and load-dependent vectors of the reduced model of the frequency response."""
LOSS_FACTOR = 0.1
SWEEP = np.arange(5.0, 301.0)
POINTS = (50.0, 100.0, 150.0, 200.0, 250.0)
DIRECT = ("fingertip_height", "bone_length", "hypodermis.elastic_modulus", "dermis.density")
"""Parameters by which receptances are derived from direct solutions too."""
ONE_BY_ONE = ("fingertip_height", "hypodermis.poisson_ratio")
DIRECTIONS_CHECKED = 2
STEP = 3e-5
"""Of the finite differences, relative: small against the distance of close modes, above the eigenvalues' rounding."""
NEGLIGIBLE = 0.01


def main(quick: bool = False, progress: script.Progress = script.silent, seed: int = 0) -> xr.Dataset:
    """Which dimensions and tissue properties decide the natural frequencies and the frequency response?"""
    tip = script.fingertip(quick, "study")
    model = SecondOrderModel(tip.stiffness, tip.mass)
    kept = model.natural_modes(count=KEPT)
    modes = Modes(kept.eigenvalue[:MODES], kept.shape[:, :MODES], kept.residual[:MODES], kept.sturm_count,
                  kept.sturm_shift, kept.next_eigenvalue_bound)
    results = frequency_sensitivity(tip, modes)
    force = np.stack([tip.patch_force(tip.mesh.fingerprint_centroid, one) for one in DIRECTIONS], axis=1)
    results = results.merge(_responses(tip, model, kept, force))
    return results.merge(_check(tip, modes, results, progress, seed)).assign_attrs(
        formulation=tip.formulation, rear=tip.rear, loss_factor=LOSS_FACTOR)


def _responses(tip: Fingertip, model: SecondOrderModel, kept: Modes, force: np.ndarray) -> xr.Dataset:
    """Receptances of the patch and their derivatives over the sweep, and how far direct solutions differ."""
    reduced = TissueDampedModel(tip, kept, force, VECTORS, model=model)
    derivatives, three = projected_derivatives(tip, reduced.basis), len(DIRECTIONS)

    def derive(frequency: np.ndarray) -> xr.Dataset:
        y = np.concatenate(list(reduced.galerkin(frequency, LOSS_FACTOR)), axis=1)
        loads = np.tile(reduced.force, len(frequency))
        return reduced_receptance_sensitivity(derivatives, loads, y, np.repeat(frequency, three), LOSS_FACTOR)

    found = derive(SWEEP)
    curve = found["receptance"].values.reshape(-1, three).T
    tops = [highest_peak(SWEEP, one) for one in curve]
    peak = np.array([np.nan if top is None else top.frequency for top in tops])
    points = np.array([[np.nan if top is None else top.frequency, *POINTS] for top in tops])
    at_points = np.array([[_column(derive, f, d) for f in points[d]] for d in range(three)])
    direct = np.array([_direct(tip, model, force, derive, f) for f in (*POINTS[::2], *peak[:1][np.isfinite(peak[:1])])])
    one = {"units": "1"}
    cube = found["logarithmic"].values.reshape(found.sizes["parameter"], -1, three).transpose(0, 2, 1)
    loss = found["loss_factor_logarithmic"].sum("tissue").values.reshape(-1, three).T
    return xr.Dataset({
        "receptance": (("direction", "sweep"), curve, {"long_name": "receptance of the patch", "units": "m N-1"}),
        "response_logarithmic": (("parameter", "direction", "sweep"), cube, {
            "long_name": "relative change of receptance magnitude per relative change of parameter", **one}),
        "response_by_loss_factor": (("direction", "sweep"), loss, {
            "long_name": "relative change of receptance magnitude per relative change of all loss factors", **one}),
        "point_logarithmic": (("parameter", "direction", "point"), at_points[..., 1:].transpose(2, 0, 1), {
            "long_name": "relative change of receptance magnitude per relative change of parameter", **one}),
        "point_by_loss_factor": (("direction", "point"), at_points[..., 0], {
            "long_name": "relative change of receptance magnitude per relative change of all loss factors", **one}),
        "peak_frequency": ("direction", peak, {"long_name": "frequency of the highest peak", "units": "Hz"}),
        "direct_difference": (("direct_case", "direct_parameter", "direction"), direct, {
            "long_name": "reduced model's derivative of receptance against a direct solution's, relative", **one}),
    }, coords={"direction": list(DIRECTIONS), "sweep": ("sweep", SWEEP, {"long_name": "frequency", "units": "Hz"}),
               "point": ["peak", *(f"{f:.0f} Hz" for f in POINTS)], "direct_parameter": list(DIRECT),
               "parameter": found["parameter"].values})


def _column(derive, frequency: float, direction: int) -> np.ndarray:
    """Logarithmic derivatives at one frequency in one direction: by all loss factors, then by each parameter."""
    found = derive(np.array([frequency if np.isfinite(frequency) else SWEEP[0]])).isel(case=direction)
    column = np.append(found["loss_factor_logarithmic"].sum("tissue"), found["logarithmic"])
    return column if np.isfinite(frequency) else np.full_like(column, np.nan)


def _direct(tip: Fingertip, model: SecondOrderModel, force: np.ndarray, derive, frequency: float) -> np.ndarray:
    """(parameter, direction) ndarray: relative difference of reduced from direct derivatives."""
    u = model.solve_harmonic(force, frequency, LOSS_FACTOR)
    truth = receptance_sensitivity(tip, force, u, frequency, LOSS_FACTOR, names=DIRECT)["derivative"]
    other = derive(np.array([frequency]))["derivative"].sel(parameter=list(DIRECT))
    return (np.abs(other - truth) / np.abs(truth)).values


def _check(
    tip: Fingertip, modes: Modes, results: xr.Dataset, progress: script.Progress, seed: int
) -> xr.Dataset:
    """Central differences of re-solved natural frequencies against the derivatives."""
    rng, names = np.random.default_rng(seed), results["parameter"].values
    weights = {f"all at once, direction {i + 1}": rng.uniform(0.3, 1.0, len(names)) * rng.choice([-1, 1], len(names))
               for i in range(DIRECTIONS_CHECKED)}
    labels = dict(zip(names, results["parameter_label"].values, strict=True))
    weights |= {labels[name]: (names == name).astype(float) for name in ONE_BY_ONE}
    slope = np.array([_resolved(tip, modes, weight) for weight in progress(list(weights.values()), "re-solved models")])
    expected = np.array([weight @ results["logarithmic"].values for weight in weights.values()])
    return xr.Dataset({
        "check_slope": (("check", "mode"), slope, {
            "long_name": "logarithmic derivative of natural frequency by re-solving", "units": "1"}),
        "check_difference": (("check", "mode"), expected - slope, {
            "long_name": "derivative less the re-solved one", "units": "1"}),
    }, coords={"check": list(weights)})


def _resolved(tip: Fingertip, modes: Modes, weight: np.ndarray) -> np.ndarray:
    """(m,) ndarray: d ln f along a direction of relative changes; NaN if an element changes its tissue on any step."""
    for step in (STEP, STEP / 3, STEP / 9):
        ends = [tip, tip]
        for i, sign in enumerate((-1, 1)):
            for one, share in zip(parameters(tip), weight, strict=True):
                if share:
                    ends[i] = with_parameter(ends[i], one.name, one.value + sign * step * share * one.scale)
        if all(np.array_equal(end.mesh.tissue, tip.mesh.tissue) for end in ends):
            low, high = (_same_modes(end, modes, tip.mass) for end in ends)
            return np.log(high / low) / (2 * step)
    return np.full(modes.count, np.nan)


def _same_modes(other: Fingertip, modes: Modes, mass: Any) -> np.ndarray:
    """(m,) ndarray [Hz]: another fingertip's modes in the order of these, by their shapes, as close ones may cross."""
    found = SecondOrderModel(other.stiffness, other.mass).natural_modes(count=modes.count + 2)
    return found.frequency_hz[np.abs(modes.shape.T @ (mass @ found.shape)).argmax(axis=1)]


def findings(results: xr.Dataset) -> list[str]:
    """What matters, what hardly does, and how far the numbers can be trusted."""
    first, modes = results["logarithmic"].sel(mode=1), results.sizes["mode"]
    peaks = results["peak_frequency"]

    def told(kind: str, count: int) -> str:
        some = ranking(first.where(results["parameter_kind"] == kind, drop=True))[:count]
        return words.listed([f"{float(one):+.2f} % ({spoken(one)})" for one in some])

    largest = np.abs(results["logarithmic"]).max("mode")
    small = [spoken(one) for one in largest if one < NEGLIGIBLE]
    assumed = ranking(largest.where(results["parameter_kind"] == "assumption", drop=True))[0]
    lines = [
        f"1 % more of a dimension changes the first natural frequency by {told('dimension', 4)}; of a tissue's "
        f"property, by {told('property', 4)}.",
        f"1 % more {words.listed(small)} changes none of the first {modes} natural frequencies by {NEGLIGIBLE:g} %."
        if small else f"1 % more of any parameter changes one of the first {modes} frequencies by {NEGLIGIBLE:g} %.",
        f"Of the declared assumptions about the surfaces {spoken(assumed)} matters most: 1 % of it changes one of "
        f"these frequencies by {float(assumed):.2f} %.",
    ]
    for direction in results["direction"].values:
        peak = results["point_logarithmic"].sel(direction=direction, point="peak")
        if np.isfinite(peak).all():
            top = words.listed([f"{float(one):+.2f} % ({spoken(one)})" for one in ranking(peak)[:3]])
            loss = float(results["point_by_loss_factor"].sel(direction=direction, point="peak"))
            where = float(peaks.sel(direction=direction))
            lines.append(f"1 % more loss factor changes the height of the {direction} peak at {where:.1f} Hz by "
                         f"{loss:+.2f} %; 1 % more of another parameter, by {top}.")
    sums = off_similarity(results)
    lines.append(
        "By similarity, logarithmic derivatives add up to 1/2 over moduli, -1/2 over densities and -1 over lengths; "
        "they are off by " + words.listed([f"{words.power(value)} ({name})" for name, value in sums.items()]) + ".")
    difference = np.abs(results["check_difference"]) / np.abs(results["check_slope"]).max("mode")
    checked = int(np.isfinite(difference).all("mode").sum())
    across = results.sizes["check"] - checked
    lines.append(
        f"Against models re-solved along {words.plural(checked, 'direction')} of change no derivative of a frequency "
        f"is off by more than {words.power(float(difference.max()))} of the largest along its direction"
        + (f" ({across} more would carry an element across the nail's edge)" if across else "")
        + "; the reduced model's derivatives of receptance differ from direct solutions' by at most "
        f"{words.error(float(results['direct_difference'].max()))}.")
    lines.append(
        "Every derivative holds each element's tissue. The nail's edge runs along elements, so nail width acts through "
        "the curvature of the dorsal surface only, and the nail widens with the fingertip.")
    return lines


def tables(results: xr.Dataset) -> list[str]:
    """Every derivative of every frequency."""
    head = ["parameter", "value", *(f"mode {m}" for m in results["mode"].values)]
    rows = []
    for one in ranking(np.abs(results["logarithmic"]).max("mode")):
        name = one["parameter"].item()
        unit, log = one["parameter_unit"].item(), results["logarithmic"].sel(parameter=name).values
        derivative, value = results["derivative"].sel(parameter=name).values, float(one["parameter_value"])
        cells = [html.cell(f"{a:+.3f}", f"{b:+.3g} Hz/{'1' if unit == '-' else unit}")
                 for a, b in zip(log, derivative, strict=True)]
        rows.append(("", [one["parameter_label"].item(), html.cell(f"{value:.4g} {unit.strip('-')}"), *cells]))
    return [html.table("Per cent of natural frequency per cent of the parameter (of one unit, where it is zero), and "
                       "the derivative itself; sorted by the largest", head, rows)]


if __name__ == "__main__":
    script.run(main, draw, findings, "sensitivity", tables=tables)
