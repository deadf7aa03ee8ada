"""Shapes in which the fingertip vibrates under a force on its pad, and where it moves most.

As published (Serhat and Kuchenbecker 2021, section 5): 0.1 N over nine nodes about the fingerprint centroid, three
directions, loss factor 0.1. Amplitudes are ``sqrt(|u_x|^2 + |u_y|^2 + |u_z|^2)`` at a node.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import script
import xarray as xr
from analysis.motion import at_largest_motion
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize

from rom.datasets import read_dataset, solve_dataset
from rom.fingertip import DIRECTIONS
from rom.metamodels import create
from rom.relative import relative_errors
from rom.reporting import html, words
from rom.reporting.figure import Figure, sheet
from rom.reporting.skin import draw_skin
from rom.scenes import get_scene
from rom.vibration.frequency_response import magnitudes, moving_nodes, sweep_cases
from rom.vibration.published import published

FREQUENCIES = (0.0, 50.0, 100.0, 150.0, 200.0, 250.0)
FORCE = 0.1
SETTINGS = {"modes": 12, "vectors": 10}
NEAR = 1.5
"""Diagonals of the loaded patch within which the largest displacement counts as lying at the load."""
DRAWN_AS = 2.0
"""Length [mm] to which the largest displacement of a panel is drawn."""


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """In which shapes does the fingertip vibrate, and where does it move most?"""
    away = published()["digitip"]["frequency_response"]["largest_away_from_load_hz"]
    scene = get_scene("harmonic-patch-forces", script.fingertip(quick, "study"))
    mesh, moving = scene.body.fingertip.mesh, moving_nodes(scene)
    cases = sweep_cases(scene, FREQUENCIES, amplitude=FORCE)
    truth = scene.values(read_dataset(solve_dataset(
        scene, cases, progress=lambda items: progress(items, "direct solves"))))
    field = create("modal-krylov", scene, **SETTINGS).fit().evaluate(cases, "field")
    size = magnitudes(field)
    centre = int(scene.loads.labels["load_node"][0])
    patch = mesh.skin_patch(centre)
    corners = mesh.nodes[patch]
    diagonal = np.linalg.norm(corners[:, None] - corners, axis=2).max()
    distance = np.linalg.norm(mesh.nodes[moving] - mesh.nodes[centre], axis=1)
    near = distance <= NEAR * diagonal

    def table(values: np.ndarray, name: str, unit: str) -> tuple:
        return ("direction", "frequency"), values.reshape(len(FREQUENCIES), -1).T, {"long_name": name, "units": unit}

    skin = scene.whole(field)[:, mesh.skin_nodes].reshape(len(FREQUENCIES), len(DIRECTIONS), -1, 3)
    return xr.Dataset({
        "displacement": (("direction", "frequency", "skin_node", "component"), skin.transpose(1, 0, 2, 3), {
            "long_name": "displacement amplitude of the skin", "units": "m"}),
        "largest_displacement": table(size.max(axis=1), "largest displacement amplitude of any node", "m"),
        "largest_distance": table(distance[size.argmax(axis=1)], "distance of that node from the patch's centre", "m"),
        "far_over_near": table(size[:, ~near].max(axis=1) / size[:, near].max(axis=1),
                               f"largest amplitude beyond {NEAR:g} patch diagonals over the largest within", "1"),
        "published_away": table(np.array([f in away[d] for f in FREQUENCIES for d in DIRECTIONS], dtype=np.int8),
                                "whether the published study sees it away from the load", "1"),
        "error": table(relative_errors(field, truth), "relative error of the field against the direct solve", "1"),
        "node_error": table(magnitudes(field - truth).max(axis=1) / magnitudes(truth).max(axis=1),
                            "largest error at any node over the largest displacement", "1"),
        "patch_diagonal": ((), diagonal, {"long_name": "diagonal of the loaded patch", "units": "m"}),
        "loaded": ("patch_node", np.searchsorted(mesh.skin_nodes, patch), {
            "long_name": "loaded skin nodes", "units": "1"}),
        "skin_quads": (("quad", "corner"), np.searchsorted(mesh.skin_nodes, mesh.skin_quads), {
            "long_name": "corners of the skin's faces", "units": "1"}),
    }, coords={
        "direction": list(DIRECTIONS), "frequency": ("frequency", list(FREQUENCIES), {
            "long_name": "excitation frequency", "units": "Hz"}), "component": ["x", "y", "z"],
        **{f"skin_{axis}": ("skin_node", mesh.nodes[mesh.skin_nodes, k], {
            "long_name": f"{axis} of a skin node", "units": "m"}) for k, axis in enumerate("xyz")}},
        attrs={"force": FORCE, "fingertip": script.spoken(scene.body.fingertip)})


# ---- what is read off the results ---------------------------------------------------------------------------

def _away(results: xr.Dataset) -> xr.DataArray:
    return results["largest_distance"] > NEAR * results["patch_diagonal"]


def findings(results: xr.Dataset) -> list[str]:
    """Whether the largest displacement lies where the published study sees it; how large; how exact."""
    found, published = _away(results), results["published_away"] == 1
    agree = found == published
    total = agree.size
    differ = []
    for direction in DIRECTIONS:
        for f in FREQUENCIES:
            one = {"direction": direction, "frequency": f}
            if not bool(agree.sel(one)):
                differ.append(f"{direction} {f:g} Hz ({'away' if bool(found.sel(one)) else 'at the load'}, "
                              f"far over near {float(results['far_over_near'].sel(one)):.2f})")
    largest = results["largest_displacement"]
    top = largest.where(largest == largest.max(), drop=True)
    return [
        f"The largest displacement lies where the published study sees it in {int(agree.sum())} of {total} cases"
        + (f"; otherwise in: {'; '.join(differ)}." if differ else "."),
        f"It lies away from the load (beyond {NEAR:g} diagonals of the patch, "
        f"{1e3 * NEAR * float(results['patch_diagonal']):.1f} mm) for " + (words.listed([
            f"{direction} " + words.listed([f"{f:g}" for f in FREQUENCIES
                                            if bool(found.sel(direction=direction, frequency=f))]) + " Hz"
            for direction in DIRECTIONS if bool(found.sel(direction=direction).any())]) or "no case") + ".",
        f"{results.attrs['force']:g} N moves some node by {1e3 * float(largest.min()):.2f} to "
        f"{1e3 * float(largest.max()):.2f} mm; most under {top['direction'].values[0]} force at "
        f"{float(top['frequency'][0]):g} Hz.",
        f"`modal-krylov` answers these cases within {words.error(float(results['error'].max()))} of direct solves, "
        f"within {words.error(float(results['node_error'].max()))} at the worst node.",
    ]


def tables(results: xr.Dataset) -> list[str]:
    """Found against published, case by case."""
    rows = []
    for direction in DIRECTIONS:
        for f in FREQUENCIES:
            one = results.sel(direction=direction, frequency=f)
            away = _away(one)
            published = bool(one["published_away"])
            rows.append(("", [html.named(f"{direction}, {f:g} Hz"), *(html.cell(text) for text in (
                f"{1e3 * float(one['largest_displacement']):.3f} mm", f"{1e3 * float(one['largest_distance']):.1f} mm",
                f"{float(one['far_over_near']):.2f}", "away" if bool(away) else "at the load",
                "away" if published else "at the load")), html.cell(
                    "yes" if bool(away) == published else "no", kind="pass" if bool(away) == published else "fail"),
                html.cell(words.error(float(one["error"])))]))
    return [html.table(
        f"Where the largest displacement lies: at the load within {NEAR:g} diagonals of the patch. Far over near is "
        "the largest amplitude beyond that distance over the largest within; near one the answer is a matter of the "
        "measure.",
        ["force", "largest", "distance", "far over near", "found", "published", "agree", "error"], rows)]


# ---- figures ------------------------------------------------------------------------------------------------

def draw(results: xr.Dataset) -> list[Figure]:
    """The same shapes by relative and by absolute displacement."""
    agree = int((_away(results) == (results["published_away"] == 1)).sum())
    largest = 1e6 * results["largest_displacement"]
    spread = largest.max("frequency") / largest.sel(frequency=0.0)
    title = f"The largest displacement lies where it was published in {agree} of {largest.size} cases"
    relative = _sheet(results, title, largest, Normalize(0.0, 1.0), "displacement over the case's largest [-]",
                      scaled=True)
    high = 10 ** np.ceil(np.log10(float(largest.max())))
    title = "Of these frequencies the best moves the fingertip " + words.listed([
        f"{float(spread.sel(direction=name)):.1f} times ({name})" for name in DIRECTIONS]) + " as far as a steady force"
    absolute = _sheet(results, title, largest, LogNorm(high / 1e2, high), "displacement [µm], one scale for all",
                      scaled=False)
    force = results.attrs["force"]
    return [Figure("relative.png", relative, f"Displacement amplitude of the skin under {force:g} N, each panel by its "
                   "own largest, drawn at the phase of largest motion, exaggerated to 2 mm; seen from the pad's side, "
                   "the tip to the right. Black dot: centre of the load. Below each panel: its largest displacement of "
                   "any node and where it lies.", "Skin coloured by relative displacement over direction and "
                   "frequency"),
            Figure("absolute.png", absolute, f"The same under {force:g} N on one logarithmic scale, undeformed.",
                   "Skin coloured by absolute displacement over direction and frequency")]


def _sheet(results: xr.Dataset, title: str, largest: xr.DataArray, norm, label: str, scaled: bool):
    rest = 1e3 * np.stack([results[f"skin_{axis}"].values for axis in "xyz"], axis=1)
    quads = results["skin_quads"].values
    loaded = results["loaded"].values
    centre = loaded[np.argmin(np.linalg.norm(rest[loaded] - rest[loaded].mean(axis=0), axis=1))]
    away = _away(results)
    figure = sheet(5.6, title)
    grid = figure.subplots(len(DIRECTIONS), len(FREQUENCIES), subplot_kw={"projection": "3d"})
    for (i, j), panel in np.ndenumerate(grid):
        where: dict[str, Any] = {"direction": i, "frequency": j}
        field = 1e6 * results["displacement"].isel(where).values
        most = float(largest.isel(where))
        size = np.linalg.norm(field, axis=1)
        moved = at_largest_motion(field[None])[0] / most
        colours = colormaps["viridis"](norm((size / most if scaled else size)[quads].mean(axis=1)))
        draw_skin(panel, rest + (DRAWN_AS * moved if scaled else 0.0), quads, colours, marks=np.array([centre]))
        panel.set_box_aspect(np.ptp(rest, axis=0), zoom=1.22)  # six in a row
        panel.text2D(0.5, 0.0, f"{most:,.0f} µm, {'away' if bool(away.isel(where)) else 'at load'}",
                     transform=panel.transAxes, ha="center", fontsize=8)
        if i == 0:
            panel.set_title(f"{FREQUENCIES[j]:g} Hz", fontsize=10, y=0.94)
        if j == 0:
            panel.text2D(-0.1, 0.5, DIRECTIONS[i], transform=panel.transAxes, rotation=90, va="center", ha="center",
                         fontsize=10)
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), ax=grid, location="bottom", shrink=0.5, aspect=45, pad=0.03)
    bar.set_label(label, fontsize=9)
    return figure


if __name__ == "__main__":
    script.run(main, draw, findings, "forced-shapes", tables=tables)
