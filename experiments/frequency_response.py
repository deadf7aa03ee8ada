"""Frequency response of the finger pad to 0.1 N over nine nodes: direct solves against modal superposition.

As published (Serhat and Kuchenbecker 2021, section 5.2): 1-260 Hz by 1 Hz, three directions, loss factor 0.1. Direct
solves share a factorization among the three forces of a frequency and are kept in the cache, so that a killed run goes
on. Every modal answer is held against them at every frequency and node, block by block.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
import script
import xarray as xr
from frequency_response_figures import DIRECT, ERROR_BAR, draw, hertz

from rom.datasets import read_dataset, solve_dataset
from rom.fingertip import DIRECTIONS
from rom.metamodels import create
from rom.metamodels.metamodel import Metamodel
from rom.provenance import machine
from rom.relative import relative_errors
from rom.reporting import html, palette, words
from rom.scenes import LinearScene, get_scene
from rom.vibration.frequency_response import (
    BLOCK,
    MEASURES,
    frequency_response,
    magnitudes,
    receptances,
    response_dataset,
    sweep_cases,
)
from rom.vibration.published import published
from rom.vibration.resonance import highest_peak

FREQUENCIES = np.arange(1.0, 261.0)
MODELS: dict[str, dict[str, Any]] = {
    "modal": {"modes": 12}, "modal-static": {"modes": 12}, "modal-krylov": {"modes": 12, "vectors": 10}}
"""Three loads ask for few vectors; twelve modes reach beyond the band. Fewer of either cost accuracy, not time."""
SPEED_BAR = 100.0
PEAK_BAR = 0.03
"""Distance from a published peak that still counts as met."""
REPEATS = 3
DIRECT_TIMED = 9
"""Frequencies at which the direct solver is timed, between the repeats of the others; its sweep is their median times
the number of frequencies."""


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How does the fingertip answer to vibration of its pad, and what does it cost to know?"""
    scene = get_scene("harmonic-patch-forces", script.fingertip(quick, "study"))
    frequency = FREQUENCIES[9::10] if quick else FREQUENCIES
    path = solve_dataset(scene, sweep_cases(scene, frequency), progress=lambda items: progress(items, "direct solves"))
    models: dict[str, Metamodel] = {}
    for name, settings in progress([(DIRECT, {}), *MODELS.items()], "offline"):
        # a scene of its own, so that no method finds another's factorization
        models[name] = create(name, scene.afresh(), **settings).fit()
    responses = {DIRECT: _stored_response(scene, path, frequency)}
    error = {DIRECT: np.zeros((2, 3 * len(frequency)))}
    for name in progress(list(MODELS), "sweeps"):
        responses[name], error[name] = _checked_response(models[name], path, frequency)
    seconds, direct_seconds = _times(models, frequency)
    results = xr.concat([responses[name] for name in models], xr.Variable(
        "method", list(models), {"long_name": "method"}), combine_attrs="override")
    fields = np.stack([error[name] for name in models]).reshape(len(models), 2, len(frequency), len(DIRECTIONS))
    one, metre = {"units": "1"}, {"units": "m N-1"}
    results = results.assign({
        "static_receptance": (("method", "direction", "measure"), np.stack([
            abs(frequency_response(model, [0.0])["receptance"].values[:, 0]) for model in models.values()]), {
            "long_name": "magnitude of the receptance at 0 Hz, loss factor included", **metre}),
        "error_over_frequency": (("method", "direction", "frequency"), fields[:, 0].transpose(0, 2, 1), {
            "long_name": "relative error of the full field against the direct solve", **one}),
        "node_error_over_frequency": (("method", "direction", "frequency"), fields[:, 1].transpose(0, 2, 1), {
            "long_name": "largest error at any node over the largest displacement of the case", **one}),
        "error_max": ("method", fields[:, 0].max(axis=(1, 2)), {
            "long_name": "largest relative error of the full field over frequencies and directions", **one}),
        "node_error_max": ("method", fields[:, 1].max(axis=(1, 2)), {
            "long_name": "largest error at any node over the largest displacement, all cases", **one}),
        "sweep_seconds": (("method", "repeat"), seconds, {
            "long_name": f"wall time of the whole sweep online; {DIRECT}: median of some frequencies times all",
            "units": "s"}),
        "direct_seconds": ("timed", direct_seconds, {
            "long_name": "wall time of one frequency, three forces, by direct solve", "units": "s"}),
        "offline_seconds": ("method", [model.offline_seconds for model in models.values()], {
            "long_name": "wall time before the first answer, matrices given", "units": "s"}),
        "natural_frequency": ("mode", scene.model.natural_modes(
            below_hz=scene.band_hz).frequency_hz, {"long_name": "natural frequency", "units": "Hz"})})
    figures = published()["digitip"]["frequency_response"]
    results["published_peak"] = ("direction", [figures["peak_normal_hz_about"], figures["peak_radial_ulnar_hz"],
                                               figures["peak_distal_proximal_hz"]], {
        "long_name": "published frequency of the peak", "units": "Hz"})
    results = results.assign({**_speed(results), **_resonances(results)})
    results.attrs = {
        "formulation": scene.body.fingertip.formulation, "n_free": scene.n_free, "machine": machine(),
        "fingertip": script.spoken(scene.body.fingertip),
        "settings": "; ".join(f"{name}: " + ", ".join(f"{n} {k}" for k, n in s.items()) for name, s in MODELS.items())}
    return results


def _stored_response(scene: LinearScene, path, frequency: np.ndarray) -> xr.Dataset:
    """Receptances of the stored direct solves."""
    cases = sweep_cases(scene, frequency)
    receptance, driving = np.empty((len(cases), len(MEASURES)), dtype=complex), np.empty(len(cases), dtype=complex)
    for first in range(0, len(cases), BLOCK):
        part = slice(first, min(first + BLOCK, len(cases)))
        receptance[part], driving[part] = receptances(scene, cases.take(part), _truth(scene, path, part))
    return response_dataset(frequency, DIRECTIONS, receptance, driving)


def _truth(scene: LinearScene, path, part: slice) -> np.ndarray:
    return scene.values(read_dataset(path, part))


def _checked_response(model: Metamodel, path, frequency: np.ndarray) -> tuple[xr.Dataset, np.ndarray]:
    """Receptances of a model, and its errors (field or worst node, case) against the stored direct solves."""
    error = np.empty((2, 3 * len(frequency)))

    def compare(part: slice, field: np.ndarray) -> None:
        truth = _truth(model.scene, path, part)
        error[0, part] = relative_errors(field, truth)
        error[1, part] = magnitudes(field - truth).max(axis=1) / magnitudes(truth).max(axis=1)

    return frequency_response(model, frequency, watch=compare).drop_vars("sweep_seconds"), error


def _times(models: dict[str, Metamodel], frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(method, repeat) seconds of a whole sweep, and (timed,) seconds of a frequency by direct solve; interleaved."""
    timed = np.linspace(0, len(frequency) - 1, DIRECT_TIMED).astype(int)
    cases = sweep_cases(models[DIRECT].scene, frequency)
    seconds, direct = np.empty((len(models), REPEATS)), []
    for repeat in range(REPEATS):
        for i, (name, model) in enumerate(models.items()):
            if name != DIRECT:
                seconds[i, repeat] = float(frequency_response(model, frequency)["sweep_seconds"])
                continue
            for k in timed[repeat::REPEATS]:
                start = perf_counter()
                model.evaluate(cases.take(slice(3 * k, 3 * k + 3)), "field")
                direct.append(perf_counter() - start)
    for repeat in range(REPEATS):
        seconds[list(models).index(DIRECT), repeat] = np.median(direct[repeat::REPEATS]) * len(frequency)
    return seconds, np.array(direct)


def _speed(results: xr.Dataset) -> dict[str, tuple]:
    online = results["sweep_seconds"].median("repeat")
    whole = online + results["offline_seconds"]
    return {
        "speedup": ("method", (online.sel({"method": DIRECT}) / online).values, {
            "long_name": "direct sweep over this one, online", "units": "1"}),
        "speedup_offline": ("method", (whole.sel({"method": DIRECT}) / whole).values, {
            "long_name": "direct sweep over this one, offline stages included", "units": "1"})}


def _resonances(results: xr.Dataset) -> dict[str, tuple]:
    """Highest peak of each curve: frequency, loss factor of its half-power width, height over the static receptance."""
    found = np.full((3, results.sizes["method"], len(DIRECTIONS), len(MEASURES)), np.nan)
    for index in np.ndindex(found.shape[1:]):
        method, direction, measure = index
        curve = abs(results["receptance"].values[method, direction, :, measure])
        peak = highest_peak(results["frequency"].values, curve)
        if peak is not None:
            static = results["static_receptance"].values[index]
            found[(slice(None), *index)] = peak.frequency, peak.height / static, peak.loss_factor
    dims = ("method", "direction", "measure")
    return {"peak_frequency": (dims, found[0], {"long_name": "frequency of the highest peak", "units": "Hz"}),
            "amplification": (dims, found[1], {"long_name": "receptance at the highest peak over the static one",
                                               "units": "1"}),
            "peak_loss_factor": (dims, found[2], {"long_name": "loss factor of the half-power width", "units": "1"})}


# ---- what is read off the results ---------------------------------------------------------------------------

def findings(results: xr.Dataset) -> list[str]:
    """Error and speed of the chosen method against their bars; peaks against the published ones; what tangents do."""
    best, direct = results.sel({"method": "modal-krylov"}), results.sel({"method": DIRECT})
    error = max(float(best["error_max"]), float(best["node_error_max"]))
    met = error <= ERROR_BAR and float(best["speedup"]) >= SPEED_BAR
    n = results.sizes["frequency"]
    sentences = [
        f"`modal-krylov` stays within {words.error(float(best['error_max']))} of direct solves over {n} frequencies "
        f"and three directions, within {words.error(float(best['node_error_max']))} at the worst node; its sweep takes "
        f"{words.seconds(_sweep(best))} against {words.seconds(_sweep(direct))}: {words.ratio(float(best['speedup']))} "
        f"faster online, {words.ratio(float(best['speedup_offline']))} with its offline stage of "
        f"{words.seconds(float(best['offline_seconds']))}. The bars ({words.error(ERROR_BAR)}, {SPEED_BAR:g} times "
        f"online) are {'met' if met else 'not met'}."]
    for measure, text in (("excitation", "of the loaded nodes"), ("whole", "of all moving nodes")):
        peaks = direct["peak_frequency"].sel(measure=measure)
        told, beyond = [], []
        for name in ("radial-ulnar", "distal-proximal", "normal"):
            peak, printed = (float(values.sel(direction=name)) for values in (peaks, results["published_peak"]))
            told.append(f"{name} {hertz(peak)} ({100 * (peak / printed - 1):+.1f} % from "
                        f"{'about ' if name == 'normal' else ''}{printed:g})")
            if not abs(peak / printed - 1) <= PEAK_BAR:
                beyond.append(name)
        verdict = f"all within {100 * PEAK_BAR:g} %" if not beyond else (
            f"beyond {100 * PEAK_BAR:g} %: {words.listed(beyond)}")
        sentences.append(f"Highest peaks {text}: {words.listed(told)}; {verdict}.")
    gain = direct["amplification"].sel(measure="excitation")
    values = {name: float(gain.sel(direction=name)) for name in DIRECTIONS}
    more = min(values["radial-ulnar"], values["distal-proximal"]) > values["normal"]
    sentences.append("At its highest peak the loaded patch moves " + words.listed([
        f"{value:.2f} times ({name})" for name, value in values.items()]) + " as far as at 0 Hz: tangential "
        f"amplification {'exceeds' if more else 'does not exceed'} normal amplification, as published"
        f"{'' if more else ' otherwise'}.")
    normal = abs(direct["receptance"].sel(direction="normal", measure="whole"))
    where, excess = _rise(results["frequency"].values, normal.values)
    sentences.append(f"Under normal force the mean over all nodes rises {100 * excess:.1f} % above its chord from "
                     f"{RISE[0]:g} to {RISE[1]:g} Hz, most at {hertz(where)} (published: a slight rise near 160 Hz).")
    left = [f"{words.error(float(one['error_max']))} (`{one['method'].item()}`)"
            for one in (results.sel({"method": name}) for name in ("modal", "modal-static"))]
    sentences.append(f"Modes alone leave {words.listed(left)}; settings: {results.attrs['settings']}.")
    return sentences


RISE = (135.0, 185.0)
"""Ends of the chord above which the normal response is said to rise [Hz]."""


def _rise(frequency: np.ndarray, response: np.ndarray) -> tuple[float, float]:
    """Where a response stands highest above its chord over `RISE` [Hz], and by how much of it."""
    inside = (frequency >= RISE[0]) & (frequency <= RISE[1])
    f, x = frequency[inside], response[inside]
    excess = x / np.interp(f, f[[0, -1]], x[[0, -1]]) - 1
    return float(f[np.argmax(excess)]), float(excess.max())


def _sweep(one: xr.Dataset) -> float:
    return float(one["sweep_seconds"].median())


def tables(results: xr.Dataset) -> list[str]:
    """Methods: errors and times; directions: peaks."""
    rows = []
    for name in results["method"].values:
        one = results.sel({"method": name})
        rows.append(("", [html.named(name, "", palette.style(name).colour), *(html.cell(text) for text in (
            "truth" if name == DIRECT else words.error(float(one["error_max"])),
            "truth" if name == DIRECT else words.error(float(one["node_error_max"])), words.seconds(_sweep(one)),
            words.seconds(float(one["offline_seconds"])), words.ratio(float(one["speedup"])),
            words.ratio(float(one["speedup_offline"]))))]))
    head = ["method", "largest error of the field", "at any node", "sweep, online", "offline", "speed-up online",
            "with offline"]
    found = [html.table("Whole sweep: three directions at every frequency.", head, rows)]
    direct = results.sel({"method": DIRECT})
    rows = []
    for direction in DIRECTIONS:
        for measure in MEASURES:
            one = direct.sel(direction=direction, measure=measure)
            rows.append(("", [html.named(direction, measure), *(html.cell(text) for text in (
                hertz(float(one["peak_frequency"])), f"{float(one['published_peak']):g} Hz",
                f"{float(one['amplification']):.2f}", f"{float(one['peak_loss_factor']):.3f}",
                f"{1e6 * float(one['static_receptance']):.1f} µm/N"))]))
    return [*found, html.table("Highest peaks by direct solves; a missing half-power side gives no loss factor.",
                               ["force", "peak", "published", "over 0 Hz", "half-power loss factor", "at 0 Hz"], rows)]


if __name__ == "__main__":
    script.run(main, draw, findings, "frequency-response", tables=tables)
