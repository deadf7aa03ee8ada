"""Free and forced vibrations of the fingertip as they move: two animations and a scene to turn, for any browser.

The free modes have the rear free. The forced vibrations answer a force of 0.1 N over nine nodes at the fingerprint
centroid, loss factor 0.1, as published (Serhat and Kuchenbecker 2021, sections 4 and 5.3, videos S1 and S2).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import script
import xarray as xr
from presentation.animation import DRAWN_AS, Vibration, film
from presentation.interactive import write_interactive

from rom.fingertip import DIRECTIONS
from rom.fingertip.body import AXES
from rom.fullorder import SecondOrderModel
from rom.reporting import words
from rom.reporting.figure import Figure, sheet
from rom.reporting.skin import PALMAR, draw_skin

BELOW_HZ = 300.0
FREQUENCY = (50.0, 100.0, 150.0, 200.0, 250.0)
FORCE = 0.1
LOSS_FACTOR = 0.1
PHASES = (0, 30, 60, 90, 120, 150)
SCENE_FILE = "vibrations.html"


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How does the fingertip move in its free modes, and under forces at the fingerprint centroid?"""
    tip = script.fingertip(quick, "study")
    mesh = tip.mesh
    model = SecondOrderModel(tip.stiffness, tip.mass)
    modes = model.natural_modes(below_hz=BELOW_HZ)
    loads = np.stack([tip.patch_force(mesh.fingerprint_centroid, one) for one in DIRECTIONS], axis=1)
    forced = np.stack([_skin(tip, model.solve_harmonic(FORCE * loads, frequency, LOSS_FACTOR))
                       for frequency in progress(list(FREQUENCY), "frequencies")])
    axis = {"long_name": "component of the displacement"}
    results = xr.Dataset(
        {
            "mode_shape": (("mode", "skin_node", "component"), _skin(tip, modes.shape), {
                "long_name": "mass-orthonormal mode shape on the skin", "units": "kg-0.5"}),
            "natural_frequency": ("mode", modes.frequency_hz, {"long_name": "natural frequency", "units": "Hz"}),
            "displacement": (("frequency", "direction", "skin_node", "component"), forced, {
                "long_name": "complex amplitude of the displacement of the skin", "units": "m"}),
            "skin_quads": (("skin_quad", "corner"), mesh.skin_quads, {
                "long_name": "corners of the skin's quadrilaterals, rows of skin_node", "units": "1"}),
            **{f"skin_{name}": ("skin_node", mesh.nodes[mesh.skin_nodes, a], {"long_name": text, "units": "m"})
               for a, (name, text) in enumerate(zip("xyz", AXES, strict=True))},
        },
        coords={
            "mode": ("mode", 1 + np.arange(len(modes.frequency_hz)), {"long_name": "mode", "units": "1"}),
            "frequency": ("frequency", list(FREQUENCY), {"long_name": "excitation frequency", "units": "Hz"}),
            "direction": ("direction", list(DIRECTIONS), {"long_name": "direction of the force on the skin"}),
            "component": ("component", list("xyz"), axis)},
        attrs={"force_n": FORCE, "loss_factor": LOSS_FACTOR, "below_hz": BELOW_HZ})
    results["out_of_phase"] = (("frequency", "direction"), out_of_phase(forced), {
        "long_name": "share of the skin's mean square displacement out of phase with the rest", "units": "1"})
    return results


def _skin(tip, values: np.ndarray) -> np.ndarray:
    """(k, n_skin, 3) ndarray from (n_free, k)."""
    full = np.zeros((values.shape[1], 3 * tip.mesh.n_nodes), dtype=values.dtype)
    full[:, tip.free_dofs] = values.T
    return full.reshape(len(full), -1, 3)[:, tip.mesh.skin_nodes]


def out_of_phase(amplitude: np.ndarray) -> np.ndarray:
    """Share of the mean square motion that no single phase explains: 0 for a standing wave, 1/2 for a travelling one.

    Parameters
    ----------
    amplitude : (..., n, 3) ndarray, complex

    Returns
    -------
    (...) ndarray
        With the phase factor that makes the in-phase part largest, |Im|^2 / |u|^2 = (1 - |sum u^2| / sum |u|^2) / 2.
    """
    total = np.sum(np.abs(amplitude) ** 2, axis=(-2, -1))
    return (1 - np.abs(np.sum(amplitude**2, axis=(-2, -1))) / total) / 2


def findings(results: xr.Dataset) -> list[str]:
    """How many modes, what moves most, and whether it moves in unison."""
    frequency = results["natural_frequency"].values
    share = results["out_of_phase"]
    size = _largest(results)
    f, d = np.unravel_index(size.argmax(), size.shape)
    g, e = np.unravel_index(share.values.argmax(), share.shape)
    h, k = np.unravel_index(share.values.argmin(), share.shape)
    hertz, way = results["frequency"].values, results["direction"].values
    return [
        f"{words.plural(len(frequency), 'free mode')} lie below {results.attrs['below_hz']:g} Hz, from "
        f"{frequency[0]:.1f} to {frequency[-1]:.1f} Hz.",
        f"Under {results.attrs['force_n']:g} N the skin moves most with {way[d]} force at {hertz[f]:g} Hz: "
        f"{words.significant(size[f, d] * 1e3, 2)} mm.",
        f"Damping makes forced motion travel: with {way[e]} force at {hertz[g]:g} Hz "
        f"{words.error(share.values[g, e])} of the skin's mean square displacement is out of phase with the rest; "
        f"least, {words.error(share.values[h, k])}, with {way[k]} force at {hertz[h]:g} Hz."]


def _largest(results: xr.Dataset) -> np.ndarray:
    """(frequency, direction) ndarray [m]: the largest displacement amplitude of the skin."""
    return np.linalg.norm(np.abs(results["displacement"].values), axis=-1).max(axis=-1)


def _surface(results: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    position = np.column_stack([results[f"skin_{name}"].values for name in "xyz"]) * 1e3
    return position, results["skin_quads"].values.astype(int)


def free_modes(results: xr.Dataset) -> list[Vibration]:
    """All modes, by frequency."""
    shapes = results["mode_shape"].transpose("mode", "skin_node", "component").values
    return [Vibration(f"Mode {number}, {frequency:.1f} Hz", shape, "Free modes") for number, frequency, shape in
            zip(results["mode"].values, results["natural_frequency"].values, shapes, strict=True)]


def forced_cases(results: xr.Dataset) -> list[Vibration]:
    """All forced cases, direction by direction."""
    values = results["displacement"].transpose("direction", "frequency", "skin_node", "component").values
    return [Vibration(f"{direction}, {frequency:g} Hz", values[d, f], f"Forced by {results.attrs['force_n']:g} N")
            for d, direction in enumerate(results["direction"].values)
            for f, frequency in enumerate(results["frequency"].values)]


def draw(results: xr.Dataset) -> list[Figure]:
    """Both animations, and the cases that are farthest from a standing wave, phase by phase."""
    surface = _surface(results)
    free, forced = free_modes(results), forced_cases(results)
    scale = f"The largest displacement of each panel is drawn as {DRAWN_AS:g} mm."
    return [
        film("free-modes.gif", *surface, free,
             title=f"The {words.plural(len(free), 'free mode')} below {results.attrs['below_hz']:g} Hz, in step",
             caption=f"One cycle of each free mode, seen from the pad's side, rear free. {scale}",
             alt="Animation of the free vibration modes of the fingertip"),
        film("forced-vibrations.gif", *surface, forced, columns=results.sizes["frequency"],
             title=f"Under {results.attrs['force_n']:g} N the motion is largest with "
                   + forced[int(np.argmax([one.size.max() for one in forced]))].title,
             caption="One cycle under a force at the fingerprint centroid, rows by direction, columns by frequency. "
                     "The force is at its largest where the animation begins. " + scale,
             alt="Animation of forced vibrations in three directions at five frequencies"),
        _film_strip(results, surface)]


def _film_strip(results: xr.Dataset, surface: tuple[np.ndarray, np.ndarray]) -> Figure:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    position, quads = surface
    share = results["out_of_phase"].transpose("direction", "frequency").values
    most = share.argmax(axis=1)
    best = int(share.max(axis=1).argmax())
    names, hertz = results["direction"].values, results["frequency"].values
    unison = "moves almost" if share.max() < 0.01 else "does not move"
    figure = sheet(1.8 * len(names) + 1.2, f"The skin {unison} in unison: with {names[best]} force at "
                   f"{hertz[most[best]]:g} Hz {words.error(share.max())} of its mean square displacement is out "
                   "of phase with the rest")
    bands = figure.subfigures(len(names) + 1, 1, height_ratios=[1.0] * len(names) + [0.4])
    for row, (name, column) in enumerate(zip(names, most, strict=True)):
        u = results["displacement"].sel(direction=name).isel(frequency=column).values
        one = Vibration(name, u)
        bands[row].suptitle(f"{name} force, {hertz[column]:g} Hz: {words.error(share[row, column])} out of phase",
                            fontsize=10, x=0.01, ha="left")
        panels = bands[row].subplots(1, len(PHASES), subplot_kw={"projection": "3d"})
        for axes, phase in zip(panels, PHASES, strict=True):
            now = one.at(np.radians(phase)) / one.size.max()
            draw_skin(axes, position + DRAWN_AS * now, quads,
                      colormaps["viridis"](np.linalg.norm(now, axis=1)[quads].mean(axis=1)), view=PALMAR)
            axes.set_box_aspect(np.ptp(position, axis=0), zoom=1.2)
            axes.set_title(f"{phase}°", fontsize=9, y=0.93)
    figure.colorbar(ScalarMappable(Normalize(0, 1), "viridis"), cax=bands[-1].add_axes((0.2, 0.7, 0.6, 0.17)),
                    orientation="horizontal").set_label(
        "displacement at that phase / largest amplitude [-]", fontsize=9)
    return Figure("half-a-cycle.png", figure,
                  "For each direction the frequency at which most of the motion is out of phase, at six phases of half "
                  "a cycle (0° where the force is largest; the other half is the same with opposite signs). A standing "
                  "wave would keep one pattern and only fade. The largest amplitude of a row is drawn as "
                  f"{DRAWN_AS:g} mm.",
                  "Skin of the fingertip at six phases of half a cycle under forces in three directions")


def extra(results: xr.Dataset, folder: Path) -> list[Path]:
    """The scene to turn and play."""
    return [write_interactive(
        folder / SCENE_FILE, *_surface(results), [*free_modes(results), *forced_cases(results)],
        title="Vibrations of the fingertip",
        explanation=f"Free modes below {results.attrs['below_hz']:g} Hz, and the answer to "
                    f"{results.attrs['force_n']:g} N at the fingerprint centroid, loss factor "
                    f"{results.attrs['loss_factor']:g}. Drag to turn, scroll to zoom.")]


if __name__ == "__main__":
    script.run(main, draw, findings, "animations", extra=extra)
