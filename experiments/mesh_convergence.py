"""Natural frequencies over mesh density: the published convergence study, taken on to finer meshes, both formulations.

Modes are followed by parity and MAC from mesh to mesh, outwards from the `study` mesh, whose numbers they keep. Each
rung is computed in a process of its own, which shows its peak of memory, and kept in the cache: a run that was stopped
goes on where it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import script
import xarray as xr
from analysis.convergence import extrapolate
from analysis.mesh_ladder import LADDER, QUICK_LADDER, modes_on
from analysis.mode_pairing import pair_modes
from presentation.mesh_convergence import (
    FITTED,
    STUDIED,
    convergence_figures,
    convergence_findings,
    convergence_tables,
)

from rom.fingertip import PRESETS, Fingertip, MeshDensity
from rom.reporting.figure import Figure
from rom.vibration.published import published, published_frequencies

FORMULATIONS = ("full", "b-bar")
FOLLOWED = 8
COUNT = 12  # computed on each mesh, so that a mode that changes its rank is still there
ONE = {"units": "1"}


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How fine must the mesh be: do the natural frequencies of the study's mesh change on finer ones?"""
    ladder = QUICK_LADDER if quick else LADDER
    home = ladder.index(PRESETS["study"]) if PRESETS["study"] in ladder else len(ladder) - 1
    reference = ladder[min(2, home)]
    rungs = [(name, density) for density in ladder for name in FORMULATIONS]  # small meshes first
    found: dict[str, list[xr.Dataset]] = {name: [] for name in FORMULATIONS}
    for name, density in progress(rungs, "meshes"):
        found[name].append(modes_on(Fingertip(density=density, formulation=name), reference, COUNT))
    results = _follow(found, Fingertip(density=reference), home)
    nodes = results["nodes"].values
    _extrapolate(results, nodes ** (-1 / 3))
    printed = published_frequencies()
    results["published_frequency"] = ("mode", [printed.get(k, np.nan) for k in range(1, FOLLOWED + 1)], {
        "long_name": "published natural frequency", "units": "Hz"})
    results.attrs = {"published_nodes": published()["digitip"]["n_nodes"], "home": home, "studied": STUDIED,
                     "ladder": "; ".join(_spelled(density) for density in ladder)}
    return results


def _spelled(density: MeshDensity) -> str:
    a, b = density.cap
    layers = "+".join(map(str, density.layers))
    return f"{a} x {b} cap, {density.front_rings} + {density.rear_rings} rings, {layers} layers"


def _follow(found: dict[str, list[xr.Dataset]], reference: Fingertip, home: int) -> xr.Dataset:
    """Frequencies of the same mode on every mesh, and the MAC from each mesh to its neighbour."""
    steps = len(found[FORMULATIONS[0]])
    frequency, mac = np.full((2, len(FORMULATIONS), steps, FOLLOWED), np.nan)
    start = found[FORMULATIONS[0]][home].isel(mode=slice(FOLLOWED))
    for i, name in enumerate(FORMULATIONS):
        rungs = found[name]
        for order in (range(home, -1, -1), range(home, steps)):
            last = start
            for step in order:
                partner, alike = _pair(last, rungs[step], replace(reference, formulation=name))
                last = rungs[step].isel(mode=partner)
                frequency[i, step], mac[i, step] = last["natural_frequency"].values, alike
    sizes = {name: found[FORMULATIONS[0]][0][name].attrs for name in ("nodes", "elements", "free_dofs")}
    results = xr.Dataset({
        "natural_frequency": (("formulation", "step", "mode"), frequency, {
            "long_name": "natural frequency of the followed mode", "units": "Hz"}),
        "mac": (("formulation", "step", "mode"), mac, {
            "long_name": "mass-weighted MAC with the same mode on the neighbouring mesh towards the study's", **ONE})},
        coords={"formulation": ("formulation", np.array(FORMULATIONS, dtype=object), {
            "long_name": "element formulation", **ONE}),
            "mode": ("mode", np.arange(1, FOLLOWED + 1), {"long_name": "mode number on the study's mesh", **ONE})})
    for name, attributes in sizes.items():
        results[name] = ("step", [int(rung[name]) for rung in found[FORMULATIONS[0]]], attributes)
    for name, long_name in (("volume", "deformable tissue"),
                            ("nail_volume", "nail plate, whose edge follows elements")):
        results[name] = ("step", [1e9 * float(rung[name]) for rung in found[FORMULATIONS[0]]],
                         {"long_name": f"volume of {long_name}", "units": "mm3"})
    for name, units in (("seconds", "s"), ("peak_memory", "byte")):
        results[name] = (("formulation", "step"), [[float(r[name]) for r in found[f]] for f in FORMULATIONS], {
            "long_name": {"seconds": "time of meshing, assembly, modes and Sturm count",
                          "peak_memory": "largest resident memory of the process"}[name], "units": units})
    return results


def _pair(last: xr.Dataset, rung: xr.Dataset, reference: Fingertip) -> tuple[np.ndarray, np.ndarray]:
    pairs = pair_modes(last["shape"].values.T.astype(float), rung["shape"].values.T.astype(float), reference.mass,
                       parity=last["parity"].values, other_parity=rung["parity"].values)
    return pairs.partner, pairs.mac


def _extrapolate(results: xr.Dataset, width: np.ndarray) -> None:
    """Limits and observed orders from the finest meshes."""
    frequency = results["natural_frequency"].values
    shape = (len(FORMULATIONS), FOLLOWED)
    limit, order, second = np.empty((3, *shape))
    last = slice(-min(FITTED, len(width)), None)
    for i, k in np.ndindex(shape):
        free = extrapolate(width[last], frequency[i, last, k])
        limit[i, k], order[i, k] = free.limit if np.isfinite(free.order) else np.nan, free.order
        second[i, k] = extrapolate(width[last], frequency[i, last, k], order=2).limit
    for name, values, long_name, units in (
            ("observed_order", order, "order of convergence in h = N^(-1/3), least squares on the finest meshes", "1"),
            ("limit", limit, "limit at the observed order", "Hz"),
            ("limit_second_order", second, "limit at order 2, that of the element", "Hz")):
        results[name] = (("formulation", "mode"), values, {"long_name": long_name, "units": units})
    change = np.full(frequency.shape, np.nan)
    change[:, 1:] = frequency[:, 1:] / frequency[:, :-1] - 1
    results["change"] = (("formulation", "step", "mode"), change, {
        "long_name": "relative change from the coarser mesh", **ONE})


def findings(results: xr.Dataset) -> list[str]:
    """Where the published criterion is met, what is left at the study's mesh, which orders show."""
    return convergence_findings(results)


def draw(results: xr.Dataset) -> list[Figure]:
    """Frequencies over nodes, changes against the criterion, distance from the limit, cost."""
    return convergence_figures(results)


def tables(results: xr.Dataset) -> list[str]:
    """Frequencies mesh by mesh, limits and orders, the ladder."""
    return convergence_tables(results)


if __name__ == "__main__":
    script.run(main, draw, findings, "mesh-convergence", tables=tables)
