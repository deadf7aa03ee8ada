"""Two harmonic forces at once, their phase difference swept: what they add up to, and who feeds whom.

The response is linear, so amplitudes add as phasors. Powers do not: with equal forces F on two patches whose
receptances are H11, H22 and, by reciprocity, H12 = H21, the mean power put in by both is that of each alone plus
``- omega F^2 Im(H12) cos(phase)``, and ``omega F^2 Re(H12) sin(phase) / 2`` flows from the second force to the first.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import script
import xarray as xr
from analysis.motion import ellipse_axes, travelling_index
from several_forces_figures import draw

from rom.datasets import read_dataset, solve_dataset
from rom.metamodels import create
from rom.relative import relative_errors
from rom.reporting import html, words
from rom.scenes import CaseArrays, LinearScene, get_scene

FREQUENCIES = (50.0, 100.0, 150.0, 200.0, 250.0)
APART = 3e-3
"""Distance of a pair's patches from the fingerprint centroid [m]: they stand 6 mm apart."""
FORCE, LOSS_FACTOR = 0.1, 0.1
SETTINGS = {"modes": 12, "vectors": 10}
LAYOUTS = {
    "side by side": (("left", "normal"), ("right", "normal")),
    "one behind the other": (("proximal", "normal"), ("distal", "normal")),
    "crossed at one patch": (("centre", "radial-ulnar"), ("centre", "distal-proximal"))}
CHECKED = (0.0, 90.0, 180.0, 270.0)
"""Phases [degree] at which answers are held against direct solves, and whose fields are kept."""


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """What do two vibrating forces do together, as their phase difference goes once around?"""
    tip = script.fingertip(quick, "study")
    places = _places(tip.mesh)
    scene = get_scene("harmonic-patch-forces", tip, sites=tuple(places.values()))
    phase = np.arange(0.0, 361.0, 30.0 if quick else 10.0)
    checked = np.searchsorted(phase, CHECKED)
    truth = read_dataset(solve_dataset(scene, _cases(scene, places, np.array(CHECKED)),
                                       progress=lambda items: progress(items, "direct solves")))
    model = create("modal-krylov", scene, **SETTINGS).fit()
    mesh, full = tip.mesh, scene.model
    n_layout, n_frequency, shape = len(LAYOUTS), len(FREQUENCIES), (len(LAYOUTS), len(FREQUENCIES), len(phase))
    major, minor, pad_mean, index, lost = (np.empty(shape) for _ in range(5))
    given, alone = np.empty((*shape, 2)), np.empty((n_layout, n_frequency, 2, 2))
    field = np.empty((n_layout, n_frequency, len(CHECKED), len(mesh.skin_nodes), 3), dtype=complex)
    error = np.empty((n_layout, n_frequency, len(CHECKED)))
    arrays, exact = _cases(scene, places, phase), scene.values(truth).reshape(*error.shape, -1)
    blocks = [(i, j) for i in range(n_layout) for j in range(n_frequency)]
    for i, j in progress(blocks, "phases"):
        start = (i * n_frequency + j) * len(phase)
        block = arrays.take(slice(start, start + len(phase)))
        f = FREQUENCIES[j]
        values = model.evaluate(block, "field")
        nodal = scene.whole(values)
        at, pad = nodal[:, mesh.fingerprint_centroid], nodal[:, mesh.pad_nodes]
        major[i, j], minor[i, j] = ellipse_axes(at)
        pad_mean[i, j] = ellipse_axes(pad)[0].mean(axis=1)
        index[i, j] = travelling_index(pad.reshape(len(phase), -1))
        lost[i, j] = full.dissipated_power(values.T, f, LOSS_FACTOR)
        unit = scene.unit_loads[:, block.node[0]]
        given[i, j] = _power_given(block.force, values @ unit, f)
        single = model.evaluate(CaseArrays(block.node[:1].T, np.full((2, 1), FORCE), np.full(2, f),
                                           np.full(2, LOSS_FACTOR)), "field")
        alone[i, j, :, 0] = ellipse_axes(scene.whole(single)[:, mesh.fingerprint_centroid])[0]
        alone[i, j, :, 1] = full.dissipated_power(single.T, f, LOSS_FACTOR)
        field[i, j] = nodal[checked][:, mesh.skin_nodes]
        error[i, j] = relative_errors(values[checked], exact[i, j])
    dims = ("layout", "frequency", "phase")
    metre, watt, one = {"units": "m"}, {"units": "W"}, {"units": "1"}
    return xr.Dataset({
        "peak_displacement": (dims, major, {"long_name": "largest displacement of the fingerprint centroid within a "
                                                         "cycle", **metre}),
        "minor_axis": (dims, minor, {"long_name": "smaller semi-axis of the ellipse that it runs through", **metre}),
        "pad_displacement": (dims, pad_mean, {"long_name": "largest displacement within a cycle, mean over the pad's "
                                                           "nodes", **metre}),
        "travelling_index": (dims, index, {"long_name": "travelling index of the pad's motion", **one}),
        "dissipated_power": (dims, lost, {"long_name": "mean power lost to damping", **watt}),
        "input_power": ((*dims, "force"), given, {"long_name": "mean power put in by a force", **watt}),
        "alone_displacement": (("layout", "frequency", "force"), alone[..., 0], {
            "long_name": "the centroid's largest displacement under one of the forces", **metre}),
        "alone_power": (("layout", "frequency", "force"), alone[..., 1], {
            "long_name": "mean power lost under one of the forces", **watt}),
        "error": (("layout", "frequency", "checked_phase"), error, {
            "long_name": "relative error of the field against the direct solve", **one}),
        "skin_displacement": (("layout", "frequency", "checked_phase", "skin_node", "component"), field, {
            "long_name": "displacement amplitude of the skin", **metre}),
        "load_node": (("layout", "force"), np.array([[np.searchsorted(mesh.skin_nodes, places[place]) for place, _ in
                                                      forces] for forces in LAYOUTS.values()]), {
            "long_name": "skin node at the centre of the loaded patch", **one}),
        "skin_quads": (("quad", "corner"), np.searchsorted(mesh.skin_nodes, mesh.skin_quads), {
            "long_name": "corners of the skin's faces", **one}),
    }, coords={
        "layout": list(LAYOUTS), "component": ["x", "y", "z"],
        "frequency": ("frequency", list(FREQUENCIES), {"long_name": "excitation frequency", "units": "Hz"}),
        "phase": ("phase", phase, {"long_name": "phase of the second force before the first", "units": "degree"}),
        "checked_phase": ("checked_phase", list(CHECKED), {"long_name": "phase difference", "units": "degree"}),
        **{f"skin_{axis}": ("skin_node", mesh.nodes[mesh.skin_nodes, k], {
            "long_name": f"{axis} of a skin node", **metre}) for k, axis in enumerate("xyz")}},
        attrs={"force": FORCE, "fingertip": script.spoken(scene.body.fingertip)})


def _places(mesh) -> dict[str, int]:
    """Pad nodes about the fingerprint centroid, as near to their distance as the mesh allows."""
    centre, pad = mesh.fingerprint_centroid, mesh.pad_nodes
    x, y = mesh.nodes[centre, :2]
    found = {"centre": centre}
    for place, target in (("left", (x, y + APART)), ("proximal", (x - APART, y)), ("distal", (x + APART, y))):
        rest = np.setdiff1d(pad, list(found.values()))
        found[place] = int(rest[np.argmin(np.linalg.norm(mesh.nodes[rest, :2] - target, axis=1))])
    return found | {"right": int(mesh.mirror[found["left"]])}


def _cases(scene: LinearScene, places: dict[str, int], phase: np.ndarray) -> CaseArrays:
    """Every layout at every frequency and phase [degree], phases fastest."""
    def rows() -> Iterator[tuple[list[int], list[complex], float]]:
        for forces in LAYOUTS.values():
            loads = [scene.load_index(places[place], direction) for place, direction in forces]
            for f in FREQUENCIES:
                for angle in phase:
                    yield loads, [FORCE, FORCE * np.exp(1j * np.radians(angle))], f

    node, force, frequency = zip(*rows(), strict=True)
    return CaseArrays(np.array(node), np.array(force), np.array(frequency), np.full(len(frequency), LOSS_FACTOR))


def _power_given(force: np.ndarray, moved: np.ndarray, frequency: float) -> np.ndarray:
    """(n_case, n_force) ndarray [W]: (1/2) Re(conj(F) i omega u) with ``moved`` the patch's motion along the force."""
    return -np.pi * frequency * (force.conj() * moved).imag


# ---- what is read off the results ---------------------------------------------------------------------------

def _span(values: xr.DataArray) -> xr.DataArray:
    return values.max("phase") / values.min("phase")


def _largest(values: xr.DataArray) -> dict:
    """Where an array is largest, as a selection."""
    index = values.argmax(...)
    return {name: values[name].values[int(k)] for name, k in index.items()}


def findings(results: xr.Dataset) -> list[str]:
    """How far the phase decides displacement and power; who feeds whom; what travels; how exact it is."""
    sentences = []
    for layout in results["layout"].values:
        one = results.sel(layout=layout)
        at = _largest(_span(one["peak_displacement"]))
        curve = 1e6 * one["peak_displacement"].sel(at)
        power = _span(one["dissipated_power"])
        round_at = _largest(one["minor_axis"] / one["peak_displacement"])
        roundness = float((one["minor_axis"] / one["peak_displacement"]).sel(round_at))
        sentences.append(
            f"{str(layout).capitalize()}: at {at['frequency']:g} Hz the phase alone takes the fingerprint centroid "
            f"from {float(curve.min()):.0f} to {float(curve.max()):.0f} µm (largest at {float(curve.idxmax()):g}°); "
            + (f"the power lost varies most at {_largest(power)['frequency']:g} Hz, by a factor of "
               f"{float(power.max()):.2f}" if float(power.max()) > 1.001 else "the power lost does not depend on it")
            + f"; the centroid's path is roundest at {round_at['frequency']:g} Hz and {round_at['phase']:g}°, its axes "
            f"as 1 to {roundness:.2f}.")
    share = (results["input_power"] / results["alone_power"]).min("force")
    at = _largest(-share)
    fed = int((results["input_power"].min("force") < 0).isel(phase=slice(None, -1)).sum())
    total = share.isel(phase=slice(None, -1)).size
    sentences.append(
        f"In {fed} of {total} cases one force takes power out that the other put in, at most "
        f"{-float(share.sel(at)):.2f} times what it would put in alone ({at['layout']}, {at['frequency']:g} Hz, "
        f"{at['phase']:g}°)." if fed else
        f"In none of {total} cases does a force take power out that the other put in.")
    at = _largest(results["travelling_index"])
    least = float(results["travelling_index"].min())
    sentences.append(
        f"The pad's motion is closest to a travelling one with forces {at['layout']}, {at['frequency']:g} Hz, "
        f"{at['phase']:g}° (index {float(results['travelling_index'].sel(at)):.2f}; {least:.2f} at least; 0 stands, "
        "1 travels).")
    balance = float((np.abs(results["input_power"].sum("force") / results["dissipated_power"] - 1)).max())
    sentences.append(
        f"`modal-krylov` stays within {words.error(float(results['error'].max()))} of direct solves; the power put in "
        f"equals the power lost within {words.error(balance)}.")
    return sentences


def tables(results: xr.Dataset) -> list[str]:
    """Spans over the phase, by layout and frequency."""
    rows = []
    for layout in results["layout"].values:
        for f in results["frequency"].values:
            one = results.sel(layout=layout, frequency=f)
            curve, power = 1e6 * one["peak_displacement"], 1e6 * one["dissipated_power"]
            rows.append(("", [html.named(f"{layout}, {f:g} Hz"), *(html.cell(text) for text in (
                f"{float(curve.min()):.1f} to {float(curve.max()):.1f} µm", f"{float(curve.idxmax()):g}°",
                f"{float(power.min()):.1f} to {float(power.max()):.1f} µW", f"{float(power.idxmax()):g}°",
                f"{float((one['input_power'] / one['alone_power']).min()):.2f}",
                f"{float(one['travelling_index'].max()):.2f}", words.error(float(one["error"].max()))))]))
    return [html.table(
        f"Two forces of {results.attrs['force']:g} N: what their phase difference changes. A negative smallest share "
        "says that a force takes power out.",
        ["layout", "centroid's largest displacement", "most at", "power lost", "most at",
         "smallest power of a force over its own alone", "largest travelling index", "error"], rows)]


if __name__ == "__main__":
    script.run(main, draw, findings, "several-forces", tables=tables)
